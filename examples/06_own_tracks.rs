//! Tracks of another program become warnings: of two people in line, the farther is said to be lost 0.4 s before they are.
//!
//! `cargo run --release --example 06_own_tracks`
//!
//! Whoever follows people by other means (cameras, a badge system, another tracker) needs stages 2 and 3 only. A number, a position
//! and a velocity suffice; what is known beyond that goes into the fields of a track. The command `umbracast cast` does the same
//! from a table.

use std::error::Error;

use umbracast::geometry::DVec2;
use umbracast::track::Track;
use umbracast::{Config, Pipeline, STEP_NS};

/// Prints what it finds and checks the figures above.
pub fn main() -> Result<(), Box<dyn Error>> {
    let config = Config::default();
    let side = &config.site.access_points[0];
    let mut pipeline = Pipeline::new(&config, None)?;
    let (mut warned, mut lost) = (None, None);
    for k in 0..30 {
        let time_ns = (k as i64 + 1) * STEP_NS;
        // One stands before the access point at (14, 0) m, and the other walks through the line between the two.
        let stands = Track::new(1, DVec2::new(4.0, 0.0), DVec2::ZERO);
        let mut walks = Track::new(2, DVec2::new(6.0, -2.0 + 0.13 * k as f64), DVec2::new(0.0, 1.3));
        (walks.height_m, walks.height_sigma_m) = (1.8, 0.02);
        let links = &pipeline.step_tracks(k, time_ns, &[stands, walks]).blockages;
        let link = links.iter().find(|link| link.access_point == 0 && link.track == 1).ok_or("a link")?;
        if warned.is_none() && link.p[8] > 0.5 {
            warned = Some(time_ns);
            println!("{:.1} s: {} will lose person 1 within 0.9 s", time_ns as f64 * 1e-9, side.name);
        }
        if lost.is_none() && link.blocked_now {
            lost = Some(time_ns);
            println!("{:.1} s: person 2 stands between", time_ns as f64 * 1e-9);
        }
    }
    let (warned, lost) = (warned.ok_or("a warning")?, lost.ok_or("a blockage")?);
    assert!(lost - warned >= 4 * STEP_NS, "{warned} ns, {lost} ns");
    Ok(())
}
