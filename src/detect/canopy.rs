//! What is carried above everybody's shoulders, such as an umbrella: it is wider than a head, hangs together, and tells nothing of
//! where somebody stands or how many they are.

use super::cluster::PlanGrid;
use super::shape::Moments;
use crate::geometry::{Aabb, DVec2, DVec3};

/// What hangs over somebody in one frame.
///
/// ```
/// use umbracast::detect::{Moments, Overhead};
///
/// let umbrella = Overhead { points: Moments::default(), low_m: 1.85, top_m: 2.0 };
/// assert!(umbrella.top_m - umbrella.low_m < 0.2);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Overhead {
    /// Where its points lie about the detection's position, along the site's axes. Those of each sensor count alike together, for each
    /// shows the side toward it.
    pub points: Moments,
    /// Height of the lowest of them above the floor,
    pub low_m: f64,
    /// and of the highest.
    pub top_m: f64,
}

impl Overhead {
    /// Of what hangs about a place: points above the floor with their sensors, one after another.
    pub(super) fn about(at_m: DVec2, overhead_m: &[(DVec3, u16)]) -> Option<Self> {
        let mut found = Self { low_m: f64::INFINITY, ..Self::default() };
        let mut sensors = 0.0;
        for of_sensor in overhead_m.chunk_by(|(_, a), (_, b)| a == b) {
            let mut points = Moments::default();
            for (p, _) in of_sensor.iter().filter(|(p, _)| p.truncate().distance(at_m) < OVER_M) {
                points.add(p.truncate() - at_m);
                (found.low_m, found.top_m) = (found.low_m.min(p.z), found.top_m.max(p.z));
            }
            if points.n > 0.0 {
                sensors += 1.0;
                found.points.mix(&points, 1.0 / sensors, points.n);
            }
        }
        (sensors > 0.0).then_some(found)
    }
}

/// Of who stands, a head alone reaches as high: shoulders of somebody of 2 m end below.
pub(super) const OVERHEAD_M: f64 = 1.7;
/// Heads of two people who touch are farther apart than this, moved behind their surfaces; returns of one canopy are not.
const APART_M: f64 = 0.25;
/// A head with a hand beside it is not as wide, from corner to corner.
const HEAD_M: f64 = 0.55;
/// What is as high and no farther from a canopy is a piece of it that beams met apart from the rest.
const PIECES_M: f64 = 0.5;

/// What hangs so near to somebody's axis, in plan view, is his.
const OVER_M: f64 = 0.7;

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
    fn an_umbrella_is_in_the_middle_of_what_the_sensors_see_and_nobody_elses() {
        let rim = |toward: f64, n: u32| {
            let at =
                move |i: u32| DVec2::from_angle(toward + 3.0 * (f64::from(i) / f64::from(n) - 0.5)) * 0.5;
            (0..=n).map(move |i| (DVec2::new(3.0, 1.0) + at(i)).extend(1.8))
        };
        // The near sensor sees much, the far one little of the other side.
        let near = rim(std::f64::consts::PI, 40).map(|p| (p, 0));
        let far = rim(0.0, 8).chain([DVec3::new(9.0, 1.0, 1.9)]).map(|p| (p, 1));
        let all: Vec<(DVec3, u16)> = near.chain(far).collect();
        let found = Overhead::about(DVec2::new(3.1, 1.0), &all).expect("it hangs there");
        let (mean_m, variance_m2) = found.points.spread();
        assert!(mean_m.distance(DVec2::new(-0.1, 0.0)) < 0.03, "{mean_m:?}");
        assert!((variance_m2.x + variance_m2.y - 0.25).abs() < 0.02 && found.top_m == 1.8, "{variance_m2:?}");
        assert_eq!(Overhead::about(DVec2::new(5.0, 1.0), &all), None);
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
