//! Points that a sensor gets from a body in every cell, by one walk along each of its rays.
//!
//! A ray meets a body where it passes the cell's middle at less than half a body's width, between feet and head, before
//! it meets the hall. One walk along the ray finds all cells that it serves, so a map costs as much as one revolution,
//! whatever the number of cells.

use umbracast::geometry::{DVec2, DVec3};
use umbracast::lidar::Model;
use umbracast::site::Sensor;
use umbracast::{Error, Site};

use crate::floor::Floor;

/// Half of a body's mean width, metres.
const RADIUS_M: f64 = 0.165;
/// Share of a body's height above which the head is narrower than the body.
const HEAD: f64 = 0.96;
/// More rays than that are thinned, and each counts for several.
const RAYS_MOST: usize = 300_000;
/// Neither do more rays meet more walls and things than that.
const MEETINGS_MOST: usize = 20_000_000;

/// Points on a standing body of `height_m` in each cell in one revolution of the sensor; 0 where nobody can stand. Of
/// about `rays` rays, evenly drawn from the columns; none takes all of them.
///
/// # Errors
/// A sensor whose beams nobody knows.
pub fn returns(
    site: &Site,
    sensor: &Sensor,
    floor: &Floor,
    height_m: f64,
    rays: Option<usize>,
) -> Result<Vec<f32>, Error> {
    let model =
        Model::of_sensor(sensor).map_err(|error| error.within(format!("sensor {:?}", sensor.name)))?;
    let columns = match model.turn {
        Some(turn) => turn.columns as usize,
        None => (1e9 / sensor.rate_hz / model.column_period_ns).round().max(1.0) as usize,
    };
    let things = site.hall.walls().count() + site.pillars.len() + site.furniture.len();
    let most =
        rays.unwrap_or(RAYS_MOST).min(RAYS_MOST).min(MEETINGS_MOST / things.max(1)).max(model.beams.len());
    let every = (columns * model.beams.len()).div_ceil(most);
    let taken = columns.div_ceil(every);
    let (pose, kept) = (sensor.site_from_sensor(), 1.0 - site.simulation.dropout);
    let weight = kept * columns as f64 / taken as f64;
    let mut walk =
        Walk { site, floor, height_m, levels_m: levels_m(site), returns: vec![0.0; floor.open.len()] };
    for column in 0..taken {
        let azimuth = (column as f64 / taken as f64 * std::f64::consts::TAU).sin_cos();
        for beam in model.beams.iter() {
            let (origin_m, direction) = beam.ray(azimuth);
            walk.along(pose.point(origin_m), pose.direction(direction), sensor, weight as f32);
        }
    }
    Ok(walk.returns)
}

/// The lowest and the highest floor, metres.
fn levels_m(site: &Site) -> [f64; 2] {
    let corners =
        site.hall.floors.iter().flat_map(|floor| {
            floor.outline_m.iter().map(|&corner| floor.height_at_m(DVec2::from_array(corner)))
        });
    corners.fold([0.0, 0.0], |[low, high], m| [low.min(m), high.max(m)])
}

struct Walk<'a> {
    site: &'a Site,
    floor: &'a Floor,
    height_m: f64,
    levels_m: [f64; 2],
    returns: Vec<f32>,
}

impl Walk<'_> {
    fn along(&mut self, origin_m: DVec3, way: DVec3, sensor: &Sensor, weight: f32) {
        let [lowest_m, highest_m] = [self.levels_m[0], self.levels_m[1] + HEAD * self.height_m];
        let at = |z: f64| (z - origin_m.z) / way.z;
        // Only while it is between floor and heads.
        let [mut near, mut far] = match way.z {
            z if z < -1e-9 => [at(highest_m), at(lowest_m)],
            z if z > 1e-9 => [at(lowest_m), at(highest_m)],
            _ if (lowest_m..highest_m).contains(&origin_m.z) => [0.0, f64::INFINITY],
            _ => return,
        };
        (near, far) = (near.max(sensor.range_min_m), far.min(sensor.range_max_m));
        if near >= far {
            return;
        }
        far = far.min(hits_at(self.site, origin_m, way, far));
        let flat = way.truncate();
        let pace = flat.length();
        if near >= far || pace < 1e-9 {
            return;
        }
        // Along the axis that it runs along more, one line of cells after the other.
        let along_x = flat.x.abs() >= flat.y.abs();
        let [ahead, aside] = if along_x { [flat.x, flat.y] } else { [flat.y, flat.x] };
        let [from_ahead, from_aside] =
            if along_x { [origin_m.x, origin_m.y] } else { [origin_m.y, origin_m.x] };
        let [cell_ahead, cell_aside] =
            if along_x { self.floor.from_m } else { [self.floor.from_m[1], self.floor.from_m[0]] };
        let (lines, across) = if along_x {
            (self.floor.columns, self.floor.rows)
        } else {
            (self.floor.rows, self.floor.columns)
        };
        let line_of = |t: f64| (from_ahead + t * ahead - cell_ahead) / self.floor.step_m;
        let reach = (RADIUS_M / self.floor.step_m).max(0.0) + 1.0;
        let [first, last] =
            if ahead > 0.0 { [line_of(near), line_of(far)] } else { [line_of(far), line_of(near)] };
        let [first, last] = [(first - reach).ceil().max(0.0), (last + reach).floor().min(lines as f64 - 1.0)];
        if first.is_nan() || last.is_nan() || first > last {
            return;
        }
        let half = RADIUS_M * pace / ahead.abs() / self.floor.step_m;
        for line in first as usize..=last as usize {
            let t = (cell_ahead + line as f64 * self.floor.step_m - from_ahead) / ahead;
            let middle = (from_aside + t * aside - cell_aside) / self.floor.step_m;
            let [low, high] =
                [(middle - half).ceil().max(0.0), (middle + half).floor().min(across as f64 - 1.0)];
            if low.is_nan() || high.is_nan() || low > high {
                continue;
            }
            for beside in low as usize..=high as usize {
                let cell = if along_x {
                    beside * self.floor.columns + line
                } else {
                    line * self.floor.columns + beside
                };
                self.meet(cell, origin_m, way, flat / pace, pace, [near, far], weight);
            }
        }
    }

    /// One cell: the ray meets the front of the body there.
    fn meet(
        &mut self,
        cell: usize,
        origin_m: DVec3,
        way: DVec3,
        flat: DVec2,
        pace: f64,
        [near, far]: [f64; 2],
        weight: f32,
    ) {
        if !self.floor.open[cell] {
            return;
        }
        let place_m = self.floor.place_m(cell);
        let to_m = place_m - origin_m.truncate();
        let beside_m = flat.perp_dot(to_m);
        let depth_m = (RADIUS_M * RADIUS_M - beside_m * beside_m).max(0.0).sqrt();
        let t = (flat.dot(to_m) - depth_m) / pace;
        let z = origin_m.z + t * way.z;
        let feet_m = self.site.hall.floor_m(place_m);
        // Steep rays come in through the head as well.
        let inside = z < feet_m + HEAD * self.height_m || {
            let t = (feet_m + HEAD * self.height_m - origin_m.z) / way.z;
            way.z < 0.0 && (origin_m.truncate() + t * way.truncate()).distance(place_m) < 0.5 * RADIUS_M
        };
        if t > near - 2.0 * RADIUS_M / pace && t < far && z > feet_m && inside {
            self.returns[cell] += weight;
        }
    }
}

/// Where a ray from within the hall first meets wall, pillar or furniture; `most` where none is nearer.
pub(crate) fn hits_at(site: &Site, origin_m: DVec3, way: DVec3, most: f64) -> f64 {
    let (from, flat) = (origin_m.truncate(), way.truncate());
    let mut far = most;
    for [a, b] in site.hall.walls() {
        let edge = b - a;
        let turned = flat.perp_dot(edge);
        let (t, s) = ((a - from).perp_dot(edge) / turned, (a - from).perp_dot(flat) / turned);
        if t > 1e-3 && t < far && (0.0..=1.0).contains(&s) {
            far = t;
        }
    }
    for pillar in &site.pillars {
        let to = DVec2::from_array(pillar.position_m) - from;
        let (square, middle) = (flat.length_squared(), to.dot(flat));
        let left = middle * middle - square * (to.length_squared() - pillar.radius_m * pillar.radius_m);
        if left > 0.0 {
            let t = (middle - left.sqrt()) / square;
            if t > 0.0 && t < far {
                far = t;
            }
        }
    }
    for piece in &site.furniture {
        let turn = DVec2::from_angle(-piece.yaw_deg.to_radians());
        let own = turn.rotate(from - DVec2::from_array(piece.position_m));
        let own_way = turn.rotate(flat);
        let base_m = site.hall.floor_m(DVec2::from_array(piece.position_m));
        let [l, w, h] = piece.size_m;
        let slabs = [
            (own.x, own_way.x, -0.5 * l, 0.5 * l),
            (own.y, own_way.y, -0.5 * w, 0.5 * w),
            (origin_m.z, way.z, base_m, base_m + h),
        ];
        let (mut enters, mut leaves) = (0.0_f64, far);
        for (p, v, low, high) in slabs {
            let (a, b) = ((low - p) / v, (high - p) / v);
            if a.is_nan() || b.is_nan() {
                continue;
            }
            enters = enters.max(a.min(b));
            leaves = leaves.min(a.max(b));
        }
        if enters < leaves && enters < far {
            far = enters;
        }
    }
    far
}
