//! How people walk: what counts as walking, the length of a stride, the phase in it, and the sway of the trunk.
//!
//! The gait depends on speed over the height of the hips. Stride law, hip height and trunk sway: Boulic,
//! Magnenat-Thalmann and Thalmann, "A global human walking model with real-time kinematic personification", The
//! Visual Computer 6 (1990).

use std::f64::consts::PI;

/// Who is slower stands: he may shift his weight and look anywhere, but not in strides.
pub const WALKS_FROM_MPS: f64 = 0.3;
/// The trunk is farthest to the left so long after the right heel touched the floor: it rides over the foot that stands.
pub const LEFTMOST_RAD: f64 = 1.7 * PI;
/// The trunk is farthest ahead so long after each heel touched the floor, as the source has it at a usual walk.
pub const FOREMOST_RAD: f64 = 0.7 * PI;
/// Stride over sqrt(speed x stature), sqrt(s). The cadence that follows is within 4 % of what clinics measure on adults
/// from 1.0 to 1.9 m/s.
const STRIDE: f64 = 0.98;
/// The hip joint above the floor, share of the height.
const HIP_SHARE: f64 = 0.53;
/// How far hands swing, and how that differs: of who walks in the scenes that the network of the pose learns from (`models/pose.md`).
pub const HAND_SWING: f64 = 0.065;
pub const HAND_SWING_SIGMA: f64 = 0.05;
/// From this speed over hip height (1/s) on the trunk's sway is all there.
const FULL_SWAY_HZ: f64 = 0.5;

/// How somebody walks: where in the stride, a von Mises distribution, and how far each hand swings.
///
/// ```
/// use umbracast::track::Gait;
///
/// // Who stands has none.
/// assert_eq!(Gait::UNKNOWN.concentration, 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gait {
    /// Since the right heel touched the floor; a stride is a full turn.
    pub phase_rad: f64,
    /// 0: nothing is known. From 2 on about one over the variance.
    pub concentration: f64,
    /// How far the left and the right hand swing to either side of their middles: shares of the height for a speed of one hip
    /// height a second; 0 of a hand that is still, less of one that swings with the leg of its side.
    pub hand_swing: [f64; 2],
    /// One standard deviation of both.
    pub hand_swing_sigma: [f64; 2],
}

impl Gait {
    /// Any phase, and hands of whom nothing is known.
    pub const UNKNOWN: Self = Self {
        phase_rad: 0.0,
        concentration: 0.0,
        hand_swing: [HAND_SWING; 2],
        hand_swing_sigma: [HAND_SWING_SIGMA; 2],
    };
}

impl Default for Gait {
    fn default() -> Self {
        Self::UNKNOWN
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
pub fn stride_hz(speed_mps: f64, height_m: f64) -> f64 {
    if speed_mps > 0.0 { speed_mps / stride_m(speed_mps, height_m) } else { 0.0 }
}

/// Share of the full sway of the trunk at a speed over hip height: it rises with the speed and stays (the source's
/// published codes jump where this bends).
pub fn sway_share(relative_speed_hz: f64) -> f64 {
    if relative_speed_hz < FULL_SWAY_HZ { 4.0 * relative_speed_hz * (1.0 - relative_speed_hz) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strides_are_as_long_as_the_way_walked_in_one() {
        for speed_mps in [0.5, 1.3, 2.0] {
            let walked_m = speed_mps / stride_hz(speed_mps, 1.75);
            assert!((walked_m - stride_m(speed_mps, 1.75)).abs() < 1e-12);
        }
        assert_eq!(stride_hz(0.0, 1.75), 0.0);
    }

    #[test]
    fn sway_is_all_there_where_the_curve_ends() {
        assert!((sway_share(FULL_SWAY_HZ - 1e-9) - 1.0).abs() < 1e-8);
        assert_eq!((sway_share(0.0), sway_share(2.0)), (0.0, 1.0));
    }
}
