//! Draws people into a sensor's view: each triangle is projected onto the grid of columns and beams, and the few
//! beams that may meet it are tested exactly.

use std::ops::{Range, RangeInclusive};

use umbracast::geometry::{DVec2, DVec3, Pose};
use umbracast::lidar::{Azimuths, Beam};

use super::gaps::{Bounds, Gaps, stretched};
use super::head::Head;
use super::view::View;
use crate::body::Walker;

/// Limbs move evenly for so long: at 100 m/s2 (a swinging foot) a path bends by 0.3 mm in 5 ms.
const EVEN_MOTION_NS: i64 = 5_000_000;
/// How far a reported azimuth may lie from the true one: rounded in the packet, in its rate and by the decoder.
const ROUNDING_CDEG: f64 = 2.0;
/// Clothes and skin, percent.
const REFLECTIVITY: u8 = 20;

/// Draws bodies for one sensor. Keeps its buffers.
#[derive(Debug, Clone)]
pub struct Painter {
    sensor_from_site: Pose,
    /// From the lowest to the highest.
    beams: Vec<SlopedBeam>,
    /// Of the beams where they pass the sensor's axis, above the sensor's origin.
    lowest_origin_m: f64,
    highest_origin_m: f64,
    /// How far from the axis beams pass.
    aside_m: f64,
    /// Least and greatest azimuth of the beams from their column's.
    column_sweep_cdeg: (f64, f64),
    /// A mesh at the start and at the end of a pass, in the sensor's frame.
    start_m: Vec<DVec3>,
    end_m: Vec<DVec3>,
    bounds: Vec<Bounds>,
    gaps: Gaps,
    /// Triangles of a pass that may meet a beam.
    crossing: Vec<u32>,
    azimuths: Azimuths,
}

/// A beam as triangles are compared with it.
#[derive(Debug, Clone, Copy)]
struct SlopedBeam {
    /// Place in firing order.
    beam: usize,
    /// Rise over horizontal distance.
    slope: f64,
    /// How far to the right of the column's azimuth it looks: by its own offset, and as the head has turned on.
    turned_cdeg: f64,
}

/// Part of a sweep in which the vertices move evenly.
struct Pass {
    columns: RangeInclusive<usize>,
    start_ns: i64,
    end_ns: i64,
    /// Unwrapped azimuth at the middle: what tangents are counted from.
    middle_cdeg: f64,
}

impl Painter {
    /// For one sensor.
    pub fn new(site_from_sensor: &Pose, head: &Head) -> Self {
        let mut beams: Vec<SlopedBeam> = (head.model.beams.iter().enumerate())
            .map(|(beam, b)| SlopedBeam {
                beam,
                slope: b.elevation_rad.tan(),
                turned_cdeg: head.rate_cdeg_per_ns * f64::from(b.turned_ns)
                    + f64::from(b.azimuth_offset_cdeg),
            })
            .collect();
        beams.sort_by(|a, b| a.slope.total_cmp(&b.slope));
        let past_axis = || head.model.beams.iter().map(past_axis);
        let turned = || beams.iter().map(|b| b.turned_cdeg);
        Self {
            sensor_from_site: site_from_sensor.inverse(),
            lowest_origin_m: past_axis().map(|(z_m, _)| z_m).fold(f64::INFINITY, f64::min),
            highest_origin_m: past_axis().map(|(z_m, _)| z_m).fold(f64::NEG_INFINITY, f64::max),
            aside_m: past_axis().map(|(_, aside_m)| aside_m).fold(0.0, f64::max),
            column_sweep_cdeg: (turned().fold(0.0, f64::min), turned().fold(0.0, f64::max)),
            gaps: Gaps::new(beams.iter().map(|b| b.slope)),
            crossing: Vec::new(),
            beams,
            start_m: Vec::new(),
            end_m: Vec::new(),
            bounds: Vec::new(),
            azimuths: Azimuths::of_a_turn(),
        }
    }

    /// Hangs the sensor elsewhere.
    pub fn hang(&mut self, sensor_from_site: Pose) {
        self.sensor_from_site = sensor_from_site;
    }

    /// Draws a body, known as `person`, wherever it is nearer than what the view shows.
    pub fn draw(&mut self, walker: &Walker, person: u32, view: &mut View) {
        let Some(last) = view.image.columns.len().checked_sub(1) else { return };
        let Some((middle_cdeg, half_cdeg)) = self.azimuths(walker, view) else { return };
        // The body may be met from the column whose last beam reaches it to the column whose first beam leaves it.
        let (least_cdeg, most_cdeg) = self.column_sweep_cdeg;
        let (before_cdeg, after_cdeg) =
            (half_cdeg + most_cdeg + ROUNDING_CDEG, half_cdeg - least_cdeg + ROUNDING_CDEG);
        // Once in every turn of the head: twice in a frame for a body that stands across the cut.
        let turns = ((view.first_cdeg - after_cdeg - middle_cdeg) / 36_000.0).ceil();
        let mut azimuth_cdeg = middle_cdeg + turns * 36_000.0;
        while view.column_at(azimuth_cdeg - before_cdeg) <= last as f64 {
            let from = view.column_at(azimuth_cdeg - before_cdeg).ceil().max(0.0) as usize;
            let to = view.column_at(azimuth_cdeg + after_cdeg).floor().min(last as f64);
            if to >= from as f64 {
                self.sweep(walker, person, from..to as usize + 1, view);
            }
            azimuth_cdeg += 36_000.0;
        }
    }

    /// Between which azimuths the body is during the view: middle and half width. None when it is not there.
    fn azimuths(&self, walker: &Walker, view: &View) -> Option<(f64, f64)> {
        let mut around: Option<(f64, f64)> = None;
        let (first, last) = (view.image.columns.first()?, view.image.columns.last()?);
        for state in [first, last].iter().filter_map(|column| walker.state_at(column.time_ns)) {
            let foot = self.sensor_from_site.point(state.position_m.extend(state.floor_m)).truncate();
            let top_m = state.floor_m + state.height_m;
            let head = self.sensor_from_site.point(state.position_m.extend(top_m)).truncate();
            let reach_m = walker.reach_m() + self.aside_m;
            if distance_to_segment(foot, head) <= reach_m {
                return Some((0.0, 18_000.0));
            }
            for end in [foot, head] {
                let azimuth_cdeg = cdeg(f64::atan2(-end.y, end.x));
                let half_cdeg = cdeg((reach_m / end.length()).asin());
                let (middle, half) = around.unwrap_or((azimuth_cdeg, 0.0));
                let azimuth_cdeg =
                    middle + (azimuth_cdeg - middle + 18_000.0).rem_euclid(36_000.0) - 18_000.0;
                let low = (middle - half).min(azimuth_cdeg - half_cdeg);
                let high = (middle + half).max(azimuth_cdeg + half_cdeg);
                around = Some(((low + high) * 0.5, ((high - low) * 0.5).min(18_000.0)));
            }
        }
        around
    }

    /// Draws the body in some columns, in passes that are short enough for its limbs.
    fn sweep(&mut self, walker: &Walker, person: u32, columns: Range<usize>, view: &mut View) {
        let times = &view.image.columns;
        let last = columns.end - 1;
        let duration_ns = times[last].time_ns - times[columns.start].time_ns;
        let passes = (duration_ns / EVEN_MOTION_NS) as usize + 1;
        let bound = |k: usize| columns.start + columns.len() * k / passes;
        let mut start_ns = times[columns.start].time_ns;
        let mut present = mesh(walker, start_ns, &self.sensor_from_site, &mut self.end_m);
        for k in 0..passes {
            std::mem::swap(&mut self.start_m, &mut self.end_m);
            let end_ns = view.image.columns[bound(k + 1).min(last)].time_ns;
            let was_present = present;
            present = mesh(walker, end_ns, &self.sensor_from_site, &mut self.end_m);
            if was_present && present && bound(k) < bound(k + 1) {
                let columns = bound(k)..=bound(k + 1) - 1;
                let middle_cdeg = view.azimuth_at((bound(k) + bound(k + 1)) as f64 * 0.5);
                let pass = Pass { columns, start_ns, end_ns, middle_cdeg };
                self.pass(&pass, &walker.surface().triangles, person, view);
            }
            start_ns = end_ns;
        }
    }

    fn pass(&mut self, pass: &Pass, triangles: &[[u32; 3]], person: u32, view: &mut View) {
        let nearest_m = self.bound(pass.middle_cdeg);
        if nearest_m > 4.0 * self.aside_m {
            let aside = self.aside_m / nearest_m;
            let mut crossing = std::mem::take(&mut self.crossing);
            self.gaps.place(&self.bounds, nearest_m, aside);
            self.gaps.crossing(triangles, &mut crossing);
            for &triangle in &crossing {
                self.triangle(pass, triangles[triangle as usize], person, view);
            }
            self.crossing = crossing;
        } else {
            triangles.iter().for_each(|&triangle| self.triangle(pass, triangle, person, view));
        }
    }

    /// Draws what beams meet of a triangle.
    fn triangle(&self, pass: &Pass, triangle: [u32; 3], person: u32, view: &mut View) {
        let corners = triangle.map(|i| i as usize);
        let [a, b, c] = corners.map(|i| self.bounds[i]);
        let bounds = a.around(b).around(c);
        if bounds.ahead_m.1.is_nan() || bounds.ahead_m.1 <= 0.0 {
            return;
        }
        let width = bounds.tangent.1 - bounds.tangent.0;
        let narrow = bounds.ahead_m.0 > 4.0 * self.aside_m && width < 1.0;
        // By what a beam that does not pass through the axis seems turned and stretched, at most.
        let aside = if narrow { self.aside_m / bounds.ahead_m.0 } else { 0.0 };
        let (low, high) = match narrow {
            true => stretched(bounds.slope, width * width + 4.0 * aside * aside),
            false => self.slopes_near_axis(corners),
        };
        let lower = self.gaps.lower_beams(low);
        let first = lower + self.beams[lower..].iter().take_while(|b| b.slope < low).count();
        if first == self.beams.len() || self.beams[first].slope > high {
            return;
        }
        let aside_cdeg = if aside > 0.0 { cdeg(aside.asin()) } else { 0.0 };
        let (from_cdeg, to_cdeg) = if narrow {
            let (from, to) = bounds.tangent;
            (pass.middle_cdeg + cdeg(from.atan()), pass.middle_cdeg + cdeg(to.atan()))
        } else {
            (f64::NEG_INFINITY, f64::INFINITY)
        };
        let (start, end) = (*pass.columns.start() as f64, *pass.columns.end() as f64);
        for beam in self.beams[first..].iter().take_while(|b| b.slope <= high) {
            let from = view.column_at(from_cdeg - beam.turned_cdeg - ROUNDING_CDEG - aside_cdeg).max(start);
            let to = view.column_at(to_cdeg - beam.turned_cdeg + ROUNDING_CDEG + aside_cdeg).min(end);
            // The cast of what is not negative is its whole part.
            let whole = from as usize;
            let from = if (whole as f64) < from { whole + 1 } else { whole };
            if from as f64 <= to {
                for column in from..=to as usize {
                    self.fire(pass, corners, column, beam.beam, person, view);
                }
            }
        }
    }

    /// Bounds of every vertex over the pass, and the least distance along the middle azimuth. Vertices move straight, so that
    /// what bounds both ends bounds the way.
    fn bound(&mut self, middle_cdeg: f64) -> f64 {
        let (sin, cos) = (middle_cdeg * 0.01).to_radians().sin_cos();
        // Both ends abreast, for they divide and take roots in one instruction.
        let over = |way: [DVec3; 2]| {
            let ahead_m = way.map(|p| p.x * cos - p.y * sin);
            let right_m = way.map(|p| -(p.x * sin + p.y * cos));
            let tangent = [right_m[0] / ahead_m[0], right_m[1] / ahead_m[1]];
            let squared = way.map(|p| p.x * p.x + p.y * p.y);
            let distance_m = [squared[0].sqrt(), squared[1].sqrt()];
            let inverse = [1.0 / distance_m[0], 1.0 / distance_m[1]];
            let low = [0, 1].map(|end| (way[end].z - self.highest_origin_m) * inverse[end]);
            let high = [0, 1].map(|end| (way[end].z - self.lowest_origin_m) * inverse[end]);
            Bounds {
                ahead_m: (ahead_m[0].min(ahead_m[1]), ahead_m[0].max(ahead_m[1])),
                tangent: (tangent[0].min(tangent[1]), tangent[0].max(tangent[1])),
                slope: (low[0].min(low[1]), high[0].max(high[1])),
            }
        };
        self.bounds.clear();
        self.bounds.extend(self.start_m.iter().zip(&self.end_m).map(|(&a, &b)| over([a, b])));
        self.bounds.iter().map(|bounds| bounds.ahead_m.0).fold(f64::INFINITY, f64::min)
    }

    /// Slopes of a triangle that reaches round the spin axis: only its height and its far end bound them.
    fn slopes_near_axis(&self, corners: [usize; 3]) -> (f64, f64) {
        let points = || corners.iter().flat_map(|&i| [self.start_m[i], self.end_m[i]]);
        let far_m = points().map(|p| p.truncate().length()).fold(0.0, f64::max);
        let least_rise_m = points().map(|p| p.z).fold(f64::INFINITY, f64::min) - self.highest_origin_m;
        let most_rise_m = points().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max) - self.lowest_origin_m;
        let low = if least_rise_m > 0.0 { least_rise_m / far_m } else { f64::NEG_INFINITY };
        let high = if most_rise_m < 0.0 { most_rise_m / far_m } else { f64::INFINITY };
        (low, high)
    }

    /// One beam against one triangle, at the instant that the beam fires. (In the last column of a pass the later
    /// beams meet the body as it was at the first: 0.04 ms.)
    fn fire(&self, pass: &Pass, corners: [usize; 3], c: usize, b: usize, person: u32, view: &mut View) {
        let passed_ns = (view.image.time_ns(c, b) - pass.start_ns) as f64;
        let share = (passed_ns / (pass.end_ns - pass.start_ns).max(1) as f64).min(1.0);
        let triangle_m = corners.map(|i| self.start_m[i].lerp(self.end_m[i], share));
        let along = |range_m| view.image.tabled_point_m(&self.azimuths, c, b, range_m);
        let origin_m = along(0.0);
        let direction = along(1.0) - origin_m;
        if let Some(range_m) = meet(origin_m, direction, triangle_m) {
            view.show(c, b, range_m as f32, REFLECTIVITY, person);
        }
    }
}

/// Where a beam's line passes the sensor's axis: how high above the origin, and at what distance. Its start is not on
/// the axis where the head carries it around.
fn past_axis(beam: &Beam) -> (f64, f64) {
    let (start_m, flat) = (beam.origin_m.truncate(), beam.direction.truncate());
    let ahead = flat / flat.length().max(1e-6);
    (beam.origin_m.z - start_m.dot(ahead) * beam.elevation_rad.tan(), start_m.perp_dot(ahead).abs())
}

/// Writes a walker's mesh in the sensor's frame; false when the walker is not there.
fn mesh(walker: &Walker, time_ns: i64, sensor_from_site: &Pose, vertices_m: &mut Vec<DVec3>) -> bool {
    let present = walker.mesh_at(time_ns, vertices_m);
    for vertex_m in vertices_m {
        *vertex_m = sensor_from_site.point(*vertex_m);
    }
    present
}

/// Where a ray meets a triangle, from either side (Moeller and Trumbore 1997). `direction` has length 1.
fn meet(origin_m: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let inverse = ab.dot(p).recip();
    let s = origin_m - a;
    let u = s.dot(p) * inverse;
    let q = s.cross(ab);
    let v = direction.dot(q) * inverse;
    let range_m = ac.dot(q) * inverse;
    // Edges belong to both neighbours. A ray within the plane gives infinities or NaN, which fail.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && range_m > 0.0).then_some(range_m)
}

fn distance_to_segment(a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let share = (-a.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (a + along * share).length()
}

fn cdeg(angle_rad: f64) -> f64 {
    angle_rad.to_degrees() * 100.0
}
