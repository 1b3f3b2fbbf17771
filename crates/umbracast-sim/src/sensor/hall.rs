//! The empty hall as each sensor sees it: every beam at every azimuth that a packet can report, traced once.

use std::f64::consts::TAU;

use umbracast::Site;
use umbracast::geometry::{DVec2, DVec3, Pose};
use umbracast::lidar::{Beam, RangeImage, Turn};
use umbracast::site::{Floor, Hall};

use super::head::Head;
use super::panes::{Meets, Mirrored, Panes};

/// Azimuths that a packet tells apart unless a sensor's columns repeat: hundredths of a degree.
const TURN_CDEG: u32 = 36_000;

/// Diffuse reflectivities in percent, as Velodyne calibrates them: painted concrete, dark floor, wood.
const FLOOR: u8 = 25;
const CEILING: u8 = 60;
const WALL: u8 = 55;
const PILLAR: u8 = 45;
const FURNITURE: u8 = 35;
/// Dust on glass, and what comes straight back.
const PANE: u8 = 10;

/// So far to either side of an edge the floor has the height that it has beside it.
const BESIDE_M: f64 = 1e-6;

/// Ranges and reflectivities of all beams at all azimuths of the head, row after row. A row holds each beam at the azimuth to
/// which the head has turned on when that beam fires, so that a column of a frame lies in one row or in two beside each other:
/// it is read from a few lines of the cache.
#[derive(Debug)]
pub struct HallImage {
    turn: Option<Turn>,
    azimuths: u32,
    /// How far each beam's azimuth is past that of its row; less than there are azimuths.
    turned: Vec<u32>,
    range_m: Vec<f32>,
    /// Percent.
    reflectivity: Vec<u8>,
    /// Empty in a hall without panes.
    mirrored: Vec<Mirrored>,
}

impl HallImage {
    /// Traces the hall from a sensor that hangs within it.
    pub fn trace(site: &Site, head: &Head, site_from_sensor: &Pose) -> Self {
        let (hall, panes) = (Solids::new(site), Panes::new(&site.simulation.panes));
        let model = &head.model;
        let (count, first_cdeg) = model.turn.map_or((TURN_CDEG, 0.0), |turn| (turn.columns, turn.first_cdeg));
        let rays = model.beams.len() * count as usize;
        let (mut ranges_m, mut reflectivities) = (Vec::with_capacity(rays), Vec::with_capacity(rays));
        let mut mirrored = Vec::with_capacity(if panes.is_empty() { 0 } else { rays });
        let azimuth_rad = |i| first_cdeg * (TAU / 36_000.0) + f64::from(i) * (TAU / f64::from(count));
        let azimuths: Vec<(f64, f64)> = (0..count).map(|i| azimuth_rad(i).sin_cos()).collect();
        // All beams of a column that repeats have one azimuth.
        let turned = |beam: &Beam| match model.turn {
            None => (head.rate_cdeg_per_ns * f64::from(beam.turned_ns)).round() as u32 % count,
            Some(_) => 0,
        };
        let turned: Vec<u32> = model.beams.iter().map(turned).collect();
        for row in 0..count {
            for (beam, turned) in model.beams.iter().zip(&turned) {
                let (origin_m, direction) = beam.ray(azimuths[((row + turned) % count) as usize]);
                let ray = (site_from_sensor.point(origin_m), site_from_sensor.direction(direction));
                let (range_m, reflectivity) = if panes.is_empty() {
                    hall.cast(ray.0, ray.1)
                } else {
                    let (range_m, reflectivity, pane) = hall.cast_at_panes(&panes, ray.0, ray.1);
                    mirrored.push(pane);
                    (range_m, reflectivity)
                };
                ranges_m.push(range_m as f32);
                reflectivities.push(reflectivity);
            }
        }
        Self {
            turn: model.turn,
            azimuths: count,
            turned,
            range_m: ranges_m,
            reflectivity: reflectivities,
            mirrored,
        }
    }

    /// Writes what each pixel of the image meets, and the panes that show it unless the hall has none.
    pub fn show(&self, image: &mut RangeImage, mirrored: &mut [Mirrored]) {
        let beams = image.beams.len();
        let mut rows = Vec::with_capacity(image.columns.len());
        rows.extend((0..image.columns.len()).map(|c| self.row(image, c)));
        // Whole rows first: the processor waits for many of them at a time.
        for (c, &row) in rows.iter().enumerate() {
            let (from, to) = (row * beams..(row + 1) * beams, c * beams..(c + 1) * beams);
            image.range_m[to.clone()].copy_from_slice(&self.range_m[from.clone()]);
            image.reflectivity[to.clone()].copy_from_slice(&self.reflectivity[from.clone()]);
            if self.has_panes() {
                mirrored[to].copy_from_slice(&self.mirrored[from]);
            }
        }
        if self.turn.is_some() {
            return;
        }
        // Then the beams that rounding moves to the row beside.
        for (c, &row) in rows.iter().enumerate() {
            for (b, &turned) in self.turned.iter().enumerate() {
                let azimuth = image.azimuth_cdeg(c, b);
                let own =
                    (if azimuth < turned { azimuth + self.azimuths } else { azimuth } - turned) as usize;
                if own != row {
                    let (from, to) = (own * beams + b, c * beams + b);
                    image.range_m[to] = self.range_m[from];
                    image.reflectivity[to] = self.reflectivity[from];
                    if self.has_panes() {
                        mirrored[to] = self.mirrored[from];
                    }
                }
            }
        }
    }

    /// Where most beams of a column look: all of them where columns repeat.
    fn row(&self, image: &RangeImage, c: usize) -> usize {
        let Some(turn) = self.turn else {
            let azimuth = image.azimuth_cdeg(c, 0);
            return ((azimuth + self.azimuths - self.turned[0]) % self.azimuths) as usize;
        };
        let passed = (f64::from(image.columns[c].azimuth_cdeg) - turn.first_cdeg) / 36_000.0;
        let number = (passed * f64::from(turn.columns)).round() as i64;
        number.rem_euclid(i64::from(turn.columns)) as usize
    }

    /// Whether any pixel may show a reflection.
    pub fn has_panes(&self) -> bool {
        !self.mirrored.is_empty()
    }
}

/// The hall's surfaces, each met exactly: planes, boxes and true cylinders.
struct Solids {
    /// Where its floor is not level.
    floor: Option<Hall>,
    room_min_m: DVec3,
    room_max_m: DVec3,
    /// Those of a room that is no rectangle along x and y.
    walls: Vec<[DVec2; 2]>,
    pillars: Vec<(DVec2, f64)>,
    /// Pose of each box's middle and its half edges.
    boxes: Vec<(Pose, DVec3)>,
}

impl Solids {
    fn new(site: &Site) -> Self {
        let [least_m, most_m] = site.hall.bounds_m();
        let is_box = site.hall.outline_m.is_empty();
        let boxes = site.furniture.iter().map(|item| {
            let size_m = DVec3::from_array(item.size_m);
            let position_m = DVec2::from_array(item.position_m);
            let middle_m = position_m.extend(site.hall.floor_m(position_m) + size_m.z * 0.5);
            (Pose::from_yaw_pitch_roll_deg(middle_m, item.yaw_deg, 0.0, 0.0).inverse(), size_m * 0.5)
        });
        Self {
            floor: (!site.hall.floors.is_empty()).then(|| site.hall.clone()),
            room_min_m: least_m.extend(0.0),
            room_max_m: most_m.extend(site.hall.height_m),
            walls: if is_box { Vec::new() } else { site.hall.walls().collect() },
            pillars: site.pillars.iter().map(|p| (DVec2::from_array(p.position_m), p.radius_m)).collect(),
            boxes: boxes.collect(),
        }
    }

    /// Range and reflectivity of what a ray from within the room meets first. `direction` has length 1.
    fn cast(&self, origin_m: DVec3, direction: DVec3) -> (f64, u8) {
        let mut nearest = self.room(origin_m, direction);
        let mut meet = |range_m: Option<f64>, reflectivity| {
            if let Some(range_m) = range_m.filter(|&r| r < nearest.0) {
                nearest = (range_m, reflectivity);
            }
        };
        for &(axis_m, radius_m) in &self.pillars {
            meet(cylinder(origin_m.truncate() - axis_m, direction.truncate(), radius_m), PILLAR);
        }
        for (box_from_site, half_m) in &self.boxes {
            meet(
                cuboid(box_from_site.point(origin_m), box_from_site.direction(direction), *half_m),
                FURNITURE,
            );
        }
        nearest
    }

    /// The same where light may go on through glass or be thrown back, once; infinitely far where nothing comes back.
    fn cast_at_panes(&self, panes: &Panes, origin_m: DVec3, direction: DVec3) -> (f64, u8, Mirrored) {
        let (solid_m, reflectivity) = self.cast(origin_m, direction);
        let Some(met) = panes.first(origin_m, direction, solid_m) else {
            return (solid_m, reflectivity, Mirrored::NONE);
        };
        match met.does(solid_m) {
            Meets::Pane => (met.range_m, PANE, Mirrored::NONE),
            Meets::Through => (solid_m, reflectivity, Mirrored::NONE),
            Meets::Reflection { reach_m } => {
                // A hair before the pane: what it hangs on is not before it.
                let from_m = origin_m + direction * met.range_m + met.reflected * 1e-6;
                let (beyond_m, reflectivity) = self.cast(from_m, met.reflected);
                let range_m = met.range_m + beyond_m;
                let range_m = if range_m <= reach_m { range_m } else { f64::INFINITY };
                let mirrored = Mirrored { pane: met.pane, at_m: met.range_m as f32, reach_m: reach_m as f32 };
                (range_m, reflectivity, mirrored)
            }
        }
    }

    fn room(&self, origin_m: DVec3, direction: DVec3) -> (f64, u8) {
        let exit = |axis: usize| {
            let wall_m = if direction[axis] < 0.0 { self.room_min_m[axis] } else { self.room_max_m[axis] };
            // A ray along a wall pair never leaves through it: x / 0 is infinite.
            (wall_m - origin_m[axis]) / direction[axis]
        };
        let side = match self.walls.is_empty() {
            true => exit(0).min(exit(1)),
            false => {
                let meets = |of: &[DVec2; 2]| wall(origin_m.truncate(), direction.truncate(), *of);
                self.walls.iter().filter_map(meets).fold(f64::INFINITY, f64::min)
            }
        };
        let end = match &self.floor {
            Some(hall) if direction.z < 0.0 => floors(hall, origin_m, direction),
            // Looking up, a step may be met before the ceiling.
            Some(hall) => {
                let step = floors(hall, origin_m, direction);
                if step < side.min(exit(2)) {
                    return (step, FLOOR);
                }
                exit(2)
            }
            None => exit(2),
        };
        if side < end { (side, WALL) } else { (end, if direction.z < 0.0 { FLOOR } else { CEILING }) }
    }
}

/// Where a ray meets a floor that is not level: ramps, platforms, what is at z = 0 between them, and the upright faces
/// where neighbours differ in height.
fn floors(hall: &Hall, origin_m: DVec3, direction: DVec3) -> f64 {
    let at_m = |range_m: f64| (origin_m + direction * range_m).truncate();
    let plane = |height_at_origin_m: f64, slope: DVec2, floor: Option<usize>| {
        let range_m = (height_at_origin_m - origin_m.z) / (direction.z - slope.dot(direction.truncate()));
        (range_m > 0.0 && hall.floor_at(at_m(range_m)) == floor).then_some(range_m)
    };
    let level = plane(0.0, DVec2::ZERO, None);
    let others = hall.floors.iter().enumerate().filter_map(|(i, floor)| {
        plane(floor.height_at_m(origin_m.truncate()), DVec2::from_array(floor.slope), Some(i))
    });
    let faces = hall.floors.iter().flat_map(Floor::edges).filter_map(|[from, to]| {
        let range_m = wall(origin_m.truncate(), direction.truncate(), [from, to])?;
        let aside_m = (to - from).normalize_or_zero().perp() * BESIDE_M;
        let sides_m = [aside_m, -aside_m].map(|aside_m| hall.floor_m(at_m(range_m) + aside_m));
        let (low_m, high_m) = (sides_m[0].min(sides_m[1]), sides_m[0].max(sides_m[1]));
        // A hair of room, so that no ray slips through between a face and what it leads to.
        (low_m - BESIDE_M..=high_m + BESIDE_M)
            .contains(&(origin_m.z + direction.z * range_m))
            .then_some(range_m)
    });
    level.into_iter().chain(others).chain(faces).fold(f64::INFINITY, f64::min)
}

/// Where a ray meets a wall, seen from above. Both ends belong to it, so that no ray slips through a corner.
fn wall(origin_m: DVec2, direction: DVec2, [from, to]: [DVec2; 2]) -> Option<f64> {
    let along = to - from;
    let across = direction.perp_dot(along);
    let range_m = (from - origin_m).perp_dot(along) / across;
    let share = (from - origin_m).perp_dot(direction) / across;
    (range_m > 0.0 && (-1e-9..=1.0 + 1e-9).contains(&share)).then_some(range_m)
}

/// Where a ray, given from the axis of an upright cylinder, enters it.
fn cylinder(origin_m: DVec2, direction: DVec2, radius_m: f64) -> Option<f64> {
    let a = direction.length_squared();
    let b = origin_m.dot(direction);
    let discriminant = b * b - a * (origin_m.length_squared() - radius_m * radius_m);
    if b >= 0.0 || discriminant < 0.0 {
        return None;
    }
    Some((-b - discriminant.sqrt()) / a).filter(|&range_m| range_m > 0.0)
}

/// Where a ray, given in the frame of a box's middle, enters it.
fn cuboid(origin_m: DVec3, direction: DVec3, half_m: DVec3) -> Option<f64> {
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let inverse = direction[axis].recip();
        let (a, b) = ((-half_m[axis] - origin_m[axis]) * inverse, (half_m[axis] - origin_m[axis]) * inverse);
        // `max` and `min` pass over the NaN of a ray that runs within a face.
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter > 0.0 && enter <= leave).then_some(enter)
}
