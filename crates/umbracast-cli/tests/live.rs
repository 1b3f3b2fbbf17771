//! Live as a user meets it: packets over loopback, a recording, and the same results from it again.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

use umbracast_io::recording::{Entry, RecordingReader};
use umbracast_io::rows::{DetectionRow, LinkRow, TrackRow};
use umbracast_io::tables;
use umbracast_io::viewers;
use umbracast_io::wire::{self, WireRow};

mod common;
#[path = "common/command.rs"]
mod command;

use command::{done, results_in, umbracast};
use common::folder;

/// A live run that listens on free ports.
struct Live {
    child: Child,
    said: BufReader<ChildStdout>,
    ports: Vec<String>,
}

impl Live {
    fn start(arguments: &[&str]) -> Self {
        let mut child = umbracast(&["live", "--port", "0", "--no-serve", "--json"])
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .expect("starts");
        let mut said = BufReader::new(child.stdout.take().expect("piped"));
        let port = |_| {
            let mut line = String::new();
            said.read_line(&mut line).expect("a line");
            line.trim().rsplit(' ').next().expect("a port").to_owned()
        };
        let ports = (0..2).map(port).collect();
        Self { child, said, ports }
    }

    /// Asks for the end as a service manager does; gives the summary.
    fn stop(mut self) -> serde_json::Value {
        let pid = self.child.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &pid]).status().expect("kill").success());
        let mut text = String::new();
        self.said.read_to_string(&mut text).expect("a summary");
        self.child.wait().expect("ends");
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}"))
    }
}

fn recording_in(folder: &Path) -> PathBuf {
    fs::read_dir(folder).expect("recordings").next().expect("one").expect("readable").path()
}

fn recorded<R: WireRow>(file: &Path, access_points: &[String]) -> Vec<R> {
    let mut reader = RecordingReader::open(file).expect("opens");
    let mut rows = Vec::new();
    while let Some(entry) = reader.next_entry().expect("reads") {
        if let Entry::Other(topic, _, message) = entry
            && topic == R::TOPIC
        {
            rows.extend(wire::decode::<R>(&message, access_points).expect("a message of ours").2);
        }
    }
    rows
}

#[test]
fn live_and_replayed_results_are_the_same_to_the_byte() {
    let folder = folder("live-and-replayed");
    let text = |path: &Path| path.to_str().expect("a plain name").to_owned();
    let (sim, out) = (text(&folder.join("sim")), text(&folder.join("out")));
    fs::write(folder.join("crossing.csv"), CROSSING).expect("writes");
    done(&["simulate", "--trajectories", &text(&folder.join("crossing.csv")), "--seed", "7", "--out", &sim]);
    let (scene, empty) = (format!("{sim}/scene-0000.mcap"), format!("{sim}/empty.mcap"));
    // A busy machine may skip a frame, which a replay does not: then once more, more slowly.
    let (recording, summary) = (["1", "0.5", "0.25", "0.1"].iter())
        .find_map(|rate| {
            let records = folder.join(format!("records-{rate}"));
            let live = Live::start(&["--empty", &empty, "--record", &text(&records), "--record-points"]);
            let to = live.ports.iter().map(|port| format!("127.0.0.1:{port}")).collect::<Vec<_>>().join(",");
            done(&["replay", &scene, "--to", &to, "--rate", rate]);
            let summary = live.stop();
            let whole = summary["frames_skipped"] == 0 && summary["recorder"]["lost"] == 0;
            whole.then(|| (recording_in(&records), summary))
        })
        .expect("a run without a skipped frame");
    assert!(summary["frames"].as_u64().expect("a count") >= 30, "{summary}");

    done(&["run", &text(&recording), "--empty", &empty, "--out", &out, "--mcap", "--points"]);
    let access_points = ["side".to_owned(), "centre".to_owned()];
    let tables = |name: &str| format!("{name}: rows of the table and of the recording");
    let out = Path::new(&out);
    let tracks = recorded::<TrackRow>(&recording, &access_points);
    assert!(tracks.len() > 40, "{} tracks", tracks.len());
    assert!(tables::read::<TrackRow>(out, &access_points).unwrap() == tracks, "{}", tables("tracks"));
    let links = recorded::<LinkRow>(&recording, &access_points);
    assert!(links.iter().any(|link| link.blocked_now), "somebody crosses in front of the access point");
    assert!(tables::read::<LinkRow>(out, &access_points).unwrap() == links, "{}", tables("links"));
    let results = out.join("results-0000.mcap");
    let (live_messages, run_messages) = (results_in(&recording), results_in(&results));
    for topic in
        ["/tf", "/umbracast/tracks", "/umbracast/markers", "/umbracast/people", "/umbracast/foreground"]
    {
        assert!(live_messages[topic].len() >= 30, "{topic}");
    }
    assert!(live_messages == run_messages, "what a run records is what the live run recorded");
    peers_read(&recording, &tracks);
    peers_read(&results, &tracks);
    let detections = recorded::<DetectionRow>(&recording, &access_points);
    assert!(
        tables::read::<DetectionRow>(out, &access_points).unwrap() == detections,
        "{}",
        tables("detections")
    );
}

/// `rosbags` and `mcap-ros2-support` read every topic, and the same values.
fn peers_read(recording: &Path, tracks: &[TrackRow]) {
    let python = std::env::var("UMBRACAST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peers.py");
    let output = Command::new(&python).arg(script).arg(recording).output();
    let output = match output {
        Ok(output) if output.status.success() => output,
        Ok(output) if !String::from_utf8_lossy(&output.stderr).contains("ModuleNotFoundError") => {
            panic!("{}", String::from_utf8_lossy(&output.stderr))
        }
        // To the terminal itself: a test's output is held back when it passes.
        _ => {
            let _ = writeln!(
                std::io::stderr(),
                "skipped: {python} has no rosbags and mcap-ros2-support to read with"
            );
            return;
        }
    };
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(found["rosbags"], found["mcap-ros2-support"]);
    let topics = found["rosbags"].as_object().expect("topics");
    assert_eq!(found["types that are not those of ROS 2"], serde_json::json!([]));
    for topic in ["/umbracast/config", "/tf_static"] {
        assert!(topics.contains_key(topic), "{topic} of {topics:?}");
    }
    let viewers = ["/tf", viewers::MARKERS_TOPIC, viewers::PEOPLE_TOPIC, viewers::FOREGROUND_TOPIC];
    for topic in [DetectionRow::TOPIC, TrackRow::TOPIC, LinkRow::TOPIC].into_iter().chain(viewers) {
        assert!(topics[topic]["messages"].as_u64() >= Some(30), "{topic}: {}", topics[topic]);
    }
    let last = tracks.last().expect("tracks").frame;
    let first = tracks.iter().find(|row| row.frame == last).expect("a first row");
    let read = &topics[TrackRow::TOPIC]["last"]["first"];
    assert_eq!((&read["track"], &read["x_m"]), (&first.track.into(), &first.x_m.into()));
    // What viewers draw is of the same people, in the same place and at the same time.
    let confirmed: Vec<&TrackRow> = tracks.iter().filter(|row| row.frame == last && row.confirmed).collect();
    let people = &topics[viewers::PEOPLE_TOPIC]["last"];
    assert_eq!(people["rows"].as_u64(), Some(confirmed.len() as u64));
    assert_eq!(people["time_ns"], serde_json::json!(first.time_ns));
    if let Some(person) = confirmed.first() {
        let expected =
            serde_json::json!({ "id": person.track.to_string(), "x_m": person.x_m, "y_m": person.y_m });
        assert_eq!(people["first"], expected);
    }
    let markers = &topics[viewers::MARKERS_TOPIC]["last"]["drawn"];
    let drawn = |ns: &str| markers[ns].as_u64();
    assert_eq!(drawn("deleted first"), Some(1), "{markers}");
    for ns in ["box", "name", "way", "in_300ms", "in_600ms", "in_900ms"] {
        assert_eq!(drawn(ns).unwrap_or(0), confirmed.len() as u64, "{ns}: {markers}");
    }
    assert_eq!(drawn("access_points"), Some(2), "{markers}");
}

/// Two people who cross in front of the `side` access point, for three seconds.
const CROSSING: &str = "t_s,id,x_m,y_m,height_m\n\
    0.0,1,6.0,-2.0,1.80\n1.0,1,6.0,-0.7,1.80\n2.0,1,6.0,0.6,1.80\n3.0,1,6.0,1.9,1.80\n\
    0.0,2,1.0,0.3,1.70\n1.0,2,0.0,0.3,1.70\n2.0,2,-1.0,0.3,1.70\n3.0,2,-2.0,0.3,1.70\n";

#[test]
fn simulated_packets_are_received_whole() {
    let folder = folder("simulated-packets");
    let crossing = folder.join("crossing.csv");
    fs::write(&crossing, CROSSING).expect("writes");
    let live = Live::start(&[]);
    let to = live.ports.iter().map(|port| format!("127.0.0.1:{port}")).collect::<Vec<_>>().join(",");
    let walk = crossing.to_str().expect("a plain name");
    let simulate =
        ["simulate", "--json", "--quiet", "--trajectories", walk, "--packets", &format!("udp:{to}")];
    let output = umbracast(&simulate).output().expect("starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let sent: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let summary = live.stop();
    // Three seconds of two HDL-32E, 1808 packets a second each.
    assert!(sent["packets_sent"].as_u64() > Some(10_000), "{sent}");
    assert_eq!(summary["packets"], sent["packets_sent"], "{summary}");
    for nothing in ["packets_lost", "packets_of_strangers"] {
        assert_eq!(summary[nothing], 0, "{summary}");
    }
    let frames = ["frames", "frames_skipped"].iter().filter_map(|name| summary[name].as_u64()).sum::<u64>();
    assert!(frames >= 30, "{summary}");
}

/// What a running program counts at its page.
fn counted(page: &str, name: &str) -> f64 {
    let mut server = TcpStream::connect(page).expect("the page's server");
    write!(server, "GET /metrics HTTP/1.1\r\nHost: {page}\r\nConnection: close\r\n\r\n").expect("asks");
    let mut said = String::new();
    server.read_to_string(&mut said).expect("an answer");
    let line = said.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    line.unwrap_or_else(|| panic!("expected {name}, found {said}")).parse().expect("a number")
}

/// The promise: what is younger than a second may be lost, what is older lies on the disk, and all that lies there opens.
#[test]
fn a_killed_run_loses_at_most_the_last_second_of_its_recording() {
    let folder = folder("killed");
    let records = folder.join("records");
    let mut live = umbracast(&["live", "--demo", "--people", "2", "--serve", "127.0.0.1:0", "--quiet"])
        .args(["--record", records.to_str().expect("a plain name")])
        .stdout(Stdio::piped())
        .spawn()
        .expect("starts");
    let (mut line, mut said) = (String::new(), BufReader::new(live.stdout.take().expect("piped")));
    said.read_line(&mut line).expect("a line");
    let page = line.trim().trim_start_matches("page: http://").trim_end_matches('/').to_owned();
    // Nearly two chunks' worth: a recorder that writes whole chunks alone would have lost more than a second then.
    let mut taken = 0.0;
    while taken < 15e6 {
        std::thread::sleep(std::time::Duration::from_millis(20));
        taken = counted(&page, "umbracast_recorded_bytes_total");
        assert!(live.try_wait().expect("a child").is_none(), "ended by itself");
    }
    let a_frame = taken / counted(&page, "umbracast_frames_total");
    live.kill().expect("kills"); // SIGKILL: nothing is written after it.
    live.wait().expect("ends");
    let file = recording_in(&records);
    let on_disk = file.metadata().expect("a file").len() as f64;
    // Ten frames a second, the one that comes when the second is over, and the one that is gathered.
    assert!(taken - on_disk < 12.0 * a_frame, "{taken} bytes were taken, {on_disk} are on the disk");
    let mut reader = RecordingReader::open(&file).expect("opens");
    let mut packets = 0;
    while let Some(entry) = reader.next_entry().expect("reads") {
        if let Entry::Packets(_, some) = entry {
            packets += some.len();
        }
    }
    // The rest is what stands around a packet, and results.
    let opened = (packets * 1206) as f64;
    assert!(opened > 0.9 * on_disk, "{opened} bytes of packets are read of {on_disk} on the disk");
}

#[test]
fn a_check_says_who_is_silent_and_ends_with_code_1() {
    let port = std::net::UdpSocket::bind("0.0.0.0:0").expect("a port").local_addr().expect("bound").port();
    let port = port.min(u16::MAX - 1).to_string();
    let output = umbracast(&["check", "--port", &port, "--seconds", "0.2"]).output().expect("starts");
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{said}");
    let expected = format!("lidar_east: silent: expected packets on UDP port {port}, found none");
    assert!(said.lines().count() == 2 && said.starts_with(&expected), "{said}");
}

/// The next line of the log that is of this event.
fn told(log: &mut impl BufRead, event: &str) -> serde_json::Value {
    loop {
        let mut line = String::new();
        assert!(log.read_line(&mut line).expect("reads") > 0, "ended before {event}");
        let value: serde_json::Value = serde_json::from_str(&line).unwrap_or_else(|e| panic!("{e}: {line}"));
        if value["event"] == event {
            return value;
        }
    }
}

#[cfg(unix)]
#[test]
fn a_site_file_read_again_moves_access_points_and_loses_nobody() {
    let folder = folder("reload");
    let (site, records) = (folder.join("hall.toml"), folder.join("records"));
    let text = |path: &Path| path.to_str().expect("a plain name").to_owned();
    let door = "[[site.access_points]]\nname = \"door\"\nposition_m = [10.0, 0.0, 2.0]\n";
    fs::write(&site, "").expect("writes");
    let mut live = umbracast(&["live", "--demo", "--people", "3", "--no-serve", "--log", "json"])
        .args(["--site", &text(&site), "--record", &text(&records)])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    let mut log = BufReader::new(live.stderr.take().expect("piped"));
    let hang_up = || {
        let pid = live.id().to_string();
        assert!(Command::new("kill").args(["-HUP", &pid]).status().expect("kill").success());
    };
    assert!(told(&mut log, "file")["text"].as_str().expect("a text").contains("records"));
    std::thread::sleep(std::time::Duration::from_secs(2)); // People are followed by then.
    for (wrong, why) in [
        ("[site.hall]\nlength_m = \"long\"", "expected a number"),
        (
            "[[site.sensors]]\nname = \"one\"\nposition_m = [0.0, 0.0, 3.0]\nrotation_deg = { yaw = 0.0, pitch = 9.0, roll = 0.0 }",
            "site.sensors",
        ),
    ] {
        fs::write(&site, wrong).expect("writes");
        hang_up();
        // The same is said once in ten seconds, so the second is only counted.
        if why == "expected a number" {
            let failed = told(&mut log, "reload_failed");
            assert!(failed["text"].as_str().expect("a text").contains(why), "{failed}");
        }
        std::thread::sleep(std::time::Duration::from_millis(300));
    }
    fs::write(&site, door).expect("writes");
    hang_up();
    told(&mut log, "reload");
    std::thread::sleep(std::time::Duration::from_secs(2));
    let pid = live.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &pid]).status().expect("kill").success());
    assert!(live.wait().expect("ends").code().is_some_and(|code| code == 0 || code == 3));
    let mut files: Vec<PathBuf> =
        fs::read_dir(&records).expect("records").flatten().map(|e| e.path()).collect();
    files.sort();
    assert_eq!(files.len(), 2, "a file for each configuration: {files:?}");
    let followed = |file: &Path, names: &[String]| -> std::collections::BTreeSet<u64> {
        recorded::<TrackRow>(file, names).iter().filter(|row| row.confirmed).map(|row| row.track).collect()
    };
    let before = followed(&files[0], &["side".to_owned(), "centre".to_owned()]);
    let after = followed(&files[1], &["door".to_owned()]);
    assert!(!before.is_empty() && before.is_subset(&after), "{before:?} are followed on: {after:?}");
    let links = recorded::<LinkRow>(&files[1], &["door".to_owned()]);
    assert!(!links.is_empty() && links.iter().all(|link| link.access_point == 0), "links of the door alone");
}
