//! The oriented box of a person (paper, section IV-A: extremes in object space and a rotation matrix M).

use glam::{DMat3, DVec2, DVec3};

use super::Aabb;

/// A box with axes of its own.
///
/// ```
/// use umbracast::geometry::{DMat3, DVec3, Obb};
///
/// let shoulders = Obb {
///     center_m: DVec3::new(0.0, 0.0, 0.9),
///     half_m: DVec3::new(0.15, 0.25, 0.9),
///     site_from_box: DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2),
/// };
/// // Turned by a quarter, the shoulders lie along x.
/// let side_m = shoulders.site_from_box * DVec3::new(0.0, shoulders.half_m.y, 0.0);
/// assert!(side_m.abs_diff_eq(DVec3::new(-0.25, 0.0, 0.0), 1e-12));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obb {
    /// The middle of the box in the site frame.
    pub center_m: DVec3,
    /// Half the edge lengths along the box's own axes.
    pub half_m: DVec3,
    /// The paper's M: columns are the box's axes in the site frame.
    pub site_from_box: DMat3,
}

impl Obb {
    /// The same box seen as an axis-aligned one.
    ///
    /// ```
    /// use umbracast::geometry::{Aabb, DVec3, Obb};
    ///
    /// let same = Obb::from_aabb(&Aabb { min_m: DVec3::ZERO, max_m: DVec3::ONE });
    /// assert_eq!((same.center_m, same.half_m), (DVec3::splat(0.5), DVec3::splat(0.5)));
    /// ```
    pub fn from_aabb(aabb: &Aabb) -> Self {
        Self { center_m: aabb.center_m(), half_m: aabb.size_m() * 0.5, site_from_box: DMat3::IDENTITY }
    }

    /// The box moved over the floor and turned about the vertical through its centre.
    ///
    /// ```
    /// use umbracast::geometry::{Aabb, DVec2, DVec3, Obb};
    ///
    /// let here = Obb::from_aabb(&Aabb { min_m: DVec3::ZERO, max_m: DVec3::ONE });
    /// let there = here.moved_by(DVec2::X, std::f64::consts::PI);
    /// assert_eq!(there.center_m, DVec3::new(1.5, 0.5, 0.5));
    /// assert!(there.site_from_box.x_axis.abs_diff_eq(-DVec3::X, 1e-12));
    /// ```
    #[must_use]
    pub fn moved_by(&self, offset_m: DVec2, turn_rad: f64) -> Self {
        Self {
            center_m: self.center_m + offset_m.extend(0.0),
            half_m: self.half_m,
            site_from_box: DMat3::from_rotation_z(turn_rad) * self.site_from_box,
        }
    }

    /// The box lifted, as by a floor that is higher there.
    ///
    /// ```
    /// use umbracast::geometry::{Aabb, DVec3, Obb};
    ///
    /// let one = Obb::from_aabb(&Aabb { min_m: DVec3::ZERO, max_m: DVec3::ONE });
    /// assert_eq!(one.raised_by(0.5).center_m, DVec3::new(0.5, 0.5, 1.0));
    /// ```
    #[must_use]
    pub fn raised_by(&self, up_m: f64) -> Self {
        Self { center_m: self.center_m + DVec3::Z * up_m, ..*self }
    }
}
