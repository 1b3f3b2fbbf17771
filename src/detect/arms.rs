//! Arms that are stretched out are no people: nothing is below them, and between them is one head.

use super::part::Part;
use crate::geometry::{DVec2, DVec3};

/// The mean of an arm's points is nearer than this to that of its owner's: half the span of arms of a tall adult.
pub(super) const ARM_M: f64 = 0.9;
/// Hands hang no lower than this share of the stature (Drillis and Contini 1966: fingertips .377).
const HAND_SHARE: f64 = 0.37;
/// Of a body that stands, more of the points are below that; of an arm with a hip beside it, fewer.
const LOW_SHARE: f64 = 0.15;
/// Points so near to the highest are the head's.
const HEAD_M: f64 = 0.2;
/// Nobody's head is nearer than this to another's.
const HEADS_M: f64 = 0.3;

/// True when `small` may be an arm of `large`, which stands on the floor.
pub(super) fn is_arm(moved_m: &[DVec3], small: &Part, large: &Part) -> bool {
    let hand_m = HAND_SHARE * large.top_m;
    small.points.len() <= large.points.len()
        && small.mean_m().distance(large.mean_m()) < ARM_M
        && low_share(moved_m, small, hand_m) < LOW_SHARE
        && low_share(moved_m, large, hand_m) >= LOW_SHARE
}

/// True when the highest points of both are of one head: halves of somebody whose arms are stretched out to both sides.
pub(super) fn have_one_head(moved_m: &[DVec3], a: &Part, b: &Part) -> bool {
    head_m(moved_m, a).distance(head_m(moved_m, b)) < HEADS_M
}

fn low_share(moved_m: &[DVec3], part: &Part, below_m: f64) -> f64 {
    let low = part.points.iter().filter(|&&i| moved_m[i as usize].z < below_m).count();
    low as f64 / part.points.len().max(1) as f64
}

fn head_m(moved_m: &[DVec3], part: &Part) -> DVec2 {
    let high = part.points.iter().map(|&i| moved_m[i as usize]).filter(|p| p.z > part.top_m - HEAD_M);
    let (sum_m, n) = high.fold((DVec2::ZERO, 0.0), |(sum_m, n), p| (sum_m + p.truncate(), n + 1.0));
    sum_m / f64::max(n, 1.0)
}
