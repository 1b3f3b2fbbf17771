//! What a method says of a scene, frame by frame, kept so that many policies are judged by the same forecasts.

use std::time::{Duration, Instant};

use umbracast::blockage::{Blockage, Caster};
use umbracast::forecast::{Forecast, Forecaster, Weights};
use umbracast::geometry::DVec2;
use umbracast::radio::{Fader, Loss, Outages};
use umbracast::track::Track;
use umbracast::{Config, Error, STEPS};

use crate::truth::{TICK_NS, Traces};

/// A track is a person's where it is no farther from him.
const SAME_M: f64 = 0.5;

/// Everybody followed in one frame.
#[derive(Debug, Clone)]
pub struct Followed {
    /// The frame's instant.
    pub time_ns: i64,
    /// As the tracker gave them.
    pub tracks: Vec<Track>,
}

/// What one frame says.
#[derive(Debug, Clone)]
pub struct Foreseen {
    /// The frame's instant.
    pub time_ns: i64,
    /// Samples of everybody confirmed; one sample where the method is binary.
    pub outages: Outages,
    /// One an access point with a radio and person confirmed.
    pub losses: Vec<Loss>,
    /// By person of the truth: the place among those confirmed; `None` where nobody is followed there.
    pub index_of: Vec<Option<usize>>,
    /// By place among those confirmed.
    pub tracks: Vec<u64>,
}

impl Foreseen {
    /// The loss of a link.
    pub fn loss(&self, access_point: usize, index: usize) -> Option<&Loss> {
        let track = self.tracks.get(index)?;
        self.losses.iter().find(|loss| loss.access_point == access_point && loss.track == *track)
    }
}

/// The stages behind the tracker.
#[derive(Debug, Clone)]
pub struct Foreteller {
    forecaster: Forecaster,
    caster: Caster,
    fader: Fader,
    access_points: usize,
    forecasts: Vec<Forecast>,
    blockages: Vec<Blockage>,
    losses: Vec<Loss>,
    /// How long the losses of the last frame took.
    pub fading: Duration,
}

impl Foreteller {
    /// Of a configuration whose access points have radios. `weights` are the LSTM's, for modes that forecast with it.
    ///
    /// # Errors
    /// A method that needs weights and gets none.
    pub fn new(config: &Config, weights: Option<&Weights>) -> Result<Self, Error> {
        Ok(Self {
            forecaster: Forecaster::new(&config.forecast, weights)?,
            caster: Caster::new(&config.blockage, &config.site),
            fader: Fader::new(&config.site),
            access_points: config.site.access_points.len(),
            forecasts: Vec::new(),
            blockages: Vec::new(),
            losses: Vec::new(),
            fading: Duration::ZERO,
        })
    }

    /// What it says of the next frame; devices are bound to the tracks that are nearest to their people.
    #[expect(clippy::disallowed_methods, reason = "how long losses take is a figure of the command's")]
    pub fn foresee(&mut self, frame: &Followed, traces: &Traces) -> Foreseen {
        self.forecaster.forecast(&frame.tracks, &mut self.forecasts);
        self.caster.cast(&frame.tracks, &self.forecasts, &mut self.blockages);
        let begun = Instant::now();
        self.fader.fade(&self.caster, &mut self.losses);
        self.fading = begun.elapsed();
        let confirmed: Vec<(u64, DVec2)> =
            frame.tracks.iter().filter(|t| t.confirmed).map(|t| (t.id, t.position_m)).collect();
        let tick = ((frame.time_ns / TICK_NS) as usize).min(traces.ticks - 1);
        let nearest = |person: usize| {
            let place_m = traces.place_m(tick, person);
            let by_distance = confirmed.iter().enumerate().map(|(i, (_, at_m))| (i, at_m.distance(place_m)));
            by_distance.filter(|(_, m)| *m <= SAME_M).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
        };
        let tracks: Vec<u64> = confirmed.iter().map(|(id, _)| *id).collect();
        // A binary method draws no samples: what it says is one.
        let (outages, losses) = match self.fader.outages().samples() {
            0 => of_windows(&self.blockages, self.access_points, &tracks),
            _ => (self.fader.outages().clone(), self.losses.clone()),
        };
        let index_of = (0..traces.people).map(nearest).collect();
        Foreseen { time_ns: frame.time_ns, outages, losses, index_of, tracks }
    }
}

/// A binary method tells in which windows a link is blocked: from the first step of the first such window on it is out.
fn of_windows(blockages: &[Blockage], access_points: usize, tracks: &[u64]) -> (Outages, Vec<Loss>) {
    let mut outages = Outages::new(access_points, tracks.len(), 1);
    let mut losses = Vec::with_capacity(blockages.len());
    for link in blockages {
        let mut loss = Loss::clear(link.access_point, link.track);
        let first = link.blocked.iter().position(|blocked| *blocked);
        let mut out = |step: usize| {
            if let Some(person) = tracks.iter().position(|track| *track == link.track) {
                outages.set(link.access_point, person, step, 0);
            }
        };
        if link.blocked_now {
            loss.p_out_now = 1.0;
            out(0);
        }
        if let Some(first) = first {
            loss.p_out[first..].fill(1.0);
            (first..STEPS).for_each(|step| out(step + 1));
            loss.onset_s[0] = (!link.blocked_now).then_some((first + 1) as f64 * umbracast::STEP_S);
        }
        losses.push(loss);
    }
    (outages, losses)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_of_a_binary_method_are_one_sample() {
        let mut link = Blockage {
            access_point: 1,
            track: 7,
            blocked_now: false,
            p_now: 0.0,
            blocked: [false; STEPS],
            p: [0.0; STEPS],
            onset_s: [None; 3],
            duration_s: [None; 3],
            own: None,
            hall: None,
            any: None,
        };
        link.blocked[2..].fill(true);
        let (outages, losses) = of_windows(&[link], 2, &[5, 7]);
        let out = (0..=STEPS).map(|step| outages.of(1, 1, step)[0]).collect::<Vec<_>>();
        assert_eq!(out, [0, 0, 0, 1, 1, 1, 1, 1, 1, 1], "from 300 ms on");
        assert!((0..=STEPS).all(|step| outages.of(0, 1, step)[0] == 0 && outages.of(1, 0, step)[0] == 0));
        assert_eq!((losses[0].p_out[1], losses[0].p_out[2], losses[0].p_out_now), (0.0, 1.0, 0.0));
        assert!((losses[0].onset_s[0].unwrap() - 0.3).abs() < 1e-12);
    }
}
