//! A person who sits down where they stay: the hips sink to a seat, one foot after the other steps out in front of
//! it, and the hands come to lie on the thighs. Before the person goes on, all of it runs backwards.
//!
//! A seat of .45 m is a chair's (ISO 5970, size 6, has .46 m). The duration is from memory. The chair belongs to the
//! hall.

use umbracast::geometry::DVec3;

use super::build::Build;
use super::feet::smoothstep;
use super::gestures::hanging_m;
use super::skeleton::{Bone, FootPose, Hold, Holds};
use super::walk::Walk;

/// Top of the seat.
const SEAT_M: f64 = 0.45;
/// Who stands for less stays standing.
const REST_MIN_NS: i64 = 8_000_000_000;
/// Stands so long before and after,
const STANDS_NS: i64 = 1_000_000_000;
/// and takes so long to sit down, and to get up.
const SITS_DOWN_NS: i64 = 1_800_000_000;
/// Ankles before the hips, and how high a foot is lifted on its way there.
const ANKLES_AHEAD_M: f64 = 0.38;
const LIFT_M: f64 = 0.04;
/// When each foot steps, as shares of the time: left, right.
const STEPS: [[f64; 2]; 2] = [[0.1, 0.5], [0.5, 0.9]];

/// When somebody sits.
#[derive(Debug, Clone, PartialEq)]
pub struct Sitting {
    /// From where on he may sit down until when he has to have got up.
    rests_ns: Vec<[i64; 2]>,
}

impl Sitting {
    /// Wherever a walk rests for long.
    pub fn plan(walk: &Walk) -> Self {
        let rest = |[from_ns, until_ns]: [i64; 2]| {
            [from_ns.saturating_add(STANDS_NS), until_ns.saturating_sub(STANDS_NS)]
        };
        let long = |&[from_ns, until_ns]: &[i64; 2]| until_ns.saturating_sub(from_ns) >= REST_MIN_NS;
        Self { rests_ns: walk.rests_ns().filter(long).map(rest).collect() }
    }

    /// How far he has sat down: 0 stands, 1 sits.
    fn share(&self, time_ns: i64) -> f64 {
        let share = |[from_ns, until_ns]: &[i64; 2]| {
            let since_ns = time_ns.saturating_sub(*from_ns).min(until_ns.saturating_sub(time_ns));
            (since_ns as f64 / SITS_DOWN_NS as f64).clamp(0.0, 1.0)
        };
        self.rests_ns.iter().map(share).fold(0.0, f64::max)
    }

    /// How much lower the hips are.
    pub fn sunk_m(&self, time_ns: i64, build: &Build) -> f64 {
        smoothstep(self.share(time_ns)) * (build.hip_height_m() - SEAT_M - 0.7 * build.thigh_radius_m)
    }

    /// Feet that step out before the seat.
    pub fn feet(&self, time_ns: i64, heading_rad: f64, mut feet: [FootPose; 2]) -> [FootPose; 2] {
        let share = self.share(time_ns);
        let ahead = DVec3::new(heading_rad.cos(), heading_rad.sin(), 0.0);
        for (foot, [from, until]) in feet.iter_mut().zip(STEPS) {
            let step = ((share - from) / (until - from)).clamp(0.0, 1.0);
            let lift_m = LIFT_M * (step * std::f64::consts::PI).sin();
            foot.ankle_m += ahead * (ANKLES_AHEAD_M * step) + DVec3::Z * lift_m;
        }
        feet
    }

    /// Hands on their way to the thighs; `None` while he stands.
    pub fn holds(&self, time_ns: i64, build: &Build) -> Option<Holds> {
        let share = self.share(time_ns);
        let (offset_m, level_m) = build.shoulder_m();
        let hand = |side: f64| {
            let hangs_m = DVec3::new(0.0, side * offset_m, level_m) + hanging_m(build, side);
            let lies_m = DVec3::new(0.30, side * 0.13, build.hip_height_m() + build.thigh_radius_m + 0.04);
            Some(Hold {
                bone: Bone::Thorax,
                at_m: hangs_m.lerp(lies_m, share),
                grip: 0.5,
                elbow: DVec3::new(-1.0, 0.3 * side, -0.3),
            })
        };
        (share > 0.0).then(|| [hand(1.0), hand(-1.0)])
    }
}
