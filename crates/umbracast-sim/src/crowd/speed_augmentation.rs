//! Speed augmentation: known paths with other timing. The whole crowd's clock runs fast, slows down, stops and starts
//! again, and everybody sways with the stride and wanders a little off the path. Simulated people never run or brake
//! as hurried people do, and recorded ones are few. People with one clock keep their distances, so they do not
//! collide.

use std::f64::consts::TAU;
use std::ops::Range;

use super::trajectory::{Crowd, STEP_NS, Trajectory};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use umbracast::geometry::DVec2;

/// Of trajectories.
const STEP_S: f64 = STEP_NS as f64 * 1e-9;
/// How fast the clock runs at most, drawn anew for each walk between two stands: 1.48 m/s (PedPy's corridor) becomes
/// 1.6 to 2.8 m/s.
const RATE: Range<f64> = 1.1..1.9;
/// People stand, set off, walk and slow down for so long, seconds.
const STAND_S: Range<f64> = 0.3..1.5;
const SET_OFF_S: Range<f64> = 0.8..1.8;
const WALK_S: Range<f64> = 4.0..12.0;
const SLOW_DOWN_S: Range<f64> = 1.0..3.5;
/// Bodies sway as people step: to both sides once a stride, and forward with each of its two steps. A stride goes so
/// far, and the sway so far to each side and ahead at most, metres.
const STRIDE_M: Range<f64> = 1.2..1.8;
const SWAY_M: [f64; 2] = [0.012, 0.03];
/// Nobody keeps to a line: standard deviation of the way wandered off, to each side and ahead, metres, and how often
/// it comes and goes. Without it a forecast trusts people's ways more than theirs deserve.
const WANDER_M: f64 = 0.02;
const WANDER_HZ: Range<f64> = 0.25..0.8;
const WAVES: usize = 4;
/// Who stops comes to rest, and who sets off begins to sway and wander, with this time constant.
const SETTLE_S: f64 = 0.15;

/// The crowd on such a clock. Nobody arrives: who reached the goal stands there.
pub fn speed_augmented(crowd: &Crowd, seed: u64) -> Crowd {
    let mut rng = Pcg64::seed_from_u64(seed);
    let clock_s = clock(crowd.duration_ns as f64 * 1e-9, &mut rng);
    let trajectories = crowd.trajectories.iter().filter_map(|way| walked(way, &clock_s, &mut rng)).collect();
    Crowd { trajectories, duration_ns: clock_s.len() as i64 * STEP_NS }
}

/// The way's time at every 10 ms, from 0 until `duration_s`.
fn clock(duration_s: f64, rng: &mut Pcg64) -> Vec<f64> {
    let mut times_s = vec![0.0];
    let mut time_s = 0.0;
    loop {
        let [stand_s, set_off_s, walk_s, slow_down_s] =
            [STAND_S, SET_OFF_S, WALK_S, SLOW_DOWN_S].map(|range| rng.random_range(range));
        let top = rng.random_range(RATE);
        // Slope 0 at both ends.
        let eased = |share: f64| share * share * (3.0 - 2.0 * share);
        let whole_s = stand_s + set_off_s + walk_s + slow_down_s;
        for step in 0..(whole_s / STEP_S) as usize {
            let at_s = step as f64 * STEP_S - stand_s;
            let rising = eased((at_s / set_off_s).clamp(0.0, 1.0));
            let falling = eased(((set_off_s + walk_s + slow_down_s - at_s) / slow_down_s).clamp(0.0, 1.0));
            time_s += top * rising * falling * STEP_S;
            if time_s > duration_s {
                return times_s;
            }
            times_s.push(time_s);
        }
    }
}

fn walked(way: &Trajectory, clock_s: &[f64], rng: &mut Pcg64) -> Option<Trajectory> {
    let stride_m = rng.random_range(STRIDE_M);
    let sway_m = SWAY_M.map(|largest_m| rng.random_range(0.0..largest_m));
    let wander = [Wander::drawn(rng), Wander::drawn(rng)];
    let (mut start_ns, mut last_m, mut phase) = (None, None, rng.random_range(0.0..TAU));
    let (mut heading, mut swaying) = (DVec2::X, 0.0);
    let mut positions_m = Vec::new();
    for (step, &time_s) in clock_s.iter().enumerate() {
        let Some((position_m, velocity_mps)) = way.at((time_s * 1e9) as i64) else { continue };
        start_ns.get_or_insert(step as i64 * STEP_NS);
        // A stride is walked, not waited for: who stands does not sway.
        let walked_m = position_m.distance(last_m.unwrap_or(position_m));
        phase += TAU * walked_m / stride_m;
        last_m = Some(position_m);
        // Slow people hardly sway, those who stand not at all: all of it from 1 m/s on.
        swaying += ((walked_m / STEP_S).min(1.0) - swaying) * STEP_S / SETTLE_S;
        heading = velocity_mps.try_normalize().unwrap_or(heading);
        let ahead = heading * swaying;
        let swayed_m = ahead * sway_m[0] * (2.0 * phase).sin() + ahead.perp() * sway_m[1] * phase.sin();
        let at_s = step as f64 * STEP_S;
        let wandered_m = ahead * wander[0].at_m(at_s) + ahead.perp() * wander[1].at_m(at_s);
        positions_m.push(position_m + swayed_m + wandered_m);
    }
    Some(Trajectory { start_ns: start_ns?, step_ns: STEP_NS, positions_m, arrived_ns: None, ..way.clone() })
}

/// A sum of waves: size in metres, frequency in hertz, phase.
struct Wander([[f64; 3]; WAVES]);

impl Wander {
    fn drawn(rng: &mut Pcg64) -> Self {
        let size_m = WANDER_M * (2.0 / WAVES as f64).sqrt();
        Self(std::array::from_fn(|_| {
            [size_m * rng.random_range(0.3..1.5), rng.random_range(WANDER_HZ), rng.random_range(0.0..TAU)]
        }))
    }

    fn at_m(&self, time_s: f64) -> f64 {
        self.0.iter().map(|[size_m, pace_hz, phase]| size_m * (TAU * pace_hz * time_s + phase).sin()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crowd::{Preset, circle_crossing};

    #[test]
    fn an_augmented_crowd_runs_and_stands_but_jumps_nowhere() {
        let crowd = speed_augmented(&circle_crossing(Preset::Orca03, 3, 5.0, 1), 1);
        assert_eq!(crowd.trajectories.len(), 3);
        let (mut fastest_mps, mut slowest_mps) = (0.0_f64, f64::INFINITY);
        for way in &crowd.trajectories {
            for pair in way.positions_m.windows(2) {
                let speed_mps = pair[0].distance(pair[1]) / STEP_S;
                (fastest_mps, slowest_mps) = (fastest_mps.max(speed_mps), slowest_mps.min(speed_mps));
            }
        }
        assert!(fastest_mps > 1.2 && fastest_mps < 4.0, "{fastest_mps} m/s");
        assert!(slowest_mps < 0.01, "{slowest_mps} m/s");
    }

    #[test]
    fn nobody_wanders_while_the_clock_stands() {
        let crowd = circle_crossing(Preset::Orca03, 3, 5.0, 1);
        let clock_s = clock(crowd.duration_ns as f64 * 1e-9, &mut Pcg64::seed_from_u64(1));
        let settled = (4.0 * SETTLE_S / STEP_S) as usize;
        let standing: Vec<usize> =
            (settled..clock_s.len()).filter(|&step| clock_s[step] - clock_s[step - settled] < 1e-3).collect();
        assert!(!standing.is_empty());
        for way in speed_augmented(&crowd, 1).trajectories {
            let first = (way.start_ns / STEP_NS) as usize;
            for step in standing.iter().filter_map(|step| step.checked_sub(first)).filter(|&step| step > 0) {
                let speed_mps = way.positions_m[step].distance(way.positions_m[step - 1]) / STEP_S;
                assert!(speed_mps < 0.05, "{speed_mps} m/s at step {step}");
            }
        }
    }
}
