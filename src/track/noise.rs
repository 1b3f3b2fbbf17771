//! How far a detection may be off, to the filter.

use super::gaussian::{Mat2, plus, round, scaled};
use super::height::HEIGHT_MEAN_M;
use super::numbers::Numbers;
use super::visibility::BodyView;
use crate::detect::Detection;

/// Measurement noise added where hardly anything of a person is seen, one axis: legs alone swing by 0.1 m, and where a
/// view ends the mean stays at its edge, frame after frame. None is added where half the height and half the returns of a
/// body in free sight are.
const HIDDEN_NOISE_M: f64 = 0.25;

/// Covariance of a detection's position for the filter, which follows the sway itself: what the detection tells of
/// its error counts in part; beside it a part that nothing mends, and one that falls with the share of the body that
/// is seen.
pub(super) fn noise(numbers: &Numbers, detection: &Detection, view: &BodyView) -> Mat2 {
    // 1 where hardly anything is seen, 0 from half the height and half the returns in free sight on.
    let low = 1.0 - 2.0 * detection.aabb.size_m().z / HEIGHT_MEAN_M;
    let few = match view.beams_known {
        true => 1.0 - 2.0 * f64::from(detection.points) / view.returns_alone.max(f64::MIN_POSITIVE),
        false => 0.0,
    };
    // The same where others hide more than half of the body: what is left to see lies to one side of it.
    let covered = match view.beams_known {
        true => 1.0 - 2.0 * view.returns / view.returns_alone.max(f64::MIN_POSITIVE),
        false => 0.0,
    };
    let hidden = low.max(few).max(covered).max(0.0);
    let claimed = detection.covariance_m2.unwrap_or_default();
    let lasting = numbers.noise_floor_m.powi(2) + (HIDDEN_NOISE_M * hidden).powi(2);
    plus(scaled(claimed, numbers.noise_share), round(lasting))
}

/// Covariance of a swaying body about the person's way, of a phase and direction that are not known.
pub(super) fn sway(numbers: &Numbers) -> Mat2 {
    let [left_m, ahead_m] = numbers.sway_m;
    round(0.5 * (left_m.powi(2) + ahead_m.powi(2)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;
    use crate::geometry::{Aabb, DVec3};

    /// Variance for the filter of a whole body's height with so many returns, where a body in free sight gives 40.
    fn variance_m2(points: u32, beams_known: bool) -> f64 {
        let numbers = Numbers::new(&Config::default().track);
        let view = BodyView { returns: 40.0, returns_alone: 40.0, beams_known, ..BodyView::default() };
        noise(&numbers, &whole_body(points), &view)[0][0]
    }

    fn whole_body(points: u32) -> Detection {
        let aabb = Aabb { min_m: DVec3::ZERO, max_m: DVec3::new(0.4, 0.4, HEIGHT_MEAN_M) };
        Detection { points, ..Detection::of_box(aabb) }
    }

    #[test]
    fn few_returns_of_who_stands_behind_others_are_hardly_believed() {
        assert_eq!(variance_m2(20, true), variance_m2(40, true));
        assert!(
            variance_m2(8, true) > 4.0 * variance_m2(20, true),
            "{} {}",
            variance_m2(8, true),
            variance_m2(20, true)
        );
        assert!(variance_m2(2, true) > variance_m2(8, true));
    }

    #[test]
    fn what_others_leave_to_see_of_a_body_is_hardly_believed() {
        let numbers = Numbers::new(&Config::default().track);
        let view = |returns: f64| BodyView {
            returns,
            returns_alone: 40.0,
            beams_known: true,
            ..BodyView::default()
        };
        let covered = [40.0, 25.0, 5.0].map(|returns| noise(&numbers, &whole_body(40), &view(returns))[0][0]);
        assert!(covered[0] == covered[1] && covered[2] > 4.0 * covered[0], "{covered:?}");
    }

    #[test]
    fn few_returns_of_unknown_beams_are_believed_for_nobody_knows_how_many_there_should_be() {
        assert_eq!(variance_m2(8, false), variance_m2(40, false));
    }
}
