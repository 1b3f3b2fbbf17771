//! Whether memory stays flat: simulated sensors over loopback into a live run that records, with every byte that is held
//! counted. A row every ten seconds, then the first minute against the last.
//!
//! ```sh
//! cargo run --release -p umbracast-live --example memory -- 600
//! ```

use std::alloc::System;
use std::fs;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use umbracast::{Config, Error};
use umbracast_live::receive::Door;
use umbracast_live::record::RecordSettings;
use umbracast_live::run::Counters;
use umbracast_live::{HostClock, Live, Settings, send};
use umbracast_sim::crowd::{Preset, Stroll};
use umbracast_sim::sensor::Sensors;

#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

const PEOPLE: usize = 10;
const SEED: u64 = 200_000;
const EVERY_S: usize = 10;
const MB: f64 = 1e6;

fn main() -> Result<(), Error> {
    let wanted_s = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(600_usize);
    let config = Config::default();
    let folder = std::env::temp_dir().join(format!("umbracast-memory-{}", std::process::id()));
    let (clock, counters) = (HostClock::start(), Arc::new(Counters::default()));
    let settings = Settings {
        config: config.clone(),
        weights: None,
        empty: Vec::new(),
        doors: (0..config.site.sensors.len()).map(|sensor| Door { sensor, port: 0, from: None }).collect(),
        record: Some(RecordSettings {
            points: false,
            folder: folder.clone(),
            file_bytes: 4 << 30,
            file_s: 3600,
            keep: Some(1),
        }),
        clock,
        counters: counters.clone(),
    };
    let live = Live::start(settings, Box::new(|_| {}))?;
    let ports = live.receivers().bound().iter();
    let to: Vec<SocketAddr> = ports.map(|at| SocketAddr::from((Ipv4Addr::LOCALHOST, at.port()))).collect();
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = stop.clone();
    let sensors = Sensors::new(&config.site, SEED)?;
    let sending = std::thread::spawn(move || {
        let first = send::frame_of_hour(clock.now_ns());
        let stroll = Stroll::new(Preset::Orca03, PEOPLE, 10.0, SEED);
        let packets = send::strolling(stroll, config.site, sensors, SEED, first);
        send::send(packets, &to, 1.0, clock, &stopped)
    });
    let mut seen = Vec::new();
    println!("{:>6} {:>12} {:>12} {:>8}", "s", "held, MB", "resident, MB", "frames");
    while seen.len() * EVERY_S < wanted_s {
        std::thread::sleep(Duration::from_secs(EVERY_S as u64));
        let (held_mb, resident_mb) = (held() as f64 / MB, resident() as f64 / MB);
        seen.push((held_mb, resident_mb));
        let frames = counters.frames.load(Ordering::Relaxed);
        println!("{:>6} {held_mb:>12.2} {resident_mb:>12.2} {frames:>8}", seen.len() * EVERY_S);
    }
    stop.store(true, Ordering::Relaxed);
    let _ = sending.join(); // What it sent is of no interest here.
    live.stop();
    let _ = fs::remove_dir_all(&folder); // A temporary folder; what stays there hurts nobody.
    let minute = 60 / EVERY_S;
    let mean = |of: &[(f64, f64)], which: fn(&(f64, f64)) -> f64| {
        of.iter().map(which).sum::<f64>() / of.len().max(1) as f64
    };
    let (first, last) = (&seen[..minute.min(seen.len())], &seen[seen.len().saturating_sub(minute)..]);
    for (name, which) in
        [("held", (|s: &(f64, f64)| s.0) as fn(&(f64, f64)) -> f64), ("resident", |s: &(f64, f64)| s.1)]
    {
        let (first_mb, last_mb) = (mean(first, which), mean(last, which));
        println!(
            "{name}: first minute {first_mb:.2} MB, last minute {last_mb:.2} MB, {:+.2} %",
            (last_mb / first_mb - 1.0) * 100.0
        );
    }
    Ok(())
}

/// Bytes that are held now.
fn held() -> i64 {
    let stats = COUNTED.stats();
    stats.bytes_allocated as i64 - stats.bytes_deallocated as i64
}

/// Bytes that the system holds for this program, in pages of 4096; 0 where it does not say.
fn resident() -> u64 {
    let text = fs::read_to_string("/proc/self/statm").unwrap_or_default();
    text.split(' ').nth(1).and_then(|pages| pages.parse::<u64>().ok()).unwrap_or(0) * 4096
}
