//! One forecast a track, by the method of the config.

use std::collections::VecDeque;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::lstm::OBSERVED_DISPLACEMENTS;
use super::{Forecast, Gaussian2, Weights, constant_velocity};
use crate::config::{ForecastConfig, ForecastMethod, Rollout};
use crate::geometry::DVec2;
use crate::track::{OBSERVED, Track};
use crate::{Error, STEP_NS};

/// Foresees.
#[derive(Debug)]
pub struct Forecaster {
    config: ForecastConfig,
    lstm: Option<Weights>,
}

impl Forecaster {
    /// `weights` are needed by the method `lstm` only.
    ///
    /// # Errors
    /// The method needs weights and there are none, or the spread is no number.
    pub fn new(config: &ForecastConfig, weights: Option<&Weights>) -> Result<Self, Error> {
        let psd = config.acceleration_psd_m2ps3;
        if !psd.is_finite() || psd < 0.0 {
            return Err(Error::new(format!(
                "forecast.acceleration_psd_m2ps3: expected a number not below 0, found {psd}"
            )));
        }
        let lstm = match (config.method, weights) {
            (ForecastMethod::ConstantVelocity, _) => None,
            (ForecastMethod::Lstm, Some(weights)) => Some(weights.clone()),
            (ForecastMethod::Lstm, None) => {
                return Err(Error::new("forecast.method = \"lstm\": expected its weights, found none"));
            }
        };
        Ok(Self { config: config.clone(), lstm })
    }

    /// One forecast for each track, in the order of the tracks.
    pub fn forecast(&mut self, tracks: &[Track], forecasts: &mut Vec<Forecast>) {
        forecasts.clear();
        let psd = self.config.acceleration_psd_m2ps3;
        forecasts.extend(tracks.iter().map(|track| constant_velocity::forecast(track, psd)));
        if let Some(weights) = &self.lstm {
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
                generators.push(generator(self.config.seed, track));
            }
        }
        let mut walked_m = Vec::new();
        walked_m.resize_with(full.len(), Vec::new);
        let foreseen = weights.roll_out(&observed_m, |person, displacement| {
            // Eq. (3) draws v; the mean, which TrajNet++ evaluates with, errs less.
            let v = match self.config.rollout {
                Rollout::Mean => displacement.mean_m,
                Rollout::Draw => draw(displacement, &mut generators[person]),
            };
            walked_m[person].push(v);
            v
        });
        for ((&i, foreseen), walked_m) in full.iter().zip(&foreseen).zip(&walked_m) {
            let mut position =
                Gaussian2 { mean_m: tracks[i].observed[OBSERVED - 1].1, ..Gaussian2::default() };
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
fn displacements_m(observed: &VecDeque<(i64, DVec2)>) -> Option<[DVec2; OBSERVED_DISPLACEMENTS]> {
    let mut displacements = [DVec2::ZERO; OBSERVED_DISPLACEMENTS];
    if observed.len() != OBSERVED {
        return None;
    }
    for (i, displacement) in displacements.iter_mut().enumerate() {
        let ((from_ns, from_m), (to_ns, to_m)) = (observed[i], observed[i + 1]);
        if to_ns <= from_ns {
            return None;
        }
        *displacement = (to_m - from_m) * (STEP_NS as f64 / (to_ns - from_ns) as f64);
    }
    Some(displacements)
}

/// A draw depends on the seed, the track and the frame alone: neither on the other tracks nor on the frames
/// before.
fn generator(seed: u64, track: &Track) -> Pcg64 {
    let time_ns = track.observed.back().map_or(0, |&(time_ns, _)| time_ns);
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
