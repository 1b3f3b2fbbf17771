//! Removes the points that belong to the empty scene.

use super::first_sight::of_people;
use super::placed::Placer;
use super::presence::Presence;
use super::sensor_model::{Clip, Learn, Look, SensorModel, unorganised_point};
use super::voxel::{Thinning, VoxelMap, thin};
use super::{Point, Prior, above_floor};
use crate::config::{BackgroundMethod, DetectConfig};
use crate::geometry::DVec3;
use crate::lidar::{Cloud, Scan};
use crate::shared::share;
use crate::{Frame, Health, Site};

/// Most foreground points kept of one frame: 100 people close to the sensors. Bounds the time of a frame.
const POINTS_MAX: usize = 40_000;
/// Threads share scans from so many on: fewer are done before another thread has begun.
const SHARED_FROM: usize = 4;
/// Voxels: hdl_people_tracking's edge.
const VOXEL_M: f64 = 0.2;
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
    presence: Presence,
    /// As many as may share the scans of a frame,
    threads: Vec<()>,
    /// and what each sensor gives them.
    found: Vec<(Health, Vec<Point>)>,
    map: Option<VoxelMap>,
    /// Scans that made the map.
    map_scans: u32,
    thinning: Thinning,
    /// For the voxels, which take every point of a frame; made with the first.
    placer: Option<Placer>,
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
        Self {
            method: config.background,
            thin_m: config.thin_m,
            sensors: site.sensors.iter().map(SensorModel::new).collect(),
            clip: Clip { hall: site.hall.clone(), highest_m: config.highest_m },
            presence: Presence::default(),
            threads: vec![()],
            found: Vec::new(),
            map: None,
            map_scans: 0,
            thinning: Thinning::default(),
            placer: None,
        }
    }

    /// Lets so many threads share the scans of a frame of many sensors. What is found does not depend on it.
    #[doc(hidden)] // `Pipeline::use_threads` calls it.
    pub fn use_threads(&mut self, threads: usize) {
        self.threads.resize(threads.max(1), ());
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
                self.sensors.iter_mut().for_each(SensorModel::know);
                let mut nothing = Vec::new();
                for scan in &frame.scans {
                    let Some(sensor) = self.sensors.get_mut(scan.sensor) else { continue };
                    let look = Look { scan, time_ns: frame.time_ns, clip: &self.clip, learn: Learn::Empty };
                    sensor.scan(look, &mut Health::default(), &mut nothing);
                }
            }
            BackgroundMethod::Voxels => {
                let mut points = Vec::new();
                self.points(frame, None, &mut Health::default(), &mut points);
                self.learn_map(&points);
            }
        }
    }

    /// The points that are new, in the site frame. Where no empty scan was learned, the background is learned
    /// on the way, but not where a person is expected; where one was, only furniture that was put there since.
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
                self.presence.renew(priors);
                self.scans(frame, health, points);
                self.forget_people(frame);
            }
            BackgroundMethod::Voxels => {
                self.new_points(frame, health, points);
                if self.thin_m == 0.0 {
                    // DP-means depends on the order; a thinned cloud has one already, its voxels'.
                    points.sort_unstable_by(in_space);
                }
            }
        }
        keep_most(points, health);
    }

    /// Forgets what a sensor has learned, for it hangs elsewhere now: it learns anew, on the way.
    #[doc(hidden)] // Of `mounting`.
    pub fn forget(&mut self, sensor: usize) {
        if let Some(model) = self.sensors.get_mut(sensor) {
            model.forget();
        }
    }

    /// Who stands there when a sensor begins to learn is not the hall.
    fn forget_people(&mut self, frame: &Frame) {
        let mut returns = Vec::new();
        for (i, scan) in frame.scans.iter().enumerate() {
            if let Some(sensor) = self.sensors.get(scan.sensor).filter(|sensor| sensor.begins()) {
                sensor.returns(i, scan, &mut returns);
            }
        }
        if returns.is_empty() {
            return;
        }
        for of in &mut returns {
            of.position_m = above_floor(&self.clip.hall, of.position_m);
        }
        let people = of_people(&returns);
        for (i, scan) in frame.scans.iter().enumerate() {
            let mut pixels: Vec<usize> = people.iter().filter(|r| r.scan == i).map(|r| r.pixel).collect();
            pixels.sort_unstable();
            pixels.dedup();
            if let Some(sensor) = self.sensors.get_mut(scan.sensor).filter(|_| !pixels.is_empty()) {
                sensor.forget_pixels(scan, &pixels);
            }
        }
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

    /// The points of a frame that lie where the map has none.
    fn new_points(&mut self, frame: &Frame, health: &mut Health, points: &mut Vec<Point>) {
        // Nine of ten points are the hall's: where they need not be thinned first, they are not even written down.
        let map = match self.map.take() {
            Some(map) if self.thin_m == 0.0 => {
                self.points(frame, Some(&map), health, points);
                map
            }
            map => {
                self.points(frame, None, health, points);
                // Without an empty scan the first cloud is the map, and nothing changes it after, as in the
                // adapted code: who stands in it is never seen.
                let map = map.unwrap_or_else(|| VoxelMap::new(VOXEL_M, points));
                points.retain(|point| map.is_new(point.position_m));
                map
            }
        };
        self.map = Some(map);
    }

    /// The points of a frame, of those that lie where a map has none, in the site frame, thinned where the config says so.
    fn points(
        &mut self,
        frame: &Frame,
        map: Option<&VoxelMap>,
        health: &mut Health,
        points: &mut Vec<Point>,
    ) {
        points.clear();
        let placer = self.placer.get_or_insert_with(Placer::new);
        for scan in &frame.scans {
            let Some(sensor) = self.sensors.get(scan.sensor) else { continue };
            let valid_m = [sensor.range_min_m, sensor.range_max_m];
            match &scan.cloud {
                Cloud::Organised(image) => placer.place(scan, image, valid_m, map, health, points),
                Cloud::Unorganised(cloud) => {
                    for point in cloud {
                        let range_m = DVec3::from(point.position_m.map(f64::from)).length() as f32;
                        let valid = range_m >= valid_m[0] && range_m <= valid_m[1];
                        health.points_invalid += u64::from(!valid);
                        let point = unorganised_point(scan, point);
                        if valid && map.is_none_or(|map| map.is_new(point.position_m)) {
                            points.push(point);
                        }
                    }
                }
            }
        }
        if self.thin_m > 0.0 {
            thin(points, self.thin_m, self.clip.hall.middle_m(), &mut self.thinning);
        }
    }

    /// Each scan against its sensor's range image; what is new goes to `points`.
    fn scans(&mut self, frame: &Frame, health: &mut Health, points: &mut Vec<Point>) {
        let Self { sensors, clip, presence, threads, found, .. } = self;
        let (clip, presence) = (&*clip, &*presence);
        let look = |sensor: &mut SensorModel, scan: &Scan, health: &mut Health, points: &mut Vec<Point>| {
            let learn =
                if sensor.is_known() { Learn::Furniture(presence) } else { Learn::OnTheWay(presence) };
            sensor.scan(Look { scan, time_ns: frame.time_ns, clip, learn }, health, points);
        };
        let one_of_each = frame.scans.is_sorted_by(|a, b| a.sensor < b.sensor);
        if threads.len() == 1 || frame.scans.len() < SHARED_FROM || !one_of_each {
            for scan in &frame.scans {
                if let Some(sensor) = sensors.get_mut(scan.sensor) {
                    look(sensor, scan, health, points);
                }
            }
            return;
        }
        found.resize_with(sensors.len(), Default::default);
        let scan_of = |number: usize| frame.scans.iter().find(|scan| scan.sensor == number);
        let each = sensors.iter_mut().zip(&mut *found).enumerate();
        let each = each.filter_map(|(number, (sensor, found))| Some((sensor, scan_of(number)?, found)));
        share(threads, each, |(), (sensor, scan, (health, points))| {
            points.clear();
            *health = Health::default();
            look(sensor, scan, health, points);
        });
        for (of_scan, new) in frame.scans.iter().filter_map(|scan| found.get(scan.sensor)) {
            health.add(of_scan);
            points.extend_from_slice(new);
        }
    }
}

/// Gives up, and counts, the points beyond what a frame may have.
pub fn keep_most(points: &mut Vec<Point>, health: &mut Health) {
    health.points_over_limit += points.len().saturating_sub(POINTS_MAX) as u64;
    points.truncate(POINTS_MAX);
}

/// An order that does not depend on how the points came.
fn in_space(a: &Point, b: &Point) -> std::cmp::Ordering {
    let key = |p: &Point| (p.sensor, p.time_ns);
    key(a).cmp(&key(b)).then_with(|| {
        let pairs = a.position_m.to_array().into_iter().zip(b.position_m.to_array());
        pairs.map(|(a, b)| a.total_cmp(&b)).fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
    })
}
