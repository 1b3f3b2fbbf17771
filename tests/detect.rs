//! Stage 1 up to the detections, on clouds of round people in a round room, cast ray by ray.

use umbracast::config::{Config, Mode};
use umbracast::detect::{Background, Cluster, Clusterer, Detection, Measurer, Point, Prior};
use umbracast::geometry::{DVec2, DVec3};
use umbracast::lidar::{Cloud, Scan, SensorPoint};
use umbracast::{Frame, Health, Pipeline};

const SENSORS_M: [DVec3; 2] = [DVec3::new(-6.0, 0.0, 3.0), DVec3::new(6.0, 0.0, 3.0)];
const ROOM_RADIUS_M: f64 = 14.0;
const PERSON_RADIUS_M: f64 = 0.18;
const PERSON_HEIGHT_M: f64 = 1.7;

fn config(mode: Mode) -> Config {
    let sensor = |p: DVec3| {
        format!(
            "[[site.sensors]]\nname = \"s{:+}\"\nmodel = \"points\"\nposition_m = [{:?}, {:?}, {:?}]\n\
             rotation_deg = {{ yaw = 0.0, pitch = 0.0, roll = 0.0 }}\nrate_hz = 10.0\ncut_deg = 180.0\n\
             range_min_m = 0.5\nrange_max_m = 50.0\nrange_noise_m = 0.0\n",
            p.x, p.x, p.y, p.z
        )
    };
    let site = format!("[site]\n{}{}", sensor(SENSORS_M[0]), sensor(SENSORS_M[1]));
    Config::with_overlay(mode, &site, "site").unwrap()
}

/// Both sensors see the room and upright cylinders at these places.
fn frame(config: &Config, index: u64, people_m: &[DVec2]) -> Frame {
    let scans = SENSORS_M.iter().enumerate().map(|(sensor, &origin_m)| Scan {
        sensor,
        site_from_sensor: config.site.sensors[sensor].site_from_sensor(),
        cloud: Cloud::Unorganised(cast(origin_m, people_m)),
    });
    Frame { index, time_ns: index as i64 * 100_000_000, scans: scans.collect() }
}

fn cast(origin_m: DVec3, people_m: &[DVec2]) -> Vec<SensorPoint> {
    let mut points = Vec::new();
    for elevation_deg in (-40..=10).step_by(2) {
        for step in 0..900 {
            let azimuth_rad = (0.4 * f64::from(step)).to_radians();
            let elevation_rad = f64::from(elevation_deg).to_radians();
            let direction = DVec3::new(
                elevation_rad.cos() * azimuth_rad.cos(),
                -elevation_rad.cos() * azimuth_rad.sin(),
                elevation_rad.sin(),
            );
            let mut range_m = -origin_m.z / direction.z.min(-1e-9);
            let far_m = cylinder(origin_m, direction, DVec2::ZERO, ROOM_RADIUS_M).1;
            range_m = range_m.min(far_m);
            for &person_m in people_m {
                let near_m = cylinder(origin_m, direction, person_m, PERSON_RADIUS_M).0;
                if near_m > 0.0 && (origin_m + direction * near_m).z < PERSON_HEIGHT_M {
                    range_m = range_m.min(near_m);
                }
            }
            let position_m = (direction * range_m).to_array().map(|c| c as f32);
            points.push(SensorPoint { position_m, time_ns: 0, reflectivity: 0.0 });
        }
    }
    points
}

/// Where a ray enters and leaves an upright cylinder; NaN where it passes by.
fn cylinder(origin_m: DVec3, direction: DVec3, axis_m: DVec2, radius_m: f64) -> (f64, f64) {
    let (o, d) = (origin_m.truncate() - axis_m, direction.truncate());
    let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - radius_m * radius_m);
    let root = (b * b - a * c).sqrt();
    ((-b - root) / a, (-b + root) / a)
}

struct Chain {
    background: Background,
    clusterer: Clusterer,
    measurer: Measurer,
    points: Vec<Point>,
    clusters: Vec<Cluster>,
    detections: Vec<Detection>,
    health: Health,
}

impl Chain {
    fn new(config: &Config) -> Self {
        Self {
            background: Background::new(&config.detect, &config.site),
            clusterer: Clusterer::new(&config.detect, &config.site),
            measurer: Measurer::new(&config.detect, &config.site),
            points: Vec::new(),
            clusters: Vec::new(),
            detections: Vec::new(),
            health: Health::default(),
        }
    }

    fn step(&mut self, frame: &Frame, priors: &[Prior]) -> &[Detection] {
        self.background.foreground(frame, priors, &mut self.health, &mut self.points);
        self.clusterer.clusters(&self.points, priors, &mut self.clusters);
        self.measurer.detections(&self.points, &self.clusters, priors, &mut self.detections);
        &self.detections
    }

    fn finds(&self, people_m: &[DVec2], within_m: f64) -> bool {
        self.detections.len() == people_m.len()
            && people_m.iter().all(|p| self.detections.iter().any(|d| d.position_m.distance(*p) < within_m))
    }
}

/// Somebody who is expected there and stands.
fn expected_at(position_m: DVec2) -> Prior {
    Prior {
        position_m,
        velocity_mps: DVec2::ZERO,
        position_sigma_m: 0.05,
        height_m: 1.7,
        confirmed: true,
        walked: false,
        is_furniture: false,
        shape: None,
    }
}

const PEOPLE_M: [DVec2; 4] =
    [DVec2::new(0.0, 0.0), DVec2::new(1.0, 3.0), DVec2::new(-2.0, -4.0), DVec2::new(2.0, -1.5)];

#[test]
fn every_mode_finds_people_after_an_empty_scan() {
    for (mode, within_m) in [(Mode::Hdl, 0.15), (Mode::Paper, 0.15), (Mode::Default, 0.08)] {
        let config = config(mode);
        let mut chain = Chain::new(&config);
        chain.background.learn_empty(&frame(&config, 0, &[]));
        chain.step(&frame(&config, 1, &PEOPLE_M), &[]);
        assert!(chain.finds(&PEOPLE_M, within_m), "{mode:?}: {:#?}", chain.detections);
        assert!(chain.health.is_clean());
        chain.step(&frame(&config, 2, &[]), &[]);
        assert!(chain.detections.is_empty(), "{mode:?}");
    }
}

#[test]
fn walkers_are_found_while_the_scene_is_learned() {
    let config = config(Mode::Default);
    let mut chain = Chain::new(&config);
    let walkers = |k: u64| PEOPLE_M.map(|p| p + DVec2::new(0.0, 0.12 * k as f64));
    for k in 0..12 {
        chain.step(&frame(&config, k, &walkers(k)), &[]);
    }
    assert!(chain.finds(&walkers(11), 0.15), "{:#?}", chain.detections);
}

#[test]
fn who_stands_at_the_start_is_seen_at_once_and_whole_once_they_walk() {
    let config = config(Mode::Default);
    let (mut chain, mut knowing) = (Chain::new(&config), Chain::new(&config));
    knowing.background.learn_empty(&frame(&config, 0, &[]));
    // Of the first revolution nothing is new.
    let expected = PEOPLE_M.map(expected_at);
    for k in 0..8 {
        chain.step(&frame(&config, k, &PEOPLE_M), if k < 2 { &[] } else { &expected });
        assert_eq!(chain.finds(&PEOPLE_M, 0.15), k > 0, "frame {k}: {:#?}", chain.detections);
    }
    for k in 8..12 {
        let walkers = PEOPLE_M.map(|p| p + DVec2::new(0.0, 0.1 * (k - 7) as f64));
        chain.step(&frame(&config, k, &walkers), &walkers.map(expected_at));
        knowing.step(&frame(&config, k, &walkers), &[]);
    }
    let (seen, whole) = (chain.points.len(), knowing.points.len());
    assert!(seen as f64 > 0.8 * whole as f64, "{seen} of {whole} points");
}

#[test]
fn who_stands_from_the_first_frame_on_is_followed_for_as_long_as_they_stand() {
    let config = config(Mode::Default);
    for empty_scan in [true, false] {
        let mut pipeline = Pipeline::new(&config, None).unwrap();
        if empty_scan {
            pipeline.learn_empty(&frame(&config, 0, &[]));
        }
        for k in 1..=450 {
            let outcome = pipeline.step(&frame(&config, k, &PEOPLE_M));
            let followed =
                |at: &DVec2| outcome.tracks.iter().any(|t| t.confirmed && t.position_m.distance(*at) < 0.2);
            assert!(k < 10 || PEOPLE_M.iter().all(followed), "frame {k}, empty scan: {empty_scan}");
        }
    }
}

#[test]
fn furniture_put_in_after_the_empty_scan_is_learned_and_forgotten_once_it_is_taken_away() {
    let config = config(Mode::Default);
    let (mut chain, thing, person) = (Chain::new(&config), PEOPLE_M[0], PEOPLE_M[1]);
    chain.background.learn_empty(&frame(&config, 0, &[]));
    let furniture = Prior { is_furniture: true, confirmed: false, ..expected_at(thing) };
    let priors = [furniture, expected_at(person)];
    for k in 0..10 {
        chain.step(&frame(&config, k, &[thing, person]), &priors);
    }
    assert!(chain.finds(&[person], 0.15), "{:#?}", chain.detections);
    // Taken away: after a second somebody who stands there is seen again.
    for k in 10..25 {
        chain.step(&frame(&config, k, &[person]), &[]);
        assert!(chain.finds(&[person], 0.15), "{:#?}", chain.detections);
    }
    chain.step(&frame(&config, 25, &[thing, person]), &[]);
    assert!(chain.finds(&[thing, person], 0.15), "{:#?}", chain.detections);
}

/// A lorry, a car, a door leaf: pieces of them have the shape of a person, and were people for as long as they stood.
#[test]
fn what_appears_out_of_nothing_is_learned_although_it_has_the_shape_of_a_person() {
    let config = config(Mode::Default);
    let (mut chain, thing, person) = (Chain::new(&config), PEOPLE_M[0], PEOPLE_M[1]);
    chain.background.learn_empty(&frame(&config, 0, &[]));
    let came_walking = Prior { walked: true, ..expected_at(person) };
    for k in 1..100 {
        let here = if k < 10 { vec![] } else { vec![thing, person] };
        let priors = if k <= 10 { vec![came_walking] } else { vec![expected_at(thing), came_walking] };
        chain.step(&frame(&config, k, &here), &priors);
        match k {
            10 => assert!(chain.finds(&here, 0.15), "at once"),
            40.. => assert!(chain.finds(&[person], 0.15), "frame {k}: {:#?}", chain.detections),
            _ => {}
        }
    }
}

#[test]
fn who_is_invented_where_something_appears_is_gone_again_within_seconds() {
    let config = config(Mode::Default);
    let mut pipeline = Pipeline::new(&config, None).unwrap();
    pipeline.learn_empty(&frame(&config, 0, &[]));
    for k in 1..=60 {
        let here: &[DVec2] = if k < 10 { &[] } else { &PEOPLE_M };
        let outcome = pipeline.step(&frame(&config, k, here));
        assert!(k < 40 || outcome.tracks.iter().all(|track| !track.confirmed), "frame {k}");
    }
}

#[test]
fn who_may_have_come_while_a_sensor_was_silent_is_not_learned() {
    let config = config(Mode::Default);
    let mut pipeline = Pipeline::new(&config, None).unwrap();
    pipeline.learn_empty(&frame(&config, 0, &[]));
    for k in (1..10).chain(20..300) {
        let here: &[DVec2] = if k < 10 { &[] } else { &PEOPLE_M };
        let outcome = pipeline.step(&frame(&config, k, here));
        let followed =
            |at: &DVec2| outcome.tracks.iter().any(|t| t.confirmed && t.position_m.distance(*at) < 0.2);
        assert!(k < 30 || here.iter().all(followed), "frame {k}");
    }
}

#[test]
fn who_stands_still_is_learned_unless_expected_there() {
    let config = config(Mode::Default);
    let standing = [PEOPLE_M[0]];
    let prior = expected_at(standing[0]);
    for (priors, still_seen) in [(vec![prior], true), (vec![], false)] {
        let mut chain = Chain::new(&config);
        for k in 0..10 {
            chain.step(&frame(&config, k, &[]), &[]);
        }
        for k in 10..60 {
            chain.step(&frame(&config, k, &standing), &priors);
        }
        assert_eq!(chain.finds(&standing, 0.15), still_seen);
    }
}

#[test]
fn the_order_of_the_points_changes_nothing() {
    for mode in [Mode::Paper, Mode::Default] {
        let config = config(mode);
        let (mut forward, mut backward) = (Chain::new(&config), Chain::new(&config));
        for k in 0..8 {
            let people: Vec<DVec2> = PEOPLE_M.iter().map(|p| *p + DVec2::splat(0.1 * k as f64)).collect();
            let frame = frame(&config, k, if k == 0 { &[] } else { &people });
            let mut reversed = frame.clone();
            for scan in &mut reversed.scans {
                if let Cloud::Unorganised(points) = &mut scan.cloud {
                    points.reverse();
                }
            }
            assert_eq!(forward.step(&frame, &[]), backward.step(&reversed, &[]), "{mode:?}, frame {k}");
        }
        assert!(!forward.detections.is_empty());
    }
}

#[test]
fn broken_points_are_counted_and_skipped() {
    for mode in Mode::ALL {
        let config = config(mode);
        let mut chain = Chain::new(&config);
        chain.background.learn_empty(&frame(&config, 0, &[]));
        let mut broken = frame(&config, 1, &PEOPLE_M);
        if let Cloud::Unorganised(points) = &mut broken.scans[0].cloud {
            for position_m in [[f32::NAN, 1.0, 1.0], [f32::INFINITY; 3], [0.0; 3], [900.0, 0.0, 0.0]] {
                points.push(SensorPoint { position_m, time_ns: 0, reflectivity: 0.0 });
            }
        }
        broken.scans.push(Scan { sensor: 7, ..broken.scans[0].clone() });
        chain.step(&broken, &[]);
        assert_eq!(chain.health.points_invalid, 4, "{mode:?}");
        assert_eq!(chain.detections.len(), PEOPLE_M.len(), "{mode:?}");
        let nothing = Frame { index: 2, time_ns: 200_000_000, scans: Vec::new() };
        assert!(chain.step(&nothing, &[]).is_empty());
    }
}

#[test]
fn more_points_than_the_limit_are_counted_and_dropped() {
    const POINTS: usize = 40_007;
    let config = config(Mode::Default);
    let mut chain = Chain::new(&config);
    chain.background.learn_empty(&frame(&config, 0, &[]));
    let mut crowded = frame(&config, 1, &[]);
    let near =
        |i: usize| SensorPoint { position_m: [1.0, 1e-5 * i as f32, 0.0], time_ns: 0, reflectivity: 0.0 };
    // Level with a sensor that hangs no higher than people are tall.
    crowded.scans.truncate(1);
    crowded.scans[0].site_from_sensor.translation_m.z = 1.5;
    crowded.scans[0].cloud = Cloud::Unorganised((0..POINTS).map(near).collect());
    let mut points = Vec::new();
    chain.background.foreground(&crowded, &[], &mut chain.health, &mut points);
    assert_eq!((points.len(), chain.health.points_over_limit), (40_000, 7));
}
