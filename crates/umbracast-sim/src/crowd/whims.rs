//! Why nobody's way is straight and even: people slow down and hurry, wander from their line, and stop for no reason that
//! anybody else sees.
//!
//! Measured on recorded heads, smoothed by 0.4 s so that their sway with the steps is gone, where the data serve to fit
//! (`docs/LOCKED.md`): PedPy's corridor (146 people who walk freely at 1.46 m/s) and three clips of the MADRAS crowd (1B,
//! 2C, 2D: 191 people in a dense street). Medians over people:
//!
//! | | corridor | MADRAS |
//! |---|---|---|
//! | speed along a way, spread over mean | 0.05 | 0.11 to 0.26 |
//! | it forgets itself in | 1.0 s | 1.2 to 1.6 s |
//! | direction about the straight way, spread | 0.04 rad | 0.20 to 0.25 rad |
//! | rate of turning, spread | 0.05 rad/s | 0.24 to 0.27 rad/s |
//! | share of the time below 0.1 m/s | 0 | 0.08 to 0.27 |
//! | stops a minute, and how long | 0 | 0.9 to 2.5, 6 to 8 s |
//!
//! A hall lies between both: the figures here are chosen so that a crowd of ten does, others being avoided too.

use glam::Vec2;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::crossing::STEP_S;

/// Of the preferred speed, as a share, and how soon it is another.
const SPEED: f32 = 0.10;
const SPEED_LASTS_S: f32 = 1.4;
/// Of the direction, radians. What lasts longer bends the way more.
const ASIDE: f32 = 0.17;
const ASIDE_LASTS_S: f32 = 2.0;
/// Nothing of this jumps: it follows what is drawn within so long.
const FOLLOWS_S: f32 = 0.4;
/// Stops a second of walking, and how long one is on the mean.
const STOPS_HZ: f32 = 1.0 / 60.0;
const STOP_S: f32 = 7.0;
/// A longer stop would be a stay.
const LONGEST_STOP_S: f32 = 20.0;

/// One party's whims: drawn anew in every step.
#[derive(Debug, Clone)]
pub(super) struct Whims {
    rng: Pcg64,
    speed: Wander,
    aside: Wander,
    stands_until_s: f32,
}

impl Whims {
    pub(super) fn new(rng: Pcg64) -> Self {
        Self {
            rng,
            speed: Wander::new(SPEED, SPEED_LASTS_S),
            aside: Wander::new(ASIDE, ASIDE_LASTS_S),
            stands_until_s: 0.0,
        }
    }

    /// What becomes of the velocity that a goal asks for.
    pub(super) fn change(&mut self, preferred_mps: Vec2, now_s: f32) -> Vec2 {
        let (faster, aside_rad) = (self.speed.step(&mut self.rng), self.aside.step(&mut self.rng));
        let stops = self.rng.random::<f32>() < STOPS_HZ * STEP_S;
        let share: f32 = self.rng.random();
        if preferred_mps == Vec2::ZERO || now_s < self.stands_until_s {
            return Vec2::ZERO;
        }
        if stops {
            self.stands_until_s = now_s + (-STOP_S * (1.0 - share).ln()).min(LONGEST_STOP_S);
            return Vec2::ZERO;
        }
        Vec2::from_angle(aside_rad).rotate(preferred_mps) * (1.0 + faster)
    }
}

/// A random walk that is drawn back to zero, smoothed.
#[derive(Debug, Clone)]
struct Wander {
    spread: f32,
    lasts_s: f32,
    drawn: f32,
    followed: f32,
}

impl Wander {
    fn new(spread: f32, lasts_s: f32) -> Self {
        Self { spread, lasts_s, drawn: 0.0, followed: 0.0 }
    }

    fn step(&mut self, rng: &mut Pcg64) -> f32 {
        let share = STEP_S / self.lasts_s;
        let draw: f32 = StandardNormal.sample(rng);
        // What follows later varies less: by the share of both times.
        let spread = self.spread * ((self.lasts_s + FOLLOWS_S) / self.lasts_s).sqrt();
        self.drawn += -self.drawn * share + spread * (2.0 * share).sqrt() * draw;
        self.followed += (self.drawn - self.followed) * STEP_S / FOLLOWS_S;
        self.followed.clamp(-3.0 * self.spread, 3.0 * self.spread)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Preset, Trajectory, circle_crossing};
    use umbracast::geometry::DVec2;

    /// Speeds and directions about the straight way, every 0.1 s between 2 m from the start and the arrival.
    fn walked(way: &Trajectory) -> Vec<(f64, f64)> {
        let start = way.positions_m[0];
        let until_ns = way.arrived_ns.unwrap();
        let straight = way.at(until_ns).unwrap().0 - start;
        let samples = (0..until_ns).step_by(100_000_000).map(|time_ns| way.at(time_ns).unwrap());
        let under_way = samples.filter(|(at, _)| at.distance(start) > 2.0);
        let told = |(_, velocity): (DVec2, DVec2)| (velocity.length(), straight.angle_to(velocity));
        under_way.map(told).collect()
    }

    fn spread(values: &[f64]) -> (f64, f64) {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        (mean, (squares / values.len() as f64).sqrt())
    }

    #[test]
    fn ways_stop_bend_and_vary_between_a_free_corridor_and_a_dense_street() {
        let (mut stands, mut all, mut speeds, mut directions) = (0, 0, Vec::new(), Vec::new());
        for seed in 0..12 {
            for way in circle_crossing(Preset::Natural, 10, 12.5, seed).trajectories {
                let walked = walked(&way);
                all += walked.len();
                stands += walked.iter().filter(|(speed, _)| *speed < 0.1).count();
                let moving: Vec<(f64, f64)> = walked.into_iter().filter(|(speed, _)| *speed > 0.3).collect();
                let (mean, sigma) = spread(&moving.iter().map(|m| m.0).collect::<Vec<_>>());
                speeds.push(sigma / mean);
                directions.push(spread(&moving.iter().map(|m| m.1).collect::<Vec<_>>()).1);
            }
        }
        let median = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        let share = stands as f64 / all as f64;
        assert!((0.02..0.27).contains(&share), "{share} of the time they stand");
        let (speed, direction) = (median(speeds), median(directions));
        assert!((0.05..0.26).contains(&speed), "{speed}: spread of the speed along a way");
        assert!((0.04..0.25).contains(&direction), "{direction} rad: spread of the direction");
    }

    #[test]
    fn strangers_keep_apart_all_arrive_and_nobody_jumps() {
        for seed in 0..6 {
            let crowd = circle_crossing(Preset::Natural, 10, 12.5, seed);
            assert!(crowd.trajectories.iter().all(|way| way.arrived_ns.is_some()), "seed {seed}");
            for way in &crowd.trajectories {
                let fastest = way.positions_m.windows(2).map(|p| p[0].distance(p[1])).fold(0.0, f64::max);
                assert!(fastest < 0.035, "seed {seed}, person {}: {fastest} m in 10 ms", way.person);
            }
        }
    }
}
