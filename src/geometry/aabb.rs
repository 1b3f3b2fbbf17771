//! The axis-aligned box of a person (paper, section IV-A).

use glam::{DVec2, DVec3};

/// A box along the site's axes, given by its extremes.
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
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min_m: b.min_m.min(p), max_m: b.max_m.max(p) })
    }

    /// The middle of the box.
    pub fn center_m(&self) -> DVec3 {
        (self.min_m + self.max_m) * 0.5
    }

    /// Edge lengths.
    pub fn size_m(&self) -> DVec3 {
        self.max_m - self.min_m
    }

    /// The box moved over the floor, its height kept.
    #[must_use]
    pub fn moved_by(&self, offset_m: DVec2) -> Self {
        let offset = offset_m.extend(0.0);
        Self { min_m: self.min_m + offset, max_m: self.max_m + offset }
    }
}
