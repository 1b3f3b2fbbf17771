//! Progress on stderr: bars on a terminal, lines in a log.

use std::sync::Mutex;

use indicatif::{ProgressBar, ProgressStyle};

use crate::run_json::Stopwatch;

/// A bar of `length` steps; hidden with `--quiet` and where stderr is not a terminal.
pub fn bar(length: u64, what: &str, quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg:24} [{bar:32}] {pos}/{len} {elapsed_precise} left {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("=> ");
    ProgressBar::new(length).with_style(style).with_message(what.to_owned())
}

/// Of a run of many scenes: how many are done and how long the others will take. A bar on a terminal; elsewhere
/// a line after the first scene and after each twentieth of them.
pub struct SceneClock {
    bar: ProgressBar,
    watch: Stopwatch,
    scenes: u64,
    log: bool,
    done: Mutex<u64>,
}

impl SceneClock {
    /// Starts now.
    pub fn start(scenes: usize, quiet: bool) -> Self {
        let bar = bar(scenes as u64, "scenes", quiet);
        let log = !quiet && bar.is_hidden();
        Self { bar, watch: Stopwatch::start(), scenes: scenes as u64, log, done: Mutex::new(0) }
    }

    /// One more scene is done; from any thread.
    pub fn one_done(&self) {
        self.bar.inc(1);
        let mut done = self.done.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        *done += 1;
        if self.log && (*done == 1 || *done * 20 / self.scenes > (*done - 1) * 20 / self.scenes) {
            let left_s = self.watch.seconds() / *done as f64 * (self.scenes - *done) as f64;
            eprintln!("{done} of {} scenes done, {} left", self.scenes, duration(left_s));
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// As one would say it: `45 s`, `12 min`, `1 h 05 min`.
fn duration(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round() as u64;
    match minutes {
        _ if seconds < 90.0 => format!("{seconds:.0} s"),
        0..60 => format!("{minutes} min"),
        _ => format!("{} h {:02} min", minutes / 60, minutes % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_read_as_one_says_them() {
        let said = [0.4, 89.0, 90.0, 3_580.0, 3_900.0].map(duration);
        assert_eq!(said, ["0 s", "89 s", "2 min", "1 h 00 min", "1 h 05 min"]);
    }
}
