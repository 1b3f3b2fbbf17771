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
    /// Length of the legs for the stature, 1 in adults, and the chin's share of it.
    pub legs: f64,
    /// See `legs`.
    pub chin: f64,
    /// Of who has joints of their own, in place of those that follow from the stature.
    pub joints: Option<Joints>,
}

/// Where the joints of a body are that hangs at rest, and how long its bones are; heights above the floor, with shoes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joints {
    /// The ankle.
    pub ankle_m: f64,
    /// From the middle to a hip joint.
    pub hip_offset_m: f64,
    /// The hip joints.
    pub hip_height_m: f64,
    /// Hip to knee.
    pub thigh_m: f64,
    /// Knee to ankle.
    pub shank_m: f64,
    /// From the middle to a shoulder joint, and its height.
    pub shoulder_m: (f64, f64),
    /// The elbow.
    pub elbow_height_m: f64,
    /// Elbow to wrist.
    pub forearm_m: f64,
    /// Where the trunk bends.
    pub waist_m: f64,
    /// Where the neck begins.
    pub neck_m: f64,
    /// Heel to toe.
    pub sole_m: f64,
}

impl Joints {
    /// Of the same body, larger or smaller.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
        Self {
            ankle_m: scale * self.ankle_m,
            hip_offset_m: scale * self.hip_offset_m,
            hip_height_m: scale * self.hip_height_m,
            thigh_m: scale * self.thigh_m,
            shank_m: scale * self.shank_m,
            shoulder_m: (scale * self.shoulder_m.0, scale * self.shoulder_m.1),
            elbow_height_m: scale * self.elbow_height_m,
            forearm_m: scale * self.forearm_m,
            waist_m: scale * self.waist_m,
            neck_m: scale * self.neck_m,
            sole_m: scale * self.sole_m,
        }
    }
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
/// Height of the hip joints of adults, as a share of the stature (BT).
const HIP: f64 = 0.53;
/// Height of the chin of adults, as a share of the stature (BT).
pub const CHIN: f64 = 0.870;
/// Children: age and median height, sexes alike.
const CHILDREN_M: [(f64, f64); 6] =
    [(3.0, 0.95), (4.0, 1.02), (5.0, 1.09), (6.0, 1.15), (10.0, 1.38), (12.0, 1.50)];
/// Spread of height within an age, as a share.
const CHILD_SPREAD: f64 = 0.045;
/// Flat indoor shoes.
const SHOE_M: f64 = 0.025;
/// Trousers and a shirt stand off the skin (shoulder breadth +10 mm indoors).
const CLOTH_M: f64 = 0.005;
/// The ball of the foot, where toes bend, as a share of the sole's length from the heel.
pub const BALL_SHARE: f64 = 0.75;
/// The ankle joint, from the heel.
pub const ANKLE_SHARE: f64 = 0.25;

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
        Self::measured(male, stature_m, bmi, None, rng)
    }

    /// Draws a child of 3 to 12 years.
    pub fn draw_child(seed: u64) -> Self {
        let rng = &mut stream(seed, "child", 0);
        let (male, age) = (rng.random::<f64>() < 0.5, rng.random_range(3.0..12.0));
        let stature_m = along(&CHILDREN_M, age) * (1.0 + CHILD_SPREAD * within_three_sigma(rng));
        // Slimmest at 5; 18 at 12 (of memory).
        let bmi =
            along(&[(3.0, 15.8), (5.0, 15.3), (12.0, 18.0)], age) * (1.0 + 0.06 * within_three_sigma(rng));
        Self::measured(male, stature_m, bmi, Some(age), rng)
    }

    /// The rest of the measures; `age` in years of a child.
    ///
    /// An adult's exponents, carried on, meet a child's breadths and girths within a centimetre or two but for
    /// the shoulders: those keep their share of the height. The head is nearly an adult's from six on; the legs
    /// are shorter below seven, when the upper body is 1.2 times the lower one.
    fn measured(male: bool, stature_m: f64, bmi: f64, age: Option<f64>, rng: &mut Pcg64) -> Self {
        let stature = if male { STATURE_MEN_M } else { STATURE_WOMEN_M };
        let mut draw = |Measure(men, women, p, q, r): Measure| {
            let x25 = if male { men } else { women };
            x25 * (stature_m / stature.0).powf(p) * (bmi / 25.0).powf(q) * (r * within_three_sigma(rng)).exp()
        };
        let (sex, h) = (|men, women| if male { men } else { women }, stature_m);
        let girth = |girth_m: f64| girth_m / TAU + CLOTH_M;
        let shoulders = |Measure(men, women, p, q, r): Measure| {
            Measure(men, women, if age.is_some() { 1.0 } else { p }, q, r)
        };
        let biacromial_m = draw(shoulders(BIACROMIAL));
        let mut build = Self {
            male,
            stature_m,
            shoe_m: SHOE_M,
            bmi,
            biacromial_m,
            bideltoid_m: draw(shoulders(BIDELTOID)).max(biacromial_m + 0.05) + 2.0 * CLOTH_M,
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
            legs: 1.0,
            chin: CHIN,
            joints: None,
        };
        if let Some(age) = age {
            let grown = along(&[(3.0, 0.94), (6.0, 1.0)], age);
            build.head_m = build.head_m.map(|size| grown * size);
            build.chin = 1.0 - (1.0 - CHIN) * grown * STATURE_WOMEN_M.0 / stature_m;
            // Upper over lower body: 1.2 up to five, 1 from seven on.
            build.legs = 2.0 / (1.0 + along(&[(5.0, 1.2), (7.0, 1.0)], age));
        }
        build
    }

    /// Standing height with shoes.
    pub fn height_m(&self) -> f64 {
        self.stature_m + self.shoe_m
    }

    /// Height above the floor of a place given as a share of an adult's stature: in a child, legs and head have
    /// their own length and the trunk fills what is between.
    pub fn level_m(&self, share: f64) -> f64 {
        let own = if share <= HIP {
            share * self.legs
        } else if (self.legs, self.chin) == (1.0, CHIN) {
            share
        } else {
            along(&[(HIP, HIP * self.legs), (CHIN, self.chin), (1.0, 1.0)], share)
        };
        self.shoe_m + own * self.stature_m
    }

    /// Ankle joint above the floor (BT).
    pub fn ankle_m(&self) -> f64 {
        self.joints.map_or_else(|| self.level_m(0.039), |joints| joints.ankle_m)
    }

    /// Hip joint above the floor, standing (BT).
    pub fn hip_height_m(&self) -> f64 {
        self.joints.map_or_else(|| self.level_m(HIP), |joints| joints.hip_height_m)
    }

    /// From the middle to a hip joint.
    pub fn hip_offset_m(&self) -> f64 {
        self.joints.map_or_else(|| 0.05 * self.stature_m, |joints| joints.hip_offset_m)
    }

    /// Hip to knee (BT).
    pub fn thigh_m(&self) -> f64 {
        self.joints.map_or_else(|| 0.245 * self.legs * self.stature_m, |joints| joints.thigh_m)
    }

    /// Knee to ankle (BT).
    pub fn shank_m(&self) -> f64 {
        self.joints.map_or_else(|| 0.246 * self.legs * self.stature_m, |joints| joints.shank_m)
    }

    /// The shoulder joint: 2 cm inside and 3.5 cm below the acromion (.82 H).
    pub fn shoulder_m(&self) -> (f64, f64) {
        self.joints.map_or_else(
            || (self.biacromial_m / 2.0 - 0.02, self.level_m(0.82) - 0.035),
            |joints| joints.shoulder_m,
        )
    }

    /// Elbow above the floor with the arm hanging: the upper arm is .191 H from the acromion.
    pub fn elbow_height_m(&self) -> f64 {
        self.joints.map_or_else(|| self.level_m(0.629), |joints| joints.elbow_height_m)
    }

    /// Where the trunk bends between pelvis and thorax.
    pub fn waist_height_m(&self) -> f64 {
        self.joints.map_or_else(|| self.level_m(0.60), |joints| joints.waist_m)
    }

    /// Where neck and head turn.
    pub fn neck_height_m(&self) -> f64 {
        self.joints.map_or_else(|| self.level_m(0.85), |joints| joints.neck_m)
    }

    /// The shoe, heel to toe: the sole is longer than the foot.
    pub fn sole_m(&self) -> f64 {
        self.joints.map_or_else(|| self.foot_m[0] + 0.02, |joints| joints.sole_m)
    }
}

/// Share of men among the people of a stature.
fn male_share(stature_m: f64) -> f64 {
    let density = |(mean, sigma): (f64, f64)| (-0.5 * ((stature_m - mean) / sigma).powi(2)).exp() / sigma;
    let (men, women) = (density(STATURE_MEN_M), density(STATURE_WOMEN_M));
    // Both vanish far out, as with children: there the sexes are alike.
    (men + 1e-9) / (men + women + 2e-9)
}

/// The straight lines through `points`, level beyond their ends.
fn along(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.iter().position(|point| point.0 > x).unwrap_or(points.len());
    if after == 0 || after == points.len() {
        return points[after.min(points.len() - 1)].1;
    }
    let ((x0, y0), (x1, y1)) = (points[after - 1], points[after]);
    y0 + (x - x0) / (x1 - x0) * (y1 - y0)
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
    fn children_have_short_legs_a_large_head_and_their_sizes() {
        let all: Vec<Build> = (0..3000).map(Build::draw_child).collect();
        let of = |low: f64, high: f64| -> Vec<Build> {
            all.iter().filter(|b| (low..high).contains(&b.stature_m)).copied().collect()
        };
        let five = of(1.05, 1.13);
        assert!(five.len() > 100, "{}", five.len());
        // Breadth and depth of the chest of five-year-olds are about 19 and 14 cm, their shoulders 25 cm.
        assert!((mean(&five, |b| b.chest_m[0]) - 0.20).abs() < 0.02);
        assert!((mean(&five, |b| b.chest_m[1]) - 0.15).abs() < 0.02);
        assert!((mean(&five, |b| b.biacromial_m) - 0.245).abs() < 0.02);
        for b in &all {
            let lower = b.level_m(0.5) - b.shoe_m;
            assert!(b.stature_m - lower > 0.99 * lower, "at {} m", b.stature_m);
            assert!((0.75..=0.88).contains(&b.chin), "{}", b.chin);
            let levels: Vec<f64> = (0..=100).map(|i| b.level_m(f64::from(i) * 0.01)).collect();
            assert!(levels.is_sorted(), "{levels:?}");
            assert!((levels[100] - b.height_m()).abs() < 1e-12);
            assert!((b.thigh_m() + b.shank_m() + b.ankle_m() - b.hip_height_m()).abs() < 1e-9);
        }
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
