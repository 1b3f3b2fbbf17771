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
    /// Seed of the samples.
    pub seed: u64,
    /// Trunk front to back.
    pub trunk_depth_m: f64,
    /// Trunk with arms side to side.
    pub trunk_width_m: f64,
    /// Top of the shoulders as a share of the height.
    pub shoulder_share: f64,
    /// Head.
    pub head_diameter_m: f64,
    /// One standard deviation of the trunk's width and depth, as a share of them.
    pub size_sigma_share: f64,
    /// One standard deviation of the height.
    pub height_sigma_m: f64,
    /// One standard deviation of the heading.
    pub heading_sigma_deg: f64,
    /// A link counts as blocked now at this probability.
    pub threshold_now: f64,
    /// A link counts as blocked within window w at `threshold[w - 1]`.
    pub threshold: [f64; STEPS],
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
