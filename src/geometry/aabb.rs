//! The axis-aligned box of a person (paper, section IV-A).

use glam::{DVec2, DVec3};

/// A box along the site's axes, given by its extremes.
///
/// ```
/// use umbracast::geometry::{Aabb, DVec3};
///
/// let person = Aabb { min_m: DVec3::new(-0.2, -0.3, 0.0), max_m: DVec3::new(0.2, 0.3, 1.8) };
/// assert_eq!(person.size_m(), DVec3::new(0.4, 0.6, 1.8));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest x, y and z, metres.
    pub min_m: DVec3,
    /// Largest x, y and z, metres.
    pub max_m: DVec3,
}

impl Aabb {
    /// The box that holds nothing and grows with every point.
    pub const EMPTY: Self = Self { min_m: DVec3::INFINITY, max_m: DVec3::NEG_INFINITY };

    /// The smallest box round the points; [`Aabb::EMPTY`] when there are none.
    ///
    /// ```
    /// use umbracast::geometry::{Aabb, DVec3};
    ///
    /// let corners = [DVec3::new(1.0, 0.0, 2.0), DVec3::new(0.0, 3.0, 1.0)];
    /// assert_eq!(Aabb::around(corners).max_m, DVec3::new(1.0, 3.0, 2.0));
    /// assert_eq!(Aabb::around([]), Aabb::EMPTY);
    /// ```
    #[inline]
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min_m: b.min_m.min(p), max_m: b.max_m.max(p) })
    }

    /// The middle of the box.
    ///
    /// ```
    /// use umbracast::geometry::{Aabb, DVec3};
    ///
    /// assert_eq!(Aabb { min_m: DVec3::ZERO, max_m: DVec3::ONE }.center_m(), DVec3::splat(0.5));
    /// ```
    #[inline]
    pub fn center_m(&self) -> DVec3 {
        (self.min_m + self.max_m) * 0.5
    }

    /// Edge lengths.
    ///
    /// ```
    /// use umbracast::geometry::{Aabb, DVec3};
    ///
    /// assert_eq!(Aabb { min_m: -DVec3::ONE, max_m: DVec3::ONE }.size_m(), DVec3::splat(2.0));
    /// ```
    #[inline]
    pub fn size_m(&self) -> DVec3 {
        self.max_m - self.min_m
    }

    /// The box moved over the floor, its height kept.
    ///
    /// ```
    /// use umbracast::geometry::{Aabb, DVec2, DVec3};
    ///
    /// let moved = Aabb { min_m: DVec3::ZERO, max_m: DVec3::ONE }.moved_by(DVec2::new(2.0, 3.0));
    /// assert_eq!(moved.min_m, DVec3::new(2.0, 3.0, 0.0));
    /// ```
    #[must_use]
    pub fn moved_by(&self, offset_m: DVec2) -> Self {
        let offset = offset_m.extend(0.0);
        Self { min_m: self.min_m + offset, max_m: self.max_m + offset }
    }

    /// The box lifted, as by a floor that is higher there.
    ///
    /// ```
    /// use umbracast::geometry::{Aabb, DVec3};
    ///
    /// let raised = Aabb { min_m: DVec3::ZERO, max_m: DVec3::ONE }.raised_by(0.5);
    /// assert_eq!((raised.min_m.z, raised.max_m.z), (0.5, 1.5));
    /// ```
    #[must_use]
    pub fn raised_by(&self, up_m: f64) -> Self {
        let up = DVec3::Z * up_m;
        Self { min_m: self.min_m + up, max_m: self.max_m + up }
    }
}
