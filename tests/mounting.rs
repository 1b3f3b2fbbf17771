//! A simulated sensor that slips is told within seconds and put right; sensors that hang right are left as they are.

use umbracast::geometry::Pose;
use umbracast::lidar::{Assembler, Packet};
use umbracast::mounting::Mountings;
use umbracast::site::Slip;
use umbracast::{Config, Frame, Health, Pipeline, Site};
use umbracast_sim::crowd::{Preset, strolling};
use umbracast_sim::scene::Scene;

const SEED: u64 = 200_500;

/// Six people for some seconds.
fn frames(site: &Site, seconds: u64) -> Vec<Frame> {
    let crowd = strolling(Preset::Orca03, 6, 8.0, SEED, seconds);
    let mut scene = Scene::new(crowd, site, SEED).unwrap();
    let (mut assembler, mut health) = (Assembler::new(site).unwrap(), Health::default());
    let mut frames = Vec::new();
    while let Some(frame) = scene.next_frame() {
        let of =
            |(sensor, packets): (usize, Vec<Packet>)| packets.into_iter().map(move |packet| (sensor, packet));
        let mut all: Vec<(usize, Packet)> = frame.packets.into_iter().enumerate().flat_map(of).collect();
        all.sort_by_key(|(_, packet)| packet.time_ns);
        all.iter().for_each(|(sensor, packet)| assembler.push(*sensor, packet, &mut health));
        frames.extend(std::iter::from_fn(|| assembler.pop()));
    }
    frames
}

fn slip(after_s: f64, turned_deg: [f64; 3], shifted_m: [f64; 3]) -> Site {
    let mut site = Config::default().site;
    site.simulation.slip.insert("lidar_west".to_owned(), Slip { after_s, turned_deg, shifted_m });
    site
}

/// Degrees and metres between two poses.
fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    let turn = a.rotation.transpose() * b.rotation;
    let cosine = 0.5 * (turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0);
    (cosine.clamp(-1.0, 1.0).acos().to_degrees(), a.translation_m.distance(b.translation_m))
}

#[test]
fn a_sensor_that_slips_is_told_and_put_right_within_two_seconds() {
    for turned_deg in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]] {
        let site = slip(2.0, turned_deg, [0.0; 3]);
        let truth = site.simulation.slip["lidar_west"].slipped(&site.sensors[1].site_from_sensor());
        let (mut mountings, mut health) =
            (Mountings::new(&Config::default().detect, &site), Health::default());
        let (mut told_s, mut last) = (None, None);
        for frame in frames(&site, 5) {
            last = Some(mountings.follow(&frame, &mut health).into_owned());
            let now_s = frame.time_ns as f64 * 1e-9;
            assert!(health.sensors_moved == 0 || now_s > 2.0, "told before it happened");
            if health.sensors_moved > 0 && told_s.is_none() {
                told_s = Some(now_s);
                assert_eq!(mountings.moved(), [1], "what it has learned is no more");
            }
        }
        assert!(told_s.is_some_and(|told_s| told_s < 4.0), "{told_s:?}");
        let last = last.unwrap();
        assert_eq!(last.scans[0].site_from_sensor, site.sensors[0].site_from_sensor());
        let (deg, m) = apart(&last.scans[1].site_from_sensor, &truth);
        assert!(deg < 0.1 && m < 0.03, "{deg} deg, {m} m");
        assert_eq!(health.sensors_moved, 1);
    }
}

#[test]
fn a_sensor_that_never_hung_right_is_put_right_and_keeps_what_it_learned() {
    let site = slip(0.0, [0.3, -0.3, 0.2], [0.02, 0.0, -0.02]);
    let truth = site.simulation.slip["lidar_west"].slipped(&site.sensors[1].site_from_sensor());
    let (mut mountings, mut health) = (Mountings::new(&Config::default().detect, &site), Health::default());
    let mut last = None;
    for frame in frames(&site, 2) {
        last = Some(mountings.follow(&frame, &mut health).into_owned());
        assert!(mountings.moved().is_empty());
    }
    let (deg, m) = apart(&last.unwrap().scans[1].site_from_sensor, &truth);
    assert!(deg < 0.1 && m < 0.04 && health.sensors_moved == 1, "{deg} deg, {m} m, {health:?}");
}

/// To the byte: nothing that the tables are made of may change where nothing is wrong.
#[test]
fn where_all_hang_right_nothing_changes() {
    let mut config = Config::default();
    let frames = frames(&config.site, 4);
    let mut following = Pipeline::new(&config, None).unwrap();
    config.detect.follow_sensors = false;
    let mut plain = Pipeline::new(&config, None).unwrap();
    for frame in &frames {
        assert_eq!(following.step(frame), plain.step(frame));
    }
}
