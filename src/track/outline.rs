//! The outline of one body, learned by watching: how much farther than a usual body it reaches ahead, behind and to both sides,
//! level by level.
//!
//! A sensor shows, in one frame, how far the body reaches toward it and to either side of its line of sight. As the person
//! walks and turns, all sides come into sight. What is carried before, behind or beside a body, a bag, a raised arm, a wheelchair,
//! becomes a part of the outline; limbs that swing are in it as they are on the mean.
//!
//! At each level, the outline reaches `r0 + r2 cos 2 psi + ahead cos psi + left sin psi` farther than usual in the direction
//! `psi` from the heading: the first terms of a Fourier series, of which those of an ellipse are nearly all.
//!
//! Numbers: `models/outline.toml`, by `umbracast train outline`.

use serde::{Deserialize, Serialize};

use super::remembered::{Remembered, Words};
use crate::Error;
use crate::detect::{LEVELS, Reach};
use crate::geometry::DVec2;

/// Ahead, left, round, oblong: how the outline of a level differs from the usual one, metres.
pub type LevelOutline = [f64; 4];

/// What reaches of usual bodies are, as shares of the height, how they vary from frame to frame, and from person to person.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UsualOutline {
    /// From the floor up.
    pub levels: Vec<UsualLevel>,
}

/// One level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UsualLevel {
    /// Factors of [`terms`] for the reach toward a sensor, as shares of the height.
    pub near: [f64; TERMS],
    /// The same to either side of the line of sight.
    pub aside: [f64; TERMS],
    /// One standard deviation of both from frame to frame, metres.
    pub near_sigma_m: f64,
    /// See `near_sigma_m`.
    pub aside_sigma_m: f64,
    /// One standard deviation of [`LevelOutline`] from person to person, metres.
    pub person_sigma_m: LevelOutline,
}

/// How many numbers the usual reach in a direction has.
pub const TERMS: usize = 6;

/// What the usual reach in a direction `cos` from the heading is made of, at a speed over hip height.
pub fn terms(cos: f64, relative_speed_hz: f64) -> [f64; TERMS] {
    let cos2 = 2.0 * cos * cos - 1.0;
    [1.0, cos, cos2, relative_speed_hz, relative_speed_hz * cos, relative_speed_hz * cos2]
}

/// The outline's share in the reach in a direction from the heading.
pub fn shares(cos: f64, sin: f64) -> LevelOutline {
    [cos, sin, 1.0, 2.0 * cos * cos - 1.0]
}

/// The axis of a body when it was seen.
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    /// Where it stood less where the detection says.
    pub from_detection_m: DVec2,
    /// Unit vector of the heading.
    pub ahead: DVec2,
}

/// Directions in which one level was seen, each as cosine and sine from the heading, with the reach from the axis, metres:
/// toward the sensor, to the left, to the right. Between two columns lies the edge, half a gap farther than the last return.
pub fn measured(reach: &Reach, axis: &Axis, gap_m: f64) -> [(f64, f64, f64); 3] {
    let of = |toward: DVec2, reach_m: f64| {
        let from_axis_m = reach_m - axis.from_detection_m.dot(toward);
        (axis.ahead.dot(toward), axis.ahead.perp_dot(toward), from_axis_m)
    };
    let left = reach.away.perp();
    [
        of(-reach.away, reach.near_m),
        of(left, reach.left_m + 0.5 * gap_m),
        of(-left, reach.right_m + 0.5 * gap_m),
    ]
}

impl UsualOutline {
    /// The one that is embedded in the program.
    pub fn shipped() -> Self {
        Self::parse(include_str!("../../models/outline.toml")).expect("the embedded file is proven by a test")
    }

    fn parse(text: &str) -> Result<Self, Error> {
        let usual: Self = toml::from_str(text).map_err(|e| Error::new(format!("usual outline: {e}")))?;
        match usual.levels.len() {
            LEVELS => Ok(usual),
            found => Err(Error::new(format!("usual outline: expected {LEVELS} levels, found {found}"))),
        }
    }
}

/// Frames follow each other faster than limbs swing: as many in a row count as one.
const FRAMES_ALIKE: f64 = 4.0;
/// People who carry nothing are most, so what is carried lies so many deviations off.
const PERSON_SIGMAS: f64 = 2.0;
/// What somebody carries is put down or taken up within about this time.
const LASTS_S: f64 = 30.0;
/// A reach so many deviations off is believed no more than one at this limit: it may be somebody else's.
const DEVIATIONS_MAX: f64 = 3.0;

/// What was learned of one body.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    levels: [Level; LEVELS],
}

/// Mean and covariance of a [`LevelOutline`].
#[derive(Debug, Clone, Copy)]
struct Level {
    mean_m: LevelOutline,
    covariance_m2: [[f64; 4]; 4],
}

impl Remembered for Outline {
    fn visit(&mut self, words: &mut impl Words) {
        for level in &mut self.levels {
            words.f64s(&mut level.mean_m);
            level.covariance_m2.iter_mut().for_each(|row| words.f64s(row));
        }
    }
}

impl Outline {
    /// Of somebody of whom nothing was seen.
    pub(super) fn new(usual: &UsualOutline) -> Self {
        Self { levels: std::array::from_fn(|level| Level::new(&usual.levels[level])) }
    }

    /// How it differs from the usual one.
    pub(super) fn levels_m(&self) -> [LevelOutline; LEVELS] {
        self.levels.map(|level| level.mean_m)
    }

    /// Time passes.
    pub(super) fn age(&mut self, usual: &UsualOutline, step_s: f64) {
        for (level, usual) in self.levels.iter_mut().zip(&usual.levels) {
            for (i, sigma_m) in usual.person_sigma_m.iter().enumerate() {
                level.covariance_m2[i][i] += (PERSON_SIGMAS * sigma_m).powi(2) * step_s / LASTS_S;
            }
        }
    }

    /// Takes one level in one frame, of a body `height_m` tall at a speed over hip height.
    pub(super) fn see(
        &mut self,
        usual: &UsualOutline,
        reach: &Reach,
        axis: &Axis,
        gap_m: f64,
        (height_m, relative_speed_hz): (f64, f64),
    ) {
        let (level, usual) = (&mut self.levels[reach.level], &usual.levels[reach.level]);
        for (i, (cos, sin, reach_m)) in measured(reach, axis, gap_m).into_iter().enumerate() {
            let (factors, sigma_m) =
                if i == 0 { (&usual.near, usual.near_sigma_m) } else { (&usual.aside, usual.aside_sigma_m) };
            let shares_of_height: f64 =
                terms(cos, relative_speed_hz).iter().zip(factors).map(|(a, b)| a * b).sum();
            level.correct(
                shares(cos, sin),
                reach_m - height_m * shares_of_height,
                FRAMES_ALIKE * sigma_m * sigma_m,
            );
        }
    }
}

impl Level {
    fn new(usual: &UsualLevel) -> Self {
        let mut covariance_m2 = [[0.0; 4]; 4];
        for (i, sigma_m) in usual.person_sigma_m.iter().enumerate() {
            covariance_m2[i][i] = (PERSON_SIGMAS * sigma_m).powi(2);
        }
        Self { mean_m: [0.0; 4], covariance_m2 }
    }

    /// A Kalman filter's correction by one number that is the sum of the mean's parts by `shares`.
    fn correct(&mut self, shares: LevelOutline, off_m: f64, variance_m2: f64) {
        let covariance = self.covariance_m2;
        let along: [f64; 4] = std::array::from_fn(|i| dot(&covariance[i], &shares));
        let spread_m2 = dot(&along, &shares) + variance_m2;
        let limit_m = DEVIATIONS_MAX * spread_m2.sqrt();
        let innovation_m = (off_m - dot(&self.mean_m, &shares)).clamp(-limit_m, limit_m);
        for i in 0..4 {
            self.mean_m[i] += along[i] / spread_m2 * innovation_m;
            for j in 0..4 {
                self.covariance_m2[i][j] -= along[i] * along[j] / spread_m2;
            }
        }
    }
}

fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten seconds of a walker along x whom two sensors see level by level, each reach that of a usual body and `more`, by level and
    /// the direction's cosine and sine.
    fn watched(more: impl Fn(usize, f64, f64) -> f64) -> Outline {
        let usual = UsualOutline::shipped();
        let mut outline = Outline::new(&usual);
        let axis = Axis { from_detection_m: DVec2::ZERO, ahead: DVec2::X };
        for frame in 0..100 {
            outline.age(&usual, 0.1);
            for (sensor, turn_rad) in [(0, 0.02), (1, 0.025)] {
                let away = DVec2::from_angle(1.0 + turn_rad * f64::from(frame) + 2.0 * f64::from(sensor));
                for (level, of) in usual.levels.iter().enumerate() {
                    let reach = |toward: DVec2, factors: &[f64; TERMS]| {
                        let share: f64 = terms(toward.x, 1.3).iter().zip(factors).map(|(a, b)| a * b).sum();
                        1.75 * share + more(level, toward.x, toward.y)
                    };
                    let (near_m, left, right) = (reach(-away, &of.near), away.perp(), -away.perp());
                    let (left_m, right_m) = (reach(left, &of.aside), reach(right, &of.aside));
                    let seen =
                        Reach { sensor: sensor as u16, level, away, near_m, left_m, right_m, returns: 9 };
                    outline.see(&usual, &seen, &axis, 0.0, (1.75, 1.3));
                }
            }
        }
        outline
    }

    #[test]
    fn a_usual_body_stays_one() {
        assert!(watched(|_, _, _| 0.0).levels_m().as_flattened().iter().all(|m| m.abs() < 1e-9));
    }

    #[test]
    fn a_bag_at_one_side_becomes_a_part_of_that_level_and_side() {
        // 0.15 m on the left of the hips, as an ellipse that is moved and grows has it: half of it moves, half grows aside.
        let outline = watched(|level, cos, sin| match level {
            1 => shares(cos, sin).iter().zip([0.0, 0.075, 0.0375, -0.0375]).map(|(a, b)| a * b).sum(),
            _ => 0.0,
        });
        let [ahead, left, round, oblong] = outline.levels_m()[1];
        let to_the_left_m = left + round - oblong;
        assert!((0.12..0.16).contains(&to_the_left_m) && ahead.abs() < 0.02, "{:?}", outline.levels_m());
        assert!((left - round + oblong).abs() < 0.03, "nothing on the right");
        assert!(outline.levels_m()[3].iter().all(|m| m.abs() < 1e-9), "nor at the shoulders");
    }

    #[test]
    fn somebody_else_s_returns_in_one_frame_change_little() {
        let usual = UsualOutline::shipped();
        let mut outline = watched(|_, _, _| 0.0);
        let axis = Axis { from_detection_m: DVec2::ZERO, ahead: DVec2::X };
        let far = Reach {
            sensor: 0,
            level: 2,
            away: DVec2::X,
            near_m: 0.15,
            left_m: 0.9,
            right_m: 0.2,
            returns: 20,
        };
        outline.see(&usual, &far, &axis, 0.0, (1.75, 1.3));
        let [_, left, ..] = outline.levels_m()[2];
        assert!(left < 0.06, "{left}");
    }

    #[test]
    fn a_file_without_every_level_is_refused() {
        let text = include_str!("../../models/outline.toml");
        let message =
            UsualOutline::parse(&text[..text.rfind("[[levels]]").unwrap()]).unwrap_err().to_string();
        assert!(message.contains("expected 5 levels, found 4"), "{message}");
    }
}
