//! Real recordings are outside the repository, where `UMBRACAST_DATA` points. A test without them passes and says so
//! on the terminal.

use std::io::Write;
use std::path::{Path, PathBuf};

/// A file or folder of the real data. Where it is not there, a line on the terminal names the test that is skipped.
pub fn real_data(path: &str) -> Option<PathBuf> {
    let found = std::env::var_os("UMBRACAST_DATA").map(|root| Path::new(&root).join(path));
    let found = found.filter(|found| found.exists());
    if found.is_none() {
        let test = std::thread::current();
        let test = test.name().unwrap_or("a test");
        // Written to the stream itself: what `eprintln!` says in a test that passes is kept from the reader.
        let _ = writeln!(std::io::stderr(), "skipped: {test}: UMBRACAST_DATA holds no {path}");
    }
    found
}
