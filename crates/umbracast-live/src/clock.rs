//! The host's time of day, which does not step while the program runs.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Read from the system once, then carried on by the monotonic clock: a time of day that somebody sets while the
/// program runs moves no packet.
#[derive(Debug, Clone, Copy)]
pub struct HostClock {
    start: Instant,
    start_ns: i64,
}

impl HostClock {
    /// Reads the time of day.
    #[expect(clippy::disallowed_methods, reason = "what is live has a clock, and this is it")]
    pub fn start() -> Self {
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
        Self { start: Instant::now(), start_ns: since_epoch.as_nanos() as i64 }
    }

    /// Nanoseconds since 1970.
    pub fn now_ns(&self) -> i64 {
        self.start_ns + self.start.elapsed().as_nanos() as i64
    }

    /// Waits until then; at once where that has passed.
    pub fn sleep_until(&self, time_ns: i64) {
        let left_ns = time_ns - self.now_ns();
        if left_ns > 0 {
            std::thread::sleep(Duration::from_nanos(left_ns as u64));
        }
    }
}
