//! Cuts the packets of several sensors into frames by time.

use std::collections::{BTreeMap, VecDeque};
use std::ops::RangeInclusive;

use super::clock::{Clock, Now, near};
use super::model::TIME_LIMIT_NS;
use super::packet::decode;
use super::{Cloud, Column, Frame, Model, Packet, RangeImage, Scan, sensor_model};
use crate::geometry::Pose;
use crate::{Error, Health, STEP_NS, Site};

/// Collects packets and gives frames of 100 ms, counted from the first packet's time rounded down to a whole
/// tenth of a second: frame k of a simulated scene, which starts at time 0, covers [k, k + 1) x 100 ms.
///
/// A frame closes when every sensor has gone past its end, or one is a whole frame further. A sensor that gave
/// nothing to the last frame is not waited for. Frames without any packet are not given.
///
/// Each sensor's clock is its own. One that is not on the time of the others (more than a frame away from where
/// the time of reception puts it, from its first packet on or after a jump) is shifted there and counted, so
/// that a clock that was set, a sensor without one, or a broken time stamp loses no data. When all time leaps
/// (every sensor was silent, or the host's clock was set forward) one packet is given up to be sure. A site may say
/// that sensors share a clock, or have none that is set: [`TimeSource`](crate::site::TimeSource).
///
/// Memory: two frames beyond those that wait for [`pop`](Self::pop); call it after every push.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let packets = packets(360);
/// use umbracast::{Config, Health, lidar::Assembler};
///
/// let mut site = Config::default().site;
/// site.sensors.truncate(1); // the others would be waited for
/// let (mut assembler, mut health) = (Assembler::new(&site)?, Health::default());
/// let mut frames = 0;
/// for packet in packets {
///     assembler.push(0, &packet, &mut health);
///     frames += assembler.pop().into_iter().count();
/// }
/// // The second frame is still open: the next packet closes it, or `finish`.
/// assert_eq!(frames, 1);
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug)]
pub struct Assembler {
    sensors: Vec<Intake>,
    /// Start of frame 0; set by the first packet.
    origin_ns: Option<i64>,
    /// The first frame that is not closed.
    next: i64,
    /// By frame, then by sensor.
    open: BTreeMap<i64, BTreeMap<usize, RangeImage>>,
    closed: VecDeque<Frame>,
    /// Where the packets so far put the time.
    now: Option<Now>,
    /// Where the packet before would have taken the time, more than a frame ahead: believed when a second says so.
    leap_ns: Option<i64>,
    /// From the clock that sensors share to the time of the frames.
    shared_shift_ns: i64,
    /// Those of the packet at hand.
    columns: Columns,
    /// Whether the packet taken last has given something to the frame that it closed.
    gave: bool,
}

/// Columns with a range and a reflectivity a beam.
#[derive(Debug, Default)]
struct Columns {
    column: Vec<Column>,
    range_m: Vec<f32>,
    reflectivity: Vec<u8>,
}

/// Columns come as evenly as this, as a share of their period.
const HAIR: f64 = 0.01;

/// Room for more columns than this is not made before they come: the finest sensor gives half as many to a frame.
const ROOM_COLUMNS: usize = 4096;

/// What the assembler knows of one sensor.
#[derive(Debug)]
struct Intake {
    /// None for a sensor known only by its clouds, which sends no packets.
    model: Option<Model>,
    site_from_sensor: Pose,
    valid_range_m: RangeInclusive<f32>,
    /// So far its times, and those at which its packets come, are ahead of the other sensors'.
    ahead_ns: i64,
    /// From its own clock to the time of the frames.
    clock: Clock,
    /// Whether frames wait for it.
    awaited: bool,
}

impl Assembler {
    /// For the sensors of a site.
    ///
    /// ```
    /// use umbracast::{Config, lidar::Assembler};
    ///
    /// let mut site = Config::default().site;
    /// assert!(Assembler::new(&site).is_ok());
    /// site.sensors[0].model = "camera".to_owned();
    /// assert!(Assembler::new(&site).unwrap_err().to_string().contains("found \"camera\""));
    /// ```
    ///
    /// # Errors
    /// A sensor model that is not known, or a file of the sensor's own that is not understood.
    pub fn new(site: &Site) -> Result<Self, Error> {
        let intake = |sensor: &crate::site::Sensor| {
            let model = match sensor_model(&sensor.model) {
                Some("points") => None,
                _ => Some(
                    Model::of_sensor(sensor).map_err(|e| e.within(format!("sensor {:?}", sensor.name)))?,
                ),
            };
            Ok(Intake {
                awaited: model.is_some(),
                model,
                site_from_sensor: sensor.site_from_sensor(),
                valid_range_m: sensor.range_min_m as f32..=sensor.range_max_m as f32,
                ahead_ns: (sensor.clock_offset_ms * 1e6).round() as i64,
                clock: Clock::new(sensor.time),
            })
        };
        Ok(Self {
            sensors: site.sensors.iter().map(intake).collect::<Result<_, Error>>()?,
            origin_ns: None,
            next: 0,
            open: BTreeMap::new(),
            closed: VecDeque::new(),
            now: None,
            leap_ns: None,
            shared_shift_ns: 0,
            columns: Columns::default(),
            gave: false,
        })
    }

    /// Takes one packet of `site.sensors[sensor]`.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let packet = packets(1).remove(0);
    /// use umbracast::{Config, Health, lidar::Assembler};
    ///
    /// let (mut assembler, mut health) = (Assembler::new(&Config::default().site)?, Health::default());
    /// assembler.push(0, &packet, &mut health);
    /// assembler.push(0, &packet, &mut health);
    /// assert_eq!(health.packets_duplicate, 1);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn push(&mut self, sensor: usize, packet: &Packet, health: &mut Health) {
        let Some(model) = self.sensors.get(sensor).and_then(|s| s.model.clone()) else {
            health.packets_not_understood += 1;
            return;
        };
        let columns = &mut self.columns;
        columns.clear();
        let ahead_ns = self.sensors[sensor].ahead_ns;
        let received_ns = packet.time_ns.saturating_sub(ahead_ns);
        decode(&model, packet, health, |column, range_m, reflectivity| {
            let time_ns = column.time_ns.saturating_sub(ahead_ns);
            columns.push(Column { time_ns, ..column }, range_m, reflectivity)
        });
        let (Some(first), Some(last)) = (columns.column.first(), columns.column.last()) else { return };

        let intake = &mut self.sensors[sensor];
        let own_ns = (first.time_ns, last.time_ns);
        let (shift_ns, jumped) =
            intake.clock.settle(own_ns, received_ns, self.now, &mut self.shared_shift_ns);
        health.clock_jumps += u64::from(jumped);
        let first_ns = first.time_ns.saturating_add(shift_ns);
        let last_ns = last.time_ns.saturating_add(shift_ns);
        let origin_ns = self.origin_ns.unwrap_or(first_ns - first_ns.rem_euclid(STEP_NS));
        let spans_ns =
            [first_ns, last_ns, first_ns.saturating_sub(origin_ns), last_ns.saturating_sub(origin_ns)];
        if spans_ns.iter().any(|ns| ns.unsigned_abs() >= TIME_LIMIT_NS) {
            health.packets_not_understood += 1;
            return;
        }
        let leaps = self.now.is_some_and(|now| first_ns.saturating_sub(now.time_ns) > STEP_NS);
        if leaps && !self.leap_ns.is_some_and(|leap_ns| near(first_ns, leap_ns)) {
            health.clock_jumps += u64::from(!jumped);
            self.leap_ns = Some(first_ns);
            return;
        }
        self.leap_ns = None;
        self.origin_ns = Some(origin_ns);
        intake.clock.shift_ns = shift_ns;
        let before_ns = intake.clock.newest_ns;
        intake.clock.newest_ns = before_ns.max(Some(last_ns));
        if !jumped {
            self.now = Some(Now::after(self.now, first_ns, received_ns));
        }
        let (next, number) = (self.next, frame_number(self.origin_ns, first_ns));
        self.store(sensor, &model, before_ns, health);
        self.close_ready(health);
        self.gave = (next..self.next).contains(&number);
    }

    /// Whether the packet that was pushed last gave something to a frame that it closed: else that frame had been whole since
    /// the packet before.
    ///
    /// ```
    /// use umbracast::{Config, lidar::Assembler};
    ///
    /// assert!(!Assembler::new(&Config::default().site)?.closed_by_its_own(), "nothing was pushed");
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn closed_by_its_own(&self) -> bool {
        self.gave
    }

    /// The next closed frame.
    ///
    /// ```
    /// use umbracast::{Config, lidar::Assembler};
    ///
    /// assert!(Assembler::new(&Config::default().site)?.pop().is_none(), "nothing was pushed");
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn pop(&mut self) -> Option<Frame> {
        self.closed.pop_front()
    }

    /// At the end of the input: closes what is open, without counting the sensors that these frames lack.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let packet = packets(1).remove(0);
    /// use umbracast::{Config, Health, lidar::Assembler};
    ///
    /// let mut assembler = Assembler::new(&Config::default().site)?;
    /// assembler.push(0, &packet, &mut Health::default());
    /// assert!(assembler.pop().is_none(), "the frame is open");
    /// assembler.finish();
    /// assert_eq!(assembler.pop().map(|frame| frame.time_ns), Some(100_000_000));
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn finish(&mut self) {
        while let Some((number, images)) = self.open.pop_first() {
            self.close(number, images, &mut Health::default());
        }
    }

    /// Puts the columns of the packet at hand into their frames; before it the sensor's newest was of `before_ns`.
    fn store(&mut self, sensor: usize, model: &Model, before_ns: Option<i64>, health: &mut Health) {
        let intake = &mut self.sensors[sensor];
        let beams = model.beams.len();
        let (mut late, mut duplicate) = (false, false);
        for (c, &column) in self.columns.column.iter().enumerate() {
            let column = Column { time_ns: column.time_ns + intake.clock.shift_ns, ..column };
            let mut number = frame_number(self.origin_ns, column.time_ns);
            // A frame closes when the next column is due after its end: one that then comes sooner is of the next.
            let sooner_ns = (model.column_period_ns / 2.0) as i64;
            let is_new = before_ns.is_some_and(|before_ns| column.time_ns > before_ns);
            if is_new && frame_number(self.origin_ns, column.time_ns.saturating_add(sooner_ns)) == self.next {
                number = self.next;
            }
            if number < self.next {
                // What comes before the first frame has none to be late for: a clock that is put right begins a little before.
                late |= number >= 0;
                continue;
            }
            let image = self.open.entry(number).or_default().entry(sensor).or_insert_with(|| {
                let columns = ((STEP_NS as f64 / model.column_period_ns) as usize + 1).min(ROOM_COLUMNS);
                RangeImage {
                    beams: model.beams.clone(),
                    columns: Vec::with_capacity(columns),
                    range_m: Vec::with_capacity(columns * beams),
                    reflectivity: Vec::with_capacity(columns * beams),
                }
            });
            // Columns come in order but for packets that overtook one another.
            let at = match image.columns.last() {
                Some(last) if last.time_ns >= column.time_ns => {
                    image.columns.partition_point(|other| other.time_ns < column.time_ns)
                }
                _ => image.columns.len(),
            };
            let apart = |other: &Column| {
                (other.time_ns - column.time_ns).unsigned_abs() as f64 >= model.column_period_ns / 2.0
            };
            if !image.columns[at.saturating_sub(1)..].iter().take(2).all(apart) {
                duplicate = true;
                continue;
            }
            intake.awaited = true;
            image.columns.insert(at, column);
            let cells = c * beams..(c + 1) * beams;
            let range_m = &self.columns.range_m[cells.clone()];
            let (least_m, most_m) = (*intake.valid_range_m.start(), *intake.valid_range_m.end());
            let valid = |range_m: f32| range_m == 0.0 || (range_m >= least_m && range_m <= most_m);
            health.points_invalid += range_m.iter().filter(|&&range_m| !valid(range_m)).count() as u64;
            let range_m = range_m.iter().map(|&range_m| if valid(range_m) { range_m } else { 0.0 });
            // To the end, and from there to where they belong: most are there already.
            image.range_m.extend(range_m);
            image.range_m[at * beams..].rotate_right(beams);
            image.reflectivity.extend_from_slice(&self.columns.reflectivity[cells]);
            image.reflectivity[at * beams..].rotate_right(beams);
        }
        health.packets_late += u64::from(late);
        health.packets_duplicate += u64::from(duplicate);
    }

    /// Closes every frame that waits for no sensor any more.
    fn close_ready(&mut self, health: &mut Health) {
        while let Some((&number, images)) = self.open.first_key_value() {
            let reached = |s: &Intake| s.clock.newest_ns.map(|ns| frame_number(self.origin_ns, ns));
            let end_ns = self.origin_ns.unwrap_or(0) + (number + 1) * STEP_NS;
            let is_past = |(i, s): (usize, &Intake)| {
                !s.awaited || reached(s) > Some(number) || s.is_whole(images.get(&i), end_ns)
            };
            let all_past = self.sensors.iter().enumerate().all(is_past);
            let one_far_past = self.sensors.iter().any(|s| reached(s) > Some(number + 1));
            if !all_past && !one_far_past {
                break;
            }
            let images = self.open.remove(&number).unwrap_or_default();
            self.close(number, images, health);
        }
    }

    fn close(&mut self, number: i64, images: BTreeMap<usize, RangeImage>, health: &mut Health) {
        let with_packets = self.sensors.iter().filter(|s| s.model.is_some()).count();
        let frames = number + 1 - self.next;
        health.sensors_missing += frames as u64 * with_packets as u64 - images.len() as u64;
        self.next = number + 1;
        for (s, sensor) in self.sensors.iter_mut().enumerate() {
            sensor.awaited = images.contains_key(&s);
        }
        let scans = images.into_iter().map(|(sensor, image)| Scan {
            sensor,
            site_from_sensor: self.sensors[sensor].site_from_sensor,
            cloud: Cloud::Organised(image),
        });
        self.closed.push_back(Frame {
            index: number as u64,
            time_ns: self.origin_ns.unwrap_or(0) + (number + 1) * STEP_NS,
            scans: scans.collect(),
        });
    }
}

impl Intake {
    /// Whether nothing of a frame that ends at `end_ns` can come any more: from its first column to its last none is missing, and
    /// the next one is of the next frame. Some sensors' packets end where frames do, and the next one comes 1.5 ms later.
    fn is_whole(&self, image: Option<&RangeImage>, end_ns: i64) -> bool {
        let (Some(model), Some(image)) = (&self.model, image) else { return false };
        let (Some(first), Some(last)) = (image.columns.first(), image.columns.last()) else { return false };
        let period_ns = model.column_period_ns;
        let columns = (last.time_ns - first.time_ns) as f64 / period_ns;
        let from_end = |time_ns: i64| (end_ns - time_ns) as f64;
        from_end(last.time_ns) <= period_ns * (1.0 + HAIR)
            && from_end(first.time_ns) > STEP_NS as f64 - period_ns
            && image.columns.len() as f64 > columns + 0.5
    }
}

impl Columns {
    fn clear(&mut self) {
        self.column.clear();
        self.range_m.clear();
        self.reflectivity.clear();
    }

    fn push(&mut self, column: Column, range_m: &[f32], reflectivity: &[u8]) {
        self.column.push(column);
        self.range_m.extend_from_slice(range_m);
        self.reflectivity.extend_from_slice(reflectivity);
    }
}

fn frame_number(origin_ns: Option<i64>, time_ns: i64) -> i64 {
    (time_ns - origin_ns.unwrap_or(0)).div_euclid(STEP_NS)
}

#[cfg(test)]
#[path = "assemble_tests.rs"]
mod tests;
