//! The model of the body axis: a network computes the position of a body's axis from what the sensors saw of it. It ships as
//! `models/body_axis.safetensors`; the card beside it has data and scores.

use super::axis_view::AxisView;
use super::point_network::PointNetwork;
use crate::geometry::DVec2;

/// Unit of the network's offsets.
pub const UNIT_M: f64 = 0.05;
/// A cluster that is no single body shall not be moved about.
const OFFSET_LIMIT_M: f64 = 0.15;
/// Nor believed without end, nor be worth nothing: logarithms of variances in units.
const LOG_VARIANCE: (f64, f64) = (-5.0, 4.0);

/// The network that ships.
pub(super) fn shipped() -> PointNetwork {
    PointNetwork::from_safetensors(include_bytes!("../../models/body_axis.safetensors"))
        .expect("the embedded file is proven by a test")
}

/// Ground point of the body axis, and the covariance of its error, m^2. The network gives the offset from the view's base along
/// and across, in units of [`UNIT_M`], then the logarithms of their variances.
pub fn locate(network: &PointNetwork, view: &AxisView) -> (DVec2, [[f64; 2]; 2]) {
    let outputs = network.outputs(view);
    let offset_m = (DVec2::new(outputs[0], outputs[1]) * UNIT_M).clamp_length_max(OFFSET_LIMIT_M);
    let variance = |i: usize| outputs[i].clamp(LOG_VARIANCE.0, LOG_VARIANCE.1).exp() * UNIT_M * UNIT_M;
    let (along, across) = (variance(2), variance(3));
    let (a, l) = (view.along, view.across);
    let xy = along * a.x * a.y + across * l.x * l.y;
    let covariance =
        [[along * a.x * a.x + across * l.x * l.x, xy], [xy, along * a.y * a.y + across * l.y * l.y]];
    (view.base_m + a * offset_m.x + l * offset_m.y, covariance)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_shipped_network_can_be_read() {
        let _ = super::shipped();
    }
}
