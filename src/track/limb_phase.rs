//! A walker's phase in the stride, from how arms and legs lie in each frame.
//!
//! [`LimbCovariance`] varies with the cosine of the phase, whose pace is known. The phase is therefore followed as an
//! oscillation of size 1, with cosine and quadrature. It is kept apart from the sway ([`super::sway`]), because
//! people sway differently at the same phase. A wrong sway would shift positions and bend velocities.

use super::gaussian::Mat2;
use super::remembered::{Remembered, Words};
use super::sway::Wave;
use crate::detect::LimbCovariance;
use crate::gait::{GaitPhase, WIDEST_RAD, relative_speed_hz, stride_hz};

/// What [`LimbCovariance`] is at its largest, of who walks at his hips' height a second: fitted on tuning scenes, as
/// is its noise in one frame, one standard deviation, which lasts over frames and counts for more than is seen of it
/// (0.007 m^2).
const WHOLE_M2: f64 = 0.0147;
const NOISE_M2: f64 = 0.010;
/// Of the cosine of any phase.
const ANY: f64 = 0.5;

/// A Gaussian over the cosine of the phase since arms and legs were farthest apart, and its quadrature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LimbPhase {
    mean: [f64; 2],
    covariance: Mat2,
}

impl Default for LimbPhase {
    /// Any phase.
    fn default() -> Self {
        Self { mean: [0.0; 2], covariance: [[ANY, 0.0], [0.0, ANY]] }
    }
}

impl Remembered for LimbPhase {
    fn visit(&mut self, words: &mut impl Words) {
        words.f64s(&mut self.mean);
        words.f64s(self.covariance.as_flattened_mut());
    }
}

impl LimbPhase {
    /// Somebody walks on.
    pub(super) fn predict(&mut self, speed_mps: f64, height_m: f64, dt_s: f64) {
        if dt_s <= 0.0 {
            return;
        }
        let wave = Wave::after(ANY, stride_hz(speed_mps, height_m), dt_s);
        let turned = |[a, b]: [f64; 2]| <[f64; 2]>::from(wave.turned(a, b));
        let transposed = |[[a, b], [c, d]]: Mat2| [[a, c], [b, d]];
        self.mean = turned(self.mean);
        self.covariance = transposed(transposed(self.covariance.map(turned)).map(turned));
        self.covariance[0][0] += wave.new;
        self.covariance[1][1] += wave.new;
    }

    /// Takes a frame's arms and legs. Steps are longer and arms swing farther the faster one walks.
    pub(super) fn see(&mut self, limbs: &LimbCovariance, speed_mps: f64, height_m: f64) {
        let whole_m2 = WHOLE_M2 * limbs.seen * relative_speed_hz(speed_mps, height_m).sqrt();
        if whole_m2 <= 0.0 {
            return;
        }
        let [[cc, cq], [_, qq]] = self.covariance;
        let innovation = limbs.arms_less_legs_m2 / whole_m2 - self.mean[0];
        let variance = cc + (NOISE_M2 / whole_m2).powi(2);
        self.mean = [self.mean[0] + cc / variance * innovation, self.mean[1] + cq / variance * innovation];
        let cross = cq - cc * cq / variance;
        self.covariance = [[cc - cc * cc / variance, cross], [cross, qq - cq * cq / variance]];
    }

    /// The phase of somebody who walks so fast.
    pub(super) fn phase(&self, speed_mps: f64) -> GaitPhase {
        let variance = 0.5 * (self.covariance[0][0] + self.covariance[1][1]);
        GaitPhase::of_wave(self.mean, variance, WIDEST_RAD, speed_mps)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;
    use crate::gait::stride_m;

    const SPEED_MPS: f64 = 1.1;
    const HEIGHT_M: f64 = 1.7;

    /// The phase found and the true one after a walk of 4 s in which the limbs swing by this share of the usual.
    fn walked(share: f64) -> (GaitPhase, f64) {
        let mut limb_phase = LimbPhase::default();
        let mut phase_rad: f64 = 0.0;
        for _ in 0..40 {
            limb_phase.predict(SPEED_MPS, HEIGHT_M, 0.1);
            phase_rad += TAU * SPEED_MPS * 0.1 / stride_m(SPEED_MPS, HEIGHT_M);
            let whole_m2 = WHOLE_M2 * 0.8 * relative_speed_hz(SPEED_MPS, HEIGHT_M).sqrt();
            let arms_less_legs_m2 = share * whole_m2 * (phase_rad - WIDEST_RAD).cos();
            limb_phase.see(&LimbCovariance { arms_less_legs_m2, seen: 0.8 }, SPEED_MPS, HEIGHT_M);
        }
        (limb_phase.phase(SPEED_MPS), phase_rad)
    }

    #[test]
    fn arms_and_legs_tell_the_phase() {
        let (gait, phase_rad) = walked(1.0);
        let off_rad = (gait.phase_rad - phase_rad + PI).rem_euclid(TAU) - PI;
        assert!(off_rad.abs() < 0.2 && gait.concentration > 3.0, "{off_rad} {gait:?}");
    }

    #[test]
    fn limbs_that_hang_still_tell_no_phase() {
        let (gait, _) = walked(0.0);
        assert!(gait.concentration < 0.1, "{gait:?}");
    }

    #[test]
    fn who_stands_has_no_phase() {
        assert_eq!(LimbPhase::default().phase(0.1), GaitPhase::UNKNOWN);
        let mut limb_phase = LimbPhase::default();
        limb_phase.see(&LimbCovariance { arms_less_legs_m2: 0.01, seen: 0.5 }, 0.0, HEIGHT_M);
        assert_eq!(limb_phase, LimbPhase::default());
    }
}
