//! Joins the frames of several front ends by their time. Pure: the caller gives the time of day.
//!
//! A frame goes on when all awaited sensors have answered, or when it has waited long enough. A sensor that missed a
//! frame is no longer awaited. It is awaited again once it answers within the waiting time, as
//! [`umbracast::lidar::Assembler`] does with packets.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use umbracast::detect::{Detection, Point};
use umbracast::lidar::Views;
use umbracast::track::Track;
use umbracast::{Health, Site};
use umbracast_io::nodes::Foreground;

/// As many frames may wait: more than a second of them is a clock that runs wild.
const OPEN_MAX: usize = 16;
/// Closed frames whose beginning is remembered, to know whether a message that came too late was worth waiting for.
const REMEMBERED: usize = 8;
/// When nothing that could be used has come for so long, time is taken as it comes: somebody's clock was set.
const SILENCE_NS: i64 = 1_000_000_000;

/// Collects messages of front ends and gives frames in order of time.
#[derive(Debug)]
pub struct Join {
    /// The site's.
    sensors: Vec<Sensor>,
    wait_ns: i64,
    open: BTreeMap<i64, Open>,
    /// Time of the frame and when its first message came, newest last.
    closed: VecDeque<(i64, i64)>,
    last_ns: Option<i64>,
    /// When a message was used last.
    used_ns: Option<i64>,
    /// What was counted.
    pub counts: Counts,
}

/// What became of messages and frames.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Frames that went on without a sensor that they had waited for.
    pub incomplete: u64,
    /// Messages that came after their frame had gone on.
    pub late: u64,
    /// Messages of a sensor that had answered already: of a front end that is there twice.
    pub doubled: u64,
    /// Messages of another site.
    pub strangers: u64,
    /// Sensors that gave nothing to a frame, one a sensor and frame.
    pub sensors_missing: u64,
}

#[derive(Debug)]
struct Sensor {
    name: String,
    awaited: bool,
    /// Of the front end that answered for it last.
    health: Health,
}

#[derive(Debug)]
struct Open {
    /// When its first message came.
    since_ns: i64,
    /// Which sensors were answered for.
    covered: Vec<bool>,
    messages: Vec<Foreground>,
}

/// A frame of all front ends.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Joined {
    /// What the sensors could see, in the site's order; with the frame's time.
    pub views: Views,
    /// New points, in the site's order of sensors.
    pub foreground: Vec<Point>,
    /// Of all front ends and of the meeting.
    pub health: Health,
    /// When the last front end closed the frame, time of its host.
    pub closed_ns: i64,
    /// How long the slowest front end took.
    pub took_ns: i64,
    /// True where time does not go on from the frame before.
    pub anew: bool,
    /// Everybody that another perception saw, in place of the foreground.
    pub detections: Option<Vec<Detection>>,
    /// Everybody that another perception follows, in place of the tracker.
    pub tracks: Option<Vec<Track>>,
}

impl Join {
    /// For the sensors of a site; a frame waits so long for those that are late.
    pub fn new(site: &Site, wait: Duration) -> Self {
        let sensor = |sensor: &umbracast::site::Sensor| Sensor {
            name: sensor.name.clone(),
            awaited: true,
            health: Health::default(),
        };
        Self {
            sensors: site.sensors.iter().map(sensor).collect(),
            wait_ns: wait.as_nanos() as i64,
            open: BTreeMap::new(),
            closed: VecDeque::new(),
            last_ns: None,
            used_ns: None,
            counts: Counts::default(),
        }
    }

    /// The next frame is taken whatever its time; what is open is given up.
    pub fn begin_anew(&mut self) {
        (self.last_ns, self.closed) = (None, VecDeque::new());
        self.open.clear();
    }

    /// Takes a message that came at `now_ns`, time that only grows. What it says is within [`crate::bounds`], and of the hall's
    /// time.
    pub fn push(&mut self, message: Foreground, now_ns: i64) {
        let known = message.sensors.iter().eq(self.sensors.iter().map(|sensor| &sensor.name));
        let sensors = self.sensors.len();
        let within = message.covers.iter().all(|&s| (s as usize) < sensors);
        if !known || !within || message.covers.is_empty() {
            self.counts.strangers += 1;
            return;
        }
        let time_ns = message.time_ns;
        let silent = self.used_ns.is_none_or(|used_ns| now_ns - used_ns > SILENCE_NS);
        if self.last_ns.is_some_and(|last_ns| time_ns <= last_ns) {
            if !silent {
                return self.too_late(&message, now_ns);
            }
            self.begin_anew();
        }
        let open = self.open.entry(time_ns).or_insert_with(|| Open {
            since_ns: now_ns,
            covered: vec![false; sensors],
            messages: Vec::new(),
        });
        let new = |&s: &u32| !open.covered[s as usize];
        if !message.covers.iter().all(new) {
            self.counts.doubled += 1;
            return;
        }
        self.used_ns = Some(now_ns);
        for &s in &message.covers {
            open.covered[s as usize] = true;
            self.sensors[s as usize].awaited = true;
            self.sensors[s as usize].health = Health::default();
        }
        self.sensors[message.covers[0] as usize].health = message.health;
        open.messages.push(message);
    }

    /// A sensor whose message would have been in time, had the frame waited, is waited for again.
    fn too_late(&mut self, message: &Foreground, now_ns: i64) {
        self.counts.late += 1;
        let began = self.closed.iter().find(|(time_ns, _)| *time_ns == message.time_ns);
        if began.is_some_and(|(_, since_ns)| now_ns - since_ns <= self.wait_ns) {
            message.covers.iter().for_each(|&s| self.sensors[s as usize].awaited = true);
        }
    }

    /// The next frame that waits for nobody any more.
    pub fn pop(&mut self, now_ns: i64) -> Option<Joined> {
        let (_, first) = self.open.first_key_value()?;
        let whole = self.sensors.iter().zip(&first.covered).all(|(s, covered)| *covered || !s.awaited);
        let waited = now_ns - first.since_ns >= self.wait_ns || self.open.len() > OPEN_MAX;
        if !whole && !waited {
            return None;
        }
        let (time_ns, open) = self.open.pop_first()?;
        self.counts.incomplete += u64::from(!whole);
        let later = |s: usize| self.open.values().any(|open| open.covered[s]);
        let awaited: Vec<bool> = (0..self.sensors.len()).map(|s| open.covered[s] || later(s)).collect();
        self.sensors.iter_mut().zip(awaited).for_each(|(sensor, awaited)| sensor.awaited = awaited);
        self.closed.push_back((time_ns, open.since_ns));
        if self.closed.len() > REMEMBERED {
            self.closed.pop_front();
        }
        let anew = self.last_ns.replace(time_ns).is_none();
        Some(self.joined(time_ns, open.messages, anew))
    }

    /// When a frame will have waited long enough; `None` while none waits.
    pub fn due_ns(&self) -> Option<i64> {
        self.open.first_key_value().map(|(_, open)| open.since_ns + self.wait_ns)
    }

    fn joined(&mut self, time_ns: i64, messages: Vec<Foreground>, anew: bool) -> Joined {
        let mut joined = Joined { anew, ..Joined::default() };
        joined.views.time_ns = time_ns;
        joined.closed_ns = messages.iter().map(|message| message.closed_ns).max().unwrap_or(0);
        joined.took_ns = messages.iter().map(|message| message.took_ns).max().unwrap_or(0);
        let alone = messages.len() == 1;
        for message in messages {
            joined.views.of_scans.extend(message.views);
            joined.foreground.extend(message.points);
        }
        joined.views.of_scans.sort_by_key(|view| view.sensor);
        // One front end's points are in the order of its method already. Those of several are range images', each
        // sensor's points behind those of the one before it.
        if !alone {
            joined.foreground.sort_by_key(|point| point.sensor);
        }
        let missing = self.sensors.len() - joined.views.of_scans.len().min(self.sensors.len());
        self.counts.sensors_missing += missing as u64;
        self.sensors.iter().for_each(|sensor| joined.health.add(&sensor.health));
        joined.health.sensors_missing = self.counts.sensors_missing;
        joined.health.packets_late = joined.health.packets_late.saturating_add(self.counts.late);
        joined
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::geometry::{DVec3, Pose};
    use umbracast::lidar::View;
    use umbracast::{Config, STEP_NS};

    const MS: i64 = 1_000_000;

    fn join() -> Join {
        Join::new(&Config::default().site, Duration::from_millis(100))
    }

    /// A message of one sensor for the frame that ends at so many tenths of a second.
    fn message(sensor: u32, tenths: i64) -> Foreground {
        let point = Point {
            position_m: DVec3::new(f64::from(sensor), 0.0, 1.0),
            time_ns: tenths,
            sensor: sensor as u16,
        };
        Foreground {
            time_ns: tenths * STEP_NS,
            sensors: vec!["lidar_east".to_owned(), "lidar_west".to_owned()],
            covers: vec![sensor],
            views: vec![View { sensor: sensor as usize, site_from_sensor: Pose::IDENTITY, fan: None }],
            points: vec![point; 2],
            ..Foreground::default()
        }
    }

    fn sensors(joined: &Joined) -> Vec<u16> {
        joined.foreground.iter().map(|point| point.sensor).collect()
    }

    #[test]
    fn frames_meet_by_time_whatever_the_order_of_messages() {
        let mut join = join();
        join.push(message(1, 2), 0);
        join.push(message(1, 1), MS);
        join.push(message(0, 2), 2 * MS);
        assert!(join.pop(2 * MS).is_none(), "frame 1 is first, and waits");
        join.push(message(0, 1), 3 * MS);
        let frames: Vec<Joined> = std::iter::from_fn(|| join.pop(3 * MS)).collect();
        assert_eq!(frames.iter().map(|f| f.views.time_ns).collect::<Vec<_>>(), [STEP_NS, 2 * STEP_NS]);
        assert_eq!(sensors(&frames[0]), [0, 0, 1, 1], "in the site's order");
        assert!(frames[0].anew && !frames[1].anew && join.counts == Counts::default());
    }

    #[test]
    fn a_lost_front_end_is_waited_for_once_and_again_when_it_comes_back() {
        let mut join = join();
        (1..=3).for_each(|k| join.push(message(0, k), k * 100 * MS));
        assert!(join.pop(199 * MS).is_none());
        assert_eq!(join.due_ns(), Some(200 * MS));
        assert_eq!(join.pop(200 * MS).map(|f| sensors(&f)), Some(vec![0, 0]));
        assert!(join.pop(200 * MS).is_some() && join.pop(300 * MS).is_some(), "no more waiting");
        assert_eq!((join.counts.incomplete, join.counts.sensors_missing), (1, 3));
        join.push(message(1, 4), 400 * MS);
        assert!(join.pop(400 * MS).is_none(), "it waits for the other one");
        join.push(message(0, 4), 401 * MS);
        assert_eq!(join.pop(401 * MS).map(|f| sensors(&f)), Some(vec![0, 0, 1, 1]));
        join.push(message(0, 5), 500 * MS);
        assert!(join.pop(500 * MS).is_none(), "and for this one");
    }

    #[test]
    fn who_is_a_little_late_is_waited_for_again_and_who_is_very_late_is_not() {
        for (after_ms, awaited) in [(5, true), (150, false)] {
            let mut join = join();
            (1..=2).for_each(|k| join.push(message(0, k), k * 100 * MS));
            assert!(join.pop(200 * MS).is_some() && join.pop(200 * MS).is_some());
            join.push(message(1, 2), (200 + after_ms) * MS);
            join.push(message(0, 3), 400 * MS);
            assert_eq!((join.counts.late, join.pop(400 * MS).is_none()), (1, awaited), "{after_ms} ms");
        }
    }

    #[test]
    fn strangers_and_doubles_are_counted_and_a_clock_that_was_set_is_followed() {
        let mut join = join();
        let mut other = message(0, 1);
        other.sensors[1] = "door".to_owned();
        join.push(other, 0);
        join.push(Foreground { covers: vec![7], ..message(0, 1) }, 0);
        (0..2).for_each(|_| join.push(message(0, 1), 0));
        join.push(message(1, 1), 0);
        assert!(join.pop(0).is_some());
        assert_eq!((join.counts.strangers, join.counts.doubled), (2, 1));
        join.push(message(0, 1), 500 * MS);
        assert_eq!(join.counts.late, 1);
        join.push(message(0, 1), 1500 * MS);
        join.push(message(1, 1), 1500 * MS);
        assert!(join.pop(1500 * MS).is_some_and(|frame| frame.anew));
    }
}
