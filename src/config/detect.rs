//! Switches of `detect`.

use serde::{Deserialize, Serialize};

/// See `config/default.toml` for every value and its reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectConfig {
    /// Which points are new.
    pub background: BackgroundConfig,
    /// Which points belong together.
    pub cluster: ClusterConfig,
    /// How a cluster becomes one person.
    pub split: SplitConfig,
    /// Position, boxes and size gate of one person.
    pub measure: MeasureConfig,
}

/// How the empty scene is remembered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BackgroundMethod {
    /// Ranges of each pixel of each sensor.
    RangeImage,
    /// Occupied voxels of the site, as the adapted code does it.
    Voxel,
}

/// Switches of the background.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BackgroundConfig {
    /// Range image or voxels.
    pub method: BackgroundMethod,
    /// Width of a pixel of an organised scan.
    pub azimuth_bin_deg: f64,
    /// Width of a pixel of a cloud whose columns are not known.
    pub cloud_azimuth_bin_deg: f64,
    /// Height of a pixel of a cloud whose beams are not known.
    pub cloud_elevation_bin_deg: f64,
    /// How much nearer than the background a return must be.
    pub margin_m: f64,
    /// Revolutions before an unlearned scene is believed to be known.
    pub start_revolutions: u32,
    /// A range is background when it came back in at least this share of the revolutions.
    pub share: f64,
    /// Revolutions after which what was learned weighs half.
    pub memory_revolutions: u32,
    /// Nothing is learned within this distance of an expected person.
    pub freeze_m: f64,
    /// Edge of a voxel.
    pub voxel_m: f64,
    /// A voxel with at least this many points of the empty scene is occupied.
    pub voxel_points: u8,
    /// So many empty scans make the voxel map.
    pub map_revolutions: u32,
    /// Edge of the voxels whose points become their centroid; 0 keeps every point.
    pub thin_m: f64,
    /// Points nearer than this to the hall's walls, or outside, are not people.
    pub wall_m: f64,
    /// Lowest point of interest.
    pub z_min_m: f64,
    /// Highest point of interest.
    pub z_max_m: f64,
    /// Most foreground points kept of one frame.
    pub points_limit: usize,
}

/// Switches of the clusters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClusterConfig {
    /// Points nearer than this in plan view belong together.
    pub radius_m: f64,
    /// The radius grows by this for each metre from the nearest sensor.
    pub radius_per_range: f64,
    /// How far a point is moved along the horizontal line of sight before it is clustered.
    pub shift_m: f64,
    /// Smaller clusters are dropped.
    pub points_min: usize,
}

/// How clusters of several people are split.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SplitMethod {
    /// DP-means, then a merge where no gap is seen (Haselich as adapted).
    DpMeans,
    /// Evidence for one person more or fewer.
    Evidence,
}

/// What the gap test of the merge takes for a cluster's mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MergeMean {
    /// The sum of the points, never divided: the adapted code's bug.
    Sum,
    /// The mean.
    Mean,
}

/// Switches of split and merge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SplitConfig {
    /// DP-means or evidence.
    pub method: SplitMethod,
    /// DP-means: a point farther than this from every centroid starts a new cluster.
    pub lambda_m: f64,
    /// DP-means: most passes.
    pub passes: u32,
    /// Gap test: clusters whose means are farther apart are not merged.
    pub merge_m: f64,
    /// Gap test: what stands for the mean.
    pub merge_mean: MergeMean,
    /// One person more or fewer.
    pub evidence: EvidenceConfig,
}

/// When there is one person more or fewer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvidenceConfig {
    /// Whether expected people move the thresholds and take pieces of bodies.
    pub guided: bool,
    /// Two people when the means of the halves of a cluster lie farther apart than this.
    pub halves_m: f64,
    /// The same where two people are expected.
    pub expected_halves_m: f64,
    /// A point or part nearer than this to an expected person may be that person.
    pub expected_m: f64,
    /// A part that ends below this height is legs, no whole person.
    pub whole_top_m: f64,
    /// Each half needs as many points.
    pub points_min: usize,
    /// Parts whose means are nearer than this are one person.
    pub one_person_m: f64,
    /// A low part nearer than this to a person is a leg.
    pub limb_m: f64,
    /// Low: its top is below this share of the person's.
    pub limb_top_share: f64,
}

/// Where a person stands, given the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PositionMethod {
    /// Centre of the axis-aligned box.
    BoxCenter,
    /// Mean of the points, each moved away from its sensor.
    ShiftedMean,
    /// The same, corrected by a linear model of what was seen.
    Fitted,
}

/// Which way an oriented box may turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObbAxes {
    /// Eigenvectors of the points.
    Eigenvectors,
    /// About the vertical only.
    Yaw,
}

/// Switches of the measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasureConfig {
    /// Box centre, shifted mean or fitted.
    pub position: PositionMethod,
    /// How far a point is moved along the horizontal line of sight.
    pub shift_m: f64,
    /// Full or upright.
    pub obb_axes: ObbAxes,
    /// Points that do not look like a person count where one is expected within this distance; 0: nowhere.
    pub expected_m: f64,
    /// Least points of a person.
    pub points_min: usize,
    /// Most points of a person.
    pub points_max: usize,
    /// Shortest diagonal of the box in plan view.
    pub diagonal_min_m: f64,
    /// Longest diagonal of the box in plan view.
    pub diagonal_max_m: f64,
    /// The same of somebody known who is lower than `seated_height_m`.
    pub seated_diagonal_max_m: f64,
    /// Who reaches no higher than this may sit in a wheelchair.
    pub seated_height_m: f64,
    /// Least height from the lowest to the highest point.
    pub extent_min_m: f64,
    /// Greatest height from the lowest to the highest point.
    pub extent_max_m: f64,
    /// Lowest place of the highest point above the floor.
    pub top_min_m: f64,
    /// Highest place of the highest point above the floor.
    pub top_max_m: f64,
}
