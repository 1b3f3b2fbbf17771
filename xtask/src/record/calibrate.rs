//! Sensors that hang elsewhere than the site file says: how well they are found again, and what that is worth.

use std::ffi::OsString;
use std::fs;

use super::book::Book;
use super::keep;
use crate::tools::{Result, argument, root};

const EXAMPLE: &str = "cargo run --release --quiet --package umbracast-calibrate --example hung -- 201800 20";
const ROOMS: &str = "cargo run --release --quiet --package umbracast-calibrate --example rooms -- 200000 400";
const BY_EYE: &str = "config/sites/hand-mounted.toml";

/// Errors over 20 scenes of each kind; then F1 with the true poses, with those of a file that is off, and with those that
/// were found from a minute of walkers.
pub fn calibrate(book: &mut Book) -> Result<()> {
    book.command(EXAMPLE);
    let said = book.bash(&root(), EXAMPLE)?;
    book.line(&said);
    let [scenes, walk, found] = ["scenes", "walk", "calibrated.toml"].map(|name| book.scratch(name));
    book.umbracast_says([
        "simulate".into(),
        "--scenes".into(),
        "20".into(),
        "--out".into(),
        argument(&scenes),
    ])?;
    let walks = ["simulate", "--stroll", "60", "--seed", "201000", "--out"].map(Into::into);
    book.umbracast_says(walks.into_iter().chain([argument(&walk)]))?;
    let words = [
        "calibrate".into(),
        argument(&walk),
        "--site".into(),
        BY_EYE.into(),
        "--out".into(),
        argument(&found),
    ];
    book.umbracast_says(words)?;
    for (name, site) in
        [("exact", None), ("by-eye", Some(BY_EYE.into())), ("calibrated", Some(argument(&found)))]
    {
        let out = book.scratch(&format!("run-{name}"));
        let words = ["run".into(), argument(&scenes), "--out".into(), argument(&out)];
        let site = site.into_iter().flat_map(|site| ["--site".into(), site]);
        book.umbracast_says(words.into_iter().chain(site))?;
        book.score(name, [argument(&out), "--truth".into(), argument(&scenes)])?;
    }
    book.compare()
}

/// Floors of random rooms and corridors, with every sensor model: right, wrong, and wrong without a word.
pub fn rooms(book: &mut Book) -> Result<()> {
    book.command(ROOMS);
    let said = book.bash(&root(), ROOMS)?;
    book.line(&said);
    Ok(())
}

/// The commands of docs/TRIPODS.md, one after the other, by somebody without sensors.
pub fn tripods(book: &mut Book) -> Result<()> {
    const SITE: &str = "config/sites/tripods.toml";
    const TRUTH: &str = "config/sites/tripods-in-truth.toml";
    let [map, walk, found, crowd, out] = ["map", "walk", "calibrated.toml", "crowd", "out"]
        .map(|name| book.scratch(name).to_string_lossy().into_owned());
    let mut says = |words: &[&str]| book.umbracast_says(words.iter().copied());
    says(&["coverage", "--site", SITE, "--out", &map])?;
    says(&["simulate", "--stroll", "60", "--seed", "202000", "--site", TRUTH, "--out", &walk])?;
    says(&["calibrate", &walk, "--site", SITE, "--out", &found])?;
    says(&["simulate", "--scenes", "10", "--seed", "203000", "--site", TRUTH, "--out", &crowd])?;
    says(&["run", &crowd, "--site", &found, "--csv", "--out", &out])?;
    says(&["evaluate", &out, "--truth", &crowd])?;
    says(&["evaluate", "--scenes", "10", "--seed", "204000", "--preset", "orca-03", "--site", &found])?;
    keep(book, &book.scratch("calibrated.svg"), "tripods.svg")
}

/// Sensors that hang otherwise than the site says, or slip, with nothing done about it but what runs.
pub fn following(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record following");
    let off = book.scratch("off.toml");
    for site in ["exact", "turned-sensor", "slipping-sensor"] {
        let crowd = ["--scenes", "20", "--preset", "orca-03"];
        let file = (site != "exact").then(|| format!("config/sites/{site}.toml"));
        let site_words = file.iter().flat_map(|file| ["--site", file]);
        book.score(site, crowd.into_iter().chain(site_words))?;
        if let Some(file) = &file {
            let text = fs::read_to_string(root().join(file)).map_err(|e| format!("{file}: {e}"))?;
            let text = text + "\n[detect]\nfollow_sensors = false\n";
            fs::write(&off, text).map_err(|e| e.to_string())?;
            let words = crowd.map(Into::into).into_iter().chain(["--site".into(), argument(&off)]);
            book.score::<OsString>(&format!("{site}, not followed"), words)?;
        }
    }
    book.compare()
}

/// Clocks that are apart while people walk for two minutes: what a run finds of them.
pub fn clocks(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record clocks");
    book.line("lidar_west ahead by, ms  seed    what a run says of the clocks");
    let (site, walk, out) = (book.scratch("late.toml"), book.scratch("walk"), book.scratch("out"));
    for ahead_ms in [0, 20, 50, -50] {
        let text = format!("[site.simulation]\nclock_ahead_ms = {{ lidar_west = {ahead_ms}.0 }}\n");
        fs::write(&site, text).map_err(|e| e.to_string())?;
        for seed in 205_000..205_005 {
            let seed = seed.to_string();
            let words = ["simulate", "--stroll", "120", "--seed", &seed, "--site"].map(OsString::from);
            let to = ["--out".into(), argument(&walk)];
            book.quietly(&words.into_iter().chain([argument(&site)]).chain(to).collect::<Vec<_>>())?;
            let said = book.quietly(&["run".into(), argument(&walk), "--out".into(), argument(&out)])?;
            let found = said.split("their mean: ").nth(1).and_then(|rest| rest.split(';').next());
            book.line(&format!("{ahead_ms:>24}  {seed}  {}", found.unwrap_or("nothing")));
        }
    }
    Ok(())
}
