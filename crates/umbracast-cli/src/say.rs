//! What goes to stdout. A reader that goes away (`| head`) ends the command quietly.

use std::io::{ErrorKind, Write};

/// Writes text as it is.
pub fn text(text: &str) {
    let mut stdout = std::io::stdout().lock();
    if let Err(error) = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush())
        && error.kind() == ErrorKind::BrokenPipe
    {
        std::process::exit(0);
    }
}

/// A word to the user that is no result: to stderr.
pub fn note(note: &str) {
    eprintln!("umbracast: note: {note}");
}

/// Writes a line.
pub fn line(line: impl std::fmt::Display) {
    text(&format!("{line}\n"));
}
