//! From samples of a link, counted or weighed, to what is told of it.

use super::Chance;
use super::trajectories::MOMENTS;
use crate::{STEP_S, STEPS};

/// Quantiles of times that are reported.
const LEVELS: [f64; 3] = [0.1, 0.5, 0.9];

/// What the samples say of one link.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Chances {
    /// That it is blocked now.
    pub p_now: f64,
    /// Whether that is likely enough to count as blocked now.
    pub blocked_now: bool,
    /// Index w - 1: that it is blocked at any of steps 1..=w.
    pub p: [f64; STEPS],
    /// Quantiles of the time until it is blocked, over the samples in which it is in sight now; of a link that does not
    /// count as blocked now.
    pub onset_s: [Option<f64>; 3],
    /// Quantiles of the time until it is clear. Of a link that counts as blocked now over the samples in which it is;
    /// else, where there is an onset, over those in which it is in sight now and will be blocked.
    pub duration_s: [Option<f64>; 3],
    /// That the owner's own body blocks it; `None` where the UE is on the axis.
    pub own: Option<Chance>,
    /// That the hall does.
    pub hall: Option<Chance>,
    /// That others, the owner or the hall do.
    pub any: Option<Chance>,
}

/// Of how many samples what first happens at each step, or how much they weigh.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    /// Blocked now, step 0.
    pub(super) now: f64,
    pub(super) blocked_now: bool,
    /// Blocked for the first time after now.
    pub(super) met: [f64; MOMENTS],
    /// The same of those in sight now.
    pub(super) onset: [f64; MOMENTS],
    /// In sight again.
    pub(super) over: [f64; MOMENTS],
}

impl Counts {
    pub(super) fn chances(&self, total: f64) -> Chances {
        let share = |count: f64| count / total;
        let coming: f64 = self.onset.iter().sum();
        let onset_s = quantiles_s(&self.onset, total - self.now);
        let over_s = |of: f64| quantiles_s(&self.over, of);
        Chances {
            p_now: share(self.now),
            blocked_now: self.blocked_now,
            p: std::array::from_fn(|w| share(self.met[1..=w + 1].iter().sum())),
            onset_s: if self.blocked_now { [None; 3] } else { onset_s },
            duration_s: match (self.blocked_now, onset_s[0]) {
                (true, _) => over_s(self.now),
                (false, Some(_)) => over_s(coming),
                (false, None) => [None; 3],
            },
            own: None,
            hall: None,
            any: None,
        }
    }
}

/// Of times given by how many come at each step; `None` where a quantile lies beyond the last step, or over nothing.
pub(super) fn quantiles_s(counts: &[f64; MOMENTS], total: f64) -> [Option<f64>; 3] {
    LEVELS.map(|level| {
        let mut sum = 0.0;
        let reached = |step: &usize| {
            sum += counts[*step];
            sum > 0.0 && sum >= level * total
        };
        (0..MOMENTS).find(reached).map(|step| step as f64 * STEP_S)
    })
}
