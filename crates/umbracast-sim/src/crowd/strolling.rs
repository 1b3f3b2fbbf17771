//! People who cross a circle again and again, for any time.

use std::sync::Arc;

use glam::Vec2;
use rand::RngExt;
use rand_pcg::Pcg64;
use umbracast::geometry::DVec2;

use super::circle::setting;
use super::crossing::{ARRIVED_M, STEP_S, scatter};
use super::floor::Floor;
use super::ground::Ground;
use super::indoors::{ASIDE_M, THINGS_S};
use super::orca::{Agent, Orca, Parameters};
use super::places::drawn_apart;
use super::preset::Preset;
use super::steering::Steering;
use super::trajectory::{Crowd, STEP_NS, Trajectory};
use crate::random::stream;

/// Preferred speeds, m/s: everybody has one of these for good, so that no two walk in step.
const PREFERRED_MPS: std::ops::Range<f32> = 0.8..1.3;
/// The next goal lies opposite, or so far to its side, radians.
const ASIDE_RAD: f32 = 0.8;

/// People who stroll for as long as they are asked to.
#[derive(Debug)]
pub struct Stroll {
    orca: Orca,
    goals: Vec<Vec2>,
    preferred_mps: Vec<f32>,
    walks: Walks,
    middle_m: DVec2,
    steps: usize,
    rng: Pcg64,
}

/// Where goals lie and how people get there.
#[derive(Debug)]
enum Walks {
    Across { radius_m: f32 },
    Round { floor: Arc<Floor>, places: Vec<Vec2>, radius_m: f32, ways: Vec<Steering> },
}

impl Stroll {
    /// Everybody walks across the circle, and on arrival to another point of it; on a floor from place to place. Nobody
    /// ever arrives for good. Spacing and manners are those of the preset; mixed and natural crowds and pairs stroll like `orca-03`.
    pub fn new(preset: Preset, people: usize, ground: &Ground, seed: u64) -> Self {
        let (mut parameters, spacing_m) = setting(preset);
        parameters.max_speed_mps = parameters.max_speed_mps.max(PREFERRED_MPS.end);
        let mut rng = stream(seed, "strolling", 0);
        let (radius_m, middle_m) = match ground {
            Ground::Circle { radius_m, middle_m } => (*radius_m, *middle_m),
            Ground::Floor(floor) => return Self::indoors(parameters, spacing_m, people, floor, rng),
        };
        let mut starts = Vec::new();
        scatter(&mut starts, people, radius_m as f32, |_, _| spacing_m, &mut rng);
        let preferred_mps: Vec<f32> = starts.iter().map(|_| rng.random_range(PREFERRED_MPS)).collect();
        let goals: Vec<Vec2> = starts.iter().map(|start| -*start).collect();
        let agents = starts.iter().map(|&start| Agent::new(parameters, start)).collect();
        let (orca, walks) = (Orca::new(STEP_S, agents, &[]), Walks::Across { radius_m: radius_m as f32 });
        Self { orca, goals, preferred_mps, walks, middle_m, steps: 0, rng }
    }

    fn indoors(
        parameters: Parameters,
        spacing_m: f32,
        people: usize,
        floor: &Arc<Floor>,
        mut rng: Pcg64,
    ) -> Self {
        let parameters = Parameters { obstacle_horizon_s: THINGS_S, ..parameters };
        let radius_m = parameters.radius_m + ASIDE_M;
        let places = floor.places(radius_m);
        let mut starts: Vec<Vec2> = Vec::new();
        for _ in 0..people {
            starts.push(drawn_apart(&places, &starts, spacing_m, |_| true, &mut rng));
        }
        let preferred_mps: Vec<f32> = starts.iter().map(|_| rng.random_range(PREFERRED_MPS)).collect();
        let agents = starts.iter().map(|&start| Agent::new(parameters, start)).collect();
        // Everybody has arrived, and so looks for the first goal.
        let ways = starts.iter().map(|_| Steering::default()).collect();
        Self {
            orca: Orca::new(STEP_S, agents, &floor.polygons),
            goals: starts,
            preferred_mps,
            walks: Walks::Round { floor: floor.clone(), places, radius_m, ways },
            middle_m: floor.zero_m,
            steps: 0,
            rng,
        }
    }

    /// The next `seconds` of everybody, from where the last ones ended. Time begins at 0 again.
    pub fn leg(&mut self, seconds: u64) -> Crowd {
        let steps = seconds as usize * (1_000_000_000 / STEP_NS) as usize;
        let way = |agent: &Agent| {
            let mut positions_m = Vec::with_capacity(steps + 1);
            positions_m.push(agent.position_m.as_dvec2());
            positions_m
        };
        let mut positions: Vec<Vec<DVec2>> = self.orca.agents.iter().map(way).collect();
        for _ in 0..steps {
            self.step();
            for (way, agent) in positions.iter_mut().zip(&self.orca.agents) {
                way.push(agent.position_m.as_dvec2());
            }
        }
        let trajectories = Trajectory::from_steps(positions, std::iter::repeat(None));
        Crowd { trajectories, duration_ns: steps as i64 * STEP_NS }.moved(self.middle_m)
    }

    fn step(&mut self) {
        let people = self.orca.agents.iter_mut().zip(&mut self.goals).zip(&self.preferred_mps);
        for (i, ((agent, goal), &speed)) in people.enumerate() {
            let has_arrived = (*goal - agent.position_m).length() < ARRIVED_M;
            agent.preferred_mps = match &mut self.walks {
                Walks::Across { radius_m } => {
                    if has_arrived {
                        let aside = Vec2::from_angle(self.rng.random_range(-ASIDE_RAD..ASIDE_RAD));
                        *goal = aside.rotate(-agent.position_m.normalize_or(Vec2::X)) * *radius_m;
                    }
                    (*goal - agent.position_m).normalize_or_zero() * speed
                }
                Walks::Round { floor, places, radius_m, ways } => {
                    if has_arrived {
                        let is_other = |at: Vec2| at.distance(agent.position_m) > 2.0 * ARRIVED_M;
                        *goal = drawn_apart(places, &[], 0.0, is_other, &mut self.rng);
                        ways[i] = Steering::new(floor, agent.position_m, *goal, *radius_m);
                    }
                    ways[i].preferred_mps(floor, agent.position_m, *radius_m, speed, self.steps)
                }
            };
        }
        self.steps += 1;
        self.orca.step();
    }
}

/// People who stroll for `seconds`: see [`Stroll`].
pub fn strolling(preset: Preset, people: usize, radius_m: f64, seed: u64, seconds: u64) -> Crowd {
    Stroll::new(preset, people, &Ground::circle(radius_m), seed).leg(seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_stops_and_nobody_leaves_the_circle() {
        let crowd = strolling(Preset::Orca03, 6, 8.0, 3, 60);
        assert_eq!((crowd.trajectories.len(), crowd.duration_ns), (6, 60_000_000_000));
        for way in &crowd.trajectories {
            let walked_m: f64 = way.positions_m.windows(2).map(|p| p[0].distance(p[1])).sum();
            assert!(walked_m > 0.6 * 60.0, "person {} walked {walked_m} m", way.person);
            assert!(way.positions_m.iter().all(|p| p.length() < 10.0), "person {}", way.person);
            let speed_mps = |p: &[DVec2]| p[0].distance(p[1]) / f64::from(STEP_S);
            assert!(way.positions_m.windows(2).all(|p| speed_mps(p) < 1.4));
        }
    }

    #[test]
    fn in_a_hall_people_stroll_round_what_stands_there() {
        let mut site = umbracast::Config::default().site;
        site.hall.outline_m = vec![[50.0, 50.0], [66.0, 50.0], [66.0, 58.0], [50.0, 58.0]];
        site.furniture.clear();
        site.pillars.truncate(1);
        site.pillars[0].position_m = [58.0, 54.0];
        let ground = Ground::of(&site, 12.5).unwrap();
        for way in Stroll::new(Preset::Orca03, 6, &ground, 3).leg(60).trajectories {
            let walked_m: f64 = way.positions_m.windows(2).map(|p| p[0].distance(p[1])).sum();
            assert!(walked_m > 25.0, "person {} walked {walked_m} m", way.person);
            let room_m = way.positions_m.iter().map(|at| crate::crowd::floor::clearance_m(&site, *at));
            let least_m = room_m.fold(f64::INFINITY, f64::min);
            assert!(least_m > 0.15, "person {}: {least_m} m", way.person);
        }
    }

    #[test]
    fn legs_are_the_same_way_as_one_long_walk() {
        let mut stroll = Stroll::new(Preset::Orca03, 4, &Ground::circle(8.0), 3);
        let (first, second) = (stroll.leg(7), stroll.leg(5));
        let whole = strolling(Preset::Orca03, 4, 8.0, 3, 12);
        for ((first, second), whole) in
            first.trajectories.iter().zip(&second.trajectories).zip(&whole.trajectories)
        {
            let both: Vec<DVec2> =
                first.positions_m.iter().chain(&second.positions_m[1..]).copied().collect();
            assert_eq!(both, whole.positions_m, "person {}", whole.person);
        }
    }
}
