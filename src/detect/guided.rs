//! Which points belong to whom, where it is known who stands there.
//!
//! A body is wide in the trunk and long in the legs, so two people whose feet lie among each other come apart all
//! the same. Without such knowledge nobody can tell four legs of two people from four people.

use super::Prior;
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

/// The place of each of `points` in `people`, if anybody's. `moved_m` are all points, each moved behind the surface
/// that its sensor saw. k-means, where each person's place stays near the expected one and a body has a shape.
/// Nobody's place is taken to be surer than `sigma_min_m`.
pub fn owners(moved_m: &[DVec3], points: &[u32], people: &[&Prior], sigma_min_m: f64) -> Vec<Option<usize>> {
    let variance = |prior: &Prior| prior.position_sigma_m.max(sigma_min_m).powi(2);
    let mut places: Vec<(DVec2, f64)> =
        people.iter().map(|prior| (prior.position_m, variance(prior))).collect();
    let mut owners = Vec::new();
    for _ in 0..PASSES {
        let last = std::mem::take(&mut owners);
        owners.extend(points.iter().map(|&i| owner(moved_m[i as usize], people, &places)));
        if owners == last {
            break;
        }
        for (k, (prior, place)) in people.iter().zip(&mut places).enumerate() {
            let own = points.iter().zip(&owners).filter(|(_, owner)| **owner == Some(k));
            let (sum_m, n) = own.fold((DVec2::ZERO, 0.0), |(sum_m, n), (&i, _)| {
                (sum_m + moved_m[i as usize].truncate(), n + 1.0)
            });
            let before = variance(prior);
            *place = (prior.position_m, before);
            if n > 0.0 {
                let gain = before / (before + MEAN_SIGMA_M.powi(2) + POINT_SIGMA_M.powi(2) / n);
                *place = (prior.position_m + (sum_m / n - prior.position_m) * gain, before * (1.0 - gain));
            }
        }
    }
    owners
}

/// The likeliest owner of a point.
fn owner(point_m: DVec3, people: &[&Prior], places: &[(DVec2, f64)]) -> Option<usize> {
    let cost = |(prior, &(place_m, variance)): (&&Prior, &(DVec2, f64))| {
        let (along_m, across_m) = deviations_m(point_m.z / prior.height_m);
        let (mut along, mut across) = (along_m.powi(2), across_m.powi(2));
        let off_m = point_m.truncate() - place_m;
        let mut heading = prior.velocity_mps;
        if heading.length() < WALKS_FROM_MPS {
            (along, across) = (0.5 * (along + across), 0.5 * (along + across));
            heading = DVec2::X;
        }
        let heading = heading.normalize();
        (along, across) = (along + variance, across + variance);
        let squared = off_m.dot(heading).powi(2) / along + off_m.perp_dot(heading).powi(2) / across;
        (squared, squared + (along * across).ln())
    };
    let all = people.iter().zip(places).map(cost).enumerate();
    let near = all.filter(|(_, (squared, _))| *squared < GATE * GATE);
    near.min_by(|(_, a), (_, b)| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}

/// How far a walking body's points lie from its axis along and across its way, at a share of its height: measured on
/// simulated returns of people who walk alone.
fn deviations_m(height_share: f64) -> (f64, f64) {
    let along_m = (0.28 - 0.55 * height_share).clamp(0.08, 0.28);
    (along_m, if (0.35..0.9).contains(&height_share) { 0.14 } else { 0.09 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prior(x: f64, y: f64, velocity_mps: DVec2) -> Prior {
        Prior {
            position_m: DVec2::new(x, y),
            velocity_mps,
            position_sigma_m: 0.1,
            height_m: 1.7,
            confirmed: true,
            is_furniture: false,
        }
    }

    #[test]
    fn legs_go_to_those_who_walk_in_their_line() {
        // Two side by side, 0.5 m apart, each in mid-stride; the feet of the two are nearer to each other.
        let feet = [(0.3, 0.05), (-0.3, 0.0), (0.3, 0.45), (-0.3, 0.5)];
        let points_m: Vec<DVec3> = feet.iter().map(|&(x, y)| DVec3::new(x, y, 0.1)).collect();
        let people = [prior(0.05, 0.0, DVec2::X), prior(-0.05, 0.5, DVec2::X)];
        let people: Vec<&Prior> = people.iter().collect();
        assert_eq!(owners(&points_m, &[0, 1, 2, 3], &people, 0.05), [Some(0), Some(0), Some(1), Some(1)]);
    }

    #[test]
    fn what_lies_apart_from_everybody_known_is_nobodys() {
        let points_m = [DVec3::new(0.0, 0.1, 1.2), DVec3::new(0.1, 1.0, 1.2)];
        let known = prior(0.0, 0.0, DVec2::ZERO);
        assert_eq!(owners(&points_m, &[0, 1], &[&known], 0.05), [Some(0), None]);
    }
}
