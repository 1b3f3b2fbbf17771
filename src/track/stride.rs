//! Where in the stride somebody is who walks, as frame after frame shows it.

use std::f64::consts::TAU;

use super::remembered::{Remembered, Words};
use crate::gait::{GaitPhase, WALKS_FROM_MPS, stride_hz};
use crate::geometry::DVec2;

/// People of one height and speed do not keep one pace: so fast the phase spreads.
const PACE_RAD2PS: f64 = 0.15;

/// A von Mises distribution of the phase: its cosine and sine times the concentration, which add up over frames.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Stride(DVec2);

impl Remembered for Stride {
    fn visit(&mut self, words: &mut impl Words) {
        words.vec2(&mut self.0);
    }
}

impl Stride {
    /// Somebody walks on.
    pub(super) fn predict(&mut self, speed_mps: f64, height_m: f64, dt_s: f64) {
        if dt_s > 0.0 {
            let walked = DVec2::from_angle(TAU * stride_hz(speed_mps, height_m) * dt_s);
            self.0 = self.0.rotate(walked) / (1.0 + self.0.length() * PACE_RAD2PS * dt_s);
        }
    }

    /// Takes what a frame tells.
    pub(super) fn see(&mut self, gait: &GaitPhase) {
        self.0 += DVec2::from_angle(gait.phase_rad) * gait.concentration;
    }

    /// The phase of somebody who walks so fast.
    pub(super) fn phase(&self, speed_mps: f64) -> GaitPhase {
        if speed_mps < WALKS_FROM_MPS || self.0 == DVec2::ZERO {
            return GaitPhase::UNKNOWN;
        }
        GaitPhase {
            phase_rad: self.0.to_angle().rem_euclid(TAU),
            concentration: self.0.length(),
            ..GaitPhase::UNKNOWN
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
    fn walked(concentration: f64) -> (GaitPhase, f64) {
        let mut stride = Stride::default();
        let mut phase_rad: f64 = 0.0;
        for _ in 0..40 {
            stride.predict(SPEED_MPS, HEIGHT_M, 0.1);
            phase_rad += TAU * SPEED_MPS * 0.1 / stride_m(SPEED_MPS, HEIGHT_M);
            stride.see(&GaitPhase { phase_rad, concentration, ..GaitPhase::UNKNOWN });
        }
        (stride.phase(SPEED_MPS), phase_rad)
    }

    #[test]
    fn frames_together_tell_the_phase_better_than_each_and_not_without_end() {
        let (gait, phase_rad) = walked(2.0);
        let off_rad = (gait.phase_rad - phase_rad + PI).rem_euclid(TAU) - PI;
        assert!(off_rad.abs() < 1e-9 && (4.0..30.0).contains(&gait.concentration), "{off_rad} {gait:?}");
        assert_eq!(walked(0.0).0, GaitPhase::UNKNOWN);
    }

    #[test]
    fn the_phase_of_who_walks_out_of_sight_is_forgotten() {
        let mut stride = Stride(DVec2::new(20.0, 0.0));
        stride.predict(SPEED_MPS, HEIGHT_M, 10.0);
        assert!(stride.phase(SPEED_MPS).concentration < 0.7, "{stride:?}");
    }

    #[test]
    fn who_stands_has_no_phase() {
        assert_eq!(Stride(DVec2::new(20.0, 0.0)).phase(0.1), GaitPhase::UNKNOWN);
    }
}
