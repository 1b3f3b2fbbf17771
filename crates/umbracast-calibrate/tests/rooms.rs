//! Floors of small rooms and corridors that a sensor sees little of.

use umbracast::lidar::Assembler;
use umbracast::site::Rotation;
use umbracast::{Config, Health, Site};
use umbracast_calibrate::{Calibration, Survey};
use umbracast_sim::scene::Scene;

const SEED: u64 = 200_401;

/// An empty room with one sensor.
fn room(model: &str, size_m: [f64; 3], position_m: [f64; 3], pitch: f64) -> Site {
    let mut site = Config::default().site;
    [site.hall.length_m, site.hall.width_m, site.hall.height_m] = size_m;
    site.pillars.clear();
    site.furniture.clear();
    site.sensors.truncate(1);
    site.sensors[0].model = model.to_owned();
    site.sensors[0].position_m = position_m;
    site.sensors[0].rotation_deg = Rotation { yaw: 5.0, pitch, roll: 1.0 };
    site.access_points.iter_mut().for_each(|ap| ap.position_m = [0.0, 0.0, 2.0]);
    site
}

/// What somebody finds who takes the sensor for one that hangs `off_m` higher and is pitched 4 degrees more.
fn calibrated(truth: &Site, off_m: f64) -> Calibration {
    let mut given = truth.clone();
    given.sensors[0].position_m[2] += off_m;
    given.sensors[0].rotation_deg.pitch += 4.0;
    let (mut assembler, mut health) = (Assembler::new(&given).unwrap(), Health::default());
    let mut survey = Survey::new(&given).unwrap();
    for of_sensors in Scene::empty(truth, SEED, 6).unwrap() {
        of_sensors[0].iter().for_each(|packet| assembler.push(0, packet, &mut health));
        std::iter::from_fn(|| assembler.pop()).for_each(|frame| survey.take(&frame));
    }
    survey.level().finish().unwrap()
}

#[test]
fn a_ring_of_beams_on_the_walls_is_not_the_floor() {
    let rooms = [
        room("vlp-16", [22.2, 2.31, 4.37], [-10.8, -0.6, 3.92], 14.5),
        room("vlp-16", [14.08, 13.02, 3.86], [-6.74, 1.89, 2.86], 4.6),
        room("xt32", [14.65, 6.39, 5.06], [-7.03, 0.37, 4.4], 5.5),
        room("xt32", [23.9, 3.95, 4.89], [-11.66, 1.29, 4.26], 4.5),
    ];
    for truth in rooms {
        let found = calibrated(&truth, 0.2);
        let (is, sensor) = (&found.sensors[0], &truth.sensors[0]);
        let off_m = is.position_m[2] - sensor.position_m[2];
        let off_deg = is.rotation_deg.pitch - sensor.rotation_deg.pitch;
        assert!(off_m.abs() < 0.02 && off_deg.abs() < 0.2, "{off_m} m, {off_deg} deg: {is:?}");
        assert!(found.doubts.is_empty(), "{:?}", found.doubts);
    }
}

#[test]
fn a_floor_far_from_the_file_is_told_with_both_heights() {
    let truth = room("hdl-32e", [14.0, 10.0, 4.0], [-6.5, 0.0, 2.6], 15.0);
    let found = calibrated(&truth, 1.5);
    assert!((found.sensors[0].position_m[2] - 2.6).abs() < 0.02, "{:?}", found.sensors[0]);
    let [doubt] = &found.doubts[..] else { panic!("expected one doubt, found {:?}", found.doubts) };
    assert!(doubt.contains("2.60 m") && doubt.contains("4.10 m"), "{doubt}");
}

/// Its lowest beam meets the walls above the floor.
#[test]
fn a_sensor_that_sees_no_floor_says_so() {
    let truth = room("os2-128", [9.8, 8.4, 4.4], [-4.6, 1.2, 3.1], -4.0);
    assert!(!calibrated(&truth, 0.2).doubts.is_empty());
}
