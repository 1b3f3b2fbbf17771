//! The `mixed` crowd: what ORCA with one speed leaves out. Each person has an own speed and starting time, may stop
//! on the way or turn to another goal, and speeds up and slows down within limits. Some walk in pairs and threes,
//! side by side.
//!
//! A group avoids others as one larger agent. Its members keep their places in a row across the path.

use glam::Vec2;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, Normal};
use umbracast::geometry::DVec2;

use super::crossing::{ARRIVED_M, MOST_ATTEMPTS, MOST_STEPS, SAMPLE_STEPS, STEP_S, parameters, scatter};
use super::orca::{Agent, Orca, Parameters};
use super::trajectory::{Crowd, STEP_NS, Trajectory};
use super::whims::Whims;
use crate::random::stream;

/// Preferred walking speeds of adults: mean, standard deviation, and the limits outside which none is drawn
/// (Weidmann, Transporttechnik der Fussgaenger, 1993).
const SPEED_MPS: (f32, f32) = (1.34, 0.26);
const SPEED_LIMITS_MPS: (f32, f32) = (0.6, 2.0);
/// To evade, people walk so much faster than they like to.
pub(super) const HURRY: f32 = 1.3;
/// People stop within two steps; starts are gentler, but one limit keeps avoidance predictable.
pub(super) const MOST_ACCELERATION_MPS2: f32 = 2.0;
/// Everybody sets off within so long.
pub(super) const LATEST_START_S: f32 = 5.0;
/// Share of parties that stop on the way, and for how long.
pub(super) const STOPPING: f64 = 0.25;
pub(super) const STOP_S: std::ops::Range<f32> = 2.0..6.0;
/// Share of parties that turn to another goal on the way.
const TURNING: f64 = 0.3;
/// Where on the way to the first goal they do.
const ON_THE_WAY: std::ops::Range<f32> = 0.3..0.7;
/// Cumulative shares of parties of one and of at most two; the rest walk in threes.
const SINGLES: f64 = 0.6;
const UP_TO_PAIRS: f64 = 0.9;
/// Between the body axes of neighbours in a group.
const GAP_M: std::ops::Range<f64> = 0.5..0.6;
/// Of the free disc around one person.
const RADIUS_M: f32 = 0.3;
/// Starts and goals leave this between the discs.
pub(super) const CLEARANCE_M: f32 = 0.2;
/// A group's row turns no faster: the outer of three then walks 0.6 m/s faster or slower.
const MOST_TURN_RADPS: f32 = 1.0;
/// Nor does its turning change faster: 1.1 m/s^2 for the outer of three.
const MOST_TURN_CHANGE_RADPS2: f32 = 2.0;
/// A row closes the gap to the direction of motion within about so long.
const TURN_S: f32 = 0.5;
/// A row follows the direction of motion only when there is one.
const LEAST_SPEED_MPS: f32 = 0.2;
/// A scene in which strangers come nearer than this is dropped: their trunks would touch.
pub(super) const APART_M: f64 = 0.35;

/// People who walk together: one, or a row.
struct Party {
    members: usize,
    gap_m: f64,
    preferred_mps: f32,
    start_s: f32,
    /// Where to, and how long to stand there.
    legs: Vec<(Vec2, f32)>,
}

/// A party on its way.
struct Walk {
    leg: usize,
    stands_until_s: f32,
    row: Row,
    arrived_ns: Option<i64>,
    whims: Option<Whims>,
}

/// How a party stands: in a row across its way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    /// Of the way.
    heading_rad: f32,
    turn_radps: f32,
}

/// A mixed crowd that crosses a circle. Scenes are dropped and drawn anew as in [`super::circle_crossing`],
/// and when strangers come too close; turns are as sharp as people make them.
pub fn crowd(people: usize, radius_m: f64, seed: u64) -> Crowd {
    first_acceptable(radius_m, seed, false, |rng| sizes(people, rng))
}

/// The same, whose people wander, slow down and stop (see `whims`).
pub fn natural(people: usize, radius_m: f64, seed: u64) -> Crowd {
    first_acceptable(radius_m, seed, true, |rng| sizes(people, rng))
}

/// Members and gap of each party.
pub(super) fn sizes(people: usize, rng: &mut dyn Rng) -> Vec<(usize, f64)> {
    let mut parties = Vec::new();
    let mut left = people;
    while left > 0 {
        let members = match rng.random_range(0.0..1.0) {
            u if u < SINGLES => 1,
            u if u < UP_TO_PAIRS => 2,
            _ => 3,
        };
        parties.push((members.min(left), rng.random_range(GAP_M)));
        left -= members.min(left);
    }
    parties
}

/// A group is as fast as its slowest member.
pub(super) fn preferred_mps(members: usize, rng: &mut impl Rng) -> f32 {
    let normal = Normal::new(SPEED_MPS.0, SPEED_MPS.1).expect("a positive deviation");
    (0..members)
        .map(|_| normal.sample(rng).clamp(SPEED_LIMITS_MPS.0, SPEED_LIMITS_MPS.1))
        .fold(f32::INFINITY, f32::min)
}

/// The same, of nothing but pairs whose body axes are `gap_m` apart.
pub fn pairs(pairs: usize, gap_m: f64, radius_m: f64, seed: u64) -> Crowd {
    first_acceptable(radius_m, seed, false, |_| vec![(2, gap_m); pairs])
}

/// Draws scenes until one will do, of people with whims or without. `sizes` gives each party's members and gap.
fn first_acceptable(
    radius_m: f64,
    seed: u64,
    with_whims: bool,
    mut sizes: impl FnMut(&mut dyn Rng) -> Vec<(usize, f64)>,
) -> Crowd {
    let mut attempt = 0;
    loop {
        let sizes = sizes(&mut stream(seed, "mixed parties", attempt));
        let discs: Vec<f32> = sizes.iter().map(|&(members, gap_m)| disc_m(members, gap_m)).collect();
        let starts = starts(&discs, radius_m as f32, &mut stream(seed, "mixed starts", attempt));
        let parties = parties(&sizes, &discs, &starts, radius_m as f32, seed, attempt);
        let whims = |party: usize| {
            with_whims.then(|| Whims::new(stream(seed, "whims", attempt << 32 | party as u64)))
        };
        let crowd = walk(&parties, &starts, whims);
        attempt += 1;
        if acceptable(&crowd, &parties) || attempt == MOST_ATTEMPTS {
            return crowd;
        }
    }
}

/// Radius of the disc that holds a party.
pub(super) fn disc_m(members: usize, gap_m: f64) -> f32 {
    RADIUS_M + 0.5 * (members - 1) as f32 * gap_m as f32
}

fn starts(discs: &[f32], radius_m: f32, rng: &mut impl Rng) -> Vec<Vec2> {
    let mut starts = Vec::new();
    scatter(&mut starts, discs.len(), radius_m, |a, b| discs[a] + discs[b] + CLEARANCE_M, rng);
    starts
}

/// Draws speeds, starts and ways.
fn parties(
    sizes: &[(usize, f64)],
    discs: &[f32],
    starts: &[Vec2],
    radius_m: f32,
    seed: u64,
    attempt: u64,
) -> Vec<Party> {
    let mut speeds = stream(seed, "mixed speeds", attempt);
    let mut ways = stream(seed, "mixed ways", attempt);

    // Those who keep their goal walk to minus the start; the others find room between those goals.
    let (changing, keeping): (Vec<usize>, Vec<usize>) =
        (0..starts.len()).partition(|_| ways.random_bool(TURNING));
    let by_goal: Vec<usize> = keeping.iter().chain(&changing).copied().collect();
    let mut placed: Vec<Vec2> = keeping.iter().map(|&i| -starts[i]).collect();
    scatter(
        &mut placed,
        starts.len(),
        radius_m,
        |a, b| discs[by_goal[a]] + discs[by_goal[b]] + CLEARANCE_M,
        &mut ways,
    );
    let mut goals = vec![Vec2::ZERO; starts.len()];
    for (&i, &goal) in by_goal.iter().zip(&placed) {
        goals[i] = goal;
    }

    sizes
        .iter()
        .enumerate()
        .map(|(i, &(members, gap_m))| {
            let preferred_mps = preferred_mps(members, &mut speeds);
            let start_s = ways.random_range(0.0..LATEST_START_S);
            let stop_s = if ways.random_bool(STOPPING) { ways.random_range(STOP_S) } else { 0.0 };
            let on_the_way = starts[i] * (1.0 - 2.0 * ways.random_range(ON_THE_WAY));
            let mut legs = Vec::new();
            if stop_s > 0.0 || changing.contains(&i) {
                legs.push((on_the_way, stop_s));
            }
            legs.push((goals[i], f32::INFINITY));
            Party { members, gap_m, preferred_mps, start_s, legs }
        })
        .collect()
}

fn walk(parties: &[Party], starts: &[Vec2], whims: impl Fn(usize) -> Option<Whims>) -> Crowd {
    let agents = parties.iter().zip(starts).map(|(party, &start)| {
        let parameters = Parameters {
            max_acceleration_mps2: MOST_ACCELERATION_MPS2,
            ..parameters(10.0, 5.0, disc_m(party.members, party.gap_m), party.preferred_mps * HURRY)
        };
        Agent::new(parameters, start)
    });
    let mut orca = Orca::new(STEP_S, agents.collect(), &[]);
    let mut walks: Vec<Walk> = parties
        .iter()
        .zip(starts)
        .enumerate()
        .map(|(number, (party, &start))| Walk {
            leg: 0,
            stands_until_s: party.start_s,
            row: Row::facing(party.legs[0].0 - start),
            arrived_ns: None,
            whims: whims(number),
        })
        .collect();
    let mut positions: Vec<Vec<DVec2>> = vec![Vec::new(); parties.iter().map(|p| p.members).sum()];
    let mut steps = 0;
    loop {
        let mut person = 0;
        for ((party, walk), agent) in parties.iter().zip(&mut walks).zip(&mut orca.agents) {
            let preferred_mps = walk.prefer(party, agent.position_m, steps);
            agent.preferred_mps = match &mut walk.whims {
                Some(whims) => whims.change(preferred_mps, steps as f32 * STEP_S),
                None => preferred_mps,
            };
            walk.row.turn(agent.velocity_mps);
            for place_m in walk.row.places(agent.position_m, party.members, party.gap_m) {
                positions[person].push(place_m);
                person += 1;
            }
        }
        let done = walks.iter().all(|walk| walk.arrived_ns.is_some()) || steps >= MOST_STEPS;
        if done && steps % SAMPLE_STEPS == 0 {
            break;
        }
        orca.step();
        steps += 1;
    }
    let arrived = parties.iter().zip(&walks).flat_map(|(party, walk)| vec![walk.arrived_ns; party.members]);
    Crowd { trajectories: Trajectory::from_steps(positions, arrived), duration_ns: steps as i64 * STEP_NS }
}

impl Walk {
    /// Where the party would go now; notes what it has reached.
    fn prefer(&mut self, party: &Party, position_m: Vec2, steps: usize) -> Vec2 {
        let now_s = steps as f32 * STEP_S;
        if now_s < self.stands_until_s {
            return Vec2::ZERO;
        }
        let (goal, stop_s) = party.legs[self.leg];
        let to_goal = goal - position_m;
        let distance = to_goal.length();
        if distance >= ARRIVED_M {
            return to_goal * (party.preferred_mps / distance);
        }
        self.stands_until_s = now_s + stop_s;
        if self.leg + 1 == party.legs.len() {
            self.arrived_ns = Some(steps as i64 * STEP_NS);
        } else {
            self.leg += 1;
        }
        Vec2::ZERO
    }
}

impl Row {
    pub(super) fn facing(way: Vec2) -> Self {
        Self { heading_rad: way.to_angle(), turn_radps: 0.0 }
    }

    /// Where the members are.
    pub(super) fn places(self, middle_m: Vec2, members: usize, gap_m: f64) -> impl Iterator<Item = DVec2> {
        let across = DVec2::from_angle(f64::from(self.heading_rad)).perp() * gap_m;
        let place = move |member: usize| member as f64 - 0.5 * (members - 1) as f64;
        (0..members).map(move |member| middle_m.as_dvec2() + across * place(member))
    }

    /// Lets the row follow the motion. It looks the same from behind, so it never turns by more than 90 deg:
    /// those who turn back swap sides.
    pub(super) fn turn(&mut self, velocity_mps: Vec2) {
        let quarter = std::f32::consts::FRAC_PI_2;
        let off = (velocity_mps.to_angle() - self.heading_rad + quarter).rem_euclid(2.0 * quarter) - quarter;
        let moving = velocity_mps.length() >= LEAST_SPEED_MPS;
        let wanted = if moving { (off / TURN_S).clamp(-MOST_TURN_RADPS, MOST_TURN_RADPS) } else { 0.0 };
        let most = MOST_TURN_CHANGE_RADPS2 * STEP_S;
        self.turn_radps += (wanted - self.turn_radps).clamp(-most, most);
        self.heading_rad += self.turn_radps * STEP_S;
    }
}

/// Everybody arrived and strangers kept apart, at 10 Hz.
fn acceptable(crowd: &Crowd, parties: &[Party]) -> bool {
    let party_of: Vec<usize> =
        parties.iter().enumerate().flat_map(|(i, party)| vec![i; party.members]).collect();
    let ways = &crowd.trajectories;
    let apart = |a: usize, b: usize| {
        let samples = ways[a].positions_m.iter().zip(&ways[b].positions_m).step_by(SAMPLE_STEPS);
        samples.into_iter().all(|(p, q)| p.distance(*q) >= APART_M)
    };
    ways.iter().all(|way| way.arrived_ns.is_some())
        && (0..ways.len()).all(|a| (0..a).all(|b| party_of[a] == party_of[b] || apart(a, b)))
}
