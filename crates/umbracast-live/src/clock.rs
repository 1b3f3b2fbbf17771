//! The host's time of day, which does not step while the program runs.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Read from the system once, then carried on by the monotonic clock: a time of day that somebody sets while the
/// program runs moves no packet.
#[derive(Debug, Clone, Copy)]
pub struct HostClock {
    start: Instant,
    start_ns: i64,
    rate: i64,
}

impl HostClock {
    /// Reads the time of day.
    pub fn start() -> Self {
        Self::faster(1)
    }

    /// The same, going on so many times as fast: for rehearsals whose hours shall not last as long.
    #[expect(clippy::disallowed_methods, reason = "what is live has a clock, and this is it")]
    pub fn faster(rate: u32) -> Self {
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
        let rate = i64::from(rate.max(1));
        Self { start: Instant::now(), start_ns: since_epoch.as_nanos() as i64, rate }
    }

    /// Nanoseconds since 1970.
    pub fn now_ns(&self) -> i64 {
        self.start_ns + self.start.elapsed().as_nanos() as i64 * self.rate
    }

    /// Waits until then; at once where that has passed.
    pub fn sleep_until(&self, time_ns: i64) {
        let left_ns = (time_ns - self.now_ns() + self.rate - 1) / self.rate;
        if left_ns > 0 {
            std::thread::sleep(Duration::from_nanos(left_ns as u64));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_faster_clock_lets_nobody_wait_as_long() {
        let (clock, host) = (HostClock::faster(100), HostClock::start());
        let from_ns = clock.now_ns();
        clock.sleep_until(from_ns + 1_000_000_000);
        assert!(clock.now_ns() - from_ns >= 1_000_000_000);
        assert!(host.now_ns() - from_ns < 1_000_000_000, "ten milliseconds were enough");
    }
}
