//! Algorithm 1 of the paper, with its misprints corrected.
//!
//! Line 10 multiplies positions; the text means directions seen from the access point, so positions are taken
//! from it first. Line 11 admits p when q is the nearer one; the text says that only people nearer to the access
//! point than the considered one are tested, so the comparison is turned round. The hit has to lie on the
//! segment between the access point and the centre of q's box, not on the infinite ray.

use crate::geometry::{Aabb, DVec2, DVec3, Obb, slab};

/// A person's box, of the kind that the config chooses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PersonBox {
    /// Along the site's axes.
    Aabb(Aabb),
    /// Along its own axes.
    Obb(Obb),
}

impl PersonBox {
    /// BoundingBoxTransform (Algorithm 1, line 8): moved to the predicted position, and turned if it can be.
    #[must_use]
    pub fn moved_by(&self, offset_m: DVec2, turn_rad: f64) -> Self {
        match self {
            Self::Aabb(aabb) => Self::Aabb(aabb.moved_by(offset_m)),
            Self::Obb(obb) => Self::Obb(obb.moved_by(offset_m, turn_rad)),
        }
    }

    /// Lifted, where it moves to a higher floor.
    #[must_use]
    pub fn raised_by(&self, up_m: f64) -> Self {
        match self {
            Self::Aabb(aabb) => Self::Aabb(aabb.raised_by(up_m)),
            Self::Obb(obb) => Self::Obb(obb.raised_by(up_m)),
        }
    }

    /// The end of the ray: the centre of the box.
    pub fn center_m(&self) -> DVec3 {
        match self {
            Self::Aabb(aabb) => aabb.center_m(),
            Self::Obb(obb) => obb.center_m,
        }
    }

    /// CheckIntersect (line 12): where along the segment the box is first met.
    fn hit(&self, start_m: DVec3, end_m: DVec3) -> Option<f64> {
        match self {
            Self::Aabb(aabb) => slab::hit_aabb(aabb, start_m, end_m),
            Self::Obb(obb) => slab::hit_obb(obb, start_m, end_m),
        }
    }
}

/// One step (lines 5 to 24): marks in `blocked` every person whose ray from the access point meets a nearer
/// person's box. `people` are the moved positions with their moved boxes. Whoever is marked already is not
/// tested again, which is what makes `blocked` that of the window.
pub fn cast_step(access_point_m: DVec3, people: &[(DVec2, PersonBox)], blocked: &mut [bool]) {
    let from_ap = |position_m: DVec2| position_m - access_point_m.truncate();
    for (p, &(position_p, box_p)) in people.iter().enumerate() {
        for (q, &(position_q, box_q)) in people.iter().enumerate() {
            let (to_p, to_q) = (from_ap(position_p), from_ap(position_q));
            let nearer = to_p.length_squared() < to_q.length_squared(); // line 11, turned round
            let same_side = to_q.dot(to_p) > 0.0; // line 10, seen from the access point
            // q's own box is never a candidate, so the nearest box that is hit (lines 13 to 16) is always
            // another's: any hit means blocked (lines 21, 22).
            if p != q
                && !blocked[q]
                && nearer
                && same_side
                && box_p.hit(access_point_m, box_q.center_m()).is_some()
            {
                blocked[q] = true;
            }
        }
    }
}
