//! Inputs in place of sensors' packets: lists of another perception system, and topics of ROS 2.

use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use umbracast::geometry::DVec2;
use umbracast::lidar::Assembler;
use umbracast::{Config, Health, STEP_NS};
use umbracast_io::nodes::{Followed, Foreground};
use umbracast_io::{fields, messages};
use umbracast_live::HostClock;
use umbracast_node::hall::Hall;
use umbracast_node::keys::Keys;
use umbracast_node::role::Role;
use umbracast_node::share::Shared;
use umbracast_node::{Node, Settings, Source, ros2};
use umbracast_sim::crowd::{Ground, Preset, Stroll};
use umbracast_sim::scene::Scene;
use zenoh::Wait;

const SOON: Duration = Duration::from_secs(10);

/// A hall of its own, which nobody else reaches.
fn hall() -> Hall {
    let mut config = zenoh::Config::default();
    config.insert_json5("listen/endpoints", "[]").unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    Hall::new(zenoh::open(config).wait().unwrap(), Keys::new("lab"))
}

fn settings(stages: &[Role], config: &Config, source: Source) -> Settings {
    Settings {
        stages: stages.to_vec(),
        config: config.clone(),
        weights: None,
        sensors: (0..config.site.sensors.len()).collect(),
        source,
        empty: Vec::new(),
        wait: Duration::from_millis(100),
        record: None,
        listener: None,
        shared: Shared::default(),
        threads: 1,
        clock: HostClock::start(),
    }
}

fn heard<M: fields::Message + Send + 'static>(hall: &Hall, key: &str) -> Receiver<M> {
    let (sender, receiver) = channel();
    let hear = move |sample: zenoh::sample::Sample| {
        let message = fields::decode::<M>(&sample.payload().to_bytes()).expect("a message");
        let _ = sender.send(message); // The test may be over.
    };
    hall.session().declare_subscriber(hall.keys().of(key)).callback(hear).background().wait().unwrap();
    receiver
}

#[test]
fn people_of_another_perception_are_followed_and_foreseen() {
    let (hall, config) = (hall(), Config::default());
    let tracks = heard::<Followed>(&hall, "tracks");
    let stages = [Role::Track, Role::Forecast, Role::Cast];
    let node = Node::start(hall.clone(), settings(&stages, &config, Source::Doors(Vec::new()))).unwrap();
    let start_ns = 1_700_000_000_000_000_000;
    let mut last = Followed::default();
    for frame in 0..20_i64 {
        let (time_ns, x_m) = (start_ns + frame * STEP_NS, 0.12 * frame as f64 - 1.0);
        let list = serde_json::json!({ "time_ns": time_ns, "objects": [
            { "id": 7, "position_m": [x_m, 0.5], "size_m": [0.3, 0.5, 1.75], "velocity_mps": [1.2, 0.0] },
            { "id": 8, "position_m": [3.0, 3.0], "size_m": [4.0, 1.8, 1.5] },
        ] });
        hall.session().put(hall.keys().of("objects/vendor"), list.to_string()).wait().unwrap();
        last = tracks.recv_timeout(SOON).expect("a frame");
        assert_eq!(last.time_ns, time_ns);
    }
    let confirmed: Vec<_> = last.tracks.iter().filter(|track| track.confirmed).collect();
    assert_eq!((confirmed.len(), last.forecasts.len()), (1, 1), "the car is nobody");
    let apart_m = confirmed[0].position_m.distance(DVec2::new(0.12 * 19.0 - 1.0, 0.5));
    assert!(apart_m < 0.2 && (confirmed[0].velocity_mps.x - 1.2).abs() < 0.3, "{:?}", confirmed[0]);
    assert_eq!(last.health.points_invalid, 20, "one car a frame");
    hall.session().put(hall.keys().of("objects/vendor"), "{}").wait().unwrap();
    let summary = node.stop();
    assert_eq!((summary.frames, summary.broken), (20, 1));
}

#[test]
fn tracks_of_another_perception_are_kept_and_answered_as_json() {
    let (hall, config) = (hall(), Config::default());
    let tracks = heard::<Followed>(&hall, "tracks");
    let (sender, json) = channel();
    let hear = move |sample: zenoh::sample::Sample| {
        let frame: serde_json::Value = serde_json::from_slice(&sample.payload().to_bytes()).expect("JSON");
        let _ = sender.send(frame); // The test may be over.
    };
    hall.session().declare_subscriber(hall.keys().of("json")).callback(hear).background().wait().unwrap();
    let stages = [Role::Track, Role::Forecast, Role::Cast];
    let node = Node::start(hall.clone(), settings(&stages, &config, Source::Doors(Vec::new()))).unwrap();
    let mut alone = umbracast::Pipeline::new(&config, None).unwrap();
    let start_ns = 1_700_000_000_000_000_000;
    for frame in 0..20_i64 {
        let (time_ns, x_m) = (start_ns + frame * STEP_NS, 0.125 * frame as f64 - 1.0);
        // Somebody who would need three frames to be believed, and two who stand too near to be told apart.
        let list = serde_json::json!({ "time_ns": time_ns, "tracked": true, "objects": [
            { "id": 812, "position_m": [x_m, 0.5], "velocity_mps": [1.25, 0.0] },
            { "id": 7, "position_m": [13.0, 0.1], "velocity_mps": [0.0, 0.0] },
            { "id": 9, "position_m": [13.0, 0.2], "velocity_mps": [0.0, 0.0] },
            { "id": 10, "position_m": [3.0, 3.0] },
        ] });
        hall.session().put(hall.keys().of("objects/vendor"), list.to_string()).wait().unwrap();
        let found = tracks.recv_timeout(SOON).expect("a frame");
        let ids: Vec<u64> = found.tracks.iter().map(|track| track.id).collect();
        assert_eq!((found.time_ns, ids), (time_ns, vec![7, 9, 812]));
        assert_eq!(found.tracks[2].position_m, DVec2::new(x_m, 0.5));
        let outcome = alone.step_tracks(frame as u64, time_ns, &found.tracks);
        assert_eq!(outcome.forecasts, found.forecasts, "as one process has them");
        let told = json.recv_timeout(SOON).expect("a frame as JSON");
        assert_eq!(
            (told["time_ns"].as_i64(), told["tracks"][2]["track"].as_u64()),
            (Some(time_ns), Some(812))
        );
        let links = told["blockages"].as_array().expect("links");
        assert_eq!(links.len(), outcome.blockages.len());
        for (link, expected) in links.iter().zip(&outcome.blockages) {
            assert_eq!(
                (link["p_now"].as_f64(), link["p_w9"].as_f64()),
                (Some(expected.p_now), Some(expected.p[8]))
            );
        }
    }
    let summary = node.stop();
    assert_eq!((summary.frames, summary.broken, summary.health.points_invalid), (20, 0, 20));
}

#[test]
fn packets_of_drivers_give_foreground() {
    let (hall, config) = (hall(), Config::default());
    let topics = (0..config.site.sensors.len()).map(|s| (s, format!("/lidar_{s}/velodyne_packets")));
    let topics: Vec<(usize, String)> = topics.collect();
    let foreground = heard::<Foreground>(&hall, "sensor/*/foreground");
    let source = Source::Ros2(3, topics.clone());
    let node = Node::start(hall.clone(), settings(&[Role::Sensor], &config, source)).unwrap();
    let driver = ros2::Node::new(hall.session(), 3, "", "velodyne_driver").unwrap();
    let publisher = |topic: &(usize, String)| driver.publisher(&topic.1, &messages::SCAN).unwrap();
    let mut publishers: Vec<ros2::Publisher> = topics.iter().map(publisher).collect();
    let crowd = Stroll::new(Preset::Orca03, 3, &Ground::circle(12.5), 7).leg(1);
    let mut scene = Scene::new(crowd, &config.site, 7).unwrap();
    while let Some(frame) = scene.next_frame() {
        for (publisher, packets) in publishers.iter_mut().zip(&frame.packets) {
            publisher.publish(1, messages::scan(frame.time_ns, "lidar", packets)).unwrap();
        }
    }
    publishers[0].publish(1, b"no message".to_vec()).unwrap();
    for frame in 1..8 {
        let message = foreground.recv_timeout(SOON).expect("a frame");
        assert_eq!((message.time_ns, message.views.len()), (frame * STEP_NS, publishers.len()));
    }
    let summary = node.stop();
    assert_eq!((summary.broken, summary.health.is_clean()), (1, true), "{:?}", summary.health);
}

#[test]
fn clouds_of_a_driver_give_foreground_by_the_tenth_of_a_second() {
    let (hall, mut config) = (hall(), Config::default());
    config.site.sensors.truncate(1);
    let crowd = Stroll::new(Preset::Orca03, 3, &Ground::circle(12.5), 7).leg(1);
    let (mut scene, mut assembler) =
        (Scene::new(crowd, &config.site, 7).unwrap(), Assembler::new(&config.site).unwrap());
    config.site.sensors[0].model = "points".to_owned();
    let foreground = heard::<Foreground>(&hall, "sensor/*/foreground");
    let source = Source::Ros2(3, vec![(0, "/lidar/points".to_owned())]);
    let node = Node::start(hall.clone(), settings(&[Role::Sensor], &config, source)).unwrap();
    let driver = ros2::Node::new(hall.session(), 3, "", "driver").unwrap();
    let mut publisher = driver.publisher("/lidar/points", &messages::CLOUD).unwrap();
    let mut health = Health::default();
    while let Some(simulated) = scene.next_frame() {
        simulated.packets[0].iter().for_each(|packet| assembler.push(0, packet, &mut health));
        while let Some(frame) = assembler.pop() {
            let cloud = messages::cloud(frame.time_ns - STEP_NS, "lidar", &frame.scans[0]);
            publisher.publish(1, cloud.clone()).unwrap();
            let message = foreground.recv_timeout(SOON).expect("a frame");
            assert_eq!((message.time_ns, message.views.len()), (frame.time_ns, 1));
            // Once more: the same frame.
            publisher.publish(1, cloud).unwrap();
        }
    }
    publisher.publish(1, b"no message".to_vec()).unwrap();
    while node.summary().broken == 0 {
        std::thread::yield_now();
    }
    let summary = node.stop();
    assert!(summary.frames > 5, "{}", summary.frames);
    // Health is that of the last frame, before which all clouds but its own had come twice.
    assert_eq!((summary.packets, summary.health.packets_late), (2 * summary.frames, summary.frames - 1));
}
