//! The soak: a day of twenty people who come, sit, carry things and go, before simulated sensors. Chairs are moved, a table is put
//! in, a door opens and closes; each hour a sensor is lost for a minute, a clock jumps, then all of them do, and packets come twice
//! and in reverse. Ends with an error where something is not at the end as it was at the beginning.
//!
//! ```sh
//! cargo run --release --package umbracast-node --example soak                # all of it: about half an hour
//! cargo run --release --package umbracast-node --example soak -- 2 0.5       # two hours of stages, half an hour live
//! ```
//!
//! **Not everything is simulated for a day**: the simulator would take hours. A dozen legs, a minute or so each, are
//! simulated once. They are played again and again with their times moved on, in an order that is drawn anew in each hour. So
//! noise, bodies and ways repeat; what is laid over them and what follows what does not.
//!
//! It has three parts, each a process of its own, so that the memory of one is not that of another. `legs` simulates. `day` has
//! a day go through assembler and stages as fast as they take it. `live` has an hour go through the whole program: packets
//! over UDP, recorder, page and a client of it, MQTT and a broker. Its clock runs [`live::RATE`] times as fast as the host's,
//! so it bears what a host would that is so much slower, with queues that hold so much less time.

use std::path::{Path, PathBuf};
use std::process::Command;

use umbracast::Error;

#[path = "soak/broker.rs"]
mod broker;
#[path = "soak/crowd.rs"]
mod crowd;
#[path = "soak/day.rs"]
mod day;
#[path = "soak/halls.rs"]
mod halls;
#[path = "soak/legs.rs"]
mod legs;
#[path = "soak/live.rs"]
mod live;
#[path = "soak/memory.rs"]
mod memory;
#[path = "soak/page.rs"]
mod page;
#[path = "soak/play.rs"]
mod play;
#[path = "soak/recorded.rs"]
mod recorded;
#[path = "../../umbracast-live/examples/faults/stream.rs"]
mod stream;
#[path = "soak/tally.rs"]
mod tally;
#[path = "soak/verdict.rs"]
mod verdict;

use verdict::Verdict;

/// Hours of each part.
const DAY_H: f64 = 24.0;
const LIVE_H: f64 = 1.0;

fn main() -> Result<(), Error> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let hours = |at: usize, usual: f64| match words.get(at) {
        None => Ok(usual),
        Some(word) => word.parse().map_err(|_| Error::new(format!("expected hours, found {word}"))),
    };
    let folder = words.get(1).map(PathBuf::from).unwrap_or_default();
    match words.first().map(String::as_str) {
        Some("legs") => legs::simulate(&folder),
        Some("day") => ended(day::run(&folder, hours(2, DAY_H)?)?),
        Some("live") => ended(live::run(&folder, hours(2, LIVE_H)?)?),
        _ => all(hours(0, DAY_H)?, hours(1, LIVE_H)?),
    }
}

/// Every part, one after the other; those that come later run although one before ended with an error.
fn all(day_h: f64, live_h: f64) -> Result<(), Error> {
    let folder = std::env::temp_dir().join(format!("umbracast-soak-legs-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| Error::new(e.to_string()).within(folder.display()))?;
    let done = part("legs", &folder, 0.0).and_then(|()| {
        let day = part("day", &folder, day_h);
        part("live", &folder, live_h).and(day)
    });
    let _ = std::fs::remove_dir_all(&folder);
    done.inspect(|()| println!("Every condition is kept."))
}

fn part(name: &str, folder: &Path, hours: f64) -> Result<(), Error> {
    let failed = |e: std::io::Error| Error::new(e.to_string()).within(name);
    let mut command = Command::new(std::env::current_exe().map_err(failed)?);
    let status = command.arg(name).arg(folder).arg(hours.to_string()).status().map_err(failed)?;
    if status.success() { Ok(()) } else { Err(Error::new(format!("{name}: {status}"))) }
}

fn ended(verdict: Verdict) -> Result<(), Error> {
    match verdict.broken {
        0 => Ok(()),
        broken => Err(Error::new(format!("{broken} conditions are not kept"))),
    }
}
