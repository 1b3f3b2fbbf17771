//! Choices of `blockage`.

use serde::{Deserialize, Serialize};

use super::mechanism::Mechanism;

/// See `config/default.toml` for every value and its reason.
///
/// ```
/// assert_eq!(umbracast::Config::default().blockage.samples, 128);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockageConfig {
    /// How a link is judged.
    pub method: BlockageMethod,
    /// The box of Algorithm 1.
    pub person_box: BoxKind,
    /// Joint samples of everybody's trajectory.
    pub samples: usize,
    /// The fewest of them that a crowd is left with.
    pub samples_min: usize,
    /// Seed of the samples.
    pub seed: u64,
    /// A link counts as blocked, now or within any window, at this probability.
    pub threshold: f64,
    /// Mechanisms left out.
    pub without: Vec<Mechanism>,
}

/// How a link is judged.
///
/// ```
/// use umbracast::{Config, config::BlockageMethod};
///
/// assert_eq!(Config::default().blockage.method, BlockageMethod::Probability);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BlockageMethod {
    /// The paper's: boxes at the forecast means, yes or no.
    #[serde(rename = "algorithm-1")]
    Algorithm1,
    /// Upright bodies on sampled trajectories: a probability.
    Probability,
}

/// The two boxes of the paper.
///
/// ```
/// use umbracast::{Config, config::BoxKind};
///
/// assert_eq!(Config::default().blockage.person_box, BoxKind::Aabb);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BoxKind {
    /// Along the site's axes.
    Aabb,
    /// Along the person's axes.
    Obb,
}
