//! How arms and legs lie relative to each other, which shows the phase of the stride.
//!
//! With the right foot ahead and the left one behind, legs lie along one diagonal seen from above; arms, which swing
//! against them, along the other one. Half a stride later it is the other way round. The measurement is the product
//! of a point's distance ahead and to the left, as the mean over the arms less the mean over the legs. It varies with
//! the cosine of the phase, once in each stride, whichever side the sensors see.

use super::{Point, Prior};
use crate::gait::WALKS_FROM_MPS;
use crate::geometry::DVec3;

/// Legs without feet, then arms with the trunk between, as shares of the height.
const LEGS_UP: std::ops::Range<f64> = 0.05..0.40;
const ARMS_UP: std::ops::Range<f64> = 0.40..0.72;
/// With so many points half of what there is to see is believed.
const POINTS_AT_HALF: f64 = 3.0;

/// Covariance of ahead and left over arms and legs in one frame.
///
/// ```
/// use umbracast::detect::LimbCovariance;
///
/// let right_foot_ahead = LimbCovariance { arms_less_legs_m2: 0.012, seen: 0.8 };
/// assert!(right_foot_ahead.arms_less_legs_m2 > 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimbCovariance {
    /// Mean of ahead times left, arms less legs, m^2.
    pub arms_less_legs_m2: f64,
    /// Share of it that so many points show.
    pub seen: f64,
}

impl LimbCovariance {
    /// Of the points of `who`, whose axis stands at `feet_m`; nothing of who stands still.
    #[doc(hidden)] // The measurer calls it.
    pub fn of<'a>(points: impl Iterator<Item = &'a Point>, feet_m: DVec3, who: &Prior) -> Option<Self> {
        if who.velocity_mps.length() < WALKS_FROM_MPS {
            return None;
        }
        let ahead = who.velocity_mps.normalize();
        let (mut legs, mut arms) = ((0.0, 0.0), (0.0, 0.0));
        for point in points {
            let up = (point.position_m.z - feet_m.z) / who.height_m;
            let part = if LEGS_UP.contains(&up) {
                &mut legs
            } else if ARMS_UP.contains(&up) {
                &mut arms
            } else {
                continue;
            };
            let off_m = (point.position_m - feet_m).truncate();
            part.0 += ahead.dot(off_m) * ahead.perp_dot(off_m);
            part.1 += 1.0;
        }
        let shown = |n: f64| n / (n + POINTS_AT_HALF);
        let mean = |(sum, n): (f64, f64)| sum / (n + POINTS_AT_HALF);
        let seen = 0.5 * (shown(legs.1) + shown(arms.1));
        (seen > 0.0).then(|| Self { arms_less_legs_m2: mean(arms) - mean(legs), seen })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec2;

    const WHO: Prior = Prior {
        position_m: DVec2::ZERO,
        velocity_mps: DVec2::new(0.0, 1.2),
        position_sigma_m: 0.1,
        height_m: 1.75,
        confirmed: true,
        walked: false,
        is_furniture: false,
        shape: None,
    };

    /// A walker along y at a phase: feet under the hips, hands beside them, each a point, a swing apart.
    fn limbs_at(phase_rad: f64, who: &Prior) -> Option<LimbCovariance> {
        let limb = |left: f64, ahead: f64, up_m: f64| Point {
            position_m: DVec3::new(-left, ahead, up_m),
            time_ns: 0,
            sensor: 0,
        };
        let wave = phase_rad.cos();
        let points = [
            limb(-0.1, 0.3 * wave, 0.3),
            limb(0.1, -0.3 * wave, 0.3),
            limb(-0.2, -0.2 * wave, 0.8),
            limb(0.2, 0.2 * wave, 0.8),
            limb(0.0, 0.1, 1.6),
        ];
        LimbCovariance::of(points.iter(), DVec3::ZERO, who)
    }

    #[test]
    fn the_covariance_goes_with_the_cosine_of_the_phase() {
        let at = |phase_rad: f64| limbs_at(phase_rad, &WHO).unwrap().arms_less_legs_m2;
        let most = at(0.0);
        assert!(most > 0.01, "{most}");
        for k in 0..16 {
            let phase_rad = std::f64::consts::TAU * f64::from(k) / 16.0;
            assert!((at(phase_rad) - most * phase_rad.cos()).abs() < 1e-12, "{phase_rad}");
        }
    }

    #[test]
    fn who_stands_shows_none_and_few_points_show_little() {
        assert_eq!(limbs_at(0.0, &Prior { velocity_mps: DVec2::ZERO, ..WHO }), None);
        let seen = limbs_at(0.0, &WHO).unwrap().seen;
        assert!((seen - 0.4).abs() < 1e-12, "two points of legs and two of arms: {seen}");
    }
}
