//! Converts a sensor's own clock to the time of the frames.

use crate::STEP_NS;
use crate::site::TimeSource;

/// A clock that the time of reception puts right runs no faster than this against it: crystals err by 50 ppm, two of them
/// by 100.
const SLOWER: i64 = 10_000;
/// A packet that was under way for a shorter time than any before puts the clock back, but so slowly that columns stay
/// apart: a hundredth.
const FASTER: i64 = 100;
/// A clock that runs on is believed against the time of reception for so long: packets wait that long when a host stands
/// still.
const WAIT_NS: i64 = 10 * STEP_NS;

/// Where the packets so far put the time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Now {
    /// Of the packet taken last whose clock did not jump.
    pub time_ns: i64,
    received_ns: i64,
    /// From its time to its reception, of the packet that came soonest: [`SLOWER`] lets it be forgotten.
    soonest_ns: i64,
}

impl Now {
    /// After a packet of this time.
    pub fn after(before: Option<Self>, time_ns: i64, received_ns: i64) -> Self {
        let took_ns = received_ns.saturating_sub(time_ns);
        let soonest_ns = before.map_or(took_ns, |now| {
            let passed_ns = received_ns.saturating_sub(now.received_ns).max(0);
            now.soonest_ns.saturating_add(passed_ns / SLOWER).min(took_ns)
        });
        Self { time_ns, received_ns, soonest_ns }
    }

    /// The time of a packet that was under way for as long as the last one.
    fn expected_ns(self, received_ns: i64) -> i64 {
        self.time_ns.saturating_add(received_ns.saturating_sub(self.received_ns).max(0))
    }

    /// The time of a packet that was under way for as long as the one that came soonest.
    fn prompt_ns(self, received_ns: i64) -> i64 {
        received_ns.saturating_sub(self.soonest_ns)
    }
}

/// One sensor's clock.
#[derive(Debug)]
pub(super) struct Clock {
    source: TimeSource,
    /// From its own time to that of the frames.
    pub shift_ns: i64,
    /// Its latest column, in the time of the frames.
    pub newest_ns: Option<i64>,
}

impl Clock {
    pub fn new(source: TimeSource) -> Self {
        Self { source, shift_ns: 0, newest_ns: None }
    }

    /// The shift for a packet whose first and last column this clock puts at `own_ns`, and whether the clock jumped.
    /// `now` is of the packet before, of any sensor; `shared_shift_ns` that of the clock that sensors share.
    ///
    /// A host that stood still receives at once what waited for it, and what did not find room is lost: the first packet after
    /// the gap is as prompt as any before it stood still. Its clock did not jump.
    pub fn settle(
        &self,
        own_ns: (i64, i64),
        received_ns: i64,
        now: Option<Now>,
        shared_shift_ns: &mut i64,
    ) -> (i64, bool) {
        let (first_ns, last_ns) = own_ns;
        let time_ns = first_ns.saturating_add(self.shift_ns);
        let runs_on = self.newest_ns.is_some_and(|newest_ns| near(time_ns, newest_ns));
        if self.source == TimeSource::Arrival {
            return self.of_arrival(last_ns, received_ns, runs_on);
        }
        let Some(now) = now else { return (0, false) };
        let expected_ns = now.expected_ns(received_ns);
        let shared = self.source == TimeSource::Ptp;
        let catches_up = time_ns > now.time_ns && near(time_ns, now.prompt_ns(received_ns));
        if runs_on || near(time_ns, expected_ns) || catches_up {
            (self.shift_ns, false)
        } else if shared && near(first_ns.saturating_add(*shared_shift_ns), expected_ns) {
            (*shared_shift_ns, true)
        } else if near(first_ns, expected_ns) {
            (0, true)
        } else {
            let shift_ns = expected_ns.saturating_sub(first_ns);
            if shared {
                *shared_shift_ns = shift_ns;
            }
            (shift_ns, true)
        }
    }

    /// The shift that lets the last column fire at reception, of the packet that came soonest: what came later was under
    /// way for longer.
    fn of_arrival(&self, last_ns: i64, received_ns: i64, runs_on: bool) -> (i64, bool) {
        let wanted_ns = received_ns.saturating_sub(last_ns);
        let Some(newest_ns) = self.newest_ns else { return (wanted_ns, false) };
        let later_ns = wanted_ns.saturating_sub(self.shift_ns);
        let most_ns = if runs_on { WAIT_NS } else { STEP_NS };
        if later_ns.saturating_abs() > most_ns {
            return (wanted_ns, true);
        }
        let passed_ns = last_ns.saturating_add(self.shift_ns).saturating_sub(newest_ns).max(0);
        (self.shift_ns.saturating_add(later_ns.clamp(-passed_ns / FASTER, passed_ns / SLOWER)), false)
    }
}

/// Within a frame's length.
pub(super) fn near(a_ns: i64, b_ns: i64) -> bool {
    a_ns.saturating_sub(b_ns).unsigned_abs() <= STEP_NS.unsigned_abs()
}
