//! What is carried above the head, such as an umbrella, or raised hands: wide, over one trunk that is not.

use super::part::{POINTS_MIN, Part};
use crate::geometry::{Aabb, DVec3};

/// An open umbrella is so high from the rim to the top, and somewhat less than a hand is higher than the head.
const CANOPY_M: f64 = 0.25;
/// Heads that are farther apart than this belong to two people with a trunk each.
const WIDE_M: f64 = 0.9;
/// One trunk with its arms is less wide than this.
const TRUNK_M: f64 = 0.7;
/// A trunk begins and ends at these shares of the highest point.
const TRUNK_SHARES: [f64; 2] = [0.37, 0.75];
/// Nobody's head begins so high above the floor.
const OVERHEAD_M: f64 = 1.75;

/// True of what is wholly above everybody's shoulders: a piece of a canopy.
pub(super) fn is_overhead(moved_m: &[DVec3], part: &Part) -> bool {
    part.top_m > OVERHEAD_M && part.points.iter().all(|&i| moved_m[i as usize].z > OVERHEAD_M)
}

/// Takes away what is wide at the top alone, over one trunk.
pub(super) fn without_canopy(moved_m: &[DVec3], part: &mut Part) {
    let diagonal_m = |low_m: f64, high_m: f64| {
        let points_m = part.points.iter().map(|&i| moved_m[i as usize]);
        let within_m = points_m.filter(|p| p.z >= low_m && p.z <= high_m);
        let is_enough = within_m.clone().nth(POINTS_MIN - 1).is_some();
        is_enough.then(|| Aabb::around(within_m).size_m().truncate().length())
    };
    let rim_m = part.top_m - CANOPY_M;
    let [hips_m, shoulders_m] = TRUNK_SHARES.map(|share| share * part.top_m);
    if diagonal_m(rim_m, part.top_m).is_some_and(|m| m > WIDE_M)
        && diagonal_m(hips_m, shoulders_m).is_some_and(|m| m < TRUNK_M)
    {
        part.points.retain(|&i| moved_m[i as usize].z < rim_m);
        part.look(moved_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec2;

    /// Somebody of 1.7 m: 40 points from the floor to the head.
    fn body(x: f64) -> Vec<DVec3> {
        let round = |i: u32| DVec2::from_angle(f64::from(i) * 2.4) * if i > 34 { 0.08 } else { 0.2 };
        (0..40).map(|i| (round(i) + DVec2::X * x).extend(0.05 + 0.042 * f64::from(i))).collect()
    }

    /// The near half of an open umbrella's dome.
    fn dome() -> impl Iterator<Item = DVec3> {
        (0..20).map(|i| {
            let around = DVec2::from_angle(f64::from(i) * 0.16) * 0.5;
            around.extend(1.85 + 0.03 * f64::from(i % 5))
        })
    }

    fn left_of(points_m: &[DVec3]) -> usize {
        let mut part = Part::new(points_m, (0..points_m.len() as u32).collect());
        without_canopy(points_m, &mut part);
        part.points.len()
    }

    #[test]
    fn an_umbrella_is_taken_off_and_two_heads_are_not() {
        let mut under = body(0.0);
        under.extend(dome());
        assert_eq!(left_of(&under), 40);
        assert_eq!(left_of(&body(0.0)), 40);
        assert_eq!(left_of(&[body(0.0), body(0.8)].concat()), 80);
    }

    #[test]
    fn a_piece_of_a_canopy_alone_is_overhead_and_a_head_is_not() {
        let whole = |points_m: &[DVec3]| Part::new(points_m, (0..points_m.len() as u32).collect());
        let (dome, tall): (Vec<DVec3>, Vec<DVec3>) =
            (dome().collect(), body(0.0).iter().map(|p| *p * 1.15).collect());
        assert!(is_overhead(&dome, &whole(&dome)));
        assert!(!is_overhead(&tall, &whole(&tall)));
    }
}
