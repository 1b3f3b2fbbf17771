//! Assigns points to people whose expected positions are known.
//!
//! A body is wide in the trunk and long in the legs, so two people come apart even if their feet are mixed. Without
//! expected positions the four legs of two people look like four people.

use super::Prior;
use super::shape::{BANDS, band_of};
use crate::gait::WALKS_FROM_MPS;
use crate::geometry::{DVec2, DVec3};

/// Passes of the assignment; it settles in two or three.
const PASSES: usize = 6;
/// A point that is less likely than one so many standard deviations off belongs to nobody known.
const GATE: f64 = 3.5;
/// Deviation of the mean of a few points from the body axis: legs swing.
const MEAN_SIGMA_M: f64 = 0.1;
/// The same for a single point.
const POINT_SIGMA_M: f64 = 0.2;

/// Kept from cluster to cluster.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    known: Vec<Known>,
    /// The place of each point's owner in `people`, if anybody's.
    pub owners: Vec<Option<usize>>,
}

/// Finds whose each of `points` is; `memory.owners` has it. `moved_m` are all points, each moved behind the surface
/// that its sensor saw. k-means, where each person's place stays near the expected one and a body has a shape.
/// Nobody's place is taken to be surer than `sigma_min_m`.
pub fn find_owners<'a>(
    moved_m: &[DVec3],
    points: &[u32],
    people: impl Iterator<Item = &'a Prior>,
    sigma_min_m: f64,
    memory: &mut Memory,
) {
    let Memory { known, owners } = memory;
    known.clear();
    known.extend(people.map(|prior| Known::new(prior, sigma_min_m)));
    owners.clear();
    owners.resize(points.len(), None);
    for pass in 0..PASSES {
        let mut changed = pass == 0;
        for (&i, owner) in points.iter().zip(&mut *owners) {
            let likeliest = likeliest(moved_m[i as usize], known);
            changed |= likeliest != *owner;
            *owner = likeliest;
        }
        if !changed {
            break;
        }
        known.iter_mut().for_each(|one| (one.sum_m, one.points) = (DVec2::ZERO, 0.0));
        for (&i, k) in points.iter().zip(&*owners).filter_map(|(i, owner)| Some((i, (*owner)?))) {
            known[k].sum_m += moved_m[i as usize].truncate();
            known[k].points += 1.0;
        }
        known.iter_mut().for_each(Known::settle);
    }
}

/// Somebody who is known, and where the points are taken to show him.
#[derive(Debug, Clone)]
struct Known {
    prior: Prior,
    /// Unit vector; none of who stands.
    heading: Option<DVec2>,
    variance_m2: f64,
    place_m: DVec2,
    place_variance_m2: f64,
    /// By band of height, what was learned of the body: means ahead and left, variances.
    learned: [Option<(DVec2, DVec2)>; BANDS],
    /// Points farther away are not his, whatever their height.
    reach2_m2: f64,
    sum_m: DVec2,
    points: f64,
}

impl Known {
    fn new(prior: &Prior, sigma_min_m: f64) -> Self {
        let velocity_mps = prior.velocity_mps;
        let variance_m2 = prior.position_sigma_m.max(sigma_min_m).powi(2);
        let shape = prior.shape.filter(|_| velocity_mps.length() >= WALKS_FROM_MPS);
        let learned = std::array::from_fn(|band| {
            let (mean_m, variance_m2) = shape.as_ref()?.band(band)?;
            Some((mean_m, variance_m2 + DVec2::splat(LEARNED_SIGMA_M.powi(2))))
        });
        // With the whole deviation of the mean beside that of the points.
        let farthest_m2 =
            |(mean_m, variance_m2): &(DVec2, DVec2)| mean_m.length_squared() + variance_m2.max_element();
        let reach_m2 = learned.iter().flatten().map(farthest_m2).fold(DEVIATION_MAX_M.powi(2), f64::max);
        Self {
            prior: *prior,
            heading: (velocity_mps.length() >= WALKS_FROM_MPS).then(|| velocity_mps.normalize()),
            variance_m2,
            place_m: prior.position_m,
            place_variance_m2: variance_m2,
            // With room for rounding. A place is never less sure than it was expected to be.
            reach2_m2: 1.001 * GATE * GATE * (reach_m2 + variance_m2),
            learned,
            sum_m: DVec2::ZERO,
            points: 0.0,
        }
    }

    /// Between where he is expected and the mean of his points.
    fn settle(&mut self) {
        let before = self.variance_m2;
        (self.place_m, self.place_variance_m2) = (self.prior.position_m, before);
        let n = self.points;
        if n > 0.0 {
            let gain = before / (before + MEAN_SIGMA_M.powi(2) + POINT_SIGMA_M.powi(2) / n);
            self.place_m = self.prior.position_m + (self.sum_m / n - self.prior.position_m) * gain;
            self.place_variance_m2 = before * (1.0 - gain);
        }
    }

    /// What it costs to take a point for his; none outside the gate.
    fn cost(&self, point_m: DVec3) -> Option<f64> {
        let off_m = point_m.truncate() - self.place_m;
        if off_m.length_squared() > self.reach2_m2 {
            return None;
        }
        let heading = self.heading.unwrap_or(DVec2::X);
        let (mean_m, variance_m2) =
            self.learned[band_of(point_m.z)].unwrap_or_else(|| (DVec2::ZERO, self.usual_m2(point_m.z)));
        let DVec2 { x: along, y: across } = variance_m2 + DVec2::splat(self.place_variance_m2);
        let off_m = DVec2::new(off_m.dot(heading), heading.perp_dot(off_m)) - mean_m;
        let squared = off_m.x.powi(2) / along + off_m.y.powi(2) / across;
        (squared < GATE * GATE).then(|| squared + (along * across).ln())
    }

    /// Variances of a usual body's points along its way and across it; of who stands the same for any direction.
    fn usual_m2(&self, height_m: f64) -> DVec2 {
        let (along_m, across_m) = deviations_m(height_m / self.prior.height_m);
        let (along, across) = (along_m.powi(2), across_m.powi(2));
        match self.heading {
            Some(_) => DVec2::new(along, across),
            None => DVec2::splat(0.5 * (along + across)),
        }
    }
}

/// The likeliest owner of a point.
fn likeliest(point_m: DVec3, known: &[Known]) -> Option<usize> {
    let near = known.iter().enumerate().filter_map(|(k, one)| Some((k, one.cost(point_m)?)));
    near.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(k, _)| k)
}

/// What is learned of a body is not surer than this: limbs swing.
const LEARNED_SIGMA_M: f64 = 0.05;
/// No deviation is larger.
const DEVIATION_MAX_M: f64 = 0.28;

/// How far a walking body's points lie from its axis along and across its way, at a share of its height: measured on
/// simulated returns of people who walk alone.
fn deviations_m(height_share: f64) -> (f64, f64) {
    let along_m = (DEVIATION_MAX_M - 0.55 * height_share).clamp(0.08, DEVIATION_MAX_M);
    (along_m, if (0.35..0.9).contains(&height_share) { 0.14 } else { 0.09 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::Shape;

    fn prior(x: f64, y: f64, velocity_mps: DVec2) -> Prior {
        Prior {
            position_m: DVec2::new(x, y),
            velocity_mps,
            position_sigma_m: 0.1,
            height_m: 1.7,
            confirmed: true,
            walked: false,
            is_furniture: false,
            shape: None,
        }
    }

    #[test]
    fn legs_go_to_those_who_walk_in_their_line() {
        // Two side by side, 0.5 m apart, each in mid-stride; the feet of the two are nearer to each other.
        let feet = [(0.3, 0.05), (-0.3, 0.0), (0.3, 0.45), (-0.3, 0.5)];
        let points_m: Vec<DVec3> = feet.iter().map(|&(x, y)| DVec3::new(x, y, 0.1)).collect();
        let people = [prior(0.05, 0.0, DVec2::X), prior(-0.05, 0.5, DVec2::X)];
        let mut memory = Memory::default();
        find_owners(&points_m, &[0, 1, 2, 3], people.iter(), 0.05, &mut memory);
        assert_eq!(memory.owners, [Some(0), Some(0), Some(1), Some(1)]);
    }

    #[test]
    fn knees_of_who_is_known_to_sit_ahead_of_them_are_his_and_not_of_who_stands_there() {
        let mut sits = prior(0.0, 0.0, DVec2::X);
        let mut shape = Shape::default();
        for band in &mut shape.bands[..3] {
            [[0.4, 0.1], [0.6, -0.1], [0.1, 0.0], [0.3, 0.0]]
                .iter()
                .for_each(|at_m| band.add(DVec2::from_array(*at_m)));
        }
        sits.shape = Some(shape);
        let stands = prior(0.9, 0.0, DVec2::ZERO);
        let knees_m = [DVec3::new(0.5, 0.1, 0.6), DVec3::new(0.55, -0.1, 0.5)];
        let owners = |sits: Prior| {
            let mut memory = Memory::default();
            find_owners(&knees_m, &[0, 1], [sits, stands].iter(), 0.05, &mut memory);
            memory.owners
        };
        assert_eq!(owners(sits), [Some(0); 2]);
        assert_eq!(owners(Prior { shape: None, ..sits }), [Some(1); 2], "of whom nothing is known");
    }

    #[test]
    fn what_lies_apart_from_everybody_known_is_nobodys() {
        let points_m = [DVec3::new(0.0, 0.1, 1.2), DVec3::new(0.1, 1.0, 1.2)];
        let known = prior(0.0, 0.0, DVec2::ZERO);
        let mut memory = Memory::default();
        find_owners(&points_m, &[0, 1], [known].iter(), 0.05, &mut memory);
        assert_eq!(memory.owners, [Some(0), None]);
    }
}
