//! Any packets must give frames in order of time.
#![no_main]

use libfuzzer_sys::fuzz_target;
use umbracast::lidar::{Assembler, Packet};
use umbracast::{Config, Health};

// Time of reception, sensor and return mode, microseconds within the hour, azimuths.
fuzz_target!(|input: Vec<(i64, u8, u32, [u16; 12])>| {
    let mut assembler = Assembler::new(&Config::default().site).expect("the default site");
    let mut health = Health::default();
    let mut last_ns = i64::MIN;
    for (time_ns, kind, within_hour_us, azimuths_cdeg) in input {
        let mut payload = Vec::with_capacity(1206);
        for azimuth_cdeg in azimuths_cdeg {
            payload.extend_from_slice(&[0xff, 0xee]);
            payload.extend_from_slice(&(azimuth_cdeg % 36_000).to_le_bytes());
            payload.extend_from_slice(&[kind; 96]);
        }
        payload.extend_from_slice(&(within_hour_us % 3_600_000_000).to_le_bytes());
        payload.extend_from_slice(&[0x37 + (kind >> 6) % 3, 0x21]);
        assembler.push(usize::from(kind & 1), &Packet { time_ns, payload }, &mut health);
        while let Some(frame) = assembler.pop() {
            assert!(frame.time_ns > last_ns);
            last_ns = frame.time_ns;
        }
    }
    assembler.finish();
});
