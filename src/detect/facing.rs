//! Which way somebody faces who stands: a network reads it from what the sensors saw of the body. It ships as
//! `models/facing.safetensors`; the card beside it has data and scores.

use std::f64::consts::PI;

use super::axis_view::AxisView;
use super::point_network::PointNetwork;
use crate::geometry::DVec2;

/// Steps to the likeliest heading.
const NEWTON_STEPS: usize = 4;
/// A body that is as round as this tells nothing: one over the variance of its heading.
const PRECISION_MIN_PER_RAD2: f64 = 0.05;

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
    PointNetwork::from_safetensors(include_bytes!("../../models/facing.safetensors"))
        .expect("the embedded file is proven by a test")
}

/// Which way the body faces. Of the network's outputs `a`, `b`, `c` and `d`, the density of a heading at the angle `t` from the line
/// of sight is proportional to `exp(a cos t + b sin t + c cos 2t + d sin 2t)`, a generalised von Mises distribution.
pub fn face(network: &PointNetwork, view: &AxisView) -> Facing {
    let [a, b, c, d] = network.outputs(view);
    let log_density = |t: f64| {
        let ((sin, cos), (sin_2, cos_2)) = (t.sin_cos(), (2.0 * t).sin_cos());
        a * cos + b * sin + c * cos_2 + d * sin_2
    };
    let slope = |t: f64| {
        let ((sin, cos), (sin_2, cos_2)) = (t.sin_cos(), (2.0 * t).sin_cos());
        b * cos - a * sin + 2.0 * (d * cos_2 - c * sin_2)
    };
    let precision = |t: f64| {
        let ((sin, cos), (sin_2, cos_2)) = (t.sin_cos(), (2.0 * t).sin_cos());
        (a * cos + b * sin + 4.0 * (c * cos_2 + d * sin_2)).max(PRECISION_MIN_PER_RAD2)
    };
    // Trunks are wider than deep, so there are two summits, nearly opposite: the first harmonic moves them a little.
    let summit =
        |start: f64| (0..NEWTON_STEPS).fold(start, |t, _| t + (slope(t) / precision(t)).clamp(-0.5, 0.5));
    let start = 0.5 * d.atan2(c);
    let [one, other] = [start, start + PI].map(summit);
    let t = if log_density(one) >= log_density(other) { one } else { other };
    let ahead = view.along * t.cos() + view.across * t.sin();
    Facing {
        heading_rad: DVec2::to_angle(ahead),
        variance_rad2: 1.0 / precision(t),
        log_odds: (log_density(one) - log_density(other)).abs(),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_shipped_network_can_be_read() {
        let _ = super::shipped();
    }
}
