//! Python clients that know nothing of this project list our ROS 2 topics, read and decode them, and publish as a
//! driver does (`peers.py`). If they are not installed, the test says that it skipped.

use std::io::Write;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use serde_json::Value;
use umbracast::Config;
use umbracast::detect::Point;
use umbracast::geometry::DVec3;
use umbracast::site::{Handover, Radio};
use umbracast_io::nodes::Warning;
use umbracast_io::results::Results;
use umbracast_io::rows::{BindingRow, DecisionRow, DetectionRow, LinkRow, LossRow, TrackRow};
use umbracast_node::hall::{Hall, Urgency};
use umbracast_node::keys::Keys;
use umbracast_node::ros2::{self, Face, Node};
use zenoh::Wait;

const DOMAIN: u32 = 42;

/// A router on a free port of this host, and the port.
fn router() -> (zenoh::Session, u16) {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut config = zenoh::Config::default();
    config.insert_json5("mode", "\"router\"").unwrap();
    config.insert_json5("listen/endpoints", &format!("[\"tcp/127.0.0.1:{port}\"]")).unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    (zenoh::open(config).wait().unwrap(), port)
}

#[test]
fn clients_of_others_list_decode_and_send() {
    let (session, port) = router();
    let mut site = Config::default().site;
    site.access_points[0].radio = Some(Radio::default());
    site.handover = Some(Handover::default());
    let mut face = Face::new(&session, DOMAIN, "", &site).unwrap();
    let node = Node::new(&session, DOMAIN, "", "umbracast_sensor").unwrap();
    let clouds = Arc::new(Mutex::new(Vec::new()));
    let packets = Arc::new(Mutex::new(Vec::new()));
    let (seen, scanned) = (clouds.clone(), packets.clone());
    let _clouds =
        ros2::clouds(&node, "/lidar/points", move |cloud| seen.lock().unwrap().push(cloud)).unwrap();
    let _packets =
        ros2::packets(&node, "/velodyne_packets", move |p| scanned.lock().unwrap().push(p)).unwrap();

    let python = std::env::var("UMBRACAST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut peer = Command::new(&python);
    peer.arg(folder.join("tests/peers.py")).arg(format!("tcp/127.0.0.1:{port}"));
    peer.args([&DOMAIN.to_string(), "3"]).arg(folder.join("../../ros2/umbracast_msgs/msg"));
    let child = peer.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let Ok(mut child) = child else { return skipped(&python) };

    let hall = Hall::new(session.clone(), Keys::new("lab"));
    let outlet = hall.outlet(&hall.keys().warnings("side"), Urgency::Warning).unwrap();
    let over = Arc::new(AtomicBool::new(false));
    let publishing = {
        let over = over.clone();
        std::thread::spawn(move || {
            let tracks = [TrackRow { track: 17, x_m: 3.25, confirmed: true, ..TrackRow::default() }];
            let mut link = LinkRow { track: 17, ..LinkRow::default() };
            link.p[8] = 0.75;
            let points = [Point { position_m: DVec3::new(1.0, 2.0, 0.5), time_ns: 1, sensor: 0 }];
            for frame in 0.. {
                if over.load(Ordering::Relaxed) {
                    break;
                }
                let results = Results {
                    frame,
                    time_ns: frame as i64 * 100_000_000,
                    logged_ns: 5,
                    detections: &[DetectionRow::default()],
                    tracks: &tracks,
                    links: &[link],
                    losses: &[LossRow { track: 17, ..LossRow::default() }],
                    bindings: &[BindingRow { device: 1, track: 17, ..BindingRow::default() }],
                    reports: &[],
                    decisions: &[DecisionRow { track: 17, ..DecisionRow::default() }],
                    foreground: Some(&points),
                };
                face.publish(&results).unwrap();
                let mut warning = Warning {
                    access_point: "side".to_owned(),
                    p_w9: 0.75,
                    state: "warning".to_owned(),
                    ..Warning::default()
                };
                outlet.put(&mut warning);
                std::thread::sleep(Duration::from_millis(50));
            }
        })
    };
    // The other side sends until it is told that both have come, and ends.
    let have_come = || !clouds.lock().unwrap().is_empty() && packets.lock().unwrap().len() > 1;
    while child.try_wait().unwrap().is_none() {
        if have_come() {
            session.put("test/done", "").wait().unwrap();
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    over.store(true, Ordering::Relaxed);
    publishing.join().unwrap();
    let output = child.wait_with_output().unwrap();
    if String::from_utf8_lossy(&output.stderr).contains("ModuleNotFoundError") {
        return skipped(&python);
    }
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["nodes"], serde_json::json!(["umbracast", "umbracast_sensor"]));
    assert_eq!((&found["complete"], &found["answered"]), (&true.into(), &true.into()), "{found}");
    assert_eq!(found["warning"], serde_json::json!(["umbracast/lab/warnings/side", "warning", 0.75]));
    let topics = found["topics"].as_object().unwrap();
    let expected = [
        "bindings",
        "blockages",
        "decisions",
        "detections",
        "foreground",
        "losses",
        "markers",
        "people",
        "tracks",
    ];
    let mut expected: Vec<String> = expected.iter().map(|name| format!("/umbracast/{name}")).collect();
    expected.insert(0, "/tf".to_owned());
    assert_eq!(topics.keys().cloned().collect::<Vec<_>>(), expected);
    for (topic, of_topic) in topics {
        assert_eq!(of_topic["hash"], true, "{topic}: rosbags computes another hash");
        assert!(of_topic["rows"].as_u64() >= Some(1), "{topic}: {of_topic}");
        let attachment = &of_topic["attachment"];
        assert!(attachment[0].as_u64() >= Some(3) && attachment[1] == 5, "{topic}: {of_topic}");
        assert_eq!((&attachment[2], &attachment[3]), (&16.into(), &33.into()), "{topic}");
        let listed = format!("{topic} [{}]", of_topic["type"].as_str().unwrap());
        assert!(found["listed"].as_array().unwrap().iter().any(|line| line == &listed), "{listed}: {found}");
    }
    assert_eq!(topics["/umbracast/tracks"]["first"], serde_json::json!([17, 3.25]));
    let access_point = &site.access_points[0].name;
    assert_eq!(topics["/umbracast/blockages"]["first"], serde_json::json!([access_point, 0.75]));

    let clouds = clouds.lock().unwrap();
    let cloud = clouds[0].as_ref().expect("a cloud");
    assert_eq!((cloud.frame_id.as_str(), cloud.stamp_ns), ("lidar", 1_700_000_000_100_000_000));
    assert_eq!((cloud.points.len(), cloud.points[1].position_m), (2, [5.0, 6.0, 7.0]));
    let packets = packets.lock().unwrap();
    let payloads: Vec<u8> = packets[..2].iter().map(|p| p.as_ref().expect("a packet").payload[0]).collect();
    assert_eq!(payloads, [7, 8]);
}

/// To the terminal itself: a test's output is held back when it passes.
fn skipped(python: &str) {
    let _ = writeln!(std::io::stderr(), "skipped: {python} has no eclipse-zenoh, zenoh-ros2-sdk and rosbags");
}
