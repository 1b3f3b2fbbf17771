//! The width and depth of a body relative to a usual one of its height, from the extents of detections in free sight.
//! The ablation shows its gain, above all for wheelchairs.
//!
//! Beams and columns lie far apart on a body, so the extent of one frame says almost nothing. The mean over some ten
//! seconds explains a sixth of the variance between people.
//!
//! Numbers: `umbracast train width`, simulated returns of 115 adults on tuning scenes.

use super::remembered::{Remembered, Words};
use super::visibility::BodyView;
use crate::detect::Detection;

/// One standard deviation of the scale of adults, before one was seen: of trunks' widths over heights.
pub const PRIOR_SIGMA: f64 = 0.058;
/// Half depth and half width of a standing body's returns together, as a share of the height.
pub(super) const STANDING_SHARE: f64 = 0.226;
/// What each m/s adds: arms and legs swing.
const SHARE_PER_MPS: f64 = 0.032;
/// Added by a scale of 1.
const SHARE_PER_SCALE: f64 = 0.101;
/// The share's error in one frame, and what no number of frames mends: people swing their arms differently.
const FRAME_SIGMA: f64 = 0.106;
const LASTING_SIGMA: f64 = 0.0098;
/// Fewer returns tell no extent, those of a body partly hidden a wrong one, and who stands shows one side only.
const RETURNS_MIN: f64 = 6.0;
const FREE_SHARE: f64 = 0.97;
const STRIDES_FROM_MPS: f64 = 0.5;

/// Half depth and half width of the returns of somebody who walks in free sight, as a share of the height.
pub fn share(detection: &Detection, view: &BodyView, height_m: f64, speed_mps: f64) -> Option<f64> {
    let free = view.returns > FREE_SHARE * view.returns_alone && view.returns > RETURNS_MIN;
    let extent_m = detection.obb.half_m.x + detection.obb.half_m.y;
    (free && detection.full_body && speed_mps > STRIDES_FROM_MPS).then(|| extent_m / height_m)
}

/// What extents have told.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BodyWidth {
    frames: f64,
    /// Of what a frame's share is off that of a usual body.
    sum: f64,
}

impl Remembered for BodyWidth {
    fn visit(&mut self, words: &mut impl Words) {
        words.f64(&mut self.frames);
        words.f64(&mut self.sum);
    }
}

impl BodyWidth {
    /// Takes the detection of a body that looks like `view`.
    pub(super) fn see(&mut self, detection: &Detection, view: &BodyView, height_m: f64, speed_mps: f64) {
        if let Some(share) = share(detection, view, height_m, speed_mps) {
            self.frames += 1.0;
            self.sum += share - STANDING_SHARE - SHARE_PER_MPS * speed_mps;
        }
    }

    /// Factor on a usual body's depths and widths, and its standard deviation.
    pub(super) fn scale(&self) -> (f64, f64) {
        if self.frames == 0.0 {
            return (1.0, PRIOR_SIGMA);
        }
        let (prior2, slope) = (PRIOR_SIGMA.powi(2), SHARE_PER_SCALE);
        let error2 = LASTING_SIGMA.powi(2) + FRAME_SIGMA.powi(2) / self.frames;
        let gain = prior2 * slope / (slope * slope * prior2 + error2);
        (1.0 + gain * self.sum / self.frames, PRIOR_SIGMA * (1.0 - gain * slope).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Aabb, DVec2, DVec3, Obb};

    /// Seen for so many frames with such an extent, walking at 1 m/s in this view.
    fn seen(frames: u32, extent_m: f64, view: BodyView) -> (f64, f64) {
        let aabb = Aabb { min_m: DVec3::ZERO, max_m: DVec3::new(extent_m, extent_m, 1.8) };
        let detection = Detection {
            position_m: DVec2::ZERO,
            covariance_m2: None,
            z_m: 0.9,
            time_ns: 0,
            points: 30,
            limbs: None,
            reaches: Vec::new(),
            full_body: true,
            top_m: 1.8,
            top_diagonal_m: 0.2,
            aabb,
            obb: Obb::from_aabb(&aabb),
        };
        let mut width = BodyWidth::default();
        (0..frames).for_each(|_| width.see(&detection, &view, 1.8, 1.0));
        width.scale()
    }

    const FREE: BodyView = BodyView {
        on_step: false,
        returns: 30.0,
        returns_alone: 30.0,
        beams_per_m_at_top: 5.0,
        top_m: 1.8,
        beams_known: true,
    };

    #[test]
    fn wide_returns_seen_long_enough_are_of_a_stout_person() {
        let usual_m = 1.8 * (STANDING_SHARE + SHARE_PER_MPS);
        let ((few, few_sigma), (many, many_sigma)) =
            (seen(5, 1.1 * usual_m, FREE), seen(150, 1.1 * usual_m, FREE));
        assert!(few > 1.0 && few < 1.02 && few_sigma > 0.95 * PRIOR_SIGMA, "{few} {few_sigma}");
        assert!(many > 1.03 && many_sigma < 0.93 * PRIOR_SIGMA, "{many} {many_sigma}");
        assert!(seen(150, 0.9 * usual_m, FREE).0 < 0.97);
        assert!((seen(150, usual_m, FREE).0 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn half_a_body_tells_no_width() {
        let behind_another = BodyView { returns: 15.0, ..FREE };
        assert_eq!(seen(150, 0.3, behind_another), (1.0, PRIOR_SIGMA));
        assert_eq!(seen(150, 0.3, BodyView { returns: 4.0, returns_alone: 4.0, ..FREE }), (1.0, PRIOR_SIGMA));
    }
}
