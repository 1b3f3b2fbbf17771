//! Choices of `track`.

use serde::{Deserialize, Serialize};

use super::mechanism::Mechanism;

/// See `config/default.toml` for every value and its reason.
///
/// ```
/// assert_eq!(umbracast::Config::default().track.coast_max_s, 3.0);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackConfig {
    /// Who follows.
    pub method: TrackMethod,
    /// New people and false detections per frame and square metre.
    pub clutter_per_m2: f64,
    /// A track dies after this long without a detection.
    pub coast_max_s: f64,
    /// Mechanisms left out.
    pub without: Vec<Mechanism>,
}

/// Who follows.
///
/// ```
/// use umbracast::{Config, config::TrackMethod};
///
/// assert_eq!(Config::default().track.method, TrackMethod::Mixture);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrackMethod {
    /// A mixture of motion models for each person, and what sensors can see.
    Mixture,
    /// The paper's tracker.
    Paper,
    /// The adapted code's.
    Hdl,
}
