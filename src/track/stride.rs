//! Where in the stride somebody is who walks, as frame after frame shows it.

use std::f64::consts::TAU;

use super::remembered::{Remembered, Words};
use crate::gait::{Gait, HAND_SWING, HAND_SWING_SIGMA, WALKS_FROM_MPS, stride_hz};
use crate::geometry::DVec2;

/// People of one height and speed do not keep one pace: so fast the phase spreads.
const PACE_RAD2PS: f64 = 0.15;
/// Frames follow each other faster than hands swing: as many in a row count as one.
const FRAMES_ALIKE: f64 = 10.0;
/// A hand that swings is put to something, or let go, within about this time.
const LASTS_S: f64 = 30.0;

/// How somebody walks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Stride {
    /// A von Mises distribution of the phase: its cosine and sine times the concentration, which add up over frames.
    phase: DVec2,
    /// Of the left and the right hand.
    hands: [Swing; 2],
}

/// How far a hand swings, and the variance of that: see [`Gait::hand_swing`].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Swing {
    mean: f64,
    variance: f64,
}

impl Default for Swing {
    fn default() -> Self {
        Self { mean: HAND_SWING, variance: HAND_SWING_SIGMA.powi(2) }
    }
}

impl Remembered for Stride {
    fn visit(&mut self, words: &mut impl Words) {
        words.vec2(&mut self.phase);
        for hand in &mut self.hands {
            words.f64(&mut hand.mean);
            words.f64(&mut hand.variance);
        }
    }
}

impl Stride {
    /// Somebody walks on.
    pub(super) fn predict(&mut self, speed_mps: f64, height_m: f64, dt_s: f64) {
        if dt_s > 0.0 {
            let walked = DVec2::from_angle(TAU * stride_hz(speed_mps, height_m) * dt_s);
            self.phase = self.phase.rotate(walked) / (1.0 + self.phase.length() * PACE_RAD2PS * dt_s);
            let spread = HAND_SWING_SIGMA.powi(2);
            for hand in &mut self.hands {
                hand.variance = (hand.variance + spread * dt_s / LASTS_S).min(spread);
            }
        }
    }

    /// Takes what a frame tells.
    pub(super) fn see(&mut self, gait: &Gait) {
        self.phase += DVec2::from_angle(gait.phase_rad) * gait.concentration;
        // What the network says of a frame already holds what is usual, which counts once.
        let usual = HAND_SWING_SIGMA.powi(-2);
        for (i, hand) in self.hands.iter_mut().enumerate() {
            let told = gait.hand_swing_sigma[i].powi(-2);
            let (known, new) = (1.0 / hand.variance, (told - usual) / FRAMES_ALIKE);
            if new > 0.0 {
                let seen = (told * gait.hand_swing[i] - usual * HAND_SWING) / (told - usual);
                hand.mean += new / (known + new) * (seen - hand.mean);
                hand.variance = 1.0 / (known + new);
            }
        }
    }

    /// The gait of somebody who walks so fast.
    pub(super) fn gait(&self, speed_mps: f64) -> Gait {
        if speed_mps < WALKS_FROM_MPS {
            return Gait::UNKNOWN;
        }
        Gait {
            phase_rad: self.phase.to_angle().rem_euclid(TAU),
            concentration: self.phase.length(),
            hand_swing: self.hands.map(|hand| hand.mean),
            hand_swing_sigma: self.hands.map(|hand| hand.variance.sqrt()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::gait::stride_m;

    const SPEED_MPS: f64 = 1.1;
    const HEIGHT_M: f64 = 1.7;

    /// After a walk of 4 s of which each frame tells the phase with this concentration: what is known, and the truth.
    fn walked(concentration: f64) -> (Gait, f64) {
        let mut stride = Stride::default();
        let mut phase_rad: f64 = 0.0;
        for _ in 0..40 {
            stride.predict(SPEED_MPS, HEIGHT_M, 0.1);
            phase_rad += TAU * SPEED_MPS * 0.1 / stride_m(SPEED_MPS, HEIGHT_M);
            stride.see(&Gait { phase_rad, concentration, ..Gait::UNKNOWN });
        }
        (stride.gait(SPEED_MPS), phase_rad)
    }

    #[test]
    fn frames_together_tell_the_phase_better_than_each_and_not_without_end() {
        let (gait, phase_rad) = walked(2.0);
        let off_rad = (gait.phase_rad - phase_rad + PI).rem_euclid(TAU) - PI;
        assert!(off_rad.abs() < 1e-9 && (4.0..30.0).contains(&gait.concentration), "{off_rad} {gait:?}");
        assert_eq!(walked(0.0).0.concentration, 0.0);
    }

    #[test]
    fn the_phase_of_who_walks_out_of_sight_is_forgotten() {
        let mut stride = Stride { phase: DVec2::new(20.0, 0.0), ..Stride::default() };
        stride.predict(SPEED_MPS, HEIGHT_M, 10.0);
        assert!(stride.gait(SPEED_MPS).concentration < 0.7, "{stride:?}");
    }

    #[test]
    fn who_stands_has_no_phase() {
        let stride = Stride { phase: DVec2::new(20.0, 0.0), ..Stride::default() };
        assert_eq!(stride.gait(0.1), Gait::UNKNOWN);
    }
    #[test]
    fn a_hand_that_is_still_is_learned_beside_one_that_swings_and_forgotten_in_the_end() {
        let mut stride = Stride::default();
        // A frame that is as unsure as everybody differs tells nothing.
        let seen = Gait { hand_swing: [0.02, 0.10], hand_swing_sigma: [0.03; 2], ..Gait::UNKNOWN };
        stride.see(&Gait { hand_swing: [0.2; 2], ..Gait::UNKNOWN });
        assert_eq!(stride, Stride::default());
        for _ in 0..50 {
            stride.predict(SPEED_MPS, HEIGHT_M, 0.1);
            stride.see(&seen);
        }
        let gait = stride.gait(SPEED_MPS);
        assert!(gait.hand_swing[0] < 0.015 && gait.hand_swing[1] > 0.1, "{gait:?}");
        assert!(gait.hand_swing_sigma[0] < 0.5 * HAND_SWING_SIGMA, "{gait:?}");
        (0..1000).for_each(|_| stride.predict(SPEED_MPS, HEIGHT_M, 0.1));
        assert_eq!(stride.gait(SPEED_MPS).hand_swing_sigma, [HAND_SWING_SIGMA; 2]);
    }
}
