//! The body of one track as frames in which it stands alone show it.

use super::remembered::{Remembered, Words};
use crate::detect::{BANDS, Moments, Shape};
use crate::geometry::DVec2;

/// So many frames tell what a body is like; from then on the newest are worth one of so many.
const FRAMES_MIN: u32 = 10;
const FRAMES: u32 = 40;

/// What was learned, and from how many frames.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LearnedShape {
    shape: Shape,
    frames: u32,
}

impl Remembered for LearnedShape {
    fn visit(&mut self, words: &mut impl Words) {
        words.u32(&mut self.frames);
        for of in &mut self.shape.bands {
            words.f64(&mut of.n);
            words.vec2(&mut of.sum_m);
            words.f64s(&mut of.squares_m2);
        }
    }
}

impl LearnedShape {
    /// Takes a frame's points, which lie about a place that is so far from the axis of who faces `ahead`.
    pub(super) fn see(&mut self, bands: &[Moments; BANDS], from_axis_m: DVec2, ahead: DVec2) {
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
}

#[cfg(test)]
mod tests {
    use super::*;

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
            learned.see(&bands, -DVec2::X * 0.1, ahead);
        }
        let of = learned.known().expect("a second").bands[3];
        let mean_m = of.sum_m / of.n;
        assert!(mean_m.distance(DVec2::new(0.4, 0.0)) < 1e-9 && (of.n - 1.0).abs() < 1e-9, "{of:?}");
    }
}
