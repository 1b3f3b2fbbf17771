//! The sway of a body whose owner walks straight on.
//!
//! Pelvis and trunk go from side to side once a stride (mediolaterally), and ahead and back once a step
//! (anteroposteriorly), by a few centimetres. A detection is of the swaying body, but the person's path is the line
//! about which it sways. Without a model of it, sway is an error that lasts over frames, and half a stride of it
//! looks like a turn. Two oscillations follow it. Their size and phase are unknown at first, but their pace is known:
//! people of one height and speed walk alike.

use std::f64::consts::TAU;

use crate::gait::{relative_speed_hz, stride_hz, sway_share};
use crate::geometry::DVec2;

/// Where the state holds the mediolateral sway, to the left, with its quadrature after it.
pub(super) const LEFT: usize = 4;
/// The same of the anteroposterior sway, ahead.
pub(super) const AHEAD: usize = 6;
/// Time after which size and phase of an oscillation are forgotten, seconds.
pub(super) const LASTS_S: f64 = 3.0;

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
    /// Of somebody `height_m` tall; `sway_m` is one standard deviation to the left and ahead at full size.
    pub(super) fn after(sway_m: [f64; 2], speed_mps: f64, height_m: f64, dt_s: f64) -> Self {
        let stride_hz = stride_hz(speed_mps, height_m);
        let size = sway_share(relative_speed_hz(speed_mps, height_m));
        let wave = |sway_m: f64, pace_hz: f64| Wave::after((size * sway_m).powi(2), pace_hz, dt_s);
        Self { left: wave(sway_m[0], stride_hz), ahead: wave(sway_m[1], 2.0 * stride_hz) }
    }
}

impl Wave {
    /// One of `variance` and a pace of `pace_hz`.
    pub(super) fn after(variance: f64, pace_hz: f64, dt_s: f64) -> Self {
        let kept = (-dt_s / LASTS_S).exp();
        let (sin, cos) = (TAU * pace_hz * dt_s).sin_cos();
        Self { cos: kept * cos, sin: kept * sin, new: variance * (1.0 - kept * kept) }
    }

    pub(super) fn turned(&self, a: f64, b: f64) -> (f64, f64) {
        (self.cos * a + self.sin * b, self.cos * b - self.sin * a)
    }
}
