//! The command as a user meets it: whole runs, the same bytes, broken files, exit codes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

mod common;

use common::folder;

/// Two people who cross in front of the `side` access point, for three seconds.
const CROSSING: &str = "t_s,id,x_m,y_m,height_m\n\
    0.0,1,6.0,-2.0,1.80\n1.0,1,6.0,-0.7,1.80\n2.0,1,6.0,0.6,1.80\n3.0,1,6.0,1.9,1.80\n\
    0.0,2,1.0,0.3,1.70\n1.0,2,0.0,0.3,1.70\n2.0,2,-1.0,0.3,1.70\n3.0,2,-2.0,0.3,1.70\n";

/// One box, in the frame of the first sensor of the default site.
const LABELS: &str = "frame_file,label_index,x_m,y_m,z_m\n20.pcd,0,10.0,0.0,0.0\n";

fn umbracast(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_umbracast")).args(arguments).arg("--quiet").output().expect("starts")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// Runs and expects code 0.
fn done(arguments: &[&str]) -> String {
    let output = umbracast(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", said(&output));
    said(&output)
}

/// Runs and expects a code; gives what was said.
fn ends_with(code: i32, arguments: &[&str]) -> String {
    let output = umbracast(arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", said(&output));
    said(&output)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("the test's folder has a plain name")
}

/// Simulates the crossing into `folder/sim`.
fn simulate(folder: &Path, threads: &str) -> PathBuf {
    let trajectories = folder.join("crossing.csv");
    fs::write(&trajectories, CROSSING).expect("writes");
    let sim = folder.join("sim");
    done(&[
        "simulate",
        "--trajectories",
        text(&trajectories),
        "--seed",
        "7",
        "--threads",
        threads,
        "--csv",
        "--out",
        text(&sim),
    ]);
    sim
}

/// The crossing's recording alone has another number than its truth.
fn simulate_as_scene_3(folder: &Path) -> PathBuf {
    let sim = simulate(folder, "0");
    fs::rename(sim.join("scene-0000.mcap"), sim.join("scene-0003.mcap")).expect("renames");
    sim
}

/// Every file below, without `run.json`, which holds times and machine.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<PathBuf> =
        fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files.retain(|path| path.is_file() && path.file_name().is_some_and(|name| name != "run.json"));
    files.iter().map(|p| (text(p.strip_prefix(folder).unwrap()).to_owned(), fs::read(p).unwrap())).collect()
}

fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (contents(a), contents(b));
    assert_eq!(a.iter().map(|f| &f.0).collect::<Vec<_>>(), b.iter().map(|f| &f.0).collect::<Vec<_>>());
    for ((name, a), (_, b)) in a.iter().zip(&b) {
        assert!(a == b, "{name} differs");
    }
}

#[test]
fn the_same_seed_gives_the_same_files_on_one_thread_and_two() {
    let (one, two) = (folder("same_one"), folder("same_two"));
    for (folder, threads) in [(&one, "1"), (&two, "2")] {
        let sim = simulate(folder, threads);
        for mode in ["default", "paper", "hdl"] {
            let out = folder.join(mode);
            done(&["run", text(&sim), "--mode", mode, "--threads", threads, "--csv", "--out", text(&out)]);
        }
    }
    assert_same(&one.join("sim"), &two.join("sim"));
    for mode in ["default", "paper", "hdl"] {
        assert!(contents(&one.join(mode)).len() >= 5, "config, tracks and links as parquet and csv");
        assert_same(&one.join(mode), &two.join(mode));
    }
}

#[test]
fn sensors_that_hang_elsewhere_than_the_site_says_are_told() {
    let folder = folder("sensors_that_hang_elsewhere_than_the_site_says_are_told");
    let sim = simulate(&folder, "0");
    let site = folder.join("site.toml");
    let sensor = |name: &str, x_m: f64, yaw: f64| {
        format!(
            "[[site.sensors]]\nname = \"{name}\"\nposition_m = [{x_m}, 0.0, 9.0]\n\
             rotation_deg = {{ yaw = {yaw}, pitch = 35.0, roll = 0.0 }}\n"
        )
    };
    let run = |code: i32, yaw: f64, follow: bool| {
        let sensors = [sensor("lidar_east", 16.0, yaw), sensor("lidar_west", -16.0, 0.0)].concat();
        fs::write(&site, format!("{sensors}[detect]\nfollow_sensors = {follow}\n")).expect("writes");
        let out = folder.join("run");
        ends_with(code, &["run", text(&sim), "--site", text(&site), "--out", text(&out)])
    };
    run(0, 180.0, true);
    assert!(run(3, 182.0, true).contains("sensors_moved"), "by floor and walls");
    assert!(run(3, 182.0, false).contains("the sensors disagree"), "by the people they see");
}

#[test]
fn simulate_run_evaluate_inspect() {
    let folder = folder("whole_way");
    let sim = simulate(&folder, "0");
    let (out, report) = (folder.join("out"), folder.join("report"));
    done(&["run", text(&sim), "--out", text(&out)]);
    let table = done(&["evaluate", text(&out), "--truth", text(&sim), "--out", text(&report)]);
    assert!(table.contains("F1"), "{table}");
    assert!(report.join("report.html").is_file());
    for folder in [&sim, &out] {
        for (name, _) in contents(folder) {
            let file = folder.join(&name);
            assert!(!done(&["inspect", text(&file)]).is_empty(), "{name}");
        }
    }
    let tracks = done(&["inspect", text(&out.join("tracks.parquet"))]);
    assert!(tracks.contains("x_s1_m"), "{tracks}");
    let detections = done(&["inspect", text(&out.join("detections.parquet"))]);
    assert!(detections.contains("top_m") && detections.contains("cov_xy_m2"), "{detections}");
    let matches = done(&["inspect", text(&report.join("matches.parquet")), "--json"]);
    let found: serde_json::Value = serde_json::from_str(&matches).expect("JSON");
    let rows: u32 = found[0]["found"]["rows"].as_str().expect("rows").parse().expect("a count");
    assert!((40..=60).contains(&rows), "two people in 30 frames: {rows}");
    let about = fs::read_to_string(out.join("run.json")).expect("run.json");
    assert!(about.contains("\"frame_numbers\": [\n    \"0-29\"\n  ]"), "{about}");
}

#[test]
fn tables_alone_are_scored_and_scenes_in_memory_leave_theirs() {
    let folder = folder("tables_alone");
    let trajectories = folder.join("crossing.csv");
    fs::write(&trajectories, CROSSING).expect("writes");
    let kept = folder.join("kept");
    done(&["evaluate", "--trajectories", text(&trajectories), "--mode", "default", "--out", text(&kept)]);
    let tables = folder.join("tables");
    fs::create_dir_all(&tables).expect("a folder");
    for name in ["people", "people_links", "tracks", "links"] {
        let name = format!("{name}.parquet");
        fs::copy(kept.join(&name), tables.join(&name)).expect("the scene that the report shows");
    }
    let again = folder.join("again");
    let said = done(&["evaluate", text(&tables), "--truth", text(&tables), "--out", text(&again)]);
    assert!(said.contains("without config.toml the tables are taken for mode default"), "{said}");
    let matches = |folder: &Path| fs::read(folder.join("matches.parquet")).expect("matches");
    assert_eq!(matches(&kept), matches(&again));
}

#[test]
fn a_run_json_that_lists_every_frame_is_still_read() {
    let folder = folder("old_run_json");
    let sim = simulate(&folder, "0");
    let out = folder.join("out");
    done(&["run", text(&sim), "--out", text(&out)]);
    let labels = folder.join("labels.csv");
    fs::write(&labels, LABELS).expect("writes");
    let score = || done(&["evaluate", text(&out), "--labels", text(&labels)]);
    let new = score();
    let about = fs::read_to_string(out.join("run.json")).expect("run.json");
    let each = (0..30).map(|frame| frame.to_string()).collect::<Vec<_>>().join(", ");
    fs::write(out.join("run.json"), about.replace("\"0-29\"", &format!("[{each}]"))).expect("writes");
    assert_eq!(score(), new);
    assert!(new.contains("1 labels"), "{new}");
    fs::write(out.join("run.json"), about.replace("0-29", "0-x")).expect("writes");
    let message = ends_with(1, &["evaluate", text(&out), "--labels", text(&labels)]);
    assert!(message.contains("run.json: frame_numbers: expected ranges"), "{message}");
}

#[test]
fn the_networks_that_ship_are_known() {
    for (file, kind) in [
        ("pose.safetensors", "pose of a body"),
        ("residual.safetensors", "residual network"),
        ("paper_lstm.safetensors", "LSTM"),
    ] {
        let path = format!("{}/../../models/{file}", env!("CARGO_MANIFEST_DIR"));
        assert!(done(&["inspect", &path]).contains(kind), "{file}");
    }
}

#[test]
fn what_changes_nothing_and_who_walks_through_walls_is_told() {
    let folder = folder("told");
    let (trajectories, sim) = (folder.join("crossing.csv"), folder.join("sim"));
    fs::write(&trajectories, format!("{CROSSING}0.0,3,14.0,0.0,\n3.0,3,48.0,0.0,\n")).expect("writes");
    let said = done(&[
        "simulate",
        "--trajectories",
        text(&trajectories),
        "--fps",
        "25",
        "--people",
        "4",
        "--csv",
        "--out",
        text(&sim),
    ]);
    assert!(said.contains("note: --fps has no effect on") && said.contains("column t_s"), "{said}");
    assert!(said.contains("note: --people has no effect with --trajectories"), "{said}");
    assert!(said.contains("of 3 people 1 leave the hall"), "{said}");
    assert!(said.contains("where they were recorded"), "{said}");
    let people = fs::read_to_string(sim.join("people.csv")).expect("the truth");
    let first: Vec<&str> = people.lines().nth(1).expect("a row").split(',').collect();
    assert_eq!(first[3], "1", "the number in the file: {first:?}");
    assert!(
        (first[4].parse::<f64>().expect("metres") - 6.0).abs() < 0.01,
        "the place in the file: {first:?}"
    );
    let centred = folder.join("centred");
    let said =
        done(&["simulate", "--centre", "--trajectories", text(&trajectories), "--out", text(&centred)]);
    assert!(said.contains("moved by (-23.00, 0.05) m to the middle of the site"), "{said}");
}

#[test]
fn a_vlp_16_may_be_written_as_its_maker_does() {
    let folder = folder("vlp_16");
    let site = folder.join("lab.toml");
    fs::write(
        &site,
        "[[site.sensors]]\nname = \"door\"\nmodel = \"VLP-16\"\nposition_m = [16.0, 0.0, 9.0]\n\
         rotation_deg = { yaw = 180.0, pitch = 35.0, roll = 0.0 }\n",
    )
    .expect("writes");
    let said = done(&["coverage", "--site", text(&site), "--step", "8", "--headings", "1"]);
    assert!(said.contains("the whole floor"), "{said}");
}

#[test]
fn scenes_in_memory_and_from_recordings_score_the_same() {
    let folder = folder("memory_and_files");
    let sim = simulate(&folder, "0");
    let out = folder.join("out");
    done(&["run", text(&sim), "--out", text(&out)]);
    let scores = |arguments: &[&str]| {
        let json: serde_json::Value = serde_json::from_str(&done(arguments)).expect("scores are JSON");
        let group = &json["groups"][0];
        let of_run = |links: &&serde_json::Value| links["predictor"] == "run";
        let links: Vec<_> =
            group["links"].as_array().expect("links").iter().filter(of_run).cloned().collect();
        assert_eq!(links.len(), 2, "one an access point");
        (links, group["modes"].clone())
    };
    let trajectories = folder.join("crossing.csv");
    let memory = scores(&[
        "evaluate",
        "--trajectories",
        text(&trajectories),
        "--seed",
        "7",
        "--mode",
        "default",
        "--json",
    ]);
    assert_eq!(memory, scores(&["evaluate", text(&out), "--truth", text(&sim), "--json"]));
}

#[test]
fn a_recording_keeps_its_number() {
    let folder = folder("its_number");
    let sim = simulate_as_scene_3(&folder);
    let out = folder.join("out");
    done(&["run", text(&sim), "--csv", "--out", text(&out)]);
    let tracks = fs::read_to_string(out.join("tracks.csv")).expect("tracks");
    assert!(tracks.lines().nth(1).is_some_and(|row| row.starts_with("3,")), "{tracks}");
}

#[test]
fn a_scene_left_of_another_simulation_is_neither_kept_nor_scored() {
    let folder = folder("left_over");
    let sim = simulate_as_scene_3(&folder);
    let out = folder.join("out");
    done(&["run", text(&sim), "--out", text(&out)]);
    let message = ends_with(1, &["evaluate", text(&out), "--truth", text(&sim)]);
    assert!(message.contains("scene 3") && message.contains(text(&sim)), "{message}");
    let message = ends_with(1, &["simulate", "--scenes", "1", "--out", text(&sim)]);
    assert!(message.contains("scene-0003.mcap") && message.contains("expected"), "{message}");
}

#[test]
fn the_truth_of_other_links_is_refused() {
    let folder = folder("other_links");
    let sim = simulate(&folder, "0");
    let (site, out) = (folder.join("lab.toml"), folder.join("out"));
    fs::write(&site, "[[site.access_points]]\nname = \"side\"\nposition_m = [3.0, 0.0, 2.0]\n")
        .expect("writes");
    done(&["run", text(&sim), "--site", text(&site), "--out", text(&out)]);
    let message = ends_with(1, &["evaluate", text(&out), "--truth", text(&sim)]);
    assert!(message.contains("access points") && message.contains(text(&sim)), "{message}");
}

#[test]
fn a_capture_among_recordings_is_refused_because_it_names_no_site() {
    let folder = folder("mixed_inputs");
    let sim = simulate(&folder, "0");
    let capture = folder.join("lidar.pcap");
    fs::write(&capture, b"never read").expect("writes");
    let out = folder.join("out");
    let message = ends_with(1, &["run", text(&capture), text(&sim), "--out", text(&out)]);
    assert!(message.contains("lidar.pcap") && message.contains("--site"), "{message}");
    assert!(!out.exists(), "refused before anything is written");
}

#[test]
fn captures_of_other_sensors_are_refused_with_what_was_expected_and_found() {
    let folder = folder("foreign_captures");
    for name in ["east.pcap", "west.pcap"] {
        let file = fs::File::create(folder.join(name)).expect("creates");
        let mut capture = umbracast_io::pcap::PcapWriter::new(file).expect("writes");
        let datagram = umbracast_io::pcap::Datagram {
            time_ns: 0,
            from: [10, 0, 0, 1],
            port: 7502,
            payload: vec![0; 64],
        };
        capture.write(&datagram).expect("writes");
        capture.finish().expect("writes");
    }
    let (east, west) = (folder.join("east.pcap"), folder.join("west.pcap"));
    let out = folder.join("out");
    let message = ends_with(1, &["run", text(&east), text(&west), "--out", text(&out)]);
    let expected =
        "east.pcap: expected packets of lidar_east (hdl-32e): 1206 bytes to port 2368, or of lidar_west";
    assert!(message.contains(expected) || message.contains("lidar_west (hdl-32e): 1206 bytes"), "{message}");
    assert!(message.contains("found 1 packet of 64 bytes from 10.0.0.1 to port 7502"), "{message}");
    assert!(!out.exists(), "refused before anything is written");
}

#[test]
fn a_sensor_that_the_site_loses_is_counted_in_the_run_s_health() {
    let folder = folder("lost_sensor");
    let site = folder.join("lost.toml");
    let sensors =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../config/sites/lost-sensor.toml"));
    let sensors = sensors.expect("a site that ships").replace("lidar_west = 14.0", "lidar_west = 1.0");
    fs::write(&site, sensors).expect("writes");
    let (trajectories, sim, out) = (folder.join("crossing.csv"), folder.join("sim"), folder.join("out"));
    fs::write(&trajectories, CROSSING).expect("writes");
    let recorded =
        ["simulate", "--trajectories", text(&trajectories), "--site", text(&site), "--out", text(&sim)];
    done(&recorded);
    let message = ends_with(3, &["run", text(&sim), "--out", text(&out)]);
    // Of 30 frames, 20 come after the loss; what the last one of a recording lacks is not counted.
    assert!(message.contains("sensors_missing: 19"), "{message}");
    let report = folder.join("report");
    let scored = ["evaluate", text(&out), "--truth", text(&sim), "--out", text(&report)];
    assert!(done(&scored).contains("sensors missing"), "the text tells of it");
    assert!(done(&["compare", text(&report)]).contains("scans missing"));
}

#[test]
fn coverage_writes_table_and_floor_plan_and_refuses_a_sensor_it_cannot_simulate() {
    let folder = folder("coverage");
    let out = folder.join("out");
    let said = done(&["coverage", "--step", "4", "--headings", "1", "--out", text(&out)]);
    assert!(said.contains("the whole floor") && said.contains("lidar_west alone"), "{said}");
    let table = done(&["inspect", text(&out.join("coverage.parquet"))]);
    assert!(table.contains("returns_lidar_east") && table.contains("static_blocked_side"), "{table}");
    assert!(out.join("coverage.csv").is_file() && out.join("coverage.svg").is_file());
    let clouds_only = concat!(env!("CARGO_MANIFEST_DIR"), "/../../config/sites/logictronix.toml");
    let message = ends_with(1, &["coverage", "--site", clouds_only]);
    assert!(message.contains("site.sensors.vlp16"), "{message}");
}

#[test]
fn a_truncated_recording_gives_what_is_whole_and_code_3() {
    let folder = folder("truncated");
    let sim = simulate(&folder, "0");
    let recording = sim.join("scene-0000.mcap");
    let bytes = fs::read(&recording).expect("a recording");
    fs::write(&recording, &bytes[..bytes.len() * 6 / 10]).expect("writes");
    let out = folder.join("out");
    let message = ends_with(3, &["run", text(&sim), "--out", text(&out)]);
    assert!(message.contains("scene-0000.mcap"), "{message}");
    assert!(out.join("tracks.parquet").is_file());
    ends_with(3, &["inspect", text(&recording)]);
}

#[test]
fn inspect_tells_of_all_files_also_where_one_is_not_understood() {
    let folder = folder("inspect_several");
    let file = |name: &str, text: &str| {
        let file = folder.join(name);
        fs::write(&file, text).expect("writes");
        file
    };
    let walk = file("walk.csv", "t_s,id,x_m,y_m\n0.0,7,1.0,0.5\n0.1,7,1.1,0.5\n");
    let table = file("table.csv", "scene,frame\n0,1\n");
    let petrack = file("walk.txt", "7 1 1.0 0.5 1.7\n7 2 1.1 0.5 1.7\n");
    let wrong = file("wrong.bvh", "HIERARCHY ROOT");
    let told = done(&["inspect", text(&walk), text(&table), text(&petrack)]);
    assert!(
        told.contains("recorded people") && told.contains("1 to 1.1") && told.contains("scene frame"),
        "{told}"
    );
    assert!(told.contains("no rate in the file: --fps"), "{told}");
    let output = umbracast(&["inspect", text(&wrong), text(&walk)]);
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(out.contains("not understood") && out.contains("recorded people"), "{out}");
    assert!(
        output.status.code() == Some(1) && err.contains("1 of 2 files") && err.contains("wrong.bvh"),
        "{err}"
    );
}

#[test]
fn an_empty_and_a_wrong_file_are_named() {
    let folder = folder("wrong_files");
    for (name, bytes) in [("empty.mcap", &b""[..]), ("wrong.mcap", b"not a recording"), ("empty.pcd", b"")] {
        let file = folder.join(name);
        fs::write(&file, bytes).expect("writes");
        for command in ["inspect", "run"] {
            let out = folder.join("out");
            let mut arguments = vec![command, text(&file)];
            if command == "run" {
                arguments.extend(["--out", text(&out)]);
            }
            let message = ends_with(1, &arguments);
            assert!(message.contains(name) && message.contains("expected"), "{message}");
        }
    }
    let missing = folder.join("missing.mcap");
    assert!(ends_with(1, &["inspect", text(&missing)]).contains("missing.mcap"));
    let missing = folder.join("missing");
    let message = ends_with(1, &["run", text(&missing), "--out", text(&folder.join("out"))]);
    assert!(message.contains("no such file"), "{message}");
}

#[test]
fn a_wrong_key_in_a_site_file_names_file_place_expected_and_found() {
    let folder = folder("wrong_key");
    let site = folder.join("lab.toml");
    fs::write(&site, "[site.hall]\nlenght_m = 12.0\n").expect("writes");
    let message = ends_with(1, &["config", "--check", text(&site)]);
    assert!(message.contains("lab.toml:2:1") && message.contains("lenght_m") && message.contains("length_m"));
    fs::write(&site, "[site.hall]\nlength_m = \"twelve\"\n").expect("writes");
    let message = ends_with(1, &["simulate", "--site", text(&site), "--out", text(&folder.join("sim"))]);
    assert!(message.contains("lab.toml:2") && message.contains("a number") && message.contains("a string"));
}

#[test]
fn wrong_arguments_end_with_code_2() {
    ends_with(2, &["simulate"]);
    ends_with(2, &["run", "x", "--out", "y", "--mode", "best"]);
    let message = ends_with(2, &["simulate", "--people", "0", "--out", "y"]);
    assert!(message.contains("expected 1 or more, found 0"), "{message}");
}
