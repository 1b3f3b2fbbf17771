//! `replay`: sends the packets of recordings over UDP at their original pace.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, mpsc};

use umbracast::lidar::Packet;
use umbracast::{Error, Mode};
use umbracast_live::HostClock;
use umbracast_live::receive::Arrived;
use umbracast_live::send;

use crate::args::{Common, ReplayPackets};
use crate::ending::Ending;
use crate::inputs;
use crate::run_json::{RunJson, Stopwatch};
use crate::{setup, signal};

/// Packets that are read ahead.
const AHEAD: usize = 4096;

/// Sends everything, each sensor's packets to a port of its own.
pub fn run(args: &ReplayPackets, common: &Common) -> Result<Ending, Error> {
    let mut site = setup::config(Mode::Default, args.site.site.as_deref())?.site;
    let inputs =
        inputs::read(&args.inputs, &args.captures, args.site.site.as_deref(), &mut site, common)?.scenes;
    let to = send::addresses(site.sensors.len(), &args.to);
    let asked: Arc<AtomicBool> = signal::asked_to_end()?;
    let watch = Stopwatch::start();
    let (packets, coming) = mpsc::sync_channel(AHEAD);
    let reading = std::thread::spawn(move || -> Result<Vec<String>, Error> {
        let (mut lost, mut ended) = (Vec::new(), false);
        for input in &inputs {
            let told = input.packets(&site, |sensor, packet: Packet| {
                ended |= packets.send(Arrived { sensor, packet }).is_err();
                if ended { Err(Error::new("asked to end")) } else { Ok(()) }
            });
            if ended {
                break;
            }
            lost.extend(told?);
        }
        Ok(lost)
    });
    let sent = send::send(coming.into_iter(), &to, args.rate, HostClock::start(), &asked)?;
    let lost = reading.join().unwrap_or_else(|_| Err(Error::new("the reader ended; this is a bug")))?;
    let summary = RunJson::new("replay", &watch)
        .with("packets", sent.packets)
        .with("failed", sent.failed)
        .with("late_ms_max", sent.latest_ns as f64 / 1e6);
    summary.print(common, &format!("{} packets sent in {:.1} s", sent.packets, watch.seconds()));
    if lost.is_empty() { Ok(Ending::Done) } else { Ok(Ending::DataLost(lost.join("; "))) }
}
