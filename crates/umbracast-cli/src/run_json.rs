//! `run.json`: times and machine, which differ between equal runs. Only this file of the command has a clock.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};
use umbracast::Error;

use crate::args::Common;
use crate::{say, setup};

/// Wall-clock time since its start.
#[derive(Debug, Clone, Copy)]
pub struct Stopwatch(Instant);

impl Stopwatch {
    /// Starts now.
    #[expect(clippy::disallowed_methods, reason = "the command measures its own speed")]
    pub fn start() -> Self {
        Self(Instant::now())
    }

    /// Seconds since the start.
    pub fn seconds(&self) -> f64 {
        self.elapsed().as_secs_f64()
    }

    /// Time since the start.
    pub fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}

/// Ascending frame numbers, kept and written as runs: `0-299,301`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Ranges(Vec<(u64, u64)>);

impl Ranges {
    /// Adds the next one.
    pub fn push(&mut self, frame: u64) {
        match self.0.last_mut() {
            Some((_, last)) if last.checked_add(1) == Some(frame) => *last = frame,
            _ => self.0.push((frame, frame)),
        }
    }

    /// How many there are.
    pub fn len(&self) -> u64 {
        self.0.iter().map(|(first, last)| last - first + 1).sum()
    }

    /// True before the first one.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl std::fmt::Display for Ranges {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (place, (first, last)) in self.0.iter().enumerate() {
            let comma = if place == 0 { "" } else { "," };
            match first == last {
                true => write!(f, "{comma}{first}")?,
                false => write!(f, "{comma}{first}-{last}")?,
            }
        }
        Ok(())
    }
}

/// The frames of one scene as `run.json` has them: [`Ranges`], or each number as older runs wrote them.
#[derive(Debug, serde::Deserialize)]
#[serde(untagged)]
pub enum Frames {
    /// As [`Ranges`] writes them.
    Ranges(String),
    /// One by one.
    Each(Vec<u64>),
}

impl Frames {
    /// Every number.
    ///
    /// # Errors
    /// Text that is no range, with it.
    pub fn numbers(&self) -> Result<BTreeSet<u64>, Error> {
        let text = match self {
            Self::Each(numbers) => return Ok(numbers.iter().copied().collect()),
            Self::Ranges(text) => text,
        };
        let mut numbers = BTreeSet::new();
        for run in text.split(',').filter(|run| !run.is_empty()) {
            let (first, last) = run.split_once('-').unwrap_or((run, run));
            let (Ok(first), Ok(last)) = (first.parse(), last.parse::<u64>()) else {
                let story = format!("frame_numbers: expected ranges such as 0-299,301, found {run:?}");
                return Err(Error::new(story));
            };
            numbers.extend(first..=last);
        }
        Ok(numbers)
    }
}

/// What a command says of its run.
#[derive(Debug)]
pub struct RunJson(Map<String, Value>);

impl RunJson {
    /// Begins with the command, the version, the machine and the time taken.
    pub fn new(command: &str, watch: &Stopwatch) -> Self {
        let cores = std::thread::available_parallelism().map_or(0, usize::from);
        let mut map = Map::new();
        for (key, value) in [
            ("command", json!(command)),
            ("version", json!(env!("CARGO_PKG_VERSION"))),
            ("wall_s", json!(watch.seconds())),
            ("cores", json!(cores)),
            ("machine", json!(format!("{} {}", std::env::consts::OS, std::env::consts::ARCH))),
        ] {
            map.insert(key.to_owned(), value);
        }
        Self(map)
    }

    /// Adds a value.
    #[must_use]
    pub fn with(mut self, key: &str, value: impl serde::Serialize) -> Self {
        self.0.insert(key.to_owned(), json!(value));
        self
    }

    /// Writes `run.json` into a folder.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        setup::write(&folder.join("run.json"), format!("{:#}\n", Value::Object(self.0.clone())))
    }

    /// To stdout: the JSON with `--json`, else `text`.
    pub fn print(&self, common: &Common, text: &str) {
        match common.json {
            true => say::line(format_args!("{:#}", Value::Object(self.0.clone()))),
            false => say::line(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_written_as_ranges_and_read_in_both_forms() {
        let frames = [0, 1, 2, 5, 7, 8];
        let mut ranges = Ranges::default();
        assert_eq!((ranges.to_string().as_str(), ranges.is_empty()), ("", true));
        frames.iter().for_each(|&frame| ranges.push(frame));
        assert_eq!((ranges.to_string().as_str(), ranges.is_empty()), ("0-2,5,7-8", false));
        for text in ["\"0-2,5,7-8\"", "[0, 1, 2, 5, 7, 8]"] {
            let read: Frames = serde_json::from_str(text).unwrap();
            assert!(read.numbers().unwrap().into_iter().eq(frames), "{text}");
        }
        let message = Frames::Ranges("0-x".to_owned()).numbers().unwrap_err().to_string();
        assert!(message.contains("expected ranges") && message.contains("0-x"), "{message}");
    }
}
