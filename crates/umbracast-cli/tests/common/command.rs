//! The command as tests run it, and what it records.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use umbracast::Error;
use umbracast_io::recording::{Entry, RecordingReader};

/// The command with arguments.
pub fn umbracast(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_umbracast"));
    command.args(arguments);
    command
}

/// Runs it to its end, which must be a good one.
pub fn done(arguments: &[&str]) {
    let output = umbracast(arguments).arg("--quiet").output().expect("starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Every message of a recording by topic, but for packets and what is said once at the beginning of a file.
#[allow(dead_code, reason = "the page's three hosts record nothing")]
pub fn results_in(file: &Path) -> BTreeMap<String, Vec<Vec<u8>>> {
    whole_results_in(file).expect("a recording")
}

/// The same of a file that may just have been begun: an error while nothing stands in it.
#[allow(dead_code, reason = "tests of files that are whole need the other one alone")]
pub fn whole_results_in(file: &Path) -> Result<BTreeMap<String, Vec<Vec<u8>>>, Error> {
    let mut reader = RecordingReader::open(file)?;
    let mut messages = BTreeMap::<_, Vec<_>>::new();
    while let Some(entry) = reader.next_entry()? {
        match entry {
            Entry::Other(topic, _, message) | Entry::Cloud(topic, message) if topic != "/tf_static" => {
                messages.entry(topic).or_default().push(message);
            }
            _ => {}
        }
    }
    Ok(messages)
}
