//! Signals: Ctrl-C and SIGTERM ask for a clean end, the second one ends at once; SIGHUP asks to read the site file
//! again, if there is one.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use umbracast::Error;

/// True once somebody asked for the end.
pub fn asked_to_end() -> Result<Arc<AtomicBool>, Error> {
    let asked = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // Who asks twice does not want to wait: this comes first, and does nothing the first time.
        flag::register_conditional_shutdown(signal, 130, asked.clone())
            .and_then(|_| flag::register(signal, asked.clone()))
            .map_err(|e| Error::new(format!("signal {signal}: {e}")))?;
    }
    Ok(asked)
}

/// True when somebody asked for the site file to be read again: whoever does so sets it to false. Never where the system
/// has no such signal.
pub fn asked_to_read_again() -> Result<Arc<AtomicBool>, Error> {
    let asked = Arc::new(AtomicBool::new(false));
    #[cfg(unix)]
    flag::register(signal_hook::consts::SIGHUP, asked.clone())
        .map_err(|e| Error::new(format!("SIGHUP: {e}")))?;
    Ok(asked)
}
