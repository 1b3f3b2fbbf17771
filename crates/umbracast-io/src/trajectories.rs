//! Files of recorded people: TrajNet++ ndjson, CSV, PeTrack text.
//!
//! The content determines the format: lines that begin with `{`, a header with commas, or else numbers.
//!
//! | format | rows | time |
//! |---|---|---|
//! | TrajNet++ | `{"track": {"f", "p", "x", "y"}}` | `fps` of the scenes is the rate of a person's rows, whatever the frame numbers step by |
//! | CSV | columns `t_s,id,x_m,y_m[,height_m]` in any order | `t_s` |
//! | CSV of PedPy and Madras | columns `frame,id,x/m,y/m[,z/m]` | the slope of `t/s`, which is rounded, over `frame`, or `fps` to be given |
//! | PeTrack | `id frame x y [z]`, blanks or tabs, `#` comments | `# framerate:` or `fps` to be given |

mod options;
mod cells;
mod tabular;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use umbracast::Error;

use cells::{Row, at_line, missing_rate, number, rate, seconds, shorten, whole};
pub use options::{Options, Unit};

/// Faster than people run: a wrong unit or rate.
const MOST_MPS: f64 = 12.0;
/// Shorter steps may be a tracker's jump, however fast: recordings at 25 Hz have some of 0.7 m.
const JUMP_M: f64 = 1.5;
/// Nobody is taller: a height in centimetres.
const TALLEST_M: f64 = 3.0;
/// Nobody is farther from the origin, metres: that of the far end of a map in UTM.
const FARTHEST_M: f64 = 1e7;
/// No time is later, seconds: three thousand years. Farther from 0 neighbours of a millisecond are no longer told apart.
const LATEST_S: f64 = 1e11;
/// Values of z that can be somebody's height; others are not read as such.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = 1.0..=2.3;

/// One recorded person.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedPerson {
    /// As in the file.
    pub id: i64,
    /// Time in seconds, x and y in metres; at least one, and times increase.
    pub samples: Vec<[f64; 3]>,
    /// Standing height where the file tells it.
    pub height_m: Option<f64>,
}

/// Reads a file of recorded people, in the order of their ids.
///
/// # Errors
/// A file that cannot be read, or as [`parse`], with its path.
pub fn read(path: &Path, options: Options) -> Result<Vec<RecordedPerson>, Error> {
    parse(&read_text(path)?, options, &path.display().to_string())
}

/// The same from text; `file` names it in errors.
///
/// # Errors
/// With file and line: a row that does not parse, two rows of one person at one time, a rate that is neither in
/// the file nor given; heights that nobody has and steps that nobody makes (a wrong unit or rate). Nobody at all.
pub fn parse(text: &str, options: Options, file: &str) -> Result<Vec<RecordedPerson>, Error> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let rows = match first_line(text) {
        None => return Err(Error::new(format!("{file}: expected rows of recorded people, found none"))),
        Some(line) if line.starts_with('{') => trajnet_rows(text, options),
        Some(line) if line.contains(',') => tabular::rows(text, options),
        Some(_) => petrack_rows(text, options),
    };
    let people = rows.and_then(people).map_err(|e| e.within(file))?;
    if people.is_empty() {
        return Err(Error::new(format!(
            "{file}: expected rows of recorded people below the header, found none"
        )));
    }
    Ok(people)
}

/// What of `options` the file has no use for, because it says so itself: a flag each, with the reason.
///
/// # Errors
/// A file that cannot be read.
pub fn without_effect(path: &Path, options: Options) -> Result<Vec<String>, Error> {
    let text = read_text(path)?;
    let first = first_line(&text).unwrap_or_default();
    let (has_times, in_metres) = match first {
        _ if first.starts_with('{') => (false, true),
        _ if first.contains(',') => (first.split(',').any(|column| column.trim() == "t_s"), true),
        _ => (false, false),
    };
    let mut told = Vec::new();
    if options.fps.is_some() && has_times {
        told.push(format!("--fps has no effect on {}: its column t_s gives the times", path.display()));
    }
    if options.unit.is_some() && in_metres {
        told.push(format!("--unit has no effect on {}: its format is in metres", path.display()));
    }
    Ok(told)
}

/// The first line that holds something.
fn first_line(text: &str) -> Option<&str> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'))
}

fn read_text(path: &Path) -> Result<String, Error> {
    let bytes = std::fs::read(path).map_err(|e| Error::new(format!("{}: {e}", path.display())))?;
    // Headers may hold Latin-1, where each byte is its code point; everything that is read is ASCII.
    Ok(match String::from_utf8(bytes) {
        Ok(text) => text,
        Err(e) => e.into_bytes().into_iter().map(char::from).collect(),
    })
}

#[derive(Deserialize)]
struct TrajnetLine {
    track: Option<TrajnetTrack>,
    scene: Option<TrajnetScene>,
}

#[derive(Deserialize)]
struct TrajnetTrack {
    f: i64,
    p: i64,
    x: f64,
    y: f64,
}

#[derive(Deserialize)]
struct TrajnetScene {
    fps: Option<f64>,
}

fn trajnet_rows(text: &str, options: Options) -> Result<Vec<Row>, Error> {
    let mut rows = Vec::new();
    let mut stated: Option<f64> = None;
    for (i, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let parsed: TrajnetLine = serde_json::from_str(line).map_err(|e| {
            at_line(i + 1, format!("expected a TrajNet++ scene or track, found {}: {e}", shorten(line)))
        })?;
        if let Some(track) = parsed.track {
            let (x_m, y_m) = (track.x, track.y);
            rows.push(Row { line: i + 1, id: track.p, time: track.f as f64, x_m, y_m, height_m: None });
        }
        let Some(fps) = parsed.scene.and_then(|scene| scene.fps) else { continue };
        if stated.is_some_and(|before| before != fps) {
            let before = stated.unwrap_or_default();
            let story = format!("expected the rate of the scenes before, {before}, found {fps}");
            return Err(at_line(i + 1, story));
        }
        stated = Some(fps);
    }
    let fps = options.fps.or(stated).ok_or_else(|| missing_rate("no scene with fps"))?;
    let step = frame_step(&rows).unwrap_or(1.0);
    Ok(seconds(rows, rate(fps, "fps")? * step))
}

/// By how much the frame number grows from row to row of a person: the commonest value.
fn frame_step(rows: &[Row]) -> Option<f64> {
    let mut frames: BTreeMap<i64, Vec<i64>> = BTreeMap::new();
    for row in rows {
        frames.entry(row.id).or_default().push(row.time as i64);
    }
    let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
    for of_person in frames.values_mut() {
        of_person.sort_unstable();
        for pair in of_person.windows(2).filter(|pair| pair[1] > pair[0]) {
            *counts.entry(pair[1] - pair[0]).or_default() += 1;
        }
    }
    let commonest = counts.into_iter().max_by_key(|&(step, count)| (count, std::cmp::Reverse(step)))?;
    Some(commonest.0 as f64)
}

fn petrack_rows(text: &str, options: Options) -> Result<Vec<Row>, Error> {
    let (mut fps, mut unit) = (options.fps, options.unit);
    let mut rows = Vec::new();
    for (line, text) in text.lines().enumerate().map(|(i, text)| (i + 1, text.trim())) {
        if let Some(comment) = text.strip_prefix('#').map(str::trim) {
            if let Some(stated) = comment.strip_prefix("framerate:") {
                let value = stated.trim().trim_end_matches("fps");
                fps = fps.or(Some(number(value, "framerate", line)?));
            }
            let units = [("x/cm", Unit::Centimetre), ("x/m", Unit::Metre)];
            let stated = units.iter().find(|(name, _)| comment.split_whitespace().any(|word| word == *name));
            unit = unit.or(stated.map(|&(_, unit)| unit));
            continue;
        }
        if text.is_empty() {
            continue;
        }
        let cells: Vec<&str> = text.split_whitespace().collect();
        if !(4..=5).contains(&cells.len()) {
            return Err(at_line(line, format!("expected `id frame x y [z]`, found {}", shorten(text))));
        }
        let height_m = match cells.get(4) {
            Some(cell) => Some(number(cell, "z", line)?),
            None => None,
        };
        rows.push(Row {
            line,
            id: whole(cells[0], "id", line)?,
            time: whole(cells[1], "frame", line)? as f64,
            x_m: number(cells[2], "x", line)?,
            y_m: number(cells[3], "y", line)?,
            height_m,
        });
    }
    // The unit may stand after rows have begun.
    let scale = unit.unwrap_or(Unit::Metre).metres();
    for row in &mut rows {
        row.x_m *= scale;
        row.y_m *= scale;
        row.height_m = row.height_m.map(|z| z * scale);
    }
    let fps = fps.ok_or_else(|| missing_rate("no `# framerate:` line"))?;
    Ok(seconds(rows, rate(fps, "framerate")?))
}

/// Sorts rows by person and time.
fn people(mut rows: Vec<Row>) -> Result<Vec<RecordedPerson>, Error> {
    rows.sort_by(|a, b| (a.id, a.time).partial_cmp(&(b.id, b.time)).unwrap_or(std::cmp::Ordering::Equal));
    // The same row twice says nothing new: scenes of TrajNet++ overlap.
    rows.dedup_by(|b, a| (a.id, a.time, a.x_m, a.y_m) == (b.id, b.time, b.x_m, b.y_m));
    let mut people = Vec::new();
    for of_person in rows.chunk_by(|a, b| a.id == b.id) {
        if let Some(pair) = of_person.windows(2).find(|pair| pair[0].time == pair[1].time) {
            let (id, time, first) = (pair[0].id, pair[0].time, pair[0].line);
            let story =
                format!("expected one place of person {id} at {time} s, found another in line {first}");
            return Err(at_line(pair[1].line, story));
        }
        plausible(of_person)?;
        let mut heights: Vec<f64> = of_person.iter().filter_map(|row| row.height_m).collect();
        heights.sort_by(f64::total_cmp);
        // A head's z sways with the steps; its middle is the person's.
        let middle = heights.get(heights.len() / 2).copied();
        people.push(RecordedPerson {
            id: of_person[0].id,
            samples: of_person.iter().map(|row| [row.time, row.x_m, row.y_m]).collect(),
            height_m: middle.filter(|height| HEIGHTS_M.contains(height)),
        });
    }
    Ok(people)
}

/// The middle of the area that recorded people walk on, metres; `None` without people.
pub fn middle_m(people: &[RecordedPerson]) -> Option<[f64; 2]> {
    let along = |axis: usize| {
        let places = people.iter().flat_map(|person| person.samples.iter().map(move |sample| sample[axis]));
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let middle = [along(1), along(2)].map(|(low, high)| 0.5 * (low + high));
    middle.iter().all(|m| m.is_finite()).then_some(middle)
}

/// Moves everybody.
pub fn shift(people: &mut [RecordedPerson], by_m: [f64; 2]) {
    for sample in people.iter_mut().flat_map(|person| &mut person.samples) {
        sample[1] += by_m[0];
        sample[2] += by_m[1];
    }
}

/// Keeps the middle `seconds` of a recording that is longer, and who is there then.
pub fn keep_middle(people: &mut Vec<RecordedPerson>, seconds: f64) {
    let times = || people.iter().flat_map(|person| person.samples.iter().map(|sample| sample[0]));
    let (first_s, last_s) =
        (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
    let spare_s = (0.5 * (last_s - first_s - seconds)).max(0.0);
    // A microsecond of room: frame times are rounded.
    let kept = first_s + spare_s - 1e-6..=last_s - spare_s + 1e-6;
    for person in people.iter_mut() {
        person.samples.retain(|sample| kept.contains(&sample[0]));
    }
    people.retain(|person| !person.samples.is_empty());
}

/// A wrong unit or rate shows in heights and speeds, places and times.
fn plausible(of_person: &[Row]) -> Result<(), Error> {
    let is_near = |value: f64, most: f64| value.abs() <= most;
    let is_here = |row: &&Row| {
        is_near(row.x_m, FARTHEST_M) && is_near(row.y_m, FARTHEST_M) && is_near(row.time, LATEST_S)
    };
    if let Some(row) = of_person.iter().find(|row| !is_here(row)) {
        let Row { line, time, x_m, y_m, .. } = *row;
        let story = format!(
            "expected places up to {FARTHEST_M} m and times up to {LATEST_S} s from 0, found {x_m} m, {y_m} m at {time} s"
        );
        return Err(at_line(line, story));
    }
    let giant = |row: &Row| row.height_m.filter(|height_m| *height_m > TALLEST_M).map(|h| (row.line, h));
    if let Some((line, height_m)) = of_person.iter().find_map(giant) {
        let story = format!(
            "height: expected metres, {TALLEST_M} at most, found {height_m}: centimetres? (PeTrack text: --unit cm)"
        );
        return Err(at_line(line, story));
    }
    let step = |s: &[Row]| ((s[1].x_m - s[0].x_m).hypot(s[1].y_m - s[0].y_m), s[1].time - s[0].time);
    let too_fast = |s: &&[Row]| {
        let (step_m, step_s) = step(s);
        step_m > JUMP_M && step_m > MOST_MPS * step_s
    };
    let Some(pair) = of_person.windows(2).find(too_fast) else { return Ok(()) };
    let ((step_m, step_s), id) = (step(pair), pair[1].id);
    Err(at_line(
        pair[1].line,
        format!(
            "expected people on foot, up to {MOST_MPS} m/s, found {:.0} m/s of person {id}: {step_m:.1} m in \
             {step_s:.3} s since line {}; give the unit (--unit cm) or the rate (--fps)",
            step_m / step_s,
            pair[0].line
        ),
    ))
}
