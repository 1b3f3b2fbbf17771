//! The people of a leg: they come through doors, walk to somewhere, stop there or not, and leave through another door; four
//! come to sit. At the end of a leg nobody is left, so that every leg may follow every other.

use glam::Vec2;
use rand::RngExt;
use umbracast::Error;
use umbracast::geometry::DVec2;
use umbracast_sim::crowd::orca::{Agent, Orca, Parameters};
use umbracast_sim::crowd::{Crowd, Trajectory};
use umbracast_sim::random::stream;

use super::halls::{Hall, SEATS_DOOR_M};
use super::play::S_NS;

const STEP_S: f32 = 0.01;
const STEP_NS: i64 = 10_000_000;
/// So many walk at once, beside those who sit.
const WALKING: usize = 22;
/// Somebody comes this often where somebody is missing, but nobody after the second time.
const COMES_EVERY_S: f32 = 0.5;
const LAST_COMES_S: f32 = 55.0;
/// A leg in which somebody is still there then is drawn anew.
const ENDS_S: f32 = 110.0;
/// Walkers first go to a place within so far of this one.
const MIDDLE_M: Vec2 = Vec2::new(2.0, 2.0);
const WITHIN_M: f32 = 4.0;
/// So near to a goal one is there.
const THERE_M: f32 = 0.6;
/// A door through which somebody walks lets nobody else in.
const CLEAR_M: f32 = 1.2;
/// Share of people who stop on their way, and for how long.
const STOPPING: f64 = 0.4;
const STOP_S: std::ops::Range<f32> = 2.0..7.0;
const SPEED_MPS: std::ops::Range<f32> = 0.8..1.5;
/// Those who sit come and leave one after the other, so long apart, at this speed.
const SEATED_EVERY_S: f64 = 1.7;
const SEATED_MPS: f64 = 1.1;
const ATTEMPTS: u64 = 50;

/// One who walks.
struct Walk {
    agent: Agent,
    speed_mps: f32,
    goals_m: Vec<Vec2>,
    /// How long to stand at the first goal.
    stop_s: f32,
    stands_until_s: f32,
    first_step: i64,
    positions_m: Vec<DVec2>,
}

/// Everybody of a leg: those who sit first.
///
/// # Errors
/// A hall through which people do not get.
pub fn people(hall: &Hall, seed: u64) -> Result<Crowd, Error> {
    let walks = (0..ATTEMPTS).find_map(|attempt| walk(hall, seed, attempt));
    let walks =
        walks.ok_or_else(|| Error::new("a leg of which everybody leaves: expected one, found none"))?;
    let seated = hall.seats_m.iter().enumerate().map(|(number, seat_m)| sit(number, *seat_m));
    let walked = walks.into_iter().map(|walk| (walk.first_step * STEP_NS, walk.positions_m));
    let ways = seated.chain(walked).enumerate();
    let trajectories: Vec<Trajectory> = ways
        .map(|(person, (start_ns, positions_m))| Trajectory {
            person: person as u32,
            start_ns,
            step_ns: STEP_NS,
            positions_m,
            arrived_ns: None,
            height_m: None,
        })
        .collect();
    let end_ns = trajectories.iter().map(|way| way.start_ns + STEP_NS * way.positions_m.len() as i64).max();
    let seconds = end_ns.unwrap_or(0) / S_NS + 1;
    Ok(Crowd { trajectories, duration_ns: seconds * S_NS })
}

/// Those who walk; `None` where somebody does not get through.
fn walk(hall: &Hall, seed: u64, attempt: u64) -> Option<Vec<Walk>> {
    let rng = &mut stream(seed, "soak", attempt);
    let doors_m: Vec<Vec2> = hall.doors_m.iter().map(|door_m| door_m.as_vec2()).collect();
    let blocked_m: Vec<Vec<Vec2>> =
        hall.blocked_m.iter().map(|corners_m| corners_m.iter().map(|m| m.as_vec2()).collect()).collect();
    let mut orca = Orca::new(STEP_S, Vec::new(), &blocked_m);
    let (mut present, mut gone): (Vec<Walk>, Vec<Walk>) = (Vec::new(), Vec::new());
    let mut next_s = 0.0;
    for step in 0.. {
        let now_s = step as f32 * STEP_S;
        if now_s >= ENDS_S {
            return None;
        }
        if now_s >= next_s && now_s < LAST_COMES_S && present.len() < WALKING {
            let from = rng.random_range(0..doors_m.len());
            let is_clear = |walk: &Walk| walk.agent.position_m.distance(doors_m[from]) > CLEAR_M;
            if present.iter().all(is_clear) {
                let to = (from + rng.random_range(1..doors_m.len())) % doors_m.len();
                let aside_m = Vec2::from_angle(rng.random_range(0.0..std::f32::consts::TAU));
                let middle_m = MIDDLE_M + aside_m * rng.random_range(0.0..WITHIN_M);
                let speed_mps = rng.random_range(SPEED_MPS);
                present.push(Walk {
                    agent: Agent::new(manners(speed_mps), doors_m[from]),
                    speed_mps,
                    goals_m: vec![doors_m[to], middle_m],
                    stop_s: if rng.random_bool(STOPPING) { rng.random_range(STOP_S) } else { 0.0 },
                    stands_until_s: 0.0,
                    first_step: step,
                    positions_m: Vec::new(),
                });
                next_s = now_s + COMES_EVERY_S;
            }
        }
        present.iter_mut().for_each(|walk| walk.look(now_s));
        let (left, stay): (Vec<Walk>, Vec<Walk>) =
            present.into_iter().partition(|walk| walk.goals_m.is_empty());
        gone.extend(left);
        present = stay;
        if present.is_empty() && now_s >= LAST_COMES_S {
            gone.sort_by_key(|walk| walk.first_step);
            return Some(gone);
        }
        orca.agents = present.iter().map(|walk| walk.agent).collect();
        orca.step();
        for (walk, agent) in present.iter_mut().zip(&orca.agents) {
            walk.agent = *agent;
        }
    }
    None
}

fn manners(speed_mps: f32) -> Parameters {
    Parameters {
        neighbor_distance_m: 6.0,
        max_neighbors: 10,
        horizon_s: 3.0,
        obstacle_horizon_s: 0.5,
        radius_m: 0.35,
        max_speed_mps: 1.3 * speed_mps,
        max_acceleration_mps2: 2.0,
    }
}

impl Walk {
    /// Notes the place, and where to go from it.
    fn look(&mut self, now_s: f32) {
        self.positions_m.push(self.agent.position_m.as_dvec2());
        let Some(&goal_m) = self.goals_m.last() else { return };
        let to_goal_m = goal_m - self.agent.position_m;
        if to_goal_m.length() < THERE_M {
            self.goals_m.pop();
            self.stands_until_s = now_s + std::mem::take(&mut self.stop_s);
        }
        let stands = now_s < self.stands_until_s;
        self.agent.preferred_mps =
            if stands { Vec2::ZERO } else { to_goal_m.normalize_or_zero() * self.speed_mps };
    }
}

/// The way of one who sits: when it begins, and where it leads.
fn sit(number: usize, seat_m: DVec2) -> (i64, Vec<DVec2>) {
    let begins_s = SEATED_EVERY_S * number as f64;
    let leaves_s = f64::from(LAST_COMES_S) + begins_s;
    let way_s = seat_m.distance(SEATS_DOOR_M) / SEATED_MPS;
    let steps = ((leaves_s + way_s - begins_s) / f64::from(STEP_S)) as usize;
    let place = |step: usize| {
        let now_s = begins_s + step as f64 * f64::from(STEP_S);
        let share = ((now_s - begins_s) / way_s).min((leaves_s + way_s - now_s) / way_s).clamp(0.0, 1.0);
        SEATS_DOOR_M.lerp(seat_m, share)
    };
    ((begins_s * S_NS as f64) as i64 / STEP_NS * STEP_NS, (0..=steps).map(place).collect())
}
