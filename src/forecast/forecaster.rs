//! One forecast for each track, by the configured method.

use std::collections::VecDeque;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::lstm::OBSERVED_DISPLACEMENTS;
use super::{Forecast, Gaussian2, Residual, Weights, constant_velocity};
use crate::config::{ForecastConfig, ForecastMethod, Mechanism, Rollout};
use crate::geometry::DVec2;
use crate::track::{OBSERVED, Observed, Track};
use crate::{Error, STEP_NS};

/// Foresees.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let config = umbracast::Config::default();
/// # let tracks = walker();
/// use umbracast::forecast::Forecaster;
///
/// let (mut forecaster, mut forecasts) = (Forecaster::new(&config.forecast, None)?, Vec::new());
/// forecaster.forecast(&tracks, &mut forecasts);
/// assert_eq!((forecasts.len(), forecasts[0].track), (1, tracks[0].id));
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Forecaster {
    rollout: Rollout,
    seed: u64,
    network: Network,
}

/// What the method needs.
#[derive(Debug, Clone)]
enum Network {
    None,
    Residual { residual: Residual, neighbours: bool },
    Lstm(Weights),
}

impl Forecaster {
    /// `weights` are needed by the method `lstm` only.
    ///
    /// ```
    /// use umbracast::{Config, Mode, forecast::Forecaster};
    ///
    /// assert!(Forecaster::new(&Config::for_mode(Mode::Default).forecast, None).is_ok());
    /// let error = Forecaster::new(&Config::for_mode(Mode::Paper).forecast, None).unwrap_err();
    /// assert!(error.to_string().contains("expected its weights"));
    /// ```
    ///
    /// # Errors
    /// The method needs weights and there are none.
    pub fn new(config: &ForecastConfig, weights: Option<&Weights>) -> Result<Self, Error> {
        let without = |mechanism| config.without.contains(&mechanism);
        let network = match (config.method, weights) {
            (ForecastMethod::ConstantVelocity, _) => Network::None,
            (ForecastMethod::Residual, _) => {
                let residual = match without(Mechanism::ResidualDeparture) {
                    true => Residual::shipped()?.believing(0.0),
                    false => Residual::shipped()?,
                };
                Network::Residual { residual, neighbours: !without(Mechanism::ResidualNeighbours) }
            }
            (ForecastMethod::Lstm, Some(weights)) => Network::Lstm(weights.clone()),
            (ForecastMethod::Lstm, None) => {
                return Err(Error::new("forecast.method = \"lstm\": expected its weights, found none"));
            }
        };
        Ok(Self { rollout: config.rollout, seed: config.seed, network })
    }

    /// One forecast for each track, in the order of the tracks.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// # let tracks = walker();
    /// use umbracast::forecast::Forecaster;
    ///
    /// let mut forecasts = Vec::new();
    /// Forecaster::new(&config.forecast, None)?.forecast(&tracks, &mut forecasts);
    /// // The farther ahead, the less is known.
    /// assert!(forecasts[0].steps[8].xx_m2 > forecasts[0].steps[0].xx_m2);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn forecast(&mut self, tracks: &[Track], forecasts: &mut Vec<Forecast>) {
        forecasts.clear();
        if let Network::Residual { residual, neighbours } = &self.network {
            forecasts.extend((0..tracks.len()).map(|i| match neighbours {
                true => residual.forecast(tracks, i),
                false => residual.forecast(&tracks[i..=i], 0),
            }));
            return;
        }
        forecasts.extend(tracks.iter().map(constant_velocity::forecast));
        if let Network::Lstm(weights) = &self.network {
            self.by_lstm(weights, tracks, forecasts);
        }
    }

    /// Replaces the steps of those tracks whose observation window is full.
    fn by_lstm(&self, weights: &Weights, tracks: &[Track], forecasts: &mut [Forecast]) {
        let (mut full, mut observed_m, mut generators) = (Vec::new(), Vec::new(), Vec::new());
        for (i, track) in tracks.iter().enumerate() {
            if let Some(displacements) = displacements_m(&track.observed) {
                full.push(i);
                observed_m.push(displacements);
                generators.push(generator(self.seed, track));
            }
        }
        let mut walked_m = Vec::new();
        walked_m.resize_with(full.len(), Vec::new);
        let foreseen = weights.roll_out(&observed_m, |person, displacement| {
            // Eq. (3) draws v; the mean, which TrajNet++ evaluates with, errs less.
            let v = match self.rollout {
                Rollout::Mean => displacement.mean_m,
                Rollout::Draw => draw(displacement, &mut generators[person]),
            };
            walked_m[person].push(v);
            v
        });
        for ((&i, foreseen), walked_m) in full.iter().zip(&foreseen).zip(&walked_m) {
            let mut position =
                Gaussian2 { mean_m: tracks[i].observed[OBSERVED - 1].position_m, ..Gaussian2::default() };
            for ((step, displacement), &v) in forecasts[i].steps.iter_mut().zip(foreseen).zip(walked_m) {
                position = moved(&position, v, displacement);
                *step = position;
            }
        }
    }
}

/// Eq. (3): x' = x + v. Each v is drawn by itself, so that the covariances of the displacements add up.
fn moved(position: &Gaussian2, v: DVec2, displacement: &Gaussian2) -> Gaussian2 {
    Gaussian2 {
        mean_m: position.mean_m + v,
        xx_m2: position.xx_m2 + displacement.xx_m2,
        xy_m2: position.xy_m2 + displacement.xy_m2,
        yy_m2: position.yy_m2 + displacement.yy_m2,
    }
}

/// Metres a frame of 100 ms, oldest first, whatever the time between the positions was. `None` while there are
/// fewer than ten of them, or when their times do not rise.
fn displacements_m(observed: &VecDeque<Observed>) -> Option<[DVec2; OBSERVED_DISPLACEMENTS]> {
    let mut displacements = [DVec2::ZERO; OBSERVED_DISPLACEMENTS];
    if observed.len() != OBSERVED {
        return None;
    }
    for (i, displacement) in displacements.iter_mut().enumerate() {
        let (from, to) = (&observed[i], &observed[i + 1]);
        if to.time_ns <= from.time_ns {
            return None;
        }
        let per_frame = STEP_NS as f64 / (to.time_ns - from.time_ns) as f64;
        *displacement = (to.position_m - from.position_m) * per_frame;
    }
    Some(displacements)
}

/// A draw depends on the seed, the track and the frame alone: neither on the other tracks nor on the frames
/// before.
fn generator(seed: u64, track: &Track) -> Pcg64 {
    let time_ns = track.observed.back().map_or(0, |last| last.time_ns);
    let key = [seed, track.id, time_ns as u64].into_iter().fold(0, |key, word| mixed(key ^ word));
    Pcg64::seed_from_u64(key)
}

/// Every bit of the result depends on every bit of the word (SplitMix64).
fn mixed(word: u64) -> u64 {
    let word = word.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    word ^ (word >> 31)
}

fn draw(displacement: &Gaussian2, generator: &mut Pcg64) -> DVec2 {
    let (a, b): (f64, f64) = (StandardNormal.sample(generator), StandardNormal.sample(generator));
    // Cholesky: x = l_xx a, y = l_xy a + l_yy b.
    let l_xx = displacement.xx_m2.sqrt();
    let l_xy = displacement.xy_m2 / l_xx;
    let l_yy = (displacement.yy_m2 - l_xy * l_xy).max(0.0).sqrt();
    displacement.mean_m + DVec2::new(l_xx * a, l_xy * a + l_yy * b)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::Config;
    use crate::forecast::lstm::tests::small_network;
    use crate::geometry::{Aabb, DMat3, DVec3, Obb};

    fn seen(time_ns: i64, position_m: DVec2) -> Observed {
        Observed { time_ns, position_m, velocity_mps: DVec2::X }
    }

    /// A track that has walked along `way_m` up to and with frame `frame`.
    pub(in crate::forecast) fn track(id: u64, way_m: &[DVec2], frame: usize) -> Track {
        let observed = (frame.saturating_sub(OBSERVED - 1)..=frame)
            .map(|k| seen((k as i64 + 1) * STEP_NS, way_m[k]))
            .collect::<VecDeque<_>>();
        Track {
            id,
            position_m: way_m[frame],
            velocity_mps: DVec2::new(1.0, 0.0),
            covariance: [[0.01; 4]; 4],
            heading_rad: 0.0,
            heading_sigma_rad: 0.0,
            heading_behind: 0.0,
            height_m: 1.75,
            height_sigma_m: 0.0,
            width_scale: 1.0,
            width_scale_sigma: 0.0,
            outline_m: Default::default(),
            canopy: None,
            gait: crate::gait::Gait::UNKNOWN,
            points: 30,
            confirmed: true,
            part_of: None,
            aabb: Aabb { min_m: DVec3::ZERO, max_m: DVec3::ONE },
            obb: Obb { center_m: DVec3::ZERO, half_m: DVec3::ONE, site_from_box: DMat3::IDENTITY },
            observed,
        }
    }

    fn way() -> Vec<DVec2> {
        (0..30).map(|k| DVec2::new(0.1 * f64::from(k), (0.3 * f64::from(k)).sin() * 0.2)).collect()
    }

    fn forecaster(method: ForecastMethod, rollout: Rollout, seed: u64) -> Forecaster {
        let config = ForecastConfig { method, rollout, seed, ..Config::default().forecast };
        let weights = Weights::from_safetensors(&small_network()).unwrap();
        Forecaster::new(&config, Some(&weights)).unwrap()
    }

    fn forecasts(forecaster: &mut Forecaster, tracks: &[Track]) -> Vec<Forecast> {
        let mut forecasts = Vec::new();
        forecaster.forecast(tracks, &mut forecasts);
        forecasts
    }

    #[test]
    fn a_draw_depends_on_seed_track_and_frame_alone() {
        let way = way();
        let mut one = forecaster(ForecastMethod::Lstm, Rollout::Draw, 1);
        let alone = forecasts(&mut one, &[track(7, &way, 15)]);
        forecasts(&mut one, &[track(7, &way, 16)]);
        let among_others = forecasts(&mut one, &[track(3, &way, 15), track(7, &way, 15), track(9, &way, 15)]);
        assert_eq!(alone[0], among_others[1]);
        assert_ne!(among_others[0].steps, among_others[1].steps);
        let later = Track { observed: track(7, &way, 15).observed, ..track(7, &way, 15) };
        let shifted =
            later.observed.iter().map(|o| Observed { time_ns: o.time_ns + STEP_NS, ..*o }).collect();
        assert_ne!(alone[0].steps, forecasts(&mut one, &[Track { observed: shifted, ..later }])[0].steps);
        let mut two = forecaster(ForecastMethod::Lstm, Rollout::Draw, 2);
        assert_ne!(alone[0].steps, forecasts(&mut two, &[track(7, &way, 15)])[0].steps);
    }

    #[test]
    fn the_mean_of_many_draws_is_the_mean_of_the_first_step() {
        let way = way();
        let mean = forecasts(&mut forecaster(ForecastMethod::Lstm, Rollout::Mean, 1), &[track(1, &way, 15)]);
        let tracks: Vec<Track> = (0..4000).map(|id| track(id, &way, 15)).collect();
        let draws = forecasts(&mut forecaster(ForecastMethod::Lstm, Rollout::Draw, 1), &tracks);
        let (first, n) = (mean[0].steps[0], draws.len() as f64);
        let (mut center, mut xy) = (DVec2::ZERO, 0.0);
        for draw in &draws {
            let d = draw.steps[0].mean_m - first.mean_m;
            (center, xy) = (center + d / n, xy + d.x * d.y / n);
        }
        let error_m = (first.xx_m2 / n).sqrt();
        assert!(center.length() < 5.0 * error_m, "{center} with a standard error of {error_m}");
        let error_m2 = (first.xx_m2 * first.yy_m2 / n).sqrt();
        assert!((xy - first.xy_m2).abs() < 5.0 * error_m2, "{xy} for {}", first.xy_m2);
    }

    #[test]
    fn later_frames_change_no_forecast() {
        const CHANGED_FROM: usize = 20;
        let way = way();
        let mut other_way = way.clone();
        other_way[CHANGED_FROM..].iter_mut().for_each(|p| *p += DVec2::new(0.5, -0.5));
        for method in [ForecastMethod::ConstantVelocity, ForecastMethod::Residual, ForecastMethod::Lstm] {
            let (mut one, mut other) =
                (forecaster(method, Rollout::Mean, 1), forecaster(method, Rollout::Mean, 1));
            for frame in 0..way.len() {
                let expected = forecasts(&mut one, &[track(1, &way, frame)]);
                let found = forecasts(&mut other, &[track(1, &other_way, frame)]);
                assert_eq!(expected == found, frame < CHANGED_FROM, "frame {frame}");
            }
        }
    }

    #[test]
    fn a_young_track_goes_on_at_constant_velocity() {
        let way = way();
        let mut lstm = forecaster(ForecastMethod::Lstm, Rollout::Mean, 1);
        let mut straight = forecaster(ForecastMethod::ConstantVelocity, Rollout::Mean, 1);
        let tracks = [track(1, &way, OBSERVED - 2), track(2, &way, OBSERVED - 1)];
        let (found, expected) = (forecasts(&mut lstm, &tracks), forecasts(&mut straight, &tracks));
        assert_eq!(found[0], expected[0]);
        assert_ne!(found[1].steps, expected[1].steps);
    }

    #[test]
    fn displacements_are_scaled_to_a_frame() {
        let observed = |period_ns: i64| -> VecDeque<_> {
            (0..OBSERVED as i64).map(|k| seen(k * period_ns, DVec2::new(k as f64, 0.0))).collect()
        };
        assert_eq!(displacements_m(&observed(STEP_NS)).unwrap()[4], DVec2::new(1.0, 0.0));
        assert_eq!(displacements_m(&observed(2 * STEP_NS)).unwrap()[4], DVec2::new(0.5, 0.0));
        assert_eq!(displacements_m(&observed(0)), None);
    }

    #[test]
    fn lstm_without_weights_is_an_error() {
        let config = ForecastConfig { method: ForecastMethod::Lstm, ..Config::default().forecast };
        let message = Forecaster::new(&config, None).unwrap_err().to_string();
        assert!(message.contains("expected its weights, found none"), "{message}");
    }
}
