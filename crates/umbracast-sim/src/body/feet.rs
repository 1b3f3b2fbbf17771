//! Feet: their prints, how they roll from heel to toes, and how they swing to the next print.

use std::f64::consts::{PI, TAU};

use umbracast::geometry::{DVec2, DVec3};

use super::build::{ANKLE_SHARE, BALL_SHARE, Build};
use super::gait;
use super::individual::Individual;
use super::skeleton::FootPose;

/// Where a foot stands flat, from contact to toe-off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    /// The back end of the sole.
    pub heel_m: DVec2,
    /// Where its toes point.
    pub yaw_rad: f64,
    /// Phase of the contact.
    pub contact: f64,
    /// Share of a stride that it stays.
    pub stance_share: f64,
}

/// Toes point outward by this angle.
const TOE_OUT_RAD: f64 = 0.1;
/// Heels come no nearer to the middle than this, else shanks would touch.
const LEGS_APART_M: f64 = 0.025;
/// Lowest point of a swinging sole above the floor, mid-swing.
const CLEARANCE_M: f64 = 0.015;

/// The print of a contact (even: right foot) under a pelvis that passes over the heel at `position_m`.
/// Walking, feet come closer together and the heel lies under the body axis; standing, the ankle does.
pub fn print(
    build: &Build,
    own: &Individual,
    contact: usize,
    position_m: DVec2,
    heading_rad: f64,
    speed_mps: f64,
) -> Footprint {
    let side = if contact.is_multiple_of(2) { -1.0 } else { 1.0 };
    let walking = smoothstep(speed_mps / 0.5);
    // Step widths of 8 to 13.5 cm (men) and 6 to 12 cm (women); standing, feet are under the hips.
    let apart_m = if build.male { 0.053 } else { 0.046 };
    let apart_m = (apart_m + own.step_width_m).max(LEGS_APART_M);
    let left_m = build.hip_offset_m() + walking * (apart_m - build.hip_offset_m());
    // Half of what steps differ by is on each side of the middle; a stride has two steps.
    let longer_m = side * own.step_asymmetry * 0.25 * gait::stride_m(speed_mps, build.stature_m, own);
    let forward_m = (walking - 1.0) * (ANKLE_SHARE * build.sole_m() + 0.02) + walking * longer_m;
    let toe_out_rad = TOE_OUT_RAD + own.toe_out_rad[usize::from(side < 0.0)];
    let offset = DVec2::from_angle(heading_rad).rotate(DVec2::new(forward_m, side * left_m));
    Footprint {
        heel_m: position_m + offset,
        yaw_rad: heading_rad + side * toe_out_rad,
        contact: contact as f64 / 2.0,
        stance_share: gait::stance_share(speed_mps / (0.53 * build.stature_m)),
    }
}

/// Both feet of a body that stands at rest at the origin, looking along x.
pub fn at_rest(build: &Build, own: &Individual) -> [FootPose; 2] {
    [1, 0].map(|contact| standing_on(&print(build, own, contact, DVec2::ZERO, 0.0, 0.0), 0.2, 0.0, build))
}

/// A foot on its print: it lands on the heel, lies flat, then rises about the ball with the toes on the floor.
pub fn standing_on(print: &Footprint, progress: f64, amount: f64, build: &Build) -> FootPose {
    let pitch_rad = amount * gait::stance_pitch_rad(progress);
    let sole = build.sole_m();
    let pivot_m = if pitch_rad > 0.0 { 0.0 } else { BALL_SHARE * sole };
    let ankle = turned(ANKLE_SHARE * sole - pivot_m, build.ankle_m(), pitch_rad);
    let ground = print.heel_m + DVec2::from_angle(print.yaw_rad) * (pivot_m + ankle[0]);
    FootPose {
        ankle_m: ground.extend(ankle[1]),
        yaw_rad: print.yaw_rad,
        pitch_rad,
        toe_pitch_rad: pitch_rad.max(0.0),
    }
}

/// A foot in the air between two prints, its lowest point always above the floor.
pub fn swinging(
    [from, to]: [&Footprint; 2],
    progress: f64,
    amount: f64,
    build: &Build,
    own: &Individual,
) -> FootPose {
    let (start, end) = (standing_on(from, 1.0, amount, build), standing_on(to, 0.0, amount, build));
    let u = progress;
    let way = swing_way(u, amount);
    let ground = start.ankle_m.truncate().lerp(end.ankle_m.truncate(), way);
    let turn = (to.yaw_rad - from.yaw_rad + PI).rem_euclid(TAU) - PI;
    let pitch_rad = amount * gait::swing_pitch_rad(u);
    // Toes leave the floor flat and straighten in the first part of the swing.
    let toe_pitch_rad = if pitch_rad > 0.0 { pitch_rad } else { pitch_rad * smoothstep(u / 0.4) };
    let rise = (PI * u).sin().powi(2) * own.lift * (CLEARANCE_M + 0.01 * amount);
    FootPose {
        ankle_m: DVec3::new(ground.x, ground.y, rise - lowest_m(build, pitch_rad, toe_pitch_rad)),
        yaw_rad: from.yaw_rad + way * turn,
        pitch_rad,
        toe_pitch_rad,
    }
}

/// Share of the way from print to print: the smoothest one (minimum jerk) that leaves with the speed which the
/// ankle has while the foot rolls over the ball, and still moves a little as the heel lands.
fn swing_way(u: f64, amount: f64) -> f64 {
    let (leave, land) = (0.5 * amount, 0.25 * amount);
    let (u2, u3) = (u * u, u * u * u);
    leave * u
        + (10.0 - 6.0 * leave - 4.0 * land) * u3
        + (8.0 * leave + 7.0 * land - 15.0) * u3 * u
        + (6.0 - 3.0 * leave - 3.0 * land) * u3 * u2
}

/// The lowest point of the sole, from the ankle.
pub fn lowest_m(build: &Build, pitch_rad: f64, toe_pitch_rad: f64) -> f64 {
    let (sole, ankle) = (build.sole_m(), build.ankle_m());
    let heel = turned(-ANKLE_SHARE * sole, -ankle, pitch_rad)[1];
    let ball = turned((BALL_SHARE - ANKLE_SHARE) * sole, -ankle, pitch_rad)[1];
    let toe = ball + turned((1.0 - BALL_SHARE) * sole, 0.0, toe_pitch_rad)[1];
    heel.min(ball).min(toe)
}

/// A point ahead and above, turned toes up.
fn turned(ahead_m: f64, up_m: f64, pitch_rad: f64) -> [f64; 2] {
    let (sin, cos) = pitch_rad.sin_cos();
    [ahead_m * cos - up_m * sin, ahead_m * sin + up_m * cos]
}

/// From 0 to 1 without a jerk.
pub fn smoothstep(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
