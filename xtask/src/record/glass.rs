//! Glass, mirrors, edges and dark cloth: all together and each part alone.

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

/// The site file with one of its parts.
fn only(text: &str, begins: &str) -> Result<String> {
    let at = text.find(&format!("\n{begins}")).ok_or(format!("{SITE}: expected {begins}, found none"))? + 1;
    let part = match begins.starts_with('[') {
        true => &text[at..],
        false => text[at..].lines().next().unwrap_or_default(),
    };
    Ok(format!("[site.simulation]\n{part}\n"))
}
