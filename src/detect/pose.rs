//! The pose of one body in one frame: where its axis stands, which way it faces if it stands, and where in the stride it is if
//! it walks. One network reads them from what the sensors saw. It ships as `models/pose.safetensors`; the card beside it has
//! data and scores.

use std::f64::consts::PI;

use super::point_network::{OUTPUTS, PointNetwork};
use super::pose_view::PoseView;
use crate::gait::Gait;
use crate::geometry::DVec2;

/// Unit of the network's offsets.
pub const UNIT_M: f64 = 0.05;
/// Of what it says of the hands' swing.
pub const SWING_UNIT: f64 = 0.1;
/// A cluster that is no single body shall not be moved about: half a pram's length at most.
const OFFSET_LIMIT_M: f64 = 0.5;
/// Nor believed without end, nor be worth nothing: logarithms of variances in units.
pub const LOG_VARIANCE: (f64, f64) = (-5.0, 4.0);
/// The same of how far hands swing: many are quite still, and whoever is sure of that learns nothing else.
pub const SWING_LOG_VARIANCE: (f64, f64) = (-2.0, 4.0);

/// Steps to the likeliest heading.
const NEWTON_STEPS: usize = 4;
/// A body that is as round as this tells nothing: one over the variance of its heading.
const PRECISION_MIN_PER_RAD2: f64 = 0.05;

/// A body as one frame shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Ground point of the body axis.
    pub position_m: DVec2,
    /// Covariance of its error, m^2.
    pub covariance_m2: [[f64; 2]; 2],
    /// Of who stands.
    pub facing: Option<Facing>,
    /// Of who walks.
    pub gait: Option<Gait>,
}

/// Which way a body faces, as one frame tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// The likeliest heading, counter-clockwise from +x.
    pub heading_rad: f64,
    /// Variance about it, and about its opposite.
    pub variance_rad2: f64,
    /// Logarithm of how much likelier it is than its opposite.
    pub log_odds: f64,
}

/// The network that ships.
pub(super) fn shipped() -> PointNetwork {
    PointNetwork::from_safetensors(include_bytes!("../../models/pose.safetensors"))
        .expect("the embedded file is proven by a test")
}

/// Reads the poses of bodies, best of all people of a frame at once.
pub fn poses(network: &PointNetwork, views: &[PoseView]) -> impl Iterator<Item = Pose> {
    views.iter().zip(network.outputs(views)).map(|(view, outputs)| pose(outputs, view))
}

/// What the network's numbers say of one body: the offset from the view's base along and across, in units of [`UNIT_M`], and the
/// logarithms of their variances; then four numbers of the heading's density; then the cosine and the sine of the stride's phase
/// in the view, times its concentration (of a von Mises distribution); then how far the hands swing, left and right in the view, in
/// units of [`SWING_UNIT`], and the logarithms of their variances.
fn pose(outputs: [f64; OUTPUTS], view: &PoseView) -> Pose {
    let [
        along,
        across,
        log_variance_along,
        log_variance_across,
        a,
        b,
        c,
        d,
        cos,
        sin,
        left,
        right,
        log_left,
        log_right,
    ] = outputs;
    let offset_m = (DVec2::new(along, across) * UNIT_M).clamp_length_max(OFFSET_LIMIT_M);
    let [along_m2, across_m2] = [log_variance_along, log_variance_across]
        .map(|log| log.clamp(LOG_VARIANCE.0, LOG_VARIANCE.1).exp() * UNIT_M * UNIT_M);
    let swing_sigma =
        |log: f64| (0.5 * log.clamp(SWING_LOG_VARIANCE.0, SWING_LOG_VARIANCE.1)).exp() * SWING_UNIT;
    let (x, y) = (view.along, view.across);
    let xy = along_m2 * x.x * x.y + across_m2 * y.x * y.y;
    Pose {
        position_m: view.base_m + x * offset_m.x + y * offset_m.y,
        covariance_m2: [
            [along_m2 * x.x * x.x + across_m2 * y.x * y.x, xy],
            [xy, along_m2 * x.y * x.y + across_m2 * y.y * y.y],
        ],
        facing: view.stands().then(|| facing([a, b, c, d], view)),
        gait: (!view.stands()).then(|| Gait {
            phase_rad: f64::atan2(sin, cos) + view.phase_of_mirror_rad(),
            concentration: cos.hypot(sin),
            hand_swing: view.sides([left, right]).map(|swing| swing * SWING_UNIT),
            hand_swing_sigma: view.sides([log_left, log_right]).map(swing_sigma),
        }),
    }
}

/// Which way a body faces. The density of a heading at the angle `t` from the line of sight is proportional to
/// `exp(a cos t + b sin t + c cos 2t + d sin 2t)`, a generalised von Mises distribution.
fn facing([a, b, c, d]: [f64; 4], view: &PoseView) -> Facing {
    // Logarithm of the density, its slope, and how sharply it bends down.
    let at = |t: f64| {
        let ((sin, cos), (sin_2, cos_2)) = (t.sin_cos(), (2.0 * t).sin_cos());
        let bend = a * cos + b * sin + 4.0 * (c * cos_2 + d * sin_2);
        (
            a * cos + b * sin + c * cos_2 + d * sin_2,
            b * cos - a * sin + 2.0 * (d * cos_2 - c * sin_2),
            bend.max(PRECISION_MIN_PER_RAD2),
        )
    };
    // Trunks are wider than deep, so there are two summits, nearly opposite: the first harmonic moves them a little.
    let summit = |start: f64| {
        let step = |t: f64, _| {
            let (_, slope, precision) = at(t);
            t + (slope / precision).clamp(-0.5, 0.5)
        };
        let t = (0..NEWTON_STEPS).fold(start, step);
        let (log_density, _, precision) = at(t);
        (log_density, precision, t)
    };
    let start = 0.5 * d.atan2(c);
    let (one, other) = (summit(start), summit(start + PI));
    let (log_density, precision, t) = if one.0 >= other.0 { one } else { other };
    Facing {
        heading_rad: DVec2::to_angle(view.along * t.cos() + view.across * t.sin()),
        variance_rad2: 1.0 / precision,
        log_odds: log_density - one.0.min(other.0),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_shipped_network_can_be_read() {
        let _ = super::shipped();
    }
}
