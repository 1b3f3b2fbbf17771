//! What holds for bodies of every kind.

use std::f64::consts::PI;
use std::ops::Range;

use umbracast::geometry::{Aabb, DVec2, DVec3};

use super::kind::Kind;
use super::*;
use crate::crowd::Trajectory;

const STEP_NS: i64 = 10_000_000;
const FOREARMS: [usize; 2] = [5, 6];
const FEET: [usize; 2] = [11, 12];

/// Walks 3 m along x, stands for a second and walks on along y.
fn walker(kind: Kind, seed: u64) -> Walker {
    let velocity = |i: usize| match i {
        0..300 => DVec2::new(1.0, 0.0),
        300..400 => DVec2::ZERO,
        _ => DVec2::new(0.0, 1.0),
    };
    Walker::of_kind(way(600, velocity), seed, kind).looking_ahead()
}

/// With this velocity in each of so many steps.
fn way(steps: usize, velocity_mps: impl Fn(usize) -> DVec2) -> Trajectory {
    let mut positions_m = vec![DVec2::ZERO];
    for i in 0..steps {
        positions_m.push(positions_m[i] + velocity_mps(i) * 0.01);
    }
    Trajectory { person: 0, start_ns: 0, step_ns: STEP_NS, positions_m, arrived_ns: None, height_m: None }
}

fn mesh(walker: &Walker, step: i64) -> Vec<DVec3> {
    let mut vertices = Vec::new();
    assert!(walker.mesh_at(step * STEP_NS, &mut vertices));
    vertices
}

fn bounds(walker: &Walker, mesh: &[DVec3], parts: Range<usize>) -> Aabb {
    let parts = &walker.surface().parts[parts];
    Aabb::around(parts.iter().flat_map(|(range, _)| mesh[range.clone()].iter().copied()))
}

/// Of everybody, in the body's own frame at step 150, when it walks along x.
fn own_bounds(walker: &Walker, parts: Range<usize>) -> Aabb {
    bounds(walker, &mesh(walker, 150), parts).moved_by(DVec2::new(-1.5, 0.0))
}

#[test]
fn every_part_is_closed_faces_outward_and_has_its_vertices() {
    for kind in Kind::ALL {
        let walker = walker(kind, 3);
        for step in [0, 150, 350, 520] {
            let mesh = mesh(&walker, step);
            for (part, (vertices, triangles)) in walker.surface().parts.iter().enumerate() {
                let faces = &walker.surface().triangles[triangles.clone()];
                let mut edges: Vec<[u32; 2]> =
                    faces.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
                edges.sort_unstable();
                let closed = edges.iter().all(|[a, b]| edges.binary_search(&[*b, *a]).is_ok());
                assert!(closed && edges.is_sorted_by(|a, b| a < b), "{kind:?}, part {part}: open or twofold");
                assert!(faces.iter().flatten().all(|v| vertices.contains(&(*v as usize))));
                let volume: f64 = faces
                    .iter()
                    .map(|f| {
                        let [a, b, c] = f.map(|i| mesh[i as usize]);
                        a.dot(b.cross(c)) / 6.0
                    })
                    .sum();
                assert!(volume > 1e-5, "{kind:?}, part {part}: {volume} m3");
            }
        }
    }
}

/// What touches the floor touches it only, and no sole that does has moved since `before`, the mesh 10 ms ago.
fn assert_stands(walker: &Walker, mesh: &[DVec3], before: &[DVec3], at: &str) {
    let down = |v: &DVec3| v.z < 1e-8;
    assert!(mesh.iter().all(|v| v.z > -1e-9), "{at}: sinks");
    assert!(mesh.iter().any(down), "{at}: floats");
    let feet = FEET.into_iter().flat_map(|foot| walker.surface().parts[foot].0.clone());
    for v in feet.filter(|_| !before.is_empty()) {
        let still = &before[v];
        assert!(!(down(&mesh[v]) && down(still)) || mesh[v].distance(*still) < 3e-4, "{at}: slides");
    }
}

#[test]
fn nobody_sinks_floats_or_slides() {
    for kind in Kind::ALL {
        for seed in 0..4 {
            let walker = walker(kind, seed);
            let mut before = Vec::new();
            for step in 0..600 {
                let mesh = mesh(&walker, step);
                let at = format!("{kind:?} {seed} at {} s", step as f64 * 0.01);
                assert_stands(&walker, &mesh, &before, &at);
                before = mesh;
            }
        }
    }
}

#[test]
fn the_height_told_is_that_of_the_head() {
    for kind in Kind::ALL {
        for seed in 0..10 {
            let walker = walker(kind, seed);
            let height = walker.state_at(0).unwrap().height_m;
            let mut upright = Vec::new();
            walker.upright_mesh(DVec2::ZERO, 0.0, &mut upright);
            // Of an umbrella not the top.
            let body =
                walker.surface().parts[..13].iter().flat_map(|(range, _)| upright[range.clone()].to_vec());
            let top = Aabb::around(body).max_m.z;
            assert!((top - height).abs() < 0.012, "{kind:?} {seed}: {top} for {height}");
        }
    }
}

#[test]
fn a_bag_hangs_at_the_hip_or_on_the_back() {
    let (mut on_back, mut at_hip) = (0, 0);
    for seed in 0..30 {
        let walker = walker(Kind::Bag, seed);
        let bag = own_bounds(&walker, 13..14);
        let [x, y, z] = bag.size_m().to_array();
        if z > 0.4 {
            on_back += 1;
            assert!(bag.max_m.x < 0.0 && (0.17..0.25).contains(&x) && (0.28..0.36).contains(&y), "{bag:?}");
        } else {
            at_hip += 1;
            assert!(bag.center_m().y.abs() > 0.18 && (0.28..0.34).contains(&x), "{bag:?}");
        }
    }
    assert!(on_back > 5 && at_hip > 5);
}

#[test]
fn a_telephone_brings_one_hand_to_the_ear_and_keeps_it_there() {
    for seed in 0..10 {
        let walker = walker(Kind::Phone, seed);
        let mut lowest_m = f64::INFINITY;
        for step in [100, 120, 140, 160, 180] {
            let mesh = mesh(&walker, step);
            let tops = FOREARMS.map(|arm| bounds(&walker, &mesh, arm..arm + 1).max_m.z);
            let head = bounds(&walker, &mesh, 2..3);
            let raised =
                tops.iter().filter(|top| (head.center_m().z - 0.08..head.max_m.z).contains(*top)).count();
            assert_eq!(raised, 1, "{tops:?} {head:?}");
            let low = bounds(&walker, &mesh, 3..7).min_m.z;
            assert!(low < walker.build.level_m(0.56), "the other hand hangs");
            lowest_m = lowest_m.min(low);
        }
        assert!(lowest_m < walker.build.level_m(0.5), "and comes down as it swings");
    }
}

#[test]
fn hands_in_pockets_do_not_swing() {
    for seed in 0..10 {
        let walker = walker(Kind::Pockets, seed);
        let ahead = |step: i64, arm: usize| {
            bounds(&walker, &mesh(&walker, step), arm..arm + 1).center_m().x - 0.01 * step as f64
        };
        for arm in FOREARMS {
            let all: Vec<f64> = (100..220).map(|step| ahead(step, arm)).collect();
            let swing =
                all.iter().fold(f64::MIN, |a, &b| a.max(b)) - all.iter().fold(f64::MAX, |a, &b| a.min(b));
            // The pelvis turns and sways.
            assert!(swing < 0.08, "{swing}");
        }
        let elbows = own_bounds(&walker, 3..7).size_m().y;
        assert!(elbows > walker.build.bideltoid_m - 0.03, "{elbows}");
    }
}

#[test]
fn who_gestures_reaches_out_while_standing_and_lets_the_hands_hang_while_walking() {
    for seed in 0..10 {
        let walker = walker(Kind::Gesturing, seed);
        let span = |steps: Range<i64>| {
            let wide =
                |step: i64| bounds(&walker, &mesh(&walker, step), 3..7).size_m().truncate().max_element();
            steps.map(wide).fold(0.0, f64::max)
        };
        let (walking_m, standing_m) = (span(100..250), span(330..390));
        assert!(
            standing_m > 0.75 && walking_m < 0.75 && standing_m > walking_m + 0.1,
            "{standing_m} {walking_m}"
        );
    }
}

#[test]
fn hands_swing_with_the_walk_and_hang_still_of_who_gestures_or_has_them_in_pockets() {
    let swings = |kind: Kind| -> Vec<f64> {
        let of = |seed| walker(kind, seed).hand_swing_at(2_000_000_000).unwrap();
        (0..20).flat_map(of).collect()
    };
    let mean = |all: Vec<f64>| all.iter().sum::<f64>() / all.len() as f64;
    let plain = swings(Kind::Plain);
    assert!(plain.iter().all(|swing| (0.0..0.3).contains(swing)), "{plain:.2?}");
    assert!((0.07..0.16).contains(&mean(plain)));
    for kind in [Kind::Gesturing, Kind::Pockets, Kind::Wheelchair] {
        let still = swings(kind);
        assert!(still.iter().all(|swing| swing.abs() < 0.03), "{kind:?} {still:.2?}");
    }
    let [left, right]: [Vec<f64>; 2] = [0, 1].map(|side| {
        (0..20).map(|seed| walker(Kind::Phone, seed).hand_swing_at(2_000_000_000).unwrap()[side]).collect()
    });
    assert!(
        left.iter().zip(&right).all(|(l, r)| l.abs().min(r.abs()) < 0.03 && l.max(*r) > 0.03),
        "{left:.2?} {right:.2?}"
    );
}

#[test]
fn a_child_is_small_and_takes_short_steps() {
    for seed in 0..30 {
        let (child, adult) = (walker(Kind::Child, seed), walker(Kind::Plain, seed));
        let height = child.state_at(0).unwrap().height_m;
        assert!((0.80..1.75).contains(&height), "{height}");
        let strides =
            |walker: &Walker| walker.walk.at(2_800_000_000).phase - walker.walk.at(200_000_000).phase;
        assert!(height > 1.5 || strides(&child) > 1.04 * strides(&adult));
    }
}

#[test]
fn a_wheelchair_has_the_sizes_of_the_standards() {
    let mut eyes_m = 0.0;
    for seed in 0..20 {
        let walker = walker(Kind::Wheelchair, seed);
        let parts = walker.surface().parts.len();
        let chair = own_bounds(&walker, 13..parts);
        assert!((chair.size_m().y - 0.66).abs() < 0.05, "{chair:?}");
        assert!((chair.size_m().x - 1.065).abs() < 0.08, "{chair:?}");
        assert!((chair.max_m.z - 0.915).abs() < 0.02 && chair.min_m.z.abs() < 1e-9, "{chair:?}");
        let whole = own_bounds(&walker, 0..parts);
        assert!(whole.max_m.x < chair.max_m.x + 0.20, "toes: {whole:?}");
        eyes_m += walker.state_at(0).unwrap().height_m - 0.07 * walker.build.stature_m;
        let knees = own_bounds(&walker, 7..9);
        assert!((0.5..0.78).contains(&knees.max_m.z), "lap at {knees:?}");
    }
    assert!((1.09..1.295).contains(&(eyes_m / 20.0)), "{eyes_m}");
}

#[test]
fn a_turned_chair_is_the_same_chair() {
    let walker = walker(Kind::Wheelchair, 5);
    let (mut here, mut there) = (Vec::new(), Vec::new());
    walker.mesh_at(1_000_000_000, &mut here);
    walker.mesh_moved(1_000_000_000, DVec2::new(3.0, -2.0), PI / 2.0, &mut there);
    for (a, b) in here.iter().zip(&there) {
        let turned = (a.truncate() - DVec2::X).perp() + DVec2::new(3.0, -2.0);
        assert!((turned.extend(a.z) - *b).length() < 1e-9);
    }
}

/// Walks for 2 s, rests for 12 s, walks on.
#[test]
fn who_stays_sits_down_and_gets_up_again_and_no_foot_slides() {
    let way = way(1600, |step| if (200..1400).contains(&step) { DVec2::ZERO } else { DVec2::X });
    for seed in 0..5 {
        let walker = Walker::of_kind(way.clone(), seed, Kind::Sitting);
        let standing_m = walker.build.height_m();
        let (mut lowest_m, mut before) = (standing_m, Vec::new());
        for step in 0..1600 {
            let mesh = mesh(&walker, step);
            let state = walker.state_at(step * STEP_NS).unwrap();
            lowest_m = lowest_m.min(state.height_m);
            let top_m = bounds(&walker, &mesh, 2..3).max_m.z;
            // Who stops at once from 1 m/s dips first.
            let told = !(300..1400).contains(&step) || (top_m - state.height_m).abs() < 0.02;
            assert!(told, "{seed}, {step}: {top_m} for {}", state.height_m);
            assert_stands(&walker, &mesh, &before, &format!("{seed}, {step}"));
            before = mesh;
        }
        assert!((0.3..0.6).contains(&(standing_m - lowest_m)), "{lowest_m} of {standing_m}");
        let sits = mesh(&walker, 800);
        let thighs = bounds(&walker, &sits, 7..9);
        assert!(thighs.size_m().x > 0.4 && thighs.min_m.z > 0.35 && thighs.max_m.z < 0.75, "{thighs:?}");
        let tall = |step: i64| walker.state_at(step * STEP_NS).unwrap().height_m;
        assert!(tall(100) == standing_m && tall(1500) == standing_m);
    }
}
