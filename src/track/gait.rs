//! How the body sways while its owner walks straight on.
//!
//! Pelvis and trunk go from side to side once a stride, and ahead and back once a step, by a few centimetres. A
//! detection is of the swaying body, the person's way is what it sways about: left out, the sway is an error that
//! lasts over frames, and half a stride of it looks like a turn. It is followed as two oscillations whose size and
//! phase are not known beforehand but whose pace is: people of a height at a speed all walk about alike. What is
//! found of the sway to the side tells a little of where in the stride a person is; arms and legs tell more
//! (`stride.rs`).

use std::f64::consts::{PI, TAU};

use crate::config::TrackConfig;
use crate::geometry::DVec2;

/// Where the state holds the sway to the left, with its quadrature after it.
pub(super) const LEFT: usize = 4;
/// The same ahead.
pub(super) const AHEAD: usize = 6;
/// Stride over sqrt(speed x stature), sqrt(s): Boulic, Magnenat-Thalmann and Thalmann 1990; the cadence that follows is
/// within 4 % of what clinics measure on adults from 1.0 to 1.9 m/s.
const STRIDE: f64 = 0.98;
/// The hip joint above the floor, share of the height. Gait goes by speed over it (the same source).
const HIP_SHARE: f64 = 0.53;
/// From standing up to this speed the sway grows to its full size.
const FULL_SWAY_MPS: f64 = 0.45;
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

    /// What the sway to the left with its quadrature tells, each known to a variance of `variance_m2`.
    pub(super) fn of_sway(left_m: f64, quadrature_m: f64, variance_m2: f64, speed_mps: f64) -> Self {
        Self::of_wave([left_m, quadrature_m], variance_m2, LEFTMOST_RAD, speed_mps)
    }

    /// What an oscillation with its quadrature tells that is largest at the phase `largest_rad`.
    pub(super) fn of_wave(wave: [f64; 2], variance: f64, largest_rad: f64, speed_mps: f64) -> Self {
        let [value, quadrature] = wave;
        let squared = value * value + quadrature * quadrature;
        if speed_mps < WALKS_FROM_MPS || squared == 0.0 {
            return Self::UNKNOWN;
        }
        // [`Wave::turned`]: the quadrature is minus the sine of the angle since the largest value.
        let since_largest_rad = f64::atan2(-quadrature, value);
        Self {
            phase_rad: (since_largest_rad + largest_rad).rem_euclid(TAU),
            concentration: squared / variance,
        }
    }

    /// The surer one of two. They are not made one: both come from the same detections.
    pub(super) fn surer(self, other: Self) -> Self {
        if other.concentration > self.concentration { other } else { self }
    }
}

/// Speed over the height of the hips.
pub fn relative_speed_hz(speed_mps: f64, height_m: f64) -> f64 {
    speed_mps / (HIP_SHARE * height_m)
}

/// Length of a stride; the phase advances with the way walked.
pub fn stride_m(speed_mps: f64, height_m: f64) -> f64 {
    STRIDE * (speed_mps * height_m).sqrt()
}

/// Strides in a second.
pub(super) fn stride_hz(speed_mps: f64, height_m: f64) -> f64 {
    if speed_mps > 0.0 { speed_mps / stride_m(speed_mps, height_m) } else { 0.0 }
}

/// Unit vectors along which the sway is measured.
pub(super) struct Axes {
    pub(super) left: DVec2,
    pub(super) ahead: DVec2,
}

impl Axes {
    pub(super) fn along(velocity_mps: DVec2) -> Self {
        let ahead = velocity_mps.normalize_or_zero();
        Self { left: ahead.perp(), ahead }
    }
}

/// What a span of time does to both oscillations.
pub(super) struct Sway {
    pub(super) left: Wave,
    pub(super) ahead: Wave,
}

/// What a span of time does to one: turns it by its pace, forgets some of it and adds as much anew, so that its
/// variance stays.
pub(super) struct Wave {
    cos: f64,
    sin: f64,
    /// Added to the variances.
    pub(super) new: f64,
}

impl Sway {
    pub(super) fn after(config: &TrackConfig, speed_mps: f64, height_m: f64, dt_s: f64) -> Self {
        let stride_hz = stride_hz(speed_mps, height_m);
        let size = (speed_mps / FULL_SWAY_MPS).min(1.0);
        let wave = |sway_m: f64, pace_hz: f64| {
            Wave::after(config.sway_lasts_s, (size * sway_m).powi(2), pace_hz, dt_s)
        };
        Self { left: wave(config.sway_left_m, stride_hz), ahead: wave(config.sway_ahead_m, 2.0 * stride_hz) }
    }
}

impl Wave {
    /// One of `variance` and a pace of `pace_hz` that is forgotten after `lasts_s`.
    pub(super) fn after(lasts_s: f64, variance: f64, pace_hz: f64, dt_s: f64) -> Self {
        let kept = (-dt_s / lasts_s).exp();
        let (sin, cos) = (TAU * pace_hz * dt_s).sin_cos();
        Self { cos: kept * cos, sin: kept * sin, new: variance * (1.0 - kept * kept) }
    }

    pub(super) fn turned(&self, a: f64, b: f64) -> (f64, f64) {
        (self.cos * a + self.sin * b, self.cos * b - self.sin * a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::kalman::Filter;
    use crate::{Config, Mode};

    const SPEED_MPS: f64 = 1.1;
    const HEIGHT_M: f64 = 1.7;

    /// A walk of 8 s along x whose detections sway by so much to the side, and the gait found at its end; the phase
    /// began with the right heel.
    fn walked(mode: Mode, sway_m: f64) -> (Gait, f64) {
        let config = Config::for_mode(mode).track;
        let noise_m2 = [[1e-4, 0.0], [0.0, 1e-4]];
        let mut filter = Filter::new(&config, DVec2::ZERO, 0.9, 1e-4);
        let mut phase_rad: f64 = 0.0;
        for frame in 1..80 {
            filter.predict(&config, HEIGHT_M, 0.1);
            phase_rad += TAU * SPEED_MPS * 0.1 / stride_m(SPEED_MPS, HEIGHT_M);
            let left_m = sway_m * (phase_rad - LEFTMOST_RAD).cos();
            filter.correct(DVec2::new(SPEED_MPS * 0.1 * f64::from(frame), left_m), 0.9, noise_m2);
        }
        (filter.gait(), phase_rad)
    }

    #[test]
    fn the_phase_is_found_in_the_sway() {
        let (gait, phase_rad) = walked(Mode::Default, 0.025);
        let off_rad = (gait.phase_rad - phase_rad + PI).rem_euclid(TAU) - PI;
        assert!(off_rad.abs() < 0.25, "{gait:?}, {}", phase_rad.rem_euclid(TAU));
        assert!(gait.concentration > 5.0, "{gait:?}");
    }

    #[test]
    fn without_sway_or_model_of_it_the_phase_is_hardly_known() {
        let (gait, _) = walked(Mode::Default, 0.0);
        assert!(gait.concentration < 0.5, "{gait:?}");
        assert_eq!(walked(Mode::Paper, 0.025).0, Gait::UNKNOWN);
    }

    #[test]
    fn who_stands_has_no_gait() {
        assert_eq!(Gait::of_sway(0.02, 0.0, 1e-4, 0.1), Gait::UNKNOWN);
    }
}
