//! What the sensors saw of one body, as the network reads it that finds its pose.
//!
//! Sensors see the near side of a body, and legs and arms swing. Every point therefore first moves away from its own
//! sensor by a constant, and along the person's path to the mean time of all points. [`super::point_network`] does the rest,
//! from how the points lie in a frame along the line of sight.

use std::f64::consts::PI;

use super::Point;
use crate::gait::WALKS_FROM_MPS;
use crate::geometry::{DVec2, DVec3};

/// The network looks at no more points than this.
pub const POINTS: usize = 32;
/// Numbers of a point.
pub const OF_POINT: usize = 5;
/// Numbers of the whole body.
pub const OF_BODY: usize = 7;

/// Where [`PoseView::of_body`] has the height and the speed.
const TOP: usize = 3;
const SPEED: usize = 5;

/// A person's points as the network sees them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseView {
    /// Mean of the points, each moved away from its sensor.
    pub base_m: DVec2,
    /// Unit vectors along the mean line of sight of the sensor that saw more, and across it: to the side to which the person
    /// walks, so that a person and his mirror image look alike.
    pub along: DVec2,
    pub across: DVec2,
    /// Its mean range in tens of metres, how far it looks down, how few points there are, how high they reach, the person's
    /// direction of walking (0 for who stands) along and across, and the speed.
    pub of_body: [f32; OF_BODY],
    /// Where each point lies off the base along and across, its height, and its own line of sight along and across.
    of_points: [[f32; OF_POINT]; POINTS],
    n: usize,
}

/// A point that has been moved.
#[derive(Debug, Clone)]
pub struct Seen {
    pub(super) at_m: DVec2,
    /// Above the floor.
    pub(super) z_m: f64,
    /// Horizontal, from the sensor.
    away: DVec2,
    range_m: f64,
    sensor: u16,
}

impl PoseView {
    /// Looks at a person's points, who stands on a floor at `floor_m`. `velocity_mps` is the person's, where it is known. Appends the
    /// points, moved, to `seen`.
    pub fn new<'a>(
        seen: &mut Vec<Seen>,
        points: impl Iterator<Item = &'a Point> + Clone,
        sensors_m: &[DVec3],
        floor_m: f64,
        shift_m: f64,
        velocity_mps: Option<DVec2>,
    ) -> Self {
        let before = seen.len();
        seen.extend(moved(points, sensors_m, floor_m, shift_m, velocity_mps));
        let seen = &seen[before..];
        let n = seen.len().max(1) as f64;
        let base_m = seen.iter().map(|s| s.at_m).sum::<DVec2>() / n;
        let main = main_sensor(seen);
        let of_main = || seen.iter().filter(|s| s.sensor == main);
        let along = of_main().map(|s| s.away).sum::<DVec2>().normalize_or(DVec2::X);
        let range_m = of_main().map(|s| s.range_m).sum::<f64>() / of_main().count().max(1) as f64;
        let above_m = sensors_m.get(usize::from(main)).map_or(0.0, |s| s.z - floor_m);
        let top_m = seen.iter().map(|s| s.z_m).fold(f64::MIN_POSITIVE, f64::max);
        let speed_mps = velocity_mps.map_or(0.0, DVec2::length);
        let walks = speed_mps > WALKS_FROM_MPS;
        let ahead = velocity_mps.filter(|_| walks).map_or(DVec2::ZERO, |v| v / speed_mps);
        // Of who stands, the side to which the upper body lies.
        let leans = || seen.iter().map(|s| (s.at_m - base_m) * s.z_m).sum();
        let sideways = if walks { ahead } else { leans() }.dot(along.perp());
        let across = if sideways < 0.0 { -along.perp() } else { along.perp() };
        let framed = |v: DVec2| [v.dot(along) as f32, v.dot(across) as f32];
        let of_point = |s: &Seen| {
            let ([x, y], [away_x, away_y]) = (framed(s.at_m - base_m), framed(s.away));
            [x, y, s.z_m as f32, away_x, away_y]
        };
        let n_looked = seen.len().min(POINTS);
        let mut of_points = [[0.0; OF_POINT]; POINTS];
        for (k, of) in of_points[..n_looked].iter_mut().enumerate() {
            *of = of_point(&seen[k * seen.len() / n_looked]);
        }
        let [ahead_x, ahead_y] = framed(ahead);
        Self {
            base_m,
            along,
            across,
            of_body: [
                (0.1 * range_m) as f32,
                (above_m / range_m.max(1.0)) as f32,
                (5.0 / n.sqrt()) as f32,
                top_m as f32,
                ahead_x,
                speed_mps as f32,
                ahead_y,
            ],
            of_points,
            n: n_looked,
        }
    }

    /// Whether its person is not known to walk.
    pub fn stands(&self) -> bool {
        f64::from(self.of_body[SPEED]) <= WALKS_FROM_MPS
    }

    /// What the mirror adds to the phase of a stride: half a turn, for left and right have changed sides.
    pub fn phase_of_mirror_rad(&self) -> f64 {
        if self.is_mirrored() { PI } else { 0.0 }
    }

    /// What is on the left and on the right of the person, as the view has it, or of the view, as the person has it.
    pub fn sides<T: Copy>(&self, [left, right]: [T; 2]) -> [T; 2] {
        if self.is_mirrored() { [right, left] } else { [left, right] }
    }

    fn is_mirrored(&self) -> bool {
        self.across.dot(self.along.perp()) < 0.0
    }

    /// Somebody of the same shape who is so many times as large.
    #[must_use]
    pub fn scaled(mut self, share: f32) -> Self {
        self.of_body[TOP] *= share;
        self.of_points.iter_mut().flat_map(|of| &mut of[..3]).for_each(|coordinate| *coordinate *= share);
        self
    }

    /// The points that are looked at: [`POINTS`] of a cluster's, evenly, or all.
    pub fn of_points(&self) -> &[[f32; OF_POINT]] {
        &self.of_points[..self.n]
    }
}

/// Each point where it would have been met at the mean time of all, moved from the skin toward the axis.
fn moved<'a>(
    points: impl Iterator<Item = &'a Point> + Clone,
    sensors_m: &[DVec3],
    floor_m: f64,
    shift_m: f64,
    velocity_mps: Option<DVec2>,
) -> impl Iterator<Item = Seen> {
    let n = points.clone().count().max(1) as f64;
    let first_ns = points.clone().map(|p| p.time_ns).min().unwrap_or_default();
    let late_s = move |p: &Point| (p.time_ns - first_ns) as f64 * 1e-9;
    let mean_s = points.clone().map(late_s).sum::<f64>() / n;
    let velocity_mps = velocity_mps.unwrap_or_default();
    points.map(move |p| {
        let at_m = p.position_m.truncate() - velocity_mps * (late_s(p) - mean_s);
        let sensor = sensors_m.get(usize::from(p.sensor));
        let sight_m = sensor.map_or(DVec2::ZERO, |s| at_m - s.truncate());
        let away = sight_m.normalize_or_zero();
        Seen {
            at_m: at_m + away * shift_m,
            z_m: p.position_m.z - floor_m,
            away,
            range_m: sight_m.length(),
            sensor: p.sensor,
        }
    })
}

/// The sensor that saw most of the points; of equals the first.
fn main_sensor(seen: &[Seen]) -> u16 {
    let points_of = |sensor: u16| seen.iter().filter(|s| s.sensor == sensor).count();
    let mut main = (0, 0);
    for (i, s) in seen.iter().enumerate() {
        if i > 0 && seen[i - 1].sensor == s.sensor {
            continue;
        }
        let points = points_of(s.sensor);
        if points > main.1 || (points == main.1 && s.sensor < main.0) {
            main = (s.sensor, points);
        }
    }
    main.0
}

/// Horizontal unit vector from a sensor to a point.
pub fn away(sensors_m: &[DVec3], point: &Point) -> DVec2 {
    let sensor = sensors_m.get(usize::from(point.sensor));
    sensor.map_or(DVec2::ZERO, |s| (point.position_m - s).truncate().normalize_or_zero())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::pose::{self, Pose};

    const SENSOR_M: DVec3 = DVec3::new(-10.0, 0.0, 8.0);
    const PERSON: [(f64, f64, f64); 5] =
        [(0.0, 0.1, 0.1), (0.1, -0.2, 0.9), (0.0, 0.25, 1.1), (0.05, 0.0, 1.3), (0.0, 0.1, 1.7)];

    fn points(corners: &[(f64, f64, f64)]) -> Vec<Point> {
        let point = |&(x, y, z)| Point { position_m: DVec3::new(x, y, z), time_ns: 0, sensor: 0 };
        corners.iter().map(point).collect()
    }

    fn view_of(points: &[Point], velocity_mps: DVec2) -> PoseView {
        PoseView::new(&mut Vec::new(), points.iter(), &[SENSOR_M], 0.0, 0.1, Some(velocity_mps))
    }

    fn pose_of(points: &[Point], velocity_mps: DVec2) -> Pose {
        pose::poses(&pose::shipped(), &[view_of(points, velocity_mps)]).next().unwrap()
    }

    #[test]
    fn somebody_mirrored_has_a_mirrored_pose() {
        let mirrored = points(&PERSON.map(|(x, y, z)| (x, -y, z)));
        let (a, b) =
            (pose_of(&points(&PERSON), DVec2::from_angle(0.4)), pose_of(&mirrored, DVec2::from_angle(-0.4)));
        assert!(a.position_m.y.abs() > 0.01, "{a:?}");
        assert!(a.position_m.distance(b.position_m * DVec2::new(1.0, -1.0)) < 1e-12, "{a:?} {b:?}");
        let [a_rad, b_rad] = [a, b].map(|pose| pose.gait.unwrap().phase_rad);
        assert!(((a_rad - b_rad).abs() - PI).abs() < 1e-12, "the other foot: {a_rad} {b_rad}");

        let [a, b] = [points(&PERSON), mirrored]
            .map(|points| pose_of(&points, DVec2::ZERO).facing.unwrap().heading_rad);
        assert!((a + b).abs() < 1e-12 && a.abs() > 0.01, "{a} {b}");
    }

    #[test]
    fn a_body_has_the_same_pose_in_any_company() {
        let views: Vec<PoseView> = (0..7)
            .map(|k| {
                let corners = PERSON.map(|(x, y, z)| (x + 0.02 * f64::from(k), y, z));
                view_of(&points(&corners), DVec2::from_angle(f64::from(k)))
            })
            .collect();
        let network = pose::shipped();
        let together: Vec<Pose> = pose::poses(&network, &views).collect();
        let alone: Vec<Pose> =
            views.iter().flat_map(|view| pose::poses(&network, std::slice::from_ref(view))).collect();
        assert!(together == alone && together[0] != together[6], "{together:?} {alone:?}");
    }

    #[test]
    fn the_axis_lies_behind_the_side_that_was_seen() {
        // The near half of a body whose axis stands at 0: trunk, neck and head as shares of the height.
        const HEIGHT_M: f64 = 1.75;
        let slices = [(0.54, 0.072, 0.097), (0.81, 0.074, 0.100), (1.0, 0.045, 0.035)];
        let near: Vec<(f64, f64, f64)> = (0..42)
            .filter_map(|i| {
                let up = (f64::from(i) + 0.5) / 42.0;
                let &(_, half_depth, half_width) = slices.iter().find(|(top, ..)| *top > up)?;
                let around = 0.5 * std::f64::consts::PI * (f64::from(i * 17 % 42) / 21.0 - 1.0);
                let (depth, width) = (half_depth * around.cos(), half_width * around.sin());
                Some((-depth * HEIGHT_M, width * HEIGHT_M, up * HEIGHT_M))
            })
            .collect();
        let seen_m = near.iter().map(|p| p.0).sum::<f64>() / near.len() as f64;
        let found = pose_of(&points(&near), DVec2::X).position_m;
        // A body without legs is none that the model learned from: the side is right, the place only nearly.
        assert!(seen_m < -0.06 && found.x > seen_m + 0.01 && found.length() < 0.07, "{seen_m}, {found}");
    }

    /// A sensor that turns half a turn later meets a walker 5 cm farther on.
    #[test]
    fn points_of_a_walker_met_at_different_times_are_seen_as_at_one() {
        let velocity_mps = DVec2::new(0.3, 1.2);
        let at_once = points(&PERSON);
        let spread: Vec<Point> = (0..)
            .zip(&at_once)
            .map(|(i, p)| {
                let time_ns = (i - 2) * 20_000_000;
                Point {
                    position_m: p.position_m + (velocity_mps * time_ns as f64 * 1e-9).extend(0.0),
                    time_ns,
                    ..*p
                }
            })
            .collect();
        let [a, b] = [at_once, spread].map(|points| pose_of(&points, velocity_mps).position_m);
        let off_m = a.distance(b);
        assert!(off_m < 1e-9, "{off_m}");
    }
}
