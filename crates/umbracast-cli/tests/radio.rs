//! Sites with radios as a user meets them: losses and decisions of a run, and the closed loop.

use std::fs;
use std::path::{Path, PathBuf};

use umbracast::decide::Action;
use umbracast_io::rows::{DecisionRow, LossRow};
use umbracast_io::tables;
use umbracast_io::wire::WireRow;

#[path = "common/command.rs"]
mod command;
mod common;

use command::{done, results_in};
use common::folder;

/// Two people who cross in front of the access point `side`, for three seconds.
const CROSSING: &str = "t_s,id,x_m,y_m,height_m\n\
    0.0,1,6.0,-2.0,1.80\n1.0,1,6.0,-0.7,1.80\n2.0,1,6.0,0.6,1.80\n3.0,1,6.0,1.9,1.80\n\
    0.0,2,1.0,0.3,1.70\n1.0,2,0.0,0.3,1.70\n2.0,2,-1.0,0.3,1.70\n3.0,2,-2.0,0.3,1.70\n";

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
    let (out, plain) = (folder.join("out"), folder.join("plain"));
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
    let names = ["side".to_owned(), "north".to_owned()];
    let losses = tables::read::<LossRow>(&out, &names).expect("a table");
    assert!(
        losses.iter().any(|row| row.loss_db[0][1] > 5.0),
        "somebody crosses in front of the access point"
    );
    let decisions = tables::read::<DecisionRow>(&out, &names).expect("a table");
    assert!(decisions.iter().any(|row| row.action != Action::Stay && row.target.is_some()), "a change helps");
    let csv = fs::read_to_string(out.join("decisions.csv")).expect("a table");
    assert!(
        csv.starts_with("scene,frame,time_ns,track,serving,action,target,deadline_s,saved_s,p_out\n"),
        "{csv}"
    );
    // The same bytes as without radios, but for the configuration and what is of the radio alone.
    let radio = ["links_db.parquet", "links_db.csv", "decisions.parquet", "decisions.csv"];
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
    let of_radio = [LossRow::TOPIC, DecisionRow::TOPIC].map(str::to_owned);
    assert!(of_radio.iter().all(|topic| topics(&out).contains(topic) && !topics(&plain).contains(topic)));
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
