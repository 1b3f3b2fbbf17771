//! What time it is in a hall, by those who send to it. Pure: the caller gives the time of day.
//!
//! A frame's time is that of the sensors, which need not be this host's: a recording has times of years ago. Time goes on no faster
//! than this host's clock, though, and all senders of a hall agree. A message of another time is not believed, whoever
//! sends it: it would make frames of now look late. Where two times are told, the one counts that more sensors tell. This host's
//! clock is one vote more.

use std::collections::BTreeMap;

use umbracast::STEP_NS;

/// A message may be late by so much: frames wait for it or do not.
const LATE_NS: i64 = 1_000_000_000;
/// Who has been silent for so long has no vote, and another time that was told for so long may be the right one.
const SILENCE_NS: i64 = 1_000_000_000;
/// This host's clock votes for a time that is so near.
const NEAR_NS: i64 = 1_000_000_000;
/// Times that are told apart.
const TIMES_MAX: usize = 8;

/// Keeps the time of a hall.
#[derive(Debug)]
pub struct Timekeeper {
    tolerance_ns: i64,
    /// The first is the hall's.
    times: Vec<Time>,
}

/// A time that somebody tells.
#[derive(Debug)]
struct Time {
    /// The newest message's, and when it came.
    newest_ns: i64,
    at_ns: i64,
    since_ns: i64,
    heard_ns: i64,
    /// When each sensor told it last.
    sensors: BTreeMap<u32, i64>,
}

/// What becomes of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It is of the hall's time, or late.
    Believed,
    /// So it is, and the hall's time is another one from now on.
    Anew,
    /// It is so far ahead of the hall's time.
    Apart(i64),
}

impl Timekeeper {
    /// Senders' clocks may be so far apart: as long as frames wait for each other.
    pub fn new(tolerance_ns: i64) -> Self {
        Self { tolerance_ns: tolerance_ns.max(STEP_NS), times: Vec::new() }
    }

    /// A message of these sensors, of a time, that came at `now_ns`.
    pub fn judge(&mut self, time_ns: i64, sensors: &[u32], now_ns: i64) -> Verdict {
        self.times.retain({
            let mut is_first = true;
            move |time| std::mem::take(&mut is_first) || now_ns - time.heard_ns <= SILENCE_NS
        });
        let tolerance_ns = self.tolerance_ns;
        let fits = |time: &Time| {
            let ahead_ns = time_ns.saturating_sub(time.now_ns(now_ns));
            // A recording may be told more slowly than time goes on.
            ahead_ns <= tolerance_ns && (ahead_ns >= -tolerance_ns || time_ns > time.newest_ns)
        };
        let place = self.times.iter().position(fits).unwrap_or_else(|| {
            if self.times.len() == TIMES_MAX {
                let heard_last = (1..TIMES_MAX).min_by_key(|&k| self.times[k].heard_ns);
                heard_last.map(|k| self.times.remove(k));
            }
            self.times.push(Time {
                newest_ns: time_ns,
                at_ns: now_ns,
                since_ns: now_ns,
                heard_ns: now_ns,
                sensors: BTreeMap::new(),
            });
            self.times.len() - 1
        });
        // That of the hall may have been silent until now.
        let silent = now_ns - self.times[0].heard_ns > SILENCE_NS;
        let time = &mut self.times[place];
        if time_ns > time.newest_ns {
            (time.newest_ns, time.at_ns) = (time_ns, now_ns);
        }
        time.heard_ns = now_ns;
        time.sensors.extend(sensors.iter().map(|&sensor| (sensor, now_ns)));
        if place == 0 {
            return Verdict::Believed;
        }
        let steady = now_ns - self.times[place].since_ns >= SILENCE_NS;
        if silent || steady && self.votes(place, now_ns) > self.votes(0, now_ns) {
            self.times.swap(0, place);
            return Verdict::Anew;
        }
        let ahead_ns = time_ns.saturating_sub(self.times[0].now_ns(now_ns));
        let late = (-LATE_NS..0).contains(&ahead_ns);
        if late { Verdict::Believed } else { Verdict::Apart(ahead_ns) }
    }

    fn votes(&self, place: usize, now_ns: i64) -> usize {
        let off_ns = |time: &Time| time.now_ns(now_ns).abs_diff(now_ns);
        let nearest = (0..self.times.len()).min_by_key(|&k| off_ns(&self.times[k]));
        let own = nearest == Some(place) && off_ns(&self.times[place]) <= NEAR_NS as u64;
        let heard = self.times[place].sensors.values().filter(|heard_ns| now_ns - **heard_ns <= SILENCE_NS);
        heard.count() + usize::from(own)
    }
}

impl Time {
    /// What time it is by now.
    fn now_ns(&self, now_ns: i64) -> i64 {
        self.newest_ns.saturating_add(now_ns - self.at_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: i64 = 1_000_000_000;
    const DAY: i64 = 86_400 * S;

    /// Ten seconds in which each of these sensors tells a time so far ahead of this host's; who is believed in the end, and how
    /// often the time began anew.
    fn told(ahead: &[(u32, i64, i64)]) -> (Vec<bool>, usize) {
        let mut keeper = Timekeeper::new(STEP_NS);
        let (mut believed, mut anew) = (vec![false; ahead.len()], 0);
        for frame in 0..100 {
            for (k, &(sensor, from_s, ahead_ns)) in ahead.iter().enumerate() {
                let now_ns = DAY + frame * STEP_NS + k as i64;
                if now_ns < DAY + from_s * S {
                    continue;
                }
                let verdict = keeper.judge(now_ns + ahead_ns, &[sensor], now_ns);
                anew += usize::from(verdict == Verdict::Anew);
                believed[k] = !matches!(verdict, Verdict::Apart(_));
            }
        }
        (believed, anew)
    }

    #[test]
    fn a_front_end_whose_clock_is_a_second_or_an_hour_off_does_not_win_whoever_comes_first() {
        for off_ns in [S / 4, S, -S / 4, -S - S / 2, 3600 * S, -3600 * S, DAY] {
            // What is late by less than a second is counted as late, and shuts nobody out.
            let late = off_ns == -S / 4;
            assert_eq!(told(&[(0, 0, 0), (1, 3, off_ns)]), (vec![true, late], 0), "{off_ns}: it comes later");
            assert_eq!(told(&[(0, 3, 0), (1, 0, off_ns)]), (vec![true, late], 1), "{off_ns}: it comes first");
        }
    }

    #[test]
    fn a_recording_of_any_time_is_believed_and_a_stranger_beside_it_is_not() {
        assert_eq!(told(&[(0, 0, -300 * DAY), (1, 0, -300 * DAY)]), (vec![true, true], 0));
        assert_eq!(
            told(&[(0, 0, -300 * DAY), (1, 1, -300 * DAY), (1, 2, DAY)]),
            (vec![true, true, false], 0)
        );
    }

    #[test]
    fn of_three_clocks_the_two_that_agree_win_against_this_hosts() {
        let hour = 3600 * S;
        assert_eq!(told(&[(0, 0, 0), (1, 2, hour), (2, 2, hour), (3, 2, hour)]).0, [false, true, true, true]);
    }

    #[test]
    fn a_message_ahead_is_refused_alone_and_a_clock_that_was_set_is_followed_after_a_second() {
        let mut keeper = Timekeeper::new(STEP_NS);
        assert_eq!(keeper.judge(100 * S, &[0], DAY), Verdict::Believed);
        for ahead_ns in [2 * S, 5 * S, 9 * S, DAY, i64::MAX - 100 * S] {
            assert!(
                matches!(keeper.judge(100 * S + ahead_ns, &[0, 1, 2], DAY + 1), Verdict::Apart(_)),
                "{ahead_ns}"
            );
        }
        assert_eq!(keeper.judge(100 * S + STEP_NS, &[0], DAY + STEP_NS), Verdict::Believed);
        assert!(matches!(keeper.judge(50 * S, &[0], DAY + 2 * STEP_NS), Verdict::Apart(_)));
        assert_eq!(keeper.judge(50 * S + 3 * S, &[0], DAY + 3 * S), Verdict::Anew);
    }

    #[test]
    fn a_hall_that_was_cut_off_goes_on_and_what_comes_in_a_burst_is_not_ahead() {
        let mut keeper = Timekeeper::new(STEP_NS);
        (0..10)
            .for_each(|k| assert_eq!(keeper.judge(k * STEP_NS, &[0], DAY + k * STEP_NS), Verdict::Believed));
        for k in 10..30 {
            assert_eq!(keeper.judge(k * STEP_NS, &[0], DAY + 3 * S), Verdict::Believed, "{k}: all at once");
        }
        assert_eq!(
            keeper.judge(200 * STEP_NS, &[0], DAY + 20 * S),
            Verdict::Believed,
            "after a long silence"
        );
    }
}
