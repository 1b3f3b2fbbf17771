//! Tests faults: simulated sensors send packets over loopback to a live run, and one thing fails for some seconds. A
//! row of a table says what must happen, what happened, and how long it took until all was well again. Ends with an error that
//! names the rows whose promises were not kept.
//!
//! ```sh
//! cargo run --release -p umbracast-live --features serve --example faults [WORDS OF A ROW'S NAME]
//! ```
//!
//! Rows of disks that are full, slow or stand still need root, who may mount a small disk; without it they are left out.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use umbracast::{Error, Site};
use umbracast_live::receive::Door;
use umbracast_live::record::RecordSettings;
use umbracast_live::run::Counters;
use umbracast_live::serve::{self, Watched};
use umbracast_live::{HostClock, Live, Published, Settings};

#[path = "faults/clients.rs"]
mod clients;
#[path = "faults/disk.rs"]
mod disk;
#[path = "faults/hall.rs"]
mod hall;
#[path = "faults/harm.rs"]
mod harm;
#[path = "faults/promise.rs"]
mod promise;
#[path = "faults/refused.rs"]
mod refused;
#[path = "faults/rows.rs"]
mod rows;
#[path = "faults/stream.rs"]
mod stream;

use clients::Clients;
use disk::{Disk, Folder};
use hall::{Hall, PEOPLE};
use harm::Harm;
use promise::{Outcome, Promise, Seen};
use rows::FAULTS;

/// A row of the table.
struct Fault {
    name: &'static str,
    must: &'static str,
    /// The same, for the program.
    promises: &'static [Promise],
    /// How long the run lasts.
    seconds: u64,
    /// What becomes of packets while it fails.
    harm: Harm,
    /// The hall and its sensors, all the time, where they are not the demonstration's; the site file knows it.
    hall: Option<fn(&mut Site)>,
    /// What the site file says otherwise than it is.
    told: fn(&mut Site),
    /// What is otherwise in the hall while it fails.
    meanwhile: fn(&mut Site),
    /// How many people there are while it fails.
    people: usize,
    /// The clocks of all sensors are ahead of the host's by so much, all the time.
    sensors_ahead_s: i64,
    disk: Disk,
    clients: Clients,
}

fn main() -> Result<(), Error> {
    let words = std::env::args().skip(1).collect::<Vec<_>>().join(" ");
    let hall = Hall::of(|_| ())?;
    println!(
        "{:46} {:43} {:>10} {:>8} {:>8} {:>5} {:>6} {:>7} {:>7} {:>9}  what was counted",
        "what failed",
        "what must happen",
        "recovers,s",
        "gap, ms",
        "fewest",
        "most",
        "others",
        "frames",
        "skipped",
        "lost pkts"
    );
    let mut wrong = Vec::new();
    for fault in FAULTS.iter().filter(|fault| fault.name.contains(&words)) {
        if fault.disk.needs_root() && !disk::is_root() {
            println!("{:46} left out: needs root", fault.name);
            continue;
        }
        let own = fault.hall.map(Hall::of).transpose()?;
        let outcome = run(fault, own.as_ref().unwrap_or(&hall)).map_err(|e| e.within(fault.name))?;
        tell(fault, &outcome);
        for broken in fault.promises.iter().filter_map(|&promise| outcome.breaks(promise)) {
            eprintln!("{}: {broken}", fault.name);
            wrong.push(fault.name);
        }
    }
    println!(
        "{PEOPLE} people, two HDL-32E over loopback. Recovers: from the end of the failure until everybody is followed with both \
         sensors again, and recorded where that failed. Gap: longest time between two frames. Fewest: people followed while it \
         fails. Most: people followed at any time. Others: people with another number at the end than before the failure."
    );
    if words.is_empty() {
        wrong.extend(refused::cases(&hall)?);
    }
    wrong.dedup();
    if wrong.is_empty() {
        Ok(())
    } else {
        Err(Error::new(format!("not as it must be: {}", wrong.join("; "))))
    }
}

fn run(fault: &Fault, hall: &Hall) -> Result<Outcome, Error> {
    let folder = Folder::on(fault.disk)?;
    let (clock, counters) = (HostClock::start(), Arc::new(Counters::default()));
    let mut known = hall.config.clone();
    (fault.told)(&mut known.site);
    let page = (fault.clients != Clients::Nobody).then(|| {
        let watched = Watched::new(known.site.clone(), counters.clone(), clock, "faults");
        serve::start(serve::Door::at(SocketAddr::from((Ipv4Addr::LOCALHOST, 0))), watched)
    });
    let page = page.transpose()?;
    let settings = Settings {
        doors: (0..known.site.sensors.len()).map(|sensor| Door { sensor, port: 0, from: None }).collect(),
        config: known,
        weights: None,
        empty: hall.empty.clone(),
        record: Some(RecordSettings {
            folder: folder.path.clone(),
            file_bytes: u64::MAX,
            file_s: 1,
            keep: None,
            points: false,
        }),
        threads: 1,
        clock,
        counters: counters.clone(),
        whole: Arc::default(),
    };
    let seen = Arc::new(Mutex::new(Vec::new()));
    let (told, publisher) = (seen.clone(), page.as_ref().map(serve::Server::publisher));
    let listener = move |published: &Arc<Published>| {
        let followed = published.tracks.iter().filter(|track| track.confirmed);
        let seen = Seen {
            published_ns: published.published_ns,
            people: followed.map(|track| track.track).collect(),
            sensors: published.sensors.iter().filter(|&&gave| gave).count(),
        };
        told.lock().expect("nobody panics with it").push(seen);
        if let Some(publisher) = &publisher {
            publisher.publish(published);
        }
    };
    let live = Live::start(settings, Box::new(listener))?;
    let ports = live.receivers().bound().iter();
    let to: Vec<SocketAddr> = ports.map(|at| SocketAddr::from((Ipv4Addr::LOCALHOST, at.port()))).collect();
    let begun_ns = clock.now_ns();
    let ended = Arc::new(AtomicBool::new(false));
    let looked = page.as_ref().map(|page| clients::look(page.address(), clock, begun_ns, &ended));
    let others = page.as_ref().map(|page| fault.clients.come(page.address(), clock, begun_ns));
    let failing = folder.fail(clock, begun_ns, fault.seconds, counters);
    let sent = hall.send(fault, &to, clock);
    let mut recorded = joined(failing)?;
    sent?;
    ended.store(true, Ordering::Relaxed);
    let mut page_seen = looked.map(joined).transpose()?;
    if let (Some(page), Some(others)) = (&mut page_seen, others) {
        page.others = joined(others)?;
    }
    let summary = live.stop();
    if let Some(page) = page {
        page.stop();
    }
    recorded.found = folder.found()?;
    let seen = std::mem::take(&mut *seen.lock().expect("nobody panics with it"));
    Ok(Outcome { begun_ns, seconds: fault.seconds, seen, summary, recorded, page: page_seen })
}

fn joined<T>(thread: std::thread::JoinHandle<Result<T, Error>>) -> Result<T, Error> {
    thread.join().unwrap_or_else(|_| Err(Error::new("a thread of the test panicked")))
}

fn tell(fault: &Fault, outcome: &Outcome) {
    let recovers = outcome.recovers_s().map_or("never".to_owned(), |s| format!("{s:.2}"));
    let mut counted: Vec<String> =
        outcome.counted().iter().map(|(name, count)| format!("{name} {count}")).collect();
    if let Some(told) = outcome.recorded.told.as_ref().and_then(|told| told.rsplit(": ").next()) {
        counted.push(format!("told \"{told}\""));
    }
    if let Some(page) = &outcome.page {
        counted.push(page.to_string());
    }
    println!(
        "{:46} {:43} {recovers:>10} {:>8.0} {:>8} {:>5} {:>6} {:>7} {:>7} {:>9}  {}",
        fault.name,
        fault.must,
        outcome.gap_ns() as f64 * 1e-6,
        outcome.fewest(),
        outcome.most(),
        outcome.renumbered(),
        outcome.summary.frames,
        outcome.summary.frames_skipped,
        outcome.summary.packets_lost,
        counted.join(", ")
    );
}
