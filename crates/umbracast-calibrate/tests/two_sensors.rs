//! Two simulated sensors that a site file has elsewhere, and one whose clock is apart, are found again.

use umbracast::lidar::{Assembler, Packet};
use umbracast::site::Sensor;
use umbracast::{Config, Frame, Health, Site};
use umbracast_calibrate::{Calibration, Frame as Held, Survey};
use umbracast_sim::crowd::{Preset, strolling};
use umbracast_sim::scene::Scene;

const SEED: u64 = 200_400;

fn frames(site: &Site, packets: impl Iterator<Item = Vec<Vec<Packet>>>) -> Vec<Frame> {
    let (mut assembler, mut health) = (Assembler::new(site).unwrap(), Health::default());
    let mut frames = Vec::new();
    for of_sensors in packets {
        let of =
            |(sensor, packets): (usize, Vec<Packet>)| packets.into_iter().map(move |packet| (sensor, packet));
        let mut all: Vec<(usize, Packet)> = of_sensors.into_iter().enumerate().flat_map(of).collect();
        all.sort_by_key(|(_, packet)| packet.time_ns);
        all.iter().for_each(|(sensor, packet)| assembler.push(*sensor, packet, &mut health));
        frames.extend(std::iter::from_fn(|| assembler.pop()));
    }
    frames
}

/// Some seconds of four people, seen by sensors that hang as `truth` says, looked at by somebody who believes `given`.
fn calibrated(truth: &Site, given: &Site, seconds: u64) -> Calibration {
    let crowd = strolling(Preset::Orca03, 4, 7.0, SEED, seconds);
    let mut scene = Scene::new(crowd, truth, SEED).unwrap();
    let empty = frames(given, Scene::empty(truth, SEED, 5).unwrap().into_iter());
    let mut survey = Survey::new(given).unwrap();
    empty.iter().for_each(|frame| survey.take(frame));
    let mut walkers = survey.level();
    empty.iter().for_each(|frame| walkers.learn_empty(frame));
    let recorded = frames(given, std::iter::from_fn(|| Some(scene.next_frame()?.packets)));
    recorded.iter().for_each(|frame| walkers.take(frame));
    walkers.finish().unwrap()
}

/// Each sensor's degrees and metres from the truth.
fn off(truth: &Site, found: &Calibration) -> Vec<(f64, f64)> {
    let of = |(sensor, found): (&Sensor, &umbracast_calibrate::Found)| {
        let is = Sensor { position_m: found.position_m, rotation_deg: found.rotation_deg, ..sensor.clone() };
        let (is, of) = (is.site_from_sensor(), sensor.site_from_sensor());
        let turn = of.rotation.transpose() * is.rotation;
        let cosine = 0.5 * (turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0);
        (cosine.clamp(-1.0, 1.0).acos().to_degrees(), is.translation_m.distance(of.translation_m))
    };
    truth.sensors.iter().zip(&found.sensors).map(of).collect()
}

#[test]
fn sensors_that_hang_elsewhere_are_found_with_their_clock() {
    let mut truth = Config::default().site;
    truth.simulation.clock_ahead_ms.insert("lidar_west".to_owned(), 35.0);
    let mut given = truth.clone();
    for (sensor, [yaw, pitch, roll]) in given.sensors.iter_mut().zip([[20.0, -4.0, 3.0], [-14.0, 3.0, -4.0]])
    {
        sensor.rotation_deg.yaw += yaw;
        sensor.rotation_deg.pitch += pitch;
        sensor.rotation_deg.roll += roll;
        sensor.position_m[1] += 0.8;
        sensor.position_m[2] -= 0.3;
    }
    let found = calibrated(&truth, &given, 25);
    for (s, (deg, m)) in off(&truth, &found).into_iter().enumerate() {
        assert!(deg < 0.1 && m < 0.02, "{s}: {deg} deg, {m} m, {:?}", found.told);
    }
    let west = &found.sensors[1];
    assert!((west.clock_offset_ms - 35.0).abs() < 5.0, "{west:?}");
    assert!(west.sigma.clock_ms.unwrap() < 5.0 && west.frame == Held::Walls && west.with == ["lidar_east"]);

    // The offset that was found leaves nothing to find.
    given.sensors[1].clock_offset_ms = 35.0;
    let again = calibrated(&truth, &given, 25);
    assert!((again.sensors[1].clock_offset_ms - 35.0).abs() < 5.0, "{:?}", again.sensors[1]);
}

#[test]
fn without_walls_the_sensors_are_found_against_one_another() {
    let truth = Config::default().site;
    let mut given = truth.clone();
    (given.hall.length_m, given.hall.width_m) = (90.0, 90.0);
    given.pillars.clear();
    given.furniture.clear();
    for sensor in &mut given.sensors {
        sensor.rotation_deg.yaw += 5.0;
        sensor.position_m[0] += 1.0;
    }
    // A minute, for people alone tell the angle: in 25 s draws of them differ by 0.2 degrees.
    let found = calibrated(&truth, &given, 60);
    let place = |s: usize| umbracast::geometry::DVec3::from_array(found.sensors[s].position_m);
    assert!(found.sensors.iter().all(|sensor| sensor.frame == Held::SiteFile));
    assert!((place(0).distance(place(1)) - 32.0).abs() < 0.03, "{} {}", place(0), place(1));
    let turned_deg =
        (found.sensors[0].rotation_deg.yaw - found.sensors[1].rotation_deg.yaw).rem_euclid(360.0);
    assert!((turned_deg - 180.0).abs() < 0.1, "{turned_deg}");
    // Both were a metre off in the same direction: nothing tells, and nothing is said to.
    assert!((0.5 * (place(0).x + place(1).x) - 1.0).abs() < 0.1);
}

#[test]
fn one_sensor_alone_is_levelled_and_stays_where_the_file_has_it() {
    let mut truth = Config::default().site;
    truth.sensors.truncate(1);
    let mut given = truth.clone();
    (given.hall.length_m, given.hall.width_m) = (90.0, 90.0);
    given.pillars.clear();
    given.furniture.clear();
    given.sensors[0].rotation_deg.pitch = 31.0;
    given.sensors[0].rotation_deg.roll = -2.0;
    given.sensors[0].position_m = [15.0, 0.5, 8.7];
    let found = &calibrated(&truth, &given, 3).sensors[0];
    let turn = found.rotation_deg;
    assert!((turn.pitch - 35.0).abs() < 0.02 && turn.roll.abs() < 0.02, "{turn:?}");
    assert!((found.position_m[2] - 9.0).abs() < 0.01, "{found:?}");
    assert!((found.position_m[0], found.position_m[1]) == (15.0, 0.5) && turn.yaw == 180.0, "{found:?}");
    assert!(found.sigma.yaw_deg.is_none() && found.sigma.x_m.is_none() && found.sigma.clock_ms.is_none());
    assert!(found.sigma.pitch_deg.is_some() && found.with.is_empty());
}
