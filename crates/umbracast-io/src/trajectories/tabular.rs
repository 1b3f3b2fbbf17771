//! Recorded people as CSV: columns found by name, with times or with frame numbers.

use csv::StringRecord;
use umbracast::Error;

use super::cells::{Row, at_line, missing_rate, number, rate, seconds, shorten, whole};
use super::options::Options;

/// The rows of either kind of columns.
pub fn rows(text: &str, options: Options) -> Result<Vec<Row>, Error> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let mut columns = StringRecord::new();
    let header_line = next_record(&mut reader, text, &mut columns)?;
    let column = |names: &[&str]| columns.iter().position(|column| names.contains(&column));
    let needed = |names: &[&str]| {
        let story = || {
            format!("expected the columns t_s,id,x_m,y_m[,height_m], found {}", shorten(&joined(&columns)))
        };
        column(names).ok_or_else(|| at_line(header_line.unwrap_or(1), story()))
    };
    let (id, x, y) = (needed(&["id"])?, needed(&["x_m", "x/m"])?, needed(&["y_m", "y/m"])?);
    let height = column(&["height_m", "z/m"]);
    let (time, rounded) = match (column(&["t_s"]), column(&["frame"])) {
        (Some(time), _) => (time, None),
        (None, Some(frame)) => (frame, column(&["t/s"])),
        (None, None) => (needed(&["t_s"])?, None),
    };

    let mut rows = Vec::new();
    let mut clock = Vec::new();
    let mut cells = StringRecord::new();
    while let Some(line) = next_record(&mut reader, text, &mut cells)? {
        if cells.len() != columns.len() {
            let (expected, found) = (columns.len(), cells.len());
            let row = shorten(&joined(&cells));
            return Err(at_line(line, format!("expected {expected} values, found {found}: {row}")));
        }
        let height_m = match height.map(|column| &cells[column]).filter(|cell| !cell.is_empty()) {
            Some(cell) => Some(number(cell, "height", line)?),
            None => None,
        };
        if let Some(rounded) = rounded {
            clock.push([number(&cells[time], "frame", line)?, number(&cells[rounded], "t/s", line)?]);
        }
        rows.push(Row {
            line,
            id: whole(&cells[id], "id", line)?,
            time: number(&cells[time], &columns[time], line)?,
            x_m: number(&cells[x], "x", line)?,
            y_m: number(&cells[y], "y", line)?,
            height_m,
        });
    }
    if &columns[time] == "t_s" {
        return Ok(rows);
    }
    let fps = options.fps.or_else(|| clock_rate(&clock));
    Ok(seconds(rows, rate(fps.ok_or_else(|| missing_rate("a column of frame numbers"))?, "fps")?))
}

/// The next record that is not blank, and the line of `text` it ends in; `None` after the last.
fn next_record(
    reader: &mut csv::Reader<&[u8]>,
    text: &str,
    record: &mut StringRecord,
) -> Result<Option<usize>, Error> {
    loop {
        let more = reader.read_record(record);
        // A record itself knows only where the comments and blank lines before it begin.
        let end = reader.position();
        let line = end.line() as usize - usize::from(text[..end.byte() as usize].ends_with('\n'));
        match more.map_err(|e| at_line(line, format!("expected CSV, found {e}")))? {
            false => return Ok(None),
            true if record.iter().all(str::is_empty) && record.len() == 1 => {}
            true => return Ok(Some(line)),
        }
    }
}

fn joined(record: &StringRecord) -> String {
    record.iter().collect::<Vec<_>>().join(",")
}

/// Frames a second from frame numbers beside times that are rounded to tenths: the slope of the line through
/// them, to the nearest whole rate where it is that near (cameras have whole ones).
fn clock_rate(clock: &[[f64; 2]]) -> Option<f64> {
    let n = clock.len() as f64;
    let mean = |k: usize| clock.iter().map(|pair| pair[k]).sum::<f64>() / n;
    let (frame, time) = (mean(0), mean(1));
    let along: f64 = clock.iter().map(|pair| (pair[0] - frame) * (pair[1] - time)).sum();
    let across: f64 = clock.iter().map(|pair| (pair[1] - time).powi(2)).sum();
    let spread: f64 = clock.iter().map(|pair| (pair[0] - frame).powi(2)).sum();
    // Over a second of frames or less, rounding to tenths hides the rate.
    let fps = (along > 0.0 && across / n > 0.1).then(|| spread / along)?;
    let whole = fps.round();
    Some(if whole > 0.0 && (fps / whole - 1.0).abs() < 0.01 { whole } else { fps })
}
