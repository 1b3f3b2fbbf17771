//! Tests faults: simulated sensors send packets over loopback to a live run, and one thing fails for some seconds. A
//! row of a table says what must happen, what happened, and how long it took until all was well again.
//!
//! ```sh
//! cargo run --release -p umbracast-live --example faults
//! ```

use std::fs;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use umbracast::lidar::{Assembler, Packet};
use umbracast::{Config, Error, Frame, Health, STEP_NS};
use umbracast_live::receive::{Arrived, Door};
use umbracast_live::record::RecordSettings;
use umbracast_live::run::Counters;
use umbracast_live::send::{self, Sent};
use umbracast_live::{HostClock, Live, Published, Settings, Summary};
use umbracast_sim::crowd::{Preset, strolling};
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

const PEOPLE: usize = 6;
const SEED: u64 = 100_700;
const S: i64 = 1_000_000_000;
/// A run lasts so long, and what fails fails between these times.
const RUN_S: u64 = 14;
const FAILS_NS: std::ops::Range<i64> = 4 * S..9 * S;

/// What is done to the packets of the time in which something fails, counted from the start of the run; packets may be held
/// back for later.
type Harm = fn(Arrived, &mut Vec<Arrived>) -> Vec<Arrived>;

struct Fault {
    name: &'static str,
    must: &'static str,
    harm: Harm,
    /// The folder of the recordings is taken away, too.
    disk: bool,
    /// The first sensor hangs so much askew, all the time, and the site file does not know it.
    askew_deg: f64,
}

const NOTHING: Fault =
    Fault { name: "nothing", must: "nothing", harm: |a, _| vec![a], disk: false, askew_deg: 0.0 };

const FAULTS: [Fault; 13] = [
    NOTHING,
    Fault {
        name: "one sensor silent for 5 s",
        must: "people are followed with the other one",
        harm: |a, _| if a.sensor == 0 { vec![] } else { vec![a] },
        ..NOTHING
    },
    Fault {
        name: "one packet of ten lost for 5 s",
        must: "counted, nobody lost",
        harm: |a, _| if one_of(10, &a) { vec![] } else { vec![a] },
        ..NOTHING
    },
    Fault {
        name: "every second packet lost for 5 s",
        must: "counted, people are followed",
        harm: |a, _| if one_of(2, &a) { vec![] } else { vec![a] },
        ..NOTHING
    },
    Fault {
        name: "one packet of a hundred corrupted for 5 s",
        must: "counted, nobody lost",
        harm: |a, _| vec![if one_of(100, &a) { corrupted(a) } else { a }],
        ..NOTHING
    },
    Fault {
        name: "every second packet corrupted for 5 s",
        must: "counted, frames go on",
        harm: |a, _| vec![if one_of(2, &a) { corrupted(a) } else { a }],
        ..NOTHING
    },
    Fault {
        name: "every packet cut in half for 5 s",
        must: "counted, all well after it",
        harm: |mut a, _| {
            a.packet.payload.truncate(a.packet.payload.len() / 2);
            vec![a]
        },
        ..NOTHING
    },
    Fault {
        name: "eight packets each in reverse order for 5 s",
        must: "no point lost but the last",
        harm: |a, held| {
            held.push(a);
            if held.len() < 8 { vec![] } else { held.drain(..).rev().collect() }
        },
        ..NOTHING
    },
    Fault {
        name: "one sensor hangs 5 deg askew",
        must: "told, people are followed",
        askew_deg: 5.0,
        ..NOTHING
    },
    Fault {
        name: "one sensor's clock half an hour off for 5 s",
        must: "shifted, counted, nobody lost",
        harm: |a, _| vec![if a.sensor == 0 { with_clock_moved(a, 1_800_000_000) } else { a }],
        ..NOTHING
    },
    Fault {
        name: "every packet ten times for 5 s",
        must: "repeated ones counted, no frame lost",
        harm: |a, _| vec![a; 10],
        ..NOTHING
    },
    Fault {
        name: "packets of zeros beside, as many, for 5 s",
        must: "counted, nobody lost",
        harm: |a, _| {
            let zeros = Packet { payload: vec![0; a.packet.payload.len()], ..a.packet };
            vec![Arrived { packet: zeros, ..a.clone() }, a]
        },
        ..NOTHING
    },
    Fault { name: "the disk gone for 5 s", must: "told, recording goes on after it", disk: true, ..NOTHING },
];

/// The microseconds within the hour that a Velodyne's packet ends with, moved: half an hour is as far as it can be told.
fn with_clock_moved(mut arrived: Arrived, by_us: u64) -> Arrived {
    let payload = &mut arrived.packet.payload;
    let at = payload.len() - 6;
    if let Some(bytes) = payload.get_mut(at..at + 4) {
        let us = u64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
        bytes.copy_from_slice(&(((us + by_us) % 3_600_000_000) as u32).to_le_bytes());
    }
    arrived
}

/// Whether this packet is among those chosen: about one of so many, by a hash of time and sensor.
fn one_of(many: u64, arrived: &Arrived) -> bool {
    let mixed = (arrived.packet.time_ns as u64 ^ arrived.sensor as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (mixed >> 33).is_multiple_of(many)
}

/// Every 97th byte is changed.
fn corrupted(mut arrived: Arrived) -> Arrived {
    arrived
        .packet
        .payload
        .iter_mut()
        .step_by(97)
        .for_each(|byte| *byte = byte.wrapping_mul(29).wrapping_add(113));
    arrived
}

/// What one frame was like: when it was published, who was followed, which sensors gave.
struct Seen {
    published_ns: i64,
    people: usize,
    sensors: usize,
}

fn main() -> Result<(), Error> {
    let config = Config::default();
    let sensors = Sensors::new(&config.site, SEED)?;
    let empty = empty_frames(&config)?;
    println!(
        "{:43} {:40} {:>10} {:>8} {:>8} {:>7} {:>7} {:>9}  what was counted",
        "what failed",
        "what must happen",
        "recovers,s",
        "gap, ms",
        "fewest",
        "frames",
        "skipped",
        "lost pkts"
    );
    for fault in FAULTS {
        run(&fault, &config, &sensors, &empty)?;
    }
    println!(
        "{PEOPLE} people, two HDL-32E over loopback. Recovers: from the end of the failure until everybody is followed with both \
         sensors again, and recorded where that failed. Gap: longest time between two frames. Fewest: people followed."
    );
    Ok(())
}

fn run(fault: &Fault, config: &Config, sensors: &Sensors, empty: &[Frame]) -> Result<(), Error> {
    let folder = std::env::temp_dir().join(format!("umbracast-faults-{}", std::process::id()));
    let (clock, counters) = (HostClock::start(), Arc::new(Counters::default()));
    let mut known = config.clone();
    known.site.sensors[0].rotation_deg.yaw -= fault.askew_deg;
    let settings = Settings {
        config: known,
        weights: None,
        empty: empty.to_vec(),
        doors: (0..config.site.sensors.len()).map(|sensor| Door { sensor, port: 0, from: None }).collect(),
        record: Some(RecordSettings {
            folder: folder.clone(),
            file_bytes: u64::MAX,
            file_s: 1,
            keep: None,
            points: false,
        }),
        clock,
        counters: counters.clone(),
        whole: Arc::default(),
    };
    let seen = Arc::new(Mutex::new(Vec::new()));
    let told = seen.clone();
    let listener = move |published: &Arc<Published>| {
        let seen = Seen {
            published_ns: published.published_ns,
            people: published.tracks.iter().filter(|track| track.confirmed).count(),
            sensors: published.sensors.iter().filter(|&&gave| gave).count(),
        };
        told.lock().expect("nobody panics with it").push(seen);
    };
    let live = Live::start(settings, Box::new(listener))?;
    let ports = live.receivers().bound().iter();
    let to: Vec<SocketAddr> = ports.map(|at| SocketAddr::from((Ipv4Addr::LOCALHOST, at.port()))).collect();
    let begun_ns = clock.now_ns();
    let disk = fault.disk.then(|| disk_that_goes(&folder, clock, begun_ns, counters));
    send_harmed(fault.harm, config, sensors, &to, clock)?;
    let recorded_ns = disk.and_then(|disk| disk.join().ok());
    let summary = live.stop();
    let _ = fs::remove_dir_all(&folder); // A temporary folder; what stays there hurts nobody.
    let seen = seen.lock().expect("nobody panics with it");
    tell(fault, &seen, begun_ns, recorded_ns, &summary);
    Ok(())
}

/// The scene's packets, harmed while the failure lasts.
fn send_harmed(
    harm: Harm,
    config: &Config,
    sensors: &Sensors,
    to: &[SocketAddr],
    clock: HostClock,
) -> Result<Sent, Error> {
    let first = send::frame_of_hour(clock.now_ns());
    let first_ns = first as i64 * STEP_NS;
    let crowd = strolling(Preset::Orca03, PEOPLE, 10.0, SEED, RUN_S).later(first_ns);
    let scene = Scene::in_hall(crowd, &config.site, sensors, SEED).starting_at(first);
    let mut held = Vec::new();
    let packets = send::simulated(scene).flat_map(|arrived| {
        match FAILS_NS.contains(&(arrived.packet.time_ns - first_ns)) {
            true => harm(arrived, &mut held),
            false => vec![arrived],
        }
    });
    send::send(packets, to, 1.0, clock, &AtomicBool::new(false))
}

/// A file stands where the folder was, so that no recording can be begun there; then the folder is back. Gives the
/// time from which on something is recorded again.
fn disk_that_goes(
    folder: &Path,
    clock: HostClock,
    begun_ns: i64,
    counters: Arc<Counters>,
) -> std::thread::JoinHandle<i64> {
    let (folder, aside) = (folder.to_owned(), folder.with_extension("aside"));
    std::thread::spawn(move || {
        clock.sleep_until(begun_ns + FAILS_NS.start);
        fs::rename(&folder, &aside).and_then(|()| fs::write(&folder, "")).expect("a temporary folder");
        clock.sleep_until(begun_ns + FAILS_NS.end);
        assert!(counters.recorder().failing.is_some(), "it was told");
        fs::remove_file(&folder).and_then(|()| fs::rename(&aside, &folder)).expect("a temporary folder");
        let before = counters.recorder().bytes;
        while counters.recorder().bytes == before && clock.now_ns() < begun_ns + RUN_S as i64 * S {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        clock.now_ns()
    })
}

fn tell(fault: &Fault, seen: &[Seen], begun_ns: i64, recorded_ns: Option<i64>, summary: &Summary) {
    let over_ns = begun_ns + FAILS_NS.end;
    let well = |seen: &&Seen| seen.published_ns >= over_ns && seen.people >= PEOPLE && seen.sensors == 2;
    let recovered_ns = seen.iter().find(well).map(|seen| seen.published_ns.max(recorded_ns.unwrap_or(0)));
    let recovers =
        recovered_ns.map_or("never".to_owned(), |ns| format!("{:.2}", (ns - over_ns) as f64 * 1e-9));
    let gap_ns = seen.windows(2).map(|pair| pair[1].published_ns - pair[0].published_ns).max().unwrap_or(0);
    let during = seen.iter().filter(|seen| FAILS_NS.contains(&(seen.published_ns - begun_ns)));
    let fewest = during.map(|seen| seen.people).min().unwrap_or(0);
    println!(
        "{:43} {:40} {recovers:>10} {:>8.0} {fewest:>8} {:>7} {:>7} {:>9}  {}",
        fault.name,
        fault.must,
        gap_ns as f64 * 1e-6,
        summary.frames,
        summary.frames_skipped,
        summary.packets_lost,
        counted(summary)
    );
}

/// What is not zero.
fn counted(summary: &Summary) -> String {
    let health = serde_json::to_value(summary.health).unwrap_or_default();
    let skipped = health
        .as_object()
        .into_iter()
        .flatten()
        .map(|(name, count)| (name.clone(), count.as_u64().unwrap_or(0)));
    let not_recorded = ("not_recorded".to_owned(), summary.recorded.lost);
    let told = skipped.chain([not_recorded]).filter(|(_, count)| *count > 0);
    told.map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
}

fn empty_frames(config: &Config) -> Result<Vec<Frame>, Error> {
    let (mut assembler, mut health) = (Assembler::new(&config.site)?, Health::default());
    for packets in Scene::empty(&config.site, SEED, 20)? {
        let of_sensor =
            |(sensor, packets): (usize, Vec<Packet>)| packets.into_iter().map(move |p| (sensor, p));
        let mut all: Vec<(usize, Packet)> = packets.into_iter().enumerate().flat_map(of_sensor).collect();
        all.sort_by_key(|(_, packet)| packet.time_ns);
        all.iter().for_each(|(sensor, packet)| assembler.push(*sensor, packet, &mut health));
    }
    assembler.finish();
    Ok(std::iter::from_fn(|| assembler.pop()).collect())
}
