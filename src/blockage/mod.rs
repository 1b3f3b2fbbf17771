//! Stage 3: which links will be blocked by a body (paper, section IV-C).

#[doc(hidden)] // The body's numbers, for their fit.
pub mod body_model;
#[doc(hidden)] // What a ray meets, for the fit, the ladder and the corpus of rays.
pub mod body;
#[doc(hidden)] // For the corpus of rays; `Caster` chooses by the config.
pub mod algorithm1;
pub(crate) mod lanes;
pub(crate) mod draws;
mod phases;
mod steps;
#[doc(hidden)] // What tests and ablations turn.
pub mod numbers;
pub(crate) mod spread;
mod figure;
pub(crate) mod trajectories;
mod glance;
mod shadows;
mod rays;
mod crossing;
mod things;
mod causes;
mod counts;
pub(crate) mod asker;
pub(crate) mod probability;
mod caster;

#[doc(hidden)] // For its fit.
pub use body_model::BodyModel;
pub use caster::Caster;
#[doc(hidden)] // For who draws bodies.
pub use figure::slices_of;
#[doc(hidden)] // What tests and ablations turn.
pub use numbers::Numbers;

// Of `core`, which has no clock: the runtime takes its time from the data.
use core::time::Duration;

use crate::{STEP_NS, STEPS};

/// One link, access point to person, now and in every window.
///
/// ```
/// use umbracast::blockage::Blockage;
///
/// /// The first window in which a link is more likely lost than not, seconds.
/// fn lost_within_s(link: &Blockage) -> Option<f64> {
///     link.p.iter().position(|p| *p > 0.5).map(|step| (step + 1) as f64 * umbracast::STEP_S)
/// }
/// # let link = Blockage {
/// #     access_point: 0, track: 7, blocked_now: false, p_now: 0.0, blocked: [false; 9],
/// #     p: [0.0, 0.1, 0.2, 0.6, 0.8, 0.9, 0.9, 0.9, 0.9], onset_s: [None; 3], duration_s: [None; 3],
/// #     own: None, hall: None, any: None,
/// # };
/// assert_eq!(lost_within_s(&link), Some(0.4));
/// ```
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
    /// Blocked by the owner's own body; what stands above is of others. `None` where the UE is on the body's axis, within
    /// it, and where the method knows others alone.
    pub own: Option<Chance>,
    /// The same by walls, pillars and furniture.
    pub hall: Option<Chance>,
    /// The same by others, the owner or the hall.
    pub any: Option<Chance>,
}

/// How likely a link is blocked by one cause, now and in every window.
///
/// ```
/// use umbracast::blockage::Chance;
///
/// let behind_a_pillar_soon = Chance { p_now: 0.0, p: [0.0, 0.2, 0.7, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0] };
/// assert!(behind_a_pillar_soon.p[2] > Chance::NONE.p[2]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chance {
    /// At the frame's instant.
    pub p_now: f64,
    /// Index w - 1: at any of steps 1..=w; never falls with w.
    pub p: [f64; STEPS],
}

impl Chance {
    /// Not at all.
    pub const NONE: Self = Self { p_now: 0.0, p: [0.0; STEPS] };
}

impl Blockage {
    /// The probability that the link is blocked within a time from now: that of the longest window that fits into
    /// `horizon`, rounded down to whole steps. Less than a step is now, and beyond the last step nothing more is known.
    ///
    /// ```
    /// use std::time::Duration;
    /// # let link = umbracast::blockage::Blockage {
    /// #     access_point: 0, track: 7, blocked_now: false, p_now: 0.05, blocked: [false; 9],
    /// #     p: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9], onset_s: [None; 3], duration_s: [None; 3],
    /// #     own: None, hall: None, any: None,
    /// # };
    /// assert_eq!(link.p_within(Duration::from_millis(300)), link.p[2]);
    /// assert_eq!(link.p_within(Duration::from_millis(399)), link.p[2]);
    /// assert_eq!(link.p_within(Duration::from_millis(99)), link.p_now);
    /// assert_eq!(link.p_within(Duration::from_secs(60)), link.p[8]);
    /// ```
    pub fn p_within(&self, horizon: Duration) -> f64 {
        let steps = (horizon.as_nanos() / STEP_NS.unsigned_abs() as u128).min(STEPS as u128) as usize;
        steps.checked_sub(1).map_or(self.p_now, |window| self.p[window])
    }
}
