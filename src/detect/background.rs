//! Removes the points that belong to the empty scene.

use super::range_model::RangeModel;
use super::voxel::{VoxelMap, thin};
use super::{Point, Prior};
use crate::config::{BackgroundMethod, DetectConfig};
use crate::geometry::{DVec3, Pose};
use crate::lidar::{Azimuths, Cloud, Model, RangeImage, Scan, SensorPoint};
use crate::site::Sensor;
use crate::{Frame, Health, Site};

/// Width of a pixel of an organised scan: a little more than one column of a sensor at 10 Hz.
const AZIMUTH_BIN_DEG: f64 = 0.2;
/// The same of a sensor whose columns lie farther apart and always at the same azimuths: with narrower pixels some would
/// never see anything.
const BIN_COLUMNS: f64 = 1.02;
/// The same of an unorganised cloud, whose columns are not known: a VLP-16 at 20 Hz fires every 0.4 degrees.
const CLOUD_AZIMUTH_BIN_DEG: f64 = 1.0;
const CLOUD_ELEVATION_BIN_DEG: f64 = 0.5;
/// A return is new when it is nearer than the background by so many standard deviations of the sensor's range,
const MARGIN_SIGMAS: f64 = 5.0;
/// and at least by this.
const MARGIN_MIN_M: f64 = 0.05;
/// Somebody who stands still must not be learned: nothing is within this distance of an expected person.
const FREEZE_M: f64 = 0.5;
/// Lower points are the floor's.
const LOWEST_M: f64 = 0.03;
/// Most foreground points kept of one frame: 100 people close to the sensors. Bounds the time of a frame.
pub const POINTS_MAX: usize = 40_000;
/// Voxels: hdl_people_tracking's edge and threshold.
const VOXEL_M: f64 = 0.2;
const VOXEL_POINTS_MIN: u8 = 2;
/// So many empty scans make the voxel map. The adapted code takes one; with our columns, which do not repeat from turn
/// to turn, one leaves some 9,000 points of the hall a frame to be taken for people.
const MAP_REVOLUTIONS: u32 = 20;

/// What the empty scene looks like to each sensor.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let config = umbracast::Config::default();
/// use umbracast::{Health, detect::Background};
///
/// let mut background = Background::new(&config.detect, &config.site);
/// background.learn_empty(&ray(0, 15.5));
/// let mut points = Vec::new();
/// background.foreground(&ray(1, 14.0), &[], &mut Health::default(), &mut points);
/// assert_eq!(points.len(), 1);
/// assert!((points[0].position_m.z - 0.97).abs() < 0.01);
/// ```
#[derive(Debug, Clone)]
pub struct Background {
    method: BackgroundMethod,
    thin_m: f64,
    sensors: Vec<SensorModel>,
    clip: Clip,
    /// True once an empty frame was given: then nothing more is learned.
    known: bool,
    map: Option<VoxelMap>,
    /// Scans that made the map.
    map_scans: u32,
    keys: Vec<u64>,
    thinned: Vec<Point>,
    /// For the voxels, which take every point of a frame; made with the first.
    azimuths: Option<Azimuths>,
}

#[derive(Debug, Clone)]
struct SensorModel {
    range_min_m: f32,
    range_max_m: f32,
    ranges: RangeModel,
    cloud_ranges: RangeModel,
    /// Row of each bin of elevation, for clouds whose beams are not known.
    row_of_elevation: Vec<Option<u16>>,
    elevation_bins_per_rad: f64,
    returns: Vec<Return>,
    /// Of each beam: how long the head has turned on, and how far it looks to the right.
    turned: Vec<[f32; 2]>,
    /// Of each beam of the column that is looked at.
    azimuths_cdeg: Vec<f32>,
    pixels: Vec<u32>,
}

/// A point of an unorganised cloud as the sensor saw it.
#[derive(Debug, Clone, Copy)]
struct Return {
    elevation_bin: usize,
    azimuth_cdeg: f32,
    range_m: f32,
    point: SensorPoint,
}

impl Background {
    /// Knows nothing yet.
    ///
    /// ```
    /// use umbracast::{Config, detect::Background};
    ///
    /// let config = Config::default();
    /// let background = Background::new(&config.detect, &config.site);
    /// let serves_another_recording = background.clone();
    /// # assert!(format!("{serves_another_recording:?}").contains("known: false"));
    /// ```
    pub fn new(config: &DetectConfig, site: &Site) -> Self {
        let ranges = |sensor: &Sensor, bin_deg| {
            RangeModel::new((MARGIN_SIGMAS * sensor.range_noise_m).max(MARGIN_MIN_M), bin_deg)
        };
        let sensor = |sensor: &Sensor| SensorModel {
            range_min_m: sensor.range_min_m as f32,
            range_max_m: sensor.range_max_m as f32,
            ranges: ranges(sensor, azimuth_bin_deg(sensor)),
            cloud_ranges: ranges(sensor, CLOUD_AZIMUTH_BIN_DEG),
            row_of_elevation: vec![None; (180.0 / CLOUD_ELEVATION_BIN_DEG) as usize + 3],
            elevation_bins_per_rad: 1.0_f64.to_degrees() / CLOUD_ELEVATION_BIN_DEG,
            returns: Vec::new(),
            turned: Vec::new(),
            azimuths_cdeg: Vec::new(),
            pixels: Vec::new(),
        };
        Self {
            method: config.background,
            thin_m: config.thin_m,
            sensors: site.sensors.iter().map(sensor).collect(),
            clip: Clip {
                half_length_m: site.hall.length_m * 0.5,
                half_width_m: site.hall.width_m * 0.5,
                highest_m: config.highest_m,
            },
            known: false,
            map: None,
            map_scans: 0,
            keys: Vec::new(),
            thinned: Vec::new(),
            azimuths: None,
        }
    }

    /// Learns from a frame without people (the paper's global map).
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// use umbracast::{Health, detect::Background};
    ///
    /// let mut background = Background::new(&config.detect, &config.site);
    /// background.learn_empty(&ray(0, 15.5));
    /// let mut points = Vec::new();
    /// background.foreground(&ray(1, 15.5), &[], &mut Health::default(), &mut points);
    /// assert!(points.is_empty(), "nothing is new");
    /// ```
    pub fn learn_empty(&mut self, frame: &Frame) {
        match self.method {
            BackgroundMethod::RangeImage => {
                self.known = true;
                let mut nothing = Vec::new();
                for scan in &frame.scans {
                    let learn = Learn { on_the_way: false, priors: &[], freeze_m: 0.0 };
                    self.scan(scan, Some(learn), &mut Health::default(), &mut nothing);
                }
            }
            BackgroundMethod::Voxels => {
                let mut points = Vec::new();
                self.all_points(frame, &mut Health::default(), &mut points);
                self.learn_map(&points);
            }
        }
    }

    /// The points that are new, in the site frame. Where no empty scan was learned, the background is learned
    /// on the way, but not where a person is expected.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// use umbracast::{Health, detect::Background};
    ///
    /// // Nothing was learned before: of the first revolution nothing is new.
    /// let (mut background, mut points) = (Background::new(&config.detect, &config.site), Vec::new());
    /// background.foreground(&ray(0, 15.5), &[], &mut Health::default(), &mut points);
    /// assert!(points.is_empty());
    /// ```
    pub fn foreground(
        &mut self,
        frame: &Frame,
        priors: &[Prior],
        health: &mut Health,
        points: &mut Vec<Point>,
    ) {
        points.clear();
        match self.method {
            BackgroundMethod::RangeImage => {
                let learn = Learn { on_the_way: true, priors, freeze_m: FREEZE_M };
                for scan in &frame.scans {
                    let learn = (!self.known).then_some(learn);
                    self.scan(scan, learn, health, points);
                }
            }
            BackgroundMethod::Voxels => {
                self.all_points(frame, health, points);
                // Without an empty scan the first cloud is the map, and nothing changes it after, as in the
                // adapted code: who stands in it is never seen.
                let map = self.map.get_or_insert_with(|| VoxelMap::new(VOXEL_M, points));
                points.retain(|p| map.is_new(p.position_m, VOXEL_POINTS_MIN));
                if self.thin_m == 0.0 {
                    // DP-means depends on the order; a thinned cloud has one already, its voxels'.
                    points.sort_unstable_by(in_space);
                }
            }
        }
        health.points_over_limit += points.len().saturating_sub(POINTS_MAX) as u64;
        points.truncate(POINTS_MAX);
    }

    /// Adds a scan to the map until it has enough.
    fn learn_map(&mut self, points: &[Point]) {
        if self.map_scans < MAP_REVOLUTIONS {
            match &mut self.map {
                Some(map) => map.add(points),
                None => self.map = Some(VoxelMap::new(VOXEL_M, points)),
            }
            self.map_scans += 1;
        }
    }

    /// All points of a frame in the site frame, thinned where the config says so.
    fn all_points(&mut self, frame: &Frame, health: &mut Health, points: &mut Vec<Point>) {
        points.clear();
        let azimuths = self.azimuths.get_or_insert_with(Azimuths::of_a_turn);
        for scan in &frame.scans {
            let Some(sensor) = self.sensors.get(scan.sensor) else { continue };
            let valid = |r: f32, health: &mut Health| {
                let ok = r >= sensor.range_min_m && r <= sensor.range_max_m;
                health.points_invalid += u64::from(!ok);
                ok
            };
            match &scan.cloud {
                Cloud::Organised(image) => {
                    for (i, &range_m) in image.range_m.iter().enumerate() {
                        let (c, b) = (i / image.beams.len().max(1), i % image.beams.len().max(1));
                        if range_m != 0.0 && c < image.columns.len() && valid(range_m, health) {
                            let position_m = image.tabled_point_m(azimuths, c, b, f64::from(range_m));
                            let time_ns = image.time_ns(c, b);
                            points.push(to_site(&scan.site_from_sensor, scan.sensor, position_m, time_ns));
                        }
                    }
                }
                Cloud::Unorganised(cloud) => {
                    for point in cloud {
                        if valid(DVec3::from(point.position_m.map(f64::from)).length() as f32, health) {
                            points.push(unorganised_point(scan, point));
                        }
                    }
                }
            }
        }
        if self.thin_m > 0.0 {
            thin(points, self.thin_m, &mut self.keys, &mut self.thinned);
        }
    }

    /// One scan against its sensor's range image; what is new goes to `points`.
    fn scan(&mut self, scan: &Scan, learn: Option<Learn>, health: &mut Health, points: &mut Vec<Point>) {
        let clip = self.clip;
        let Some(sensor) = self.sensors.get_mut(scan.sensor) else { return };
        match &scan.cloud {
            Cloud::Organised(image) => sensor.organised(scan, image, &clip, learn, health, points),
            Cloud::Unorganised(cloud) => sensor.unorganised(scan, cloud, &clip, learn, health, points),
        }
        if learn.is_some() {
            match &scan.cloud {
                Cloud::Organised(_) => sensor.ranges.close_revolution(self.known),
                Cloud::Unorganised(_) => sensor.cloud_ranges.close_revolution(self.known),
            }
        }
    }
}

/// What may be learned.
#[derive(Clone, Copy)]
struct Learn<'a> {
    /// Not from an empty scan. Then returns nearer than the sensor's range are learned too, though never new: behind
    /// somebody beside the sensor the scene is unknown, not empty, and what appears there later is no person.
    on_the_way: bool,
    /// Where somebody is expected nothing is learned.
    priors: &'a [Prior],
    freeze_m: f64,
}

impl Learn<'_> {
    fn is_frozen(&self, position_m: DVec3) -> bool {
        let near = |prior: &Prior| {
            let reach_m = self.freeze_m + prior.position_sigma_m.min(self.freeze_m);
            prior.position_m.distance_squared(position_m.truncate()) < reach_m * reach_m
        };
        self.priors.iter().any(near)
    }
}

/// Where people can be: the hall is known, so what lies outside is a reflection.
#[derive(Debug, Clone, Copy)]
struct Clip {
    half_length_m: f64,
    half_width_m: f64,
    highest_m: f64,
}

impl Clip {
    fn holds(&self, p: DVec3) -> bool {
        p.x.abs() <= self.half_length_m
            && p.y.abs() <= self.half_width_m
            && p.z >= LOWEST_M
            && p.z <= self.highest_m
    }
}

impl SensorModel {
    fn organised(
        &mut self,
        scan: &Scan,
        image: &RangeImage,
        clip: &Clip,
        learn: Option<Learn>,
        health: &mut Health,
        points: &mut Vec<Point>,
    ) {
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
        for (c, (column, ranges_m)) in image.columns.iter().zip(image.range_m.chunks_exact(beams)).enumerate()
        {
            for (azimuth_cdeg, [turned_ns, offset_cdeg]) in azimuths_cdeg.iter_mut().zip(&*turned) {
                let turned_cdeg = column.azimuth_rate_cdeg_per_ns * turned_ns;
                *azimuth_cdeg = column.azimuth_cdeg + turned_cdeg + offset_cdeg;
            }
            ranges.pixels(azimuths_cdeg, pixels);
            // Nearly every column sees nothing but the hall.
            if learn.is_none() && !ranges.any_new(pixels, ranges_m) {
                continue;
            }
            for (b, &range_m) in ranges_m.iter().enumerate() {
                if range_m == 0.0 {
                    continue;
                }
                let pixel = pixels[b] as usize;
                // Written so that NaN is caught: it is neither beyond the limit nor in the range.
                let background = range_m >= ranges.limit_m(pixel);
                if background && learn.is_none() {
                    continue;
                }
                if !(range_m >= range_min_m && range_m <= range_max_m) {
                    health.points_invalid += 1;
                    if range_m > 0.0 && range_m < range_min_m && learn.is_some_and(|learn| learn.on_the_way) {
                        ranges.observe(pixel, range_m);
                    }
                    continue;
                }
                let mut frozen = false;
                if !background {
                    let point = organised_point(scan, image, c, b, range_m);
                    if clip.holds(point.position_m) {
                        points.push(point);
                        frozen = learn.is_some_and(|learn| learn.is_frozen(point.position_m));
                    }
                }
                if learn.is_some() && !frozen {
                    ranges.observe(pixel, range_m);
                }
            }
        }
    }

    fn unorganised(
        &mut self,
        scan: &Scan,
        cloud: &[SensorPoint],
        clip: &Clip,
        learn: Option<Learn>,
        health: &mut Health,
        points: &mut Vec<Point>,
    ) {
        self.sort_returns(cloud, learn.is_some_and(|learn| learn.on_the_way), health);
        for i in 0..self.returns.len() {
            let Return { elevation_bin, azimuth_cdeg, range_m, point } = self.returns[i];
            // Beams sit between two bins of elevation, so both neighbours count as well.
            let rows = &self.row_of_elevation[elevation_bin.saturating_sub(1)..=elevation_bin + 1];
            let pixel = |row: u16| self.cloud_ranges.pixel(usize::from(row), azimuth_cdeg);
            let limits_m = rows.iter().flatten().map(|&row| self.cloud_ranges.limit_m(pixel(row)));
            let limit_m = limits_m.fold(f32::INFINITY, f32::min);
            let own = self.row_of_elevation[elevation_bin].map(pixel);
            let mut frozen = false;
            if range_m < limit_m && range_m >= self.range_min_m {
                let point = unorganised_point(scan, &point);
                if clip.holds(point.position_m) {
                    points.push(point);
                    frozen = learn.is_some_and(|learn| learn.is_frozen(point.position_m));
                }
            }
            if let Some(own) = own.filter(|_| learn.is_some() && !frozen) {
                self.cloud_ranges.observe(own, range_m);
            }
        }
    }

    /// The cloud as a spinning sensor saw it, in an order that does not depend on the cloud's; with what is nearer
    /// than the sensor's range where `keep_near`.
    fn sort_returns(&mut self, cloud: &[SensorPoint], keep_near: bool, health: &mut Health) {
        self.returns.clear();
        for &point in cloud {
            let [x, y, z] = point.position_m;
            let range_m = (x * x + y * y + z * z).sqrt();
            if !(range_m >= self.range_min_m && range_m <= self.range_max_m) {
                health.points_invalid += 1;
                if !(keep_near && range_m > 0.0 && range_m < self.range_min_m) {
                    continue;
                }
            }
            let elevation_rad = f64::from(z / range_m).clamp(-1.0, 1.0).asin();
            let above_nadir_rad = elevation_rad + std::f64::consts::FRAC_PI_2;
            // Bins are centred on their multiples, where beams use to be; bin 0 stays empty for the neighbours.
            let elevation_bin = (above_nadir_rad * self.elevation_bins_per_rad).round() as usize + 1;
            let elevation_bin = elevation_bin.min(self.row_of_elevation.len() - 2);
            if self.row_of_elevation[elevation_bin].is_none() {
                self.row_of_elevation[elevation_bin] = Some(self.cloud_ranges.rows() as u16);
                self.cloud_ranges.grow(self.cloud_ranges.rows() + 1);
            }
            let azimuth_cdeg = (-y).atan2(x).to_degrees() * 100.0;
            self.returns.push(Return { elevation_bin, azimuth_cdeg, range_m, point });
        }
        self.returns.sort_unstable_by(|a, b| {
            let key = |r: &Return| (r.elevation_bin, r.point.time_ns, r.range_m.to_bits());
            let place = |r: &Return| r.point.position_m.map(f32::to_bits);
            key(a).cmp(&key(b)).then_with(|| place(a).cmp(&place(b)))
        });
    }
}

/// A sensor that is not known has no pixels to fill.
fn azimuth_bin_deg(sensor: &Sensor) -> f64 {
    let turn = Model::of_sensor(sensor).ok().and_then(|model| model.turn);
    turn.map_or(AZIMUTH_BIN_DEG, |turn| AZIMUTH_BIN_DEG.max(BIN_COLUMNS * 360.0 / f64::from(turn.columns)))
}

/// An order that does not depend on how the points came.
fn in_space(a: &Point, b: &Point) -> std::cmp::Ordering {
    let key = |p: &Point| (p.sensor, p.time_ns);
    key(a).cmp(&key(b)).then_with(|| {
        let pairs = a.position_m.to_array().into_iter().zip(b.position_m.to_array());
        pairs.map(|(a, b)| a.total_cmp(&b)).fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
    })
}

fn organised_point(scan: &Scan, image: &RangeImage, c: usize, b: usize, range_m: f32) -> Point {
    to_site(&scan.site_from_sensor, scan.sensor, image.point_m(c, b, f64::from(range_m)), image.time_ns(c, b))
}

fn unorganised_point(scan: &Scan, point: &SensorPoint) -> Point {
    let position_m = DVec3::from(point.position_m.map(f64::from));
    to_site(&scan.site_from_sensor, scan.sensor, position_m, point.time_ns)
}

fn to_site(site_from_sensor: &Pose, sensor: usize, position_m: DVec3, time_ns: i64) -> Point {
    Point { position_m: site_from_sensor.point(position_m), time_ns, sensor: sensor as u16 }
}
