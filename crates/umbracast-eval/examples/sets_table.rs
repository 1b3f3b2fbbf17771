//! One table of several evaluations: a row a group of scenes and mode.
//!
//! `cargo run --release -p umbracast-eval --example sets_table -- SCORES.json...`, each as `evaluate --out` or
//! `evaluate --json` writes it.

use serde_json::Value;
use umbracast_eval::pooled::ALL;
use umbracast_eval::report::tables::Table;
use umbracast_eval::score::Predictor;

const HEADER: [&str; 14] = [
    "set",
    "mode",
    "scenes",
    "frames",
    "F1 300 ms side",
    "centre",
    "onset F1 300 ms side",
    "recall",
    "MOTA",
    "IDF1",
    "switches",
    "position, m",
    "velocity, m/s",
    "900 ms, m",
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut table = Table {
        title: "Every set beside the others".to_owned(),
        note: "Switches a scene; position and velocity: root mean square of the 2-D error; last column: mean displacement of the forecast."
            .to_owned(),
        header: HEADER.map(str::to_owned).to_vec(),
        words: 2,
        rows: Vec::new(),
    };
    for file in std::env::args().skip(1) {
        let text = std::fs::read_to_string(&file).map_err(|e| format!("{file}: {e}"))?;
        let scores: Value = serde_json::from_str(&text).map_err(|e| format!("{file}: {e}"))?;
        let groups =
            scores["groups"].as_array().ok_or_else(|| format!("{file}: expected groups, found none"))?;
        for group in groups.iter().filter(|group| group["name"] != ALL) {
            let modes = group["modes"].as_array().into_iter().flatten();
            table.rows.extend(modes.map(|mode| row(group, mode)));
        }
    }
    print!("{}", table.to_text());
    Ok(())
}

fn row(group: &Value, mode: &Value) -> Vec<String> {
    let window = |access_point: &str| {
        let mut links = group["links"].as_array().into_iter().flatten();
        let own = |links: &&Value| {
            links["mode"] == mode["mode"]
                && links["predictor"] == Predictor::Run.name()
                && links["access_point"] == access_point
        };
        links.find(own).map_or(Value::Null, |links| links["windows"][2].clone())
    };
    let (side, centre) = (window("side"), window("centre"));
    let figure = |of: &Value| of["value"].as_f64().map_or("-".to_owned(), |value| format!("{value:.3}"));
    let mut cells = vec![
        group["name"].as_str().unwrap_or("-").to_owned(),
        mode["mode"].as_str().unwrap_or("-").to_owned(),
        group["scenes"].to_string(),
        group["frames"].to_string(),
    ];
    cells.extend([&side["f1"], &centre["f1"], &side["onset_f1"]].map(figure));
    let stage1 = ["recall", "mota", "idf1", "switches_per_scene", "position_rmse_m", "velocity_rmse_mps"];
    cells.extend(stage1.map(|name| figure(&mode[name])));
    cells.push(figure(&mode["displacement_m"][8]));
    cells
}
