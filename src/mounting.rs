//! Checks from floor and walls whether sensors still hang where the site file says, and corrects their poses if not.
//!
//! A few times a second, least squares fit a part of each sensor's returns to the floor, the ceiling and the walls of
//! the hall, with the site file's pose as prior. The offset of each surface from the file is unknown too. A wall
//! therefore determines a sensor's rotation, and its position only as well as the wall's own is known. The pose stays
//! as it is for differences below [`TURN_RAD`] and [`SHIFT_M`], and if the hall does not match the file.

use std::borrow::Cow;

use crate::config::DetectConfig;
use crate::geometry::{DMat3, DVec2, DVec3, Pose, cholesky};
use crate::lidar::{Cloud, Frame, RangeImage, Scan};
use crate::site::Hall;
use crate::{Health, Site};

/// Every so many-th frame is looked at,
const EVERY: u32 = 5;
/// and about so many returns of it.
const RETURNS: usize = 1500;
/// What a return is taken to be of a surface by, round after round, metres.
const GATES_M: [f64; 8] = [0.8, 0.8, 0.4, 0.4, 0.2, 0.2, 0.1, 0.1];
/// The last of them do where a sensor hangs as it did.
const GATES_AGAIN_M: &[f64] = &[0.2, 0.1];
/// One standard deviation of a return; more returns of a surface than so many tell no more of how it is turned.
const RETURN_M: f64 = 0.04;
const RETURNS_MAX: f64 = 200.0;
/// Of the floor and of walls against the site file: the one is level, of the others somebody has read a plan.
const FLOOR_M: f64 = 0.01;
const WALL_M: f64 = 0.05;
/// Of the site file's pose: what somebody who measured is off by.
const FILE_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;
const FILE_M: f64 = 0.03;
/// The hall is the file's where such a share of the returns lies on its surfaces, and so many on the floor.
const SHARE_MIN: f64 = 0.5;
const FLOOR_MIN: usize = 40;
/// A wall is not where the file has it if so many returns lie on a plane before or behind it, as thick as `PLANE_M` and no farther
/// than `ASIDE_M`, and not half as many on the wall.
const ASIDE_MIN: usize = 40;
const PLANE_M: f64 = 0.2;
const ASIDE_M: f64 = 1.0;
const PLANES: usize = (2.0 * ASIDE_M / PLANE_M) as usize + 1;
/// Less than this stays as it is: 0.15 degrees are 4 cm at 15 m, as much as a person's position errs.
pub const TURN_RAD: f64 = 0.15 * std::f64::consts::PI / 180.0;
/// The same of a place.
pub const SHIFT_M: f64 = 0.02;
/// Two looks that follow one another and find this much the same are believed, radians and metres.
const SAME_RAD: f64 = 0.05 * std::f64::consts::PI / 180.0;
const SAME_M: f64 = 0.01;

/// A turn about the sensor, along the site's axes, and a shift.
type Six = [f64; 6];

/// Follows how every sensor hangs.
#[derive(Debug, Clone)]
pub struct Mountings {
    surroundings: Surroundings,
    /// None where sensors are not to be followed.
    sensors: Vec<Mounting>,
    frames: u32,
    moved: Vec<usize>,
    /// Returns that are looked at.
    points_m: Vec<DVec3>,
    of_surfaces: OfSurfaces,
}

/// What the returns say of each surface. It is kept only so that a look allocates nothing.
#[derive(Debug, Clone, Default)]
struct OfSurfaces {
    sums: Vec<Sums>,
    /// How many returns lie on planes beside it.
    planes: Vec<[usize; PLANES]>,
}

/// What sensors see of the hall.
#[derive(Debug, Clone)]
struct Surroundings {
    hall: Hall,
    /// The floor at z = 0, ceiling and walls, then floors of other heights in the hall's order.
    surfaces: Vec<Surface>,
    /// How many come before those.
    level: usize,
}

/// A plane: points on it have `normal . p = off_m`.
#[derive(Debug, Clone, Copy)]
struct Surface {
    normal: DVec3,
    off_m: f64,
    sigma_m: f64,
}

/// One sensor.
#[derive(Debug, Clone)]
struct Mounting {
    given: Pose,
    /// What is taken to be the difference from `given`.
    used: Six,
    /// Another one that was found once: until the next look the sensor is not believed.
    doubted: Option<Six>,
    /// Whether it was found to hang right, or put right, before.
    settled: bool,
}

impl Mountings {
    /// Of a site's sensors, which hang as it says until they are seen not to.
    pub fn new(config: &DetectConfig, site: &Site) -> Self {
        let mounting = |sensor: &crate::site::Sensor| Mounting {
            given: sensor.site_from_sensor(),
            used: [0.0; 6],
            doubted: None,
            settled: false,
        };
        Self {
            surroundings: Surroundings::new(&site.hall),
            sensors: site.sensors.iter().filter(|_| config.follow_sensors).map(mounting).collect(),
            frames: 0,
            moved: Vec::new(),
            points_m: Vec::new(),
            of_surfaces: OfSurfaces::default(),
        }
    }

    /// Looks at a frame. Gives it with poses put right and without the scans of sensors that are in doubt; as it is where all
    /// hang as the site says.
    pub fn follow<'a>(&mut self, frame: &'a Frame, health: &mut Health) -> Cow<'a, Frame> {
        self.moved.clear();
        let look = self.frames.is_multiple_of(EVERY);
        self.frames = self.frames.wrapping_add(1);
        if look {
            for scan in &frame.scans {
                self.look(scan, health);
            }
        }
        let as_given = |mounting: &Mounting| mounting.used == [0.0; 6] && mounting.doubted.is_none();
        if self.sensors.iter().all(as_given) {
            return Cow::Borrowed(frame);
        }
        let known =
            |scan: &&Scan| self.sensors.get(scan.sensor).is_none_or(|mounting| mounting.doubted.is_none());
        let put_right = |scan: &Scan| {
            let site_from_sensor = match self.sensors.get(scan.sensor) {
                Some(mounting) if mounting.used != [0.0; 6] => corrected(&mounting.given, &mounting.used),
                _ => scan.site_from_sensor,
            };
            Scan { site_from_sensor, ..scan.clone() }
        };
        let scans = frame.scans.iter().filter(known).map(put_right).collect();
        Cow::Owned(Frame { scans, ..*frame })
    }

    /// Sensors that were found in the last frame to have moved since they were believed: what they have learned of the hall
    /// is no more.
    pub fn moved(&self) -> &[usize] {
        &self.moved
    }

    fn look(&mut self, scan: &Scan, health: &mut Health) {
        let (Some(mounting), Cloud::Organised(image)) = (self.sensors.get_mut(scan.sensor), &scan.cloud)
        else {
            return;
        };
        self.points_m.clear();
        self.points_m.extend(sampled(image, self.frames));
        let before = mounting.doubted.take();
        let Mounting { given, used, .. } = &*mounting;
        let near = |a: &Six, b: &Six, turn_rad: f64, shift_m: f64| {
            let off = |axes: std::ops::Range<usize>| axes.map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
            off(0..3) < turn_rad && off(3..6) < shift_m
        };
        let as_used = |found: &Six| near(found, used, TURN_RAD, SHIFT_M);
        let mut fit = |gates_m: &[f64]| {
            fitted(&self.points_m, given, used, gates_m, &self.surroundings, &mut self.of_surfaces)
        };
        let again = if before.is_none() { fit(GATES_AGAIN_M).filter(as_used) } else { None };
        let Some(found) = again.or_else(|| fit(&GATES_M)) else { return };
        match before {
            _ if as_used(&found) => mounting.settled = true,
            None => mounting.doubted = Some(found),
            Some(before) if near(&found, &before, SAME_RAD, SAME_M) => {
                mounting.used = found;
                health.sensors_moved += 1;
                if mounting.settled {
                    self.moved.push(scan.sensor);
                }
                mounting.settled = true;
            }
            // What trembles is seen every other time, which is better than not at all.
            Some(_) => {}
        }
    }
}

impl Surroundings {
    /// Each surface looks in.
    fn new(hall: &Hall) -> Self {
        let floor = Surface { normal: DVec3::Z, off_m: 0.0, sigma_m: FLOOR_M };
        let ceiling = Surface { normal: -DVec3::Z, off_m: -hall.height_m, sigma_m: WALL_M };
        // Counter-clockwise the hall lies to the left.
        let wall = |[from, to]: [DVec2; 2]| {
            let normal = (to - from).normalize_or(DVec2::X).perp();
            Surface { normal: normal.extend(0.0), off_m: normal.dot(from), sigma_m: WALL_M }
        };
        let mut surfaces: Vec<Surface> = [floor, ceiling].into_iter().chain(hall.walls().map(wall)).collect();
        let level = surfaces.len();
        surfaces.extend(hall.floors.iter().map(|floor| {
            let normal = DVec3::new(-floor.slope[0], -floor.slope[1], 1.0).normalize();
            Surface { normal, off_m: normal.z * floor.height_at_m(DVec2::ZERO), sigma_m: FLOOR_M }
        }));
        Self { hall: hall.clone(), surfaces, level }
    }

    /// The surface that a point is nearest to, and how far before it. Of all floors only that below it counts.
    fn nearest(&self, at_m: DVec3) -> Option<(usize, f64)> {
        let off = |s: usize| self.surfaces[s].normal.dot(at_m) - self.surfaces[s].off_m;
        let floor = self.hall.floor_at(at_m.truncate()).map_or(0, |floor| self.level + floor);
        let all = std::iter::once(floor).chain(1..self.level).map(|s| (s, off(s)));
        all.min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }

    fn is_floor(&self, surface: usize) -> bool {
        surface == 0 || surface >= self.level
    }
}

/// Some of the returns of a revolution, others each time, in the sensor's frame.
fn sampled(image: &RangeImage, turn: u32) -> impl Iterator<Item = DVec3> {
    let beams = image.beams.len().max(1);
    let every = (image.columns.len() * beams).div_ceil(RETURNS).max(1);
    let columns = (turn as usize % every..image.columns.len()).step_by(every);
    let rays = columns.flat_map(move |c| (0..beams).map(move |b| (c, b)));
    let ranges = rays.filter_map(move |(c, b)| Some((c, b, *image.range_m.get(c * beams + b)?)));
    ranges.filter(|ray| ray.2 > 0.0).map(|(c, b, range_m)| image.point_m(c, b, f64::from(range_m)))
}

fn corrected(given: &Pose, by: &Six) -> Pose {
    let turn = DVec3::new(by[0], by[1], by[2]);
    let angle = turn.length();
    let rotation = if angle > 0.0 { DMat3::from_axis_angle(turn / angle, angle) } else { DMat3::IDENTITY };
    Pose {
        rotation: rotation * given.rotation,
        translation_m: given.translation_m + DVec3::new(by[3], by[4], by[5]),
    }
}

/// The difference from `given` that lays returns on surfaces; `None` where these are not the hall's.
fn fitted(
    points_m: &[DVec3],
    given: &Pose,
    start: &Six,
    gates_m: &[f64],
    surroundings: &Surroundings,
    OfSurfaces { sums, planes }: &mut OfSurfaces,
) -> Option<Six> {
    let surfaces = &surroundings.surfaces;
    let mut by = *start;
    let mut on = (0, 0);
    sums.resize(surfaces.len(), Sums::default());
    for &gate_m in gates_m {
        let pose = corrected(given, &by);
        sums.fill(Sums::default());
        on = (0, 0);
        for point in points_m {
            let at_m = pose.point(*point);
            let Some((s, off_m)) = surroundings.nearest(at_m) else { continue };
            if off_m.abs() < gate_m {
                let (arm_m, normal) = (at_m - pose.translation_m, surfaces[s].normal);
                let turn = arm_m.cross(normal);
                sums[s].add(&[turn.x, turn.y, turn.z, normal.x, normal.y, normal.z], off_m);
                on = (on.0 + 1, on.1 + usize::from(surroundings.is_floor(s)));
            }
        }
        let step = solved(sums, &by, surfaces)?;
        by.iter_mut().zip(step).for_each(|(by, step)| *by += step);
    }
    let enough = on.0 as f64 >= SHARE_MIN * points_m.len() as f64 && on.1 >= FLOOR_MIN;
    (enough && !contradicts(points_m, &corrected(given, &by), surroundings, planes)).then_some(by)
}

/// Whether a wall is seen parallel to where the file has it, and not there: then the file is no measure for a sensor.
fn contradicts(
    points_m: &[DVec3],
    pose: &Pose,
    surroundings: &Surroundings,
    planes: &mut Vec<[usize; PLANES]>,
) -> bool {
    planes.clear();
    planes.resize(surroundings.surfaces.len(), [0; PLANES]);
    for point in points_m {
        let Some((s, off_m)) = surroundings.nearest(pose.point(*point)) else { continue };
        let plane = (off_m / PLANE_M).round() + (PLANES / 2) as f64;
        if let Some(count) = planes[s].get_mut(plane as usize).filter(|_| plane >= 0.0) {
            *count += 1;
        }
    }
    planes.iter().any(|planes| {
        let on = planes[PLANES / 2];
        planes.iter().any(|&count| count >= ASIDE_MIN && count > 2 * on)
    })
}

/// Of one surface: how its residuals change with the six, summed up.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: f64,
    slopes: Six,
    residuals: f64,
    squares: [Six; 6],
    products: Six,
}

impl Sums {
    fn add(&mut self, slopes: &Six, residual_m: f64) {
        self.count += 1.0;
        self.residuals += residual_m;
        for i in 0..6 {
            self.slopes[i] += slopes[i];
            self.products[i] += slopes[i] * residual_m;
            for j in 0..6 {
                self.squares[i][j] += slopes[i] * slopes[j];
            }
        }
    }
}

/// The step of the normal equations, each surface's own distance left out of them (Schur's complement).
fn solved(sums: &[Sums], by: &Six, surfaces: &[Surface]) -> Option<Six> {
    let (mut matrix, mut right) = ([[0.0; 6]; 6], [0.0; 6]);
    for i in 0..6 {
        let weight = if i < 3 { FILE_RAD.powi(-2) } else { FILE_M.powi(-2) };
        matrix[i][i] = weight;
        right[i] = -weight * by[i];
    }
    for (sums, surface) in sums.iter().zip(surfaces).filter(|(sums, _)| sums.count > 0.0) {
        let weight = (RETURNS_MAX / sums.count).min(1.0) / (RETURN_M * RETURN_M);
        let own = weight / (sums.count + 1.0 / (weight * surface.sigma_m * surface.sigma_m));
        for i in 0..6 {
            right[i] -= weight * sums.products[i] - own * sums.slopes[i] * sums.residuals;
            for j in 0..6 {
                matrix[i][j] += weight * sums.squares[i][j] - own * sums.slopes[i] * sums.slopes[j];
            }
        }
    }
    cholesky(matrix, right)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    /// Returns of the default hall from a sensor that hangs at `pose`, some of them of people.
    fn returns(pose: &Pose, hall: &Hall) -> Vec<DVec3> {
        let back = pose.inverse();
        let surfaces = Surroundings::new(hall).surfaces;
        let ray = |k: usize| {
            let (azimuth, elevation) = (k as f64 * 2.399_963, -0.5 + 0.7 * (k as f64 * 0.618_034).fract());
            let ahead =
                DVec3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
            let direction = pose.direction(ahead);
            let range = surfaces.iter().filter_map(|s| {
                let slope = s.normal.dot(direction);
                (slope < -1e-9).then(|| (s.off_m - s.normal.dot(pose.translation_m)) / slope)
            });
            let range_m = range.fold(f64::INFINITY, f64::min) * if k.is_multiple_of(9) { 0.7 } else { 1.0 };
            let noise_m = 0.02 * ((k as f64 * 7.77).sin() + (k as f64 * 3.33).cos());
            back.point(pose.translation_m + direction * (range_m + noise_m))
        };
        (0..RETURNS).map(ray).collect()
    }

    fn found(turn_deg: DVec3, shift_m: DVec3, hall: &Hall) -> Option<Six> {
        let site = Config::default().site;
        let given = site.sensors[0].site_from_sensor();
        let turn = turn_deg * std::f64::consts::PI / 180.0;
        let truth = corrected(&given, &[turn.x, turn.y, turn.z, shift_m.x, shift_m.y, shift_m.z]);
        fitted(
            &returns(&truth, hall),
            &given,
            &[0.0; 6],
            &GATES_M,
            &Surroundings::new(&site.hall),
            &mut OfSurfaces::default(),
        )
    }

    #[test]
    fn a_sensor_that_is_turned_is_found_to_be_and_one_that_hangs_right_is_left() {
        let hall = Config::default().site.hall;
        for turn_deg in
            [DVec3::new(0.5, -0.3, 0.4), DVec3::new(0.0, 1.0, 0.0), DVec3::new(-0.4, 0.2, 1.0), DVec3::ZERO]
        {
            let found = found(turn_deg, DVec3::new(0.01, 0.0, -0.01), &hall).unwrap();
            let turned = DVec3::new(found[0], found[1], found[2]) * 180.0 / std::f64::consts::PI;
            assert!(turned.distance(turn_deg) < 0.05, "{turned} for {turn_deg}");
            assert!(found[3..].iter().all(|m| m.abs() < 0.02), "{found:?}");
        }
    }

    #[test]
    fn another_hall_tells_nothing() {
        let hall = Hall { length_m: 60.0, width_m: 50.0, height_m: 14.0, ..Config::default().site.hall };
        assert_eq!(found(DVec3::ZERO, DVec3::ZERO, &hall), None);
    }

    /// A wall that stands 6 cm off is no reason to move a sensor by 6 cm, nor to turn it.
    #[test]
    fn a_wall_that_stands_elsewhere_moves_a_sensor_less_than_itself() {
        let hall = Config::default().site.hall;
        let found =
            found(DVec3::ZERO, DVec3::ZERO, &Hall { length_m: hall.length_m + 0.12, ..hall }).unwrap();
        assert!(found[..3].iter().all(|turn| turn.abs() < TURN_RAD), "{found:?}");
        assert!(found[3].abs() < 0.03, "{found:?}");
    }
}
