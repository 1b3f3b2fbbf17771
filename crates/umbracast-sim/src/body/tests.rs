use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::OnceLock;

use umbracast::geometry::{Aabb, DVec2, DVec3};

use super::individual::Individual;
use super::*;
use crate::crowd::Trajectory;

const STEP_NS: i64 = 10_000_000;

/// Starts at the origin and moves by `velocity(t)`.
fn way(seconds: f64, velocity: impl Fn(f64) -> DVec2) -> Trajectory {
    let mut positions_m = vec![DVec2::ZERO];
    for i in 0..(seconds * 100.0) as usize {
        let next = positions_m[i] + velocity(i as f64 * 0.01) * 0.01;
        positions_m.push(next);
    }
    Trajectory { person: 0, start_ns: 0, step_ns: STEP_NS, positions_m, arrived_ns: None, height_m: None }
}

/// Walks that together have starts, stops, turns and every speed.
fn walks() -> Vec<(&'static str, Trajectory)> {
    let straight = |speed: f64| way(5.0, move |_| DVec2::new(speed, 0.0));
    vec![
        ("slow", straight(0.4)),
        ("at ease", straight(1.0)),
        ("fast", straight(1.6)),
        ("stops at once", way(6.0, |t| if t < 2.5 { DVec2::new(1.0, 0.0) } else { DVec2::ZERO })),
        ("starts at once", way(6.0, |t| if t > 2.0 { DVec2::new(0.0, 1.0) } else { DVec2::ZERO })),
        ("turns about", way(8.0, |t| DVec2::from_angle(0.8 * t) * 1.1)),
        ("stands", way(3.0, |_| DVec2::ZERO)),
    ]
}

fn meshes(walker: &Walker) -> Vec<Vec<DVec3>> {
    let samples = walker.trajectory.positions_m.len() as i64;
    (0..samples)
        .map(|i| {
            let mut vertices = Vec::new();
            assert!(walker.mesh_at(i * STEP_NS, &mut vertices));
            vertices
        })
        .collect()
}

/// Vertices of a part: the same in every body.
fn part(index: usize) -> Range<usize> {
    static PARTS: OnceLock<Vec<Range<usize>>> = OnceLock::new();
    let all = || {
        let walker = Walker::new(way(1.0, |_| DVec2::ZERO), 1);
        walker.surface().parts.iter().map(|(vertices, _)| vertices.clone()).collect()
    };
    PARTS.get_or_init(all)[index].clone()
}

const TRUNK: usize = 0;
const ARMS: Range<usize> = 3..7;
const FOREARMS: [usize; 2] = [5, 6];
const SHANKS: [usize; 2] = [9, 10];
const FEET: [usize; 2] = [11, 12];

#[test]
fn no_vertex_sinks_below_the_floor() {
    for (name, way) in walks() {
        let walker = Walker::new(way, 11);
        for (i, mesh) in meshes(&walker).iter().enumerate() {
            let lowest = mesh.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
            assert!(lowest > -1e-9, "{name}: {lowest} m at {} s", i as f64 * 0.01);
        }
    }
}

#[test]
fn a_foot_is_always_on_the_floor_and_what_touches_it_does_not_slide() {
    for (name, way) in walks() {
        let walker = Walker::new(way, 12);
        let all = meshes(&walker);
        for (i, pair) in all.windows(2).enumerate() {
            let mut feet_down = 0;
            for foot in FEET {
                let low = |v: &DVec3| v.z < 1e-8;
                feet_down += usize::from(part(foot).any(|v| low(&pair[0][v])));
                for v in part(foot).filter(|&v| low(&pair[0][v]) && low(&pair[1][v])) {
                    let slip = pair[0][v].distance(pair[1][v]);
                    assert!(slip < 3e-4, "{name}: {slip} m in 10 ms at {} s", i as f64 * 0.01);
                }
            }
            assert!(feet_down > 0, "{name}: in the air at {} s", i as f64 * 0.01);
        }
    }
}

#[test]
fn a_stopped_person_rests_on_both_feet_beside_each_other() {
    let walker = Walker::new(walks().remove(3).1, 13).looking_ahead();
    let mesh = meshes(&walker).pop().unwrap();
    let middle = |foot: usize| Aabb::around(part(foot).map(|v| mesh[v])).center_m();
    let apart = middle(FEET[0]) - middle(FEET[1]);
    assert!(apart.x.abs() < 0.07, "one foot {} m ahead", apart.x);
    assert!((0.1..0.25).contains(&apart.y), "{} m apart", apart.y);
}

#[test]
fn arms_swing_against_the_legs() {
    let walker = Walker::new(walks().remove(1).1, 14).looking_ahead();
    let mut sum = [0.0; 2];
    for (i, mesh) in meshes(&walker).iter().enumerate() {
        let axis = walker.state_at(i as i64 * STEP_NS).unwrap().position_m.x;
        let ahead = |index: usize| Aabb::around(part(index).map(|v| mesh[v])).center_m().x - axis;
        for side in 0..2 {
            sum[side] += ahead(FOREARMS[side]) * ahead(SHANKS[side]);
        }
    }
    assert!(sum[0] < 0.0 && sum[1] < 0.0, "{sum:?}");
}

#[test]
fn stride_follows_the_speed() {
    // Women of mean height: 1.42 m and 116 steps a minute at 1.42 m/s; BT's 1.49 m and 114.
    let mut way = way(10.0, |_| DVec2::new(1.42, 0.0));
    way.height_m = Some(1.655);
    let walker = Walker::new(way, 15);
    let strides = walker.walk.at(9_000_000_000).phase - walker.walk.at(1_000_000_000).phase;
    let stride_m = 8.0 * 1.42 / strides / Individual::draw(15, walker.build.male).stride;
    assert!((1.42..1.52).contains(&stride_m), "{stride_m}");
}

#[test]
fn heading_follows_the_way_is_held_standing_and_turns_no_faster_than_a_body() {
    let turning = way(6.0, |t| match t {
        t if t < 2.0 => DVec2::new(0.0, 1.0),
        t if t < 4.0 => DVec2::ZERO,
        _ => DVec2::new(-1.0, 0.0),
    });
    let walker = Walker::new(turning, 16).looking_ahead();
    let heading = |time_s: f64| walker.state_at((time_s * 1e9) as i64).unwrap().heading_rad;
    assert!((heading(1.0) - PI / 2.0).abs() < 1e-6);
    assert!((heading(3.0) - PI / 2.0).abs() < 1e-6);
    assert!((heading(5.5).abs() - PI).abs() < 1e-6);
    for i in 0..598 {
        let turn = heading(0.01 * f64::from(i + 1)) - heading(0.01 * f64::from(i));
        let turn = (turn + PI).rem_euclid(TAU) - PI;
        assert!(turn.abs() < 0.0351, "{turn} rad in 10 ms");
    }
}

#[test]
fn upright_the_body_has_its_height_and_breadths() {
    for seed in 0..30 {
        let walker = Walker::new(way(1.0, |_| DVec2::ZERO), seed);
        let (build, mut mesh) = (walker.build, Vec::new());
        walker.upright_mesh(DVec2::ZERO, 0.0, &mut mesh);
        let whole = Aabb::around(mesh.iter().copied());
        assert!((whole.max_m.z - build.height_m()).abs() < 0.012, "{} {}", whole.max_m.z, build.height_m());
        assert!(whole.min_m.z.abs() < 1e-9);

        let near = |z: f64| move |v: &DVec3| (v.z - z).abs() < 0.03;
        let trunk_at = |share: f64| {
            let level = part(TRUNK).map(|v| mesh[v]).filter(near(build.level_m(share)));
            Aabb::around(level).size_m()
        };
        assert!((trunk_at(0.727).y - build.chest_m[0]).abs() < 0.03);
        assert!((trunk_at(0.727).x - build.chest_m[1]).abs() < 0.02);
        assert!((trunk_at(0.52).y - build.hip_m[0]).abs() < 0.02);

        let (_, shoulder) = build.shoulder_m();
        let arms = ARMS.flat_map(part).map(|v| mesh[v]).filter(|v| v.z > shoulder - 0.1);
        let bideltoid = Aabb::around(arms).size_m().y;
        assert!((bideltoid - build.bideltoid_m).abs() < 0.035, "{bideltoid} {}", build.bideltoid_m);
    }
}

#[test]
fn a_walking_body_keeps_below_its_standing_height_and_near_it() {
    let walker = Walker::new(walks().remove(1).1, 17);
    for mesh in meshes(&walker) {
        let top = mesh.iter().map(|v| v.z).fold(0.0, f64::max);
        let short = walker.build.height_m() - top;
        assert!((-0.005..0.07).contains(&short), "{short} m below standing");
    }
}

#[test]
fn a_moved_mesh_is_the_walking_one_elsewhere() {
    let walker = Walker::new(walks().remove(1).1, 18).looking_ahead();
    let (mut here, mut there) = (Vec::new(), Vec::new());
    walker.mesh_at(1_000_000_000, &mut here);
    walker.mesh_moved(1_000_000_000, DVec2::new(3.0, -2.0), PI / 2.0, &mut there);
    let axis = walker.state_at(1_000_000_000).unwrap().position_m;
    for (a, b) in here.iter().zip(&there) {
        let turned = (a.truncate() - axis).perp() + DVec2::new(3.0, -2.0);
        assert!((turned.extend(a.z) - *b).length() < 1e-9);
    }
}

#[test]
fn a_mesh_has_two_to_six_thousand_triangles_and_all_its_vertices() {
    let walker = Walker::new(way(1.0, |_| DVec2::ZERO), 1);
    let mut mesh = Vec::new();
    walker.mesh_at(0, &mut mesh);
    let triangles = &walker.surface().triangles;
    assert!((2000..6000).contains(&triangles.len()), "{}", triangles.len());
    let used = triangles.iter().flatten().max().unwrap();
    assert_eq!(*used as usize + 1, mesh.len());
}

#[test]
fn the_same_seed_gives_the_same_body_and_who_is_not_there_has_none() {
    let walker = |seed: u64| Walker::new(walks().remove(1).1, seed);
    let mesh = |seed: u64, time_ns: i64| {
        let mut vertices = Vec::new();
        let there = walker(seed).mesh_at(time_ns, &mut vertices);
        (there, vertices)
    };
    assert_eq!(mesh(3, 2_000_000_000), mesh(3, 2_000_000_000));
    assert_ne!(mesh(3, 2_000_000_000), mesh(4, 2_000_000_000));
    assert_eq!(mesh(3, -1), (false, Vec::new()));
    assert_eq!(walker(3).state_at(5_000_000_001), None);
}

#[test]
fn in_a_crowd_that_starts_stops_and_swerves_nobody_slides_sinks_floats_or_crouches() {
    let crowd = crate::crowd::circle_crossing(crate::crowd::Preset::Mixed, 10, 12.5, 100_002);
    for way in crowd.trajectories {
        let seed = u64::from(way.person);
        let walker = Walker::new(way, seed);
        let (mut mesh, mut before) = (Vec::new(), Vec::new());
        for i in 0..walker.trajectory.positions_m.len() {
            walker.mesh_at(i as i64 * STEP_NS, &mut mesh);
            let at = format!("person {seed} at {} s", i as f64 * 0.01);
            let down = |v: &DVec3| v.z < 1e-8;
            assert!(mesh.iter().all(|v| v.z > -1e-9), "{at}");
            assert!(FEET.into_iter().flat_map(part).any(|v| down(&mesh[v])), "{at}");
            for v in FEET.into_iter().flat_map(part).filter(|_| !before.is_empty()) {
                assert!(!(down(&mesh[v]) && down(&before[v])) || mesh[v].distance(before[v]) < 3e-4, "{at}");
            }
            let hips = walker.walk.at(i as i64 * STEP_NS).hip_height_m;
            assert!(hips > walker.build.hip_height_m() - 0.10, "{at}: hips at {hips} m");
            std::mem::swap(&mut mesh, &mut before);
        }
    }
}
