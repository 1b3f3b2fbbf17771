//! What tells one person's walk from another's: drawn once from the person's own seed and kept.
//!
//! The published gait (`gait`) is that of a mean person. Each figure here says how far healthy people are from it, one
//! standard deviation, with its source.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::random::stream;

/// One person's own way to walk. Factors are 1 and everything else is 0 in a mean person. Of two sides the left is first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Individual {
    /// Factor on the stride's length at a given speed; the cadence changes against it.
    pub stride: f64,
    /// By this share the left step is longer and the right one shorter.
    pub step_asymmetry: f64,
    /// Factors on the swing of the arms.
    pub arm_swing: [f64; 2],
    /// Added to the bend of the elbows.
    pub elbow_rad: [f64; 2],
    /// How far arms are spread more than they must be to hang clear of the hips.
    pub arm_spread_rad: [f64; 2],
    /// Added to the forward lean of the trunk, standing too.
    pub lean_rad: f64,
    /// Factor on how the trunk nods with each step.
    pub nod: f64,
    /// Factor on the turn of the pelvis.
    pub pelvis_turn: f64,
    /// Factor on the roll of the pelvis.
    pub pelvis_list: f64,
    /// Factor on the sway of the pelvis, to the side and ahead.
    pub sway: f64,
    /// Factor on the turn of the thorax.
    pub thorax_turn: f64,
    /// Added to the distance of each heel from the middle while walking.
    pub step_width_m: f64,
    /// Added to the angle by which toes point outward.
    pub toe_out_rad: [f64; 2],
    /// Factor on how high a foot is lifted.
    pub lift: f64,
}

/// Step length over cadence, for their height, is .60 +- .07 cm a step/min in people of 70 to 81 years ("The walk ratio:
/// investigation of invariance across walking conditions and gender", Gait & Posture, March 2018); at a given speed the
/// length goes with its square root.
const STRIDE: f64 = 0.06;
/// Left and right steps of healthy people differ by a few percent (from memory).
const STEP_ASYMMETRY: f64 = 0.025;
/// (Left - right) / larger, mean and spread, of 334 people walking at ease (Killeen et al. 2018, "Arm swing asymmetry in
/// overground walking": 21.9 +- 39.5 %): two in three swing the left arm farther, some barely swing one.
const ARM_ASYMMETRY: (f64, f64) = (0.219, 0.395);
/// Of the swing of both arms together, as a share, and the most that one arm swings (from memory): an arc of 50 degrees at
/// 1.34 m/s.
const ARM_SWING: f64 = 0.25;
const ARM_SWING_MOST: f64 = 1.8;
/// Between people, and between the arms of one (from memory).
const ELBOW_RAD: f64 = 0.12;
const ELBOW_APART_RAD: f64 = 0.06;
/// From memory.
const ARM_SPREAD_RAD: f64 = 0.05;
/// Women's trunks are 5 degrees more upright than men's (Chung et al. 2010, "Kinematic aspects of trunk motion and gender
/// effect in normal adults"): half of it to either side. The spread within a sex is from memory.
const LEAN_BY_SEX_RAD: f64 = 0.044;
const LEAN_RAD: f64 = 0.05;
/// Ranges of motion of pelvis and trunk vary by a quarter to a third between people (from memory).
const TURN: f64 = 0.30;
const LIST: f64 = 0.25;
const SWAY: f64 = 0.25;
/// Half the spread of step width: men 8 to 13.5, women 6 to 12 cm (GAITRite norms), taken for one deviation each way.
const STEP_WIDTH_M: f64 = 0.013;
/// Of the foot progression angle: 4.4 degrees at 16 years (Losel et al. 1996, "A simplified technique for determining foot
/// progression angle in children 4 to 16 years of age"); between the feet of one person from memory.
const TOE_OUT_RAD: f64 = 0.077;
const TOE_OUT_APART_RAD: f64 = 0.035;
/// Clearance of the toes varies by about a third between people (from memory).
const LIFT: f64 = 0.3;

impl Individual {
    /// Nobody in particular: the published gait.
    pub const MEAN: Self = Self {
        stride: 1.0,
        step_asymmetry: 0.0,
        arm_swing: [1.0; 2],
        elbow_rad: [0.0; 2],
        arm_spread_rad: [0.0; 2],
        lean_rad: 0.0,
        nod: 1.0,
        pelvis_turn: 1.0,
        pelvis_list: 1.0,
        sway: 1.0,
        thorax_turn: 1.0,
        step_width_m: 0.0,
        toe_out_rad: [0.0; 2],
        lift: 1.0,
    };

    /// The person with this seed.
    pub fn draw(seed: u64, male: bool) -> Self {
        let rng = &mut stream(seed, "individual", 0);
        let stride = factor(rng, STRIDE);
        let step_asymmetry = STEP_ASYMMETRY * normal(rng);
        let both = factor(rng, ARM_SWING);
        let asymmetry = (ARM_ASYMMETRY.0 + ARM_ASYMMETRY.1 * normal(rng)).clamp(-0.95, 0.95);
        // The mean of both arms is the person's.
        let larger = (2.0 * both / (2.0 - asymmetry.abs())).min(ARM_SWING_MOST);
        let smaller = larger * (1.0 - asymmetry.abs());
        let elbows_rad = ELBOW_RAD * normal(rng);
        let toes_rad = TOE_OUT_RAD * normal(rng);
        let lean_rad = if male { LEAN_BY_SEX_RAD } else { -LEAN_BY_SEX_RAD };
        Self {
            stride,
            step_asymmetry,
            arm_swing: if asymmetry > 0.0 { [larger, smaller] } else { [smaller, larger] },
            elbow_rad: [0, 1].map(|_| elbows_rad + ELBOW_APART_RAD * normal(rng)),
            arm_spread_rad: [0, 1].map(|_| (ARM_SPREAD_RAD * normal(rng)).abs()),
            lean_rad: lean_rad + LEAN_RAD * normal(rng),
            nod: factor(rng, LIST),
            pelvis_turn: factor(rng, TURN),
            pelvis_list: factor(rng, LIST),
            sway: factor(rng, SWAY),
            thorax_turn: factor(rng, TURN),
            step_width_m: STEP_WIDTH_M * normal(rng),
            toe_out_rad: [0, 1].map(|_| toes_rad + TOE_OUT_APART_RAD * normal(rng)),
            lift: factor(rng, LIFT),
        }
    }
}

/// Its logarithm is normal.
fn factor(rng: &mut Pcg64, spread: f64) -> f64 {
    (spread * normal(rng)).exp()
}

/// A standard normal number; beyond two and a half a walk is no longer a healthy one.
pub(super) fn normal(rng: &mut Pcg64) -> f64 {
    loop {
        let x: f64 = StandardNormal.sample(rng);
        if x.abs() <= 2.5 {
            return x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_differ_as_published() {
        let all: Vec<Individual> = (0..4000).map(|seed| Individual::draw(seed, seed % 2 == 0)).collect();
        let told = |name: &str, of: &dyn Fn(&Individual) -> f64, mean: f64, spread: f64, room: f64| {
            let values: Vec<f64> = all.iter().map(of).collect();
            let found = values.iter().sum::<f64>() / values.len() as f64;
            let squares: f64 = values.iter().map(|v| (v - found).powi(2)).sum();
            let sigma = (squares / values.len() as f64).sqrt();
            assert!(
                (found - mean).abs() < room && (sigma - spread).abs() < room,
                "{name}: {found} +- {sigma}"
            );
        };
        let asymmetry = |one: &Individual| {
            let [left, right] = one.arm_swing;
            (left - right) / left.max(right)
        };
        told("arms", &asymmetry, 0.219, 0.395, 0.04);
        told("stride", &|one| one.stride, 1.0, 0.06, 0.005);
        told("toes", &|one| one.toe_out_rad[0], 0.0, 0.085, 0.006);
        let left = all.iter().filter(|one| one.arm_swing[0] > one.arm_swing[1]).count();
        assert!((2400..3100).contains(&left), "{left} of 4000 swing the left arm farther");
        let still = all.iter().filter(|one| one.arm_swing[0].min(one.arm_swing[1]) < 0.3).count();
        assert!((100..1200).contains(&still), "{still} of 4000 barely swing one arm");
        assert!(Individual::draw(7, true) == Individual::draw(7, true));
    }
}
