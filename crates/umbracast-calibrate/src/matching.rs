//! Finds the turn and shift between two sensors that makes their people the same, without a first guess.
//!
//! It lays each piece of a path that one sensor saw onto each piece that another one saw at the same time. A straight
//! path at an even pace fits onto many others. Each trial is therefore judged by all people: at every instant, how
//! many people of one sensor stand where the other one sees somebody.

use std::collections::BTreeSet;

use umbracast::geometry::DVec2;

use crate::people::{self, Way};
use crate::plan::{Plan, wrapped};

/// Instants at which everybody is compared are so far apart, or farther in a long recording.
const STEP_NS: i64 = 200_000_000;
const STEPS_MAX: i64 = 900;
/// Instants in a piece of a way, and how many of them both sensors must have.
const PIECE: usize = 40;
const PIECE_FEWEST: usize = 25;
/// A piece tells a direction when its places are spread like this, metres (root mean square).
const SPREAD_M: f64 = 0.8;
/// The same way seen twice differs by no more, root mean square: a clock 50 ms off moves a walker 7 cm.
const FIT_M: f64 = 0.2;
/// Trials, at most: spread evenly over all that there are.
const TRIALS_MAX: usize = 4000;
/// Trials that are looked at closer.
const BEST: usize = 12;
/// The same person stands this near by both sensors once a trial has been made finer, metres.
const SAME_M: f64 = 0.5;
/// What a person costs whom the other sensor should see and does not: somebody else may hide it.
const UNSEEN: f64 = 0.3;
/// Edge of the squares in which a sensor has seen people, metres.
const CELL_M: f64 = 1.0;
/// So much must speak for it, in persons times instants: some seconds of two people.
const SCORE_MIN: f64 = 30.0;
/// A trial that is nearly as good and quite another one makes the answer doubtful.
const RIVAL: f64 = 0.7;
const OTHER_DEG: f64 = 5.0;
const OTHER_M: f64 = 1.0;

/// How two sensors stand to one another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// From the second sensor's level frame to the first's.
    pub first_from_second: Plan,
    /// Persons times instants that speak for it.
    pub score: f64,
    /// Quite another answer is nearly as good: the nearer one to the site file was taken.
    pub doubtful: bool,
}

/// Everybody at every instant.
struct Sampled {
    /// Of each way, by instant.
    ways: Vec<Vec<Option<DVec2>>>,
    /// By instant.
    at: Vec<Vec<DVec2>>,
    cells: BTreeSet<(i64, i64)>,
}

/// How the second sensor stands to the first; `guess` chooses between answers that the data cannot tell apart. `None`
/// where too few people were seen by both.
pub fn find(first: &[Way], second: &[Way], guess: &Plan) -> Option<Match> {
    let times_ns = || first.iter().chain(second).flatten().map(|s| s.time_ns);
    let (start_ns, end_ns) = (times_ns().min()?, times_ns().max()?);
    let step_ns = STEP_NS.max((end_ns - start_ns) / STEPS_MAX);
    let sampled =
        |ways: &[Way]| sampled(ways, start_ns, step_ns, ((end_ns - start_ns) / step_ns + 1) as usize);
    let (first, second) = (sampled(first), sampled(second));
    let trials = trials(&first, &second);
    let every = trials.len().div_ceil(TRIALS_MAX).max(1);
    let scored = trials.into_iter().step_by(every).map(|plan| (score(&first, &second, &plan), plan));
    let mut scored: Vec<(f64, Plan)> = scored.collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut apart: Vec<Plan> = Vec::new();
    for (_, plan) in scored {
        if apart.len() < BEST && !apart.iter().any(|other| is_same(other, &plan)) {
            apart.push(plan);
        }
    }
    let mut finer: Vec<(f64, Plan)> = (apart.iter())
        .map(|plan| finer(&first, &second, plan))
        .map(|plan| (score(&first, &second, &plan), plan))
        .collect();
    finer.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (best, plan) = *finer.first()?;
    let rivals: Vec<_> =
        finer.iter().filter(|(score, other)| *score > RIVAL * best && !is_same(&plan, other)).collect();
    let off = |plan: &Plan| {
        let turned = wrapped(plan.yaw_rad - guess.yaw_rad).abs().to_degrees() / OTHER_DEG;
        turned + plan.at_m.distance(guess.at_m) / OTHER_M
    };
    let nearest = rivals.iter().map(|(score, plan)| (*score, *plan)).chain([(best, plan)]);
    let (score, first_from_second) = nearest.min_by(|a, b| off(&a.1).total_cmp(&off(&b.1)))?;
    (score >= SCORE_MIN).then_some(Match { first_from_second, score, doubtful: !rivals.is_empty() })
}

fn is_same(a: &Plan, b: &Plan) -> bool {
    wrapped(a.yaw_rad - b.yaw_rad).abs().to_degrees() < OTHER_DEG && a.at_m.distance(b.at_m) < OTHER_M
}

fn sampled(ways: &[Way], start_ns: i64, step_ns: i64, steps: usize) -> Sampled {
    let position = |way: &Way, k: usize| {
        people::at(way, start_ns + k as i64 * step_ns).map(|sighting| sighting.position_m)
    };
    let ways: Vec<Vec<Option<DVec2>>> =
        ways.iter().map(|way| (0..steps).map(|k| position(way, k)).collect()).collect();
    let at: Vec<Vec<DVec2>> = (0..steps).map(|k| ways.iter().filter_map(|way| way[k]).collect()).collect();
    let cells = at.iter().flatten().map(cell).collect();
    Sampled { ways, at, cells }
}

fn cell(p: &DVec2) -> (i64, i64) {
    ((p.x / CELL_M).floor() as i64, (p.y / CELL_M).floor() as i64)
}

/// Each piece of each way of the second laid onto each of the first.
fn trials(first: &Sampled, second: &Sampled) -> Vec<Plan> {
    let mut trials = Vec::new();
    for a in &first.ways {
        for b in &second.ways {
            for from in (0..a.len()).step_by(PIECE / 2) {
                let piece = a.iter().zip(b).skip(from).take(PIECE);
                let pairs: Vec<_> = piece.filter_map(|(a, b)| Some(((*a)?, (*b)?, 1.0))).collect();
                if pairs.len() >= PIECE_FEWEST && spread_m(&pairs) >= SPREAD_M {
                    trials.extend(Plan::aligning(&pairs).filter(|plan| misfit_m(plan, &pairs) < FIT_M));
                }
            }
        }
    }
    trials
}

fn spread_m(pairs_m: &[(DVec2, DVec2, f64)]) -> f64 {
    let n = pairs_m.len() as f64;
    let middle_m = pairs_m.iter().map(|pair| pair.0).sum::<DVec2>() / n;
    (pairs_m.iter().map(|pair| pair.0.distance_squared(middle_m)).sum::<f64>() / n).sqrt()
}

fn misfit_m(plan: &Plan, pairs_m: &[(DVec2, DVec2, f64)]) -> f64 {
    let sum: f64 = pairs_m.iter().map(|(a, b, _)| a.distance_squared(plan.point(*b))).sum();
    (sum / pairs_m.len() as f64).sqrt()
}

/// People times instants that agree, less what contradicts.
fn score(first: &Sampled, second: &Sampled, first_from_second: &Plan) -> f64 {
    let mut score = 0.0;
    for (a, b) in first.at.iter().zip(&second.at) {
        for p in b.iter().map(|&p| first_from_second.point(p)) {
            let off_m2 = a.iter().map(|a| a.distance_squared(p)).fold(f64::INFINITY, f64::min);
            if off_m2 < SAME_M * SAME_M {
                score += 1.0 - off_m2 / (SAME_M * SAME_M);
            } else if first.cells.contains(&cell(&p)) {
                score -= UNSEEN;
            }
        }
    }
    score
}

/// The trial by everybody who is seen by both, not by the piece alone that it came from.
fn finer(first: &Sampled, second: &Sampled, trial: &Plan) -> Plan {
    let mut plan = *trial;
    for gate_m in [1.5, 1.0, 0.7, SAME_M, SAME_M, SAME_M] {
        let mut pairs = Vec::new();
        for (a, b) in first.at.iter().zip(&second.at) {
            for &p in b {
                let moved = plan.point(p);
                let nearest = a.iter().min_by(|x, y| x.distance(moved).total_cmp(&y.distance(moved)));
                pairs
                    .extend(nearest.filter(|near| near.distance(moved) < gate_m).map(|near| (*near, p, 1.0)));
            }
        }
        plan = Plan::aligning(&pairs).unwrap_or(plan);
    }
    plan
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::people::Sighting;

    /// Somebody who walks with turns, as a sensor whose clock is off sees it from `level_from_site`, every 0.1 s.
    fn way(person: usize, level_from_site: &Plan, ahead_ns: i64) -> Way {
        let place = |t: f64| {
            let k = person as f64;
            DVec2::new(
                5.0 * (0.21 * t + k).sin() + 0.8 * k - 2.0,
                4.0 * (0.17 * t * (1.0 + 0.1 * k) + 2.0 * k).cos(),
            )
        };
        let sighting = |k: i64| Sighting {
            time_ns: k * 100_000_000 + ahead_ns,
            position_m: level_from_site.point(place(k as f64 * 0.1)),
            covariance_m2: [[1e-3, 0.0], [0.0, 1e-3]],
            velocity_mps: DVec2::ZERO,
        };
        (0..400).map(sighting).collect()
    }

    #[test]
    fn the_same_people_are_found_whatever_the_guess() {
        let second = Plan { yaw_rad: 2.5, at_m: DVec2::new(-12.0, 5.0) };
        for people in [2, 6] {
            let of = |plan: &Plan, ahead_ns| (0..people).map(|k| way(k, plan, ahead_ns)).collect::<Vec<_>>();
            let seen = (of(&Plan::default(), 0), of(&second.inverse(), 40_000_000));
            let found = find(&seen.0, &seen.1, &Plan::default()).unwrap();
            assert!(is_same(&found.first_from_second, &second) && !found.doubtful, "{found:?}");
            assert!(found.first_from_second.at_m.distance(second.at_m) < 0.2, "{found:?}");
        }
    }

    #[test]
    fn other_people_are_no_match() {
        let first: Vec<Way> = (0..3).map(|k| way(k, &Plan::default(), 0)).collect();
        let second: Vec<Way> = (4..7).map(|k| way(k, &Plan::default(), 0)).collect();
        assert_eq!(find(&first, &second, &Plan::default()), None);
    }
}
