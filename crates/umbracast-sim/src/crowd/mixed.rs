//! The `mixed` crowd.

use super::{Crowd, Preset, circle_crossing};

/// People of the `mixed` preset. They walk as in `orca-03` until speeds, stops and groups of their own are in.
pub fn crowd(people: usize, radius_m: f64, seed: u64) -> Crowd {
    circle_crossing(Preset::Orca03, people, radius_m, seed)
}
