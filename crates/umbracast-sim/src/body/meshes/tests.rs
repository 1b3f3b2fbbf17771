use std::collections::BTreeMap;

use umbracast::geometry::{Aabb, DVec2};

use super::*;
use crate::body::Walker;
use crate::body::kind::Kind;
use crate::crowd::Trajectory;

const STEP_NS: i64 = 10_000_000;

fn way(velocity_mps: impl Fn(usize) -> DVec2) -> Trajectory {
    let mut positions_m = vec![DVec2::ZERO];
    for i in 0..500 {
        positions_m.push(positions_m[i] + velocity_mps(i) * 0.01);
    }
    Trajectory { person: 0, start_ns: 0, step_ns: STEP_NS, positions_m, arrived_ns: None, height_m: None }
}

fn ahead() -> Trajectory {
    way(|i| if i < 400 { DVec2::new(1.3, 0.0) } else { DVec2::ZERO })
}

fn families() -> [Meshes; 2] {
    ["a", "b"].map(|name| Meshes::family(name).unwrap())
}

/// Everybody of a family, each as they are.
fn everybody(people: &Meshes) -> Vec<Walker> {
    (0..people.len())
        .map(|i| {
            let alone = Meshes { name: String::new(), people: vec![people.people[i].clone()] };
            Walker::of_meshes(ahead(), i as u64, Kind::Plain, Some(&alone))
        })
        .collect()
}

#[test]
fn a_family_has_men_and_women_of_published_sizes() {
    for family in families() {
        assert_eq!(family.len(), 16);
        assert_eq!(family.people.iter().filter(|person| person.male).count(), 8);
        let mut heights: Vec<f64> = family.people.iter().map(fit::height_m).collect();
        heights.sort_by(f64::total_cmp);
        assert!(
            heights[0] > 1.50 && heights[0] < 1.60 && heights[15] > 1.85 && heights[15] < 2.0,
            "{heights:?}"
        );
        let heavy: Vec<f64> = family.people.iter().map(|person| person.bmi).collect();
        assert!(heavy.iter().any(|bmi| *bmi < 20.5) && heavy.iter().any(|bmi| *bmi > 31.0), "{heavy:?}");
        for person in &family.people {
            assert!((2000..6000).contains(&person.triangles.len()), "{}", person.triangles.len());
        }
    }
}

#[test]
fn surfaces_are_closed_and_face_outward() {
    for family in families() {
        for person in &family.people {
            let mut edges: BTreeMap<[u32; 2], i32> = BTreeMap::new();
            for [a, b, c] in &person.triangles {
                for [from, to] in [[a, b], [b, c], [c, a]] {
                    *edges.entry([*from.min(to), *from.max(to)]).or_default() +=
                        if from < to { 1 } else { -1 };
                }
            }
            assert!(edges.values().all(|sum| *sum == 0), "open");
            let at = |corner: u32| person.vertices[corner as usize].at_m;
            let cone = |t: &[u32; 3]| at(t[0]).dot(at(t[1]).cross(at(t[2]))) / 6.0;
            let volume: f64 = person.triangles.iter().map(cone).sum();
            assert!((0.035..0.25).contains(&volume), "{volume} m3");
        }
    }
}

#[test]
fn the_height_told_is_that_of_the_head_and_the_feet_stand_on_the_floor() {
    for family in families() {
        for walker in everybody(&family) {
            let mut mesh = Vec::new();
            walker.upright_mesh(DVec2::ZERO, 0.0, &mut mesh);
            let whole = Aabb::around(mesh.iter().copied());
            let height_m = walker.state_at(0).unwrap().height_m;
            assert!((whole.max_m.z - height_m).abs() < 0.012, "{} for {height_m}", whole.max_m.z);
            assert!(whole.min_m.z.abs() < 1e-9, "{}", whole.min_m.z);
            // Arms hang: nobody is wider than with elbows bent, and hands are at the thighs.
            assert!((0.38..0.85).contains(&whole.size_m().y), "{whole:?}");
            assert!((0.2..0.7).contains(&whole.size_m().x), "{whole:?}");
        }
    }
}

#[test]
fn who_walks_stays_on_the_floor_and_together_and_no_sole_slides() {
    for family in families() {
        for (number, walker) in everybody(&family).iter().enumerate() {
            let (mut mesh, mut before) = (Vec::new(), Vec::new());
            for step in 0..500 {
                assert!(walker.mesh_at(step * STEP_NS, &mut mesh));
                let axis = walker.state_at(step * STEP_NS).unwrap().position_m;
                let at = format!("{}{number}, step {step}", family.name);
                let lowest_m = mesh.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
                assert!((-1e-9..0.012).contains(&lowest_m), "{at}: {lowest_m} m above the floor");
                let reach_m = mesh.iter().map(|v| v.truncate().distance(axis)).fold(0.0, f64::max);
                assert!(reach_m < 0.95, "{at}: {reach_m} m from the axis");
                for (v, still) in mesh.iter().zip(&before) {
                    let down = |v: &DVec3| v.z < 1e-9;
                    assert!(!(down(v) && down(still)) || v.distance(*still) < 2e-3, "{at}: slides");
                }
                std::mem::swap(&mut mesh, &mut before);
            }
        }
    }
}

/// A truth whose axis were another one in other bodies would be scored as an error of the tracker.
#[test]
fn the_axis_runs_through_the_trunk() {
    for family in families() {
        for walker in everybody(&family) {
            let mut mesh = Vec::new();
            walker.upright_mesh(DVec2::ZERO, 0.0, &mut mesh);
            let height_m = walker.build.height_m();
            let chest =
                mesh.iter().copied().filter(|v| (0.70..0.76).contains(&(v.z / height_m)) && v.y.abs() < 0.13);
            let ahead_m = Aabb::around(chest).center_m().x;
            assert!(ahead_m.abs() < 0.015, "{ahead_m}");
        }
    }
}

#[test]
fn a_known_height_is_kept_and_another_seed_is_another_person() {
    let family = Meshes::family("a").unwrap();
    for seed in 0..20 {
        let (build, _) = family.draw(seed, Some(1.83));
        assert!((build.height_m() - 1.83).abs() < 1e-9, "{}", build.height_m());
    }
    let of = |seed: u64| family.draw(seed, None);
    assert_eq!(of(3), of(3));
    assert!((0..20).any(|seed| of(seed).0 != of(3).0));
}

#[test]
fn files_that_are_none_are_refused() {
    let refused = |bytes: &[u8]| Meshes::read("x", bytes).unwrap_err().to_string();
    assert!(refused(b"solid cube").starts_with("glTF: "));
    let whole = include_bytes!("../../../bodies/family-a.glb");
    assert!(!refused(&whole[..whole.len() / 2]).is_empty());
    assert!(Meshes::family("c").unwrap_err().to_string().contains("expected a or b"));
    let renamed: Vec<u8> = {
        let mut bytes = whole.to_vec();
        let at = bytes.windows(17).position(|w| w == b"\"name\":\"ToesLeft\"").unwrap();
        bytes[at + 8] = b'P';
        bytes
    };
    assert!(refused(&renamed).contains("found \"PoesLeft\""), "{}", refused(&renamed));
}
