//! How far samples lie from their mean, in any direction.

use super::lanes::{larger, smaller};
use crate::geometry::DVec2;
use std::f64::consts::FRAC_1_SQRT_2;

/// Most of x, x + y, y, y - x and of their opposites over samples of a plane.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Spread {
    most_m: [f64; 8],
    /// No sample is farther away.
    pub(crate) radius_m: f64,
}

/// More than single precision takes from a distance of metres.
const ROUNDED_M: f64 = 1e-6;
/// Cosine of a sixteenth of a turn.
const COS_SIXTEENTH: f64 = 0.923_879_532_511_286_7;

/// A unit vector put together from the two of the eight directions beside it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Between {
    straight: usize,
    diagonal: usize,
    /// How much of each.
    off: f64,
    share: f64,
}

impl Between {
    #[inline(always)]
    pub(super) fn of(direction: DVec2) -> Self {
        let (x, y) = (direction.x.abs(), direction.y.abs());
        let (right, up) = (direction.x >= 0.0, direction.y >= 0.0);
        let diagonal = match (right, up) {
            (true, true) => 1,
            (false, true) => 3,
            (false, false) => 5,
            (true, false) => 7,
        };
        let (straight, off, share) = match x > y {
            true => (if right { 0 } else { 4 }, x - y, y),
            false => (if up { 2 } else { 6 }, y - x, x),
        };
        Self { straight, diagonal, off, share }
    }
}

impl Spread {
    #[inline(always)]
    pub(super) fn of(x_m: &[f32], y_m: &[f32]) -> Self {
        const LANES: usize = 8;
        let (mut least, mut most) = ([[0.0_f32; LANES]; 4], [[0.0_f32; LANES]; 4]);
        let (x8, y8) = (x_m.chunks_exact(LANES), y_m.chunks_exact(LANES));
        let rest = x8.remainder().iter().zip(y8.remainder());
        let mut take = |i: usize, x: f32, y: f32| {
            for (axis, along) in [x, x + y, y, y - x].into_iter().enumerate() {
                least[axis][i] = smaller(least[axis][i], along);
                most[axis][i] = larger(most[axis][i], along);
            }
        };
        for (x, y) in x8.zip(y8) {
            (0..LANES).for_each(|i| take(i, x[i], y[i]));
        }
        rest.for_each(|(x, y)| take(0, *x, *y));
        let of_all = |lanes: [f32; LANES]| f64::from(lanes.into_iter().fold(0.0, larger)) + ROUNDED_M;
        let (most, least) = (most.map(of_all), least.map(|lanes| of_all(lanes.map(|along| -along))));
        let most_m: [f64; 8] = std::array::from_fn(|i| if i < 4 { most[i] } else { least[i - 4] });
        // A corner of the octagon lies beyond its sides by a sixteenth of a turn.
        let side_m = |(i, most_m): (usize, &f64)| most_m * if i % 2 == 0 { 1.0 } else { FRAC_1_SQRT_2 };
        let farthest_m = most_m.iter().enumerate().map(side_m).fold(0.0, f64::max);
        Self { most_m, radius_m: farthest_m / COS_SIXTEENTH }
    }

    /// No sample lies farther along a direction nor, second, along its opposite.
    #[inline(always)]
    pub(super) fn both_ways_m(&self, direction: &Between) -> [f64; 2] {
        let Between { straight, diagonal, off, share } = *direction;
        [0, 4].map(|turned| {
            let most_m = |i: usize| self.most_m[(i + turned) % 8];
            off * most_m(straight) + share * most_m(diagonal)
        })
    }

    /// The first of them.
    #[cfg(test)]
    fn along_m(&self, direction: DVec2) -> f64 {
        self.both_ways_m(&Between::of(direction))[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_sample_lies_beyond_and_one_lies_near() {
        let points: Vec<DVec2> = (0..70)
            .map(|i| DVec2::from_angle(f64::from(i) * 2.4) * DVec2::new(0.05, 0.01) * f64::from(i))
            .collect();
        let coordinate = |of: fn(&DVec2) -> f64| points.iter().map(|p| of(p) as f32).collect::<Vec<_>>();
        let spread = Spread::of(&coordinate(|p| p.x), &coordinate(|p| p.y));
        for i in 0..100 {
            let direction = DVec2::from_angle(f64::from(i) * 0.3);
            let farthest = points.iter().map(|p| p.dot(direction)).fold(0.0, f64::max);
            let bound = spread.along_m(direction);
            assert!(farthest <= bound && bound < 1.3 * farthest, "{i}: {farthest}, {bound}");
        }
        let radius = points.iter().map(|p| p.length()).fold(0.0, f64::max);
        assert!(radius <= spread.radius_m && spread.radius_m < 1.2 * radius);
    }
}
