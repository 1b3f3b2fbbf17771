//! Umbracast live: the one place with sockets, threads and the time of day.
//!
//! ```text
//! sockets  -> packets -> assembler -> frames -> pipeline -> what was published -> page, events, metrics
//! (receive)              (frames)               (run)    \-> recorder           (serve)
//!                            \-> recorder (raw packets)
//! ```
//!
//! Every arrow is a [`queue::Queue`] of bounded length with a rule for when it is full. Before the pipeline the
//! newest frame replaces the oldest. The recorder delays no other thread. Losses are counted. The stages are those of
//! the runtime, called with the same frames as from a file, so a recording gives the same results again, to the byte.

pub mod clock;
pub mod queue;
pub mod latency;
pub mod warnings;
pub mod advice;
pub mod receive;
pub mod published;
pub mod whole;
pub mod recording;
pub mod record;
pub mod heard;
pub mod run;
pub mod log;
pub mod send;
pub mod check;
#[cfg(feature = "serve")]
pub mod serve;

pub use clock::HostClock;
pub use published::Published;
pub use run::{Live, Settings, Summary};
