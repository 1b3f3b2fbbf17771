//! People who are there in the first frame of a run without an empty scan. The background does not learn an object
//! that stands alone and has the shape of a person. If it never walks, the tracker calls it furniture after a while.

use super::cluster::PlanGrid;
use crate::geometry::{Aabb, DVec2, DVec3};

/// Lower points are the floor's, for a floor is not quite even;
const LOWEST_M: f64 = 0.2;
/// and nothing of what is higher than this is a person's, but it shows that what is below goes on.
const HIGHEST_M: f64 = 4.0;
/// Points nearer than this in plan view are of one thing.
const APART_M: f64 = 0.3;
/// A person's: fewer points say nothing of a shape,
const POINTS_MIN: usize = 10;
/// who stands, walks or sits is so high, and more of him is seen than a bush or a sign shows,
const TOP_M: std::ops::Range<f64> = 1.0..2.1;
const HEIGHT_MIN_M: f64 = 0.7;
/// and a stride with swinging arms is not longer, from corner to corner.
const DIAGONAL_M: std::ops::Range<f64> = 0.2..1.1;

/// One return of a frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Return {
    /// Place of its scan in the frame.
    pub(super) scan: usize,
    /// Of the sensor's range model.
    pub(super) pixel: usize,
    /// Its height is above the floor.
    pub(super) position_m: DVec3,
}

/// Those returns that are of somebody, it seems.
pub(super) fn of_people(returns: &[Return]) -> Vec<Return> {
    let above: Vec<&Return> =
        returns.iter().filter(|r| (LOWEST_M..HIGHEST_M).contains(&r.position_m.z)).collect();
    let places_m: Vec<DVec2> = above.iter().map(|r| r.position_m.truncate()).collect();
    let mut labels = Vec::new();
    let things =
        PlanGrid::default().components(&places_m, &vec![APART_M; places_m.len()], APART_M, &mut labels);
    let mut of_thing = vec![Vec::new(); things];
    above.iter().zip(&labels).for_each(|(r, &label)| of_thing[label as usize].push(**r));
    of_thing.into_iter().filter(|thing| is_person(thing)).flatten().collect()
}

fn is_person(thing: &[Return]) -> bool {
    let aabb = Aabb::around(thing.iter().map(|r| r.position_m));
    let size_m = aabb.size_m();
    thing.len() >= POINTS_MIN
        && TOP_M.contains(&aabb.max_m.z)
        && size_m.z > HEIGHT_MIN_M
        && DIAGONAL_M.contains(&size_m.truncate().length())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns every 5 cm of the sides of a box on the floor.
    fn thing(middle_m: DVec2, size_m: DVec3) -> Vec<Return> {
        let steps = |length_m: f64| (0..=(length_m / 0.05) as i32).map(|k| 0.05 * f64::from(k));
        let side = |z: f64| steps(size_m.x).map(move |x| DVec3::new(x - 0.5 * size_m.x, 0.5 * size_m.y, z));
        steps(size_m.z)
            .flat_map(|z| side(z).chain(side(z).map(|p| DVec3::new(p.x, -p.y, p.z))))
            .map(|p| Return { scan: 0, pixel: 0, position_m: p + middle_m.extend(0.0) })
            .collect()
    }

    #[test]
    fn what_stands_alone_and_is_as_large_as_a_person_may_be_one() {
        let person = DVec3::new(0.5, 0.3, 1.7);
        let found = |things: &[Vec<Return>]| !of_people(&things.concat()).is_empty();
        let alone = thing(DVec2::new(5.0, 1.0), person);
        assert!(found(std::slice::from_ref(&alone)));
        assert!(found(&[alone.clone(), thing(DVec2::new(9.0, 1.0), DVec3::new(3.0, 0.1, 3.0))]));
        assert!(!found(&[alone, thing(DVec2::new(5.0, 1.3), DVec3::new(3.0, 0.1, 3.0))]), "beside a wall");
        for other in [[0.7, 0.7, 3.5], [1.6, 0.8, 0.75], [0.5, 0.5, 0.9], [1.6, 0.6, 2.0]] {
            assert!(!found(&[thing(DVec2::ZERO, DVec3::from_array(other))]), "{other:?}");
        }
    }
}
