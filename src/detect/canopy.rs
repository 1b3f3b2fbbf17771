//! What is carried above everybody's shoulders, such as an umbrella: it is wider than a head, hangs together, and tells nothing of
//! where somebody stands or how many they are.

use super::cluster::PlanGrid;
use crate::geometry::{Aabb, DVec2, DVec3};

/// Of who stands, a head alone reaches as high: shoulders of somebody of 2 m end below.
pub(super) const OVERHEAD_M: f64 = 1.7;
/// Heads of two people who touch are farther apart than this, moved behind their surfaces; returns of one canopy are not.
const APART_M: f64 = 0.25;
/// A head with a hand beside it is not as wide, from corner to corner.
const HEAD_M: f64 = 0.55;
/// What is as high and no farther from a canopy is a piece of it that beams met apart from the rest.
const PIECES_M: f64 = 0.5;

/// Kept from frame to frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Canopies {
    grid: PlanGrid,
    /// Which points are as high, and where.
    high: Vec<u32>,
    plan_m: Vec<DVec2>,
    apart_m: Vec<f64>,
    labels: Vec<u32>,
    /// By label, then of canopies alone.
    boxes: Vec<Aabb>,
}

impl Canopies {
    /// The points that are of no canopy, ascending. Heights are above the floor.
    pub(super) fn leave_out(&mut self, moved_m: &[DVec3], shown: &mut Vec<u32>) {
        let Self { grid, high, plan_m, apart_m, labels, boxes } = self;
        high.clear();
        high.extend((0..).zip(moved_m).filter(|(_, p)| p.z > OVERHEAD_M).map(|(i, _)| i));
        plan_m.clear();
        plan_m.extend(high.iter().map(|&i| moved_m[i as usize].truncate()));
        apart_m.clear();
        apart_m.resize(high.len(), APART_M);
        let found = grid.components(plan_m, apart_m, APART_M, labels);
        boxes.clear();
        boxes.resize(found, Aabb::around([]));
        for (&i, &label) in high.iter().zip(&*labels) {
            let (of, at_m) = (&mut boxes[label as usize], moved_m[i as usize]);
            *of = Aabb { min_m: of.min_m.min(at_m), max_m: of.max_m.max(at_m) };
        }
        boxes.retain(|of| of.size_m().truncate().length() > HEAD_M);
        let is_of = |canopy: &Aabb, p: DVec2| {
            p.distance(p.clamp(canopy.min_m.truncate(), canopy.max_m.truncate())) < PIECES_M
        };
        let is_canopys = |at_m: &DVec2| boxes.iter().any(|canopy| is_of(canopy, *at_m));
        let mut of_canopies = high.iter().zip(&*plan_m).filter(|(_, at_m)| is_canopys(at_m)).peekable();
        let all = 0..moved_m.len() as u32;
        shown.extend(all.filter(|i| of_canopies.next_if(|(of, _)| *of == i).is_none()));
    }
}

/// True of what is wholly above everybody's shoulders: a piece of a canopy.
pub(super) fn is_overhead(moved_m: &[DVec3], points: &[u32]) -> bool {
    points.iter().all(|&i| moved_m[i as usize].z > OVERHEAD_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Somebody of 1.9 m: 40 points from the floor to the head.
    fn body(x: f64) -> Vec<DVec3> {
        let round = |i: u32| DVec2::from_angle(f64::from(i) * 2.4) * if i > 34 { 0.08 } else { 0.2 };
        (0..40).map(|i| (round(i) + DVec2::X * x).extend(0.05 + 0.047 * f64::from(i))).collect()
    }

    /// The near half of an open umbrella's dome.
    fn dome(x: f64) -> Vec<DVec3> {
        let around = |i: u32| DVec2::from_angle(f64::from(i) * 0.16) * 0.5 + DVec2::X * x;
        (0..20).map(|i| around(i).extend(1.85 + 0.03 * f64::from(i % 5))).collect()
    }

    fn left_of(points_m: &[DVec3]) -> usize {
        let mut shown = Vec::new();
        Canopies::default().leave_out(points_m, &mut shown);
        shown.len()
    }

    #[test]
    fn umbrellas_that_touch_are_left_out_and_heads_of_tall_people_side_by_side_are_not() {
        let bare: Vec<DVec3> = body(0.0).into_iter().filter(|p| p.z < OVERHEAD_M).collect();
        assert_eq!(left_of(&[bare.clone(), dome(0.0)].concat()), bare.len());
        assert_eq!(left_of(&[bare.clone(), dome(0.0), dome(1.0)].concat()), bare.len());
        assert_eq!(left_of(&body(0.0)), 40);
        assert_eq!(left_of(&[body(0.0), body(0.45)].concat()), 80);
    }
}
