//! The front end beside the sensors: it turns packets, or a driver's clouds, into foreground, and sends only that.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use umbracast::config::BackgroundMethod;
use umbracast::detect::{Background, Prior};
use umbracast::lidar::{Assembler, Cloud, Scan, Views, sensor_model};
use umbracast::mounting::Mountings;
use umbracast::site::Sensor;
use umbracast::{Config, Error, Frame, Health, STEP_NS, Site};
use umbracast_io::fields;
use umbracast_io::nodes::{Foreground, Priors};
use umbracast_io::point_cloud::PointCloud;
use umbracast_live::HostClock;
use umbracast_live::receive::Arrived;

use crate::keys::front_end;
use crate::terms::Terms;

/// Without an empty scan, a front end waits so long for the priors of its frame while a tracker is there.
const PRIORS_WAIT: Duration = Duration::from_millis(50);
/// A clock that is so far back has been set anew.
const LEAP_NS: i64 = 1_000_000_000;
/// A tracker that has been silent for so long is not waited for.
const TRACKER_SILENT_NS: i64 = 1_000_000_000;

/// Packets or clouds in, foreground out.
#[derive(Debug)]
pub struct Front {
    assembler: Assembler,
    /// Of a front end that takes clouds: its sensor,
    of_clouds: Option<Sensor>,
    /// and the time of its last frame.
    last_ns: Option<i64>,
    mountings: Mountings,
    background: Background,
    /// Place in the site of each sensor that the assembler knows.
    own: Vec<usize>,
    names: Vec<String>,
    /// How long a frame waits for where people are expected. Not at all where the empty hall is known: then only furniture is
    /// learned, which has time.
    priors_wait: Duration,
    expected: Arc<Expected>,
    health: Health,
    /// Frames for which the priors did not come in time.
    priors_late: u64,
    clock: HostClock,
}

/// Where the tracker expects people: the newest that was heard.
#[derive(Debug, Default)]
pub struct Expected {
    newest: Mutex<Option<(Priors, i64)>>,
    terms: Mutex<Terms>,
    heard: Condvar,
}

impl Front {
    /// For those sensors of the site that `own` names by place. `empty` are frames of the whole site without people.
    ///
    /// # Errors
    /// A sensor that the site has not, or a method that takes the points of all sensors together where some are
    /// another front end's.
    pub fn new(
        config: &Config,
        own: &[usize],
        empty: &[Frame],
        expected: Arc<Expected>,
        clock: HostClock,
    ) -> Result<Self, Error> {
        let all = config.site.sensors.len();
        if own.is_empty() || own.iter().any(|&s| s >= all) {
            return Err(Error::new(format!(
                "sensors of the front end: expected some of {all}, found {own:?}"
            )));
        }
        if config.detect.background == BackgroundMethod::Voxels && own.len() < all {
            return Err(Error::new(format!(
                "mode {}: voxels are counted over the points of all sensors: expected one front end with all {all}, \
                 found {} of them in this one",
                config.mode.name(),
                own.len()
            )));
        }
        let sensors: Vec<Sensor> = own.iter().map(|&s| config.site.sensors[s].clone()).collect();
        let of_clouds = sensors.iter().find(|sensor| takes_clouds(sensor)).cloned();
        if let Some(sensor) = of_clouds.as_ref().filter(|_| own.len() > 1) {
            return Err(Error::new(format!(
                "sensor {:?} gives clouds: expected a front end of its own, found one of {} sensors",
                sensor.name,
                own.len()
            )));
        }
        let mut health = Health::default();
        let (mountings, background) = learned(config, empty, &mut health);
        let knows = !empty.is_empty() || config.detect.background == BackgroundMethod::Voxels;
        Ok(Self {
            assembler: Assembler::new(&Site { sensors, ..config.site.clone() })?,
            of_clouds,
            last_ns: None,
            mountings,
            background,
            own: own.to_vec(),
            names: config.site.sensors.iter().map(|sensor| sensor.name.clone()).collect(),
            priors_wait: if knows { Duration::ZERO } else { PRIORS_WAIT },
            expected,
            health,
            priors_late: 0,
            clock,
        })
    }

    /// Takes the hall without people, which came later, in place of what was learned on the way.
    pub fn take_empty(&mut self, config: &Config, empty: &[Frame]) {
        // What was skipped of the empty hall was skipped by whoever recorded it.
        (self.mountings, self.background) = learned(config, empty, &mut Health::default());
        self.priors_wait = Duration::ZERO;
    }

    /// Takes a packet, whose sensor is a place in the site, and gives what it closes to `sink`.
    pub fn push(&mut self, arrived: &Arrived, sink: impl FnMut(Foreground)) {
        let Some(sensor) = self.own.iter().position(|&s| s == arrived.sensor) else { return };
        self.assembler.push(sensor, &arrived.packet, &mut self.health);
        self.drain(sink);
    }

    /// Takes a cloud and gives it to `sink` as the frame of the nearest tenth of a second, in which it ends. A cloud of a frame
    /// that was given already is late, also where the driver's clock has leapt back by less than a second.
    pub fn push_cloud(&mut self, cloud: PointCloud, mut sink: impl FnMut(Foreground)) {
        let Some(sensor) = &self.of_clouds else { return };
        let over_ns = cloud.points.iter().map(|point| point.time_ns).max().unwrap_or(cloud.stamp_ns);
        let time_ns = over_ns.saturating_add(STEP_NS / 2).div_euclid(STEP_NS).saturating_mul(STEP_NS);
        self.health.points_invalid += cloud.dropped;
        if self.last_ns.is_some_and(|last_ns| (last_ns.saturating_sub(LEAP_NS)..=last_ns).contains(&time_ns))
        {
            self.health.packets_late += 1;
            return;
        }
        self.last_ns = Some(time_ns);
        let scan = Scan {
            sensor: self.own[0],
            site_from_sensor: sensor.site_from_sensor(),
            cloud: Cloud::Unorganised(cloud.points),
        };
        let index = time_ns.div_euclid(STEP_NS).unsigned_abs();
        sink(self.foreground(&Frame { index, time_ns, scans: vec![scan] }));
    }

    /// At the end of the packets: what is open.
    pub fn finish(&mut self, sink: impl FnMut(Foreground)) {
        self.assembler.finish();
        self.drain(sink);
    }

    /// Frames for which the priors did not come in time.
    pub fn priors_late(&self) -> u64 {
        self.priors_late
    }

    /// What was skipped since the start.
    pub fn health(&self) -> Health {
        self.health
    }

    fn drain(&mut self, mut sink: impl FnMut(Foreground)) {
        while let Some(mut frame) = self.assembler.pop() {
            for scan in &mut frame.scans {
                scan.sensor = self.own[scan.sensor];
            }
            sink(self.foreground(&frame));
        }
    }

    fn foreground(&mut self, frame: &Frame) -> Foreground {
        let closed_ns = self.clock.now_ns();
        let priors = self.priors(frame.time_ns);
        let begun_ns = self.clock.now_ns();
        let frame = &*frame.usable(&mut self.health);
        let frame = &*self.mountings.follow(frame, &mut self.health);
        self.mountings.moved().iter().for_each(|&sensor| self.background.forget(sensor));
        let mut points = Vec::new();
        self.background.foreground(frame, &priors, &mut self.health, &mut points);
        Foreground {
            time_ns: frame.time_ns,
            sensors: self.names.clone(),
            covers: self.own.iter().map(|&s| s as u32).collect(),
            views: Views::of(frame).of_scans,
            points,
            health: self.health,
            closed_ns,
            took_ns: self.clock.now_ns() - begun_ns,
        }
    }

    /// Those for the frame, or the newest that there are; then that is counted.
    fn priors(&mut self, time_ns: i64) -> Vec<Prior> {
        let (priors, in_time) = self.expected.at(time_ns, self.priors_wait, self.clock);
        self.priors_late += u64::from(!in_time && !self.priors_wait.is_zero());
        priors
    }
}

/// A front end's message; none where it is not understood, or covers other sensors than its key names.
pub fn heard(key: &str, bytes: &[u8]) -> Option<Foreground> {
    let foreground = fields::decode::<Foreground>(bytes)?;
    let named = key.rsplit('/').nth(1)?;
    (front_end(&foreground.sensors, &foreground.covers)? == named).then_some(foreground)
}

/// How sensors hang and what they see where nobody is, as frames of the empty hall show it.
fn learned(config: &Config, empty: &[Frame], health: &mut Health) -> (Mountings, Background) {
    let mut mountings = Mountings::new(&config.detect, &config.site);
    let mut background = Background::new(&config.detect, &config.site);
    for frame in empty {
        background.learn_empty(&mountings.follow(frame, health));
    }
    (mountings, background)
}

/// Whether a sensor sends no packets that are understood here, so that its driver's clouds stand for it.
pub fn takes_clouds(sensor: &Sensor) -> bool {
    sensor_model(&sensor.model) == Some("points")
}

impl Expected {
    /// Takes what was heard, if no newer leader is there.
    pub fn hear(&self, priors: Priors, now_ns: i64) {
        if !self.terms.lock().unwrap_or_else(PoisonError::into_inner).takes(priors.term, now_ns) {
            return;
        }
        let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        *newest = Some((priors, now_ns));
        drop(newest);
        self.heard.notify_all();
    }

    /// Waits for the priors of a frame while a tracker is there; whether they came in time, or nobody was there.
    fn at(&self, time_ns: i64, wait: Duration, clock: HostClock) -> (Vec<Prior>, bool) {
        let newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        let early = |newest: &mut Option<(Priors, i64)>| {
            newest.as_ref().is_some_and(|(priors, heard_ns)| {
                priors.time_ns < time_ns && clock.now_ns() - heard_ns < TRACKER_SILENT_NS
            })
        };
        let waited = self.heard.wait_timeout_while(newest, wait, early);
        let (newest, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match &*newest {
            Some((priors, _)) => (priors.priors.clone(), priors.time_ns == time_ns),
            None => (Vec::new(), true),
        }
    }
}
