//! Switches of `track`.

use serde::{Deserialize, Serialize};

/// See `config/default.toml` for every value and its reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackConfig {
    /// Which instant a detection is taken to be measured at.
    pub measured_at: MeasuredAt,
    /// How the motion departs from a constant velocity.
    pub process_noise: ProcessNoise,
    /// White-acceleration densities, one a motion model, m^2/s^3.
    pub acceleration_m2ps3: Vec<f64>,
    /// How much of the time each motion model holds.
    pub model_share: Vec<f64>,
    /// How much of the time people stand: with 0 there is no such model. The shares add up to 1.
    pub standing_share: f64,
    /// Velocity of who stands, one standard deviation of an axis.
    pub standing_speed_mps: f64,
    /// How long a motion model lasts.
    pub model_dwell_s: f64,
    /// How far a walking body sways to the left and right, one standard deviation.
    pub sway_left_m: f64,
    /// The same ahead and back.
    pub sway_ahead_m: f64,
    /// What [`crate::detect::Swing`] is at its largest, of who walks at his hips' height a second.
    pub swing_m2: f64,
    /// Its noise in one frame, one standard deviation.
    pub swing_noise_m2: f64,
    /// Whether the sway to the side tells the phase of the gait.
    pub gait_from_sway: bool,
    /// Whether arms and legs tell it.
    pub gait_from_limbs: bool,
    /// Whether extents of detections tell how stout a person is.
    pub girth: bool,
    /// Time after which size and phase of the sway are forgotten.
    pub sway_lasts_s: f64,
    /// `per-step`: added to the position's variance each frame.
    pub step_position_m2: f64,
    /// `per-step`: added to the velocity's variance each frame.
    pub step_velocity_m2ps2: f64,
    /// Follow the height of the points too.
    pub follow_z: bool,
    /// How much of the variance that a detection tells of its position is no sway, which the filter follows.
    pub noise_share: f64,
    /// Measurement noise that nothing mends, one axis.
    pub noise_floor_m: f64,
    /// Measurement noise added where hardly anything of a person is seen, one axis; none is where half the height and
    /// half the returns of a body in free sight are.
    pub hidden_noise_m: f64,
    /// A new track's position variance as a multiple of the measurement's.
    pub birth_variance_per_noise: f64,
    /// A new track's velocity, one standard deviation of an axis.
    pub birth_speed_mps: f64,
    /// Which spread a detection must lie within to belong to a track.
    pub gate_on: GateOn,
    /// How much farther than foreseen a detection may lie where it is given to a track, one sigma of an axis.
    pub gate_slack_m: f64,
    /// Squared Mahalanobis distance a pair may have.
    pub gate_chi2: f64,
    /// Distance a pair may have.
    pub gate_m: f64,
    /// How detections are given to tracks.
    pub assignment: Assignment,
    /// New people and false detections per frame and square metre.
    pub new_per_m2: f64,
    /// Only a detection farther than this from every track starts one.
    pub birth_radius_m: f64,
    /// Hits that confirm a track.
    pub confirm_hits: u32,
    /// Time within which they must come.
    pub confirm_within_s: f64,
    /// A track is not told as confirmed while its position, one standard deviation of the larger axis, is less sure.
    pub told_sigma_max_m: f64,
    /// Whether sensors, furniture and other people decide if a person can be seen.
    pub visibility: bool,
    /// Chance to detect a person in full view.
    pub detection_probability: f64,
    /// Expected returns at which that chance has fallen to half.
    pub returns_at_half: f64,
    /// A body that sensors meet only below this height is not detected.
    pub seen_top_min_m: f64,
    /// Distance between two people below which they often give one detection.
    pub resolution_m: f64,
    /// How much likelier a detection is from a person than from nobody.
    pub hit_ratio: f64,
    /// A track dies when the probability that somebody is there falls below this.
    pub existence_min: f64,
    /// A track dies after this long without a detection.
    pub coast_max_s: f64,
    /// A track dies when the trace of its position covariance reaches this.
    pub position_variance_max_m2: f64,
    /// Two tracks nearer than this are one person,
    pub duplicate_m: f64,
    /// once they have been for so long.
    pub duplicate_after_s: f64,
    /// Below this speed the heading is held.
    pub heading_speed_mps: f64,
    /// Whose size the boxes have.
    pub boxes: Boxes,
    /// Mean standing height of adults, with shoes.
    pub height_mean_m: f64,
    /// Its standard deviation.
    pub height_sigma_m: f64,
    /// Chance that somebody new is a child, or sits: of any height up to 1.5 m. Below 1.
    pub children_share: f64,
    /// Time over which the width of a box is averaged.
    pub box_average_s: f64,
}

/// Which instant a detection is taken to be measured at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeasuredAt {
    /// The mean time of its points.
    Points,
    /// The frame's end.
    Frame,
}

/// How the motion departs from a constant velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProcessNoise {
    /// White acceleration, scaled by the time that passed.
    WhiteAcceleration,
    /// The same for every step, however long.
    PerStep,
}

/// Which spread a detection must lie within.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GateOn {
    /// The predicted position's alone.
    Prediction,
    /// The predicted position's and the measurement's.
    Innovation,
}

/// How detections are given to tracks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Assignment {
    /// The best pair first, then the best of the rest.
    Greedy,
    /// The pairs whose total is the best.
    Optimal,
}

/// Whose size the boxes have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Boxes {
    /// The last detection's, moved along.
    Detection,
    /// Averaged over time, standing on the floor, turned with the heading.
    Averaged,
}
