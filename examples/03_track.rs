//! Detections become tracks: after three seconds ten tracks, about 0.01 m and 0.01 m/s off.
//!
//! `cargo run --release --example 03_track`
//!
//! Stage 1, second half. A track is one person with a number that stays, position and velocity with their covariance,
//! heading and height. It is confirmed after enough detections.

mod simulated;

use std::error::Error;

use umbracast::{Config, Pipeline};
use umbracast_sim::scene::PersonTruth;

/// Prints what it finds and checks the figures above.
pub fn main() -> Result<(), Box<dyn Error>> {
    let config = Config::default();
    let hall = simulated::crossing(&config.site, 10, 12.5, 30)?;
    let mut pipeline = Pipeline::new(&config, None)?;
    hall.empty.iter().for_each(|frame| pipeline.learn_empty(frame));
    // What a step gives is valid until the next one; a clone of it may be kept.
    let mut tracks = Vec::new();
    for frame in &hall.frames {
        tracks = pipeline.step(frame).tracks.clone();
    }
    tracks.retain(|track| track.confirmed);

    let (mut off_m, mut off_mps) = (0.0, 0.0);
    for track in &tracks {
        let distance_m = |person: &PersonTruth| person.state.position_m.distance(track.position_m);
        let nearest = hall.truth[29].people.iter().min_by(|a, b| distance_m(a).total_cmp(&distance_m(b)));
        let person = nearest.ok_or("somebody is there")?;
        println!(
            "track {} at ({:.2}, {:.2}) m, {:.2} m/s, {:.2} m tall: {:.3} m from person {}",
            track.id,
            track.position_m.x,
            track.position_m.y,
            track.velocity_mps.length(),
            track.height_m,
            distance_m(person),
            person.person
        );
        off_m += distance_m(person) / tracks.len() as f64;
        off_mps += person.state.velocity_mps.distance(track.velocity_mps) / tracks.len() as f64;
    }
    println!("{} tracks, {off_m:.3} m and {off_mps:.3} m/s off", tracks.len());
    assert_eq!(tracks.len(), 10);
    assert!(off_m < 0.025 && off_mps < 0.03, "{off_m} m, {off_mps} m/s");
    Ok(())
}
