//! Where somebody faces: along his way, and while he stands as his body shows.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::gaussian::State;
use super::remembered::{Remembered, Words};
use crate::detect::Facing;
use crate::gait::WALKS_FROM_MPS;

/// Variance of a heading that may be any: even over a turn.
const ANY_HEADING_RAD2: f64 = std::f64::consts::PI * std::f64::consts::PI / 3.0;
/// How fast who stands may turn away from the last heading: 40 degrees (one sigma) in a second. A guess: nothing
/// that is measured here tells it.
const STANDING_TURN_RAD2PS: f64 = 0.5;

/// Probability of either way where both are alike.
const EITHER: f64 = 0.5;
/// Frames show the same body in nearly the same pose: so much of what one tells of its heading is new.
const NEW_IN_A_FRAME: f64 = 0.2;
/// However long a body is looked at, it may be one of those that look alike from the front and from behind: no look makes the
/// opposite less likely than this.
const BEHIND_MIN: f64 = 0.03;
/// Two such logarithms add up to a number that can be.
const LOG_MAX: f64 = 300.0;

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

    /// Learns from which way the body seems to face while somebody stands.
    pub(super) fn see(&mut self, facing: &Facing, speed_mps: f64) {
        if speed_mps > WALKS_FROM_MPS {
            return;
        }
        let off_rad = turned(facing.heading_rad - self.mean_rad);
        // It may be the opposite that lies near to the mean.
        let (is_near, off_rad) = match off_rad.abs() <= FRAC_PI_2 {
            true => (true, off_rad),
            false => (false, turned(off_rad + PI)),
        };
        let log_odds = NEW_IN_A_FRAME * if is_near { facing.log_odds } else { -facing.log_odds };
        let said_rad2 = facing.variance_rad2 / NEW_IN_A_FRAME;
        let (is_known, spread_rad2) = (self.variance_rad2 < ANY_HEADING_RAD2, self.variance_rad2 + said_rad2);
        // How much likelier the way that lies nearer to the mean is, if the mean is right.
        let log_ratio = match is_known {
            true => 0.5 * ((PI - off_rad.abs()).powi(2) - off_rad.powi(2)) / spread_rad2,
            false => 0.0,
        };
        let ratio = log_ratio.min(LOG_MAX).exp();
        let near = ((1.0 - self.behind) * ratio + self.behind) * log_odds.clamp(-LOG_MAX, LOG_MAX).exp();
        let far = (1.0 - self.behind) + self.behind * ratio;
        self.behind = (far / (near + far)).max(self.behind.min(BEHIND_MIN));
        if is_known {
            self.mean_rad += off_rad * self.variance_rad2 / spread_rad2;
            self.variance_rad2 *= said_rad2 / spread_rad2;
        } else {
            self.mean_rad += off_rad;
            self.variance_rad2 = said_rad2.min(ANY_HEADING_RAD2);
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Stands for so many steps and seems to face in directions that turn by so much each.
    fn stand(heading: &mut Heading, first_rad: f64, turn_rad: f64, steps: u32, log_odds: f64) {
        for step in 0..steps {
            heading.variance_rad2 =
                (heading.variance_rad2 + STANDING_TURN_RAD2PS * 0.1).min(ANY_HEADING_RAD2);
            let heading_rad = first_rad + turn_rad * f64::from(step);
            heading.see(&Facing { heading_rad, variance_rad2: 0.02, log_odds }, 0.0);
        }
    }

    #[test]
    fn a_body_that_looks_alike_from_both_sides_may_face_either_way() {
        let mut heading = Heading::ANY;
        stand(&mut heading, 1.9, 0.0, 10, 0.0);
        let off_rad = (heading.mean_rad - 1.9).rem_euclid(PI);
        assert!(off_rad.min(PI - off_rad) < 1e-9, "{heading:?}");
        assert!(heading.behind == EITHER && heading.sigma_rad() < 0.3, "{heading:?}");
    }

    #[test]
    fn who_never_walked_is_known_by_and_by_to_face_as_the_body_shows_and_never_for_sure() {
        let mut heading = Heading::ANY;
        stand(&mut heading, -2.0, 0.0, 3, 1.0);
        assert!((0.3..0.45).contains(&heading.behind), "{heading:?}");
        stand(&mut heading, -2.0, 0.0, 100, 1.0);
        assert!((heading.mean_rad + 2.0).abs() < 0.01 && heading.behind == BEHIND_MIN, "{heading:?}");
        // One look from where nothing is seen of the face does not turn anybody round.
        stand(&mut heading, -2.0 + PI, 0.0, 1, 1.0);
        assert!((heading.mean_rad + 2.0).abs() < 0.01 && heading.behind < 0.1, "{heading:?}");
    }

    #[test]
    fn who_walked_and_turns_on_the_spot_is_known_to_face_the_same_way_still() {
        let mut heading = Heading { mean_rad: 0.0, variance_rad2: 0.05, behind: 0.0 };
        // Three quarters of a turn in nine seconds.
        stand(&mut heading, 0.0, 1.5 * PI / 90.0, 91, 0.0);
        let off_rad = (heading.mean_rad + FRAC_PI_2).abs();
        assert!(off_rad < 0.15 && heading.behind < 1e-3, "{heading:?}");
    }

    /// A body seen too sharply made the probability of the opposite no number.
    #[test]
    fn no_look_is_too_sharp() {
        let mut heading = Heading { mean_rad: 0.0, variance_rad2: 1e-6, behind: 0.0 };
        for heading_rad in [0.1, 3.0] {
            heading.see(&Facing { heading_rad, variance_rad2: 1e-9, log_odds: 1e9 }, 0.0);
            assert!((0.0..=0.5).contains(&heading.behind) && heading.mean_rad.is_finite(), "{heading:?}");
        }
    }

    #[test]
    fn who_was_long_out_of_sight_may_have_turned_round() {
        let mut heading = Heading { mean_rad: 0.0, variance_rad2: 1.5, behind: 0.0 };
        heading.see(&Facing { heading_rad: 0.2, variance_rad2: 0.02, log_odds: 0.0 }, 0.0);
        assert!((0.01..0.2).contains(&heading.behind), "{heading:?}");
    }
}
