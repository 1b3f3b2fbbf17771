//! Planning a hall before anybody hangs a sensor.
//!
//! ```text
//! site -> Floor (cells)  -> returns of each sensor   -> how long a person is seen
//!                        -> links of each access point -> how long a link is blocked
//!      candidates        -> values -> the best places (exact, or greedy with its bound)
//! ```
//!
//! The people of a plan are nobody in particular: so many stand and walk anywhere on the floor. Who walks between two
//! places at some moment follows from their density alone. The page shows what is computed here ([`answer`]).

mod floor;
mod crowd;
mod rays;
mod map;
mod candidates;
mod choose;
mod best;
mod site_file;
mod questions;

pub use best::{Best, Placed, Wanted, best, versus_random};
pub use choose::{Choice, EXACT_MOST, choose};
pub use crowd::Crowd;
pub use floor::Floor;
pub use map::{Map, map};
pub use questions::{Plan, answer};
pub use rays::returns;
pub use site_file::write_into;

/// With fewer returns a person is missed more often than not, as in `umbracast coverage`.
pub const SEEN_RETURNS: f64 = 6.0;
