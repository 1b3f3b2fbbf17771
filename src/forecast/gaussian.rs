//! A Gaussian in the plane.

use crate::geometry::DVec2;

/// Mean and covariance of a position on the floor.
///
/// ```
/// use umbracast::{forecast::Gaussian2, geometry::DVec2};
///
/// let there = Gaussian2 { mean_m: DVec2::new(1.0, 2.0), xx_m2: 0.04, xy_m2: 0.0, yy_m2: 0.01 };
/// assert_eq!((there.xx_m2.sqrt(), there.yy_m2.sqrt()), (0.2, 0.1));
/// ```
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
