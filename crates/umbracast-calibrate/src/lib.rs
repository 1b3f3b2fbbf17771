//! Where the sensors of a site hang, from a recording in which people walk.
//!
//! The floor tells each sensor's height, roll and pitch (`floor`, of what lies `still`). People tell how the sensors stand to
//! one another in plan view, and how their clocks differ: each sensor finds and follows them alone (`people`), the same people
//! are found among them without a guess (`matching`), and all sightings by two sensors at once are fitted together
//! (`joint`). The frame as a whole comes from the walls, where they are to be seen (`gauge`), else from the site file. Every
//! number comes with its standard deviation; what the data do not tell stays what the site file says.

mod plan;
pub mod floor;
mod still;
mod people;
mod matching;
mod hall;
mod normal;
mod joint;
mod gauge;
mod misfit;
mod calibration;
mod site_file;

pub use calibration::{Calibration, Found, Frame, Sigma, Weak};
pub use joint::Seen;
pub use plan::Plan;
pub use site_file::write_into;

use umbracast::geometry::DVec3;
use umbracast::lidar;
use umbracast::{Error, Site};

use floor::Level;
use people::Follower;
use still::Still;

/// Without an empty scan, what lies still is looked for in every so many-th frame.
const EVERY: u64 = 10;

/// Both looks at a recording of people who walk: at what lies still, then at the people. `empty` are frames without people; without
/// any, the recording is looked at twice. `frames` gives every frame of it from the first on to what it is handed.
///
/// # Errors
/// A floor that is not level, what `frames` fails with, and a fit without a solution.
pub fn of_recording(
    site: &Site,
    empty: &[lidar::Frame],
    mut frames: impl FnMut(&mut dyn FnMut(&lidar::Frame)) -> Result<(), Error>,
) -> Result<Calibration, Error> {
    let mut survey = Survey::new(site)?;
    empty.iter().for_each(|frame| survey.take(frame));
    if empty.is_empty() {
        frames(&mut |frame| {
            if frame.index.is_multiple_of(EVERY) {
                survey.take(frame);
            }
        })?;
    }
    let mut walkers = survey.level();
    empty.iter().for_each(|frame| walkers.learn_empty(frame));
    frames(&mut |frame| walkers.take(frame))?;
    walkers.finish()
}

/// The first look: what lies still. Frames without people are best; among others every tenth will do.
#[derive(Debug)]
pub struct Survey {
    site: Site,
    still: Vec<Still>,
}

impl Survey {
    /// Nothing was seen yet.
    ///
    /// # Errors
    /// A floor that is not level: sensors are levelled by it.
    pub fn new(site: &Site) -> Result<Self, Error> {
        match site.hall.floors.len() {
            0 => Ok(Self {
                site: site.clone(),
                still: site.sensors.iter().map(|_| Still::default()).collect(),
            }),
            count => Err(Error::new(format!(
                "site.hall.floors: expected none, for sensors are levelled by the floor, found {count}; calibrate where the \
                 floor is level"
            ))),
        }
    }

    /// Looks at a frame.
    pub fn take(&mut self, frame: &lidar::Frame) {
        for scan in &frame.scans {
            if let Some(still) = self.still.get_mut(scan.sensor) {
                still.take(scan);
            }
        }
    }

    /// True when more frames tell nothing more.
    pub fn is_enough(&self) -> bool {
        self.still.iter().all(Still::is_enough)
    }

    /// Levels every sensor by its floor.
    pub fn level(self) -> Walkers {
        let Self { site, still } = self;
        let hall = hall::Outline::new(&site);
        let sensors = still.into_iter().zip(&site.sensors).map(|(still, sensor)| {
            let (points_m, guess) = (still.points_m(), sensor.site_from_sensor());
            let level = floor::level(&points_m, &guess);
            let used = level.unwrap_or_else(|| as_given(sensor));
            let level_from_sensor = used.level_from_sensor();
            let upright_m = thinned(points_m.iter().map(|&p| level_from_sensor.point(p)), &hall);
            Walking { floor: level, level: used, upright_m, follower: Follower::new(sensor, used) }
        });
        Walkers { sensors: sensors.collect(), site }
    }
}

/// The second look: people, sensor by sensor.
#[derive(Debug)]
pub struct Walkers {
    site: Site,
    sensors: Vec<Walking>,
}

/// One sensor's.
#[derive(Debug)]
struct Walking {
    /// What the floor tells.
    floor: Option<Level>,
    /// That, or what the site file says.
    level: Level,
    upright_m: Vec<DVec3>,
    follower: Follower,
}

impl Walkers {
    /// Learns from a frame without people. Without any, the background is learned on the way.
    pub fn learn_empty(&mut self, frame: &lidar::Frame) {
        self.each(frame, |follower, scan| follower.learn_empty(frame.time_ns, scan));
    }

    /// Looks at the next frame.
    pub fn take(&mut self, frame: &lidar::Frame) {
        self.each(frame, |follower, scan| follower.take(frame.time_ns, scan));
    }

    fn each(&mut self, frame: &lidar::Frame, mut look: impl FnMut(&mut Follower, &lidar::Scan)) {
        for scan in &frame.scans {
            if let Some(sensor) = self.sensors.get_mut(scan.sensor) {
                look(&mut sensor.follower, scan);
            }
        }
    }

    /// Fits everything.
    ///
    /// # Errors
    /// A fit without a solution: nothing that was recorded leads there.
    pub fn finish(self) -> Result<Calibration, Error> {
        let outline = hall::Outline::new(&self.site);
        let (mut levels, mut seen) = (Vec::new(), Vec::new());
        for (walking, sensor) in self.sensors.into_iter().zip(&self.site.sensors) {
            let ways = walking.follower.finish();
            let guess = calibration::plan_of(sensor);
            levels.push((walking.floor, walking.level));
            seen.push(Seen { ways, upright_m: walking.upright_m, guess, ..Seen::default() });
        }
        calibration::fit(&self.site, &outline, &levels, seen)
    }
}

/// As the site file says.
fn as_given(sensor: &umbracast::site::Sensor) -> Level {
    Level {
        height_m: sensor.position_m[2],
        pitch_rad: sensor.rotation_deg.pitch.to_radians(),
        roll_rad: sensor.rotation_deg.roll.to_radians(),
        sigma: [f64::NAN; 3],
        far_from_file: false,
    }
}

/// Edge of the cubes of which one point each is kept, metres.
const CUBE_M: f64 = 0.25;
/// So many points of upright surfaces are enough.
const UPRIGHT_MAX: usize = 3000;

/// Points that may be of walls and furniture, near surfaces no denser than far ones.
fn thinned(points_m: impl Iterator<Item = DVec3>, hall: &hall::Outline) -> Vec<DVec3> {
    let mut kept = std::collections::BTreeMap::new();
    for point in points_m.filter(|point| hall.may_be_upright(point.z)) {
        let cube = (point / CUBE_M).floor().to_array().map(|edge| edge as i64);
        kept.entry(cube).or_insert(point);
    }
    let every = kept.len().div_ceil(UPRIGHT_MAX).max(1);
    kept.into_values().step_by(every).collect()
}
