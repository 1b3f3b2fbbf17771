//! Which known people are expected where points lie.

use super::Prior;
use super::arms::ALONE_M;
use super::part::Part;
use crate::geometry::{DVec2, DVec3};

/// Two people who are known may be two where the means of the halves of a cluster lie farther apart than this.
pub(super) const EXPECTED_HALVES_M: f64 = 0.3;
/// A point or part nearer than this to an expected person may be that person.
const EXPECTED_M: f64 = 0.3;
/// Where so many grown people are within this of each other, they press: their axes come as near as [`PRESSED_APART_M`]. Who sits and
/// what is pushed is lower, and needs more room.
const PRESSED_PEOPLE: usize = 5;
pub const PRESSED_M: f64 = 1.0;
const GROWN_M: f64 = 1.4;
pub const PRESSED_APART_M: f64 = 0.25;

/// Whether people so tall, all who are near a place, press there: many, and nobody among them who sits or is pushed.
pub fn press(heights_m: impl Iterator<Item = f64>) -> bool {
    let (mut people, mut all_grown) = (0, true);
    for height_m in heights_m {
        people += 1;
        all_grown &= height_m > GROWN_M;
    }
    all_grown && people >= PRESSED_PEOPLE
}

/// How near two are at least: `usual_m`, or less where those of these who are expected around this place press.
pub(super) fn apart_m<'a>(usual_m: f64, at_m: DVec2, priors: impl Iterator<Item = &'a Prior>) -> f64 {
    let near = |prior: &&Prior| prior.confirmed && prior.position_m.distance(at_m) < PRESSED_M;
    match press(priors.filter(near).map(|prior| prior.height_m)) {
        true => PRESSED_APART_M,
        false => usual_m,
    }
}

/// How many confirmed people are expected so near to any of these that none of them is alone.
pub(super) fn expected_near(parts: &[&Part], priors: &[Prior]) -> usize {
    let is_near = |prior: &&Prior| {
        prior.confirmed && parts.iter().any(|part| prior.position_m.distance(part.mean_m()) < ALONE_M)
    };
    priors.iter().filter(is_near).count()
}

/// True when each of the two is where another confirmed person is expected.
pub(super) fn are_expected_apart(a_m: DVec2, b_m: DVec2, priors: &[Prior]) -> bool {
    let nearest = |p_m: DVec2| {
        let confirmed = priors.iter().filter(|prior| prior.confirmed).map(|prior| prior.position_m);
        confirmed.min_by(|a, b| a.distance_squared(p_m).total_cmp(&b.distance_squared(p_m)))
    };
    let (Some(p), Some(q)) = (nearest(a_m), nearest(b_m)) else { return false };
    let own = |prior_m: DVec2, p_m: DVec2| prior_m.distance(p_m) < EXPECTED_M;
    p.distance(q) > EXPECTED_HALVES_M && own(p, a_m) && own(q, b_m)
}

/// Which confirmed people are expected within the cluster.
pub(super) fn expected(moved_m: &[DVec3], priors: &[Prior], cluster: &[u32]) -> impl Iterator<Item = usize> {
    let of = || cluster.iter().map(|&i| moved_m[i as usize].truncate());
    let bounds_m = |(least, most): (DVec2, DVec2), p: DVec2| (least.min(p), most.max(p));
    let (least_m, most_m) = of().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), bounds_m);
    let is_inside = move |prior: &Prior| {
        let at_m = prior.position_m;
        // Most people are elsewhere.
        let away_m = at_m - at_m.clamp(least_m, most_m);
        prior.confirmed
            && away_m.length_squared() < EXPECTED_M * EXPECTED_M
            && of().any(|p| p.distance(at_m) < EXPECTED_M)
    };
    (0..priors.len()).filter(move |&k| is_inside(&priors[k]))
}
