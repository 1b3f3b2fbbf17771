//! A person's measures, drawn from published statistics.
//!
//! Source of all figures unless noted: our statistics of the raw files of ANSUR II (4082 men, 1986 women). Shares
//! of the height marked BT are those of Boulic, Magnenat-Thalmann and Thalmann (1990). A measure of a person is
//! X = X25 (H / mean H)^p (BMI / 25)^q exp(N(0, r)), X25 being that of a person of mean height with a BMI of 25.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::random::stream;

/// Everything that tells one body from another, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Build {
    /// True for a man's proportions.
    pub male: bool,
    /// Barefoot.
    pub stature_m: f64,
    /// What the shoes add to the height.
    pub shoe_m: f64,
    /// Body mass over height squared.
    pub bmi: f64,
    /// Between the outermost points of the shoulder blades' acromia.
    pub biacromial_m: f64,
    /// Over the arms at the shoulders.
    pub bideltoid_m: f64,
    /// Breadth and depth of the chest without the arms.
    pub chest_m: [f64; 2],
    /// Breadth and depth at the navel.
    pub waist_m: [f64; 2],
    /// Breadth of the hips and depth of the buttocks.
    pub hip_m: [f64; 2],
    /// Radii of the limbs where they are thickest, and of the neck.
    pub thigh_radius_m: f64,
    /// See `thigh_radius_m`.
    pub calf_radius_m: f64,
    /// See `thigh_radius_m`.
    pub arm_radius_m: f64,
    /// See `thigh_radius_m`.
    pub forearm_radius_m: f64,
    /// See `thigh_radius_m`.
    pub neck_radius_m: f64,
    /// Breadth and length of the head.
    pub head_m: [f64; 2],
    /// From the elbow to the wrist.
    pub forearm_m: f64,
    /// Wrist to fingertip.
    pub hand_m: f64,
    /// Length and breadth of the bare foot.
    pub foot_m: [f64; 2],
}

/// X25 of men and women, then the exponents p and q and the spread r.
struct Measure(f64, f64, f64, f64, f64);

const BIACROMIAL: Measure = Measure(0.411, 0.365, 0.65, 0.1, 0.04);
const BIDELTOID: Measure = Measure(0.493, 0.448, 0.51, 0.36, 0.03);
const CHEST_BREADTH: Measure = Measure(0.282, 0.268, 0.55, 0.3, 0.045);
const CHEST_DEPTH: Measure = Measure(0.239, 0.244, 0.55, 0.63, 0.055);
const WAIST_BREADTH: Measure = Measure(0.307, 0.296, 0.67, 0.63, 0.055);
const WAIST_DEPTH: Measure = Measure(0.218, 0.209, 0.5, 0.86, 0.07);
const HIP_BREADTH: Measure = Measure(0.334, 0.352, 0.68, 0.38, 0.04);
const BUTTOCK_DEPTH: Measure = Measure(0.230, 0.230, 0.55, 0.65, 0.045);
const THIGH_GIRTH: Measure = Measure(0.591, 0.610, 0.61, 0.57, 0.036);
const CALF_GIRTH: Measure = Measure(0.377, 0.371, 0.55, 0.42, 0.04);
const ARM_GIRTH: Measure = Measure(0.339, 0.302, 0.5, 0.6, 0.05);
const FOREARM_GIRTH: Measure = Measure(0.299, 0.263, 0.55, 0.37, 0.04);
const NECK_GIRTH: Measure = Measure(0.384, 0.328, 0.35, 0.33, 0.037);

const STATURE_MEN_M: (f64, f64) = (1.756, 0.069);
const STATURE_WOMEN_M: (f64, f64) = (1.629, 0.064);
const BMI_MEN: (f64, f64) = (27.7, 4.0);
const BMI_WOMEN: (f64, f64) = (25.5, 3.5);
/// Flat indoor shoes.
const SHOE_M: f64 = 0.025;
/// Trousers and a shirt stand off the skin (shoulder breadth +10 mm indoors).
const CLOTH_M: f64 = 0.005;

impl Build {
    /// Draws a body; `height_m`, with shoes, where it is known.
    pub fn draw(seed: u64, height_m: Option<f64>) -> Self {
        let rng = &mut stream(seed, "build", 0);
        let even: f64 = rng.random();
        let male = match height_m {
            None => even < 0.5,
            Some(height) => even < male_share(height - SHOE_M),
        };
        let (stature, bmi) = if male { (STATURE_MEN_M, BMI_MEN) } else { (STATURE_WOMEN_M, BMI_WOMEN) };
        let drawn_m = stature.0 + stature.1 * within_three_sigma(rng);
        let stature_m = height_m.map_or(drawn_m, |height| height - SHOE_M);
        let bmi = (bmi.0 + bmi.1 * within_three_sigma(rng)).max(17.0);
        let mut draw = |Measure(men, women, p, q, r): Measure| {
            let x25 = if male { men } else { women };
            x25 * (stature_m / stature.0).powf(p) * (bmi / 25.0).powf(q) * (r * within_three_sigma(rng)).exp()
        };
        let (sex, h) = (|men, women| if male { men } else { women }, stature_m);
        let girth = |girth_m: f64| girth_m / TAU + CLOTH_M;
        let biacromial_m = draw(BIACROMIAL);
        Self {
            male,
            stature_m,
            shoe_m: SHOE_M,
            bmi,
            biacromial_m,
            bideltoid_m: draw(BIDELTOID).max(biacromial_m + 0.05) + 2.0 * CLOTH_M,
            chest_m: [draw(CHEST_BREADTH) + 2.0 * CLOTH_M, draw(CHEST_DEPTH) + 2.0 * CLOTH_M],
            waist_m: [draw(WAIST_BREADTH) + 2.0 * CLOTH_M, draw(WAIST_DEPTH) + 2.0 * CLOTH_M],
            hip_m: [draw(HIP_BREADTH) + 2.0 * CLOTH_M, draw(BUTTOCK_DEPTH) + 2.0 * CLOTH_M],
            thigh_radius_m: girth(draw(THIGH_GIRTH)),
            calf_radius_m: girth(draw(CALF_GIRTH)),
            // Taken with the muscle flexed; hanging it is about 7 % slimmer.
            arm_radius_m: girth(0.93 * draw(ARM_GIRTH)),
            forearm_radius_m: girth(draw(FOREARM_GIRTH)),
            neck_radius_m: girth(draw(NECK_GIRTH)),
            // Nearly free of the height.
            head_m: [
                sex(0.154, 0.148) + sex(0.006, 0.005) * within_three_sigma(rng),
                sex(0.200, 0.190) + 0.007 * within_three_sigma(rng),
            ],
            forearm_m: sex(0.153, 0.148) * h,
            hand_m: 0.11 * h,
            foot_m: [sex(0.154, 0.151) * h, sex(0.058, 0.057) * h],
        }
    }

    /// Standing height with shoes.
    pub fn height_m(&self) -> f64 {
        self.stature_m + self.shoe_m
    }

    /// Height above the floor of a place given as a share of the stature.
    pub fn level_m(&self, share: f64) -> f64 {
        self.shoe_m + share * self.stature_m
    }

    /// Ankle joint above the floor (BT).
    pub fn ankle_m(&self) -> f64 {
        self.level_m(0.039)
    }

    /// Hip joint above the floor, standing (BT).
    pub fn hip_height_m(&self) -> f64 {
        self.level_m(0.53)
    }

    /// From the middle to a hip joint.
    pub fn hip_offset_m(&self) -> f64 {
        0.05 * self.stature_m
    }

    /// Hip to knee (BT).
    pub fn thigh_m(&self) -> f64 {
        0.245 * self.stature_m
    }

    /// Knee to ankle (BT).
    pub fn shank_m(&self) -> f64 {
        0.246 * self.stature_m
    }

    /// The shoulder joint: 2 cm inside and 3.5 cm below the acromion (.82 H).
    pub fn shoulder_m(&self) -> (f64, f64) {
        (self.biacromial_m / 2.0 - 0.02, self.level_m(0.82) - 0.035)
    }

    /// Elbow above the floor with the arm hanging: the upper arm is .191 H from the acromion.
    pub fn elbow_height_m(&self) -> f64 {
        self.level_m(0.629)
    }

    /// The shoe, heel to toe: the sole is longer than the foot.
    pub fn sole_m(&self) -> f64 {
        self.foot_m[0] + 0.02
    }
}

/// Share of men among the people of a stature.
fn male_share(stature_m: f64) -> f64 {
    let density = |(mean, sigma): (f64, f64)| (-0.5 * ((stature_m - mean) / sigma).powi(2)).exp() / sigma;
    let (men, women) = (density(STATURE_MEN_M), density(STATURE_WOMEN_M));
    // Both vanish far out, as with children: there the sexes are alike.
    (men + 1e-9) / (men + women + 2e-9)
}

/// A standard normal number, drawn again while it is beyond three sigma.
fn within_three_sigma(rng: &mut Pcg64) -> f64 {
    loop {
        let x: f64 = StandardNormal.sample(rng);
        if x.abs() <= 3.0 {
            return x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(builds: &[Build], of: impl Fn(&Build) -> f64) -> f64 {
        builds.iter().map(of).sum::<f64>() / builds.len() as f64
    }

    #[test]
    fn measures_have_the_published_means() {
        let all: Vec<Build> = (0..4000).map(|seed| Build::draw(seed, None)).collect();
        let (men, women): (Vec<Build>, Vec<Build>) = all.into_iter().partition(|b| b.male);
        let near = |name: &str, found: f64, published: f64, tolerance: f64| {
            assert!((found - published).abs() < tolerance, "{name}: {found} against {published}");
        };
        near("stature, men", mean(&men, |b| b.stature_m), 1.756, 0.005);
        near("stature, women", mean(&women, |b| b.stature_m), 1.629, 0.005);
        // Published on the skin; ours wear 5 mm a side.
        near("biacromial, men", mean(&men, |b| b.biacromial_m), 0.416, 0.005);
        near("bideltoid, men", mean(&men, |b| b.bideltoid_m - 0.01), 0.510, 0.008);
        near("bideltoid, women", mean(&women, |b| b.bideltoid_m - 0.01), 0.450, 0.008);
        near("chest breadth, men", mean(&men, |b| b.chest_m[0] - 0.01), 0.289, 0.006);
        near("chest depth, women", mean(&women, |b| b.chest_m[1] - 0.01), 0.247, 0.006);
        near("waist depth, men", mean(&men, |b| b.waist_m[1] - 0.01), 0.238, 0.008);
        near("hip breadth, women", mean(&women, |b| b.hip_m[0] - 0.01), 0.354, 0.006);
        near("thigh radius, men", mean(&men, |b| b.thigh_radius_m - 0.005), 0.099, 0.003);
    }

    #[test]
    fn a_known_height_is_kept_to_the_millimetre() {
        for seed in 0..20 {
            assert!((Build::draw(seed, Some(1.83)).height_m() - 1.83).abs() < 1e-12);
        }
    }

    #[test]
    fn tall_people_are_mostly_men() {
        let men = (0..1000).filter(|&seed| Build::draw(seed, Some(1.88)).male).count();
        assert!(men > 900, "{men}");
    }
}
