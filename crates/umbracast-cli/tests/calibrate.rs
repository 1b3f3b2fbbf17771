//! `calibrate` as somebody runs it who has hung two sensors up by eye.

use std::fs;
use std::path::Path;
use std::process::Command;

mod common;

use common::folder;

fn text(path: &Path) -> &str {
    path.to_str().expect("a path of ASCII")
}

/// What the command prints.
fn done(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_umbracast"))
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."))
        .args(arguments)
        .arg("--quiet")
        .output()
        .expect("the command starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn a_site_file_made_by_eye_is_put_right() {
    let folder = folder("calibrate");
    let (sim, out) = (folder.join("sim"), folder.join("calibrated.toml"));
    done(&["simulate", "--stroll", "20", "--people", "4", "--out", text(&sim)]);
    let by_eye = "config/sites/hand-mounted.toml";
    let told = done(&["calibrate", text(&sim), "--site", by_eye, "--out", text(&out), "--json"]);
    let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    for (sensor, x_m) in [(0, 16.0), (1, -16.0)] {
        let found = &told["sensors"][sensor];
        let of = |key: &str, at: usize| found[key][at].as_f64().expect("a number");
        assert!((of("position_m", 0) - x_m).abs() < 0.03 && of("position_m", 1).abs() < 0.03, "{found}");
        assert!(found["turned_deg"].as_f64().is_some_and(|deg| deg > 3.0), "{found}");
        assert!(found["sigma"]["yaw_deg"].as_f64().is_some_and(|deg| deg < 0.1), "{found}");
        assert_eq!(found["frame"], "walls");
    }
    let written = fs::read_to_string(&out).expect("the site file");
    assert!(written.starts_with("# The default hall with poses estimated by eye"), "{written}");
    done(&["config", "--check", text(&out)]);
    let picture = fs::read_to_string(out.with_extension("svg")).expect("the picture");
    assert!(picture.starts_with("<svg") && picture.contains("lidar_west"));
    // What was found leaves nothing to put right: the same command again moves nothing.
    let again = done(&[
        "calibrate",
        text(&sim),
        "--site",
        text(&out),
        "--out",
        text(&folder.join("again.toml")),
        "--json",
    ]);
    let again: serde_json::Value = serde_json::from_str(&again).expect("JSON");
    let moved_m = again["sensors"][1]["moved_m"].as_f64().expect("a number");
    assert!(moved_m < 0.005, "{moved_m}");
}
