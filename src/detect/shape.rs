//! How the points of one body lie about its axis, band by band in height: in one frame, and as a track has learned it.

use crate::geometry::DVec2;

/// Bands of height above the floor; what is higher belongs to the last.
pub const BANDS: usize = 7;
const BAND_M: f64 = 0.3;

/// In which band a height lies.
pub(super) fn band_of(height_m: f64) -> usize {
    ((height_m / BAND_M).max(0.0) as usize).min(BANDS - 1)
}

/// Points of a band: how many, the sum of where they lie, and of the squares and products; a share of all after the track has learned them.
///
/// ```
/// use umbracast::{detect::Moments, geometry::DVec2};
///
/// let mut knees = Moments::default();
/// [0.4, 0.6].iter().for_each(|ahead_m| knees.add(DVec2::X * *ahead_m));
/// assert_eq!((knees.n, knees.sum_m.x), (2.0, 1.0));
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    /// How many points, or their share.
    pub n: f64,
    /// Sum of where they lie, metres.
    pub sum_m: DVec2,
    /// Sums of x^2, y^2 and x y, square metres.
    pub squares_m2: [f64; 3],
}

impl Moments {
    /// Its numbers in their order.
    pub fn numbers(&self) -> [f64; 6] {
        let Self { n, sum_m, squares_m2: [xx, yy, xy] } = *self;
        [n, sum_m.x, sum_m.y, xx, yy, xy]
    }

    /// The moments with these numbers.
    pub fn of_numbers([n, x_m, y_m, xx_m2, yy_m2, xy_m2]: [f64; 6]) -> Self {
        Self { n, sum_m: DVec2::new(x_m, y_m), squares_m2: [xx_m2, yy_m2, xy_m2] }
    }

    /// Takes a point.
    pub fn add(&mut self, at_m: DVec2) {
        self.n += 1.0;
        self.sum_m += at_m;
        let squares_m2 = [at_m.x * at_m.x, at_m.y * at_m.y, at_m.x * at_m.y];
        (0..3).for_each(|i| self.squares_m2[i] += squares_m2[i]);
    }

    /// Mean of the points and their variances along both axes.
    pub(crate) fn spread(&self) -> (DVec2, DVec2) {
        let n = self.n.max(f64::MIN_POSITIVE);
        let mean_m = self.sum_m / n;
        let square_m2 = DVec2::new(self.squares_m2[0], self.squares_m2[1]) / n;
        (mean_m, (square_m2 - mean_m * mean_m).max(DVec2::ZERO))
    }

    /// The same points moved by `by_m`, then seen from axes of which the first points along `ahead`.
    pub(crate) fn along(&self, by_m: DVec2, ahead: DVec2) -> Self {
        let [xx, yy, xy] = self.squares_m2;
        let (n, sum, by) = (self.n, self.sum_m, by_m);
        let xx = xx + 2.0 * by.x * sum.x + n * by.x * by.x;
        let yy = yy + 2.0 * by.y * sum.y + n * by.y * by.y;
        let xy = xy + by.x * sum.y + by.y * sum.x + n * by.x * by.y;
        let sum = sum + by * n;
        let (c, s) = (ahead.x, ahead.y);
        Self {
            n,
            sum_m: DVec2::new(ahead.dot(sum), ahead.perp_dot(sum)),
            squares_m2: [
                c * c * xx + 2.0 * c * s * xy + s * s * yy,
                s * s * xx - 2.0 * c * s * xy + c * c * yy,
                c * s * (yy - xx) + (c * c - s * s) * xy,
            ],
        }
    }

    /// What is left of it after a share of it is forgotten for as much of another.
    pub(crate) fn mix(&mut self, other: &Self, share: f64, of_n: f64) {
        let factor = share / of_n;
        self.n += factor * other.n - share * self.n;
        self.sum_m += other.sum_m * factor - self.sum_m * share;
        for i in 0..3 {
            self.squares_m2[i] += factor * other.squares_m2[i] - share * self.squares_m2[i];
        }
    }
}

/// A body as its track has learned it, about the axis, ahead and left.
///
/// ```
/// use umbracast::detect::Shape;
///
/// assert_eq!(Shape::default().longest_m(), 0.0, "nothing was learned");
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Shape {
    /// By band: shares of the points, their means and squares.
    pub bands: [Moments; BANDS],
}

/// Of a band that shows less, the usual body is taken.
const SHARE_MIN: f64 = 0.03;

impl Shape {
    /// Mean of a band's points, ahead and left, and their variances; nothing of a band that shows too little.
    pub(super) fn band(&self, band: usize) -> Option<(DVec2, DVec2)> {
        let of = &self.bands[band];
        (of.n > SHARE_MIN).then(|| of.spread())
    }

    /// One standard deviation of all points along the direction in which it is largest.
    pub fn longest_m(&self) -> f64 {
        let (mut n, mut sum_m, mut squares) = (0.0, DVec2::ZERO, [0.0; 3]);
        for of in &self.bands {
            n += of.n;
            sum_m += of.sum_m;
            (0..3).for_each(|i| squares[i] += of.squares_m2[i]);
        }
        if n <= 0.0 {
            return 0.0;
        }
        let mean_m = sum_m / n;
        let [xx, yy, xy] = [
            squares[0] / n - mean_m.x * mean_m.x,
            squares[1] / n - mean_m.y * mean_m.y,
            squares[2] / n - mean_m.x * mean_m.y,
        ];
        (0.5 * (xx + yy + ((xx - yy).powi(2) + 4.0 * xy * xy).sqrt())).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(points_m: &[DVec2]) -> Moments {
        let mut all = Moments::default();
        points_m.iter().for_each(|p| all.add(*p));
        all
    }

    #[test]
    fn moments_move_and_turn_as_their_points_do() {
        let points_m = [DVec2::new(0.3, -0.1), DVec2::new(-0.2, 0.4), DVec2::new(0.1, 0.2)];
        let (by_m, ahead) = (DVec2::new(0.5, -0.7), DVec2::from_angle(0.8));
        let turned = points_m.map(|p| DVec2::new(ahead.dot(p + by_m), ahead.perp_dot(p + by_m)));
        let (found, expected) = (moments(&points_m).along(by_m, ahead), moments(&turned));
        assert!(found.sum_m.distance(expected.sum_m) < 1e-12);
        let off = |i: usize| (found.squares_m2[i] - expected.squares_m2[i]).abs();
        assert!((0..3).all(|i| off(i) < 1e-12), "{found:?} {expected:?}");
    }

    #[test]
    fn a_band_of_few_points_says_nothing_and_the_longest_direction_is_any() {
        let mut shape = Shape::default();
        let diagonal = DVec2::from_angle(0.6);
        [-0.5, -0.2, 0.2, 0.5].iter().for_each(|m| shape.bands[1].add(diagonal * *m));
        shape.bands[2] = Moments { n: 0.02, ..Moments::default() };
        let expected_m = (2.0 * (0.25 + 0.04) / 4.02_f64).sqrt();
        assert!((shape.longest_m() - expected_m).abs() < 1e-9, "{}", shape.longest_m());
        assert!(shape.band(1).is_some() && shape.band(2).is_none());
        assert_eq!([0.0, 0.31, 5.0].map(band_of), [0, 1, BANDS - 1]);
    }
}
