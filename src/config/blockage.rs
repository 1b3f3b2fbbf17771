//! Switches of `blockage`.

use serde::{Deserialize, Serialize};

use crate::STEPS;

/// See `config/default.toml` for every value and its reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockageConfig {
    /// How a link is judged.
    pub method: BlockageMethod,
    /// The box of Algorithm 1.
    pub person_box: BoxKind,
    /// Joint samples of everybody's way.
    pub samples: usize,
    /// Whether the steps of a sample are one way, not drawn each by itself.
    pub joint: bool,
    /// Seed of the samples.
    pub seed: u64,
    /// What a ray meets.
    pub body: BodyConfig,
    /// What bodies differ in from the tracks' girth: one standard deviation, as a share of the body.
    pub girth_sigma: f64,
    /// The same of the height.
    pub height_sigma_m: f64,
    /// One standard deviation of the heading.
    pub heading_sigma_deg: f64,
    /// A link counts as blocked now at this probability.
    pub threshold_now: f64,
    /// A link counts as blocked within window w at `threshold[w - 1]`.
    pub threshold: [f64; STEPS],
}

/// An upright body. All sizes are shares of the standing height.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyConfig {
    /// Elliptic cylinders from the floor up.
    pub slices: Vec<SliceConfig>,
    /// Side to side, half of the way that the trunk sways as it walks.
    pub sway: f64,
    /// The same ahead and back, twice a stride.
    pub surge: f64,
    /// Left and right alike.
    pub arms: ArmsConfig,
}

/// One elliptic cylinder of a body, from the top of the one below.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SliceConfig {
    /// Upper end.
    pub top: f64,
    /// Half axis front to back.
    pub half_depth: f64,
    /// Half axis side to side.
    pub half_width: f64,
    /// Its middle ahead of the body axis.
    pub ahead: f64,
}

/// An arm: rods from the shoulder to the elbow and on to the middle of the hand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmsConfig {
    /// Above the floor.
    pub shoulder_up: f64,
    /// Away from the axis.
    pub shoulder_out: f64,
    /// Above the floor.
    pub elbow_up: f64,
    /// Away from the axis.
    pub elbow_out: f64,
    /// Above the floor.
    pub hand_up: f64,
    /// Away from the axis.
    pub hand_out: f64,
    /// Of the upper arm.
    pub upper_radius: f64,
    /// Of forearm and hand.
    pub fore_radius: f64,
    /// How far the elbow swings to either side, for a speed of one hip height a second.
    pub elbow_swing: f64,
    /// How far ahead the hand is in the middle of its swing, for the same speed.
    pub hand_ahead: f64,
    /// How far the hand swings to either side of that, for the same speed.
    pub hand_swing: f64,
    /// Share of people who walk without swinging their arms.
    pub still_share: f64,
}

/// How a link is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BlockageMethod {
    /// The paper's: boxes at the forecast means, yes or no.
    #[serde(rename = "algorithm-1")]
    Algorithm1,
    /// Upright bodies on sampled ways: a probability.
    Probability,
}

/// The two boxes of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BoxKind {
    /// Along the site's axes.
    Aabb,
    /// Along the person's axes.
    Obb,
}
