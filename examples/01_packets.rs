//! Packets of two LiDARs become a frame: 360 packets, 2 scans, 135,477 returns.
//!
//! `cargo run --release --example 01_packets`
//!
//! A sensor sends UDP packets; [`Packet`] is one payload and the time it was received. The [`Assembler`] decodes them,
//! cuts them into tenths of a second and gives a [`Frame`] with one scan a sensor. Here a simulated hall sends; from a
//! capture `umbracast_io::pcap::PcapReader` gives the same payloads.

use std::error::Error;

use umbracast::lidar::{Assembler, Cloud, Packet};
use umbracast::{Config, Health};
use umbracast_sim::crowd::{Preset, circle_crossing};
use umbracast_sim::scene::Scene;

/// Prints what it finds and checks the figures above.
pub fn main() -> Result<(), Box<dyn Error>> {
    // Where sensors hang and how they are turned: two HDL-32E, 3 m high on the walls of a hall.
    let site = Config::default().site;

    // What arrives in the first tenth of a second, sensors mixed: which sensor, and the packet.
    let people = circle_crossing(Preset::Orca03, 10, 12.5, 100_000);
    let first = Scene::new(people, &site, 100_000)?.next_frame().ok_or("a scene has frames")?;
    let mut arriving: Vec<(usize, Packet)> = Vec::new();
    for (sensor, packets) in first.packets.into_iter().enumerate() {
        arriving.extend(packets.into_iter().map(|packet| (sensor, packet)));
    }
    arriving.sort_by_key(|(_, packet)| packet.time_ns);
    println!("{} packets of {} bytes", arriving.len(), arriving[0].1.payload.len());

    // Nothing fails on a broken packet: it is counted in `health` and skipped.
    let (mut assembler, mut health) = (Assembler::new(&site)?, Health::default());
    for (sensor, packet) in &arriving {
        assembler.push(*sensor, packet, &mut health);
    }
    // A frame closes when a packet of the next one arrives; at the end of the input, this says so.
    assembler.finish();
    let frame = assembler.pop().ok_or("a tenth of a second is a frame")?;

    let mut returns = 0;
    for scan in &frame.scans {
        let Cloud::Organised(image) = &scan.cloud else { continue };
        let hits = image.range_m.iter().filter(|range_m| **range_m > 0.0).count();
        println!("sensor {}: {} columns, {hits} returns", scan.sensor, image.columns.len());
        returns += hits;
    }
    assert_eq!(frame.scans.len(), 2);
    assert_eq!(arriving.len(), 360);
    assert_eq!(returns, 135_477);
    assert!(health.is_clean(), "{health:?}");
    Ok(())
}
