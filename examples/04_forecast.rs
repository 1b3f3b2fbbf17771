//! Tracks become warnings: of some 300 links said to be blocked within 300 ms, 97 % are.
//!
//! `cargo run --release --example 04_forecast`
//!
//! Stages 2 and 3: where each person will be in the next second, and how likely a body is to stand between an access
//! point and that person by then.

mod simulated;

use std::error::Error;

use umbracast::{Config, Pipeline};

/// Three steps of 100 ms; `p` and `steps` count them from 1, so that the third has index 2.
const STEPS_AHEAD: usize = 3;
const FRAMES: usize = 120;

/// Prints what it finds and checks the figures above.
pub fn main() -> Result<(), Box<dyn Error>> {
    let config = Config::default();
    let hall = simulated::crossing(&config.site, 10, 8.0, FRAMES)?;
    let mut pipeline = Pipeline::new(&config, None)?;
    hall.empty.iter().for_each(|frame| pipeline.learn_empty(frame));

    let (mut warnings, mut right) = (0, 0);
    for (k, frame) in hall.frames.iter().enumerate().take(FRAMES - STEPS_AHEAD) {
        let outcome = pipeline.step(frame);
        for link in outcome.blockages.iter().filter(|link| link.p[STEPS_AHEAD - 1] > 0.5) {
            // Tracks and forecasts stand in the same order.
            let Some(t) = outcome.tracks.iter().position(|track| track.id == link.track) else { continue };
            let (now_m, then_m) =
                (outcome.tracks[t].position_m, outcome.forecasts[t].steps[STEPS_AHEAD - 1].mean_m);
            // Whose track it is, and whether a body stood in the way in one of the next three frames.
            let people = &hall.truth[k].people;
            let Some(person) = people.iter().find(|p| p.state.position_m.distance(now_m) < 0.3) else {
                continue;
            };
            let comes = hall.truth[k + 1..=k + STEPS_AHEAD]
                .iter()
                .flat_map(|later| &later.links)
                .any(|l| l.blocked && (l.access_point, l.person) == (link.access_point, person.person));
            if warnings % 100 == 0 {
                println!(
                    "{:.1} s: track {}, on the way to ({:.2}, {:.2}) m, is lost to {} with {:.0} %: {}",
                    frame.time_ns as f64 * 1e-9,
                    link.track,
                    then_m.x,
                    then_m.y,
                    config.site.access_points[link.access_point].name,
                    100.0 * link.p[STEPS_AHEAD - 1],
                    if comes { "so it was" } else { "it was not" }
                );
            }
            warnings += 1;
            right += usize::from(comes);
        }
    }
    println!("{warnings} warnings, {right} right");
    assert!((270..330).contains(&warnings) && right as f64 > 0.9 * warnings as f64, "{right} of {warnings}");
    Ok(())
}
