//! What real halls do to light, all of it together and each part alone; and how old what sensors saw may be.

use std::ffi::OsString;
use std::fs;

use super::book::Book;
use crate::tools::{Result, argument, root};

const SITE: &str = "config/sites/glass.toml";
/// Parts of the site file that stand alone, by the words they begin with; panes are the rest of the file.
const PARTS: [(&str, &str); 4] = [
    ("bias", "range_bias_m"),
    ("edges", "mixed_returns"),
    ("dark cloth", "dark_cloth"),
    ("panes", "[[site.simulation.panes]]"),
];

/// Scores of the default hall without and with everything, and with one thing at a time.
pub fn glass(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record glass");
    let crowd = ["--scenes", "20", "--preset", "orca-03"];
    book.score("without", crowd)?;
    book.score("together", crowd.into_iter().chain(["--site", SITE]))?;
    let text = fs::read_to_string(root().join(SITE)).map_err(|e| format!("{SITE}: {e}"))?;
    let alone = book.scratch("alone.toml");
    for (name, begins) in PARTS {
        fs::write(&alone, only(&text, begins)?).map_err(|e| e.to_string())?;
        let words = crowd.map(OsString::from).into_iter().chain(["--site".into(), argument(&alone)]);
        book.score(&format!("{name} alone"), words)?;
    }
    book.compare()
}

/// The default hall with revolutions cut elsewhere than behind the sensors, who see people within a quarter of a turn to
/// either side: soon after these, their points are 25 ms younger when the frame closes, and before these as much older.
pub fn cut(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record cut");
    let crowd = ["--scenes", "20", "--preset", "orca-03"];
    for (name, cut_deg) in [("after people", 95.0), ("behind", 180.0), ("before people", 265.0)] {
        let sensor = |name: &str, x_m: f64, yaw_deg: f64| {
            format!(
                "[[site.sensors]]\nname = \"{name}\"\nmodel = \"hdl-32e\"\nposition_m = [{x_m:.1}, 0.0, 9.0]\n\
                 rotation_deg = {{ yaw = {yaw_deg:.1}, pitch = 35.0, roll = 0.0 }}\ncut_deg = {cut_deg:.1}\n"
            )
        };
        let file = book.scratch(&format!("cut-{cut_deg}.toml"));
        let text = sensor("lidar_east", 16.0, 180.0) + &sensor("lidar_west", -16.0, 0.0);
        fs::write(&file, text).map_err(|e| e.to_string())?;
        let words = crowd.map(OsString::from).into_iter().chain(["--site".into(), argument(&file)]);
        book.score(name, words)?;
    }
    book.compare()
}

/// The site file with one of its parts.
fn only(text: &str, begins: &str) -> Result<String> {
    let at = text.find(&format!("\n{begins}")).ok_or(format!("{SITE}: expected {begins}, found none"))? + 1;
    let part = match begins.starts_with('[') {
        true => &text[at..],
        false => text[at..].lines().next().unwrap_or_default(),
    };
    Ok(format!("[site.simulation]\n{part}\n"))
}
