//! Tells outstretched arms from people: nothing is below the arms, and one head is between them.

use super::part::Part;
use crate::geometry::{DVec2, DVec3};

/// The mean of an arm's points is nearer than this to that of its owner's: half the span of arms is some 0.9 m, of which the
/// points are the outer part.
pub(super) const ARM_M: f64 = 0.75;
/// Hands hang no lower than this share of the stature.
const HAND_SHARE: f64 = 0.37;
/// A raised hand is no higher than this share of the stature.
const RAISED_SHARE: f64 = 1.2;
/// Of the points of a body an arm has so many at most: who stands behind somebody shows more.
const ARM_SHARE: f64 = 0.5;
/// Arms are looked for where nobody else is known as near: in a crowd people show as little of themselves.
pub(super) const ALONE_M: f64 = 2.0;
/// Of a body that stands, more of the points are below that; of an arm with a hip beside it, fewer.
const LOW_SHARE: f64 = 0.15;
/// Points so near to the highest are the head's.
const HEAD_M: f64 = 0.2;
/// Nobody's head is nearer than this to another's.
const HEADS_M: f64 = 0.3;

/// True when `small` may be an arm of `large`, which is known to be somebody or else seen to stand on the floor: beams may
/// pass above the legs of who is near.
pub(super) fn is_arm(moved_m: &[DVec3], small: &Part, large: &Part, is_known: bool) -> bool {
    let hand_m = HAND_SHARE * large.top_m;
    let is_less = small.points.len() as f64 <= ARM_SHARE * large.points.len() as f64;
    let may_own = is_known || low_share(moved_m, large, hand_m) >= LOW_SHARE;
    is_less
        && may_own
        && small.top_m < RAISED_SHARE * large.top_m
        && small.mean_m().distance(large.mean_m()) < ARM_M
        && low_share(moved_m, small, hand_m) < LOW_SHARE
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Somebody of 1.75 m who stands at x = 0: 40 points from the floor to the head.
    fn body() -> Vec<DVec3> {
        let round = |i: u32| DVec2::from_angle(f64::from(i) * 2.4) * if i > 36 { 0.07 } else { 0.15 };
        (0..40).map(|i| round(i).extend(0.05 + 0.0435 * f64::from(i))).collect()
    }

    /// From the shoulder to the hand, stretched out along x to one side.
    fn arm(side: f64) -> Vec<DVec3> {
        (0..12)
            .map(|i| DVec3::new(side * (0.3 + 0.05 * f64::from(i)), 0.0, 1.4 - 0.02 * f64::from(i)))
            .collect()
    }

    fn parts(points_m: &[&[DVec3]]) -> (Vec<DVec3>, Vec<Part>) {
        let all = points_m.concat();
        let mut from = 0;
        let parts = points_m.iter().map(|points| {
            let own = from..from + points.len() as u32;
            from = own.end;
            Part::new(&all, own.collect())
        });
        let parts = parts.collect();
        (all, parts)
    }

    #[test]
    fn a_stretched_arm_is_its_owners_and_another_person_is_not() {
        let (points_m, both) = parts(&[&body(), &arm(1.0)]);
        assert!(is_arm(&points_m, &both[1], &both[0], false));
        assert!(!is_arm(&points_m, &both[0], &both[1], true));
        let other: Vec<DVec3> = body().iter().map(|p| *p + DVec3::X * 0.6).collect();
        let (points_m, both) = parts(&[&body(), &other]);
        assert!(
            !is_arm(&points_m, &both[1], &both[0], true) && !have_one_head(&points_m, &both[0], &both[1])
        );
    }

    #[test]
    fn the_other_of_a_pair_whose_legs_are_hidden_is_no_arm() {
        let beside: Vec<DVec3> = body().iter().filter(|p| p.z > 0.75).map(|p| *p + DVec3::X * 0.6).collect();
        let (points_m, both) = parts(&[&body(), &beside]);
        assert!(low_share(&points_m, &both[1], 0.6) < LOW_SHARE, "nothing of the legs is to be seen");
        assert!(!is_arm(&points_m, &both[1], &both[0], true));
    }

    #[test]
    fn halves_of_somebody_with_both_arms_out_have_one_head() {
        let whole = [body(), arm(1.0), arm(-1.0)].concat();
        let (left, right): (Vec<DVec3>, Vec<DVec3>) = whole.iter().partition(|p| p.x < 0.0);
        let (points_m, halves) = parts(&[&left, &right]);
        assert!(halves[0].mean_m().distance(halves[1].mean_m()) > 0.42, "they look like two");
        assert!(have_one_head(&points_m, &halves[0], &halves[1]));
    }
}
