//! A real motion capture drives a simulated body, where `UMBRACAST_DATA` tells where it is.

#[path = "../../../tests/real_data/mod.rs"]
mod real_data;

use std::sync::Arc;

use umbracast::geometry::DVec2;
use umbracast_io::bvh;
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
    assert!((1.0..2.2).contains(&stride_m), "{stride_m}");
    let (mut mesh, mut slipped_m, mut frames, mut before) = (Vec::new(), 0.0, 0.0, Vec::new());
    for i in 0..600 {
        assert!(walker.mesh_at(i * 10_000_000, &mut mesh));
        let lowest = mesh.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
        assert!(lowest.abs() < 1e-8, "{lowest} at {i}");
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
    assert!(slip_mps < 0.4, "{slip_mps} m/s");
}
