//! Tells whether a track is a person or an object that was put there.

use super::followed::seconds;
use super::remembered::{Remembered, Words};
use crate::detect::Detection;
use crate::gait::WALKS_FROM_MPS;
use crate::geometry::DVec2;

/// Who has come so far from where the track began has walked: positions of furniture jump by less, as more or less of it
/// is seen.
const WALKED_M: f64 = 1.0;
/// What has never walked is furniture after this long, unless it has the shape of a person and not the place of a part of
/// other furniture: nobody stops being a person by standing still.
const FURNITURE_AFTER_S: f64 = 4.0;
/// Who stands or sits shows returns above this (a small adult sits 1.15 m high on a chair of 0.44 m, and the highest beam on
/// him may be a beam gap lower; a chair without somebody on it ends below), is not as long in plan view, and has a head on
/// top.
const PERSON_TOP_M: f64 = 1.0;
const PERSON_DIAGONAL_M: f64 = 1.0;
const HEAD_DIAGONAL_M: f64 = 0.6;

/// What first shows this near to furniture is taken for a part of it that was hidden: a large table's other end.
pub(super) const BESIDE_M: f64 = 0.9;
/// A detection that cannot be of a person counts for so many that can: of one who stands 96 of 100 can, of a cupboard up
/// to 45.
const NO_PERSON: f64 = 2.0;

/// Where a track began, and what it has shown since.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin {
    born_ns: i64,
    position_m: DVec2,
    /// Beside furniture.
    beside: bool,
    walked: bool,
    /// Detections that may be of a person, less [`NO_PERSON`] for each that cannot.
    like_person: f64,
}

impl Remembered for Origin {
    fn visit(&mut self, words: &mut impl Words) {
        words.i64(&mut self.born_ns);
        words.vec2(&mut self.position_m);
        words.bool(&mut self.beside);
        words.bool(&mut self.walked);
        words.f64(&mut self.like_person);
    }
}

impl Origin {
    pub(super) fn new(position_m: DVec2, born_ns: i64, beside: bool) -> Self {
        Self { born_ns, position_m, beside, walked: false, like_person: 0.0 }
    }

    pub(super) fn age_s(&self, time_ns: i64) -> f64 {
        seconds(self.born_ns, time_ns)
    }

    /// A detection of the track, which is now here.
    pub(super) fn see(&mut self, detection: &Detection, position_m: DVec2, speed_mps: f64) {
        self.walked |= speed_mps > WALKS_FROM_MPS && position_m.distance(self.position_m) > WALKED_M;
        let diagonal_m = detection.aabb.size_m().truncate().length();
        let may_be_person = detection.top_m > PERSON_TOP_M
            && diagonal_m < PERSON_DIAGONAL_M
            && detection.top_diagonal_m < HEAD_DIAGONAL_M;
        self.like_person += if may_be_person { 1.0 } else { -NO_PERSON };
    }

    /// True once it is taken for something that was put there.
    pub(super) fn is_furniture(&self, time_ns: i64) -> bool {
        let may_be_person = self.like_person > 0.0 && !self.beside;
        !self.walked && !may_be_person && self.age_s(time_ns) > FURNITURE_AFTER_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Aabb, DVec3, Obb};

    /// Seen ten times a second for `seconds`, with this height and these diagonals, going along x.
    fn is_furniture(seconds: i64, top_m: f64, top_diagonal_m: f64, speed_mps: f64) -> bool {
        seen(Origin::new(DVec2::ZERO, 0, false), seconds, top_m, top_diagonal_m, speed_mps)
    }

    fn seen(mut origin: Origin, seconds: i64, top_m: f64, top_diagonal_m: f64, speed_mps: f64) -> bool {
        let aabb = Aabb { min_m: DVec3::ZERO, max_m: DVec3::new(0.4, 0.3, top_m) };
        for k in 0..10 * seconds {
            let position_m = DVec2::new(0.1 * k as f64 * speed_mps, 0.0);
            let detection = Detection {
                position_m,
                covariance_m2: None,
                z_m: 0.5 * top_m,
                time_ns: k * crate::STEP_NS,
                points: 40,
                full_body: true,
                top_m,
                top_diagonal_m,
                limbs: None,
                reaches: Vec::new(),
                aabb,
                obb: Obb::from_aabb(&aabb),
            };
            origin.see(&detection, position_m, speed_mps);
        }
        origin.is_furniture(10 * seconds * crate::STEP_NS)
    }

    #[test]
    fn what_never_walks_is_furniture_unless_it_has_the_shape_of_a_person() {
        let (head, cupboard) = (0.25, 0.9);
        assert_eq!([3, 5].map(|s| is_furniture(s, 0.8, head, 0.0)), [false, true], "a chair");
        assert_eq!([3, 5].map(|s| is_furniture(s, 1.8, cupboard, 0.0)), [false, true], "a cupboard");
        assert_eq!([31, 300].map(|s| is_furniture(s, 1.8, head, 0.0)), [false; 2], "who stands");
        assert_eq!([5, 300].map(|s| is_furniture(s, 1.25, head, 0.0)), [false; 2], "who sits");
        assert!(!is_furniture(300, 1.8, head, 0.5), "who walks");
        let beside = Origin::new(DVec2::ZERO, 0, true);
        assert!(seen(beside, 5, 1.8, head, 0.0), "the hidden side of a cupboard");
        assert!(!seen(beside, 5, 1.8, head, 0.5), "who comes out from behind it");
        // Somebody crouches and creeps: speed alone does not make a person, nor does a jump of the position.
        assert!(is_furniture(5, 0.8, head, 0.15));
    }
}
