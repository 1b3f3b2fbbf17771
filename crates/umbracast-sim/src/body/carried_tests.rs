//! What people carry, push and pull has its size, is where it should be, and goes along.

use std::ops::Range;

use umbracast::geometry::{Aabb, DVec2, DVec3};

use super::kind::Kind;
use super::*;
use crate::crowd::Trajectory;

const FOREARMS: [usize; 2] = [5, 6];
/// Parts of a body; what follows are things.
const BODY: usize = 13;

/// Walks 3 m along x, then along y.
fn walker(kind: Kind, seed: u64, meshes: Option<&Meshes>) -> Walker {
    let mut positions_m = vec![DVec2::ZERO];
    for i in 0..600 {
        let step = if i < 300 { DVec2::new(0.01, 0.0) } else { DVec2::new(0.0, 0.01) };
        positions_m.push(positions_m[i] + step);
    }
    let way = Trajectory {
        person: 0,
        start_ns: 0,
        step_ns: 10_000_000,
        positions_m,
        arrived_ns: None,
        height_m: None,
    };
    Walker::of_meshes(way, seed, kind, meshes).looking_ahead()
}

/// In the body's own frame at step 200, when it walks along x.
fn own(walker: &Walker, parts: Range<usize>) -> Aabb {
    let mut mesh = Vec::new();
    walker.mesh_at(2_000_000_000, &mut mesh);
    let parts = &walker.surface().parts[parts];
    let vertices = parts.iter().flat_map(|(range, _)| mesh[range.clone()].iter().copied());
    Aabb::around(vertices).moved_by(DVec2::new(-2.0, 0.0))
}

fn things(walker: &Walker) -> Aabb {
    own(walker, BODY..walker.surface().parts.len())
}

fn near(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() < tolerance
}

#[test]
fn things_have_their_sizes_and_places() {
    for seed in 0..20 {
        let of = |kind: Kind| {
            let walker = walker(kind, seed, None);
            (things(&walker), own(&walker, 0..BODY), walker.build.height_m())
        };
        let (sack, _, _) = of(Kind::Rucksack);
        assert!(sack.max_m.x < 0.0 && near(sack.size_m().y, 0.30, 0.06), "{sack:?}");
        let (bags, body, _) = of(Kind::Bags);
        assert!(bags.min_m.z > 0.05 && bags.max_m.z < 0.9 && bags.size_m().y > body.size_m().y, "{bags:?}");
        let (umbrella, _, height_m) = of(Kind::Umbrella);
        assert!(near(umbrella.max_m.z, (height_m + 0.14).max(2.0), 0.06), "{umbrella:?}");
        assert!(near(umbrella.size_m().x, 1.0, 0.05) && near(umbrella.size_m().y, 1.0, 0.05), "{umbrella:?}");
        let (pram, _, _) = of(Kind::Pram);
        assert!(near(pram.size_m().y, 0.55, 0.05) && near(pram.size_m().x, 0.95, 0.1), "{pram:?}");
        assert!(
            pram.min_m.x > 0.25 && pram.min_m.z.abs() < 1e-9 && near(pram.max_m.z, 1.03, 0.04),
            "{pram:?}"
        );
        let (case, _, _) = of(Kind::Trolley);
        assert!(case.max_m.x < 0.0 && near(case.min_m.x, -1.17, 0.05) && case.max_m.z < 0.8, "{case:?}");
        let (frame, _, _) = of(Kind::Frame);
        assert!(near(frame.size_m().y, 0.575, 0.03) && near(frame.size_m().x, 0.75, 0.1), "{frame:?}");
        let (child, _, height_m) = of(Kind::Carrying);
        assert!(child.max_m.z < height_m && child.min_m.z > 0.5 && child.size_m().z > 0.5, "{child:?}");
        let (chair, _, height_m) = of(Kind::Pushed);
        assert!((1.1..1.5).contains(&chair.max_m.z) && chair.max_m.z < height_m, "{chair:?}");
        // The chair is .66 m wide; elbows may be farther out.
        assert!(chair.min_m.x > 0.15 && chair.max_m.x > 1.1, "{chair:?}");
        assert!((0.62..0.90).contains(&chair.size_m().y), "{chair:?}");
    }
}

#[test]
fn hands_are_at_what_they_hold() {
    for seed in 0..10 {
        for (kind, hands) in [
            (Kind::Bags, 2),
            (Kind::Umbrella, 1),
            (Kind::Screen, 2),
            (Kind::Carrying, 1),
            (Kind::Pram, 2),
            (Kind::Trolley, 1),
            (Kind::Frame, 2),
            (Kind::Pushed, 2),
        ] {
            let walker = walker(kind, seed, None);
            let mut mesh = Vec::new();
            walker.mesh_at(2_000_000_000, &mut mesh);
            let vertices = |part: usize| {
                let (range, _) = &walker.surface().parts[part];
                mesh[range.clone()].iter().copied()
            };
            let things: Vec<DVec3> = (BODY..walker.surface().parts.len()).flat_map(vertices).collect();
            // Handles have few corners, so a hand may be a hand's length from the next one.
            let gap = |arm: usize| {
                vertices(arm)
                    .flat_map(|hand| things.iter().map(move |thing| thing.distance(hand)))
                    .fold(f64::INFINITY, f64::min)
            };
            let near = FOREARMS.iter().filter(|arm| gap(**arm) < 0.12).count();
            assert!(near >= hands, "{kind:?} {seed}: {:?}", FOREARMS.map(gap));
        }
    }
}

#[test]
fn nothing_is_farther_from_the_axis_than_told_and_third_party_bodies_carry_as_well() {
    let meshes = Meshes::family("b").unwrap();
    for kind in Kind::ALL {
        for (seed, meshes) in [(1, None), (2, Some(&meshes))] {
            let walker = walker(kind, seed, meshes);
            let mut mesh = Vec::new();
            for step in (0..600).step_by(7) {
                walker.mesh_at(step * 10_000_000, &mut mesh);
                let axis = walker.state_at(step * 10_000_000).unwrap().position_m;
                let far = mesh.iter().map(|v| v.truncate().distance(axis)).fold(0.0, f64::max);
                assert!(far < walker.reach_m(), "{kind:?}: {far} of {} m", walker.reach_m());
                assert!(mesh.iter().all(|v| v.z > -1e-9), "{kind:?} sinks");
            }
        }
    }
}

#[test]
fn what_rolls_does_not_sway_with_the_hips() {
    let walker = walker(Kind::Pram, 3, None);
    let mut mesh = Vec::new();
    let (range, _) = walker.surface().parts[BODY].clone();
    for step in 100..200 {
        walker.mesh_at(step * 10_000_000, &mut mesh);
        let pram = Aabb::around(mesh[range.clone()].iter().copied());
        assert!(pram.center_m().y.abs() < 1e-9, "{pram:?}");
        assert!(near(pram.center_m().x - 0.01 * step as f64, 0.87, 1e-9), "{pram:?}");
    }
}
