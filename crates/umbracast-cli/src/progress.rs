//! Progress bars on stderr, only where somebody looks.

use indicatif::{ProgressBar, ProgressStyle};

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
