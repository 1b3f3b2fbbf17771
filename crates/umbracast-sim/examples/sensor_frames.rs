//! Simulates the frames of ten people who cross the default site: `cargo run --release -p umbracast-sim --example
//! sensor_frames 280`. Timed from outside, with two numbers of frames, the difference is the cost of a frame.

use umbracast::Config;
use umbracast::geometry::DVec2;
use umbracast_sim::body::Walker;
use umbracast_sim::crowd::Trajectory;
use umbracast_sim::sensor::Sensors;

fn main() {
    let frames = std::env::args().nth(1).map_or(280, |n| n.parse().expect("a number of frames"));
    let mut sensors = Sensors::new(&Config::default().site, 1).expect("the default site");
    let walkers: Vec<Walker> =
        (0..10).map(|person| Walker::new(crossing(person), u64::from(person))).collect();
    let (mut packets, mut returns) = (0, 0);
    for frame in 0..frames {
        let (sent, seen) = sensors.frame(frame, &walkers);
        packets += sent.iter().map(Vec::len).sum::<usize>();
        returns += seen.iter().sum::<u32>();
    }
    println!("{frames} frames, {packets} packets, {returns} returns from {} people", walkers.len());
}

/// Through a circle of 10 m at 0.9 m/s, from rim to rim and on.
fn crossing(person: u32) -> Trajectory {
    let angle = f64::from(person) * 0.628;
    let positions_m = (0..=3000)
        .map(|i| DVec2::from_angle(angle) * (10.0 - 0.009 * f64::from(i)) + DVec2::from_angle(angle * 3.0))
        .collect();
    Trajectory { person, start_ns: 0, step_ns: 10_000_000, positions_m, arrived_ns: None, height_m: None }
}
