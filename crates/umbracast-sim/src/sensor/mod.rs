//! Simulated LiDARs that give packets in the sensors' own format.
//!
//! The hall does not move and is traced once (`hall`). A frame looks it up and draws only the people into it
//! (`raster`), each column at the instant it fires (`head`), and their reflections in panes (`panes`). Then come
//! edges, noise, drop-outs, limits and the packet codec. A simulated sensor and a real one therefore enter the
//! pipeline in the same way.

mod head;
mod panes;
mod hall;
mod view;
mod gaps;
mod raster;
mod edges;
mod noise;
mod survey;

use std::ops::Range;
use std::sync::Arc;

use umbracast::geometry::{DVec3, Pose};
use umbracast::lidar::{Model, Packet, packet};
use umbracast::site::Sensor;
use umbracast::{Error, Site};

use self::hall::HallImage;
use self::head::Head;
use self::noise::Noise;
use self::panes::Panes;
use self::raster::Painter;
pub use self::survey::{Seen, Survey};
use self::view::{NOBODY, View};
use crate::body::Walker;

/// All sensors of a site in its hall. A clone shares the traced hall.
#[derive(Debug, Clone)]
pub struct Sensors {
    sensors: Vec<Simulated>,
    /// The view before, for its buffers.
    spent: Option<View>,
}

#[derive(Debug, Clone)]
struct Simulated {
    head: Head,
    outlook: Outlook,
    noise: Noise,
    /// Packets that are not wholly within are not sent.
    powered_ns: Range<i64>,
    /// From each of these times on it hangs elsewhere or more is there, and it sees this; in order of time.
    later: Vec<(i64, Outlook)>,
    /// Its clock before true time.
    ahead_ns: i64,
    open: OpenPacket,
}

/// What is seen from one place.
#[derive(Debug, Clone)]
struct Outlook {
    hall: Arc<HallImage>,
    painter: Painter,
    /// One a pane: draws what it reflects.
    reflected: Vec<Painter>,
}

/// The packet whose columns have not all fired yet.
#[derive(Debug, Clone, Default)]
struct OpenPacket {
    number: u64,
    /// One a column and beam; without return until fired.
    range_m: Vec<f32>,
    reflectivity: Vec<u8>,
}

impl Sensors {
    /// Traces the empty hall once for each sensor.
    ///
    /// # Errors
    /// A sensor model that cannot be simulated, a sensor that does not turn or hangs outside the hall.
    pub fn new(site: &Site, seed: u64) -> Result<Self, Error> {
        let simulate = |(number, sensor): (usize, &Sensor)| {
            Simulated::new(site, sensor, Noise::new(sensor, &site.simulation, seed, number as u64))
                .map_err(|error| error.within(format_args!("site.sensors.{}", sensor.name)))
        };
        let sensors = site.sensors.iter().enumerate().map(simulate).collect::<Result<_, _>>()?;
        Ok(Self { sensors, spent: None })
    }

    /// Begins another scene in the same hall: as [`Sensors::new`] with this seed, without tracing the hall again.
    pub fn restart(&mut self, seed: u64) {
        for sensor in &mut self.sensors {
            sensor.noise.reseed(seed);
            sensor.powered_ns = 0..i64::MAX;
            sensor.open = OpenPacket::default();
        }
    }

    /// Lets one sensor work only during a span of time: a sensor that is lost, one that starts within a
    /// revolution. Packets that do not lie wholly within the span are not sent.
    pub fn power(&mut self, sensor: usize, span_ns: Range<i64>) {
        self.sensors[sensor].powered_ns = span_ns;
    }

    /// The packets of frame `index` (one list a sensor) and, for each walker, how many returns came from its
    /// body, all sensors together. Frames must be asked for in order.
    ///
    /// A packet is sent when its last column fires, so that one which holds columns of two frames comes with the
    /// later. The returns are those of the columns that fire in this frame, as the assembler cuts frames.
    pub fn frame(&mut self, index: u64, walkers: &[Walker]) -> (Vec<Vec<Packet>>, Vec<u32>) {
        let mut returns = vec![0; walkers.len()];
        let spent = &mut self.spent;
        let packets = self.sensors.iter_mut().map(|s| s.frame(index, walkers, &mut returns, spent)).collect();
        (packets, returns)
    }

    /// At the end of a scene: the packets that wait for columns of the next frame, which are left without returns.
    pub fn flush(&mut self) -> Vec<Vec<Packet>> {
        self.sensors.iter_mut().map(|s| s.close().into_iter().collect()).collect()
    }
}

impl Simulated {
    fn new(site: &Site, sensor: &Sensor, noise: Noise) -> Result<Self, Error> {
        let model = Model::of_sensor(sensor)?;
        if !(sensor.rate_hz > 0.0 && sensor.rate_hz <= 50.0) {
            let found = sensor.rate_hz;
            return Err(Error::new(format!("rate_hz: expected more than 0 and at most 50, found {found}")));
        }
        let at_m = DVec3::from_array(sensor.position_m);
        let floor_m = site.hall.floor_m(at_m.truncate());
        if !(site.hall.clearance_m(at_m.truncate()) > 0.0 && at_m.z > floor_m && at_m.z < site.hall.height_m)
        {
            let [least_m, most_m] = site.hall.bounds_m();
            let (hall_m, found) = ((most_m - least_m).extend(site.hall.height_m), sensor.position_m);
            return Err(Error::new(format!(
                "position_m: expected a place within the hall of {hall_m} m, found {found:?}"
            )));
        }
        let site_from_sensor = sensor.site_from_sensor();
        let head = Head::new(model, sensor);
        let (slip, put_in) = (site.simulation.slip.get(&sensor.name), &site.simulation.put_in);
        let mut times_s: Vec<f64> =
            slip.iter().map(|slip| slip.after_s).chain(put_in.iter().map(|more| more.after_s)).collect();
        times_s.sort_by(f64::total_cmp);
        let later = times_s.into_iter().map(|time_s| {
            let slipped =
                slip.filter(|slip| slip.after_s <= time_s).map(|slip| slip.slipped(&site_from_sensor));
            let mut site = site.clone();
            let more = put_in.iter().filter(|more| more.after_s <= time_s).flat_map(|more| &more.furniture);
            site.furniture.extend(more.copied());
            ((time_s * 1e9) as i64, Outlook::new(&site, &slipped.unwrap_or(site_from_sensor), &head))
        });
        let later = later.collect();
        Ok(Self {
            outlook: Outlook::new(site, &site_from_sensor, &head),
            head,
            noise,
            powered_ns: 0..i64::MAX,
            later,
            ahead_ns: site.simulation.clock_ahead_ms.get(&sensor.name).map_or(0, |ms| (ms * 1e6) as i64),
            open: OpenPacket::default(),
        })
    }

    fn frame(
        &mut self,
        index: u64,
        walkers: &[Walker],
        returns: &mut [u32],
        spent: &mut Option<View>,
    ) -> Vec<Packet> {
        let mut view = self.look(index, walkers, spent.take());
        self.noise.measure(index, &mut view);
        let packets = self.send(&view, returns);
        *spent = Some(view);
        packets
    }

    /// What is really there.
    fn look(&mut self, index: u64, walkers: &[Walker], spent: Option<View>) -> View {
        let time_ns = index as i64 * umbracast::STEP_NS;
        let later = self.later.iter_mut().rev().find(|(after_ns, _)| time_ns >= *after_ns);
        let outlook = later.map_or(&mut self.outlook, |(_, outlook)| outlook);
        let mut view = View::of_hall(&outlook.hall, &self.head, index, spent);
        for (pane, painter) in (0..).zip(std::iter::once(&mut outlook.painter).chain(&mut outlook.reflected))
        {
            view.pane = pane;
            for (person, walker) in walkers.iter().enumerate() {
                painter.draw(walker, person as u32, &mut view);
            }
        }
        view
    }

    /// Puts the measured columns into packets and counts the returns of each body.
    fn send(&mut self, view: &View, returns: &mut [u32]) -> Vec<Packet> {
        let beams = view.image.beams.len();
        let per_packet = self.head.packet_columns();
        let mut packets = Vec::new();
        // Of the packet before.
        let mut powered = (u64::MAX, false);
        for c in 0..view.image.columns.len() {
            let column = view.first_column + c as u64;
            let (number, within) = (column / per_packet, (column % per_packet) as usize);
            self.open.start(number, per_packet as usize * beams);
            let (from, to) = (c * beams..(c + 1) * beams, within * beams..(within + 1) * beams);
            self.open.range_m[to.clone()].copy_from_slice(&view.image.range_m[from.clone()]);
            self.open.reflectivity[to].copy_from_slice(&view.image.reflectivity[from.clone()]);
            if powered.0 != number {
                powered = (number, self.is_powered(number));
            }
            if powered.1 {
                let seen = view.owner[from.clone()].iter().zip(&view.image.range_m[from]);
                for (&owner, _) in seen.filter(|&(&owner, &range_m)| owner != NOBODY && range_m > 0.0) {
                    returns[owner as usize] += 1;
                }
            }
            if within + 1 == per_packet as usize {
                packets.extend(self.close());
            }
        }
        packets
    }

    fn is_powered(&self, packet: u64) -> bool {
        let first = packet * self.head.packet_columns();
        self.powered_ns.start <= self.head.time_ns(first)
            && self.head.time_ns(first + self.head.packet_columns() - 1) < self.powered_ns.end
    }

    /// Sends the open packet at the time its last column fires; what it says of the time is its clock's.
    fn close(&mut self) -> Option<Packet> {
        let OpenPacket { number, range_m, reflectivity } = std::mem::take(&mut self.open);
        if range_m.is_empty() || !self.is_powered(number) {
            return None;
        }
        let mut columns = self.head.turn(number);
        let sent_ns = columns[columns.len() - 1].time_ns;
        columns.iter_mut().for_each(|column| column.time_ns += self.ahead_ns);
        Some(packet::encode(&self.head.model, &columns, &range_m, &reflectivity, sent_ns))
    }
}

impl Outlook {
    fn new(site: &Site, site_from_sensor: &Pose, head: &Head) -> Self {
        let painter = Painter::new(site_from_sensor, head);
        let reflected = |reflection: Pose| {
            let mut painter = painter.clone();
            painter.hang(site_from_sensor.inverse().after(&reflection));
            painter
        };
        Self {
            hall: Arc::new(HallImage::trace(site, head, site_from_sensor)),
            reflected: Panes::new(&site.simulation.panes).reflections().map(reflected).collect(),
            painter,
        }
    }
}

impl OpenPacket {
    /// Makes this the packet of that number, if it is not yet.
    fn start(&mut self, number: u64, rays: usize) {
        if self.number != number || self.range_m.is_empty() {
            *self = Self { number, range_m: vec![0.0; rays], reflectivity: vec![0; rays] };
        }
    }
}

#[cfg(test)]
mod oracle;
#[cfg(test)]
mod tests;
