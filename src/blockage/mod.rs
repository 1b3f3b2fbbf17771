//! Stage 3: which links will be blocked by a body (paper, section IV-C).

pub mod body;
pub mod algorithm1;
pub mod probability;
pub mod caster;

pub use caster::Caster;

use crate::STEPS;

/// One link, access point to person, now and in every window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blockage {
    /// Which access point of the site.
    pub access_point: usize,
    /// The person.
    pub track: u64,
    /// Blocked at the frame's instant.
    pub blocked_now: bool,
    /// The same as a probability.
    pub p_now: f64,
    /// Index w - 1: blocked at any of steps 1..=w.
    pub blocked: [bool; STEPS],
    /// The same as a probability; never falls with w. 0 or 1 where the method is binary.
    pub p: [f64; STEPS],
}
