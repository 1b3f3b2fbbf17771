//! A hall in use: furniture that is put in, people who stand, a run without an empty scan.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::ffi::OsString;
use std::fmt::Write;
use std::fs;

use super::book::Book;
use crate::tools::{Result, root};

/// Walkers and scenes of each row.
const SCENES: u32 = 20;
/// Seeds of tests begin here.
const FIRST_SEED: u64 = 200_000;
/// What is put in after the empty scan: a table, a cupboard, a chair; and what stands in the default hall, for a list
/// replaces the default's list.
const PUT_IN: [&str; 3] = [
    "position_m = [9.5, 11.0]\nsize_m = [1.6, 0.8, 0.75]\nyaw_deg = 20.0",
    "position_m = [-10.5, -9.8]\nsize_m = [0.8, 0.45, 1.8]\nyaw_deg = 40.0",
    "position_m = [3.0, 13.6]\nsize_m = [0.5, 0.5, 0.9]\nyaw_deg = 10.0",
];
/// From here on all that was put in is known.
const FROM_S: f64 = 10.0;
/// Who stands stands this long.
const STANDS_S: f64 = 300.0;
/// Who has moved no farther than this stands.
const STILL_M: f64 = 0.005;
/// A track this near to a person is the person's.
const GATE_M: f64 = 0.5;

/// One table: precision, MOTA, and who stands, with and without an empty scan.
pub fn living(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record living");
    book.line(&format!(
        "{:<28} {:<10} {:>6} {:>9} {:>15} {:>6} {:>9} {:>14} {:>10}",
        "hall",
        "empty scan",
        "recall",
        "precision",
        format!("from {FROM_S:.0} s on"),
        "MOTA",
        "switches",
        "standing, seen",
        "ids a head"
    ));
    let plain = simulated(book, "plain", &crossing(&[]))?;
    let site = book.scratch("furnished.toml");
    fs::write(&site, furnished()?).map_err(|e| e.to_string())?;
    let furnished = simulated(book, "furnished", &crossing(&["--site", &site.to_string_lossy()]))?;
    let empty = format!("{plain}/empty.mcap");
    let known = ["--empty", empty.as_str()];
    row(book, "people cross", &plain, &known)?;
    row(book, "people cross", &plain, &["--no-empty"])?;
    row(book, "furniture put in", &furnished, &known)?;
    row(book, "furniture put in", &furnished, &["--no-empty"])?;
    let halves: Vec<String> = (0..SCENES).map(|k| half_stand(u64::from(k))).collect();
    let half = simulated(book, "half", &walked(book, "half", &halves)?)?;
    row(book, "half stand for the first 6 s", &half, &known)?;
    row(book, "half stand for the first 6 s", &half, &["--no-empty"])?;
    let standing: Vec<String> = (0..SCENES / 5).map(|k| stand(u64::from(k))).collect();
    let standing = simulated(book, "standing", &walked(book, "standing", &standing)?)?;
    row(book, "four come and stand 5 min", &standing, &known)?;
    row(book, "four come and stand 5 min", &standing, &["--no-empty"])?;
    let stools = book.scratch("stools.toml");
    fs::write(&stools, with_stools()?).map_err(|e| e.to_string())?;
    let sitting: Vec<String> = (0..SCENES / 5).map(|k| sit(u64::from(k))).collect();
    let mut how = walked(book, "sitting", &sitting)?;
    how.extend(["--bodies", "sitting", "--site", &stools.to_string_lossy()].map(str::to_owned));
    let sitting = simulated(book, "sitting", &how)?;
    row(book, "four come and sit 5 min", &sitting, &["--empty", &format!("{sitting}/empty.mcap")])?;
    row(book, "four come and sit 5 min", &sitting, &["--no-empty"])?;
    book.line(
        "Default mode, test seeds. Put in after the empty scan: a table of 0.75 m, a cupboard of 1.8 m, a chair. Standing, seen: \
         share of the frames in which somebody stands, at least a second by now, who has a confirmed track within 0.5 m. Ids a \
         head: different tracks of one person while standing, on the mean.",
    );
    Ok(())
}

fn crossing(more: &[&str]) -> Vec<String> {
    let scenes = SCENES.to_string();
    ["--preset", "orca-03", "--scenes", &scenes].iter().chain(more).map(|word| (*word).to_owned()).collect()
}

/// Trajectories as files of the scratch folder, and the words that replay them.
pub(super) fn walked(book: &Book, name: &str, ways: &[String]) -> Result<Vec<String>> {
    let mut words = vec!["--trajectories".to_owned()];
    for (k, way) in ways.iter().enumerate() {
        let file = book.scratch(&format!("{name}-{k:02}.csv"));
        fs::write(&file, way).map_err(|e| e.to_string())?;
        words.push(file.to_string_lossy().into_owned());
    }
    Ok(words)
}

/// Simulates into a folder of the scratch folder; its path.
pub(super) fn simulated(book: &Book, name: &str, how: &[String]) -> Result<String> {
    let out = book.scratch(&format!("sim-{name}")).to_string_lossy().into_owned();
    let words = ["simulate", "--csv", "--out", &out].into_iter().map(str::to_owned).chain(how.to_vec());
    book.quietly(&words.map(OsString::from).collect::<Vec<_>>())?;
    Ok(out)
}

/// Runs and scores what was simulated.
fn row(book: &mut Book, hall: &str, sim: &str, empty: &[&str]) -> Result<()> {
    let out = format!("{sim}-out");
    let mut scenes: Vec<_> =
        fs::read_dir(sim).map_err(|e| e.to_string())?.flatten().map(|f| f.path()).collect();
    scenes.retain(|path| path.to_string_lossy().contains("scene-"));
    scenes.sort();
    let mut words: Vec<OsString> =
        ["run", "--csv", "--out", &out].iter().chain(empty).map(OsString::from).collect();
    words.extend(scenes.into_iter().map(OsString::from));
    book.quietly(&words)?;
    let said = book.quietly(&["evaluate", &out, "--truth", sim].map(OsString::from))?;
    let [recall, precision, mota, switches] =
        scores(&said).ok_or("evaluate: expected a table of stage 1, found none")?;
    let looked = look(&read(&format!("{sim}/people.csv"))?, &read(&format!("{out}/tracks.csv"))?);
    let known = if empty[0] == "--empty" { "known" } else { "none" };
    book.line(&format!(
        "{hall:<28} {known:<10} {recall:>6} {precision:>9} {:>15.4} {mota:>6} {switches:>9} {:>14} {:>10}",
        looked.late_precision,
        looked.standing_seen.map_or("-".to_owned(), |share| format!("{share:.4}")),
        looked.ids_a_head.map_or("-".to_owned(), |ids| format!("{ids:.2}")),
    ));
    Ok(())
}

/// Recall, precision, MOTA and switches of the default mode, as `evaluate` prints them.
fn scores(said: &str) -> Option<[String; 4]> {
    let mut lines = said.lines().skip_while(|line| !line.starts_with("Detection and tracking"));
    let names: Vec<&str> = lines.nth(1)?.split_whitespace().collect();
    let values: Vec<&str> = lines.next()?.split_whitespace().collect();
    let of = |name: &str| Some((*values.get(names.iter().position(|n| *n == name)?)?).to_owned());
    Some([of("recall")?, of("precision")?, of("MOTA")?, of("switches")?])
}

struct Looked {
    /// Of confirmed tracks, from [`FROM_S`] on.
    late_precision: f64,
    standing_seen: Option<f64>,
    ids_a_head: Option<f64>,
}

/// What no table of `evaluate` tells. Keys are scene and frame.
fn look(people: &[Row], tracks: &[Row]) -> Looked {
    let mut of_frame: BTreeMap<(u32, u32), Vec<&Row>> = BTreeMap::new();
    tracks
        .iter()
        .filter(|t| t.confirmed)
        .for_each(|t| of_frame.entry((t.scene, t.frame)).or_default().push(t));
    let near = |a: &Row, b: &Row| (a.x_m - b.x_m).hypot(a.y_m - b.y_m) < GATE_M;
    let (mut right, mut told) = (0, 0);
    let (mut seen, mut stood) = (0, 0);
    let mut ids: BTreeMap<(u32, u64), Vec<u64>> = BTreeMap::new();
    let mut still_since: BTreeMap<(u32, u64), (f64, f64, u32)> = BTreeMap::new();
    let mut people_of: BTreeMap<(u32, u32), Vec<&Row>> = BTreeMap::new();
    people.iter().for_each(|p| people_of.entry((p.scene, p.frame)).or_default().push(p));
    for (key, here) in &people_of {
        let known = of_frame.get(key).map_or(&[][..], Vec::as_slice);
        if f64::from(key.1) >= 10.0 * FROM_S {
            told += known.len();
            right += known.iter().filter(|track| here.iter().any(|person| near(track, person))).count();
        }
        for person in here {
            let since = still_since.entry((person.scene, person.id)).or_insert((f64::NAN, f64::NAN, key.1));
            // Not a number at first, which is near nothing.
            let moved_m = (person.x_m - since.0).hypot(person.y_m - since.1);
            if moved_m.is_nan() || moved_m > STILL_M {
                *since = (person.x_m, person.y_m, key.1);
            }
            if key.1 < since.2 + 10 {
                continue;
            }
            stood += 1;
            if let Some(track) = known.iter().find(|track| near(track, person)) {
                seen += 1;
                let ids = ids.entry((person.scene, person.id)).or_default();
                if !ids.contains(&track.id) {
                    ids.push(track.id);
                }
            }
        }
    }
    Looked {
        late_precision: f64::from(right as u32) / f64::from(told as u32),
        standing_seen: (stood > 0).then(|| f64::from(seen) / f64::from(stood)),
        ids_a_head: (!ids.is_empty())
            .then(|| ids.values().map(Vec::len).sum::<usize>() as f64 / ids.len() as f64),
    }
}

/// A row of `people` or of `tracks`.
pub(super) struct Row {
    pub(super) scene: u32,
    pub(super) frame: u32,
    pub(super) id: u64,
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) confirmed: bool,
}

pub(super) fn read(path: &str) -> Result<Vec<Row>> {
    let text = fs::read_to_string(path).map_err(|e| format!("{path}: {e}"))?;
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let place = |name: &str| {
        names.iter().position(|n| *n == name).ok_or(format!("{path}: expected a column {name}, found none"))
    };
    let id = place("person").or_else(|_| place("track"))?;
    let [scene, frame, x, y] = ["scene", "frame", "x_m", "y_m"].map(place);
    let (scene, frame, x, y) = (scene?, frame?, x?, y?);
    let confirmed = place("confirmed").ok();
    let row = |(line, text): (usize, &str)| {
        let cells: Vec<&str> = text.split(',').collect();
        let cell = |i: usize| cells.get(i).copied().unwrap_or_default();
        let row = || {
            Some(Row {
                scene: cell(scene).parse().ok()?,
                frame: cell(frame).parse().ok()?,
                id: cell(id).parse().ok()?,
                x_m: cell(x).parse().ok()?,
                y_m: cell(y).parse().ok()?,
                confirmed: confirmed.is_none_or(|i| cell(i) == "true"),
            })
        };
        row().ok_or_else(|| format!("{path}, line {}: expected numbers, found {text}", line + 2))
    };
    lines.enumerate().map(row).collect()
}

/// The default hall's furniture, and what is put in.
fn furnished() -> Result<String> {
    let mut text = default_furniture()?;
    for thing in PUT_IN {
        let _ = write!(text, "[[site.furniture]]\n{thing}\n");
    }
    Ok(text)
}

fn default_furniture() -> Result<String> {
    let default = fs::read_to_string(root().join("config/default.toml")).map_err(|e| e.to_string())?;
    let mut text = String::new();
    let mut inside = false;
    for line in default.lines() {
        inside = match line {
            _ if line.starts_with("[[site.furniture]]") => true,
            _ if line.starts_with('[') || line.is_empty() => false,
            _ => inside,
        };
        if inside {
            text.push_str(line);
            text.push('\n');
        }
    }
    Ok(text)
}

/// Five stand for six seconds and then walk about on their own rays; five walk in rings from the start.
fn half_stand(seed: u64) -> String {
    let mut draw = draws(seed);
    let mut people: Vec<Vec<(f64, f64)>> = Vec::new();
    for person in 0..5 {
        let angle = TAU / 5.0 * f64::from(person) + draw();
        let (radius_m, speed_mps) = (3.5 + 4.5 * draw(), 0.9 + 0.5 * draw());
        let at =
            |radius_m: f64, turn: f64| (radius_m * (angle + turn).cos(), radius_m * (angle + turn).sin());
        let stops = [at(radius_m, 0.0), at(11.7, 0.3), at(radius_m, 0.0), at(radius_m, 0.5), at(11.7, 0.4)];
        people.push(way(&stops, 6.0, speed_mps, 30.0));
    }
    people.extend(rings(30.0, &[(3, 9.5, 1.2), (2, 2.0, 0.8)]));
    table(&people)
}

/// Four walk in and stand for minutes; six walk in rings between and around them.
fn stand(seed: u64) -> String {
    let mut draw = draws(seed);
    let seconds = STANDS_S + 15.0;
    let mut people: Vec<Vec<(f64, f64)>> = Vec::new();
    for person in 0..4 {
        let angle = TAU / 4.0 * f64::from(person) + draw();
        let (radius_m, speed_mps) = (3.5 + 4.5 * draw(), 0.9 + 0.5 * draw());
        let at = |radius_m: f64| (radius_m * angle.cos(), radius_m * angle.sin());
        people.push(way(&[at(11.9), at(radius_m)], 1.0, speed_mps, seconds));
    }
    people.extend(rings(seconds, &[(4, 9.5, 1.2), (2, 2.0, 0.8)]));
    table(&people)
}

/// Where the stools are that people sit down on, well inside the hall.
pub(super) fn stools() -> [(f64, f64); 4] {
    [(3.6, 0.3), (6.2, 1.9), (5.0, 3.5), (7.0, 5.0)].map(|(r, a): (f64, f64)| (r * a.cos(), r * a.sin()))
}

/// The default hall with these in it.
pub(super) fn with_stools() -> Result<String> {
    let mut text = default_furniture()?;
    for (x_m, y_m) in stools() {
        let _ = write!(
            text,
            "[[site.furniture]]\nposition_m = [{x_m:.4}, {y_m:.4}]\nsize_m = [0.36, 0.36, 0.44]\nyaw_deg = 0.0\n"
        );
    }
    Ok(text)
}

/// Four walk to the stools and stay there for minutes; six walk in rings between and around them.
fn sit(seed: u64) -> String {
    let mut draw = draws(seed);
    let seconds = STANDS_S + 15.0;
    let mut people: Vec<Vec<(f64, f64)>> = Vec::new();
    for (x_m, y_m) in stools() {
        let (angle, speed_mps) = (TAU * draw(), 0.9 + 0.5 * draw());
        people.push(way(&[(11.9 * angle.cos(), 11.9 * angle.sin()), (x_m, y_m)], 1.0, speed_mps, seconds));
    }
    people.extend(rings(seconds, &[(4, 9.5, 1.2), (2, 2.0, 0.8)]));
    table(&people)
}

/// Numbers from 0 to 1 that a seed determines: a linear congruential generator (Knuth, MMIX), its upper bits.
pub(super) fn draws(seed: u64) -> impl FnMut() -> f64 {
    let mut state = FIRST_SEED + seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Ten places a second of who stands at the first stop until `from_s`, goes from stop to stop, and stays at the last.
pub(super) fn way(stops: &[(f64, f64)], from_s: f64, speed_mps: f64, seconds: f64) -> Vec<(f64, f64)> {
    let mut at = stops[0];
    let mut next = 1;
    (0..=(10.0 * seconds) as u32)
        .map(|k| {
            let now = at;
            let mut left_m = if f64::from(k) >= 10.0 * from_s { 0.1 * speed_mps } else { 0.0 };
            while let Some(&(x_m, y_m)) = stops.get(next).filter(|_| left_m > 0.0) {
                let (dx_m, dy_m) = (x_m - at.0, y_m - at.1);
                let off_m = dx_m.hypot(dy_m);
                if off_m <= left_m {
                    (at, left_m, next) = ((x_m, y_m), left_m - off_m, next + 1);
                } else {
                    at = (at.0 + dx_m / off_m * left_m, at.1 + dy_m / off_m * left_m);
                    left_m = 0.0;
                }
            }
            now
        })
        .collect()
}

/// People evenly along circles about the middle: how many, radius, speed.
pub(super) fn rings(seconds: f64, rings: &[(u32, f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let ring = |&(people, radius_m, speed_mps): &(u32, f64, f64)| {
        (0..people).map(move |person| {
            let first = TAU / f64::from(people) * f64::from(person) + 0.3;
            (0..=(10.0 * seconds) as u32)
                .map(|k| first + speed_mps * 0.1 * f64::from(k) / radius_m)
                .map(|angle| (radius_m * angle.cos(), radius_m * angle.sin()))
                .collect()
        })
    };
    rings.iter().flat_map(ring).collect()
}

/// `t_s,id,x_m,y_m`.
pub(super) fn table(people: &[Vec<(f64, f64)>]) -> String {
    let mut text = "t_s,id,x_m,y_m\n".to_owned();
    for k in 0..people.first().map_or(0, Vec::len) {
        for (id, way) in people.iter().enumerate() {
            let _ = writeln!(text, "{:.1},{id},{:.4},{:.4}", 0.1 * k as f64, way[k].0, way[k].1);
        }
    }
    text
}
