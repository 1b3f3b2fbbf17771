//! The arms of a person who talks: each hand swings about the shoulder, near and at full stretch, while the person
//! stands.
//!
//! The hands make half to one movement a second, as in stressed speech. Their reach is the worst case, not a mean.

use std::f64::consts::{FRAC_PI_2, TAU};

use rand::RngExt;
use umbracast::geometry::DVec3;

use super::build::Build;
use super::skeleton::{Bone, Hold, Holds};
use crate::random::stream;

/// Movements a second.
const RATE_HZ: std::ops::Range<f64> = 0.5..1.0;
/// How far a hand is from its shoulder, as a share of the arm's length.
const STRETCH: (f64, f64) = (0.5, 1.0);
/// From straight ahead to the side.
const ASIDE_RAD: (f64, f64) = (0.0, FRAC_PI_2);
/// From hanging down to above the shoulder.
const RAISED_RAD: (f64, f64) = (-1.2, 0.5);
/// At this speed the hands hang.
const WALKING_MPS: f64 = 0.6;

/// How somebody's hands move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gestures {
    /// Left, right.
    hands: [[Swing; 3]; 2],
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Swing {
    rate_hz: f64,
    phase: f64,
}

impl Swing {
    /// From 0 to 1 and back.
    fn at(&self, time_s: f64) -> f64 {
        0.5 - 0.5 * (TAU * (self.rate_hz * time_s + self.phase)).cos()
    }
}

impl Gestures {
    /// Of a person with this seed.
    pub fn draw(seed: u64) -> Self {
        let rng = &mut stream(seed, "gestures", 0);
        let mut swing = || Swing { rate_hz: rng.random_range(RATE_HZ), phase: rng.random() };
        Self { hands: [[swing(), swing(), swing()], [swing(), swing(), swing()]] }
    }

    /// Where the hands are.
    pub fn holds(&self, build: &Build, time_ns: i64, speed_mps: f64) -> Holds {
        let (offset_m, level_m) = build.shoulder_m();
        let length_m = arm_m(build);
        let hanging = (speed_mps / WALKING_MPS).min(1.0);
        let between = |(least, most): (f64, f64), share: f64| least + (most - least) * share;
        let time_s = time_ns as f64 * 1e-9;
        let hand = |side: f64, [stretch, aside, raised]: &[Swing; 3]| {
            let (sin, cos) = between(ASIDE_RAD, aside.at(time_s)).sin_cos();
            let (rise, out) = between(RAISED_RAD, raised.at(time_s)).sin_cos();
            let towards = DVec3::new(out * cos, side * out * sin, rise);
            let from_shoulder_m = towards * between(STRETCH, stretch.at(time_s)) * length_m;
            let hangs_m = hanging_m(build, side);
            Some(Hold {
                bone: Bone::Thorax,
                at_m: DVec3::new(0.0, side * offset_m, level_m) + from_shoulder_m.lerp(hangs_m, hanging),
                grip: 0.5,
                elbow: DVec3::new(-1.0, 0.3 * side, -0.3),
            })
        };
        [hand(1.0, &self.hands[0]), hand(-1.0, &self.hands[1])]
    }
}

/// From the shoulder to the middle of the hand.
pub fn arm_m(build: &Build) -> f64 {
    build.shoulder_m().1 - build.elbow_height_m() + build.forearm_m + 0.5 * build.hand_m
}

/// Where the middle of a hand that hangs is from its shoulder, on a side: 1 left, -1 right.
pub fn hanging_m(build: &Build, side: f64) -> DVec3 {
    DVec3::new(0.1, side * 0.1, -0.95).normalize() * arm_m(build)
}
