//! The slab test (paper, section IV-C): does a segment meet a box, and where first?

use glam::DVec3;

use super::{Aabb, Obb};

/// Where along the segment from `start` to `end` the box is first met, as a fraction from 0 to 1, or `None`.
/// A segment that starts inside meets the box at 0. Touching a face counts as meeting.
pub fn hit_aabb(aabb: &Aabb, start_m: DVec3, end_m: DVec3) -> Option<f64> {
    let direction = end_m - start_m;
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        let (s, d) = (start_m[axis], direction[axis]);
        let (lo, hi) = (aabb.min_m[axis], aabb.max_m[axis]);
        if d == 0.0 {
            if s < lo || s > hi {
                return None;
            }
            continue;
        }
        let (a, b) = ((lo - s) / d, (hi - s) / d);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave).then_some(enter)
}

/// [`hit_aabb`] in the box's own space. The segment is turned by the transpose of the box's rotation; nothing
/// is inverted.
pub fn hit_obb(obb: &Obb, start_m: DVec3, end_m: DVec3) -> Option<f64> {
    let box_from_site = obb.site_from_box.transpose();
    let aabb = Aabb { min_m: -obb.half_m, max_m: obb.half_m };
    hit_aabb(&aabb, box_from_site * (start_m - obb.center_m), box_from_site * (end_m - obb.center_m))
}
