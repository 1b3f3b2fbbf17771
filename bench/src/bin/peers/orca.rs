//! One step of a crowd, in the middle of its walk: everybody picks a velocity that keeps clear of the ten nearest, and moves.
//!
//! The peer is `dodgy_2d`, a port of RVO2. Its `Simulator` keeps a hash map of all pairs and passes over those who are near
//! in place of those who are far, so it answers no question worth timing; its documentation recommends the bare step with
//! the user's own search. That search is here the k-d tree of `kiddo`, which its users would take, for the same ten.

use std::borrow::Cow;
use std::f32::consts::TAU;
use std::num::NonZero;
use std::path::Path;

use glam::Vec2;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use umbracast_sim::crowd::orca::{Agent, Orca, Parameters};

use crate::exchange::{Answer, times, uniform, write_f32};

const CROWDS: [usize; 3] = [10, 1000, 10_000];
const STEP_S: f32 = 0.1;
/// Steps before the one that counts: people have met by then.
const BEFORE: usize = 50;
/// The square that everybody starts in the middle of, give or take a quarter, metres.
const PLACE_M: f32 = 1.5;
/// `orca-03`, which is also the default of RVO2's users.
const PARAMETERS: Parameters = Parameters {
    neighbor_distance_m: 10.0,
    max_neighbors: 10,
    horizon_s: 5.0,
    obstacle_horizon_s: 5.0,
    radius_m: 0.3,
    max_speed_mps: 1.0,
    max_acceleration_mps2: f32::INFINITY,
};

/// A crowd in which everybody wants to go a way of their own, after some steps of it.
fn crowd(people: usize) -> Orca {
    let mut state = people as u64;
    let side = (people as f32).sqrt().ceil() as usize;
    let mut agent = |i: usize| {
        let off = [(); 2].map(|()| 0.5 * (uniform(&mut state) as f32 - 0.5));
        let place = Vec2::new((i % side) as f32, (i / side) as f32) + Vec2::from_array(off);
        let preferred_mps = Vec2::from_angle(TAU * uniform(&mut state) as f32);
        Agent { preferred_mps, ..Agent::new(PARAMETERS, place * PLACE_M) }
    };
    let mut orca = Orca::new(STEP_S, (0..people).map(&mut agent).collect(), &[]);
    (0..BEFORE).for_each(|_| orca.step());
    orca
}

/// Ours.
pub fn row(folder: &Path) -> Answer {
    let mut answer = Answer::default();
    for people in CROWDS {
        let crowd = crowd(people);
        let state = |a: &Agent| [a.position_m, a.velocity_mps, a.preferred_mps].map(|v: Vec2| v.to_array());
        let state: Vec<f32> = crowd.agents.iter().flat_map(state).flatten().collect();
        write_f32(folder, &format!("crowd_{people}"), &[people, 3, 2], &state);
        let mut after_m = Vec::new();
        let ms = times(
            tries(people),
            || crowd.clone(),
            |orca| {
                orca.step();
                if after_m.is_empty() {
                    after_m = orca.agents.iter().map(|agent| agent.position_m).collect();
                }
            },
        );
        note(&mut answer, people, &ms, &after_m, &after_m);
    }
    answer
}

/// The peer. It is in Rust, so the crowd is made again in place of being read.
pub fn dodgy(_: &Path) -> Answer {
    let mut answer = Answer::default();
    for people in CROWDS {
        let mut ours = crowd(people);
        let vec = |v: Vec2| dodgy_2d::Vec2::from_array(v.to_array());
        let agent = |a: &Agent| dodgy_2d::Agent {
            position: vec(a.position_m),
            velocity: vec(a.velocity_mps),
            radius: PARAMETERS.radius_m,
            avoidance_responsibility: 1.0,
        };
        let agents: Vec<_> = ours.agents.iter().map(agent).collect();
        let preferred_mps: Vec<_> = ours.agents.iter().map(|a| vec(a.preferred_mps)).collect();
        ours.step();
        let ours_m: Vec<Vec2> = ours.agents.iter().map(|a| a.position_m).collect();
        let mut after_m = Vec::new();
        let ms = times(
            tries(people),
            || agents.clone(),
            |agents| {
                step(agents, &preferred_mps);
                if after_m.is_empty() {
                    after_m = agents.iter().map(|a| Vec2::from_array(a.position.to_array())).collect();
                }
            },
        );
        note(&mut answer, people, &ms, &after_m, &ours_m);
    }
    answer
}

/// One step of the peer: a tree of everybody, the ten nearest of each, velocities, and then the moves.
fn step(agents: &mut [dodgy_2d::Agent], preferred_mps: &[dodgy_2d::Vec2]) {
    let options = dodgy_2d::AvoidanceOptions {
        obstacle_margin: PARAMETERS.radius_m,
        time_horizon: PARAMETERS.horizon_s,
        obstacle_time_horizon: PARAMETERS.obstacle_horizon_s,
    };
    let places_m: Vec<[f32; 2]> = agents.iter().map(|agent| agent.position.to_array()).collect();
    let tree = ImmutableKdTree::new_from_slice(&places_m).expect("nobody stands nowhere");
    // One more, for whoever asks is found too.
    let most = NonZero::new(PARAMETERS.max_neighbors + 1).expect("it is not 0");
    let range_sq = PARAMETERS.neighbor_distance_m * PARAMETERS.neighbor_distance_m;
    let mut neighbors = Vec::with_capacity(most.get());
    let choose = |(i, agent): (usize, &_)| {
        let nearest =
            tree.query(&places_m[i]).nearest_n::<SquaredEuclidean<f32>>(most).within(range_sq).execute();
        neighbors.clear();
        let others = nearest.iter().map(|found| found.item as usize).filter(|&other| other != i);
        neighbors.extend(others.map(|other| Cow::Borrowed(&agents[other])));
        let agent: &dodgy_2d::Agent = agent;
        let fastest_mps = PARAMETERS.max_speed_mps;
        agent.compute_avoiding_velocity(&neighbors, &[], preferred_mps[i], fastest_mps, STEP_S, &options)
    };
    let next_mps: Vec<dodgy_2d::Vec2> = agents.iter().enumerate().map(choose).collect();
    for (agent, velocity) in agents.iter_mut().zip(next_mps) {
        agent.velocity = velocity;
        agent.position += velocity * STEP_S;
    }
}

/// A step of ten takes microseconds, one of ten thousand much longer.
fn tries(people: usize) -> usize {
    (200_000 / people).clamp(30, 1000)
}

/// How near the two nearest are after the step, and how far people are from where our step puts them.
fn note(answer: &mut Answer, people: usize, ms: &[f64], after_m: &[Vec2], ours_m: &[Vec2]) {
    let apart =
        |(i, a): (usize, &Vec2)| after_m[..i].iter().map(|b| a.distance(*b)).fold(f32::INFINITY, f32::min);
    let least_m = after_m.iter().enumerate().map(apart).fold(f32::INFINITY, f32::min);
    let off_mm = after_m.iter().zip(ours_m).map(|(a, b)| 1e3 * f64::from(a.distance(*b)));
    let found = [
        ("least distance, m", f64::from(least_m)),
        ("mean off ours, mm", off_mm.clone().sum::<f64>() / people as f64),
        ("share within 1 mm of ours", off_mm.filter(|&mm| mm < 1.0).count() as f64 / people as f64),
    ];
    answer.case(&format!("{people} people"), ms, &found);
}
