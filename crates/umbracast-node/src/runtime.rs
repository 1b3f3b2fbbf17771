//! Threads of Zenoh: so many that hosts which vanish stop nobody else.
//!
//! A host whose cable is pulled leaves a connection with data that nobody acknowledges. Zenoh closes it when it has been silent
//! for its lease, and asks the system to wait for the acknowledgment ("linger") for 10 s: a constant that is set when Zenoh is
//! built. The call that closes blocks its thread all that time. Zenoh has two threads that receive, so that two lost connections
//! stop everything that comes to a process. The sound way would be a close that does not wait; what can be set from outside
//! is the number of threads. Each that closes is one less, and the rest go on.

use std::env;

/// Zenoh reads it once, before its first session.
const VARIABLE: &str = "ZENOH_RUNTIME";
/// Receiving threads for as many connections as a host or a switch may take away within 10 s. `net` closes what could not be
/// sent, `acc` what was lost before it was accepted. A thread that does nothing costs no processor time, and some 20 kB.
const THREADS: &str = "(rx: (worker_threads: 32), net: (worker_threads: 8), acc: (worker_threads: 4))";

/// Sets the number of threads, unless it is set from outside. Before any session is opened.
///
/// # Safety
/// No other thread may run: it sets a variable of the environment, which another thread may read at that moment
/// ([`std::env::set_var`]).
pub unsafe fn widen() {
    if env::var_os(VARIABLE).is_none() {
        // SAFETY: whoever calls this has no other thread.
        unsafe { env::set_var(VARIABLE, THREADS) };
    }
}
