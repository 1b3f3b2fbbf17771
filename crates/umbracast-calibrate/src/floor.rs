//! Where a sensor sees the floor: the nearly level plane below it that may be walked on, and how the sensor is turned against it.

use std::collections::{BTreeMap, BTreeSet};

use umbracast::geometry::{DMat3, DVec3, Pose};

/// A return this near to a plane is of it, metres: some deviations of any sensor's range.
const NEAR_M: f64 = 0.08;
/// A plane that is steeper than this is no floor, even of a sensor whose pose is wrong.
const STEEPEST_DEG: f64 = 30.0;
/// Planes through three returns that are tried.
const TRIES: u32 = 600;
/// Returns that each of them is tried on, one of a cube of this edge: the level beam of a sensor lies in a plane as well, and
/// most of its returns are close together, on the nearest walls.
const TRIED_ON: usize = 3000;
const CUBE_M: f64 = 0.25;
/// The floor is even within a square of this edge, metres; each square counts once, the near ones no more than the far.
const CELL_M: f64 = 0.5;
/// A square has so many returns at least.
const CELL_FEWEST: usize = 3;
/// A square that lies off by more than this times the usual is a step, a mat, the foot of a wall.
const OFF_MAX: f64 = 3.0;
/// A floor has so many of the returns at least; a sensor that looks along the hall sees more walls than floor.
const FEWEST: usize = 100;
/// Below a floor nothing is seen, and people walk on it: what lies on a plane is of a wall where so much is seen in the same
/// square below the plane, or as high above it as a body is.
const BELOW_M: f64 = 0.2;
const BODY_M: std::ops::Range<f64> = 0.3..1.5;
/// A floor that is left has such squares, so many at least.
const SQUARES_FEWEST: usize = 8;
/// The site file errs by no more than that in height, metres: a floor within it is looked for first.
const FILE_M: f64 = 0.9;
/// No sensor lies nearer to its floor, metres; a ring of returns on the walls lies in a plane through the sensor.
const LOWEST_M: f64 = 0.2;

/// The plane z = slope_x x + slope_y y + z_m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    slope_x: f64,
    slope_y: f64,
    z_m: f64,
}

/// How a sensor hangs over the floor: all that the floor tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Over the floor, metres.
    pub height_m: f64,
    /// Positive looks down.
    pub pitch_rad: f64,
    /// About the sensor's own x axis.
    pub roll_rad: f64,
    /// One standard deviation of height (metres), pitch and roll (radians).
    pub sigma: [f64; 3],
    /// True where no floor is at about the height that the site file has, and another plane was taken.
    pub far_from_file: bool,
}

impl Level {
    /// From the sensor's frame to one that is level, its origin on the floor below the sensor, turned by no yaw.
    pub fn level_from_sensor(&self) -> Pose {
        let (pitch, roll) = (self.pitch_rad.to_degrees(), self.roll_rad.to_degrees());
        Pose::from_yaw_pitch_roll_deg(DVec3::new(0.0, 0.0, self.height_m), 0.0, pitch, roll)
    }
}

/// How a sensor hangs, by returns in its own frame that lie still; `guess` is where the site file says it does. `None`
/// where no floor is seen.
pub fn level(points_m: &[DVec3], guess: &Pose) -> Option<Level> {
    let yaw_rad = guess.rotation.x_axis.y.atan2(guess.rotation.x_axis.x);
    let rotation = DMat3::from_rotation_z(-yaw_rad) * guess.rotation;
    let mut level_from_sensor = Pose { rotation, translation_m: DVec3::new(0.0, 0.0, guess.translation_m.z) };
    let mut level = None;
    for _ in 0..3 {
        let moved: Vec<DVec3> = points_m.iter().map(|&point| level_from_sensor.point(point)).collect();
        let sensor_m = level_from_sensor.translation_m;
        let ground = Ground::new(&moved);
        let near_file = |height_m: f64| (height_m - guess.translation_m.z).abs() < FILE_M;
        let at_file = ground.floor(sensor_m, near_file);
        let far_from_file = at_file.is_none();
        let floor = at_file.or_else(|| ground.floor(sensor_m, |_| true))?;
        let (floor, sigma) = even(&floor, &ground.borne_m(&floor))?;
        let up = DVec3::new(-floor.slope_x, -floor.slope_y, 1.0).normalize();
        let up = level_from_sensor.rotation.transpose() * up;
        let found = Level {
            height_m: floor.height_of_m(sensor_m),
            pitch_rad: (-up.x).clamp(-1.0, 1.0).asin(),
            roll_rad: up.y.atan2(up.z),
            sigma,
            far_from_file,
        };
        level_from_sensor = found.level_from_sensor();
        level = Some(found);
    }
    level
}

/// By least squares through the middles of squares; with one standard deviation of the height at the origin, of the slope
/// along x and of that along y, each square's error taken for its own.
fn even(floor: &Floor, points_m: &[DVec3]) -> Option<(Floor, [f64; 3])> {
    let mut cells: BTreeMap<(i64, i64), (DVec3, usize)> = BTreeMap::new();
    for point in points_m.iter().filter(|point| floor.height_of_m(**point).abs() < NEAR_M) {
        let (sum_m, count) = cells.entry(square(*point)).or_default();
        *sum_m += *point;
        *count += 1;
    }
    let enough = cells.values().filter(|(_, count)| *count >= CELL_FEWEST);
    let mut middles: Vec<DVec3> = enough.map(|(sum_m, count)| *sum_m / *count as f64).collect();
    let (fit, _) = plane_through(&middles)?;
    let usual_m = spread_m(&fit, &middles);
    middles.retain(|middle| fit.height_of_m(*middle).abs() <= OFF_MAX * usual_m);
    let (fit, inverse) = plane_through(&middles)?;
    let spread_m = spread_m(&fit, &middles);
    Some((fit, [2, 0, 1].map(|i| spread_m * inverse.col(i)[i].sqrt())))
}

/// Root mean square.
fn spread_m(floor: &Floor, points_m: &[DVec3]) -> f64 {
    let sum: f64 = points_m.iter().map(|point| floor.height_of_m(*point).powi(2)).sum();
    (sum / points_m.len().max(1) as f64).sqrt()
}

impl Floor {
    /// Degrees from level.
    pub fn tilt_deg(&self) -> f64 {
        self.slope_x.hypot(self.slope_y).atan().to_degrees()
    }

    /// How it rises along a direction of the plan, degrees.
    pub fn rise_deg(&self, yaw_deg: f64) -> f64 {
        let (sin, cos) = yaw_deg.to_radians().sin_cos();
        (self.slope_x * cos + self.slope_y * sin).atan().to_degrees()
    }

    /// How high it lies below or above a point.
    fn z_m(&self, point_m: DVec3) -> f64 {
        self.slope_x * point_m.x + self.slope_y * point_m.y + self.z_m
    }

    /// How far a point is from it, positive above.
    pub fn height_of_m(&self, point_m: DVec3) -> f64 {
        let above_m = point_m.z - self.z_m(point_m);
        above_m / (1.0 + self.slope_x.powi(2) + self.slope_y.powi(2)).sqrt()
    }
}

/// The floor among returns in the site's frame, as the sensor's pose puts them there; `None` where too few lie on any
/// nearly level plane below `sensor_m` that may carry people. The same returns give the same floor.
pub fn find(points_m: &[DVec3], sensor_m: DVec3) -> Option<Floor> {
    Ground::new(points_m).floor(sensor_m, |_| true)
}

/// Returns, and how high others lie in the same square of the plan.
struct Ground {
    /// Each with its square.
    points_m: Vec<(DVec3, usize)>,
    /// Of each square all heights, lowest first.
    heights_m: Vec<Vec<f64>>,
}

impl Ground {
    fn new(points_m: &[DVec3]) -> Self {
        let mut squares = BTreeMap::new();
        let mut heights_m: Vec<Vec<f64>> = Vec::new();
        let of = |point: &DVec3| {
            let next = squares.len();
            let square = *squares.entry(square(*point)).or_insert(next);
            if square == heights_m.len() {
                heights_m.push(Vec::new());
            }
            heights_m[square].push(point.z);
            (*point, square)
        };
        let points_m = points_m.iter().map(of).collect();
        heights_m.iter_mut().for_each(|of| of.sort_unstable_by(f64::total_cmp));
        Self { points_m, heights_m }
    }

    /// True where a return is of the plane and its square may be walked on. A ring of returns on walls lies in a plane too,
    /// but its squares have returns of other beams below and above.
    fn bears(&self, floor: &Floor, (point_m, square): &(DVec3, usize)) -> bool {
        if floor.height_of_m(*point_m).abs() >= NEAR_M {
            return false;
        }
        let below = |z_m: f64| self.heights_m[*square].partition_point(|of_m| *of_m < z_m);
        let z_m = floor.z_m(*point_m);
        let [lower, feet, head] = [z_m - BELOW_M, z_m + BODY_M.start, z_m + BODY_M.end].map(below);
        let on = feet - lower;
        10 * lower <= on && 2 * (head - feet) <= on
    }

    fn borne_m(&self, floor: &Floor) -> Vec<DVec3> {
        self.points_m.iter().filter(|point| self.bears(floor, point)).map(|(point_m, _)| *point_m).collect()
    }

    /// The plane that bears most, among those above which the sensor hangs as high as `may_be` says, metres.
    fn floor(&self, sensor_m: DVec3, may_be: impl Fn(f64) -> bool) -> Option<Floor> {
        let is_floor = |floor: &Floor| {
            let height_m = floor.height_of_m(sensor_m);
            height_m > LOWEST_M && may_be(height_m) && floor.tilt_deg() < STEEPEST_DEG
        };
        let mut cubes = BTreeSet::new();
        let mut spread = self.points_m.clone();
        spread.retain(|(point_m, _)| {
            cubes.insert((*point_m / CUBE_M).floor().to_array().map(|edge| edge as i64))
        });
        let every = spread.len().div_ceil(TRIED_ON).max(1);
        let tried: Vec<(DVec3, usize)> = spread.iter().step_by(every).copied().collect();
        // What is the floor's is the lowest of its square: a sensor that sees little of it draws few planes from walls.
        let is_lowest =
            |(point_m, square): &&(DVec3, usize)| point_m.z - self.heights_m[*square][0] < BELOW_M;
        let lowest: Vec<(DVec3, usize)> = tried.iter().filter(is_lowest).copied().collect();
        let planes = (0..TRIES)
            .filter_map(|k| {
                let [a, b, c] = [3 * k, 3 * k + 1, 3 * k + 2].map(|k| draw(&lowest, k));
                plane([a?.0, b?.0, c?.0])
            })
            .filter(is_floor);
        let best =
            planes.max_by_key(|floor| tried.iter().filter(|point| self.bears(floor, point)).count())?;
        let floor = plane_through(&self.borne_m(&best))?.0;
        let borne_m = self.borne_m(&floor);
        let floor = plane_through(&borne_m)?.0;
        let squares: BTreeSet<_> = borne_m.iter().map(|point_m| square(*point_m)).collect();
        (borne_m.len() >= FEWEST && squares.len() >= SQUARES_FEWEST && is_floor(&floor)).then_some(floor)
    }
}

/// The square of the plan that a point lies in.
fn square(point_m: DVec3) -> (i64, i64) {
    let key = |m: f64| (m / CELL_M).floor() as i64;
    (key(point_m.x), key(point_m.y))
}

/// Any of the points, as if at random: a hash that mixes well (the end of MurmurHash3), for with a plain one the three
/// of a plane always lie equally far apart, and never all on the floor ahead of a sensor on a wall.
fn draw<T: Copy>(points: &[T], k: u32) -> Option<T> {
    let mut hash = k.wrapping_add(1);
    for (shift, factor) in [(16, 0x85eb_ca6b_u32), (13, 0xc2b2_ae35)] {
        hash = (hash ^ (hash >> shift)).wrapping_mul(factor);
    }
    hash ^= hash >> 16;
    points.get(((u64::from(hash) * points.len() as u64) >> 32) as usize).copied()
}

/// Through three points, unless it stands upright.
fn plane([a, b, c]: [DVec3; 3]) -> Option<Floor> {
    let normal = (b - a).cross(c - a);
    if normal.z.abs() < 0.5 * normal.length() || normal.z == 0.0 {
        return None;
    }
    let (slope_x, slope_y) = (-normal.x / normal.z, -normal.y / normal.z);
    Some(Floor { slope_x, slope_y, z_m: a.z - slope_x * a.x - slope_y * a.y })
}

/// By least squares; with the inverse of the normal matrix of slopes and height.
fn plane_through(points_m: &[DVec3]) -> Option<(Floor, DMat3)> {
    let (mut sums, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for point in points_m {
        let row = DVec3::new(point.x, point.y, 1.0);
        sums += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
        right += row * point.z;
    }
    // Three points in a line, or fewer.
    if sums.determinant().abs() < 1e-6 {
        return None;
    }
    let inverse = sums.inverse();
    let [slope_x, slope_y, z_m] = (inverse * right).to_array();
    Some((Floor { slope_x, slope_y, z_m }, inverse))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor and a wall, as many returns each, two centimetres of noise.
    fn room(tilt_deg: f64) -> Vec<DVec3> {
        let slope = tilt_deg.to_radians().tan();
        let noise = |k: u32| 0.04 * (f64::from(k.wrapping_mul(2_654_435_769)) / f64::from(u32::MAX) - 0.5);
        let floor = (0..2500).map(|k| {
            let (x, y) = (f64::from(k % 50) * 0.2, f64::from(k / 50) * 0.2);
            DVec3::new(x, y, slope * x + 0.3 + noise(k))
        });
        let wall =
            (0..2500).map(|k| DVec3::new(10.0 + noise(k), f64::from(k % 50) * 0.2, f64::from(k / 50) * 0.1));
        floor.chain(wall).collect()
    }

    #[test]
    fn a_tilted_floor_is_found_beside_a_wall() {
        for tilt_deg in [0.0, 3.0, -7.0] {
            let floor = find(&room(tilt_deg), DVec3::new(0.0, 5.0, 4.0)).unwrap();
            assert!((floor.rise_deg(0.0) - tilt_deg).abs() < 0.05, "{floor:?}");
            assert!((floor.tilt_deg() - tilt_deg.abs()).abs() < 0.05 && floor.rise_deg(90.0).abs() < 0.05);
            let height_m = 3.7 * tilt_deg.to_radians().cos();
            assert!((floor.height_of_m(DVec3::new(0.0, 5.0, 4.0)) - height_m).abs() < 0.01);
        }
    }

    #[test]
    fn a_sensor_finds_how_it_hangs_whatever_the_guess() {
        let truth = Pose::from_yaw_pitch_roll_deg(DVec3::new(0.0, 5.0, 4.0), 17.0, 31.0, -2.5);
        let seen: Vec<DVec3> = room(0.0).iter().map(|&point| truth.inverse().point(point)).collect();
        let guess = Pose::from_yaw_pitch_roll_deg(DVec3::new(3.0, 0.0, 3.5), 60.0, 26.0, 3.0);
        let found = level(&seen, &guess).unwrap();
        assert!((found.pitch_rad.to_degrees() - 31.0).abs() < 0.05, "{found:?}");
        assert!((found.roll_rad.to_degrees() + 2.5).abs() < 0.05, "{found:?}");
        assert!((found.height_m - 3.7).abs() < 0.005, "{found:?}");
        let [height_m, pitch, roll] = found.sigma;
        assert!(height_m > 1e-4 && height_m < 0.01 && pitch.max(roll) < 0.002, "{found:?}");
    }

    /// Sixteen beams in a room of 14 m by 10 m: of most columns the level ones return from walls that are near, and a plane
    /// through them lies just below the sensor.
    #[test]
    fn a_level_beam_all_round_on_walls_is_no_floor() {
        let sensor_m = DVec3::new(-6.3, -4.2, 2.2);
        let pose = Pose::from_yaw_pitch_roll_deg(sensor_m, 35.0, 15.0, 0.0);
        let beams =
            (0..16).flat_map(|b| (0..1800).map(move |c| (2.0 * f64::from(b) - 15.0, 0.2 * f64::from(c))));
        let seen: Vec<DVec3> = beams
            .map(|(up_deg, turn_deg)| {
                let (up, turn) = (up_deg.to_radians(), turn_deg.to_radians());
                let ray = pose.rotation * DVec3::new(up.cos() * turn.cos(), up.cos() * turn.sin(), up.sin());
                let edges =
                    [(ray.x, 7.0, sensor_m.x), (ray.y, 5.0, sensor_m.y), (ray.z, 2.0, sensor_m.z - 2.0)];
                let ranges_m = edges
                    .map(|(along, half_m, at_m): (f64, f64, f64)| (half_m.copysign(along) - at_m) / along);
                sensor_m + ray * ranges_m.into_iter().fold(f64::INFINITY, f64::min)
            })
            .collect();
        let floor = find(&seen, sensor_m).unwrap();
        assert!((floor.height_of_m(sensor_m) - 2.2).abs() < 0.01 && floor.tilt_deg() < 0.1, "{floor:?}");
    }

    #[test]
    fn a_ceiling_is_no_floor_and_nothing_is_none() {
        assert_eq!(find(&room(0.0), DVec3::new(0.0, 5.0, -1.0)), None);
        assert_eq!(find(&[], DVec3::ZERO), None);
    }
}
