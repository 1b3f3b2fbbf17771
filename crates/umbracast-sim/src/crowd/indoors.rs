//! Crowds in a hall without room for the circle. People walk from place to place, or between entrances if the site
//! names some, around walls, pillars and furniture. People of a mixed crowd may stop on the way, or queue where the
//! site has places for that.

use glam::Vec2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use umbracast::geometry::DVec2;

use super::circle::{PAIR_GAP_M, PREFERRED_MPS, setting};
use super::crossing::{ARRIVED_M, MOST_STEPS, SAMPLE_STEPS, STEP_S};
use super::floor::Floor;
use super::mixed::{self, Row};
use super::orca::{Agent, Orca, Parameters};
use super::places::{ELBOW_M, drawn_apart, in_queue};
use super::preset::Preset;
use super::steering::Steering;
use super::trajectory::{Crowd, STEP_NS, Trajectory};
use super::whims::Whims;
use crate::random::stream;

/// After so many dropped scenes the last one stands, whatever its faults.
const MOST_ATTEMPTS: u64 = 30;
/// Walls and things are avoided for so long ahead: longer, and nobody would walk along one.
pub(super) const THINGS_S: f32 = 0.5;
/// Ways are made with so much more room than the disc.
pub(super) const ASIDE_M: f32 = 0.1;
/// Goals lie so far from the start, as a share of the farthest place from there.
const FAR_SHARE: f32 = 0.5;
/// Who has arrived stands near a wall or a thing, not in others' way.
const STANDS_M: f32 = 0.8;
/// How near those who leave, and those who queue, come to their goal.
const LEAVES_M: f32 = 0.5;
const QUEUES_M: f32 = 0.25;
/// Through one entrance people come one after the other.
const ENTER_EVERY_S: f32 = 2.0;
/// The slowest walk at this speed on the longest way.
const SLOWEST_MPS: f32 = 0.5;

/// Free floor for one who walks, square metres: below it ORCA's discs stand still.
const FLOOR_EACH_M2: f32 = 1.5;

/// People who walk together: one, or a row.
struct Party {
    members: usize,
    gap_m: f64,
    parameters: Parameters,
    preferred_mps: f32,
    start_s: f32,
    start: Vec2,
    enters: bool,
    legs: Vec<Leg>,
    whims: Option<Whims>,
}

#[derive(Clone, Copy)]
struct Leg {
    goal: Vec2,
    near_m: f32,
    /// How long to stand there; endless at the last.
    stop_s: f32,
    /// Through an entrance.
    leaves: bool,
}

/// A party on its way.
struct Walk {
    leg: usize,
    steering: Steering,
    stands_until_s: f32,
    row: Row,
    whims: Option<Whims>,
    arrived_ns: Option<i64>,
    first_step: usize,
    /// By member.
    positions: Vec<Vec<DVec2>>,
}

impl Floor {
    /// So many people can walk on it.
    pub(super) fn most_people(&self) -> usize {
        (self.free_m2(ELBOW_M + ASIDE_M) / FLOOR_EACH_M2) as usize
    }
}

/// Scenes in which not everybody arrives, or somebody comes too near to a wall or to others, are dropped and drawn anew.
/// Coordinates are the floor's.
pub(super) fn crowd(preset: Preset, people: usize, floor: &Floor, seed: u64) -> Crowd {
    let mut attempt = 0;
    loop {
        let parties = parties(preset, people, floor, &mut stream(seed, "indoors", attempt));
        let (crowd, party_of) = walk(&parties, floor);
        attempt += 1;
        if acceptable(&crowd, &party_of, floor, preset) || attempt == MOST_ATTEMPTS {
            return crowd;
        }
    }
}

fn parties(preset: Preset, people: usize, floor: &Floor, rng: &mut Pcg64) -> Vec<Party> {
    let lively = matches!(preset, Preset::Mixed | Preset::Natural | Preset::Pairs);
    let sizes = match preset {
        Preset::Orca03 | Preset::Orca06 => vec![(1, 0.0); people],
        Preset::Pairs => vec![(2, PAIR_GAP_M); people.div_ceil(2)],
        Preset::Mixed | Preset::Natural => mixed::sizes(people, rng),
    };
    let (plain, spacing_m) = setting(preset);
    let disc_m = |members: usize, gap_m: f64| match lively {
        true => mixed::disc_m(members, gap_m),
        false => plain.radius_m,
    };
    let largest_m = sizes.iter().map(|&(members, gap_m)| disc_m(members, gap_m)).fold(0.0, f32::max);
    let mut places = floor.places(largest_m + ASIDE_M);
    if places.is_empty() {
        places = floor.places(ELBOW_M + ASIDE_M);
    }
    let beside: Vec<Vec2> =
        places.iter().copied().filter(|at| floor.clear_at(*at) <= largest_m + ASIDE_M + STANDS_M).collect();
    let (mut starts, mut goals, mut queue) = (Vec::new(), Vec::new(), vec![0; floor.places_m.len()]);
    let mut entered_s = vec![0.0; floor.entrances_m.len()];
    let mut parties = Vec::new();
    for (number, &(members, gap_m)) in sizes.iter().enumerate() {
        let radius_m = disc_m(members, gap_m);
        let apart_m = if lively { 2.0 * radius_m + mixed::CLEARANCE_M } else { spacing_m };
        let door = (!entered_s.is_empty()).then(|| rng.random_range(0..entered_s.len()));
        let door = door.filter(|_| number % 2 == 1);
        let mut start_s = if lively { rng.random_range(0.0..mixed::LATEST_START_S) } else { 0.0 };
        let start = match door {
            Some(door) => {
                start_s = entered_s[door];
                entered_s[door] += ENTER_EVERY_S * members as f32;
                floor.entrances_m[door]
            }
            None => drawn_apart(&places, &starts, apart_m, |_| true, rng),
        };
        if door.is_none() {
            starts.push(start);
        }
        let goal = match entered_s.len() {
            0 => {
                let farthest_m = beside.iter().map(|at| at.distance(start)).fold(0.0, f32::max);
                let is_far = |at: Vec2| at.distance(start) >= FAR_SHARE * farthest_m;
                let goal = drawn_apart(&beside, &goals, apart_m + ARRIVED_M, is_far, rng);
                goals.push(goal);
                Leg { goal, near_m: ARRIVED_M, stop_s: f32::INFINITY, leaves: false }
            }
            count => {
                let other = rng.random_range(0..count);
                // Nobody leaves where he came in, if there is another door.
                let out = if Some(other) == door { (other + 1) % count } else { other };
                let goal = floor.entrances_m[out];
                Leg { goal, near_m: LEAVES_M, stop_s: f32::INFINITY, leaves: true }
            }
        };
        let mut legs = vec![goal];
        if matches!(preset, Preset::Mixed | Preset::Natural) && rng.random_bool(mixed::STOPPING) {
            let stop_s = rng.random_range(mixed::STOP_S);
            let (at, near_m) = match queue.len() {
                0 => {
                    let way = Steering::new(floor, start, goal.goal, radius_m + ASIDE_M);
                    (way.part_way(start, rng.random_range(0.3..0.7)), ARRIVED_M)
                }
                count => {
                    let place = rng.random_range(0..count);
                    queue[place] += 1;
                    (in_queue(floor, floor.places_m[place], queue[place] - 1), QUEUES_M)
                }
            };
            legs.insert(0, Leg { goal: at, near_m, stop_s, leaves: false });
        }
        let preferred_mps = if lively { mixed::preferred_mps(members, rng) } else { PREFERRED_MPS };
        let parameters = Parameters { obstacle_horizon_s: THINGS_S, radius_m, ..plain };
        let parameters = match lively {
            true => Parameters {
                max_acceleration_mps2: mixed::MOST_ACCELERATION_MPS2,
                max_speed_mps: preferred_mps * mixed::HURRY,
                ..parameters
            },
            false => parameters,
        };
        let enters = door.is_some();
        let whims = (preset == Preset::Natural).then(|| Whims::new(Pcg64::seed_from_u64(rng.random())));
        parties.push(Party {
            members,
            gap_m,
            parameters,
            preferred_mps,
            start_s,
            start,
            enters,
            legs,
            whims,
        });
    }
    parties
}

/// Everybody's way, and whose party each person is of.
fn walk(parties: &[Party], floor: &Floor) -> (Crowd, Vec<usize>) {
    let mut orca = Orca::new(STEP_S, Vec::new(), &floor.polygons);
    let mut party_of_agent: Vec<usize> = Vec::new();
    let mut walks: Vec<Walk> = parties.iter().map(|party| Walk::new(party, floor)).collect();
    let mut waiting: Vec<usize> = (0..parties.len()).collect();
    let longest_m: f32 = parties
        .iter()
        .map(|party| party.legs.iter().map(|leg| leg.goal.distance(party.start)).sum::<f32>())
        .fold(0.0, f32::max);
    let most_steps = MOST_STEPS + (2.0 * longest_m / SLOWEST_MPS / STEP_S) as usize;
    let mut steps = 0;
    loop {
        let now_s = steps as f32 * STEP_S;
        waiting.retain(|&i| {
            let party = &parties[i];
            let reach_m = |agent: &Agent| agent.parameters.radius_m + party.parameters.radius_m;
            let is_free = |agent: &Agent| agent.position_m.distance(party.start) > reach_m(agent);
            if party.enters && (now_s < party.start_s || !orca.agents.iter().all(is_free)) {
                return true;
            }
            walks[i].first_step = steps;
            orca.agents.push(Agent::new(party.parameters, party.start));
            party_of_agent.push(i);
            false
        });
        let mut gone = Vec::new();
        for (a, &i) in party_of_agent.iter().enumerate() {
            let (party, walk, agent) = (&parties[i], &mut walks[i], &mut orca.agents[a]);
            let preferred_mps = walk.prefer(party, floor, agent.position_m, steps);
            agent.preferred_mps = match &mut walk.whims {
                Some(whims) => whims.change(preferred_mps, now_s),
                None => preferred_mps,
            };
            walk.row.turn(agent.velocity_mps);
            let places = walk.row.places(agent.position_m, party.members, party.gap_m);
            places.zip(&mut walk.positions).for_each(|(place_m, way)| way.push(place_m));
            if walk.arrived_ns.is_some() && party.legs[walk.leg].leaves {
                gone.push(a);
            }
        }
        for a in gone.into_iter().rev() {
            orca.agents.remove(a);
            party_of_agent.remove(a);
        }
        let done = walks.iter().all(|walk| walk.arrived_ns.is_some()) || steps >= most_steps;
        if done && steps % SAMPLE_STEPS == 0 {
            break;
        }
        orca.step();
        steps += 1;
    }
    let (mut trajectories, mut party_of) = (Vec::new(), Vec::new());
    for (i, walk) in walks.into_iter().enumerate() {
        for positions_m in walk.positions {
            party_of.push(i);
            trajectories.push(Trajectory {
                person: trajectories.len() as u32,
                start_ns: walk.first_step as i64 * STEP_NS,
                step_ns: STEP_NS,
                positions_m,
                arrived_ns: walk.arrived_ns,
                height_m: None,
            });
        }
    }
    (Crowd { trajectories, duration_ns: steps as i64 * STEP_NS }, party_of)
}

impl Walk {
    fn new(party: &Party, floor: &Floor) -> Self {
        let steering =
            Steering::new(floor, party.start, party.legs[0].goal, party.parameters.radius_m + ASIDE_M);
        Self {
            leg: 0,
            stands_until_s: if party.enters { 0.0 } else { party.start_s },
            row: Row::facing(steering.first() - party.start),
            steering,
            whims: party.whims.clone(),
            arrived_ns: None,
            first_step: 0,
            positions: vec![Vec::new(); party.members],
        }
    }

    /// Where the party would go now; notes what it has reached.
    fn prefer(&mut self, party: &Party, floor: &Floor, position_m: Vec2, steps: usize) -> Vec2 {
        let now_s = steps as f32 * STEP_S;
        if now_s < self.stands_until_s {
            return Vec2::ZERO;
        }
        let (leg, room_m) = (party.legs[self.leg], party.parameters.radius_m + ASIDE_M);
        if leg.goal.distance(position_m) >= leg.near_m {
            return self.steering.preferred_mps(floor, position_m, room_m, party.preferred_mps, steps);
        }
        self.stands_until_s = now_s + leg.stop_s;
        if self.leg + 1 == party.legs.len() {
            self.arrived_ns = Some(steps as i64 * STEP_NS);
        } else {
            self.leg += 1;
            self.steering = Steering::new(floor, position_m, party.legs[self.leg].goal, room_m);
        }
        Vec2::ZERO
    }
}

/// Everybody arrived, nobody came too near to a wall or a thing, and strangers kept apart, at 10 Hz.
fn acceptable(crowd: &Crowd, party_of: &[usize], floor: &Floor, preset: Preset) -> bool {
    let ways = &crowd.trajectories;
    let sampled = |i: usize| {
        let first = (ways[i].start_ns / STEP_NS) as usize;
        let samples = ways[i].positions_m.iter().enumerate().map(move |(k, at)| (first + k, *at));
        samples.filter(|(step, _)| step % SAMPLE_STEPS == 0)
    };
    let room = |i: usize| sampled(i).all(|(_, at)| floor.clear_at(at.as_vec2()) >= ELBOW_M);
    let apart_m = if preset == Preset::Orca06 { 2.0 * mixed::APART_M } else { mixed::APART_M };
    let apart = |a: usize, b: usize| {
        let first = (ways[b].start_ns / STEP_NS) as usize;
        let other = |step: usize| ways[b].positions_m.get(step.checked_sub(first)?);
        sampled(a).all(|(step, at)| other(step).is_none_or(|other| other.distance(at) >= apart_m))
    };
    ways.iter().all(|way| way.arrived_ns.is_some())
        && (0..ways.len()).all(room)
        && (0..ways.len()).all(|a| (0..a).all(|b| party_of[a] == party_of[b] || apart(a, b)))
}

#[cfg(test)]
mod tests {
    use super::super::ground::{Ground, drawn};
    use super::*;
    use umbracast::{Config, Site};

    fn site(outline_m: &[[f64; 2]]) -> Site {
        let mut site = Config::default().site;
        site.hall.outline_m = outline_m.iter().map(|[x, y]| [x + 1000.0, y - 2000.0]).collect();
        site.furniture.truncate(1);
        site.furniture[0].position_m = [1004.0, -1998.0];
        site.furniture[0].size_m = [2.0, 1.0, 0.8];
        site.pillars.truncate(1);
        site.pillars[0].position_m = [1003.0, -1988.0];
        site
    }

    const L: [[f64; 2]; 6] = [[0.0, 0.0], [18.0, 0.0], [18.0, 6.0], [7.0, 6.0], [7.0, 18.0], [0.0, 18.0]];

    #[test]
    fn every_crowd_walks_in_an_l_far_from_the_origin_and_arrives() {
        let site = site(&L);
        let ground = Ground::of(&site, 12.5).unwrap();
        ground.hold(10).unwrap();
        assert!(ground.hold(1000).unwrap_err().to_string().contains("people: expected "));
        for preset in Preset::ALL {
            let crowd = drawn(preset, 10, &ground, 200_000);
            assert_eq!(crowd.trajectories.len(), 10);
            for way in &crowd.trajectories {
                assert!(way.arrived_ns.is_some(), "{}: person {}", preset.name(), way.person);
                let nearest_m = way.positions_m.iter().map(|at| super::super::floor::clearance_m(&site, *at));
                let nearest_m = nearest_m.fold(f64::INFINITY, f64::min);
                assert!(nearest_m > 0.1, "{}: person {}: {nearest_m} m", preset.name(), way.person);
                let walked_m: f64 = way.positions_m.windows(2).map(|p| p[0].distance(p[1])).sum();
                assert!(walked_m > 3.0, "{}: person {} walked {walked_m} m", preset.name(), way.person);
            }
            assert_eq!(crowd, drawn(preset, 10, &ground, 200_000), "the same seed");
        }
    }

    #[test]
    fn people_come_in_and_leave_through_the_entrances_and_queue_at_places() {
        let mut site = site(&L);
        site.simulation.entrances_m = vec![[1017.0, -1997.0], [1003.5, -1983.0]];
        site.simulation.places_m = vec![[1002.0, -1997.0]];
        let crowd = drawn(Preset::Mixed, 12, &Ground::of(&site, 12.5).unwrap(), 200_001);
        let door =
            |at: &DVec2| site.simulation.entrances_m.iter().any(|e| at.distance(DVec2::from_array(*e)) < 1.3);
        assert!(crowd.trajectories.iter().all(|way| way.positions_m.last().is_some_and(door)));
        assert!(crowd.trajectories.iter().any(|way| way.start_ns > 0 && door(&way.positions_m[0])));
    }
}
