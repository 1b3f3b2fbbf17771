//! One row of a file of recorded people, and its cells: numbers, rates, and errors that name the line.

use umbracast::Error;

/// One row, whatever the format.
pub struct Row {
    pub line: usize,
    pub id: i64,
    /// Seconds, or a frame number still to be divided by the rate.
    pub time: f64,
    pub x_m: f64,
    pub y_m: f64,
    pub height_m: Option<f64>,
}

pub fn at_line(line: usize, story: impl std::fmt::Display) -> Error {
    Error::new(format!("line {line}: {story}"))
}

/// A finite number.
pub fn number(text: &str, what: &str, line: usize) -> Result<f64, Error> {
    let value = text.trim().parse().ok().filter(|v: &f64| v.is_finite());
    value.ok_or_else(|| at_line(line, format!("{what}: expected a number, found {text:?}")))
}

/// A whole number, which some programs write with a decimal point.
pub fn whole(text: &str, what: &str, line: usize) -> Result<i64, Error> {
    let value = number(text, what, line)?;
    // Beyond 2^53 neighbours are no longer told apart.
    if value.fract() != 0.0 || value.abs() > 9.0e15 {
        return Err(at_line(line, format!("{what}: expected a whole number, found {text:?}")));
    }
    Ok(value as i64)
}

/// A rate that can divide.
pub fn rate(fps: f64, place: &str) -> Result<f64, Error> {
    if fps.is_finite() && fps > 0.0 {
        return Ok(fps);
    }
    Err(Error::new(format!("{place}: expected frames per second above 0, found {fps}")))
}

pub fn missing_rate(found: &str) -> Error {
    Error::new(format!("expected frames per second, found {found}: give them (--fps)"))
}

pub fn seconds(mut rows: Vec<Row>, fps: f64) -> Vec<Row> {
    rows.iter_mut().for_each(|row| row.time /= fps);
    rows
}

/// The beginning of a line, for an error.
pub fn shorten(line: &str) -> String {
    format!("{:?}", line.chars().take(60).collect::<String>())
}
