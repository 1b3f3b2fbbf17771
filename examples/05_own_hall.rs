//! A hall of one's own, with one VLP-16 and one access point: three people, three tracks from 0.2 s on.
//!
//! `cargo run --release --example 05_own_hall`
//!
//! A file holds what differs from `config/default.toml`. It replaces lists such as the sensors as a whole. The
//! command reads the same file: `umbracast coverage --site hall.toml` shows what such a sensor sees before you mount
//! one.

mod simulated;

use std::error::Error;

use umbracast::{Config, Mode, Pipeline};

/// Origin in the middle of the floor, x along `length_m`, z up. Yaw is counter-clockwise from x, pitch looks down.
const HALL: &str = r#"
[site]
name = "workshop"
pillars = []
furniture = []

[site.hall]
length_m = 14.0
width_m = 10.0
height_m = 4.0

[[site.sensors]]
name = "above the door"
model = "vlp-16"
position_m = [-6.5, 0.0, 3.0]
rotation_deg = { yaw = 0.0, pitch = 18.0, roll = 0.0 }
rate_hz = 10.0
cut_deg = 180.0
range_min_m = 0.5
range_max_m = 60.0
range_noise_m = 0.02

[[site.access_points]]
name = "far wall"
position_m = [6.8, 0.0, 3.0]
"#;

/// Prints what it finds and checks the figures above.
pub fn main() -> Result<(), Box<dyn Error>> {
    // A key that does not exist or a value that cannot work is refused with file, line, expected and found.
    let config = Config::with_overlay(Mode::Default, HALL, "hall.toml")?;
    let hall = simulated::crossing(&config.site, 3, 3.0, 30)?;
    let mut pipeline = Pipeline::new(&config, None)?;
    hall.empty.iter().for_each(|frame| pipeline.learn_empty(frame));

    let mut seen = Vec::new();
    for frame in &hall.frames {
        let outcome = pipeline.step(frame);
        seen.push(outcome.tracks.iter().filter(|track| track.confirmed).count());
        for link in outcome.blockages.iter().filter(|link| link.p[2] > 0.5) {
            println!(
                "{:.1} s: the far wall is about to lose track {}",
                frame.time_ns as f64 * 1e-9,
                link.track
            );
        }
    }
    println!("people followed, frame by frame: {seen:?}");
    assert_eq!(hall.truth[0].people.len(), 3);
    assert!(seen[1..].iter().all(|tracks| *tracks == 3), "{seen:?}");
    Ok(())
}
