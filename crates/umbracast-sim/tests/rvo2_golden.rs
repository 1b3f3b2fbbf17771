//! Positions equal to RVO2's, bit for bit (`testdata/rvo2_golden/README.md`).

use std::path::Path;

use glam::Vec2;
use umbracast_sim::crowd::orca::{Agent, Orca, Parameters};

/// `orca-03`.
const DEFAULT: Parameters = Parameters {
    neighbor_distance_m: 10.0,
    max_neighbors: 10,
    horizon_s: 5.0,
    obstacle_horizon_s: 5.0,
    radius_m: 0.3,
    max_speed_mps: 1.0,
    max_acceleration_mps2: f32::INFINITY,
};

/// `orca-06`.
const TRAJNET: Parameters =
    Parameters { neighbor_distance_m: 4.0, horizon_s: 4.0, radius_m: 0.6, max_speed_mps: 1.5, ..DEFAULT };

/// Step, agent and position, in the file's order.
fn rows(file: &str) -> Vec<(usize, usize, Vec2)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/rvo2_golden").join(file);
    let text = std::fs::read_to_string(&path).unwrap();
    text.lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            let position = Vec2::new(cells[2].parse().unwrap(), cells[3].parse().unwrap());
            (cells[0].parse().unwrap(), cells[1].parse().unwrap(), position)
        })
        .collect()
}

/// Walks everybody to minus the start and compares at each step of the file.
fn assert_same_bits(file: &str, parameters: Parameters, polygons: &[Vec<Vec2>]) {
    let rows = rows(file);
    let starts: Vec<Vec2> = rows.iter().take_while(|row| row.0 == 0).map(|row| row.2).collect();
    let agents = starts.iter().map(|&start| Agent::new(parameters, start)).collect();
    let mut orca = Orca::new(0.01, agents, polygons);
    let mut steps = 0;
    for (step, agent, expected) in rows {
        while steps < step {
            for (agent, &start) in orca.agents.iter_mut().zip(&starts) {
                let to_goal = -start - agent.position_m;
                let distance = to_goal.length();
                let far = distance >= 1.0;
                agent.preferred_mps = if far { to_goal * (1.0 / distance) } else { Vec2::ZERO };
            }
            orca.step();
            steps += 1;
        }
        let found = orca.agents[agent].position_m;
        let bits = |p: Vec2| (p.x.to_bits(), p.y.to_bits());
        assert_eq!(bits(found), bits(expected), "{file}, step {step}, agent {agent}: {found} for {expected}");
    }
    assert!(steps > 0, "{file} holds no steps");
}

#[test]
fn ten_agents() {
    assert_same_bits("circle10_default.csv", DEFAULT, &[]);
}

#[test]
fn ten_wide_agents() {
    assert_same_bits("circle10_trajnet.csv", TRAJNET, &[]);
}

#[test]
fn a_hundred_agents() {
    assert_same_bits("circle100_default.csv", DEFAULT, &[]);
}

#[test]
fn a_thousand_agents() {
    assert_same_bits("circle1000_default.csv", DEFAULT, &[]);
}

#[test]
fn twenty_agents_around_a_pillar() {
    let pillar = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(Vec2::from).to_vec();
    assert_same_bits("circle20_pillar.csv", DEFAULT, &[pillar]);
}
