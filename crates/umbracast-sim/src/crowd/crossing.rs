//! What all crowds that cross a circle have in common: the simulator's steps, its settings and where people start.

use glam::Vec2;
use rand::{Rng, RngExt};

use super::orca::Parameters;

/// One step as ORCA takes it.
pub(super) const STEP_S: f32 = 0.01;
/// A person has arrived when nearer to the goal.
pub(super) const ARRIVED_M: f32 = 1.0;
/// A scene in which somebody walks longer is dropped.
pub(super) const MOST_STEPS: usize = 6000;
/// Steps from one 10 Hz sample to the next.
pub(super) const SAMPLE_STEPS: usize = 10;
/// After so many dropped scenes the last one stands, whatever its faults.
pub(super) const MOST_ATTEMPTS: u64 = 100;
/// Start points lie on the circle within this, on each axis.
const START_NOISE_M: f32 = 0.5;

/// What the generator's two parameter sets have in common: 10 neighbours, 5 s for obstacles, no limit of
/// acceleration.
pub(super) fn parameters(
    neighbor_distance_m: f32,
    horizon_s: f32,
    radius_m: f32,
    max_speed_mps: f32,
) -> Parameters {
    Parameters {
        neighbor_distance_m,
        max_neighbors: 10,
        horizon_s,
        obstacle_horizon_s: 5.0,
        radius_m,
        max_speed_mps,
        max_acceleration_mps2: f32::INFINITY,
    }
}

/// Adds points on a noisy circle until there are `count`; `spacing_m(i, j)` is the least distance of two.
pub(super) fn scatter(
    points: &mut Vec<Vec2>,
    count: usize,
    radius_m: f32,
    spacing_m: impl Fn(usize, usize) -> f32,
    rng: &mut impl Rng,
) {
    let (mut shrink, mut refused) = (1.0, 0);
    while points.len() < count {
        let angle = rng.random_range(0.0..std::f32::consts::TAU);
        let noise = Vec2::new(
            rng.random_range(-START_NOISE_M..START_NOISE_M),
            rng.random_range(-START_NOISE_M..START_NOISE_M),
        );
        let point = Vec2::from_angle(angle) * radius_m + noise;
        let this = points.len();
        if points.iter().enumerate().all(|(i, other)| other.distance(point) >= shrink * spacing_m(i, this)) {
            points.push(point);
            continue;
        }
        refused += 1;
        // No place left.
        if refused % 1000 == 0 {
            shrink *= 0.9;
        }
    }
}
