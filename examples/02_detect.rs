//! A frame becomes detections: ten people in the hall, ten detections, about 0.05 m off.
//!
//! `cargo run --release --example 02_detect`
//!
//! Stage 1, first half: points that do not belong to the empty hall, grouped in plan view, one group a person.

mod simulated;

use std::error::Error;

use umbracast::{Config, Pipeline};

/// Prints what it finds and checks the figures above.
pub fn main() -> Result<(), Box<dyn Error>> {
    let config = Config::default();
    let hall = simulated::crossing(&config.site, 10, 12.5, 10)?;
    let mut pipeline = Pipeline::new(&config, None)?;

    // Two seconds without people teach what belongs to the hall. Without them it is learned on the way.
    for frame in &hall.empty {
        pipeline.learn_empty(frame);
    }
    let outcome = pipeline.step(&hall.frames[0]);
    println!("{} points in {} groups", outcome.foreground.len(), outcome.clusters.len());

    let people = &hall.truth[0].people;
    let mut sum_m = 0.0;
    for detection in &outcome.detections {
        let off_m = people.iter().map(|person| person.state.position_m.distance(detection.position_m));
        let off_m = off_m.fold(f64::MAX, f64::min);
        println!(
            "{} points around ({:.2}, {:.2}) m, {off_m:.2} m from the nearest person",
            detection.points, detection.position_m.x, detection.position_m.y
        );
        sum_m += off_m;
    }
    let mean_m = sum_m / outcome.detections.len() as f64;
    println!("{} people, {} detections, {mean_m:.3} m off", people.len(), outcome.detections.len());
    assert_eq!((people.len(), outcome.detections.len()), (10, 10));
    assert!(mean_m < 0.06, "{mean_m} m");
    Ok(())
}
