//! Stage 3: which links will be blocked by a body (paper, section IV-C).

pub mod body_model;
pub mod body;
pub mod algorithm1;
mod draws;
mod steps;
pub mod numbers;
pub mod probability;
pub mod caster;

pub use body_model::BodyModel;
pub use caster::Caster;
pub use numbers::Numbers;

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
    /// 10, 50 and 90 % quantiles of the time until a link in sight now is blocked, seconds, in whole steps. `None`
    /// where it lies beyond the last step, where the link is blocked now, and where the method is binary.
    pub onset_s: [Option<f64>; 3],
    /// The same of the time until the blockage is over: the one that is, or the first that comes. `None` as well where
    /// none comes with a chance of 10 % or more.
    pub duration_s: [Option<f64>; 3],
}
