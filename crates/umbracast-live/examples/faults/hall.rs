//! What the sensors see and send: people in the hall, and what is otherwise while something fails.

use std::net::SocketAddr;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

use umbracast::lidar::{Assembler, Packet};
use umbracast::{Config, Error, Frame, Health, STEP_NS, Site};
use umbracast_live::HostClock;
use umbracast_live::receive::Arrived;
use umbracast_live::send::{self, Sent};
use umbracast_sim::crowd::{Crowd, Preset, strolling};
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

use super::Fault;

pub const PEOPLE: usize = 6;
/// People stroll within so far of the middle of the hall.
const STROLL_M: f64 = 10.0;
const SEED: u64 = 100_700;
pub const S: i64 = 1_000_000_000;
/// What fails fails between these times of a run.
pub const FAILS_NS: Range<i64> = 4 * S..9 * S;

/// A hall with its sensors, traced once.
pub struct Hall {
    pub config: Config,
    sensors: Sensors,
    pub empty: Vec<Frame>,
}

impl Hall {
    /// The hall of the demonstration, but for this.
    pub fn of(change: fn(&mut Site)) -> Result<Self, Error> {
        let mut config = Config::default();
        change(&mut config.site);
        let (sensors, empty) = (Sensors::new(&config.site, SEED)?, empty_frames(&config.site)?);
        Ok(Self { config, sensors, empty })
    }

    /// Sends the packets of a run of so many seconds, harmed while the failure lasts.
    pub fn send(&self, fault: &Fault, to: &[SocketAddr], clock: HostClock) -> Result<Sent, Error> {
        let ahead_ns = fault.sensors_ahead_s * S;
        let first = send::frame_of_hour(clock.now_ns()) + (ahead_ns / STEP_NS) as u64;
        let first_ns = first as i64 * STEP_NS;
        let everybody = |people: usize| {
            strolling(Preset::Orca03, people.max(PEOPLE), STROLL_M, SEED, fault.seconds).later(first_ns)
        };
        let mut more = everybody(fault.people);
        let fewer = Crowd { trajectories: more.trajectories[..PEOPLE].to_vec(), ..more };
        if fault.people < PEOPLE {
            more = fewer.clone();
        }
        let mut otherwise = self.config.site.clone();
        (fault.meanwhile)(&mut otherwise);
        let changes = otherwise != self.config.site || fault.people > PEOPLE;
        let traced = if otherwise == self.config.site { None } else { Some(Sensors::new(&otherwise, SEED)?) };
        // One scene where nothing changes in the hall, else three: before, while, and after.
        let ends_ns: &[i64] = if changes { &[FAILS_NS.start, FAILS_NS.end, i64::MAX] } else { &[i64::MAX] };
        let begins_ns = [0, FAILS_NS.start, FAILS_NS.end];
        let scenes = begins_ns.into_iter().zip(ends_ns).map(|(begins_ns, ends_ns)| {
            let is_otherwise = changes && begins_ns == FAILS_NS.start;
            let crowd = if is_otherwise { more.clone() } else { fewer.clone() };
            let (site, sensors) = match &traced {
                Some(sensors) if is_otherwise => (&otherwise, sensors),
                _ => (&self.config.site, &self.sensors),
            };
            let scene = Scene::in_hall(crowd, site, sensors, SEED);
            let end_ns = first_ns.saturating_add(*ends_ns);
            let scene = scene.starting_at(first + (begins_ns / STEP_NS) as u64);
            send::simulated(scene).take_while(move |arrived| arrived.packet.time_ns < end_ns)
        });
        let mut held = Vec::new();
        let packets = scenes.flatten().flat_map(|mut arrived| {
            let fails = FAILS_NS.contains(&(arrived.packet.time_ns - first_ns));
            arrived.packet.time_ns -= ahead_ns;
            if fails { (fault.harm)(arrived, &mut held) } else { vec![arrived] }
        });
        send::send(packets, to, 1.0, clock, &AtomicBool::new(false))
    }
}

/// The packets of two seconds of the hall without people, sorted by time.
pub fn empty_packets(site: &Site) -> Result<Vec<Arrived>, Error> {
    let mut all = Vec::new();
    for packets in Scene::empty(site, SEED, 20)? {
        let of_sensor = |(sensor, packets): (usize, Vec<Packet>)| {
            packets.into_iter().map(move |packet| Arrived { sensor, packet })
        };
        all.extend(packets.into_iter().enumerate().flat_map(of_sensor));
    }
    all.sort_by_key(|arrived| arrived.packet.time_ns);
    Ok(all)
}

fn empty_frames(site: &Site) -> Result<Vec<Frame>, Error> {
    let (mut assembler, mut health) = (Assembler::new(site)?, Health::default());
    for Arrived { sensor, packet } in empty_packets(site)? {
        assembler.push(sensor, &packet, &mut health);
    }
    assembler.finish();
    Ok(std::iter::from_fn(|| assembler.pop()).collect())
}
