//! The examples do what their first line says: each checks its own figures.

#![allow(clippy::duplicate_mod, reason = "each example reads in the simulated hall for itself")]

#[path = "../examples/01_packets.rs"]
mod packets;
#[path = "../examples/02_detect.rs"]
mod detect;
#[path = "../examples/03_track.rs"]
mod track;
#[path = "../examples/04_forecast.rs"]
mod forecast;
#[path = "../examples/05_own_hall.rs"]
mod own_hall;
#[path = "../examples/06_own_tracks.rs"]
mod own_tracks;

#[test]
fn packets_become_a_frame() {
    packets::main().unwrap();
}

#[test]
fn a_frame_becomes_detections() {
    detect::main().unwrap();
}

#[test]
fn detections_become_tracks() {
    track::main().unwrap();
}

#[test]
fn tracks_become_warnings() {
    forecast::main().unwrap();
}

#[test]
fn a_hall_of_ones_own_is_watched() {
    own_hall::main().unwrap();
}

#[test]
fn tracks_of_another_program_become_warnings() {
    own_tracks::main().unwrap();
}
