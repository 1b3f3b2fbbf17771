//! Sites with radios as a user meets them: losses and decisions of a run, and the closed loop.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use umbracast::decide::Action;
use umbracast::radio::Surface;
use umbracast_io::rows::{BindingRow, DecisionRow, LossRow, ReportRow};
use umbracast_io::tables;
use umbracast_io::wire::WireRow;

#[path = "common/command.rs"]
mod command;
mod common;

use command::{done, results_in, umbracast};
use common::folder;

/// Two people who cross in front of the access point `side`, for three seconds.
const CROSSING: &str = "t_s,id,x_m,y_m,height_m\n\
    0.0,1,6.0,-2.0,1.80\n1.0,1,6.0,-0.7,1.80\n2.0,1,6.0,0.6,1.80\n3.0,1,6.0,1.9,1.80\n\
    0.0,2,3.0,0.3,1.70\n1.0,2,2.0,0.3,1.70\n2.0,2,1.0,0.3,1.70\n3.0,2,0.0,0.3,1.70\n";

fn text(path: &Path) -> &str {
    path.to_str().expect("the test's folder has a plain name")
}

/// The files of a folder, by name.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<PathBuf> =
        fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    let name = |path: &Path| path.file_name().expect("a name").to_string_lossy().into_owned();
    files.iter().map(|path| (name(path), fs::read(path).expect("a file"))).collect()
}

#[test]
fn a_site_with_radios_has_tables_of_losses_and_decisions_and_no_other_site_has() {
    let folder = folder("radio");
    let (walk, sim) = (folder.join("crossing.csv"), folder.join("sim"));
    fs::write(&walk, CROSSING).expect("writes");
    done(&["simulate", "--trajectories", text(&walk), "--seed", "7", "--out", text(&sim)]);
    let (out, plain, beams) = (folder.join("out"), folder.join("plain"), folder.join("beams"));
    let run = |out: &Path, radio: &str, handover: &str| {
        let access_points =
            [("side", "[14.0, 0.0, 2.0]"), ("north", "[0.0, 14.0, 3.0]")].map(|(name, at)| {
                format!("[[site.access_points]]\nname = \"{name}\"\nposition_m = {at}\n{radio}\n")
            });
        let site = out.with_extension("toml");
        fs::write(&site, access_points.concat() + handover).expect("writes");
        done(&["run", text(&sim), "--site", text(&site), "--mcap", "--csv", "--out", text(out)]);
    };
    run(
        &out,
        "radio = { carrier_ghz = 140.0, margin_db = 5.0 }",
        "[site.handover]\nprocedure = \"nr-ltm\"\n",
    );
    run(&plain, "", "");
    run(
        &beams,
        "radio = { carrier_ghz = 140.0, margin_db = 12.0 }",
        "[site.handover]\n[site.reflections]\nwalls = \"none\"\nceiling = \"metal\"\nfloor = \"none\"\n",
    );
    let names = ["side".to_owned(), "north".to_owned()];
    let losses = tables::read::<LossRow>(&out, &names).expect("a table");
    assert!(
        losses.iter().any(|row| row.loss_db[0][1] > 5.0),
        "somebody crosses in front of the access point"
    );
    let decisions = tables::read::<DecisionRow>(&out, &names).expect("a table");
    assert!(decisions.iter().any(|row| row.action != Action::Stay && row.target.is_some()), "a change helps");
    let pointed = tables::read::<DecisionRow>(&beams, &names).expect("a table");
    let surfaces: Vec<_> =
        pointed.iter().filter(|row| row.action == Action::Beam).map(|row| row.surface).collect();
    assert!(surfaces.contains(&Some(Surface::Ceiling)) && surfaces.contains(&None), "{surfaces:?}");
    assert!(decisions.iter().all(|row| row.action != Action::Beam && row.surface.is_none()));
    let csv = fs::read_to_string(out.join("decisions.csv")).expect("a table");
    assert!(
        csv.starts_with("scene,frame,time_ns,track,serving,action,target,surface,deadline_s,saved_s,p_out\n"),
        "{csv}"
    );
    // The same bytes as without radios, but for the configuration and what is of the radio alone.
    let radio = [
        "links_db.parquet",
        "links_db.csv",
        "bindings.parquet",
        "bindings.csv",
        "decisions.parquet",
        "decisions.csv",
    ];
    let of = |folder: &Path| {
        let kept = |(name, _): &(String, Vec<u8>)| {
            !radio.contains(&name.as_str())
                && !["config.toml", "run.json"].contains(&name.as_str())
                && !name.ends_with(".mcap")
        };
        contents(folder).into_iter().filter(kept).collect::<Vec<_>>()
    };
    assert!(of(&out) == of(&plain));
    assert!(radio.iter().all(|name| !plain.join(name).exists()));
    let topics =
        |folder: &Path| results_in(&folder.join("results-0000.mcap")).into_keys().collect::<Vec<_>>();
    let of_radio = [LossRow::TOPIC, BindingRow::TOPIC, DecisionRow::TOPIC].map(str::to_owned);
    assert!(of_radio.iter().all(|topic| topics(&out).contains(topic) && !topics(&plain).contains(topic)));
}

/// The crossing on a site with two radios: the folder, its simulation, the site file.
fn crossing(name: &str) -> (PathBuf, PathBuf, PathBuf) {
    let folder = folder(name);
    let (walk, sim, site) = (folder.join("crossing.csv"), folder.join("sim"), folder.join("hall.toml"));
    fs::write(&walk, CROSSING).expect("writes");
    done(&["simulate", "--trajectories", text(&walk), "--seed", "7", "--out", text(&sim)]);
    let access_points = [("side", "[14.0, 0.0, 2.0]"), ("north", "[0.0, 14.0, 3.0]")].map(|(name, at)| {
        format!("[[site.access_points]]\nname = \"{name}\"\nposition_m = {at}\nradio = {{}}\n")
    });
    fs::write(&site, access_points.concat()).expect("writes");
    (folder, sim, site)
}

#[test]
fn reports_of_a_file_say_who_carries_a_device() {
    let (folder, sim, site) = crossing("reports");
    let out = folder.join("out");
    let run = |reports: &Path, out: &Path| {
        let words = ["run", text(&sim), "--site", text(&site), "--csv", "--out", text(out), "--reports"];
        umbracast(&[&words[..], &[text(reports)]].concat()).output().expect("runs")
    };
    let of_access_points = fs::read_to_string(&site).expect("was written");
    fs::write(&site, of_access_points + "[site.handover]\n").expect("writes");
    // Device 17 comes nearer to `north` as nobody but the second person does, who walks away from `side`.
    let reports = folder.join("reports.csv");
    let heard = |k: i64| {
        let s = k as f64 * 0.1;
        let (x_m, y_m) = (1.0 - s, 0.3);
        let loss_db = |ap: [f64; 2]| 20.0 * ((ap[0] - x_m).hypot(ap[1] - y_m)).log10();
        let time_ns = k * 100_000_000;
        let powers = [-30.0 - loss_db([14.0, 0.0]), -30.0 - loss_db([0.0, 14.0])];
        format!("{time_ns},17,side,{:.2}\n{time_ns},17,north,{:.2}\n", powers[0], powers[1])
    };
    let rows: String = (0..30).map(heard).collect();
    fs::write(&reports, format!("time_ns,device,access_point,power_dbm\n{rows}")).expect("writes");
    let done = run(&reports, &out);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let names = ["side".to_owned(), "north".to_owned()];
    let bindings = tables::read::<BindingRow>(&out, &names).expect("a table");
    assert!(!bindings.is_empty() && bindings.iter().all(|row| row.device == 17), "{bindings:?}");
    let csv = fs::read_to_string(out.join("bindings.csv")).expect("a table");
    assert!(csv.starts_with("scene,frame,time_ns,device,track,p\n"), "{csv:.200}");
    // Decisions about whoever carries it begin with the access point that is said to serve it.
    let carrier = bindings.iter().rfind(|row| row.p > 0.5).expect("somebody carries it").track;
    for (index, name) in (0..).zip(&names) {
        let rows: String =
            rows.lines().map(|row| format!("{row},{}\n", row.contains(name.as_str()))).collect();
        fs::write(&reports, format!("time_ns,device,access_point,power_dbm,serves\n{rows}")).expect("writes");
        let out = folder.join(format!("served-by-{name}"));
        assert!(run(&reports, &out).status.success());
        let decisions = tables::read::<DecisionRow>(&out, &names).expect("a table");
        let of_carrier: Vec<u32> =
            decisions.iter().filter(|row| row.track == carrier).map(|row| row.serving).collect();
        let last = &of_carrier[of_carrier.len() - 5..];
        assert!(last.iter().all(|serving| *serving == index), "served by {name}: {of_carrier:?}");
    }
    fs::write(&reports, "time_ns,device,access_point,power_dbm\n5,17,attic,-60\n").expect("writes");
    let refused = run(&reports, &folder.join("refused"));
    let told = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1), "{told}");
    assert!(
        told.contains("reports.csv: line 2, column access_point: expected the name of an access point"),
        "{told}"
    );
}

#[test]
fn what_a_live_run_heard_is_heard_again_from_its_recording() {
    let (folder, sim, site) = crossing("reports-live");
    let empty = sim.join("empty.mcap");
    let names = ["side".to_owned(), "north".to_owned()];
    // A busy machine may skip a frame, which a replay does not: then once more, more slowly.
    let recording = ["0.5", "0.25", "0.1"].iter().find_map(|rate| {
        let records = folder.join(format!("records-{rate}"));
        let words = ["live", "--port", "0", "--serve", "127.0.0.1:0", "--json", "--site", text(&site)];
        let mut live = umbracast(&[&words[..], &["--empty", text(&empty), "--record", text(&records)]].concat())
            .stdout(Stdio::piped())
            .spawn()
            .expect("starts");
        let mut said = BufReader::new(live.stdout.take().expect("piped"));
        let mut ends_with = || {
            let mut line = String::new();
            said.read_line(&mut line).expect("a line");
            line.trim().rsplit(' ').next().expect("a word").to_owned()
        };
        let page = ends_with();
        let ports: Vec<String> = (0..2).map(|_| format!("127.0.0.1:{}", ends_with())).collect();
        let (scene, to) = (sim.join("scene-0000.mcap"), ports.join(","));
        let replay = umbracast(&["replay", text(&scene), "--to", &to, "--rate", rate, "--quiet"]).spawn();
        let mut replay = replay.expect("starts");
        let host = page.trim_start_matches("http://").trim_end_matches('/');
        while replay.try_wait().expect("a state").is_none() {
            let body = "[{\"access_point\":\"side\",\"device\":17,\"power_dbm\":-53.3},\
                        {\"access_point\":\"north\",\"device\":17,\"power_dbm\":-52.9}]";
            let mut stream = TcpStream::connect(host).expect("the page");
            let length = body.len();
            write!(stream, "POST /api/reports HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nContent-Length: {length}\r\n\r\n{body}")
                .expect("sends");
            let mut answer = String::new();
            stream.read_to_string(&mut answer).expect("an answer");
            assert!(answer.starts_with("HTTP/1.1 202"), "{answer}");
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        assert!(Command::new("kill").args(["-TERM", &live.id().to_string()]).status().expect("kill").success());
        let mut summary = String::new();
        said.read_to_string(&mut summary).expect("a summary");
        live.wait().expect("ends");
        let summary: serde_json::Value = serde_json::from_str(&summary).expect("a summary");
        let whole = summary["frames_skipped"] == 0 && summary["recorder"]["lost"] == 0;
        whole.then(|| fs::read_dir(&records).expect("recordings").next().expect("one").expect("readable").path())
    });
    let recording = recording.expect("a run without a skipped frame");
    let out = folder.join("out");
    done(&["run", text(&recording), "--empty", text(&empty), "--mcap", "--out", text(&out)]);
    let (live, again) = (results_in(&recording), results_in(&out.join("results-0000.mcap")));
    for topic in [BindingRow::TOPIC, ReportRow::TOPIC] {
        assert!(live[topic].len() > 20, "{topic}: {} messages", live[topic].len());
        assert!(live[topic] == again[topic], "{topic}");
    }
    assert!(!tables::read::<BindingRow>(&out, &names).expect("a table").is_empty());
}

#[test]
fn a_data_set_is_scored_without_us() {
    let out = folder("dataset");
    let (set, answers) = (out.join("set"), out.join("answers"));
    let words =
        ["network", "--dataset", text(&set), "--csv", "--scenes", "1", "--seconds", "20", "--people", "4"];
    done(
        &[&words[..], &["--seed", "120000", "--carrier", "28", "--access-points", "2", "--truth", "edges"]]
            .concat(),
    );
    let csv = |name: &str| fs::read_to_string(set.join(name)).expect("a table");
    assert_eq!(csv("split.csv"), "scene,seed,split\n0,120000,train\n");
    assert_eq!(csv("devices.csv").lines().count(), 5);
    // Every 10 ms, two access points, four people.
    assert_eq!(csv("radio.csv").lines().count(), 1 + 2000 * 8);
    assert!(
        csv("labels.csv")
            .starts_with("scene,frame,time_ns,access_point,person,x_m,y_m,loss_now_db,loss_s1_db,")
    );
    let reports = set.join("reports.csv");
    done(&["run", text(&set), "--csv", "--reports", text(&reports), "--out", text(&answers)]);
    assert!(fs::read_to_string(answers.join("bindings.csv")).expect("a table").lines().count() > 100);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/dataset/score.py");
    let score = |split: &str| {
        Command::new("python3")
            .arg(&script)
            .args([&set, &answers])
            .args(["--split", split])
            .output()
            .expect("python3")
    };
    let said = score("train");
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    let said = String::from_utf8_lossy(&said.stdout).into_owned();
    let value = |name: &str| {
        let line =
            said.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {said}"));
        line.rsplit(' ').next().and_then(|value| value.parse::<f64>().ok()).expect("a number")
    };
    assert!(value("share followed") > 0.8 && value("F1 of out within 300 ms") > 0.6, "{said}");
    assert!(value("expected calibration error") < 0.1, "{said}");
    assert!(!score("test").status.success(), "there is no such scene");
    // The same set as if it had been measured.
    let words = ["network", "--measured", text(&set), "--reports", text(&reports), "--json"];
    let said = umbracast(&words).output().expect("runs").stdout;
    let fit: serde_json::Value = serde_json::from_slice(&said).expect("JSON");
    assert!(fit["links"].as_u64() >= Some(4), "{fit}");
    assert!(
        fit["ahead"][0]["rmse_db"].as_f64() < Some(9.0) && fit["f1_out_300_ms"].as_f64() > Some(0.4),
        "{fit}"
    );
    let refused = umbracast(&["network", "--measured", text(&set)]).output().expect("runs");
    assert!(String::from_utf8_lossy(&refused.stderr).contains("are there reports"), "nothing was heard");
}

#[test]
fn a_network_is_played_alike_on_any_number_of_threads_and_traced_for_another_simulator() {
    let out = folder("network");
    let words = [
        "network",
        "--scenes",
        "2",
        "--seconds",
        "20",
        "--people",
        "3",
        "--seed",
        "120000",
        "--carrier",
        "60",
    ];
    let words = [&words[..], &["--access-points", "2", "--truth", "edges", "--out"]].concat();
    let played = |name: &str, threads: &str| {
        let place = out.join(name);
        let policies = ["--policies", "a3-60-40,forecast,oracle", "--threads", threads];
        done(&[&words[..], &[text(&place)], &policies].concat());
        contents(&place)
    };
    let (one, two) = (played("one", "1"), played("two", "2"));
    assert!(one == two);
    let rows: serde_json::Value = serde_json::from_slice(&one[1].1).expect("network.json");
    assert_eq!(rows.as_array().map(Vec::len), Some(3));
    assert!(
        rows[0]["outage"].as_f64() >= rows[2]["outage"].as_f64(),
        "nobody does better than who knows all: {rows}"
    );
    let traces = out.join("traces");
    done(&[&words[..], &[text(&traces), "--trace", "ns3"]].concat());
    let trace = fs::read_to_string(traces.join("trace-120000.csv")).expect("a trace");
    assert!(trace.starts_with("time_s,access_point,device,loss_db,p_out_300ms\n0.00,0,0,"), "{trace:.200}");
    let times: Vec<f64> =
        trace.lines().skip(1).map(|line| line.split(',').next().unwrap().parse().unwrap()).collect();
    assert!(times.is_sorted() && times.len() > 10, "{} losses", times.len());
}
