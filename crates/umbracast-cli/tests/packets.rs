//! Packets as files: captures that `simulate` writes are read back as what was recorded beside them.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::Command;

use umbracast_io::pcap::PcapReader;
use umbracast_io::recording::{Entry, RecordingReader};

mod common;

use common::folder;

/// Runs and expects a code; gives what was said.
fn ends_with(code: i32, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_umbracast"))
        .args(arguments)
        .arg("--quiet")
        .output()
        .expect("starts");
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said.into_owned()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("the test's folder has a plain name")
}

/// Two people who cross, for a second and a half.
const CROSSING: &str = "t_s,id,x_m,y_m\n0.0,1,6.0,-1.0\n0.5,1,6.0,-0.4\n1.0,1,6.0,0.2\n1.5,1,6.0,0.8\n\
    0.0,2,1.0,0.3\n0.5,2,0.5,0.3\n1.0,2,0.0,0.3\n1.5,2,-0.5,0.3\n";

/// A sensor of each family that speaks in packets, told apart by port.
const FAMILIES: &str = r#"
[[site.sensors]]
name = "hdl"
model = "hdl-32e"
position_m = [16.0, 0.0, 9.0]
rotation_deg = { yaw = 180.0, pitch = 35.0, roll = 0.0 }
range_noise_m = 0.02
[[site.sensors]]
name = "ouster"
model = "os0-32"
position_m = [-16.0, 0.0, 9.0]
rotation_deg = { yaw = 0.0, pitch = 35.0, roll = 0.0 }
range_noise_m = 0.02
[[site.sensors]]
name = "hesai"
model = "xt32"
udp_port = 2370
position_m = [0.0, 16.0, 9.0]
rotation_deg = { yaw = -90.0, pitch = 35.0, roll = 0.0 }
range_noise_m = 0.02
"#;

/// Simulates two scenes of the crossing with captures.
fn simulate(folder: &Path, site: Option<&str>) -> PathBuf {
    let (one, two, sim) = (folder.join("one.csv"), folder.join("two.csv"), folder.join("sim"));
    fs::write(&one, CROSSING).expect("writes");
    fs::write(&two, CROSSING.replace("6.0", "5.0")).expect("writes");
    let mut arguments = vec!["simulate", "--trajectories", text(&one), text(&two), "--packets", "pcap"];
    arguments.extend(["--out", text(&sim)]);
    arguments.extend(site.iter().flat_map(|site| ["--site", site]));
    ends_with(0, &arguments);
    sim
}

fn same_tables(a: &Path, b: &Path) {
    for table in ["detections", "tracks", "links"] {
        let bytes = |folder: &Path| fs::read(folder.join(table).with_extension("parquet")).expect("a table");
        assert!(bytes(a) == bytes(b), "{table} of {} and {}", a.display(), b.display());
    }
}

#[test]
fn captures_of_every_family_give_what_the_recordings_give() {
    let folder = folder("captures");
    let site = folder.join("families.toml");
    fs::write(&site, FAMILIES).expect("writes");
    let sim = simulate(&folder, Some(text(&site)));
    let (first, second) = (sim.join("scene-0000.pcap"), sim.join("scene-0001.pcap"));

    // Packet by packet.
    let capture = BufReader::new(File::open(&first).expect("a capture"));
    let mut captured: Vec<(i64, Vec<u8>)> =
        PcapReader::new(capture, "first").expect("pcap").map(|d| (d.time_ns, d.payload)).collect();
    let mut reader = RecordingReader::open(&sim.join("scene-0000.mcap")).expect("opens");
    let mut recorded = Vec::new();
    while let Some(entry) = reader.next_entry().expect("reads") {
        if let Entry::Packets(_, packets) = entry {
            recorded.extend(packets.into_iter().map(|packet| (packet.time_ns, packet.payload)));
        }
    }
    captured.sort();
    recorded.sort();
    assert!(captured.len() > 3000 && captured == recorded, "{} and {}", captured.len(), recorded.len());
    let told = ends_with(0, &["inspect", text(&first)]);
    for port in ["port 2368, 1206 bytes", "port 7502", "port 2370"] {
        assert!(told.contains(port), "{port}: {told}");
    }

    // Through the pipeline: each capture holds all sensors, and is a scene of its own.
    let (from_captures, from_recordings) = (folder.join("from-pcap"), folder.join("from-mcap"));
    let empty = sim.join("empty.pcap");
    let captures = ["run", text(&first), text(&second), "--site", text(&site), "--empty", text(&empty)];
    ends_with(0, &[&captures[..], &["--out", text(&from_captures)]].concat());
    ends_with(0, &["run", text(&sim), "--out", text(&from_recordings)]);
    same_tables(&from_captures, &from_recordings);
    assert!(fs::read_to_string(from_captures.join("run.json")).expect("text").contains("\"scenes\": 2"));
}

#[test]
fn captures_of_single_sensors_are_one_scene() {
    let folder = folder("single-captures");
    let sim = simulate(&folder, None);
    let file = |name: &str| text(&sim.join(name)).to_owned();
    let (east, west) = (file("scene-0000-lidar_east.pcap"), file("scene-0000-lidar_west.pcap"));
    let other = file("scene-0001-lidar_east.pcap");
    let [captures, swapped, recording] = ["from-pcap", "swapped", "from-mcap"].map(|name| folder.join(name));
    let no_empty = ["--no-empty", "--out"];
    ends_with(0, &[&["run", &east, &west], &no_empty[..], &[text(&captures)]].concat());
    ends_with(0, &[&["run", &west, &east], &no_empty[..], &[text(&swapped)]].concat());
    ends_with(0, &[&["run", &file("scene-0000.mcap")], &no_empty[..], &[text(&recording)]].concat());
    same_tables(&captures, &recording);
    same_tables(&swapped, &recording);
    assert!(
        !ends_with(0, &["run", &east, &west, "--no-empty", "--out", text(&captures)]).contains("caution")
    );
    let told = ends_with(0, &["run", &east, &west, "--out", text(&captures)]);
    assert!(told.contains("no empty hall was given") && told.contains("in 15 frame(s)"), "{told}");
    let told = ends_with(1, &["run", &east, &west, &other, "--out", text(&folder.join("out"))]);
    assert!(told.contains("expected 2 captures, one for each sensor") && told.contains("found 3"), "{told}");

    // As a shell's glob gives them, with the empty hall among them.
    let empty = ["empty-lidar_east.pcap", "empty-lidar_west.pcap"].map(file);
    let [globbed, from_folder] = ["globbed", "from-folder"].map(|name| folder.join(name));
    let output = Command::new(env!("CARGO_BIN_EXE_umbracast"))
        .args(["run", &empty[0], &empty[1], &west, &east, "--out", text(&globbed)])
        .output()
        .expect("starts");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    assert!(told.contains("scene-0000-lidar_east.pcap -> lidar_east (its name)"), "{told}");
    assert!(told.contains("empty-lidar_west.pcap -> lidar_west (its name)"), "{told}");
    ends_with(0, &["run", &file("scene-0000.mcap"), "--out", text(&from_folder)]);
    same_tables(&globbed, &from_folder);
    let told = ends_with(1, &["simulate", "--packets", "pcap"]);
    assert!(told.contains("expected --out"), "{told}");
}

#[test]
fn ranges_that_the_site_file_does_not_know_are_told() {
    let folder = folder("far-ranges");
    let cloud = umbracast_io::pcd::PcdCloud {
        width: 100,
        height: 1,
        viewpoint: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        // Millimetres, as some exporters write them.
        fields: ["x", "y", "z"]
            .map(|name| umbracast_io::pcd::PcdField {
                name: name.to_owned(),
                kind: umbracast_io::pcd::PcdKind::F32,
                count: 1,
                values: (0..100).map(|n| 4000.0 + f64::from(n)).collect(),
            })
            .into(),
    };
    let (file, site) = (folder.join("0.pcd"), folder.join("points.toml"));
    let bytes = umbracast_io::pcd::write_pcd(&cloud, umbracast_io::pcd::PcdEncoding::Binary);
    fs::write(&file, bytes).expect("writes");
    let sensor = "[[site.sensors]]\nname = \"door\"\nmodel = \"points\"\nposition_m = [0.0, 0.0, 3.0]\n\
                  rotation_deg = { yaw = 0.0, pitch = 20.0, roll = 0.0 }";
    fs::write(&site, sensor).expect("writes");
    let told = ends_with(0, &["run", text(&file), "--site", text(&site), "--out", text(&folder.join("out"))]);
    assert!(
        told.contains("100 % of 100 returns were left out") && told.contains("door: 0.5 to 50 m"),
        "{told}"
    );
    assert!(told.contains("in 1 frame(s)"), "{told}");
}

#[test]
fn names_with_spaces_make_topics_and_files_without() {
    let folder = folder("spaces");
    let site = folder.join("families.toml");
    fs::write(&site, FAMILIES.replace("\"hdl\"", "\"above the door\"")).expect("writes");
    let sim = simulate(&folder, Some(text(&site)));
    let told = ends_with(0, &["inspect", text(&sim.join("scene-0000.mcap"))]);
    assert!(told.contains("/above_the_door/packets") && !told.contains("/above the"), "{told}");
    // Read back as the sensor's.
    let [recorded, captured] = ["from-mcap", "from-pcap"].map(|name| folder.join(name));
    ends_with(0, &["run", text(&sim.join("scene-0000.mcap")), "--no-empty", "--out", text(&recorded)]);
    let capture = sim.join("scene-0000.pcap");
    ends_with(0, &["run", text(&capture), "--site", text(&site), "--no-empty", "--out", text(&captured)]);
    same_tables(&recorded, &captured);
}

#[test]
fn two_sensors_at_one_port_are_told_before_they_are_listened_to() {
    let folder = folder("one-port");
    let site = folder.join("site.toml");
    fs::write(&site, FAMILIES.replace("udp_port = 2370", "udp_port = 2368")).expect("writes");
    let told = ends_with(0, &["config", "--check", text(&site)]);
    let why = "sensors \"hdl\" and \"hesai\": expected an `address` or a `udp_port` of its own for each";
    assert!(told.contains("site.toml: understood") && told.contains(why), "{told}");
    for command in ["check", "live"] {
        assert!(ends_with(1, &[command, "--site", text(&site)]).contains(why), "{command}");
    }
}
