//! Where somebody faces: along his way, and while he stands across his shoulders.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::gaussian::State;
use super::remembered::{Remembered, Words};
use super::visibility::BodyView;
use crate::detect::Detection;
use crate::gait::WALKS_FROM_MPS;
use crate::geometry::Obb;

/// Variance of a heading that may be any: even over a turn.
const ANY_HEADING_RAD2: f64 = std::f64::consts::PI * std::f64::consts::PI / 3.0;
/// How fast who stands may turn away from the last heading: 40 degrees (one sigma) in a second. A guess: nothing
/// that is measured here tells it.
const STANDING_TURN_RAD2PS: f64 = 0.5;

/// Returns of a standing body this much longer than wide (the difference of the squares over their sum) lie along its
/// shoulders; and they tell how these lie so well, one standard deviation. Measured on simulated people in `config/sites/l-hall.toml`:
/// 4 to 8 degrees from 0.3 on, no more than chance below.
const SHOULDERS_FROM: f64 = 0.3;
const SHOULDERS_RAD2: f64 = 0.17 * 0.17;
/// Where others hide more of a body, or so few returns are, its shoulders are not looked for.
const SHOULDERS_FREE: f64 = 0.9;
const SHOULDERS_POINTS: u32 = 12;

/// Probability of either way where both are alike.
const EITHER: f64 = 0.5;

/// Where a trunk faces, counter-clockwise from +x.
#[derive(Debug, Clone, Copy)]
pub(super) struct Heading {
    pub(super) mean_rad: f64,
    variance_rad2: f64,
    /// Probability that it is the other way, with the same variance.
    pub(super) behind: f64,
}

impl Remembered for Heading {
    fn visit(&mut self, words: &mut impl Words) {
        words.f64(&mut self.mean_rad);
        words.f64(&mut self.variance_rad2);
        words.f64(&mut self.behind);
    }
}

impl Heading {
    /// Of who has never walked.
    pub(super) const ANY: Self = Self { mean_rad: 0.0, variance_rad2: ANY_HEADING_RAD2, behind: 0.0 };

    /// The heading follows the velocity of who walks; who stands may turn on the spot.
    pub(super) fn follow(&mut self, state: &State, step_s: f64) {
        let v = state.velocity_mps();
        if v.length() > WALKS_FROM_MPS {
            self.mean_rad = v.y.atan2(v.x);
            self.variance_rad2 = state.heading_variance_rad2();
            self.behind = 0.0;
        } else {
            self.variance_rad2 += STANDING_TURN_RAD2PS * step_s;
        }
        self.variance_rad2 = self.variance_rad2.min(ANY_HEADING_RAD2);
    }

    /// Learns from the shoulders of who stands, where they can be seen.
    pub(super) fn see(&mut self, detection: &Detection, view: &BodyView, speed_mps: f64) {
        let is_free = view.returns >= SHOULDERS_FREE * view.returns_alone;
        let can_tell = speed_mps <= WALKS_FROM_MPS && is_free && detection.points >= SHOULDERS_POINTS;
        if let Some(along_rad) = shoulders_rad(&detection.obb).filter(|_| can_tell) {
            self.face_across(along_rad);
        }
    }

    /// Faces one way or the other across a line.
    fn face_across(&mut self, along_rad: f64) {
        let off_rad = (along_rad + FRAC_PI_2 - self.mean_rad + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2;
        if self.variance_rad2 >= ANY_HEADING_RAD2 {
            let mean_rad = turned(self.mean_rad + off_rad);
            *self = Self { mean_rad, variance_rad2: SHOULDERS_RAD2, behind: EITHER };
            return;
        }
        let spread_rad2 = self.variance_rad2 + SHOULDERS_RAD2;
        // How much likelier the way that lies nearer to the mean is, if the mean is right.
        let ratio = (0.5 * ((PI - off_rad.abs()).powi(2) - off_rad.powi(2)) / spread_rad2).exp();
        let near = (1.0 - self.behind) * ratio + self.behind;
        let far = (1.0 - self.behind) + self.behind * ratio;
        self.behind = far / (near + far);
        self.mean_rad += off_rad * self.variance_rad2 / spread_rad2;
        self.variance_rad2 *= SHOULDERS_RAD2 / spread_rad2;
        if self.behind > EITHER {
            (self.mean_rad, self.behind) = (self.mean_rad + PI, 1.0 - self.behind);
        }
        self.mean_rad = turned(self.mean_rad);
    }

    pub(super) fn sigma_rad(&self) -> f64 {
        self.variance_rad2.sqrt()
    }
}

/// From -pi to pi.
fn turned(rad: f64) -> f64 {
    (rad + PI).rem_euclid(TAU) - PI
}

/// Along which line returns lie, if they do along any.
fn shoulders_rad(obb: &Obb) -> Option<f64> {
    let [long, wide] = [obb.half_m.x, obb.half_m.y];
    let axis = if long >= wide { obb.site_from_box.x_axis } else { obb.site_from_box.y_axis };
    let (long2, wide2) = (long * long, wide * wide);
    ((long2 - wide2).abs() > SHOULDERS_FROM * (long2 + wide2)).then(|| axis.y.atan2(axis.x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{DMat3, DVec3};

    /// Shoulders that lie along this line, so long and wide.
    fn shoulders(along_rad: f64, half_m: [f64; 2]) -> Obb {
        Obb {
            center_m: DVec3::ZERO,
            half_m: DVec3::new(half_m[0], half_m[1], 0.85),
            site_from_box: DMat3::from_rotation_z(along_rad),
        }
    }

    /// Stands for so many steps with shoulders along lines that turn by so much each.
    fn stand(heading: &mut Heading, first_rad: f64, turn_rad: f64, steps: u32) {
        for step in 0..steps {
            heading.variance_rad2 =
                (heading.variance_rad2 + STANDING_TURN_RAD2PS * 0.1).min(ANY_HEADING_RAD2);
            heading.face_across(first_rad + turn_rad * f64::from(step));
        }
    }

    #[test]
    fn who_never_walked_faces_either_way_across_the_shoulders_wherever_the_hall_s_middle_is() {
        let mut heading = Heading::ANY;
        stand(&mut heading, 0.3, 0.0, 10);
        let off_rad = (heading.mean_rad - 0.3 - FRAC_PI_2).rem_euclid(PI);
        assert!(off_rad.min(PI - off_rad) < 1e-9, "{heading:?}");
        assert!(heading.behind == EITHER && heading.sigma_rad() < 0.2, "{heading:?}");
    }

    #[test]
    fn who_walked_and_turns_on_the_spot_is_known_to_face_the_same_way_still() {
        let mut heading = Heading { mean_rad: 0.0, variance_rad2: 0.05, behind: 0.0 };
        // Three quarters of a turn in nine seconds.
        stand(&mut heading, FRAC_PI_2, 1.5 * PI / 90.0, 91);
        let off_rad = (heading.mean_rad + FRAC_PI_2).abs();
        assert!(off_rad < 0.15 && heading.behind < 1e-3, "{heading:?}");
    }

    #[test]
    fn who_was_long_out_of_sight_may_have_turned_round() {
        let mut heading = Heading { mean_rad: 0.0, variance_rad2: 1.5, behind: 0.0 };
        heading.face_across(FRAC_PI_2);
        assert!((0.01..0.2).contains(&heading.behind), "{heading:?}");
    }

    #[test]
    fn shoulders_lie_along_what_is_long_and_what_is_round_has_none() {
        let along = |obb: Obb| shoulders_rad(&obb).map(|rad| rad.rem_euclid(PI));
        assert!((along(shoulders(0.4, [0.25, 0.12])).unwrap() - 0.4).abs() < 1e-12);
        assert!((along(shoulders(0.4, [0.12, 0.25])).unwrap() - 0.4 - FRAC_PI_2).abs() < 1e-12);
        assert_eq!(shoulders_rad(&shoulders(0.4, [0.2, 0.17])), None);
    }
}
