//! What goes to stdout. A reader that goes away (`| head`) ends the command quietly.

use std::io::{ErrorKind, Write};
use std::sync::{Mutex, PoisonError};

use umbracast_live::HostClock;
use umbracast_live::log::{Event, Form, Log};

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

/// What the user should know before the result is used: to stderr.
pub fn caution(caution: &str) {
    eprintln!("umbracast: caution: {caution}");
}

/// Writes a line.
pub fn line(line: impl std::fmt::Display) {
    text(&format!("{line}\n"));
}

/// Tells events of a thread to stderr, the same one not too often.
pub fn events(form: Form, quiet: bool, clock: HostClock) -> impl Fn(Event) + Send + 'static {
    let log = Mutex::new(Log::new(form));
    move |event| {
        let mut log = log.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(line) = log.line(&event, clock.now_ns()).filter(|_| !quiet) {
            eprintln!("{line}");
        }
    }
}
