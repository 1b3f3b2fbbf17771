//! Numbers of the mixture tracker that a left-out mechanism or a test may change. All others are constants beside the
//! code that uses them.

use super::outline::UsualOutline;
use crate::config::{Mechanism, TrackConfig};

/// A model of motion, and how much of the time it holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionModel {
    /// Spectral density of white acceleration, m^2/s^3.
    pub acceleration_psd_m2ps3: f64,
    /// The shares of all models add up to 1.
    pub share: f64,
    /// Of who stands: how far the velocity may be from zero, one sigma of an axis.
    pub standing_mps: Option<f64>,
}

/// Walking on smoothly as in ORCA (0.1 m/s^2 held for 0.1 s is 0.001 m^2/s^3), turning as real people do (1.7 m/s^2),
/// starting or turning sharply; and standing, whose velocity need not be learned from positions. The first alone doubles
/// the error on real people, the second alone that on ORCA. Chosen on tuning scenes and on the walkers of
/// circle-antipode's repeats numbered 1.
const MOTION_MODELS: [MotionModel; 4] = [
    MotionModel { acceleration_psd_m2ps3: 0.0008, share: 0.60, standing_mps: None },
    MotionModel { acceleration_psd_m2ps3: 0.3, share: 0.25, standing_mps: None },
    MotionModel { acceleration_psd_m2ps3: 3.0, share: 0.10, standing_mps: None },
    MotionModel { acceleration_psd_m2ps3: 0.0, share: 0.05, standing_mps: Some(0.05) },
];
/// Where one model has to do for all.
const ONE_MODEL: MotionModel = MotionModel { acceleration_psd_m2ps3: 0.1, share: 1.0, standing_mps: None };

/// See the fields.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers {
    /// Weighed by how well each foresees the detections.
    pub motion_models: Vec<MotionModel>,
    /// One standard deviation of the sway to the left and ahead that the network of the pose leaves in a detection,
    /// measured on tuning scenes.
    pub sway_m: [f64; 2],
    /// Measurement noise that nothing mends, one axis.
    pub noise_floor_m: f64,
    /// How much of the variance that a detection claims of its position differs from frame to frame and is no sway:
    /// where the covariance agrees with the errors on tuning scenes.
    pub noise_share: f64,
    /// How much of it lasts, for every frame sees the same body: the track's position is less sure by it.
    pub lasting_share: f64,
    /// Whether sensors, furniture and other people decide if a person can be seen.
    pub visibility: bool,
    /// Whether arms and legs tell the phase of the gait.
    pub stride: bool,
    /// What outlines of usual bodies look like.
    pub usual: UsualOutline,
    /// Whether outlines are learned.
    pub outline: bool,
    /// Whether it is learned where the points of a body lie, and what hangs over it.
    pub shape: bool,
    /// Whether a track may be somebody's thing.
    pub things: bool,
    /// One standard deviation of adults' heights.
    pub height_sigma_m: f64,
    /// Chance that somebody new is a child, or sits: of any height up to 1.5 m. Below 1. How often they come does not
    /// matter much, for a few frames tell.
    pub children_share: f64,
    /// New people and false detections per frame and square metre.
    pub clutter_per_m2: f64,
    /// A track dies after this long without a detection.
    pub coast_max_s: f64,
}

impl Numbers {
    /// Those of a configuration.
    pub fn new(config: &TrackConfig) -> Self {
        let without = |mechanism| config.without.contains(&mechanism);
        let mut motion_models = MOTION_MODELS.to_vec();
        if without(Mechanism::MotionModels) {
            motion_models = vec![ONE_MODEL];
        } else if without(Mechanism::StandingModel) {
            motion_models.retain(|model| model.standing_mps.is_none());
            let walking: f64 = motion_models.iter().map(|model| model.share).sum();
            motion_models.iter_mut().for_each(|model| model.share /= walking);
        }
        let mut numbers = Self {
            motion_models,
            sway_m: [0.012; 2],
            noise_floor_m: 0.005,
            noise_share: 0.7,
            lasting_share: 0.1,
            visibility: !without(Mechanism::Visibility),
            stride: !without(Mechanism::Stride),
            usual: UsualOutline::shipped(),
            outline: !without(Mechanism::Outline),
            shape: !without(Mechanism::Shape),
            things: !without(Mechanism::Things),
            height_sigma_m: if without(Mechanism::Height) { 1e-3 } else { 0.09 },
            children_share: 0.1,
            clutter_per_m2: config.clutter_per_m2,
            coast_max_s: config.coast_max_s,
        };
        if without(Mechanism::Sway) {
            // What is not followed is noise.
            numbers.noise_floor_m = numbers.noise_floor_m.hypot(numbers.sway_m[0]);
            numbers.sway_m = [0.0; 2];
        }
        if without(Mechanism::Height) || without(Mechanism::ChildrenAndSeated) {
            numbers.children_share = 0.0;
        }
        if without(Mechanism::Pose) {
            // A detection claims no covariance then: what a constant shift leaves of the error of one frame
            // (models/pose.md).
            numbers.noise_floor_m = 0.04;
        }
        numbers
    }
}
