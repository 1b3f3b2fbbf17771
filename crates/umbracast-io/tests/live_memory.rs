//! A recorder's memory must not grow over hours. The test writes an hour of a live recording as fast as it can and
//! counts this program's memory. It is alone in its file, because the count includes everything.

use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use std::alloc::System;
use umbracast::Config;
use umbracast::lidar::Packet;
use umbracast_io::messages::PACKET_BYTES;
use umbracast_io::recording::{RecordingWriter, Results};
use umbracast_io::rows::TrackRow;

#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Bytes that are held now.
fn held() -> i64 {
    let stats = COUNTED.stats();
    stats.bytes_allocated as i64 - stats.bytes_deallocated as i64
}

#[test]
fn an_hour_of_recording_holds_no_more_than_its_index() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = Config::default();
    let path = folder.path().join("hour.mcap");
    let mut writer =
        RecordingWriter::create_live(&path, &config.to_toml(), &config.site, 0).expect("creates");
    let packet = Packet { time_ns: 0, payload: vec![7; PACKET_BYTES] };
    let rows = [TrackRow::default(); 10];
    let mut by_minute = Vec::new();
    for frame in 0..36_000_u64 {
        let time_ns = frame as i64 * umbracast::STEP_NS;
        // One packet for 180: the disk need not hold the hour, and memory does not know what a chunk holds.
        writer.write_packets(time_ns, &[vec![packet.clone()], vec![packet.clone()]]).expect("writes");
        let results = Results { frame, time_ns, logged_ns: time_ns, tracks: &rows, ..Results::default() };
        writer.write_results(&results).expect("writes");
        // As the recorder does, once a second.
        if frame % 10 == 9 {
            writer.flush().expect("flushes");
        }
        if frame % 600 == 599 {
            by_minute.push(held());
        }
    }
    let grown = by_minute[59] - by_minute[0];
    assert!((0..1_000_000).contains(&grown), "{grown} bytes in 59 minutes: {by_minute:?}");
    writer.finish().expect("finishes");
    assert!(held() < by_minute[0], "what a file held is given back with it");
}
