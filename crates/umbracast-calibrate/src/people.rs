//! The people that one sensor sees, in its own level frame. The runtime's stages run for each sensor alone.

use std::collections::BTreeMap;

use umbracast::detect::{Background, Cluster, Clusterer, Detection, Measurer, Point, Prior};
use umbracast::geometry::{DVec2, DVec3};
use umbracast::lidar::{Frame, Scan, Views};
use umbracast::site::{Hall, Sensor};
use umbracast::track::{Track, Tracker};
use umbracast::{Config, Health, Site};

use crate::floor::Level;

/// A detection farther than this from its track is another one's.
const OWN_M: f64 = 0.6;
/// Sightings of one person follow one another within this, else what lies between is not known.
const GAP_NS: i64 = 350_000_000;
/// The velocity at a sighting is that of a line through all this near in time.
const LINE_NS: i64 = 450_000_000;
/// Shorter ways tell little, and are often no people.
const FEWEST: usize = 8;

/// One person at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// By the sensor's clock, as the frames have it.
    pub time_ns: i64,
    /// Of the body's axis, in the sensor's level frame.
    pub position_m: DVec2,
    /// Of the position's error, m^2.
    pub covariance_m2: [[f64; 2]; 2],
    /// By the sightings before and after.
    pub velocity_mps: DVec2,
}

/// One person followed by one sensor, in order of time.
pub type Way = Vec<Sighting>;

/// Follows the people before one sensor.
#[derive(Debug)]
pub struct Follower {
    background: Background,
    clusterer: Clusterer,
    measurer: Measurer,
    tracker: Tracker,
    level: Level,
    priors: Vec<Prior>,
    points: Vec<Point>,
    clusters: Vec<Cluster>,
    detections: Vec<Detection>,
    tracks: Vec<Track>,
    ways: BTreeMap<u64, Way>,
}

impl Follower {
    /// For a sensor of which no more is known than how it hangs over the floor.
    pub fn new(sensor: &Sensor, level: Level) -> Self {
        let mut config = Config::default();
        config.site = empty_site(sensor, &level, &config.site);
        let site = &config.site;
        Self {
            background: Background::new(&config.detect, site),
            clusterer: Clusterer::new(&config.detect, site),
            measurer: Measurer::new(&config.detect, site),
            tracker: Tracker::new(&config.track, site),
            level,
            priors: Vec::new(),
            points: Vec::new(),
            clusters: Vec::new(),
            detections: Vec::new(),
            tracks: Vec::new(),
            ways: BTreeMap::new(),
        }
    }

    /// Learns from a revolution without people.
    pub fn learn_empty(&mut self, time_ns: i64, scan: &Scan) {
        self.background.learn_empty(&self.alone(time_ns, scan));
    }

    /// One revolution through the stages that find and follow people.
    pub fn take(&mut self, time_ns: i64, scan: &Scan) {
        let frame = self.alone(time_ns, scan);
        self.tracker.priors(time_ns, &mut self.priors);
        let mut health = Health::default();
        self.background.foreground(&frame, &self.priors, &mut health, &mut self.points);
        self.clusterer.clusters(&self.points, &self.priors, &mut self.clusters);
        self.measurer.detections(&self.points, &self.clusters, &self.priors, &mut self.detections);
        self.tracker.update(&Views::of(&frame), &self.detections, &mut self.tracks);
        for track in self.tracks.iter().filter(|track| track.confirmed && track.points > 0) {
            let off_m = |d: &Detection| d.position_m.distance(track.position_m);
            let own = (self.detections.iter())
                .filter(|d| d.full_body && d.points == track.points && off_m(d) < OWN_M)
                .min_by(|a, b| off_m(a).total_cmp(&off_m(b)));
            let Some((own, covariance_m2)) = own.and_then(|own| Some((own, own.covariance_m2?))) else {
                continue;
            };
            self.ways.entry(track.id).or_default().push(Sighting {
                time_ns: own.time_ns,
                position_m: own.position_m,
                covariance_m2,
                velocity_mps: DVec2::ZERO,
            });
        }
    }

    /// Everybody who was seen long enough.
    pub fn finish(self) -> Vec<Way> {
        let mut ways: Vec<Way> = self.ways.into_values().filter(|way| way.len() >= FEWEST).collect();
        ways.iter_mut().for_each(|way| find_velocities(way));
        ways
    }

    fn alone(&self, time_ns: i64, scan: &Scan) -> Frame {
        let site_from_sensor = self.level.level_from_sensor();
        let scan = Scan { sensor: 0, site_from_sensor, cloud: scan.cloud.clone() };
        Frame { index: 0, time_ns, scans: vec![scan] }
    }
}

/// A hall without walls about the sensor.
fn empty_site(sensor: &Sensor, level: &Level, default: &Site) -> Site {
    let size_m = 2.0 * sensor.range_max_m;
    let mut sensor = sensor.clone();
    sensor.position_m = DVec3::new(0.0, 0.0, level.height_m).to_array();
    Site {
        hall: Hall {
            length_m: size_m,
            width_m: size_m,
            height_m: level.height_m + size_m,
            outline_m: Vec::new(),
            floors: Vec::new(),
        },
        pillars: Vec::new(),
        furniture: Vec::new(),
        sensors: vec![sensor],
        access_points: Vec::new(),
        ..default.clone()
    }
}

fn find_velocities(way: &mut [Sighting]) {
    for i in 0..way.len() {
        let now_ns = way[i].time_ns;
        let near = way.iter().filter(|s| (s.time_ns - now_ns).abs() <= LINE_NS);
        let (mut n, mut st, mut stt, mut sp, mut stp) = (0.0, 0.0, 0.0, DVec2::ZERO, DVec2::ZERO);
        for s in near {
            let t = (s.time_ns - now_ns) as f64 * 1e-9;
            (n, st, stt, sp, stp) = (n + 1.0, st + t, stt + t * t, sp + s.position_m, stp + s.position_m * t);
        }
        let spread = n * stt - st * st;
        if spread > 1e-9 {
            way[i].velocity_mps = (stp * n - sp * st) / spread;
        }
    }
}

/// The person at a time between two sightings, or nothing.
pub fn at(way: &[Sighting], time_ns: i64) -> Option<Sighting> {
    let next = way.partition_point(|s| s.time_ns < time_ns);
    let (before, after) = (way.get(next.checked_sub(1)?)?, way.get(next)?);
    let gap_ns = after.time_ns - before.time_ns;
    if gap_ns > GAP_NS {
        return None;
    }
    let share = (time_ns - before.time_ns) as f64 / gap_ns as f64;
    let between = |a: DVec2, b: DVec2| a + (b - a) * share;
    // The errors of two sightings that follow one another are much the same: no less is known between them.
    let nearer = if share < 0.5 { before } else { after };
    Some(Sighting {
        time_ns,
        position_m: between(before.position_m, after.position_m),
        covariance_m2: nearer.covariance_m2,
        velocity_mps: between(before.velocity_mps, after.velocity_mps),
    })
}
