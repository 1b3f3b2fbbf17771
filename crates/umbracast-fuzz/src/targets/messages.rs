//! What comes from other programs and nodes: messages, rows, clouds, lists of objects.

use umbracast::detect::Detection;
use umbracast::lidar::Views;
use umbracast::radio::Binder;
use umbracast::track::Tracker;
use umbracast::{Config, STEP_NS};
use umbracast_io::fields::{Message, decode, encode};
use umbracast_io::messages::{read_scan, read_sensor_packets, scan, sensor_packets};
use umbracast_io::nodes::{Followed, Foreground, NodeHealth, Priors, TrackerState, Warning};
use umbracast_io::rows::{DetectionRow, LinkRow, TrackRow};
use umbracast_io::wire::{self, WireRow};
use umbracast_io::{objects, point_cloud, reports};

use super::{Target, packets, step};

/// A message of a node that is understood is written again as it was read, and takes no more memory than its bytes account
/// for. The first byte says which message it is.
pub const NODES: Target = Target { name: "nodes", corpus: node_messages, check: node_message };
/// The same of rows and of recorded packets.
pub const ROWS: Target = Target { name: "rows", corpus: row_messages, check: row_message };
/// A cloud of another program gives finite points that stand in its bytes, or nothing.
pub const CLOUDS: Target = Target { name: "clouds", corpus: cloud_messages, check: cloud_message };
/// A list of objects gives detections that a tracker can follow and tracks that links can be cast of, or nothing. The first eight
/// bytes are the frame's time.
pub const OBJECTS: Target = Target { name: "objects", corpus: lists, check: list };
/// JSON of reports gives reports that a binder can take, or a sentence; what is passed on is read again as it was.
pub const REPORTS: Target = Target { name: "reports", corpus: reported, check: report };

/// What is read is no larger than so many times its bytes.
const GROWTH: usize = 64;

fn node_messages() -> Vec<Vec<u8>> {
    let outcome = step::outcome();
    let config = Config::default();
    let sensors: Vec<String> = config.site.sensors.iter().map(|sensor| sensor.name.clone()).collect();
    let views = Views::of(step::frame()).of_scans;
    let foreground = Foreground {
        time_ns: STEP_NS,
        sensors,
        covers: vec![0, 1],
        views,
        points: outcome.foreground.iter().copied().take(20).collect(),
        ..Foreground::default()
    };
    let (mut tracker, mut tracks) = (Tracker::new(&config.track, &config.site), Vec::new());
    let mut priors = Priors { time_ns: STEP_NS, tracker: "a".to_owned(), ..Priors::default() };
    for k in 1..4 {
        let views = Views { time_ns: k * STEP_NS, of_scans: Vec::new() };
        let seen: Vec<Detection> =
            outcome.detections.iter().map(|d| Detection { time_ns: views.time_ns, ..d.clone() }).collect();
        tracker.update(&views, &seen, &mut tracks);
        tracker.priors(views.time_ns + STEP_NS, &mut priors.priors);
    }
    let followed = Followed {
        time_ns: outcome.time_ns,
        tracks: outcome.tracks.clone(),
        forecasts: outcome.forecasts.clone(),
        sensors: vec![0, 1],
        ..Followed::default()
    };
    let state = TrackerState { version: "1".to_owned(), tracker: tracker.state(), ..TrackerState::default() };
    let warning =
        Warning { access_point: "side".to_owned(), state: "clear".to_owned(), ..Warning::default() };
    let health =
        NodeHealth { node: "a".to_owned(), stages: vec!["track".to_owned()], ..NodeHealth::default() };
    let of = |kind: u8, bytes: Vec<u8>| [vec![kind], bytes].concat();
    vec![
        of(0, encode(&mut { foreground })),
        of(1, encode(&mut { priors })),
        of(2, encode(&mut { followed })),
        of(3, encode(&mut { state })),
        of(4, encode(&mut { warning })),
        of(5, encode(&mut { health })),
    ]
}

fn node_message(input: &[u8]) -> bool {
    let Some((kind, bytes)) = input.split_first() else { return false };
    match kind % 6 {
        0 => again::<Foreground>(bytes).is_some(),
        1 => again::<Priors>(bytes).is_some(),
        2 => again::<Followed>(bytes).is_some(),
        3 => again::<TrackerState>(bytes).map(|state| taken_up(&state.tracker)).is_some(),
        4 => again::<Warning>(bytes).is_some(),
        _ => again::<NodeHealth>(bytes).is_some(),
    }
}

/// The message, once it was written and read again.
fn again<M: Message>(bytes: &[u8]) -> Option<M> {
    let mut message = decode::<M>(bytes)?;
    let written = encode(&mut message);
    assert!(written.len() <= GROWTH * bytes.len().max(GROWTH), "{} of {} bytes", written.len(), bytes.len());
    let mut read = decode::<M>(&written).expect("a message of ours");
    assert_eq!(encode(&mut read), written);
    Some(message)
}

/// A tracker that takes up a state says the same again.
fn taken_up(state: &[u8]) {
    let config = Config::default();
    let mut tracker = Tracker::new(&config.track, &config.site);
    if tracker.take_up(state) {
        let said = tracker.state();
        assert!(said.len() <= GROWTH * state.len().max(GROWTH));
        let mut other = Tracker::new(&config.track, &config.site);
        assert!(other.take_up(&said) && other.state() == said);
    }
}

fn access_points() -> [String; 2] {
    ["side", "centre"].map(str::to_owned)
}

fn row_messages() -> Vec<Vec<u8>> {
    let known = access_points();
    let model = umbracast::lidar::Model::by_name("xt32").expect("a model of the table");
    let packets = [packets::whole(&model, 0), packets::whole(&model, STEP_NS)];
    let velodyne = [packets::whole(&umbracast::lidar::Model::hdl_32e(), 0)];
    let of = |kind: u8, bytes: Vec<u8>| [vec![kind], bytes].concat();
    vec![
        of(0, wire::encode(STEP_NS, 1, &[DetectionRow::default(); 3], &known)),
        of(1, wire::encode(STEP_NS, 1, &[TrackRow::default(); 3], &known)),
        of(
            2,
            wire::encode(
                STEP_NS,
                1,
                &[LinkRow::default(), LinkRow { access_point: 1, ..LinkRow::default() }],
                &known,
            ),
        ),
        of(3, scan(STEP_NS, "lidar", &velodyne)),
        of(4, sensor_packets(STEP_NS, "lidar", &packets)),
    ]
}

fn row_message(input: &[u8]) -> bool {
    let Some((kind, bytes)) = input.split_first() else { return false };
    let held = match kind % 5 {
        0 => return rows::<DetectionRow>(bytes),
        1 => return rows::<TrackRow>(bytes),
        2 => return rows::<LinkRow>(bytes),
        3 => read_scan(bytes),
        _ => read_sensor_packets(bytes),
    };
    let Some(packets) = held else { return false };
    let held: usize = packets.iter().map(|packet| packet.payload.len() + 8).sum();
    assert!(held <= bytes.len(), "{held} bytes out of {}", bytes.len());
    true
}

fn rows<R: WireRow>(bytes: &[u8]) -> bool {
    let known = access_points();
    let Some((frame, time_ns, rows)) = wire::decode::<R>(bytes, &known) else { return false };
    let written = wire::encode(time_ns, frame, &rows, &known);
    let (again_frame, again_ns, again) = wire::decode::<R>(&written, &known).expect("a message of ours");
    assert_eq!((again_frame, again_ns, again.len()), (frame, time_ns, rows.len()));
    assert_eq!(wire::encode(again_ns, again_frame, &again, &known), written);
    true
}

fn cloud_messages() -> Vec<Vec<u8>> {
    let frame = step::frame();
    frame
        .scans
        .iter()
        .map(|scan| umbracast_io::messages::cloud(frame.time_ns, "lidar", &step::narrowed(scan)))
        .collect()
}

fn cloud_message(bytes: &[u8]) -> bool {
    let Some(cloud) = point_cloud::read(bytes) else { return false };
    // A point has three fields, which may lie over one another.
    assert!(cloud.points.len() as u64 + cloud.dropped <= bytes.len() as u64);
    assert!(cloud.points.iter().flat_map(|point| point.position_m).all(f32::is_finite));
    true
}

fn lists() -> Vec<Vec<u8>> {
    let list = r#"{ "time_ns": 900, "vendor": "x", "objects": [
        { "id": 17, "position_m": [3.0, 4.0, 0.0], "size_m": [0.4, 0.6, 1.7], "velocity_mps": [1.0, 0.0, 0.0],
          "heading_rad": 1.5707963267948966, "sigma_m": 0.1 },
        { "id": "car", "position_m": [9.0, 4.0], "size_m": [4.2, 1.8, 1.5] },
        { "position_m": [5.0, 6.0], "size_m": [0.5, 0.5, 1.6] } ] }"#;
    let tracked = r#"{ "time_ns": 900, "tracked": true, "objects": [
        { "id": 17, "position_m": [3.0, 4.0], "velocity_mps": [1.0, 0.0], "size_m": [0.4, 0.6, 1.7], "sigma_m": 0.1 },
        { "id": 4, "position_m": [5.0, 6.0, 0.0], "velocity_mps": [0.0, 0.0, 0.0], "heading_rad": 0.5 } ] }"#;
    [list, tracked].map(|list| [&STEP_NS.to_le_bytes()[..], list.as_bytes()].concat()).into()
}

fn list(input: &[u8]) -> bool {
    let Some((time_ns, bytes)) = input.split_first_chunk() else { return false };
    let time_ns = i64::from_le_bytes(*time_ns);
    let Some(list) = objects::read(bytes) else { return false };
    let (found, none) = objects::detections(&list, time_ns);
    assert_eq!(found.len() + none as usize, list.objects.len());
    for detection in &found {
        assert!(detection.position_m.is_finite() && detection.obb.half_m.is_finite());
        assert!(detection.aabb.min_m.is_finite() && detection.aabb.max_m.cmpge(detection.aabb.min_m).all());
        assert!(detection.covariance_m2.is_none_or(|c| c[0][0] > 0.0 && c[0][0].is_finite()));
    }
    let config = Config::default();
    let (own, none) = objects::tracks(&list, time_ns, &config.site.hall);
    assert_eq!(own.len() + none as usize, list.objects.len());
    assert!(own.is_sorted_by(|a, b| a.id < b.id) && own.iter().all(step::is_finite), "{own:?}");
    let (mut tracker, mut tracks) = (Tracker::new(&config.track, &config.site), Vec::new());
    for after_ns in [0, STEP_NS] {
        let views = Views { time_ns: time_ns.saturating_add(after_ns), of_scans: Vec::new() };
        tracker.update(&views, &found, &mut tracks);
        assert!(tracks.len() <= 2 * found.len());
        assert!(tracks.iter().all(step::is_finite), "{tracks:?}");
    }
    true
}

fn reported() -> Vec<Vec<u8>> {
    let one = r#"{ "access_point": "side", "device": 17, "power_dbm": -63.5 }"#;
    let many = r#"[ { "time_ns": 200000000, "access_point": "side", "device": 17, "power_dbm": -63.5, "serves": true },
        { "time_ns": 180000000, "access_point": "centre", "device": 18446744073709551615, "power_dbm": -7e1 } ]"#;
    vec![one.into(), many.into()]
}

fn report(bytes: &[u8]) -> bool {
    let mut site = Config::default().site;
    site.access_points.iter_mut().for_each(|ap| ap.radio = Some(umbracast::site::Radio::default()));
    let now_ns = 2 * STEP_NS;
    let Ok(came) = reports::from_json(bytes, &site, now_ns) else { return false };
    let again = reports::from_json(reports::to_json(&came, &site).as_bytes(), &site, now_ns);
    assert_eq!(again.as_deref().ok(), Some(&came[..]));
    let (mut binder, mut bindings) = (Binder::new(&site), Vec::new());
    binder.hear(&came.iter().map(|came| came.report).collect::<Vec<_>>());
    let outcome = step::outcome();
    for frame in 1..4 {
        binder.bind(frame * STEP_NS, &outcome.tracks, &outcome.losses, &mut bindings);
        assert!(bindings.iter().all(|binding| (0.0..=1.0 + 1e-9).contains(&binding.p)), "{bindings:?}");
        assert!(binder.served().all(|served| outcome.tracks.iter().any(|track| track.id == served.track)));
    }
    true
}
