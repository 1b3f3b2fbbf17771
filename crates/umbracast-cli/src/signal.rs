//! Ctrl-C and SIGTERM: the first asks for a clean end.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use umbracast::Error;

/// True once somebody asked for the end.
pub fn asked_to_end() -> Result<Arc<AtomicBool>, Error> {
    let asked = Arc::new(AtomicBool::new(false));
    let shared = asked.clone();
    ctrlc::set_handler(move || {
        // Who asks twice does not want to wait.
        if shared.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(|e| Error::new(format!("signals: {e}")))?;
    Ok(asked)
}
