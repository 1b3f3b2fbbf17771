//! One agent: its avoidance, position and wished velocity.

use glam::Vec2;

/// How an agent sees and keeps clear of the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Agents farther away are not seen.
    pub neighbor_distance_m: f32,
    /// Of those, only the nearest so many count.
    pub max_neighbors: usize,
    /// For how long agents must stay clear of each other.
    pub horizon_s: f32,
    /// For how long of obstacles.
    pub obstacle_horizon_s: f32,
    /// Of the disc that stays free of others.
    pub radius_m: f32,
    /// No velocity is longer.
    pub max_speed_mps: f32,
    /// The velocity changes no faster; infinite in the published method.
    pub max_acceleration_mps2: f32,
}

/// A disc that wants to go somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agent {
    /// How it avoids.
    pub parameters: Parameters,
    /// Centre.
    pub position_m: Vec2,
    /// Of the last step.
    pub velocity_mps: Vec2,
    /// Where it would go alone; to be set before every step.
    pub preferred_mps: Vec2,
}

impl Agent {
    /// At rest.
    pub fn new(parameters: Parameters, position_m: Vec2) -> Self {
        Self { parameters, position_m, velocity_mps: Vec2::ZERO, preferred_mps: Vec2::ZERO }
    }
}
