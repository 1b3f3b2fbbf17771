//! The body of one track as frames in which it stands alone show it.

use super::remembered::{Remembered, Words};
use crate::detect::{BANDS, Detection, Moments, Overhead, Shape};
use crate::geometry::DVec2;

/// What somebody carries over the head, such as an umbrella: a dome over a disc that turns with the body.
///
/// ```
/// use umbracast::{geometry::DVec2, track::Canopy};
///
/// let umbrella = Canopy { center_m: DVec2::new(0.1, 0.1), radius_m: 0.5, low_m: 1.85, top_m: 2.0 };
/// assert!(umbrella.top_m > umbrella.low_m);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Canopy {
    /// Its middle, ahead of the axis and left of it.
    pub center_m: DVec2,
    /// The disc's.
    pub radius_m: f64,
    /// Height of the rim above the floor,
    pub low_m: f64,
    /// and of the top.
    pub top_m: f64,
}

impl Canopy {
    /// Its numbers in their order.
    pub fn numbers(&self) -> [f64; 5] {
        let Self { center_m, radius_m, low_m, top_m } = *self;
        [center_m.x, center_m.y, radius_m, low_m, top_m]
    }

    /// The canopy with these numbers.
    pub fn of_numbers([ahead_m, left_m, radius_m, low_m, top_m]: [f64; 5]) -> Self {
        Self { center_m: DVec2::new(ahead_m, left_m), radius_m, low_m, top_m }
    }
}

/// So many frames tell what a body is like; from then on the newest are worth one of so many.
const FRAMES_MIN: u32 = 10;
const FRAMES: u32 = 40;

/// What was learned, and from how many frames.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LearnedShape {
    shape: Shape,
    frames: u32,
    overhead: Overhead,
    /// How many frames more showed something overhead than did not.
    covered: u32,
}

impl Remembered for LearnedShape {
    fn visit(&mut self, words: &mut impl Words) {
        words.u32(&mut self.frames);
        words.u32(&mut self.covered);
        words.f64(&mut self.overhead.low_m);
        words.f64(&mut self.overhead.top_m);
        for of in self.shape.bands.iter_mut().chain([&mut self.overhead.points]) {
            let mut numbers = of.numbers();
            words.f64s(&mut numbers);
            *of = Moments::of_numbers(numbers);
        }
    }
}

impl LearnedShape {
    /// Takes a frame's points of who faces `ahead`, and what hangs over them.
    pub(super) fn see(&mut self, detection: &Detection, axis_m: DVec2, ahead: DVec2) {
        let from_axis_m = detection.position_m - axis_m;
        self.see_body(&detection.bands, from_axis_m, ahead);
        let Some(Overhead { points, low_m, top_m }) = detection.overhead else {
            self.covered = self.covered.saturating_sub(1);
            return;
        };
        self.covered = (self.covered + 1).min(FRAMES);
        let (share, learned) = (1.0 / f64::from(self.covered), &mut self.overhead);
        learned.points.mix(&points.along(from_axis_m, ahead), share, points.n);
        learned.low_m += (low_m - learned.low_m) * share;
        learned.top_m += (top_m - learned.top_m) * share;
    }

    /// Takes points that lie about a place which is so far from the axis.
    fn see_body(&mut self, bands: &[Moments; BANDS], from_axis_m: DVec2, ahead: DVec2) {
        let n: f64 = bands.iter().map(|of| of.n).sum();
        if n <= 0.0 {
            return;
        }
        self.frames = (self.frames + 1).min(FRAMES);
        let share = 1.0 / f64::from(self.frames);
        for (learned, of) in self.shape.bands.iter_mut().zip(bands) {
            learned.mix(&of.along(from_axis_m, ahead), share, n);
        }
    }

    /// The body, once enough was seen.
    pub(super) fn known(&self) -> Option<Shape> {
        (self.frames >= FRAMES_MIN).then_some(self.shape)
    }

    /// What is carried over the head, the same. Points that fill a disc of radius 1 have a variance of 1/4 along each axis; of one that is
    /// seen from one side all the time, only the axis across tells how wide it is.
    pub(super) fn canopy(&self) -> Option<Canopy> {
        let Overhead { points, low_m, top_m } = self.overhead;
        let (center_m, variance_m2) = points.spread();
        let radius_m = 2.0 * variance_m2.max_element().sqrt();
        (self.covered >= FRAMES_MIN).then_some(Canopy { center_m, radius_m, low_m, top_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Aabb, DVec3};

    #[test]
    fn a_body_is_known_after_a_second_and_turns_with_its_heading() {
        let mut learned = LearnedShape::default();
        let mut bands = [Moments::default(); BANDS];
        for k in 0..FRAMES_MIN {
            assert!(learned.known().is_none());
            let ahead = DVec2::from_angle(0.3 * f64::from(k));
            // Something is carried 0.4 m ahead of the axis, which stands 0.1 m to the east of where the detection says.
            bands[3] = Moments::default();
            [0.38, 0.42].iter().for_each(|m| bands[3].add(ahead * *m + DVec2::X * 0.1));
            learned.see_body(&bands, -DVec2::X * 0.1, ahead);
        }
        assert!(learned.canopy().is_none(), "nothing hung over it");
        let of = learned.known().expect("a second").bands[3];
        let mean_m = of.sum_m / of.n;
        assert!(mean_m.distance(DVec2::new(0.4, 0.0)) < 1e-9 && (of.n - 1.0).abs() < 1e-9, "{of:?}");
    }

    #[test]
    fn an_umbrella_is_known_after_a_second_and_forgotten_when_it_is_closed() {
        let mut learned = LearnedShape::default();
        let mut points = Moments::default();
        // A disc of 0.5 m, 0.1 m to the left of who faces north.
        for i in 0..2000 {
            let share = f64::from(i) / 2000.0;
            points.add(DVec2::from_angle(2.4 * f64::from(i)) * 0.5 * share.sqrt() - DVec2::X * 0.1);
        }
        let bare = Detection::of_box(Aabb { min_m: DVec3::ZERO, max_m: DVec3::new(0.4, 0.4, 1.7) });
        let under = Detection { overhead: Some(Overhead { points, low_m: 1.8, top_m: 2.0 }), ..bare.clone() };
        for _ in 0..FRAMES_MIN {
            assert!(learned.canopy().is_none());
            learned.see(&under, DVec2::ZERO, DVec2::Y);
        }
        let found = learned.canopy().expect("a second");
        assert!(found.center_m.distance(DVec2::Y * 0.1) < 0.01, "{found:?}");
        assert!((found.radius_m - 0.5).abs() < 0.02 && (found.low_m, found.top_m) == (1.8, 2.0), "{found:?}");
        learned.see(&bare, DVec2::ZERO, DVec2::Y);
        assert!(learned.canopy().is_none());
    }
}
