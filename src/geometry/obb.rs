//! The oriented box of a person (paper, section IV-A: extremes in object space and a rotation matrix M).

use glam::{DMat3, DVec2, DVec3};

use super::Aabb;

/// A box with axes of its own.
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
    pub fn from_aabb(aabb: &Aabb) -> Self {
        Self { center_m: aabb.center_m(), half_m: aabb.size_m() * 0.5, site_from_box: DMat3::IDENTITY }
    }

    /// The box moved over the floor and turned about the vertical through its centre.
    #[must_use]
    pub fn moved_by(&self, offset_m: DVec2, turn_rad: f64) -> Self {
        Self {
            center_m: self.center_m + offset_m.extend(0.0),
            half_m: self.half_m,
            site_from_box: DMat3::from_rotation_z(turn_rad) * self.site_from_box,
        }
    }
}
