//! Single detections of simulated bodies against where they truly stand.

use umbracast::geometry::{DVec2, DVec3};
use umbracast::lidar::Assembler;
use umbracast::{Config, Health, Mode, Pipeline};
use umbracast_eval::run::chain::{CIRCLE_M, empty_frames, push};
use umbracast_sim::crowd::{Preset, circle_crossing};
use umbracast_sim::scene::Scene;

const SEED: u64 = 100_000;
const FRAMES: usize = 60;
/// A detection nearer than this to a person is that person's.
const OWN_M: f64 = 0.5;

/// What is seen is the side toward the sensor, some 0.1 m off the axis.
#[test]
fn detections_stand_on_the_body_axis_not_on_the_side_that_was_seen() {
    let mut config = Config::for_mode(Mode::Default);
    config.site.access_points.clear();
    let mut pipeline = Pipeline::new(&config, None).unwrap();
    empty_frames(&config.site, SEED).unwrap().iter().for_each(|frame| pipeline.learn_empty(frame));
    let mut scene =
        Scene::new(circle_crossing(Preset::Orca03, 10, CIRCLE_M, SEED), &config.site, SEED).unwrap();
    let walkers = scene.walkers().to_vec();
    let sensors_m: Vec<DVec2> =
        config.site.sensors.iter().map(|s| DVec3::from_array(s.position_m).truncate()).collect();
    let (mut assembler, mut health) = (Assembler::new(&config.site).unwrap(), Health::default());
    let (mut n, mut away_m, mut squared_m2) = (0.0, 0.0, 0.0);
    for _ in 0..FRAMES {
        push(&mut assembler, &scene.next_frame().unwrap().packets, &mut health);
        while let Some(frame) = assembler.pop() {
            for detection in &pipeline.step(&frame).detections {
                let off = |walker: &umbracast_sim::body::Walker| {
                    Some(detection.position_m - walker.state_at(detection.time_ns)?.position_m)
                };
                let offs = walkers.iter().filter_map(off);
                let nearest = offs.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
                let Some(off_m) = nearest.filter(|off_m| off_m.length() < OWN_M) else { continue };
                let toward = |a: &&DVec2, b: &&DVec2| {
                    let squared = |s: &DVec2| s.distance_squared(detection.position_m);
                    squared(a).total_cmp(&squared(b))
                };
                let sensor_m = *sensors_m.iter().min_by(toward).unwrap();
                n += 1.0;
                away_m += off_m.dot((detection.position_m - sensor_m).normalize_or_zero());
                squared_m2 += off_m.length_squared();
            }
        }
    }
    assert!(n > 0.9 * 10.0 * (FRAMES - 1) as f64, "{n} detections");
    assert!((away_m / n).abs() < 0.01, "{} m away from the sensor", away_m / n);
    assert!((squared_m2 / n).sqrt() < 0.035, "{} m", (squared_m2 / n).sqrt());
}
