//! The gait phases of the samples.

use std::f64::consts::{PI, TAU};

use crate::gait::Gait;

/// Quantiles of the phase of a gait.
#[derive(Debug, Clone)]
pub(super) struct Phases {
    first_rad: f64,
    /// Share of the phases up to each of so many equal steps of a turn, the first from opposite the likeliest phase.
    shares: [f64; PHASES],
}

const PHASES: usize = 48;

impl Phases {
    /// Of a von Mises distribution.
    pub(super) fn new(gait: &Gait) -> Self {
        let width_rad = TAU / PHASES as f64;
        let densities: [f64; PHASES] = std::array::from_fn(|i| {
            let off_rad = (i as f64 + 0.5) * width_rad - PI;
            (gait.concentration * (off_rad.cos() - 1.0)).exp()
        });
        let total: f64 = densities.iter().sum();
        let mut sum = 0.0;
        let shares = densities.map(|density| {
            sum += density / total;
            sum
        });
        Self { first_rad: gait.phase_rad - PI, shares }
    }

    /// The phase below which a share of them lies.
    #[cfg(test)]
    pub(super) fn at(&self, share: f64) -> f64 {
        let i = self.shares.partition_point(|&up_to| up_to < share).min(PHASES - 1);
        self.within(i, share)
    }

    /// The same for the middles of n equal shares, in their order.
    pub(super) fn even(&self, n: usize) -> impl Iterator<Item = f64> {
        let mut i = 0;
        (0..n).map(move |k| {
            let share = (k as f64 + 0.5) / n as f64;
            while i < PHASES - 1 && self.shares[i] < share {
                i += 1;
            }
            self.within(i, share)
        })
    }

    fn within(&self, i: usize, share: f64) -> f64 {
        let below = if i == 0 { 0.0 } else { self.shares[i - 1] };
        let within = (share - below) / (self.shares[i] - below).max(f64::MIN_POSITIVE);
        self.first_rad + TAU / PHASES as f64 * (i as f64 + within)
    }
}
