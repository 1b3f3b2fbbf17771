//! Algorithm 1 of the paper, with its misprints corrected.
//!
//! Line 10 multiplies positions; the text means directions seen from the access point, so positions are taken
//! from it first. Line 11 admits p when q is the nearer one; the text says that only people nearer to the access
//! point than the considered one are tested, so the comparison is turned round. The hit has to lie on the
//! segment between the access point and the centre of q's box, not on the infinite ray.

use crate::geometry::{Aabb, Covered, DVec2, DVec3, Obb, Sectors, slab};

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
    #[inline]
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
    #[inline]
    pub fn center_m(&self) -> DVec3 {
        match self {
            Self::Aabb(aabb) => aabb.center_m(),
            Self::Obb(obb) => obb.center_m,
        }
    }

    /// CheckIntersect (line 12): where along the segment the box is first met.
    #[inline]
    fn hit(&self, start_m: DVec3, end_m: DVec3) -> Option<f64> {
        match self {
            Self::Aabb(aabb) => slab::hit_aabb(aabb, start_m, end_m),
            Self::Obb(obb) => slab::hit_obb(obb, start_m, end_m),
        }
    }

    /// FromAbove from above, all of the box lies so near to its centre.
    fn reach_m(&self) -> f64 {
        match self {
            Self::Aabb(aabb) => 0.5 * aabb.size_m().truncate().length(),
            Self::Obb(obb) => obb.half_m.length(),
        }
    }
}

/// Casts rays step after step in the same memory.
#[derive(Debug, Clone, Default)]
pub struct Rays {
    /// Those of the step at hand.
    seen: Vec<FromAbove>,
    /// Who was sorted by direction last, each with [`SLACK_M`] to move.
    sorted: Vec<FromAbove>,
    covered: Vec<Covered>,
    sectors: Sectors<SECTORS>,
}

impl Rays {
    /// One step (lines 5 to 24): marks in `blocked` every person whose ray from the access point meets a nearer
    /// person's box. `people` are the moved positions with their moved boxes. Whoever is marked already is not
    /// tested again, which is what makes `blocked` that of the window.
    ///
    /// The listing tests every pair. Here a pair is tested only where the boxes lie in about one direction from the access point;
    /// the answers are the same.
    pub fn cast_step(&mut self, access_point_m: DVec3, people: &[(DVec2, PersonBox)], blocked: &mut [bool]) {
        self.seen.clear();
        self.seen.extend(people.iter().map(|person| FromAbove::of(access_point_m, person)));
        let are_many = blocked.iter().filter(|&&blocked| !blocked).count() > FEW;
        if are_many {
            self.sort();
        }
        let Self { seen, sectors, .. } = self;
        for (q, to_q) in seen.iter().enumerate() {
            if blocked[q] {
                continue;
            }
            // q's own box is never a candidate, so the nearest box that is hit (lines 13 to 16) is always another's: any hit
            // means blocked (lines 21, 22).
            let end_m = people[q].1.center_m();
            let hides = |p: usize| seen[p].may_hide(to_q) && people[p].1.hit(access_point_m, end_m).is_some();
            blocked[q] = match are_many {
                true => sectors.towards(to_q.middle_m).iter().any(|&p| hides(p as usize)),
                false => (0..people.len()).any(hides),
            };
        }
    }

    /// Sorts people by direction, unless all are still about where they were when they were sorted.
    fn sort(&mut self) {
        let Self { seen, sorted, covered, sectors } = self;
        let is_near = |(person, then): (&FromAbove, &FromAbove)| {
            let moved_m = person.middle_m.distance(then.middle_m);
            moved_m + person.reach_m <= then.reach_m + SLACK_M
        };
        if seen.len() == sorted.len() && seen.iter().zip(&*sorted).all(is_near) {
            return;
        }
        sorted.clone_from(seen);
        covered.clear();
        covered.extend(seen.iter().map(|p| Covered::of::<SECTORS>(p.middle_m, p.reach_m + SLACK_M)));
        sectors.sort(covered);
    }
}

/// Up to so many people who are not blocked yet, testing every pair is faster than sorting by direction.
const FEW: usize = 24;
/// Of a turn. A person ten metres away covers about two, with room to move.
const SECTORS: usize = 64;
/// So far people may move before they are sorted again: as far as they walk in four steps.
const SLACK_M: f64 = 0.6;
/// More than rounding errs by.
const ROOM_M: f64 = 1e-6;

/// A person from above, from the access point.
#[derive(Debug, Clone)]
struct FromAbove {
    position_m: DVec2,
    distance2_m2: f64,
    /// Of the box.
    middle_m: DVec2,
    middle2_m2: f64,
    reach_m: f64,
}

impl FromAbove {
    #[inline]
    fn of(access_point_m: DVec3, (position_m, person_box): &(DVec2, PersonBox)) -> Self {
        let position_m = position_m - access_point_m.truncate();
        let middle_m = (person_box.center_m() - access_point_m).truncate();
        Self {
            position_m,
            distance2_m2: position_m.length_squared(),
            middle_m,
            middle2_m2: middle_m.length_squared(),
            reach_m: person_box.reach_m() + ROOM_M,
        }
    }

    /// Whether this person is nearer (line 11, turned round), on the same side (line 10, seen from the access point), and
    /// the ray to `other` passes within reach of the box. Nobody is nearer than himself.
    #[inline]
    fn may_hide(&self, other: &Self) -> bool {
        let nearer = self.distance2_m2 < other.distance2_m2;
        let same_side = other.position_m.dot(self.position_m) > 0.0;
        let aside_m2 = other.middle_m.perp_dot(self.middle_m);
        nearer && same_side && aside_m2 * aside_m2 <= self.reach_m * self.reach_m * other.middle2_m2
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// The listing: every pair.
    fn every_pair(access_point_m: DVec3, people: &[(DVec2, PersonBox)]) -> Vec<bool> {
        let from_ap = |position_m: DVec2| position_m - access_point_m.truncate();
        let hides = |p: &(DVec2, PersonBox), q: &(DVec2, PersonBox)| {
            let (to_p, to_q) = (from_ap(p.0), from_ap(q.0));
            to_p.length_squared() < to_q.length_squared()
                && to_q.dot(to_p) > 0.0
                && p.1.hit(access_point_m, q.1.center_m()).is_some()
        };
        people.iter().map(|q| people.iter().any(|p| hides(p, q))).collect()
    }

    #[test]
    fn sorted_by_direction_the_answers_are_those_of_every_pair() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let mut rays = Rays::default();
        for count in [3, 20, 25, 60, 300] {
            for _ in 0..20 {
                let mut place = || random.random_range(-9.0..9.0);
                let ap_m = DVec3::new(place(), place(), 0.5 * place().abs());
                let mut people: Vec<(DVec2, PersonBox)> = (0..count)
                    .map(|i| {
                        let at_m = DVec2::new(place(), place());
                        let middle_m = (at_m + 0.02 * DVec2::new(place(), place())).extend(0.9);
                        let half_m = DVec3::new(0.1 + 0.04 * place().abs(), 0.3, 0.9);
                        let aabb = Aabb { min_m: middle_m - half_m, max_m: middle_m + half_m };
                        let obb = Obb::from_aabb(&aabb).moved_by(DVec2::ZERO, place());
                        (at_m, if i % 2 == 0 { PersonBox::Aabb(aabb) } else { PersonBox::Obb(obb) })
                    })
                    .collect();
                for _ in 0..4 {
                    let mut blocked = vec![false; count];
                    rays.cast_step(ap_m, &people, &mut blocked);
                    assert_eq!(blocked, every_pair(ap_m, &people));
                    for (at_m, person_box) in &mut people {
                        let offset_m = 0.03 * DVec2::new(place(), place());
                        *at_m += offset_m;
                        *person_box = person_box.moved_by(offset_m, place());
                    }
                }
            }
        }
    }
}
