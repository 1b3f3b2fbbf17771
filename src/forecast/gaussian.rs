//! A Gaussian in the plane.

use crate::geometry::DVec2;

/// Mean and covariance of a position on the floor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gaussian2 {
    /// Metres.
    pub mean_m: DVec2,
    /// Variance along x, m^2.
    pub xx_m2: f64,
    /// Covariance, m^2.
    pub xy_m2: f64,
    /// Variance along y, m^2.
    pub yy_m2: f64,
}
