//! Optimal reciprocal collision avoidance: agents that pick, each step, the velocity nearest to the wished one
//! that keeps every pair apart for a while (van den Berg, Guy, Lin, Manocha: Reciprocal n-body collision
//! avoidance, ISRR 2009).
//!
//! Single precision and the order of operations of the authors' RVO2 library: without fused multiply-add the
//! positions are equal to the last bit (`testdata/rvo2_golden`). The motion is chaotic, so anything less exact
//! cannot be compared at all. One difference: RVO2 may cut an edge in two where its obstacle tree splits it,
//! here edges stay whole; a single convex obstacle is never cut.

mod agent;
mod grid;
mod velocity;
mod obstacles;

use glam::Vec2;

pub use agent::{Agent, Parameters};
use grid::Grid;
use obstacles::Corner;
use velocity::{HalfPlane, tangents};

/// Agents among fixed polygons.
#[derive(Debug, Clone)]
pub struct Orca {
    step_s: f32,
    /// In the order they were given.
    pub agents: Vec<Agent>,
    corners: Vec<Corner>,
    grid: Grid,
    next_mps: Vec<Vec2>,
    neighbors: Vec<usize>,
    edges: Vec<(f32, usize)>,
    lines: Vec<HalfPlane>,
}

impl Orca {
    /// Agents with a time step. Polygons list their corners counter-clockwise; clockwise ones are walls around
    /// the agents.
    pub fn new(step_s: f32, agents: Vec<Agent>, polygons: &[Vec<Vec2>]) -> Self {
        Self {
            step_s,
            next_mps: vec![Vec2::ZERO; agents.len()],
            agents,
            corners: obstacles::corners(polygons),
            grid: Grid::default(),
            neighbors: Vec::new(),
            edges: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// Moves everybody by one step: all choose first, then all move. Agents may have come and gone since the last.
    pub fn step(&mut self) {
        self.next_mps.resize(self.agents.len(), Vec2::ZERO);
        self.grid.rebuild(&self.agents);
        for i in 0..self.agents.len() {
            self.next_mps[i] = self.choose_velocity(i);
        }
        for (agent, &next) in self.agents.iter_mut().zip(&self.next_mps) {
            let change = next - agent.velocity_mps;
            let limit = agent.parameters.max_acceleration_mps2 * self.step_s;
            let length = change.length();
            agent.velocity_mps =
                if length > limit { agent.velocity_mps + change * (limit / length) } else { next };
            agent.position_m += agent.velocity_mps * self.step_s;
        }
    }

    fn choose_velocity(&mut self, i: usize) -> Vec2 {
        let agent = &self.agents[i];
        self.lines.clear();

        obstacles::visible_edges(&self.corners, agent, &mut self.edges);
        for &(_, edge) in &self.edges {
            let line = obstacles::half_plane(&self.corners, edge, agent, &self.lines);
            self.lines.extend(line);
        }
        let obstacle_lines = self.lines.len();

        self.grid.nearest(&self.agents, i, &mut self.neighbors);
        for &other in &self.neighbors {
            self.lines.push(half_plane(agent, &self.agents[other], self.step_s));
        }
        velocity::nearest_allowed(
            &self.lines,
            obstacle_lines,
            agent.parameters.max_speed_mps,
            agent.preferred_mps,
        )
    }
}

/// Velocities that take half the effort to stay clear of `other` for the horizon.
fn half_plane(agent: &Agent, other: &Agent, step_s: f32) -> HalfPlane {
    let position = other.position_m - agent.position_m;
    let velocity = agent.velocity_mps - other.velocity_mps;
    let distance_sq = position.length_squared();
    let radius = agent.parameters.radius_m + other.parameters.radius_m;
    let radius_sq = radius * radius;

    // The forbidden relative velocities are a cone with a round tip, the disc (position, radius) / time.
    // Discs that overlap must part within one step.
    let overlapping = distance_sq <= radius_sq;
    let inverse_time = if overlapping { 1.0 / step_s } else { 1.0 / agent.parameters.horizon_s };
    let from_tip = velocity - position * inverse_time;
    let from_tip_sq = from_tip.length_squared();
    let along = from_tip.dot(position);

    let (direction, to_border) = if overlapping || (along < 0.0 && along * along > radius_sq * from_tip_sq) {
        let length = from_tip_sq.sqrt();
        let outward = from_tip * (1.0 / length);
        (-outward.perp(), outward * (radius * inverse_time - length))
    } else {
        let (left, right) = tangents(position, radius, distance_sq);
        let leg = if position.perp_dot(from_tip) > 0.0 { left } else { -right };
        (leg, leg * velocity.dot(leg) - velocity)
    };
    HalfPlane { point: agent.velocity_mps + to_border * 0.5, direction }
}
