//! Quantiles of durations, in memory that does not grow.

use std::time::Duration;

/// Steps to a factor of ten: a quantile is right within 1 %.
const PER_DECADE: f64 = 232.0;
/// From a microsecond to a hundred seconds.
const DECADES: f64 = 8.0;

/// A histogram with steps of 1 %, from 1 us to 100 s.
#[derive(Debug, Clone)]
pub struct Latencies {
    counts: Vec<u64>,
    total: u64,
    sum: Duration,
    longest: Duration,
}

impl Default for Latencies {
    fn default() -> Self {
        let counts = vec![0; (PER_DECADE * DECADES) as usize + 1];
        Self { counts, total: 0, sum: Duration::ZERO, longest: Duration::ZERO }
    }
}

impl Latencies {
    /// Counts one.
    pub fn add(&mut self, took: Duration) {
        let step = (took.as_secs_f64() * 1e6).max(1.0).log10() * PER_DECADE;
        let last = self.counts.len() - 1;
        self.counts[(step as usize).min(last)] += 1;
        self.total += 1;
        self.sum += took;
        self.longest = self.longest.max(took);
    }

    /// How many were counted.
    pub fn count(&self) -> u64 {
        self.total
    }

    /// All of them together.
    pub fn sum(&self) -> Duration {
        self.sum
    }

    /// The longest.
    pub fn longest(&self) -> Duration {
        self.longest
    }

    /// The time within which that share of them lies; zero of nothing.
    pub fn quantile(&self, share: f64) -> Duration {
        let wanted = (share * self.total as f64).ceil().max(1.0) as u64;
        let mut counted = 0;
        for (step, count) in self.counts.iter().enumerate() {
            counted += count;
            if counted >= wanted && self.total > 0 {
                let upper = Duration::from_secs_f64(10_f64.powf((step + 1) as f64 / PER_DECADE) * 1e-6);
                return upper.min(self.longest);
            }
        }
        Duration::ZERO
    }

    /// The same in milliseconds.
    pub fn quantile_ms(&self, share: f64) -> f64 {
        self.quantile(share).as_nanos() as f64 / 1e6
    }

    /// How many took no longer than this, within the histogram's steps.
    pub fn within(&self, limit: Duration) -> u64 {
        let step = (limit.as_secs_f64() * 1e6).max(1.0).log10() * PER_DECADE;
        self.counts.iter().take(step.round() as usize).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_right_within_a_step() {
        let mut latencies = Latencies::default();
        (1..=1000).for_each(|i| latencies.add(Duration::from_micros(i * 10)));
        for (share, expected_us) in [(0.5, 5000.0), (0.99, 9900.0), (1.0, 10_000.0)] {
            let found_us = latencies.quantile(share).as_secs_f64() * 1e6;
            assert!((found_us / expected_us - 1.0).abs() < 0.011, "{share}: {found_us}");
        }
        assert_eq!((latencies.count(), latencies.longest()), (1000, Duration::from_millis(10)));
        assert!(latencies.within(Duration::from_millis(5)).abs_diff(500) <= 6);
    }

    #[test]
    fn nothing_and_the_extremes_have_their_place() {
        let mut latencies = Latencies::default();
        assert_eq!(latencies.quantile(0.5), Duration::ZERO);
        latencies.add(Duration::ZERO);
        latencies.add(Duration::from_secs(1000));
        assert_eq!(
            latencies.quantile(1.0),
            Duration::from_secs_f64(10_f64.powf((232.0 * 8.0 + 1.0) / 232.0) * 1e-6)
        );
    }
}
