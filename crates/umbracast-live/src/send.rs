//! Sends packets at the times they carry, for simulated sensors and recordings. The receiver sees them as real
//! sensors.

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;

use umbracast::lidar::Packet;
use umbracast::{Error, STEP_NS, Site};
use umbracast_sim::crowd::{Crowd, Stroll};
use umbracast_sim::scene::{Scene, SceneFrame};
use umbracast_sim::sensor::Sensors;

use crate::clock::HostClock;
use crate::receive::Arrived;

/// Packets that are made ahead of their time: about a second of two HDL-32E.
const AHEAD: usize = 4096;
/// From a packet to the next one of the same recording.
const SAME_PACE_NS: std::ops::Range<i64> = -STEP_NS..100 * STEP_NS;

/// People who stroll are simulated so far at a time: their ways take some 60 kB a person and leg, twice.
const LEG_S: u64 = 30;
/// Frames.
const STEPS_PER_S: i64 = 1_000_000_000 / STEP_NS;

/// What was sent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sent {
    /// Packets.
    pub packets: u64,
    /// Packets that the system did not take.
    pub failed: u64,
    /// The packet that left latest after its time, by so much.
    pub latest_ns: i64,
}

impl Sent {
    /// Together with what was sent before or after.
    pub fn add(&mut self, more: &Self) {
        self.packets += more.packets;
        self.failed += more.failed;
        self.latest_ns = self.latest_ns.max(more.latest_ns);
    }
}

/// Sends packets, each `rate` times as fast as the times they carry follow one another. `to` has an address for each
/// sensor; all packets leave from a socket of their sensor's own. Ends with the packets or when `stop` is set.
///
/// # Errors
/// No socket to send from.
pub fn send(
    packets: impl Iterator<Item = Arrived>,
    to: &[SocketAddr],
    rate: f64,
    clock: HostClock,
    stop: &AtomicBool,
) -> Result<Sent, Error> {
    let sockets = to
        .iter()
        .map(|_| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| Error::new(format!("a socket to send from: {e}")))?;
    let mut sent = Sent::default();
    let mut pace = None;
    for Arrived { sensor, packet } in packets {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        let (Some(socket), Some(to)) = (sockets.get(sensor), to.get(sensor)) else { continue };
        // Another recording, or a long silence: the pace begins anew.
        let (host_ns, packet_ns) = match pace {
            Some((host_ns, packet_ns, last_ns)) if SAME_PACE_NS.contains(&(packet.time_ns - last_ns)) => {
                (host_ns, packet_ns)
            }
            _ => (clock.now_ns(), packet.time_ns),
        };
        pace = Some((host_ns, packet_ns, packet.time_ns));
        let due_ns = host_ns + ((packet.time_ns - packet_ns) as f64 / rate) as i64;
        clock.sleep_until(due_ns);
        sent.latest_ns = sent.latest_ns.max(clock.now_ns() - due_ns);
        match socket.send_to(&packet.payload, to) {
            Ok(_) => sent.packets += 1,
            // Nobody listens yet: the next one may be heard.
            Err(_) => sent.failed += 1,
        }
    }
    Ok(sent)
}

/// Where each of so many sensors' packets go: those without an address follow the last one that is given, on the ports
/// that follow its.
pub fn addresses(sensors: usize, given: &[SocketAddr]) -> Vec<SocketAddr> {
    let of_sensor = |sensor: usize| {
        given.get(sensor).copied().or_else(|| {
            let (last, further) = (given.last()?, (sensor + 1).saturating_sub(given.len()));
            Some(SocketAddr::new(last.ip(), last.port().saturating_add(further as u16)))
        })
    };
    (0..sensors).filter_map(of_sensor).collect()
}

/// The same packets from a thread of their own, which is some frames ahead: what takes long to make leaves in time all the
/// same.
pub fn ahead(
    packets: impl Iterator<Item = Arrived> + Send + 'static,
) -> impl Iterator<Item = Arrived> + Send + 'static {
    let (made, coming) = mpsc::sync_channel(AHEAD);
    std::thread::spawn(move || {
        give_way();
        // Nobody takes them any more: the end.
        for packet in packets {
            if made.send(packet).is_err() {
                break;
            }
        }
    });
    coming.into_iter()
}

/// Lets other threads run before this one: sensors of a hall have a computer of their own, and simulated ones shall not
/// delay who listens to them. Only Linux gives a thread a priority, and where it refuses nothing is lost.
fn give_way() {
    #[cfg(target_os = "linux")]
    let _ = rustix::process::nice(10);
}

/// The packets of a simulated scene in the order in which they are sent.
pub fn simulated(mut scene: Scene) -> impl Iterator<Item = Arrived> {
    std::iter::from_fn(move || scene.next_frame()).flat_map(in_order)
}

/// The packets of people who stroll for good, from frame `first` on. A thread draws up the next leg of their way while
/// they walk this one, so that nobody waits for it; it ends when the packets are wanted no more.
pub fn strolling(
    mut stroll: Stroll,
    site: Site,
    sensors: Sensors,
    seed: u64,
    first: u64,
) -> impl Iterator<Item = Arrived> {
    let (legs, next_leg) = mpsc::sync_channel(0);
    let nobody = Crowd { trajectories: Vec::new(), duration_ns: 0 };
    let mut scene = Scene::in_hall(nobody, &site, &sensors, seed).starting_at(first);
    std::thread::spawn(move || {
        give_way();
        for leg in 0.. {
            let begins_ns = (first as i64 + leg * LEG_S as i64 * STEPS_PER_S) * STEP_NS;
            let scene = Scene::truth_only(stroll.leg(LEG_S).later(begins_ns), &site, seed);
            if legs.send(scene).is_err() {
                break;
            }
        }
    });
    let frames = std::iter::from_fn(move || {
        scene.next_frame().or_else(|| {
            scene.go_on(next_leg.recv().ok()?);
            scene.next_frame()
        })
    });
    frames.flat_map(in_order)
}

fn in_order(frame: SceneFrame) -> Vec<Arrived> {
    let of_sensor = |(sensor, packets): (usize, Vec<Packet>)| {
        packets.into_iter().map(move |packet| Arrived { sensor, packet })
    };
    let mut all: Vec<Arrived> = frame.packets.into_iter().enumerate().flat_map(of_sensor).collect();
    all.sort_by_key(|arrived| arrived.packet.time_ns);
    all
}

/// The frame of a scene that agrees with a time of day within the hour: sensors tell no more, and who receives them
/// takes the hour from his own clock.
pub fn frame_of_hour(time_ns: i64) -> u64 {
    (time_ns.rem_euclid(3_600_000_000_000) / STEP_NS) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_without_an_address_follow_the_last_one() {
        let to: Vec<SocketAddr> = vec!["10.0.0.1:7502".parse().unwrap(), "10.0.0.2:2368".parse().unwrap()];
        let found: Vec<String> = addresses(4, &to).iter().map(SocketAddr::to_string).collect();
        assert_eq!(found, ["10.0.0.1:7502", "10.0.0.2:2368", "10.0.0.2:2369", "10.0.0.2:2370"]);
    }

    #[test]
    fn what_is_made_ahead_comes_whole_and_in_order() {
        let packet = |k: i64| Arrived { sensor: 0, packet: Packet { time_ns: k, payload: vec![k as u8; 4] } };
        let taken: Vec<i64> = ahead((0..3 * AHEAD as i64).map(packet)).map(|a| a.packet.time_ns).collect();
        assert!(taken.into_iter().eq(0..3 * AHEAD as i64));
        // Whoever leaves early leaves nobody behind.
        assert_eq!(ahead((0..).map(packet)).take(2).count(), 2);
    }
}
