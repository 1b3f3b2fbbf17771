//! One sensor's view of the empty scene, pixel by pixel, and the returns that are nearer.

use super::Point;
use super::cloud_limits::{CloudLimits, Elevations, azimuth_of_cdeg, range_of_m};
use super::first_sight::Return;
use super::presence::{Expected, Presence};
use super::range_model::{Near, RangeModel, Verdict};
use crate::Health;
use crate::elementary::wide;
use crate::geometry::{DVec3, Pose};
use crate::lidar::{Cloud, Column, Model, RangeImage, Scan, SensorPoint};
use crate::site::{Hall, Sensor};
use std::ops::Range;

/// Width of a pixel of an organised scan: a little more than one column of a sensor at 10 Hz.
const AZIMUTH_BIN_DEG: f64 = 0.2;
/// The same of a sensor whose columns lie farther apart and always at the same azimuths: with narrower pixels some would
/// never see anything.
const BIN_COLUMNS: f64 = 1.02;
/// The same of an unorganised cloud, whose columns are not known: a VLP-16 at 20 Hz fires every 0.4 degrees.
const CLOUD_AZIMUTH_BIN_DEG: f64 = 1.0;
const CLOUD_ELEVATION_BIN_DEG: f64 = 0.5;
/// In so many frames it is looked who is there from the start.
const FIRST_FRAMES: u32 = 3;
/// Who was not looked for in so long may have walked in.
const BLIND_NS: u64 = 350_000_000;
/// Lower points are the floor's.
const LOWEST_M: f64 = 0.03;

/// What the empty scene looks like to one sensor, and what it sees now.
#[derive(Debug, Clone)]
pub(super) struct SensorModel {
    pub(super) range_min_m: f32,
    pub(super) range_max_m: f32,
    ranges: RangeModel,
    cloud_ranges: RangeModel,
    /// Row of each bin of elevation, for clouds whose beams are not known.
    row_of_elevation: Vec<Option<u16>>,
    elevations: Elevations,
    /// Limits of the known scene by direction. `None` once something was learned; made again when the next cloud needs them.
    cloud_limits: Option<CloudLimits>,
    /// True once the empty scene was shown.
    known: bool,
    /// Since the start.
    frames: u32,
    /// Of the last frame.
    time_ns: i64,
    returns: Vec<CloudReturn>,
    /// Of each beam: how long the head has turned on, and how far it looks to the right.
    turned: Vec<[f32; 2]>,
    /// Of each beam of the column that is looked at.
    azimuths_cdeg: Vec<f32>,
    pixels: Vec<u32>,
}

/// A point of an unorganised cloud as the sensor saw it.
#[derive(Debug, Clone, Copy)]
struct CloudReturn {
    elevation_bin: usize,
    azimuth_cdeg: f32,
    range_m: f32,
    point: SensorPoint,
}

/// What is learned of a scan.
#[derive(Debug, Clone, Copy)]
pub(super) enum Learn<'a> {
    /// Everything: nobody is there.
    Empty,
    /// Everything but where somebody is expected. Then returns nearer than the sensor's range are learned too, though
    /// never new: behind somebody beside the sensor the scene is unknown, not empty, and what appears there later is no
    /// person.
    OnTheWay(&'a Presence),
    /// The empty scene is known: only what was put there since.
    Furniture(&'a Presence),
}

impl Learn<'_> {
    fn is_all(self) -> bool {
        !matches!(self, Self::Furniture(_))
    }

    /// Of a return, new or not; `at_m` says where it is, if people can be there. `stays` is asked whether what is new has been there
    /// for long.
    fn verdict(
        self,
        at_m: Option<DVec3>,
        new: bool,
        stays: impl FnOnce(&dyn Fn() -> Near) -> bool,
    ) -> Verdict {
        match (self, at_m) {
            // What is not new there may be of somebody too: a body's edge beside a pixel whose background is nearer. If it
            // were learned, the body would be learned from its edge inwards.
            (Self::OnTheWay(expected), Some(at_m)) if expected.is_somebodys(at_m) => Verdict::Somebodys,
            (Self::Empty | Self::OnTheWay(_), _) => Verdict::Learned,
            (Self::Furniture(expected), Some(at_m))
                if new
                    && (stays(&|| expected.near(at_m))
                        || expected.is_furnitures(at_m) && !expected.is_somebodys(at_m)) =>
            {
                Verdict::Furnitures
            }
            (Self::Furniture(_), _) => Verdict::Left,
        }
    }

    /// Ranges at which somebody may be whom this does not learn: most returns are of the hall behind all of them.
    fn ranges_near_people(self, site_from_sensor: &Pose, clip: &Clip) -> Vec<Range<f32>> {
        let Self::OnTheWay(expected) = self else { return Vec::new() };
        let sensor_m = site_from_sensor.point(DVec3::ZERO);
        let range = |&Expected { position_m, reach_m, .. }: &Expected| {
            let away_m = position_m.distance(sensor_m.truncate());
            let above_floor_m = sensor_m.z - clip.hall.floor_m(position_m);
            let off_m = above_floor_m.abs().max((above_floor_m - clip.highest_m).abs());
            // Half a metre more, for the floor under him may be a ramp's.
            (away_m - reach_m) as f32..(away_m + reach_m).hypot(off_m + 0.5) as f32
        };
        expected.people().map(range).collect()
    }
}

/// One scan, and what is asked of it.
#[derive(Clone, Copy)]
pub(super) struct Look<'a> {
    pub(super) scan: &'a Scan,
    /// The frame's.
    pub(super) time_ns: i64,
    pub(super) clip: &'a Clip,
    pub(super) learn: Learn<'a>,
}

/// Where people can be: the hall is known, so what lies outside is a reflection.
#[derive(Debug, Clone)]
pub(super) struct Clip {
    pub(super) hall: Hall,
    pub(super) highest_m: f64,
}

impl Clip {
    fn holds(&self, p: DVec3) -> bool {
        let above_m = || p.z - self.hall.floor_m(p.truncate());
        self.hall.contains(p.truncate()) && (LOWEST_M..=self.highest_m).contains(&above_m())
    }
}

impl SensorModel {
    /// Knows nothing yet.
    pub(super) fn new(sensor: &Sensor) -> Self {
        let elevations = Elevations::of_deg(CLOUD_ELEVATION_BIN_DEG);
        Self {
            range_min_m: sensor.range_min_m as f32,
            range_max_m: sensor.range_max_m as f32,
            ranges: RangeModel::of_rays(azimuth_bin_deg(sensor)),
            cloud_ranges: RangeModel::new(CLOUD_AZIMUTH_BIN_DEG),
            row_of_elevation: vec![None; elevations.bins],
            elevations,
            cloud_limits: None,
            known: false,
            frames: 0,
            time_ns: 0,
            returns: Vec::new(),
            turned: Vec::new(),
            azimuths_cdeg: Vec::new(),
            pixels: Vec::new(),
        }
    }

    /// Knows nothing again.
    pub(super) fn forget(&mut self) {
        self.ranges = self.ranges.forgotten();
        self.cloud_ranges = self.cloud_ranges.forgotten();
        self.row_of_elevation.fill(None);
        self.cloud_limits = None;
        (self.known, self.frames) = (false, 0);
    }

    /// Is shown the empty scene: from now on no more is learned than what was put there.
    pub(super) fn know(&mut self) {
        self.known = true;
    }

    pub(super) fn is_known(&self) -> bool {
        self.known
    }

    /// True in the first frames from which the scene is learned, of which the very first may be cut.
    pub(super) fn begins(&self) -> bool {
        !self.known && self.frames <= FIRST_FRAMES
    }

    /// One scan; what is new goes to `points`.
    pub(super) fn scan(&mut self, look: Look, health: &mut Health, points: &mut Vec<Point>) {
        self.frames = self.frames.saturating_add(1);
        let last_ns = std::mem::replace(&mut self.time_ns, look.time_ns);
        // Nor is it known how long ago the empty scan was made.
        if look.time_ns.abs_diff(last_ns) > BLIND_NS || matches!(look.learn, Learn::Empty) {
            self.ranges.was_blind();
            self.cloud_ranges.was_blind();
        }
        let known = self.known;
        let ranges = match &look.scan.cloud {
            Cloud::Organised(image) => {
                self.organised(look, image, health, points);
                &mut self.ranges
            }
            Cloud::Unorganised(cloud) => {
                self.unorganised(look, cloud, health, points);
                &mut self.cloud_ranges
            }
        };
        match look.learn {
            Learn::Empty | Learn::OnTheWay(_) => ranges.close_revolution(known),
            Learn::Furniture(_) => ranges.close_known_revolution(),
        }
    }

    wide! {
        fn organised(
            &mut self, look: Look, image: &RangeImage, health: &mut Health, points: &mut Vec<Point>,
        ) = organised_avx2 or organised_portably
    }

    /// The returns of a scan, the `scan`-th of its frame, with their pixels.
    pub(super) fn returns(&self, scan: usize, of: &Scan, returns: &mut Vec<Return>) {
        match &of.cloud {
            Cloud::Organised(image) => {
                let beams = image.beams.len();
                for (i, &range_m) in image.range_m.iter().enumerate() {
                    let (c, b) = (i / beams, i % beams);
                    if range_m >= self.range_min_m && range_m <= self.range_max_m {
                        let (column, beam) = (&image.columns[c], &image.beams[b]);
                        let looks_cdeg =
                            azimuth_cdeg(column, beam.turned_ns as f32, beam.azimuth_offset_cdeg);
                        let pixel = self.ranges.pixel(b, looks_cdeg);
                        let position_m = organised_point(of, image, c, b, range_m).position_m;
                        returns.push(Return { scan, pixel, position_m });
                    }
                }
            }
            // The returns were sorted when the scan was learned.
            Cloud::Unorganised(_) => returns.extend(self.returns.iter().filter_map(|r| {
                let pixel = self
                    .cloud_ranges
                    .pixel(usize::from(self.row_of_elevation[r.elevation_bin]?), r.azimuth_cdeg);
                Some(Return { scan, pixel, position_m: unorganised_point(of, &r.point).position_m })
            })),
        }
    }

    /// Forgets what those pixels saw last, which are sorted: it was somebody.
    pub(super) fn forget_pixels(&mut self, of: &Scan, pixels: &[usize]) {
        match &of.cloud {
            Cloud::Organised(_) => self.ranges.forget(pixels),
            Cloud::Unorganised(_) => self.cloud_ranges.forget(pixels),
        }
    }

    #[inline(always)]
    fn organised_portably(
        &mut self,
        look: Look,
        image: &RangeImage,
        health: &mut Health,
        points: &mut Vec<Point>,
    ) {
        let Look { scan, clip, learn, .. } = look;
        let beams = image.beams.len();
        if beams == 0 {
            return;
        }
        self.ranges.grow(beams);
        let (range_min_m, range_max_m) = (self.range_min_m, self.range_max_m);
        let Self { ranges, turned, azimuths_cdeg, pixels, .. } = self;
        turned.clear();
        turned.extend(image.beams.iter().map(|beam| [beam.turned_ns as f32, beam.azimuth_offset_cdeg]));
        azimuths_cdeg.resize(beams, 0.0);
        pixels.resize(beams, 0);
        let least_and_most = |i: usize| {
            let all = turned.iter().map(|beam| beam[i]);
            [all.clone().fold(f32::INFINITY, f32::min), all.fold(f32::NEG_INFINITY, f32::max)]
        };
        let [turned_ns, offset_cdeg] = [0, 1].map(least_and_most);
        let near_people = learn.ranges_near_people(&scan.site_from_sensor, clip);
        for (c, (column, ranges_m)) in image.columns.iter().zip(image.range_m.chunks_exact(beams)).enumerate()
        {
            // Nearly every column sees nothing but the hall.
            let may_skip = !learn.is_all() && !ranges.has_furniture();
            let clockwise = column.azimuth_rate_cdeg_per_ns >= 0.0;
            let outermost =
                |i: usize| azimuth_cdeg(column, turned_ns[if clockwise { i } else { 1 - i }], offset_cdeg[i]);
            let bins = if may_skip { ranges.one_or_two_bins([outermost(0), outermost(1)]) } else { None };
            if bins.is_some_and(|bins| !ranges.may_be_new(bins, ranges_m)) {
                continue;
            }
            for (azimuth, [turned_ns, offset_cdeg]) in azimuths_cdeg.iter_mut().zip(&*turned) {
                *azimuth = azimuth_cdeg(column, *turned_ns, *offset_cdeg);
            }
            ranges.pixels(azimuths_cdeg, pixels);
            if may_skip && bins.is_none() && !ranges.any_new(pixels, ranges_m) {
                continue;
            }
            for (b, &range_m) in ranges_m.iter().enumerate() {
                let pixel = pixels[b] as usize;
                if learn.is_all() {
                    ranges.look(pixel);
                }
                if range_m == 0.0 {
                    continue;
                }
                // Written so that NaN is caught: it is neither beyond the limit nor in the range.
                let background = range_m >= ranges.limit_m(pixel);
                if background && !learn.is_all() {
                    ranges.see_past(pixel, range_m);
                    continue;
                }
                if !(range_m >= range_min_m && range_m <= range_max_m) {
                    health.points_invalid += 1;
                    if range_m > 0.0 && range_m < range_min_m && matches!(learn, Learn::OnTheWay(_)) {
                        ranges.observe(pixel, range_m);
                    }
                    continue;
                }
                let verdict = if background && !near_people.iter().any(|ranges| ranges.contains(&range_m)) {
                    Verdict::Learned
                } else {
                    let point = organised_point(scan, image, c, b, range_m);
                    let at_m = Some(point.position_m).filter(|&at_m| clip.holds(at_m));
                    if !background && at_m.is_some() {
                        points.push(point);
                    }
                    learn.verdict(at_m, !background, |near| ranges.stays(pixel, range_m, near))
                };
                ranges.take(pixel, range_m, verdict);
            }
        }
    }

    fn unorganised(
        &mut self,
        look: Look,
        cloud: &[SensorPoint],
        health: &mut Health,
        points: &mut Vec<Point>,
    ) {
        let Look { scan, clip, learn, .. } = look;
        if self.sees_new_only(learn)
            && let Some(out_of_range) = self.sort_new(cloud)
        {
            health.points_invalid += out_of_range;
            for CloudReturn { elevation_bin, azimuth_cdeg, range_m, point } in self.returns.iter().copied() {
                let point = unorganised_point(scan, &point);
                if !clip.holds(point.position_m) {
                    continue;
                }
                points.push(point);
                let Some(row) = self.row_of_elevation[elevation_bin] else { continue };
                let own = self.cloud_ranges.pixel(usize::from(row), azimuth_cdeg);
                let stays = |near: &dyn Fn() -> Near| self.cloud_ranges.stays(own, range_m, near);
                let verdict = learn.verdict(Some(point.position_m), true, stays);
                self.cloud_ranges.take(own, range_m, verdict);
            }
            return;
        }
        self.cloud_limits = None;
        self.sort_returns(cloud, matches!(learn, Learn::OnTheWay(_)), health);
        for i in 0..self.returns.len() {
            let CloudReturn { elevation_bin, azimuth_cdeg, range_m, point } = self.returns[i];
            // Beams sit between two bins of elevation, so both neighbours count as well.
            let rows = &self.row_of_elevation[elevation_bin.saturating_sub(1)..=elevation_bin + 1];
            let pixel = |row: u16| self.cloud_ranges.pixel(usize::from(row), azimuth_cdeg);
            let limits_m = rows.iter().flatten().map(|&row| self.cloud_ranges.limit_m(pixel(row)));
            let limit_m = limits_m.fold(f32::INFINITY, f32::min);
            let own = self.row_of_elevation[elevation_bin].map(pixel);
            let point = unorganised_point(scan, &point);
            let new = range_m < limit_m && range_m >= self.range_min_m;
            let at_m = Some(point.position_m).filter(|&at_m| clip.holds(at_m));
            if new && at_m.is_some() {
                points.push(point);
            }
            let Some(own) = own else { continue };
            if range_m >= limit_m && !learn.is_all() {
                self.cloud_ranges.see_past(own, range_m);
            } else {
                let verdict = learn.verdict(at_m, new, |near| self.cloud_ranges.stays(own, range_m, near));
                self.cloud_ranges.take(own, range_m, verdict);
            }
        }
    }

    /// The cloud as a spinning sensor saw it, in an order that does not depend on the cloud's; with what is nearer
    /// than the sensor's range where `keep_near`.
    fn sort_returns(&mut self, cloud: &[SensorPoint], keep_near: bool, health: &mut Health) {
        self.returns.clear();
        for &point in cloud {
            let range_m = range_of_m(point.position_m);
            if !(range_m >= self.range_min_m && range_m <= self.range_max_m) {
                health.points_invalid += 1;
                if !(keep_near && range_m > 0.0 && range_m < self.range_min_m) {
                    continue;
                }
            }
            let elevation_bin = self.elevations.bin(point.position_m[2], range_m);
            if self.row_of_elevation[elevation_bin].is_none() {
                self.row_of_elevation[elevation_bin] = Some(self.cloud_ranges.rows() as u16);
                self.cloud_ranges.grow(self.cloud_ranges.rows() + 1);
            }
            let azimuth_cdeg = azimuth_of_cdeg(point.position_m);
            self.returns.push(CloudReturn { elevation_bin, azimuth_cdeg, range_m, point });
        }
        self.returns.sort_unstable_by(CloudReturn::in_order);
    }

    /// Whether a cloud teaches nothing: the scene is known, and nothing was put there or is looked for.
    fn sees_new_only(&self, learn: Learn) -> bool {
        let Learn::Furniture(expected) = learn else { return false };
        !self.cloud_ranges.has_furniture() && !expected.has_furniture()
    }

    /// The same as [`SensorModel::sort_returns`] of those alone that are new. Returns how many were out of range; `None`
    /// where an elevation is to be learned first.
    fn sort_new(&mut self, cloud: &[SensorPoint]) -> Option<u64> {
        let Self { cloud_ranges, row_of_elevation, elevations, pixels: new, returns, .. } = self;
        let limits = || CloudLimits::new(cloud_ranges, row_of_elevation, *elevations);
        let limits = self.cloud_limits.get_or_insert_with(limits);
        let range_m = [self.range_min_m, self.range_max_m];
        let out_of_range = limits.new_of(cloud, cloud_ranges, range_m, new)?;
        returns.clear();
        returns.extend(new.iter().map(|&i| {
            let (point, range_m) = (cloud[i as usize], range_of_m(cloud[i as usize].position_m));
            let elevation_bin = elevations.bin(point.position_m[2], range_m);
            CloudReturn { elevation_bin, azimuth_cdeg: azimuth_of_cdeg(point.position_m), range_m, point }
        }));
        returns.sort_unstable_by(CloudReturn::in_order);
        Some(out_of_range)
    }
}

impl CloudReturn {
    /// By what was seen alone, not by its place in the cloud.
    fn in_order(a: &Self, b: &Self) -> std::cmp::Ordering {
        let key = |r: &Self| (r.elevation_bin, r.point.time_ns, r.range_m.to_bits());
        let place = |r: &Self| r.point.position_m.map(f32::to_bits);
        key(a).cmp(&key(b)).then_with(|| place(a).cmp(&place(b)))
    }
}

/// Where a beam looks that fires so long after its column begins, and so far to the right of the head.
#[inline(always)]
fn azimuth_cdeg(column: &Column, turned_ns: f32, offset_cdeg: f32) -> f32 {
    column.azimuth_cdeg + column.azimuth_rate_cdeg_per_ns * turned_ns + offset_cdeg
}

/// A sensor that is not known has no pixels to fill.
fn azimuth_bin_deg(sensor: &Sensor) -> f64 {
    let turn = Model::of_sensor(sensor).ok().and_then(|model| model.turn);
    turn.map_or(AZIMUTH_BIN_DEG, |turn| AZIMUTH_BIN_DEG.max(BIN_COLUMNS * 360.0 / f64::from(turn.columns)))
}

fn organised_point(scan: &Scan, image: &RangeImage, c: usize, b: usize, range_m: f32) -> Point {
    to_site(&scan.site_from_sensor, scan.sensor, image.point_m(c, b, f64::from(range_m)), image.time_ns(c, b))
}

pub(super) fn unorganised_point(scan: &Scan, point: &SensorPoint) -> Point {
    let position_m = DVec3::from(point.position_m.map(f64::from));
    to_site(&scan.site_from_sensor, scan.sensor, position_m, point.time_ns)
}

pub(super) fn to_site(site_from_sensor: &Pose, sensor: usize, position_m: DVec3, time_ns: i64) -> Point {
    Point { position_m: site_from_sensor.point(position_m), time_ns, sensor: sensor as u16 }
}
