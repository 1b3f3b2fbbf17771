//! Tells whether a track is a person or an object that was put there.

use super::followed::seconds;
use super::remembered::{Remembered, Words};
use super::visibility::BodyView;
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

/// What gives less than this share of the returns that it gave before, although others hide no more than the rest, is what is left of
/// an object that the background learns: its edges.
const LEFT_SHARE: f64 = 0.25;
const FREE_SHARE: f64 = 0.5;
/// So much is taken to have been seen of everybody.
const MOST_SHARE: f64 = 0.4;
/// What never walked is furniture when it has been no more than that for so long.
const LEFT_AFTER_S: f64 = 0.5;

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
    pub(super) walked: bool,
    /// The largest share of a body's returns that a detection had.
    most_share: f64,
    /// For how long it has been what is left of an object.
    left_s: f64,
    /// Detections that may be of a person, less [`NO_PERSON`] for each that cannot.
    like_person: f64,
}

impl Remembered for Origin {
    fn visit(&mut self, words: &mut impl Words) {
        words.i64(&mut self.born_ns);
        words.vec2(&mut self.position_m);
        words.bool(&mut self.beside);
        words.bool(&mut self.walked);
        words.f64(&mut self.most_share);
        words.f64(&mut self.left_s);
        words.f64(&mut self.like_person);
    }
}

impl Origin {
    pub(super) fn new(position_m: DVec2, born_ns: i64, beside: bool) -> Self {
        Self {
            born_ns,
            position_m,
            beside,
            walked: false,
            most_share: MOST_SHARE,
            left_s: 0.0,
            like_person: 0.0,
        }
    }

    pub(super) fn age_s(&self, time_ns: i64) -> f64 {
        seconds(self.born_ns, time_ns)
    }

    /// A detection of the track, which is now here.
    pub(super) fn see(
        &mut self,
        detection: &Detection,
        view: &BodyView,
        position_m: DVec2,
        speed_mps: f64,
        step_s: f64,
    ) {
        let share = f64::from(detection.points) / view.returns.max(f64::MIN_POSITIVE);
        let is_free = view.beams_known && view.returns > FREE_SHARE * view.returns_alone;
        let is_left = is_free && share < LEFT_SHARE * self.most_share;
        if is_free {
            self.most_share = self.most_share.max(share.min(1.0));
        }
        self.walked |=
            !is_left && speed_mps > WALKS_FROM_MPS && position_m.distance(self.position_m) > WALKED_M;
        let diagonal_m = detection.aabb.size_m().truncate().length();
        // What seems to hang over it may be its own top: a cupboard's.
        let may_be_person = !is_left
            && detection.overhead.is_none()
            && detection.top_m > PERSON_TOP_M
            && diagonal_m < PERSON_DIAGONAL_M
            && detection.top_diagonal_m < HEAD_DIAGONAL_M;
        self.like_person += if may_be_person { 1.0 } else { -NO_PERSON };
        self.left_s = if is_left { self.left_s + step_s } else { 0.0 };
        if self.left_s > FURNITURE_AFTER_S {
            (self.walked, self.like_person) = (false, 0.0);
        }
    }

    /// True once it is taken for something that was put there.
    pub(super) fn is_furniture(&self, time_ns: i64) -> bool {
        let may_be_person = self.like_person > 0.0 && !self.beside;
        let is_left = self.left_s > LEFT_AFTER_S;
        !self.walked && (is_left || !may_be_person && self.age_s(time_ns) > FURNITURE_AFTER_S)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::Overhead;
    use crate::geometry::{Aabb, DVec3};

    /// Seen ten times a second for `seconds`, with this height and these diagonals, going along x.
    fn is_furniture(seconds: i64, top_m: f64, top_diagonal_m: f64, speed_mps: f64) -> bool {
        seen(Origin::new(DVec2::ZERO, 0, false), seconds, top_m, top_diagonal_m, speed_mps)
    }

    fn of(aabb: Aabb, top_m: f64, top_diagonal_m: f64) -> Detection {
        Detection { top_m, top_diagonal_m, ..Detection::of_box(aabb) }
    }

    fn seen(mut origin: Origin, seconds: i64, top_m: f64, top_diagonal_m: f64, speed_mps: f64) -> bool {
        let aabb = Aabb { min_m: DVec3::ZERO, max_m: DVec3::new(0.4, 0.3, top_m) };
        for k in 0..10 * seconds {
            let position_m = DVec2::new(0.1 * k as f64 * speed_mps, 0.0);
            let detection =
                Detection { position_m, time_ns: k * crate::STEP_NS, ..of(aabb, top_m, top_diagonal_m) };
            origin.see(&detection, &BodyView::default(), position_m, speed_mps, crate::STEP_S);
        }
        origin.is_furniture(10 * seconds * crate::STEP_NS)
    }

    /// A track slid along the edges that the background had not learned of a lorry, and had walked.
    #[test]
    fn what_is_left_of_an_object_has_not_walked() {
        let mut origin = Origin::new(DVec2::ZERO, 0, false);
        let mut see = |points: u32, x_m: f64| {
            let view =
                BodyView { returns: 60.0, returns_alone: 60.0, beams_known: true, ..BodyView::default() };
            let aabb = Aabb { min_m: DVec3::ZERO, max_m: DVec3::new(0.4, 0.3, 1.7) };
            let detection = Detection { points, ..of(aabb, 1.7, 0.25) };
            origin.see(&detection, &view, DVec2::new(x_m, 0.0), 0.5, 0.1);
            (origin.walked, origin.is_furniture(crate::STEP_NS))
        };
        assert_eq!((0..10).map(|_| see(50, 0.0)).last(), Some((false, false)));
        assert_eq!((0..10).map(|k| see(4, 0.2 * f64::from(k))).last(), Some((false, true)));
        // Somebody is seen whole again, and was a person all the time.
        assert_eq!(see(50, 1.5), (true, false));
        assert_eq!(
            (0..45).map(|_| see(4, 1.5)).last(),
            Some((false, true)),
            "it jumped before it was learned"
        );
    }

    /// A cupboard's top was left out as a canopy, and its two sides below it were people for good.
    #[test]
    fn what_stands_below_its_own_top_is_furniture_and_who_came_under_an_umbrella_is_none() {
        let aabb = Aabb { min_m: DVec3::ZERO, max_m: DVec3::new(0.4, 0.3, 1.65) };
        let is_furniture = |speed_mps: f64| {
            let mut origin = Origin::new(DVec2::ZERO, 0, false);
            for k in 0..60 {
                let position_m = DVec2::new(0.1 * f64::from(k) * speed_mps, 0.0);
                let covered =
                    Detection { overhead: Some(Overhead::default()), position_m, ..of(aabb, 1.65, 0.25) };
                origin.see(&covered, &BodyView::default(), position_m, speed_mps, crate::STEP_S);
            }
            origin.is_furniture(60 * crate::STEP_NS)
        };
        assert_eq!([0.0, 0.5].map(is_furniture), [true, false]);
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
