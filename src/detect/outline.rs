//! How far a body reaches toward a sensor and to either side of it, level by level, as one frame shows it.

use super::Point;
use crate::geometry::{DVec2, DVec3};

/// Parts of a body, one above another.
pub const LEVELS: usize = 5;
/// Their upper ends as shares of the height: shanks, thighs and hips, waist, shoulders, neck and head.
pub const LEVEL_TOPS: [f64; LEVELS] = [0.30, 0.539, 0.751, 0.83, 1.05];
/// Fewer returns of a level have no edges.
const RETURNS_MIN: u32 = 3;

/// What one sensor saw of one level of a body, from the detection's position.
///
/// ```
/// use umbracast::{detect::Reach, geometry::DVec2};
///
/// let chest = Reach { sensor: 0, level: 2, away: DVec2::X, near_m: 0.13, left_m: 0.22, right_m: 0.21, returns: 9 };
/// assert!(chest.left_m + chest.right_m > 0.4, "as wide as shoulders");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Which sensor of the site.
    pub sensor: u16,
    /// Which of [`LEVELS`].
    pub level: usize,
    /// Unit vector of the line of sight in plan view.
    pub away: DVec2,
    /// Toward the sensor.
    pub near_m: f64,
    /// To the left of the line of sight.
    pub left_m: f64,
    /// To the right of it.
    pub right_m: f64,
    /// How many returns.
    pub returns: u32,
}

/// Looks at the points of somebody `height_m` tall whose axis stood at `feet_m` at `time_ns`, and who moved on by `velocity_mps`.
/// Points of one sensor follow each other, or else the sensor comes twice. What it finds is added to `all`.
#[doc(hidden)] // The measurer calls it.
pub fn reaches<'a>(
    points: impl Iterator<Item = &'a Point> + Clone,
    sensors_m: &[DVec3],
    feet_m: DVec3,
    time_ns: i64,
    height_m: f64,
    velocity_mps: DVec2,
    all: &mut Vec<Reach>,
) {
    let mut rest = points.peekable();
    while let Some(&&Point { sensor, position_m, .. }) = rest.peek() {
        let seen_from = sensors_m.get(usize::from(sensor)).copied().unwrap_or(position_m);
        let away = (feet_m - seen_from).truncate().normalize_or(DVec2::X);
        let blank = |level: usize| Reach {
            sensor,
            level,
            away,
            near_m: f64::MIN,
            left_m: f64::MIN,
            right_m: f64::MIN,
            returns: 0,
        };
        let mut levels: [Reach; LEVELS] = std::array::from_fn(blank);
        while let Some(point) = rest.next_if(|point| point.sensor == sensor) {
            let up = (point.position_m.z - feet_m.z) / height_m;
            let Some(level) = LEVEL_TOPS.iter().position(|top| up < *top) else { continue };
            let late_s = (point.time_ns - time_ns) as f64 * 1e-9;
            let off_m = (point.position_m - feet_m).truncate() - velocity_mps * late_s;
            let reach = &mut levels[level];
            reach.near_m = reach.near_m.max(-off_m.dot(away));
            reach.left_m = reach.left_m.max(off_m.dot(away.perp()));
            reach.right_m = reach.right_m.max(-off_m.dot(away.perp()));
            reach.returns += 1;
        }
        all.extend(levels.into_iter().filter(|reach| reach.returns >= RETURNS_MIN));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sensor in the west sees an arm of somebody at the origin stretched out to the north, at the height of the chest.
    #[test]
    fn an_arm_to_one_side_is_a_reach_to_that_side_of_its_level() {
        let point = |x: f64, y: f64, z: f64| Point { position_m: DVec3::new(x, y, z), time_ns: 0, sensor: 0 };
        let chest = [-0.2, -0.1, 0.0, 0.1, 0.2, 0.5].map(|y| point(-0.12, y, 1.1));
        let thighs = [-0.1, 0.0, 0.1].map(|y| point(-0.08, y, 0.7));
        let head = [point(0.0, 0.0, 1.7); 2];
        let points: Vec<Point> = chest.into_iter().chain(thighs).chain(head).collect();
        let mut seen = Vec::new();
        let sensors_m = [DVec3::new(-10.0, 0.0, 3.0)];
        reaches(points.iter(), &sensors_m, DVec3::ZERO, 0, 1.75, DVec2::ZERO, &mut seen);
        let levels: Vec<usize> = seen.iter().map(|reach| reach.level).collect();
        assert_eq!(levels, [1, 2], "two returns are no head");
        let [thighs, chest] = [seen[0], seen[1]];
        assert!((chest.left_m - 0.5).abs() < 1e-12 && (chest.right_m - 0.2).abs() < 1e-12, "{chest:?}");
        assert!((chest.near_m - 0.12).abs() < 1e-12 && (thighs.left_m - 0.1).abs() < 1e-12, "{thighs:?}");
    }

    /// A walker whom a second sensor meets 50 ms later reaches no farther for it.
    #[test]
    fn returns_of_a_walker_are_taken_back_to_one_time() {
        let velocity_mps = DVec2::new(0.0, 1.2);
        let late = |y: f64, time_ns: i64| Point { position_m: DVec3::new(-0.1, y, 1.1), time_ns, sensor: 0 };
        let points = [late(-0.2, 0), late(0.0, 0), late(0.26, 50_000_000)];
        let mut seen = Vec::new();
        reaches(points.iter(), &[DVec3::new(-10.0, 0.0, 3.0)], DVec3::ZERO, 0, 1.75, velocity_mps, &mut seen);
        assert!((seen[0].left_m - 0.2).abs() < 1e-12, "{seen:?}");
    }
}
