//! A real motion capture drives a simulated body, where `UMBRACAST_DATA` tells where it is.

#[path = "../../../tests/real_data/mod.rs"]
mod real_data;

use std::sync::Arc;

use umbracast::geometry::DVec2;
use umbracast_io::{bvh, motion};
use umbracast_sim::body::{Gait, Walker};
use umbracast_sim::crowd::Trajectory;

use real_data::real_data;

#[test]
fn a_captured_walk_carries_a_body_over_the_floor() {
    let Some(file) = real_data("cmu_walk/scaled_131_01.bvh") else { return };
    let motion = bvh::read(&file).unwrap();
    assert_eq!((motion.joints.len(), motion.positions.len()), (31, 995));
    let heights = || motion.positions.iter().map(|frame| frame[0][1]);
    assert!((heights().fold(f64::MAX, f64::min) - 0.50).abs() < 0.01, "the hips sink to half a metre");
    let gait = Gait::new(motion.frame_s, &motion.joints, &motion.positions).unwrap();

    assert_walks(gait, 0.4, "131_01");
}

#[test]
fn every_clip_of_joints_turns_carries_a_body_over_the_floor() {
    // Letters are people (see the README beside the clips); speeds are those of whole clips.
    for (clip, speeds_mps) in [
        ("a01", 1.0..1.4),
        ("a14", 1.0..1.4),
        ("b03", 1.4..1.9),
        ("c01", 0.8..1.4),
        ("d02", 0.0..0.7),
        ("f06", 1.2..1.6),
        // Turns about on the way.
        ("g01", 0.0..1.3),
    ] {
        let Some(file) = real_data(&format!("gaits/{clip}.txt")) else { return };
        let motion = motion::read(&file).unwrap();
        let hips = || motion.positions.iter().map(|frame| frame[0]);
        let (first, last) = (hips().next().unwrap(), hips().next_back().unwrap());
        let way_m = (last[0] - first[0]).hypot(last[2] - first[2]);
        let speed_mps = way_m / motion.frame_s / (motion.positions.len() - 1) as f64;
        assert!(speeds_mps.contains(&speed_mps), "{clip}: {speed_mps} m/s");
        assert!(hips().all(|at| (0.7..1.15).contains(&at[1])), "{clip}: hips of somebody who walks");
        let gait = Gait::new(motion.frame_s, &motion.joints, &motion.positions).unwrap();
        assert_walks(gait, 0.5, clip);
    }
    let Some(file) = real_data("gaits/e01.txt") else { return };
    let sidesteps = motion::read(&file).unwrap();
    let refused = Gait::new(sidesteps.frame_s, &sidesteps.joints, &sidesteps.positions).unwrap_err();
    assert!(refused.to_string().contains("walks ahead"), "{refused}");
}

/// A body that walks so stays on the floor, takes strides of a usual length and slides little.
fn assert_walks(gait: Gait, most_mps: f64, clip: &str) {
    let positions_m = (0..600).map(|i| DVec2::new(0.012 * f64::from(i), 0.0)).collect();
    let way = Trajectory {
        person: 0,
        start_ns: 0,
        step_ns: 10_000_000,
        positions_m,
        arrived_ns: None,
        height_m: None,
    };
    let walker = Walker::new(way, 7).with_gait(Arc::new(gait.clone()));
    let stride_m = gait.stride_m(&walker.build);
    assert!((0.9..2.2).contains(&stride_m), "{clip}: {stride_m}");
    let (mut mesh, mut slipped_m, mut frames, mut before) = (Vec::new(), 0.0, 0.0, Vec::new());
    for i in 0..600 {
        assert!(walker.mesh_at(i * 10_000_000, &mut mesh));
        let lowest = mesh.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
        assert!(lowest.abs() < 1e-8, "{clip}: {lowest} at {i}");
        // How fast the vertices move that stay on the floor: a body that skates has 1.2 m/s.
        let down = |mesh: &[umbracast::geometry::DVec3], v: usize| mesh[v].z < 0.01;
        let feet = || walker.surface().parts[11..13].iter().flat_map(|(range, _)| range.clone());
        if !before.is_empty() {
            let stays = feet().filter(|&v| down(&mesh, v) && down(&before, v));
            let slips: Vec<f64> = stays.map(|v| mesh[v].distance(before[v])).collect();
            slipped_m += slips.iter().sum::<f64>() / slips.len().max(1) as f64;
            frames += 1.0;
        }
        before.clone_from(&mesh);
    }
    let slip_mps = slipped_m / frames / 0.01;
    assert!(slip_mps < most_mps, "{clip}: {slip_mps} m/s");
}
