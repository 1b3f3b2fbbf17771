//! A front end that starts before anybody has the empty hall.

use std::sync::Arc;
use std::sync::mpsc::channel;
use std::time::Duration;

use umbracast::Config;
use umbracast::lidar::Packet;
use umbracast_io::nodes::Foreground;
use umbracast_live::HostClock;
use umbracast_live::receive::Arrived;
use umbracast_node::front::{self, Front};
use umbracast_node::hall::Hall;
use umbracast_node::keys::Keys;
use umbracast_node::role::Role;
use umbracast_node::share::{Shared, empty_frames};
use umbracast_node::{Node, Settings, Source};
use umbracast_sim::crowd::{Ground, Preset, Stroll};
use umbracast_sim::scene::Scene;
use zenoh::Wait;

const SOON: Duration = Duration::from_secs(20);
const SEED: u64 = 200_000;
const FRAMES: usize = 6;

/// A hall of its own, which nobody else reaches.
fn hall() -> Hall {
    let mut config = zenoh::Config::default();
    config.insert_json5("listen/endpoints", "[]").unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    Hall::new(zenoh::open(config).wait().unwrap(), Keys::new("lab"))
}

/// The packets of the first sensor while people walk, and those of every sensor in the empty hall.
fn simulated(config: &Config) -> (Vec<Arrived>, Vec<Vec<Packet>>) {
    let crowd = Stroll::new(Preset::Orca03, 4, &Ground::circle(5.0), SEED).leg(1);
    let mut scene = Scene::new(crowd, &config.site, SEED).unwrap();
    let frames = std::iter::from_fn(|| scene.next_frame()).take(FRAMES);
    let packets = frames.flat_map(|frame| frame.packets[0].clone());
    let packets = packets.map(|packet| Arrived { sensor: 0, packet }).collect();
    let empty = Scene::empty(&config.site, SEED, 5).unwrap();
    let of_sensor = |sensor: usize| empty.iter().flat_map(|frame| frame[sensor].clone()).collect();
    (packets, (0..config.site.sensors.len()).map(of_sensor).collect())
}

#[test]
fn a_front_end_that_starts_before_the_tracker_gets_the_empty_hall_from_it_later() {
    let (hall, config, clock) = (hall(), Config::default(), HostClock::start());
    let (packets, empty) = simulated(&config);
    let (sender, came) = channel();
    let hear = move |sample: zenoh::sample::Sample| {
        let foreground = front::heard(sample.key_expr().as_str(), &sample.payload().to_bytes());
        let _ = sender.send(foreground.expect("of the sensors that its key names")); // The test may be over.
    };
    let key = hall.keys().of("sensor/*/foreground");
    hall.session().declare_subscriber(key).callback(hear).background().wait().unwrap();
    let node = Node::start(
        hall.clone(),
        Settings {
            stages: vec![Role::Sensor],
            config: config.clone(),
            weights: None,
            sensors: vec![0],
            // It begins when the other sensor's front end and all stages are there.
            source: Source::Replay(Box::new(packets.clone().into_iter()), 1.0),
            empty: Vec::new(),
            wait: Duration::from_millis(100),
            record: None,
            listener: None,
            shared: Shared::default(),
            threads: 1,
            clock,
        },
    )
    .unwrap();
    assert!(!node.has_empty_hall() && !node.summary().empty_hall);

    let _tracker = Shared::default().with_empty(&hall, &config.site, &empty).answer(&hall).unwrap();
    let until_ns = clock.now_ns() + SOON.as_nanos() as i64;
    while !node.has_empty_hall() && clock.now_ns() < until_ns {
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(node.summary().empty_hall);
    let _others =
        [(Role::Sensor, Some("lidar_west")), (Role::Track, None), (Role::Forecast, None), (Role::Cast, None)]
            .map(|(role, name)| hall.show(role, name).unwrap());

    // It sees what one sees that had the empty hall from the first.
    let frames = empty_frames(&config.site, &empty).unwrap();
    let mut knows = Front::new(&config, &[0], &frames, Arc::default(), clock).unwrap();
    let mut expected: Vec<Foreground> = Vec::new();
    packets.iter().for_each(|arrived| knows.push(arrived, |foreground| expected.push(foreground)));
    knows.finish(|foreground| expected.push(foreground));
    assert!(expected.len() >= FRAMES - 1 && expected.iter().any(|foreground| !foreground.points.is_empty()));
    for expected in expected {
        let found = came.recv_timeout(SOON).expect("a frame");
        assert_eq!((found.time_ns, found.points), (expected.time_ns, expected.points));
    }
    node.stop();
}
