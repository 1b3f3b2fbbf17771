//! Where the device is that a person carries: in a hand that moves, now and then at the ear.

use std::f64::consts::TAU;

use rand::RngExt;
use umbracast::site::Ue;

use crate::random::stream;

/// A hand goes round the body axis by up to 20 degrees, two standard deviations. An assumption, as is all that follows.
const TURN_RAD: f64 = 0.175;
/// The rest of the spread is its own along each axis: of a hand 0.36 m from the axis, the turn makes 0.6 of 0.1 m.
const OWN: f64 = 0.8;
/// Periods of the hand's motion, seconds.
const PERIODS_S: [f64; 3] = [2.3, 4.1, 8.7];
/// A person may take a call in each stretch of this length,
const STRETCH_S: f64 = 40.0;
/// with this chance,
const CALLS: f64 = 0.4;
/// for so long,
const CALL_S: std::ops::Range<f64> = 6.0..15.0;
/// and the hand takes so long to the ear.
const RAISE_S: f64 = 0.8;
/// The ear: on the side of the hand, this far from the axis, at this share of the height.
const EAR_M: f64 = 0.09;
const EAR_SHARE: f64 = 0.92;

/// Where the device of a body is at a time. `ue` says where it is on the mean and, by its spread, how far the hand goes from there;
/// without a spread it is always there. It depends on the seed of the body and on the time alone.
pub(super) fn held(ue: &Ue, seed: u64, time_ns: i64, height_m: f64) -> Ue {
    if ue.spread_m == 0.0 {
        return *ue;
    }
    let time_s = 1e-9 * time_ns as f64;
    let wave = |coordinate: u64| {
        let mut draws = stream(seed, "hand", coordinate);
        let part = |period_s: &f64| (TAU * (time_s / period_s + draws.random::<f64>())).sin();
        (2.0 / PERIODS_S.len() as f64).sqrt() * PERIODS_S.iter().map(part).sum::<f64>()
    };
    let (sin, cos) = (TURN_RAD * wave(3)).sin_cos();
    let forward_m = cos * ue.forward_m - sin * ue.left_m + OWN * ue.spread_m * wave(0);
    let left_m = sin * ue.forward_m + cos * ue.left_m + OWN * ue.spread_m * wave(1);
    let height_share = ue.height_share + ue.spread_m * wave(2) / height_m;
    let at_ear = call(seed, time_s);
    let between = |hand: f64, ear: f64| (1.0 - at_ear) * hand + at_ear * ear;
    Ue {
        forward_m: between(forward_m, 0.0),
        left_m: between(left_m, if ue.left_m < 0.0 { -EAR_M } else { EAR_M }),
        height_share: between(height_share, EAR_SHARE),
        spread_m: ue.spread_m,
    }
}

/// 0 where the hand is down, 1 at the ear, smoothly between.
fn call(seed: u64, time_s: f64) -> f64 {
    let stretch = (time_s / STRETCH_S).floor();
    let mut draws = stream(seed, "call", stretch as i64 as u64);
    if draws.random::<f64>() >= CALLS {
        return 0.0;
    }
    let lasts_s = draws.random_range(CALL_S);
    let from_s = (STRETCH_S - lasts_s) * draws.random::<f64>();
    let into_s = time_s - STRETCH_S * stretch - from_s;
    let raised = (into_s.min(lasts_s - into_s) / RAISE_S).clamp(0.0, 1.0);
    raised * raised * (3.0 - 2.0 * raised)
}

#[cfg(test)]
mod tests {
    use super::*;

    const IN_HAND: Ue = Ue { forward_m: 0.3, left_m: -0.2, height_share: 0.6, spread_m: 0.1 };

    #[test]
    fn a_hand_moves_by_the_spread_and_goes_to_the_ear_and_back() {
        let mut down = Vec::new();
        let (mut raised, mut times, mut fastest_mps) = (0, 0, 0.0_f64);
        for seed in 0..40 {
            let mut before = held(&IN_HAND, seed, 0, 1.75);
            for k in 1..1200 {
                let time_ns = k * 100_000_000;
                let ue = held(&IN_HAND, seed, time_ns, 1.75);
                let up_m = 1.75 * (ue.height_share - before.height_share);
                let off_m = (ue.forward_m - before.forward_m).hypot(ue.left_m - before.left_m).hypot(up_m);
                fastest_mps = fastest_mps.max(10.0 * off_m);
                match call(seed, 1e-9 * time_ns as f64) {
                    0.0 => down.push(ue.left_m - IN_HAND.left_m),
                    1.0 => {
                        assert!((ue.forward_m, ue.left_m, ue.height_share) == (0.0, -EAR_M, EAR_SHARE));
                        raised += 1;
                    }
                    _ => {}
                }
                (before, times) = (ue, times + 1);
            }
        }
        let sigma_m = (down.iter().map(|m| m * m).sum::<f64>() / down.len() as f64).sqrt();
        assert!((sigma_m - 0.1).abs() < 0.01, "{sigma_m}");
        let share = f64::from(raised) / f64::from(times);
        assert!((0.04..0.16).contains(&share), "{share} of the time at the ear");
        assert!(fastest_mps < 2.0, "a hand is not thrown: {fastest_mps} m/s");
    }

    #[test]
    fn without_a_spread_the_device_is_where_the_site_says() {
        let fixed = Ue { spread_m: 0.0, ..IN_HAND };
        assert!((0..100).all(|k| held(&fixed, 7, k * 1_000_000_000, 1.75) == fixed));
    }
}
