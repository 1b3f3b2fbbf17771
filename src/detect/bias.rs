//! Where a body's axis stands, given the points that were seen of it.
//!
//! What is seen is the side toward the sensors, and legs and arms swing. So every point first moves away from its
//! own sensor by a constant; the rest is a linear model of what the points look like and where the person walks,
//! in a frame along the line of sight. Its coefficients were fitted on simulated returns by
//! `cargo run --release -p umbracast-eval --example fit_bias`: error of a single frame 0.038 m on scenes of their
//! own (all presets and pairs), 0.046 m with the constant alone, 0.083 m for the mean of the points.

use super::Point;
use crate::geometry::{DVec2, DVec3};

/// Features along the line of sight.
pub const ALONG: usize = 9;
/// Features across it: all change sign when the scene is mirrored.
pub const ACROSS: usize = 7;
/// From the shifted mean to the body axis, away from the sensor, metres a unit of each feature.
const AWAY: [f64; ALONG] = [0.0054, -0.1760, -0.0130, -0.0093, -0.0122, -0.0741, -0.0494, 0.0043, 0.0010];
/// The same, to the left as the sensor sees it.
const LEFT: [f64; ACROSS] = [0.4527, 0.5074, -0.0169, -0.1439, 0.0038, 0.0490, -0.0823];
/// A cluster that is no single body shall not be moved about.
const LIMIT_M: f64 = 0.12;
/// Upper ends of feet, legs and trunk as shares of the height that was seen; the head is above.
const BANDS: [f64; 3] = [0.25, 0.5, 0.82];
/// The part whose extent tells more than its mean.
const TRUNK: std::ops::Range<f64> = 0.5..0.86;

/// A person's points as the linear model sees them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Mean of the points, each moved away from its sensor.
    pub base_m: DVec2,
    /// Unit vector along the mean line of sight of the sensor that saw more.
    pub away: DVec2,
    /// Features along it.
    pub along: [f64; ALONG],
    /// Features across it.
    pub across: [f64; ACROSS],
}

impl View {
    /// Looks at a person's points, given with the horizontal unit vector from the sensor to each. `heading` is the
    /// direction of walking where it is known.
    pub fn new<'a>(
        points: impl Iterator<Item = (&'a Point, DVec2)> + Clone,
        shift_m: f64,
        heading: Option<DVec2>,
    ) -> Self {
        let moved =
            points.clone().map(|(p, away)| (p.position_m.truncate() + away * shift_m, p.position_m.z));
        let n = points.clone().count().max(1) as f64;
        let base_m = moved.clone().map(|(q, _)| q).sum::<DVec2>() / n;
        let (away, other_share) = main_direction(points.clone());
        let left = away.perp();
        let top_m = points.clone().map(|(p, _)| p.position_m.z).fold(0.0, f64::max);
        let mean_z_m = points.map(|(p, _)| p.position_m.z).sum::<f64>() / n;

        let mut bands = [(DVec2::ZERO, 0.0); BANDS.len() + 1];
        let mut whole = Span::default();
        let mut trunk = Span::default();
        for (q, z_m) in moved {
            let off = q - base_m;
            let off = DVec2::new(off.dot(away), off.dot(left));
            let share = z_m / top_m;
            let band = &mut bands[BANDS.iter().filter(|&&upper| share >= upper).count()];
            band.0 += off;
            band.1 += 1.0;
            whole.add(off);
            if TRUNK.contains(&share) {
                trunk.add(off);
            }
        }
        let [feet, legs, body, head] = bands.map(|(sum, n)| if n > 0.0 { sum / n } else { DVec2::ZERO });
        let (cos, sin) = heading.map_or((0.0, 0.0), |h| (h.dot(away), h.dot(left)));
        let (cos_2, sin_2) = (cos * cos - sin * sin, 2.0 * cos * sin);
        Self {
            base_m,
            away,
            along: [
                1.0,
                whole.middle().x,
                cos,
                cos_2,
                feet.x,
                trunk.deviation_x(),
                cos_2 * (mean_z_m - 1.0),
                trunk.middle().x,
                other_share * cos_2,
            ],
            across: [body.y, head.y, sin, whole.middle().y, sin_2, legs.y, trunk.middle().y],
        }
    }

    /// Ground point of the body axis.
    pub fn position_m(&self) -> DVec2 {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let off = self.away * dot(&AWAY, &self.along) + self.away.perp() * dot(&LEFT, &self.across);
        self.base_m + off.clamp_length_max(LIMIT_M)
    }
}

/// Mean line of sight of the sensor that saw more, and the share of the points the others saw.
fn main_direction<'a>(points: impl Iterator<Item = (&'a Point, DVec2)> + Clone) -> (DVec2, f64) {
    let of = |sensor: u16| points.clone().filter(move |(p, _)| p.sensor == sensor);
    let n = points.clone().count();
    let mut main = (0, 0);
    let mut last = None;
    for (point, _) in points.clone() {
        if last.replace(point.sensor) == Some(point.sensor) {
            continue;
        }
        let seen = of(point.sensor).count();
        if seen > main.1 || (seen == main.1 && point.sensor < main.0) {
            main = (point.sensor, seen);
        }
    }
    let sum: DVec2 = of(main.0).map(|(_, away)| away).sum();
    (sum.normalize_or(DVec2::X), 1.0 - main.1 as f64 / n.max(1) as f64)
}

/// Extent and deviation of a group of points.
#[derive(Default)]
struct Span {
    points: f64,
    min: DVec2,
    max: DVec2,
    sum_x: f64,
    squares_x: f64,
}

impl Span {
    fn add(&mut self, p: DVec2) {
        (self.min, self.max) = if self.points == 0.0 { (p, p) } else { (self.min.min(p), self.max.max(p)) };
        self.points += 1.0;
        self.sum_x += p.x;
        self.squares_x += p.x * p.x;
    }

    /// Middle of the extent; zero for fewer than two points.
    fn middle(&self) -> DVec2 {
        if self.points < 2.0 { DVec2::ZERO } else { (self.min + self.max) * 0.5 }
    }

    fn deviation_x(&self) -> f64 {
        if self.points < 2.0 {
            return 0.0;
        }
        let mean = self.sum_x / self.points;
        (self.squares_x / self.points - mean * mean).max(0.0).sqrt()
    }
}

/// Horizontal unit vector from a sensor to a point.
pub fn away(sensors_m: &[DVec3], point: &Point) -> DVec2 {
    let sensor = sensors_m.get(usize::from(point.sensor));
    sensor.map_or(DVec2::ZERO, |s| (point.position_m - s).truncate().normalize_or_zero())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSOR_M: DVec3 = DVec3::new(-10.0, 0.0, 8.0);

    fn position_m(corners: &[(f64, f64, f64)], heading: DVec2) -> DVec2 {
        let points: Vec<Point> = corners
            .iter()
            .map(|&(x, y, z)| Point { position_m: DVec3::new(x, y, z), time_ns: 0, sensor: 0 })
            .collect();
        View::new(points.iter().map(|p| (p, away(&[SENSOR_M], p))), 0.1, Some(heading)).position_m()
    }

    #[test]
    fn a_mirrored_person_stands_at_the_mirrored_place() {
        let person = [(0.0, 0.1, 0.1), (0.1, -0.2, 0.9), (0.0, 0.25, 1.1), (0.05, 0.0, 1.3), (0.0, 0.1, 1.7)];
        let mirrored = person.map(|(x, y, z)| (x, -y, z));
        let (a, b) =
            (position_m(&person, DVec2::from_angle(0.4)), position_m(&mirrored, DVec2::from_angle(-0.4)));
        assert!(a.y.abs() > 0.01, "{a}");
        assert!((a.x - b.x).abs() < 1e-12 && (a.y + b.y).abs() < 1e-12, "{a} {b}");
    }

    #[test]
    fn the_axis_lies_behind_the_side_that_was_seen() {
        let front: Vec<(f64, f64, f64)> =
            (0..20).map(|i| (0.0, 0.02 * f64::from(i) - 0.19, 0.09 * f64::from(i))).collect();
        let found = position_m(&front, DVec2::X);
        assert!((0.04..0.2).contains(&found.x), "{found}");
    }
}
