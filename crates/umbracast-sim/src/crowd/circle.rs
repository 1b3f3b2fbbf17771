//! The paper's scene: people start on a circle and walk to the opposite point, driven by ORCA.

use glam::Vec2;
use umbracast::geometry::DVec2;

use super::crossing::{ARRIVED_M, MOST_ATTEMPTS, MOST_STEPS, SAMPLE_STEPS, STEP_S, parameters, scatter};
use super::mixed;
use super::orca::{Agent, Orca, Parameters};
use super::preset::Preset;
use super::trajectory::{Crowd, STEP_NS, Trajectory};
use crate::random::stream;

/// Preferred speed of everybody.
pub(super) const PREFERRED_MPS: f32 = 1.0;
/// Between the body axes of a pair: people who walk hand in hand or talk.
pub(super) const PAIR_GAP_M: f64 = 0.5;
/// A scene of people who cross a circle. A scene in which not all arrive or somebody turns back at once is
/// dropped and drawn anew.
///
/// Where the circle is too small for so many people, they start nearer to each other than the preset says; if
/// no scene out of a hundred will do, the last one stands, with `arrived_ns` empty for those who did not arrive.
pub fn circle_crossing(preset: Preset, people: usize, radius_m: f64, seed: u64) -> Crowd {
    match preset {
        Preset::Orca03 | Preset::Orca06 => {}
        Preset::Mixed => return mixed::crowd(people, radius_m, seed),
        Preset::Natural => return mixed::natural(people, radius_m, seed),
        Preset::Pairs => return mixed::pairs(people.div_ceil(2), PAIR_GAP_M, radius_m, seed),
    }
    let (parameters, spacing_m) = setting(preset);
    let mut attempt = 0;
    loop {
        let mut rng = stream(seed, "circle starts", attempt);
        let mut starts = Vec::new();
        scatter(&mut starts, people, radius_m as f32, |_, _| spacing_m, &mut rng);
        let crowd = walk(parameters, &starts);
        attempt += 1;
        if acceptable(&crowd) || attempt == MOST_ATTEMPTS {
            return crowd;
        }
    }
}

/// How people of a preset avoid one another, and how far apart they start, metres.
pub(super) fn setting(preset: Preset) -> (Parameters, f32) {
    match preset {
        Preset::Orca06 => (parameters(4.0, 4.0, 0.6, 1.5), 2.0),
        Preset::Orca03 | Preset::Mixed | Preset::Natural | Preset::Pairs => {
            (parameters(10.0, 5.0, 0.3, 1.0), 0.8)
        }
    }
}

/// Everybody walks to minus the start until all have arrived.
fn walk(parameters: Parameters, starts: &[Vec2]) -> Crowd {
    let agents = starts.iter().map(|&start| Agent::new(parameters, start)).collect();
    let mut orca = Orca::new(STEP_S, agents, &[]);
    let mut positions: Vec<Vec<DVec2>> = starts.iter().map(|start| vec![start.as_dvec2()]).collect();
    let mut arrived = vec![None; starts.len()];
    let mut steps = 0;
    loop {
        for (i, agent) in orca.agents.iter_mut().enumerate() {
            let to_goal = -starts[i] - agent.position_m;
            let distance = to_goal.length();
            if distance < ARRIVED_M {
                arrived[i] = arrived[i].or(Some(steps as i64 * STEP_NS));
                agent.preferred_mps = Vec2::ZERO;
            } else {
                // The reference lets everybody stand for the first step; here they follow the goal at once.
                agent.preferred_mps = to_goal * (1.0 / distance) * PREFERRED_MPS;
            }
        }
        let done = arrived.iter().all(Option::is_some) || steps >= MOST_STEPS;
        // The last arrival, rounded up to a frame.
        if done && steps % SAMPLE_STEPS == 0 {
            break;
        }
        orca.step();
        steps += 1;
        for (way, agent) in positions.iter_mut().zip(&orca.agents) {
            way.push(agent.position_m.as_dvec2());
        }
    }
    Crowd { trajectories: Trajectory::from_steps(positions, arrived), duration_ns: steps as i64 * STEP_NS }
}

/// Everybody arrived, and nobody turned by 90 deg or more within three samples at 10 Hz before that.
fn acceptable(crowd: &Crowd) -> bool {
    crowd.trajectories.iter().all(|way| {
        let Some(arrived_ns) = way.arrived_ns else { return false };
        let walked = &way.positions_m[..=(arrived_ns / STEP_NS) as usize];
        let samples: Vec<DVec2> = walked.iter().step_by(SAMPLE_STEPS).copied().collect();
        samples.windows(3).all(|p| (p[1] - p[0]).dot(p[2] - p[1]) > 0.0)
    })
}
