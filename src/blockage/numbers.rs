//! Numbers of the blockage probability that a left-out mechanism or a fit may change.

use super::body_model::BodyModel;
use crate::config::{BlockageConfig, Mechanism};

/// See the fields.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers {
    /// Joint samples of everybody's trajectory.
    pub samples: usize,
    /// The fewest of them that are asked, however many bodies may stand in the way.
    pub samples_min: usize,
    /// Seed of the samples.
    pub seed: u64,
    /// Whether the steps of a sample are one trajectory: those of a window are not independent. Otherwise each step is
    /// drawn by itself.
    pub joint: bool,
    /// What a ray meets.
    pub body: BodyModel,
    /// How bodies differ in depth and width from the scales that tracks know, one standard deviation as a share of the
    /// body: arms and clothes on tuning scenes.
    pub width_sigma: f64,
    /// How bodies differ from the heights that tracks know, one standard deviation.
    pub height_sigma_m: f64,
    /// The same of the trunk's heading.
    pub heading_sigma_rad: f64,
}

impl Numbers {
    /// Those of a configuration, with the body that ships.
    pub fn new(config: &BlockageConfig) -> Self {
        let without = |mechanism| config.without.contains(&mechanism);
        let mut body = BodyModel::shipped();
        if without(Mechanism::Arms) {
            (body.arms.upper_radius, body.arms.fore_radius) = (0.0, 0.0);
        }
        if without(Mechanism::ArmSwing) {
            let arms = &mut body.arms;
            (arms.elbow_swing, arms.hand_ahead, arms.hand_swing) = (0.0, 0.0, 0.0);
        }
        if without(Mechanism::TrunkSway) {
            (body.sway_left, body.sway_ahead) = (0.0, 0.0);
        }
        Self {
            samples: config.samples,
            samples_min: config.samples_min,
            seed: config.seed,
            joint: !without(Mechanism::JointSampling),
            body,
            width_sigma: 0.055,
            height_sigma_m: 0.02,
            heading_sigma_rad: 10.0_f64.to_radians(),
        }
    }
}
