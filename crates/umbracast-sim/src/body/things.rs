//! What people carry or use, and where it puts their hands: bags, a telephone, pockets, a wheelchair.
//!
//! Sizes: bag .3 x .12 x .3 m, backpack .3 x .18 x .45 m (from memory); elbows with hands in the pockets bent by
//! about 40 degrees (from memory); front pocket at (.10, .12) m and half the stature (derived). Wheelchair: figures
//! of the ADA Standards, .66 m wide, 1.065 m long and .15 m of toes, seat at .485, armrests at .76, handles at .915.

use rand::RngExt;
use umbracast::geometry::{DVec2, DVec3};

use super::build::Build;
use super::carried;
use super::kind::Kind;
use super::shape::{Form, Part, case};
use super::skeleton::{Bone, FootPose, Hold, Holds};
use crate::random::stream;

/// What goes with a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Things {
    /// Surfaces beside those of the body.
    pub parts: Vec<Part>,
    /// What the hands are at.
    pub holds: Holds,
    /// Height of the hip joints of who sits.
    pub seat_m: Option<f64>,
}

/// What a person of a kind has; sides and models are drawn from the seed.
pub fn of(kind: Kind, build: &Build, seed: u64) -> Things {
    let rng = &mut stream(seed, "things", 0);
    let (left, other): (bool, bool) = (rng.random(), rng.random());
    let side = if left { 1.0 } else { -1.0 };
    let one_hand = |hold: Hold| if left { [Some(hold), None] } else { [None, Some(hold)] };
    match kind {
        Kind::Plain | Kind::Child | Kind::CmuWalk | Kind::Gesturing | Kind::Sitting => Things::default(),
        Kind::Bag if other => Things { parts: vec![backpack(build)], ..Things::default() },
        Kind::Bag => {
            let (bag, hold) = shoulder_bag(build, side);
            Things { parts: vec![bag], holds: one_hand(hold), ..Things::default() }
        }
        Kind::Phone => Things { holds: one_hand(at_ear(build, side)), ..Things::default() },
        Kind::Pockets => {
            Things { holds: [1.0, -1.0].map(|side| Some(in_pocket(build, side))), ..Things::default() }
        }
        Kind::Wheelchair => wheelchair(build),
        _ => carried::of(kind, build, side, rng),
    }
}

pub(super) fn backpack(b: &Build) -> Part {
    // 2 cm into the back, which is not flat.
    let middle = DVec3::new(-(b.chest_m[1] / 2.0 + 0.07), 0.0, b.level_m(0.70));
    case(Bone::Thorax, middle, DVec3::new(0.18, 0.30, 0.45))
}

/// It hangs at the hip, under the forearm.
fn shoulder_bag(b: &Build, side: f64) -> (Part, Hold) {
    let hip = b.hip_m[0] / 2.0;
    let bag = case(
        Bone::Pelvis,
        DVec3::new(-0.02, side * (hip + 0.05), b.level_m(0.50)),
        DVec3::new(0.30, 0.12, 0.30),
    );
    let hold = Hold {
        bone: Bone::Pelvis,
        at_m: DVec3::new(0.10, side * (hip + 0.13), b.level_m(0.52)),
        grip: 0.5,
        elbow: DVec3::new(-0.6, side, 0.0),
    };
    (bag, hold)
}

fn at_ear(b: &Build, side: f64) -> Hold {
    Hold {
        bone: Bone::Head,
        at_m: DVec3::new(0.02, side * (b.head_m[0] / 2.0 + 0.025), b.level_m(0.924)),
        grip: 0.9,
        elbow: DVec3::new(0.6, 0.5 * side, -0.7),
    }
}

fn in_pocket(b: &Build, side: f64) -> Hold {
    Hold {
        bone: Bone::Pelvis,
        at_m: DVec3::new(0.10, side * 0.82 * b.hip_m[0] / 2.0, b.level_m(0.47)),
        grip: 0.5,
        elbow: DVec3::new(-1.0, 0.8 * side, 0.0),
    }
}

/// Top of the seat.
const SEAT_M: f64 = 0.485;
/// Rear wheels of 24 inches, outside the frame.
const WHEEL_M: f64 = 0.305;
const WHEEL_ASIDE_M: f64 = 0.30;
/// Sole of a shoe on its rest.
const FOOTREST_M: f64 = 0.12;
/// Ankles ahead of the hips.
const ANKLES_AHEAD_M: f64 = 0.52;

/// A chair pushed by hand. Wheels are rims without spokes, through which beams pass; the frame's tubes are left
/// out. The chair hangs at the pelvis, whose rest is as high as a standing body's.
fn wheelchair(b: &Build) -> Things {
    let hips_m = SEAT_M + 0.7 * b.thigh_radius_m;
    let rest = |x: f64, y: f64, z: f64| DVec3::new(x, y, z - hips_m + b.hip_height_m());
    let boxed = |middle: DVec3, x: f64, y: f64, z: f64| case(Bone::Pelvis, middle, DVec3::new(x, y, z));
    let wheel = |middle: DVec3, radius_m: f64, half_m: f64| Part {
        bones: [Bone::Pelvis; 2],
        form: Form::Hoop(middle, radius_m - half_m, half_m),
    };
    let mut parts = vec![
        boxed(rest(0.09, 0.0, SEAT_M - 0.03), 0.44, 0.44, 0.05),
        boxed(rest(-0.17, 0.0, 0.70), 0.04, 0.42, 0.43),
    ];
    for side in [1.0, -1.0] {
        parts.extend([
            wheel(rest(-0.08, side * WHEEL_ASIDE_M, WHEEL_M), WHEEL_M, 0.02),
            wheel(rest(0.38, side * 0.22, 0.08), 0.08, 0.015),
            // Armrest, the guard between it and the seat, push handle, footrest.
            boxed(rest(0.10, side * 0.255, 0.745), 0.34, 0.05, 0.03),
            boxed(rest(0.06, side * 0.245, 0.60), 0.30, 0.015, 0.27),
            boxed(rest(-0.22, side * 0.20, 0.90), 0.10, 0.03, 0.03),
            boxed(rest(0.55, side * 0.10, FOOTREST_M - 0.015), 0.16, 0.15, 0.02),
        ]);
    }
    let on_rim = |side: f64| Hold {
        bone: Bone::Pelvis,
        at_m: rest(0.02, side * (WHEEL_ASIDE_M + 0.02), 2.0 * WHEEL_M),
        grip: 0.5,
        elbow: DVec3::new(-1.0, 0.5 * side, 0.0),
    };
    Things { parts, holds: [1.0, -1.0].map(|side| Some(on_rim(side))), seat_m: Some(hips_m) }
}

/// Feet on their rests, left and right.
pub fn feet_on_rests(b: &Build, position_m: DVec2, heading_rad: f64) -> [FootPose; 2] {
    [1.0, -1.0].map(|side| {
        let offset = DVec2::from_angle(heading_rad).rotate(DVec2::new(ANKLES_AHEAD_M, 0.09 * side));
        FootPose {
            ankle_m: (position_m + offset).extend(FOOTREST_M + b.ankle_m()),
            yaw_rad: heading_rad + 0.1 * side,
            pitch_rad: 0.0,
            toe_pitch_rad: 0.0,
        }
    })
}
