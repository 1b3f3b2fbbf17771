//! Where in the stride a walking person is, from the sway of the trunk.
//!
//! A trunk rides over the foot that stands: a person's detections swing by some 25 mm to the left and right of the
//! way once a stride, and the stride follows from speed and height. Demodulated over the last strides, what the
//! detections lie beside the prediction tells the phase. Measured on tuning scenes: the errors across the way of
//! ORCA's walkers repeat after a stride with a correlation of 0.5, and two thirds of them are that swing.

use std::f64::consts::{PI, TAU};

use crate::geometry::DVec2;

/// Stride over sqrt(speed x height), sqrt(s) (Boulic and Thalmann 1990).
const STRIDE: f64 = 0.98;
/// No detection errs less than this besides the sway.
const NOISE_M: f64 = 0.01;
/// So many detections without sway are believed before any is seen.
const DOUBT: f64 = 3.0;
/// Half of a sway is believed whose phase is this concentrated.
const BELIEVED_AT: f64 = 6.0;
/// Who is slower may shift his weight, but not in strides.
const WALKS_FROM_MPS: f64 = 0.3;
/// The trunk is farthest to the left so long after the right heel touches the floor.
const LEFTMOST_RAD: f64 = 1.7 * PI;

/// The phase of a gait and how sure it is: a von Mises distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gait {
    /// Since the right heel touched the floor; a stride is a full turn.
    pub phase_rad: f64,
    /// 0: nothing is known. From 2 on about one over the variance.
    pub concentration: f64,
}

impl Gait {
    /// Any phase.
    pub const UNKNOWN: Self = Self { phase_rad: 0.0, concentration: 0.0 };
}

/// Length of a stride; the phase advances with the way walked.
pub fn stride_m(speed_mps: f64, height_m: f64) -> f64 {
    STRIDE * (speed_mps * height_m).sqrt()
}

/// Remembers the sway.
#[derive(Debug, Clone, Copy)]
pub struct Sway {
    /// How long a detection is remembered; 0: not at all.
    memory_s: f64,
    /// Sum of what detections lay to the left, turned to the present: a complex number.
    swing_m: DVec2,
    /// How many detections are in it, old ones less.
    weight: f64,
    /// Sum of their squares.
    power_m2: f64,
}

impl Sway {
    /// Nothing is known yet.
    pub fn new(memory_s: f64) -> Self {
        Self { memory_s, swing_m: DVec2::ZERO, weight: 0.0, power_m2: 0.0 }
    }

    /// Time goes on.
    pub fn advance(&mut self, speed_mps: f64, height_m: f64, step_s: f64) {
        if self.weight == 0.0 {
            return;
        }
        let stride_m = stride_m(speed_mps, height_m);
        let turn_rad = if stride_m > 0.0 { TAU * speed_mps * step_s / stride_m } else { 0.0 };
        let kept = (-step_s / self.memory_s).exp();
        self.swing_m = self.swing_m.rotate(DVec2::from_angle(turn_rad)) * kept;
        self.weight *= kept;
        self.power_m2 *= kept;
    }

    /// A detection lies `left_m` to the left of where it was predicted.
    pub fn see(&mut self, left_m: f64, speed_mps: f64) {
        if speed_mps >= WALKS_FROM_MPS && self.memory_s > 0.0 {
            self.swing_m += DVec2::new(left_m, 0.0);
            self.weight += 1.0;
            self.power_m2 += left_m * left_m;
        }
    }

    /// How far to the left the trunk is now, as far as that is known.
    pub fn left_m(&self) -> f64 {
        let concentration = self.gait().concentration;
        let known = concentration / (concentration + BELIEVED_AT);
        2.0 * self.swing_m.x / (self.weight + DOUBT) * known
    }

    /// What is known now.
    pub fn gait(&self) -> Gait {
        if self.weight == 0.0 {
            return Gait::UNKNOWN;
        }
        // Of a swing of size a in noise of variance s2 the phase's likelihood is that of von Mises with a |sum| / s2.
        let size_m = 2.0 * self.swing_m.length() / (self.weight + DOUBT);
        let noise_m2 = (self.power_m2 / self.weight - 0.5 * size_m * size_m).max(NOISE_M * NOISE_M);
        let concentration = size_m * self.swing_m.length() / noise_m2;
        Gait { phase_rad: (self.swing_m.to_angle() + LEFTMOST_RAD).rem_euclid(TAU), concentration }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEED_MPS: f64 = 1.1;
    const HEIGHT_M: f64 = 1.7;

    /// A walk of 4 s with a sway of so much, beginning with the right heel; `noise_m` comes on top.
    fn walked(sway_m: f64, noise_m: impl Fn(u32) -> f64) -> (Sway, f64) {
        let (mut sway, mut phase_rad) = (Sway::new(2.0), 0.0);
        for frame in 0..40 {
            sway.advance(SPEED_MPS, HEIGHT_M, 0.1);
            phase_rad += TAU * SPEED_MPS * 0.1 / stride_m(SPEED_MPS, HEIGHT_M);
            sway.see(sway_m * (phase_rad - LEFTMOST_RAD).cos() + noise_m(frame), SPEED_MPS);
        }
        (sway, phase_rad.rem_euclid(TAU))
    }

    #[test]
    fn the_phase_is_found_in_the_sway_and_goes_on_with_the_way() {
        let (mut sway, phase_rad) = walked(0.025, |_| 0.0);
        let gait = sway.gait();
        assert!((gait.phase_rad - phase_rad).abs() < 0.15, "{gait:?}, {phase_rad}");
        assert!(gait.concentration > 10.0, "{gait:?}");
        let half_a_stride_s = 0.5 * stride_m(SPEED_MPS, HEIGHT_M) / SPEED_MPS;
        let left_m = sway.left_m();
        sway.advance(SPEED_MPS, HEIGHT_M, half_a_stride_s);
        assert!(sway.left_m() * left_m < 0.0, "{left_m}, then {}", sway.left_m());
    }

    #[test]
    fn without_sway_or_before_any_detection_the_phase_is_hardly_known() {
        // Noise of 25 mm that does not repeat with the stride.
        let (sway, _) = walked(0.0, |frame| 0.025 * f64::from(frame * 7919 % 13) / 6.0 - 0.025);
        assert!(sway.gait().concentration < 1.5, "{:?}", sway.gait());
        assert_eq!((Sway::new(2.0).gait().concentration, Sway::new(2.0).left_m()), (0.0, 0.0));
    }

    #[test]
    fn who_stands_has_no_gait() {
        let mut sway = Sway::new(2.0);
        (0..20).for_each(|frame| sway.see(0.03 * f64::from(frame % 2), 0.1));
        assert_eq!(sway.gait().concentration, 0.0);
    }
}
