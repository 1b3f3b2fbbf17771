//! Rules that ORCA obeys, beyond the golden files: walls, rooms, limited acceleration.

use glam::Vec2;
use umbracast_sim::crowd::orca::{Agent, Orca, Parameters};

const PARAMETERS: Parameters = Parameters {
    neighbor_distance_m: 10.0,
    max_neighbors: 10,
    horizon_s: 5.0,
    obstacle_horizon_s: 2.0,
    radius_m: 0.3,
    max_speed_mps: 1.5,
    max_acceleration_mps2: f32::INFINITY,
};

#[test]
fn nobody_leaves_a_room_or_crosses_a_wall() {
    // Clockwise: people are inside. A wall stands in the middle.
    let room = [(-5.0, -5.0), (-5.0, 5.0), (5.0, 5.0), (5.0, -5.0)].map(Vec2::from).to_vec();
    let wall = [(0.0, -5.0), (0.0, 3.0)].map(Vec2::from).to_vec();
    let agents = [(-3.0, -3.0), (-2.0, 0.0), (3.0, -2.0), (2.0, 1.0)];
    let agents = agents.map(|start| Agent::new(PARAMETERS, Vec2::from(start))).to_vec();
    let mut orca = Orca::new(0.01, agents, &[room, wall]);
    for step in 0..3000 {
        for (i, agent) in orca.agents.iter_mut().enumerate() {
            // Against the wall first, then against the corners.
            let goal = if step < 1500 { Vec2::ZERO } else { Vec2::from_angle(i as f32) * 20.0 };
            agent.preferred_mps = (goal - agent.position_m).normalize_or_zero();
        }
        orca.step();
        for (i, agent) in orca.agents.iter().enumerate() {
            let p = agent.position_m;
            assert!(p.abs().max_element() < 4.7 + 1e-3, "agent {i} in step {step} at {p}");
            assert!(p.y > 3.0 || p.x.abs() > 0.3 - 1e-3, "agent {i} in step {step} at {p}");
        }
    }
}

#[test]
fn velocity_changes_no_faster_than_allowed() {
    let parameters = Parameters { max_acceleration_mps2: 2.0, ..PARAMETERS };
    let mut orca = Orca::new(0.01, vec![Agent::new(parameters, Vec2::ZERO)], &[]);
    for step in 0..200 {
        let before = orca.agents[0].velocity_mps;
        orca.agents[0].preferred_mps = if step < 100 { Vec2::X } else { Vec2::NEG_Y };
        orca.step();
        let change = orca.agents[0].velocity_mps.distance(before);
        assert!(change < 0.02 + 1e-5, "step {step}: {change} m/s");
    }
    assert!(orca.agents[0].velocity_mps.distance(Vec2::NEG_Y) < 1e-5, "and gets there in the end");
}
