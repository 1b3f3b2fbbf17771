//! Things that people carry, push and pull, beside bags at the shoulder and wheelchairs of one's own (`things`): rucksacks, bags in
//! both hands, umbrellas, telephones before the face, children on the arm, prams, suitcases, walking frames, and wheelchairs
//! that somebody pushes.
//!
//! Sizes are from memory unless a source stands beside them. What rolls follows the ground below the body ([`Bone::Ground`]), not
//! the swaying hips.

use rand::RngExt;
use rand_pcg::Pcg64;
use umbracast::geometry::DVec3;

use super::build::Build;
use super::kind::Kind;
use super::loft::{Along, Ring};
use super::shape::{Form, Part, case};
use super::skeleton::{Bone, Hold, Holds};
use super::things::{Things, backpack};

/// What a person of one of these kinds has; `side` is that of the hand that is used alone, 1 left.
pub(super) fn of(kind: Kind, build: &Build, side: f64, rng: &mut Pcg64) -> Things {
    match kind {
        Kind::Rucksack => Things { parts: vec![backpack(build)], ..Things::default() },
        Kind::Bags => bags(build, rng),
        Kind::Umbrella => umbrella(build, side),
        Kind::Screen => screen(build),
        Kind::Carrying => carrying(build, side, rng),
        Kind::Pram => pram(rng),
        Kind::Trolley => trolley(side, rng),
        Kind::Frame => frame(),
        _ => Things::default(),
    }
}

fn hold(bone: Bone, at_m: DVec3, elbow: DVec3) -> Hold {
    Hold { bone, at_m, grip: 0.6, elbow }
}

/// Left and right, mirrored.
fn both(hand: impl Fn(f64) -> Hold) -> Holds {
    [1.0, -1.0].map(|side| Some(hand(side)))
}

/// One hand, on this side.
fn one(side: f64, hand: Hold) -> Holds {
    if side > 0.0 { [Some(hand), None] } else { [None, Some(hand)] }
}

/// A round rod between two heights.
fn rod(bone: Bone, from_m: DVec3, to_m: DVec3, radius_m: f64) -> Part {
    let ring = |at: DVec3| Ring {
        at_m: at.z,
        center_m: [at.x, at.y],
        half_m: [radius_m; 2],
        power: 2.0,
        second: 0.0,
    };
    Part { bones: [bone; 2], form: Form::Loft(Along::Z, vec![ring(from_m), ring(to_m)], 8) }
}

/// A wheel on the ground, without spokes: beams pass through it.
fn wheel(x_m: f64, y_m: f64, radius_m: f64) -> Part {
    let half_m = 0.016;
    Part {
        bones: [Bone::Ground; 2],
        form: Form::Hoop(DVec3::new(x_m, y_m, radius_m), radius_m - half_m, half_m),
    }
}

fn on_ground(middle_m: [f64; 3], size_m: [f64; 3]) -> Part {
    case(Bone::Ground, DVec3::from_array(middle_m), DVec3::from_array(size_m))
}

/// Arms hang straight beside the hips; the load keeps them from swinging.
fn bags(b: &Build, rng: &mut Pcg64) -> Things {
    let hand_m = b.elbow_height_m() - b.forearm_m - 0.6 * b.hand_m + 0.01;
    let aside_m = b.hip_m[0] / 2.0 + 0.10;
    let bag = |side: f64, high_m: f64| {
        let top_m = hand_m - 0.04;
        let middle = DVec3::new(0.03, side * (aside_m + 0.02), top_m - high_m / 2.0);
        case(Bone::Thorax, middle, DVec3::new(0.32, 0.14, high_m))
    };
    // Never on the floor, be the person as short as may be.
    let mut high_m = || rng.random_range(0.25..0.40_f64).min(hand_m - 0.12);
    Things {
        parts: vec![bag(1.0, high_m()), bag(-1.0, high_m())],
        holds: both(|side| {
            hold(Bone::Thorax, DVec3::new(0.03, side * aside_m, hand_m), DVec3::new(-1.0, 0.5 * side, 0.0))
        }),
        ..Things::default()
    }
}

/// A dome of 1 m across, its top at 2 m or over a tall head, and the shaft down to the hand.
fn umbrella(b: &Build, side: f64) -> Things {
    let top_m = (b.height_m() + 0.14).max(2.0);
    let (x_m, y_m) = (0.12, 0.10 * side);
    // From within: the middle of the inner side, down to the rim, and up again outside.
    let share = [0.03, 0.35, 0.65, 0.88, 1.0];
    let dome = |share: f64, thick_m: f64| Ring {
        at_m: top_m - thick_m - 0.17 * share * share,
        center_m: [x_m, y_m],
        half_m: [0.5 * share; 2],
        power: 2.0,
        second: 0.0,
    };
    let within = share.iter().map(|&share| dome(share, 0.006));
    let rings = within.chain(share.iter().rev().map(|&share| dome(share, 0.0))).collect();
    let hand = DVec3::new(0.22, 0.16 * side, b.level_m(0.70));
    let canopy = Part { bones: [Bone::Thorax; 2], form: Form::Loft(Along::Z, rings, 16) };
    let below = hand - DVec3::Z * 0.08;
    Things {
        parts: vec![canopy, rod(Bone::Thorax, below, DVec3::new(x_m, y_m, top_m - 0.005), 0.008)],
        holds: one(side, hold(Bone::Thorax, hand, DVec3::new(-0.5, side, -0.7))),
        ..Things::default()
    }
}

/// Both hands hold it .35 m before the eyes, a little below them: eye to telephone is 37 +- 7 cm standing (notes of bodies).
fn screen(b: &Build) -> Things {
    let middle = DVec3::new(0.36, 0.0, b.level_m(0.80));
    Things {
        parts: vec![case(Bone::Thorax, middle, DVec3::new(0.012, 0.08, 0.16))],
        holds: both(|side| {
            let at_m = middle + DVec3::new(0.0, 0.04 * side, -0.05);
            Hold { grip: 0.8, ..hold(Bone::Thorax, at_m, DVec3::new(-0.3, 0.6 * side, -1.0)) }
        }),
        ..Things::default()
    }
}

/// A child of one to three years (.75 to .95 m long) sits on the forearm, its trunk at the adult's side.
fn carrying(b: &Build, side: f64, rng: &mut Pcg64) -> Things {
    let size = rng.random_range(0.75..0.95) / 0.85;
    let (x_m, y_m) = (0.10, side * (b.chest_m[0] / 2.0 + 0.06 * size));
    let seat_m = b.level_m(0.60);
    let stack = |keys: &[(f64, f64, f64)], x_m: f64, y_m: f64| Part {
        bones: [Bone::Thorax; 2],
        form: Form::Loft(
            Along::Z,
            keys.iter()
                .map(|&(up, half_x, half_y)| Ring {
                    at_m: seat_m + size * up,
                    center_m: [x_m, y_m],
                    half_m: [size * half_x, size * half_y],
                    power: 2.2,
                    second: 0.0,
                })
                .collect(),
            14,
        ),
    };
    let trunk = [
        (-0.04, 0.06, 0.07),
        (0.02, 0.095, 0.11),
        (0.15, 0.09, 0.11),
        (0.26, 0.08, 0.12),
        (0.31, 0.03, 0.04),
    ];
    let head = [
        (0.30, 0.04, 0.04),
        (0.36, 0.085, 0.07),
        (0.43, 0.095, 0.075),
        (0.49, 0.07, 0.06),
        (0.51, 0.02, 0.02),
    ];
    let leg = [(-0.24, 0.035, 0.03), (-0.22, 0.05, 0.035), (-0.02, 0.055, 0.05), (0.05, 0.05, 0.05)];
    let legs = [0.10, -0.06].map(|ahead_m| stack(&leg, x_m + ahead_m, y_m + side * 0.02));
    let mut parts = vec![stack(&trunk, x_m, y_m), stack(&head, x_m, y_m)];
    parts.extend(legs);
    let hand = DVec3::new(0.24, side * 0.10, seat_m + 0.02);
    Things {
        parts,
        holds: one(side, hold(Bone::Thorax, hand, DVec3::new(-0.5, side, -0.6))),
        ..Things::default()
    }
}

/// Where hands push: ahead of the hips, at this height.
const HANDLE_AHEAD_M: f64 = 0.36;

fn pushing(handle_m: f64, apart_m: f64) -> Holds {
    both(|side| {
        let at_m = DVec3::new(HANDLE_AHEAD_M, side * apart_m / 2.0, handle_m);
        hold(Bone::Ground, at_m, DVec3::new(-0.7, 0.6 * side, -0.3))
    })
}

/// .55 x .90 m, handles at 1.0 m, the hood up or down.
fn pram(rng: &mut Pcg64) -> Things {
    let first = HANDLE_AHEAD_M + 0.06;
    let mut parts = vec![
        on_ground([first + 0.45, 0.0, 0.62], [0.78, 0.42, 0.30]),
        on_ground([first + 0.45, 0.0, 0.28], [0.55, 0.36, 0.12]),
        on_ground([HANDLE_AHEAD_M, 0.0, 1.0], [0.03, 0.46, 0.03]),
    ];
    if rng.random() {
        parts.push(on_ground([first + 0.68, 0.0, 0.90], [0.34, 0.42, 0.30]));
    }
    for side in [1.0, -1.0] {
        parts.push(wheel(first + 0.17, side * 0.255, 0.14));
        parts.push(wheel(first + 0.76, side * 0.255, 0.10));
        let (from, to) =
            (DVec3::new(first + 0.2, side * 0.22, 0.5), DVec3::new(HANDLE_AHEAD_M, side * 0.22, 1.0));
        parts.push(rod(Bone::Ground, from, to, 0.012));
    }
    Things { parts, holds: pushing(1.0, 0.34), ..Things::default() }
}

/// A suitcase of .45 x .28 x .65 m on two wheels, tilted, its handle in a hand that stays behind.
fn trolley(side: f64, rng: &mut Pcg64) -> Things {
    let y_m = side * rng.random_range(0.24..0.32);
    let hand = DVec3::new(-0.16, y_m, 0.76);
    let (low, high) = (DVec3::new(-0.98, y_m, 0.06), DVec3::new(-0.50, y_m, 0.52));
    let ring = |at: DVec3, across: f64| Ring {
        at_m: at.z,
        center_m: [at.x, at.y],
        // Cut level, a tilted case is longer than it is deep.
        half_m: [across * 0.19, across * 0.225],
        power: 8.0,
        second: 0.0,
    };
    let rings = vec![
        ring(low, 0.9),
        ring(low.lerp(high, 0.08), 1.0),
        ring(low.lerp(high, 0.92), 1.0),
        ring(high, 0.9),
    ];
    let bar = |aside_m: f64| rod(Bone::Ground, high + DVec3::Y * aside_m, hand + DVec3::Y * aside_m, 0.009);
    Things {
        parts: vec![
            Part { bones: [Bone::Ground; 2], form: Form::Loft(Along::Z, rings, 24) },
            bar(0.07),
            bar(-0.07),
            wheel(low.x, y_m + 0.18, 0.04),
            wheel(low.x, y_m - 0.18, 0.04),
        ],
        holds: one(side, hold(Bone::Ground, hand, DVec3::new(-1.0, 0.4 * side, 0.0))),
        ..Things::default()
    }
}

/// A rollator, .60 x .65 m, handles at .92 m, with seat and basket.
fn frame() -> Things {
    let mut parts = vec![
        on_ground([HANDLE_AHEAD_M + 0.20, 0.0, 0.60], [0.22, 0.42, 0.03]),
        on_ground([HANDLE_AHEAD_M + 0.24, 0.0, 0.45], [0.24, 0.36, 0.18]),
    ];
    for side in [1.0, -1.0] {
        let y_m = side * 0.27;
        let point = |ahead_m: f64, up_m: f64| DVec3::new(HANDLE_AHEAD_M + ahead_m, y_m, up_m);
        parts.extend([
            rod(Bone::Ground, point(0.42, 0.16), point(0.08, 0.90), 0.014),
            rod(Bone::Ground, point(-0.10, 0.16), point(0.12, 0.62), 0.014),
            on_ground([HANDLE_AHEAD_M, y_m, 0.92], [0.16, 0.035, 0.035]),
            wheel(HANDLE_AHEAD_M - 0.12, y_m, 0.10),
            wheel(HANDLE_AHEAD_M + 0.43, y_m, 0.10),
        ]);
    }
    Things { parts, holds: pushing(0.94, 0.54), ..Things::default() }
}

/// Somebody seated in a wheelchair, whose mesh at the origin is this, is pushed: the chair's handles are where hands push.
pub(super) fn pushed(
    vertices_m: &[DVec3],
    triangles: &[[u32; 3]],
    parts: &[std::ops::Range<usize>],
) -> Things {
    // Handles of the chair behind its owner's axis, and their height (`things`).
    let (behind_m, handle_m) = (0.22, 0.915);
    let by = DVec3::X * (HANDLE_AHEAD_M + behind_m);
    let ready = |range: &std::ops::Range<usize>| {
        let own = |t: &&[u32; 3]| t.iter().all(|corner| range.contains(&(*corner as usize)));
        let from = range.start as u32;
        Part {
            bones: [Bone::Ground; 2],
            form: Form::Ready(
                vertices_m[range.clone()].iter().map(|v| *v + by).collect(),
                triangles.iter().filter(own).map(|t| t.map(|corner| corner - from)).collect(),
            ),
        }
    };
    Things { parts: parts.iter().map(ready).collect(), holds: pushing(handle_m, 0.40), ..Things::default() }
}
