//! Whose a return may be, of those who are expected.

use super::Prior;
use super::range_model::Near;
use crate::geometry::DVec3;

/// Nothing is learned within this distance of an expected person.
const FREEZE_M: f64 = 0.5;
/// What is new within this distance of furniture's middle is a part of it: half a large table.
const FURNITURE_M: f64 = 0.9;

/// Who is near a return that is not known to be furniture's.
pub(super) fn near(priors: &[Prior], at_m: DVec3) -> Near {
    let mut near = Near::Nobody;
    for prior in around(priors, at_m) {
        if prior.walked {
            return Near::Walker;
        }
        near = Near::Unsure;
    }
    near
}

/// Somebody who stands still must not be learned.
pub(super) fn is_somebodys(priors: &[Prior], at_m: DVec3) -> bool {
    around(priors, at_m).next().is_some()
}

fn around(priors: &[Prior], at_m: DVec3) -> impl Iterator<Item = &Prior> {
    let is_near = move |(prior, reach_m): &(&Prior, f64)| {
        prior.position_m.distance_squared(at_m.truncate()) < reach_m * reach_m
    };
    people(priors).filter(is_near).map(|(prior, _)| prior)
}

/// Those who are expected, and how near to them a return may be theirs.
pub(super) fn people(priors: &[Prior]) -> impl Iterator<Item = (&Prior, f64)> {
    let reach_m = |prior: &Prior| FREEZE_M + prior.position_sigma_m.min(FREEZE_M);
    priors.iter().filter(|prior| !prior.is_furniture).map(move |prior| (prior, reach_m(prior)))
}

pub(super) fn is_furnitures(priors: &[Prior], at_m: DVec3) -> bool {
    let near = |prior: &Prior| prior.position_m.distance(at_m.truncate()) < FURNITURE_M;
    priors.iter().any(|prior| prior.is_furniture && near(prior))
}
