//! Choices of `detect`.

use serde::{Deserialize, Serialize};

use super::mechanism::Mechanism;

/// See `config/default.toml` for every value and its reason.
///
/// ```
/// assert_eq!(umbracast::Config::default().detect.highest_m, 2.4);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectConfig {
    /// How the empty scene is remembered.
    pub background: BackgroundMethod,
    /// Edge of the voxels whose points become their centroid before anything else; 0 keeps every point.
    pub thin_m: f64,
    /// Points higher than this above the floor are nobody's.
    pub highest_m: f64,
    /// Whether floor and walls put the poses of sensors right.
    pub follow_sensors: bool,
    /// How points become people.
    pub clusters: ClusterMethod,
    /// Where a person stands, given the points.
    pub position: PositionMethod,
    /// Mechanisms left out.
    pub without: Vec<Mechanism>,
}

/// How the empty scene is remembered.
///
/// ```
/// use umbracast::{Config, config::BackgroundMethod};
///
/// assert_eq!(Config::default().detect.background, BackgroundMethod::RangeImage);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BackgroundMethod {
    /// Ranges of each pixel of each sensor.
    RangeImage,
    /// Occupied voxels of the site, as the adapted code does it.
    Voxels,
}

/// How clusters of several people are split.
///
/// ```
/// use umbracast::{Config, config::ClusterMethod};
///
/// assert_eq!(Config::default().detect.clusters, ClusterMethod::Evidence);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClusterMethod {
    /// Evidence for one person more or fewer.
    Evidence,
    /// DP-means, then a merge where no gap is seen (Haselich), as published.
    Haselich,
    /// The same with the bug of the adapted code, which keeps it from ever merging.
    HaselichAsShipped,
}

/// Where a person stands, given the points.
///
/// ```
/// use umbracast::{Config, config::PositionMethod};
///
/// assert_eq!(Config::default().detect.position, PositionMethod::Fitted);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PositionMethod {
    /// Centre of the axis-aligned box, with the adapted code's size of a person and its oriented box.
    BoxCenter,
    /// Mean of the points, each moved away from its sensor. Neither phase of the gait nor which way who stands faces is read.
    ShiftedMean,
    /// The same, corrected by a model of what was seen.
    Fitted,
}
