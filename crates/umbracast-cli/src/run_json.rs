//! `run.json`: times and machine, which are not part of what equal runs have equal. The one place with a clock.

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
