//! One person more, or one fewer? A cluster is split as long as its parts lie farther apart than the halves of one
//! body, and parts nearer than two bodies can stand become one. Both thresholds change where people are expected.

use super::arms::{ARM_M, have_one_head, is_arm};
use super::canopy::is_overhead;
use super::expected::{EXPECTED_HALVES_M, apart_m, are_expected_apart, expected, expected_near};
use super::means::{PASSES, means, one_more, people_if};
use super::memory::{Memory, PEOPLE_OF_CLUSTER};
use super::part::{POINTS_MIN, Part};
use super::{Cluster, Prior};
use crate::geometry::{DVec2, DVec3};

/// Two people when the means of the halves of a cluster lie farther apart than this: the halves of one body are at most
/// 0.35 m apart, of two side by side 0.45 m.
const HALVES_M: f64 = 0.42;
/// What ends below this height is legs alone: the hips of most adults.
pub(super) const FULL_BODY_TOP_M: f64 = 0.9;
/// Parts whose means are nearer than this are one person: outside a press nobody's body axis comes nearer to another's.
const ONE_PERSON_M: f64 = 0.33;
/// A low part nearer than this to a person is a leg: half a stride.
const LIMB_M: f64 = 0.55;
/// Low: its top is below this share of the person's, for a leg ends below the hip.
const LIMB_TOP_SHARE: f64 = 0.55;
/// How sure a known person's place is at most where pieces are given away, and in a crowd: there a track that took a
/// neighbour's points would otherwise be told by them that it is right.
const PIECES_SIGMA_M: f64 = 0.05;
const CROWD_SIGMA_M: f64 = 0.15;
/// Two people when the halves of what a known person was given in a crowd lie farther apart than this: what others leave to
/// see of one body is shorter than a body.
const BESIDE_M: f64 = 0.30;
/// Halves of a body that is known lie no farther apart than so many standard deviations of its points.
const HALVES_OF_LENGTH: f64 = 2.2;
/// Points that deviate more than this along their longest axis are more than four people in a row.
const CROWD_M: f64 = 0.7;

/// Splits a cluster as long as one person more is likelier; parts go to `parts`. `moved_m` are all points, each
/// moved behind the surface that its sensor saw.
pub(super) fn split(
    moved_m: &[DVec3],
    priors: &[Prior],
    cluster: Cluster,
    parts: &mut Vec<Part>,
    memory: &mut Memory,
) {
    if is_overhead(moved_m, &cluster) {
        memory.points.give(cluster);
        return;
    }
    let all = Part::new(moved_m, cluster);
    if all.points.len() < 2 * POINTS_MIN {
        parts.push(all);
        return;
    }
    let axis_m = all.axis_m(moved_m);
    let is_crowd = axis_m.length() > CROWD_M;
    // Most are one person alone, for whom nothing need be remembered.
    if !is_crowd
        && expected(moved_m, priors, &all.points).take(2).count() < 2
        && !has_halves(moved_m, &all, axis_m)
    {
        parts.push(all);
        return;
    }
    let mut known = memory.people.take(PEOPLE_OF_CLUSTER);
    known.extend(expected(moved_m, priors, &all.points));
    split_more(moved_m, priors, &known, &all, axis_m, parts, memory);
    memory.people.give(known);
    memory.points.give(all.points);
}

/// The same for a cluster within which these confirmed people are expected, and which may be more than one.
fn split_more(
    moved_m: &[DVec3],
    priors: &[Prior],
    known: &[usize],
    all: &Part,
    axis_m: DVec2,
    parts: &mut Vec<Part>,
    memory: &mut Memory,
) {
    let (is_crowd, cluster) = (axis_m.length() > CROWD_M, &all.points);
    if is_crowd && known.is_empty() {
        // The work grows with the square of the people, so a crowd is halved first; whom the cut divides, the
        // merge makes whole again.
        if let Some(mut halves) = means(moved_m, cluster, all.ends_m(axis_m), memory) {
            halves.drain(..).for_each(|half| split(moved_m, priors, half.points, parts, memory));
            memory.parts.give(halves);
        }
        return;
    }
    let expected_m = known.iter().map(|&k| priors[k].position_m);
    let guided = match is_crowd {
        true => None,
        false => {
            people_if(moved_m, cluster, expected_m, memory, |people| are_people(people, EXPECTED_HALVES_M))
        }
    };
    if is_crowd || guided.is_none() && known.len() > 1 {
        among_known(moved_m, priors, known, cluster, parts, memory);
        return;
    }
    let mut people = guided.unwrap_or_else(|| {
        let (mut one, mut points) = (memory.parts.take(PEOPLE_OF_CLUSTER), memory.take_points());
        points.extend(cluster);
        one.push(Part { points, ..*all });
        one
    });
    // k against k + 1: the longest part gives way to its two halves, and all find their places anew. Legs alone
    // are never counted: two of them may be one person or two. Nor are the halves of somebody alone with his arms out. What is low
    // and farther from every body than a leg is a thing.
    let alone = known.first().filter(|_| known.len() == 1).and_then(|&k| priors[k].shape);
    let halves_m = alone.map_or(HALVES_M, |shape| HALVES_M.max(HALVES_OF_LENGTH * shape.longest_m()));
    let are_more = |more: &[Part]| {
        are_people(more, halves_m)
            && more.iter().all(|part| part.top_m >= FULL_BODY_TOP_M || is_no_leg(part, more))
            && !(more.len() == 2
                && expected_near(&[all], priors) < 2
                && are_of_one_body(moved_m, more, known.len() == 1))
    };
    while let Some(more) = people_if(moved_m, cluster, one_more(moved_m, &people), memory, are_more) {
        memory.give_parts(std::mem::replace(&mut people, more));
    }
    parts.append(&mut people);
    memory.parts.give(people);
}

/// Gives each point of a cluster to the known person whose body explains it best, so that who shows little costs nobody
/// else anything; what nobody known explains is split as if nobody were known.
fn among_known(
    moved_m: &[DVec3],
    priors: &[Prior],
    known: &[usize],
    cluster: &[u32],
    parts: &mut Vec<Part>,
    memory: &mut Memory,
) {
    let people = known.iter().map(|&k| &priors[k]);
    let (mut own, strangers) = memory.share_out(moved_m, cluster, people.clone(), CROWD_SIGMA_M);
    for (&k, mut whole) in known.iter().zip(own.drain(..)) {
        if whole.points.is_empty() {
            memory.points.give(whole.points);
            continue;
        }
        whole.look(moved_m);
        let ends_m = whole.ends_m(whole.axis_m(moved_m));
        let apart_m = apart_m(BESIDE_M, priors[k].position_m, people.clone());
        let beside_m =
            priors[k].shape.map_or(apart_m, |shape| apart_m.max(HALVES_OF_LENGTH * shape.longest_m()));
        let are_two =
            |two: &[Part]| are_people(two, beside_m) && two.iter().all(|part| part.top_m >= FULL_BODY_TOP_M);
        let first = parts.len();
        match people_if(moved_m, &whole.points, ends_m, memory, are_two) {
            Some(mut two) => {
                parts.append(&mut two);
                memory.parts.give(two);
                memory.points.give(whole.points);
            }
            None => parts.push(whole),
        }
        // Who stands beside somebody known is new; the known one is where he is expected.
        let off_m = |part: &Part| part.mean_m().distance(priors[k].position_m);
        parts[first..].sort_by(|a, b| off_m(a).total_cmp(&off_m(b)));
        parts[first].owner = Some(k);
        parts[first].expected = true;
    }
    memory.parts.give(own);
    match strangers.is_empty() {
        true => memory.points.give(strangers),
        false => split(moved_m, &[], strangers, parts, memory),
    }
}

/// True when two of them share a head, or one is another's arm.
fn are_of_one_body(moved_m: &[DVec3], parts: &[Part], is_known: bool) -> bool {
    let of_one = |a: &Part, b: &Part| {
        have_one_head(moved_m, a, b) || is_arm(moved_m, a, b, is_known) || is_arm(moved_m, b, a, is_known)
    };
    parts.iter().enumerate().any(|(k, a)| parts[k + 1..].iter().any(|b| of_one(a, b)))
}

/// True of what is farther from every body among `parts` than a leg, where there is one.
fn is_no_leg(low: &Part, parts: &[Part]) -> bool {
    let mut bodies = parts.iter().filter(|part| part.top_m >= FULL_BODY_TOP_M).peekable();
    bodies.peek().is_some() && bodies.all(|body| body.mean_m().distance(low.mean_m()) > LIMB_M)
}

/// True when all stand apart and show enough.
fn are_people(parts: &[Part], apart_m: f64) -> bool {
    let apart = |k: usize, a: &Part| parts[k + 1..].iter().all(|b| a.mean_m().distance(b.mean_m()) > apart_m);
    parts.iter().enumerate().all(|(k, a)| a.points.len() >= POINTS_MIN && apart(k, a))
}

/// Joins parts that are one person, nearest first: those nearer than two people can stand, and legs and arms that lost
/// their body.
pub(super) fn merge(moved_m: &[DVec3], parts: &mut Vec<Part>, priors: &[Prior], memory: &mut Memory) {
    let reach_m = ONE_PERSON_M.max(LIMB_M).max(ARM_M);
    let Memory { order, candidates, into, points, .. } = memory;
    order.clear();
    order.extend(0..parts.len());
    order.sort_unstable_by(|&a, &b| parts[a].mean_m().x.total_cmp(&parts[b].mean_m().x).then(a.cmp(&b)));
    candidates.clear();
    for (k, &i) in order.iter().enumerate() {
        for &j in &order[k + 1..] {
            let off_m = parts[j].mean_m() - parts[i].mean_m();
            if off_m.x > reach_m {
                break;
            }
            if off_m.length() < reach_m {
                candidates.push((off_m.length(), i.min(j), i.max(j)));
            }
        }
    }
    candidates.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    // What was merged leaves an empty part that points to where it went.
    into.clear();
    into.extend(0..parts.len());
    let root = |into: &[usize], mut i: usize| {
        while into[i] != i {
            i = into[i];
        }
        i
    };
    for &(_, i, j) in &*candidates {
        let (i, j) = (root(into, i), root(into, j));
        if i == j || !is_one_person(moved_m, &parts[i], &parts[j], priors) {
            continue;
        }
        points.give(join(parts, i, j));
        into[j] = i;
    }
    tidy(parts);
}

/// Gives the points of pieces to the expected people whose bodies are nowhere: legs where the beams pass below the
/// hips, or the few points that others let through. Without an expected person such pieces are nobody.
pub(super) fn give_pieces(moved_m: &[DVec3], parts: &mut Vec<Part>, priors: &[Prior], memory: &mut Memory) {
    let mut without_body = std::mem::take(&mut memory.without_body);
    let off_m = |part: &Part, k: usize| priors[k].position_m.distance(part.mean_m());
    let is_near = |part: &Part, k: usize| off_m(part, k) < LIMB_M + priors[k].position_sigma_m.min(LIMB_M);
    let confirmed = || (0..priors.len()).filter(|&k| priors[k].confirmed);
    without_body.clear();
    without_body.extend(priors.iter().map(|prior| prior.confirmed));
    for body in parts.iter().filter(|part| !is_piece(part)) {
        let near = confirmed().filter(|&k| is_near(body, k));
        let nearest = || near.min_by(|&a, &b| off_m(body, a).total_cmp(&off_m(body, b)));
        if let Some(k) = body.owner.or_else(nearest) {
            without_body[k] = false;
        }
    }
    let is_theirs = |part: &Part| is_piece(part) && confirmed().any(|k| without_body[k] && is_near(part, k));
    let mut pieces = memory.take_points();
    parts.retain_mut(|part| {
        let goes = is_theirs(part);
        if goes {
            pieces.append(&mut part.points);
            memory.points.give(std::mem::take(&mut part.points));
        }
        !goes
    });
    if !pieces.is_empty() {
        let people = priors.iter().filter(|prior| prior.confirmed);
        let (mut own, nobodys) = memory.share_out(moved_m, &pieces, people, PIECES_SIGMA_M);
        for (k, mut part) in confirmed().zip(own.drain(..)) {
            if without_body[k] && !part.points.is_empty() {
                part.points.sort_unstable();
                part.look(moved_m);
                parts.push(Part { expected: true, ..part });
            } else {
                memory.points.give(part.points);
            }
        }
        memory.parts.give(own);
        memory.points.give(nobodys);
    }
    memory.points.give(pieces);
    memory.without_body = without_body;
}

/// True for what may be somebody's leg or head, but does not look like a whole person, and is not known to be somebody's.
fn is_piece(part: &Part) -> bool {
    part.owner.is_none() && (part.points.len() < POINTS_MIN || part.top_m < FULL_BODY_TOP_M)
}

/// Moves the points of part `j` to part `i`; their list comes back.
fn join(parts: &mut [Part], i: usize, j: usize) -> Cluster {
    let mut points = std::mem::take(&mut parts[j].points);
    parts[i].points.append(&mut points);
    let (sum_m, top_m) = (parts[j].sum_m, parts[j].top_m);
    parts[i].sum_m += sum_m;
    parts[i].top_m = parts[i].top_m.max(top_m);
    parts[i].owner = parts[i].owner.or(parts[j].owner);
    parts[i].expected |= parts[j].expected;
    points
}

/// Drops what was joined to others.
fn tidy(parts: &mut Vec<Part>) {
    parts.retain(|part| !part.points.is_empty());
    parts.iter_mut().for_each(|part| part.points.sort_unstable());
}

fn is_one_person(moved_m: &[DVec3], a: &Part, b: &Part, priors: &[Prior]) -> bool {
    let off_m = a.mean_m().distance(b.mean_m());
    if a.owner.is_some() && b.owner.is_some() {
        return false;
    }
    if off_m < ONE_PERSON_M && off_m < apart_m(ONE_PERSON_M, a.mean_m().midpoint(b.mean_m()), priors.iter()) {
        return !are_expected_apart(a.mean_m(), b.mean_m(), priors);
    }
    // A leg in mid-stride stands apart from its body, is low, and shows less.
    let (small, large) = if a.points.len() < b.points.len() { (a, b) } else { (b, a) };
    if off_m < LIMB_M && small.top_m < LIMB_TOP_SHARE * large.top_m {
        return true;
    }
    // Who is not known has no arms here, for strangers who stand close show as little of themselves.
    (is_arm(moved_m, small, large, true) || is_arm(moved_m, large, small, true))
        && expected_near(&[small, large], priors) == 1
}

/// True when both halves of a part, a step along this axis to either side of its middle, might be people: what [`means`] would
/// make of them, without their points.
fn has_halves(moved_m: &[DVec3], part: &Part, axis_m: DVec2) -> bool {
    let mut means_m = [part.mean_m() - axis_m, part.mean_m() + axis_m];
    let mut halves = [(DVec2::ZERO, 0.0, 0.0); 2];
    for pass in 0..=PASSES {
        halves = [(DVec2::ZERO, 0.0, 0.0); 2];
        for point_m in part.points.iter().map(|&i| moved_m[i as usize]) {
            let p = point_m.truncate();
            let nearer = means_m[1].distance_squared(p) < means_m[0].distance_squared(p);
            let (sum_m, points, top_m) = &mut halves[usize::from(nearer)];
            *sum_m += p;
            *points += 1.0;
            *top_m = f64::max(*top_m, point_m.z);
        }
        if halves.iter().any(|(_, points, _)| *points == 0.0) {
            return false;
        }
        // The last pass only shares out.
        let last = std::mem::replace(&mut means_m, halves.map(|(sum_m, points, _)| sum_m / points));
        if last == means_m || pass == PASSES {
            break;
        }
    }
    let shows_enough = halves.iter().all(|(_, points, _)| *points >= POINTS_MIN as f64);
    let bodies = halves.iter().filter(|(_, _, top_m)| *top_m >= FULL_BODY_TOP_M).count();
    let apart_m = means_m[0].distance(means_m[1]);
    shows_enough && apart_m > HALVES_M && (bodies == 2 || bodies == 1 && apart_m > LIMB_M)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::Shape;

    /// An upright body of 0.26 x 0.5 m, broad along y.
    fn body(x: f64, y: f64) -> Vec<DVec3> {
        (0..40)
            .map(|i| {
                let around = DVec2::from_angle(f64::from(i) * 2.4);
                DVec3::new(x + 0.13 * around.x, y + 0.25 * around.y, 0.1 + 0.04 * f64::from(i))
            })
            .collect()
    }

    fn people(points_m: &[DVec3], priors: &[Prior]) -> usize {
        let mut parts = Vec::new();
        let memory = &mut Memory::default();
        split(points_m, priors, (0..points_m.len() as u32).collect(), &mut parts, memory);
        merge(points_m, &mut parts, priors, memory);
        parts.len()
    }

    fn prior(x: f64, y: f64) -> Prior {
        Prior {
            position_m: DVec2::new(x, y),
            velocity_mps: DVec2::X,
            position_sigma_m: 0.05,
            height_m: 1.7,
            confirmed: true,
            walked: false,
            is_furniture: false,
            shape: None,
        }
    }

    #[test]
    fn one_body_stays_whole_and_a_pair_shoulder_to_shoulder_comes_apart() {
        assert_eq!(people(&body(0.0, 0.0), &[]), 1);
        assert_eq!(people(&[body(0.0, 0.0), body(0.0, 0.5)].concat(), &[]), 2);
        assert_eq!(people(&[body(0.0, 0.0), body(0.0, 0.5), body(0.0, 1.0)].concat(), &[]), 3);
    }

    /// A suitcase that is pulled, and what its shaft leaves of the gap to the hand: one cluster with its owner.
    fn suitcase(x: f64) -> Vec<DVec3> {
        (0..20)
            .map(|i| DVec3::new(x + 0.02 * f64::from(i % 10), 0.1 * f64::from(i / 10), 0.03 * f64::from(i)))
            .collect()
    }

    #[test]
    fn a_stranger_who_pulls_a_suitcase_is_told_from_it() {
        assert_eq!(people(&[body(0.0, 0.0), suitcase(-0.9)].concat(), &[]), 2);
        let leg: Vec<DVec3> = suitcase(-0.45);
        assert_eq!(people(&[body(0.0, 0.0), leg].concat(), &[]), 1);
    }

    #[test]
    fn a_body_that_is_known_to_be_long_is_not_halved_and_a_stranger_as_long_is() {
        let long = [body(0.0, 0.0), body(0.5, 0.0)].concat();
        let mut known = prior(0.25, 0.0);
        assert_eq!(people(&long, &[known]), 2);
        let mut shape = Shape::default();
        long.iter().for_each(|p| shape.bands[0].add(p.truncate() - DVec2::X * 0.25));
        known.shape = Some(shape);
        assert_eq!(people(&long, &[known]), 1);
    }

    #[test]
    fn two_who_are_expected_come_apart_where_strangers_would_not() {
        let close = [body(0.0, 0.0), body(0.35, 0.0)].concat();
        assert_eq!(people(&close, &[]), 1);
        assert_eq!(people(&close, &[prior(0.0, 0.0), prior(0.4, 0.0)]), 2);
    }

    #[test]
    fn who_is_pressed_between_others_is_not_one_with_a_neighbour() {
        // Two who were just found, 0.3 m apart, of whom one is known, and four around them.
        let pressed =
            [(0.0, 0.0), (-0.4, 0.0), (0.0, -0.4), (0.0, 0.4), (0.7, 0.0)].map(|(x, y)| prior(x, y));
        let points_m = [body(0.0, 0.0), body(0.3, 0.0)].concat();
        let left = |priors: &[Prior]| {
            let halves = [0..40, 40..80];
            let mut parts: Vec<Part> = halves.map(|half| Part::new(&points_m, half.collect())).into();
            merge(&points_m, &mut parts, priors, &mut Memory::default());
            parts.len()
        };
        assert_eq!(left(&pressed), 2);
        assert_eq!(left(&pressed[..1]), 1, "nobody presses");
        let mut with_a_pram = pressed;
        with_a_pram[4].height_m = 1.0;
        assert_eq!(left(&with_a_pram), 1, "what is pushed needs room");
    }

    #[test]
    fn one_known_person_who_conflicts_costs_nobody_else_the_guidance() {
        // Three in a row, as near as nobody would tell strangers apart, and a track that is left where nobody stands.
        let row = [body(0.0, 0.0), body(0.36, 0.0), body(0.72, 0.0)].concat();
        let mut known = [prior(0.0, 0.0), prior(0.36, 0.0), prior(0.72, 0.0)].to_vec();
        assert_eq!(people(&row, &known), 3);
        known.push(prior(0.3, 0.1));
        assert!(people(&row, &known) >= 3);
    }

    #[test]
    fn who_shows_three_points_in_a_crowd_keeps_them() {
        let head = (0..3).map(|i| DVec3::new(0.36, 0.03 * f64::from(i), 1.6));
        let points_m: Vec<DVec3> = body(0.0, 0.0).into_iter().chain(body(0.72, 0.0)).chain(head).collect();
        let known = [prior(0.0, 0.0), prior(0.36, 0.0), prior(0.72, 0.0)];
        let mut parts = Vec::new();
        let memory = &mut Memory::default();
        split(&points_m, &known, (0..points_m.len() as u32).collect(), &mut parts, memory);
        merge(&points_m, &mut parts, &known, memory);
        give_pieces(&points_m, &mut parts, &known, memory);
        assert_eq!(parts.len(), 3);
        assert!(parts.iter().any(|part| part.expected && (80..83).all(|i| part.points.contains(&i))));
    }

    #[test]
    fn two_legs_become_one_person_where_one_is_expected_and_stay_pieces_elsewhere() {
        let leg = |y: f64| (0..8).map(move |i| DVec3::new(0.0, y, 0.05 * f64::from(i)));
        let points_m: Vec<DVec3> = leg(-0.3).chain(leg(0.3)).collect();
        let legs = || vec![Part::new(&points_m, (0..8).collect()), Part::new(&points_m, (8..16).collect())];
        let (mut known, mut unknown) = (legs(), legs());
        give_pieces(&points_m, &mut known, &[prior(0.1, 0.0)], &mut Memory::default());
        give_pieces(&points_m, &mut unknown, &[prior(3.0, 0.0)], &mut Memory::default());
        assert!(known.len() == 1 && known[0].expected && known[0].points.len() == 16);
        assert!(unknown.len() == 2 && !unknown[0].expected);
    }

    #[test]
    fn legs_without_bodies_are_not_counted() {
        let leg = |y: f64| (0..8).map(move |i| DVec3::new(0.0, y, 0.05 * f64::from(i)));
        assert_eq!(people(&leg(-0.3).chain(leg(0.3)).collect::<Vec<_>>(), &[]), 1);
    }

    #[test]
    fn a_leg_joins_its_body() {
        let mut points_m = body(0.0, 0.0);
        points_m.extend((0..8).map(|i| DVec3::new(0.4, 0.0, 0.1 * f64::from(i))));
        let mut parts =
            vec![Part::new(&points_m, (0..40).collect()), Part::new(&points_m, (40..48).collect())];
        merge(&points_m, &mut parts, &[], &mut Memory::default());
        assert_eq!(parts.len(), 1);
        assert_eq!(parts[0].points.len(), 48);
    }
}
