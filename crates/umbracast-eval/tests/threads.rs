//! What a step gives is the same on any number of threads.

use umbracast::lidar::Assembler;
use umbracast::site::{AccessPoint, Radio};
use umbracast::{Config, Health, Pipeline};
use umbracast_eval::run::chain::{CIRCLE_M, empty_frames, push};
use umbracast_sim::crowd::{Preset, circle_crossing};
use umbracast_sim::scene::Scene;

const SEED: u64 = 100_001;
const FRAMES: usize = 40;

/// Five sensors and eight access points: enough for threads to share both scans and links.
fn config() -> Config {
    let mut config = Config::default();
    for i in 0..3 {
        let mut sensor = config.site.sensors[0].clone();
        (sensor.name, sensor.position_m[1]) = (format!("more_{i}"), 4.0 * f64::from(i) - 6.0);
        config.site.sensors.push(sensor);
    }
    config.site.access_points.extend((0..6).map(|i| AccessPoint {
        name: format!("more-{i}"),
        position_m: [5.0 * f64::from(i) - 12.0, -9.0, 2.5],
        radio: Some(Radio::default()),
    }));
    config.site.ue.spread_m = 0.1;
    config
}

#[test]
fn a_step_gives_the_same_on_any_number_of_threads() {
    let config = config();
    let mut alone = Pipeline::new(&config, None).unwrap();
    empty_frames(&config.site, SEED).unwrap().iter().for_each(|frame| alone.learn_empty(frame));
    let mut shared = [2, 3, 16].map(|threads| {
        let mut shared = alone.clone();
        shared.use_threads(threads);
        // As after new access points are told.
        shared.take_over_links(&config);
        shared
    });
    alone.take_over_links(&config);
    let crowd = circle_crossing(Preset::Mixed, 16, CIRCLE_M / 2.0, SEED);
    let mut scene = Scene::new(crowd, &config.site, SEED).unwrap();
    let (mut assembler, mut health, mut links) =
        (Assembler::new(&config.site).unwrap(), Health::default(), 0);
    for _ in 0..FRAMES {
        push(&mut assembler, &scene.next_frame().unwrap().packets, &mut health);
        while let Some(frame) = assembler.pop() {
            let expected = alone.step(&frame);
            links = links.max(expected.blockages.len());
            for pipeline in &mut shared {
                assert!(pipeline.step(&frame) == expected, "frame {}", frame.index);
            }
        }
    }
    assert!(links > 100, "{links} links");
}
