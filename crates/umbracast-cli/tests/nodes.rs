//! Nodes as a user meets them: processes that find each other, and the results of one process.
#![cfg(feature = "node")]

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::Duration;

use umbracast_io::rows::{DecisionRow, LossRow, TrackRow};
use umbracast_io::wire::{self, WireRow};

mod common;
#[path = "common/command.rs"]
mod command;

use command::{done, results_in, umbracast, whole_results_in};
use common::folder;

/// Two people: one crosses in front of the access point, the other walks the other way.
const CROSSING: &str = "t_s,id,x_m,y_m,height_m\n\
    0.0,1,6.0,-2.0,1.80\n1.0,1,6.0,-0.7,1.80\n2.0,1,6.0,0.6,1.80\n3.0,1,6.0,1.9,1.80\n\
    0.0,2,1.0,0.3,1.70\n1.0,2,0.0,0.3,1.70\n2.0,2,-1.0,0.3,1.70\n3.0,2,-2.0,0.3,1.70\n";

/// The access points of the default site, with radios.
const RADIO: &str = "[[site.access_points]]\nname = \"side\"\nposition_m = [14.0, 0.0, 2.0]\nradio = {}\n\
    [[site.access_points]]\nname = \"centre\"\nposition_m = [0.0, 0.0, 3.0]\nradio = { carrier_ghz = 60.0 }\n\
    [site.handover]\nprocedure = \"nr-ltm\"\n";

/// A node that runs until it is asked to end.
struct Node {
    child: Child,
    said: BufReader<ChildStdout>,
}

impl Node {
    /// Returns once it is ready.
    fn start(arguments: &[&str]) -> Self {
        let command =
            umbracast(&["node", "--json", "--no-serve"]).args(arguments).stdout(Stdio::piped()).spawn();
        let mut child = command.expect("starts");
        let mut said = BufReader::new(child.stdout.take().expect("piped"));
        let mut line = String::new();
        while !line.trim_end().ends_with("ready") {
            line.clear();
            assert!(
                said.read_line(&mut line).expect("a line") > 0,
                "{arguments:?}: ended before it was ready"
            );
        }
        Self { child, said }
    }

    /// Asks for the end as a service manager does; gives the summary.
    fn stop(self) -> serde_json::Value {
        let pid = self.child.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &pid]).status().expect("kill").success());
        self.ended()
    }

    /// The summary of one that ends by itself.
    fn ended(mut self) -> serde_json::Value {
        let mut text = String::new();
        self.said.read_to_string(&mut text).expect("a summary");
        self.child.wait().expect("ends");
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}"))
    }
}

impl Node {
    /// As a machine that loses its power.
    fn kill(mut self) {
        self.child.kill().expect("is there");
        self.child.wait().expect("ends");
    }
}

/// A test that fails leaves nobody behind.
impl Drop for Node {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A hall of its own: a folder, a site file, and an endpoint where its nodes meet.
struct Hall {
    folder: PathBuf,
    site: String,
    meet: String,
}

impl Hall {
    fn new(name: &str) -> Self {
        Self::with(name, "")
    }

    /// A hall whose site file says this besides.
    fn with(name: &str, besides: &str) -> Self {
        let folder = folder(name);
        let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a port").port();
        let site = text(&folder.join("hall.toml"));
        // A busy machine is late: no frame goes on without a front end.
        fs::write(&site, format!("{besides}[network]\nhall = \"{name}\"\nwait_s = 5.0\n")).expect("writes");
        Self { folder, site, meet: format!("tcp/127.0.0.1:{port}") }
    }

    /// The node that the others know.
    fn first(&self, arguments: &[&str]) -> Node {
        Node::start(&[&["--site", &self.site, "--listen", &self.meet][..], arguments].concat())
    }

    fn node(&self, arguments: &[&str]) -> Node {
        Node::start(&[&["--site", &self.site, "--connect", &self.meet][..], arguments].concat())
    }

    fn path(&self, name: &str) -> String {
        text(&self.folder.join(name))
    }
}

fn text(path: &Path) -> String {
    path.to_str().expect("a plain name").to_owned()
}

fn recording_in(folder: &str) -> PathBuf {
    fs::read_dir(folder).expect("recordings").next().expect("one").expect("readable").path()
}

/// The scene and the empty hall, and what one process makes of it, message by message.
fn simulated(hall: &Hall, run: &[&str]) -> (String, String, BTreeMap<String, Vec<Vec<u8>>>) {
    let (sim, out) = (hall.path("sim"), hall.path("one"));
    let walk = hall.path("crossing.csv");
    fs::write(&walk, CROSSING).expect("writes");
    done(&["simulate", "--trajectories", &walk, "--seed", "7", "--site", &hall.site, "--out", &sim]);
    let (scene, empty) = (format!("{sim}/scene-0000.mcap"), format!("{sim}/empty.mcap"));
    done(&[&["run", &scene, "--out", &out, "--mcap", "--points"][..], run].concat());
    (scene, empty, results_in(&Path::new(&out).join("results-0000.mcap")))
}

fn assert_same(found: &BTreeMap<String, Vec<Vec<u8>>>, expected: &BTreeMap<String, Vec<Vec<u8>>>) {
    assert!(expected["/umbracast/tracks"].len() >= 30 && expected.len() >= 7, "{:?}", expected.keys());
    for (topic, messages) in expected {
        let found = found.get(topic).map_or(&[][..], Vec::as_slice);
        let apart = messages.iter().zip(found).position(|(a, b)| a != b);
        assert_eq!((found.len(), apart), (messages.len(), None), "{topic}: messages, first that differs");
    }
}

#[test]
fn two_front_ends_a_tracker_and_a_caster_give_what_one_process_gives_to_the_byte() {
    let hall = Hall::with("nodes-empty", RADIO);
    let (scene, empty, expected) = simulated(&hall, &[]);
    for topic in [LossRow::TOPIC, DecisionRow::TOPIC] {
        let longest = expected[topic].iter().map(Vec::len).max();
        assert!(longest > expected[topic].first().map(Vec::len), "{topic}: nothing is told");
    }
    let track = hall.first(&["track,forecast", "--empty", &empty]);
    // One node is given no site: it asks for it.
    let cast = Node::start(&["cast", "--hall", "nodes-empty", "--connect", &hall.meet]);
    let records = hall.path("records");
    let record = hall.node(&["record", "--record", &records, "--record-points"]);
    // One front end is given the empty hall, the other asks for it.
    let east = hall.node(&["sensor", "--sensors", "lidar_east", "--from", &scene, "--empty", &empty]);
    let west = hall.node(&["sensor", "--sensors", "lidar_west", "--from", &scene]);
    let fronts = [east.ended(), west.ended()];
    wait_for_frames(&records, expected["/umbracast/tracks"].len());
    let summaries = [track.stop(), cast.stop(), record.stop()];
    for summary in fronts.iter().chain(&summaries) {
        assert_eq!(
            (&summary["frames_incomplete"], &summary["messages_late"]),
            (&0.into(), &0.into()),
            "{summary}"
        );
    }
    assert_same(&results_in(&recording_in(&records)), &expected);
}

#[test]
fn the_background_is_learned_beside_the_sensors_with_what_the_tracker_expects() {
    let hall = Hall::new("nodes-learning");
    let (scene, _, expected) = simulated(&hall, &["--no-empty"]);
    let track = hall.first(&["track"]);
    let stages = [hall.node(&["forecast"]), hall.node(&["cast"])];
    let records = hall.path("records");
    let record = hall.node(&["record", "--record", &records, "--record-points"]);
    // At half the pace a busy machine is in time, too.
    let sensor = |name| hall.node(&["sensor", "--sensors", name, "--from", &scene, "--rate", "0.5"]);
    let fronts = [sensor("lidar_east"), sensor("lidar_west")].map(Node::ended);
    wait_for_frames(&records, expected["/umbracast/tracks"].len());
    stages.into_iter().chain([track, record]).for_each(|node| drop(node.stop()));
    assert!(fronts.iter().all(|front| front["priors_late"] == 0), "{fronts:?}");
    assert_same(&results_in(&recording_in(&records)), &expected);
}

#[test]
fn where_the_leader_dies_the_one_that_stands_by_goes_on_and_no_byte_is_lost() {
    let hall = Hall::new("nodes-leader");
    let (scene, empty, expected) = simulated(&hall, &[]);
    let leader = hall.first(&["track", "--empty", &empty]);
    let other = hall.node(&["track"]);
    let stages = [hall.node(&["forecast"]), hall.node(&["cast"])];
    let records = hall.path("records");
    let record = hall.node(&["record", "--record", &records, "--record-points"]);
    let sensor = |name| hall.node(&["sensor", "--sensors", name, "--from", &scene, "--rate", "0.25"]);
    let fronts = [sensor("lidar_east"), sensor("lidar_west")];
    wait_for_frames(&records, 5);
    leader.kill();
    assert_running(&fronts);
    fronts.into_iter().for_each(|front| drop(front.ended()));
    wait_for_frames(&records, expected["/umbracast/tracks"].len());
    let summary = other.stop();
    assert!(summary["leads"] == true && summary["messages_late"] == 0, "{summary}");
    stages.into_iter().chain([record]).for_each(|node| drop(node.stop()));
    assert_same(&results_in(&recording_in(&records)), &expected);
}

#[test]
fn a_tracker_that_comes_back_knows_its_people_and_counts_on() {
    let hall = Hall::new("nodes-back");
    let (scene, empty, expected) = simulated(&hall, &[]);
    let cast = hall.first(&["forecast,cast"]);
    let track = hall.node(&["track"]);
    let records = hall.path("records");
    let record = hall.node(&["record", "--record", &records, "--record-points"]);
    let sensor = |name| {
        hall.node(&["sensor", "--sensors", name, "--from", &scene, "--rate", "0.25", "--empty", &empty])
    };
    let fronts = [sensor("lidar_east"), sensor("lidar_west")];
    wait_for_frames(&records, 10);
    track.kill();
    std::thread::sleep(Duration::from_millis(400)); // Two frames at this pace.
    let track = hall.node(&["track"]);
    assert_running(&fronts);
    fronts.into_iter().for_each(|front| drop(front.ended()));
    std::thread::sleep(Duration::from_secs(2)); // What was seen last is recorded.
    [cast, track, record].into_iter().for_each(|node| drop(node.stop()));
    let access_points = ["side".to_owned(), "centre".to_owned()];
    let last = |messages: &BTreeMap<String, Vec<Vec<u8>>>| {
        let message = messages["/umbracast/tracks"].last().expect("tracks").clone();
        let (frame, _, rows) = wire::decode::<TrackRow>(&message, &access_points).expect("tracks");
        (frame, rows.iter().map(|row| row.track).collect::<Vec<_>>())
    };
    let found = results_in(&recording_in(&records));
    assert_eq!(last(&found), last(&expected), "the last frame and who is in it");
    assert!(found["/umbracast/tracks"].len() < expected["/umbracast/tracks"].len(), "it was gone");
}

/// What happened, happened in the midst of the scene.
fn assert_running(fronts: &[Node]) {
    let fronts: Vec<u32> = fronts.iter().map(|front| front.child.id()).collect();
    let runs =
        |id: &u32| fs::read_to_string(format!("/proc/{id}/stat")).is_ok_and(|stat| !stat.contains(") Z"));
    assert!(fronts.iter().all(runs), "the scene was over");
}

/// Until the recorder has written so many frames: it flushes once a second. A minute at most.
fn wait_for_frames(records: &str, frames: usize) {
    let recorded = || {
        let file = fs::read_dir(records).ok()?.next()?.ok()?.path();
        Some(whole_results_in(&file).ok()?.get("/umbracast/tracks")?.len())
    };
    let enough = |_| {
        std::thread::sleep(Duration::from_millis(100));
        recorded().is_some_and(|found| found >= frames)
    };
    assert!((0..600).any(enough), "{:?} frames recorded of {frames}", recorded());
}
