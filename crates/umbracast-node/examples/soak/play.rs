//! Legs played one after the other, for as long as is wanted: which one follows is drawn anew in every hour, and what goes wrong is
//! laid over them. What is moved is time: that at which a packet comes, and that which it carries.

use std::ops::Range;
use std::path::PathBuf;

use rand::RngExt;
use rand::seq::SliceRandom;
use umbracast::{Error, STEP_NS};
use umbracast_live::receive::Arrived;
use umbracast_sim::random::stream;

use super::halls::HALLS;
use super::legs::{self, Leg, LegFrame, SEED};

pub const S_NS: i64 = 1_000_000_000;
pub const MINUTE_NS: i64 = 60 * S_NS;
pub const HOUR_NS: i64 = 60 * MINUTE_NS;
/// After a leg the hall is changed so often.
const CHANGING: f64 = 0.25;
/// A Velodyne's packet ends with the microseconds of its hour, before two bytes that name it.
const STAMP_FROM_END: usize = 6;
const HOUR_US: i64 = HOUR_NS / 1000;
/// Packets that change their order do so within so many.
const TURNED: usize = 8;
/// Clocks jump by as much as this, to and fro.
const JUMP_S: Range<i64> = 2..1000;

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wrong {
    /// A sensor sends nothing.
    Silent,
    /// A sensor's clock is off.
    Clock,
    /// All clocks are off, by the same.
    Clocks,
    /// Every packet comes twice.
    Twice,
    /// Eight packets each come in reverse order.
    Reversed,
}

/// For how long each does, once an hour.
const WRONG: [(Wrong, i64); 5] = [
    (Wrong::Silent, MINUTE_NS),
    (Wrong::Clock, 2 * MINUTE_NS),
    (Wrong::Clocks, 2 * MINUTE_NS),
    (Wrong::Twice, MINUTE_NS / 2),
    (Wrong::Reversed, MINUTE_NS / 2),
];

/// Of one hour.
struct Hour {
    number: i64,
    order: rand_pcg::Pcg64,
    /// When, from the hour's begin.
    wrong_ns: Vec<(Wrong, Range<i64>)>,
    /// The sensor that is silent; the clock of the other one is off.
    sensor: usize,
    jump_ns: i64,
}

impl Hour {
    fn new(number: i64) -> Self {
        let mut order = stream(SEED, "hour", number as u64);
        let mut tenths: Vec<i64> = (0..WRONG.len() as i64).collect();
        tenths.shuffle(&mut order);
        let when = |((wrong, lasts_ns), tenth): ((Wrong, i64), i64)| {
            let from_ns = (2 + 11 * tenth + order.random_range(0..8)) * MINUTE_NS;
            (wrong, from_ns..from_ns + lasts_ns)
        };
        let wrong_ns = WRONG.into_iter().zip(tenths).map(when).collect();
        let forth = if order.random() { 1 } else { -1 };
        let jump_ns = forth * order.random_range(JUMP_S) * S_NS;
        Self { number, order, wrong_ns, sensor: (number % 2) as usize, jump_ns }
    }
}

/// A frame as it is played.
#[derive(Debug, Default)]
pub struct Played {
    /// Where it ends in the time of what is played.
    pub end_ns: i64,
    /// Which of the halls it is in, and whether the leg begins or ends with it.
    pub hall: usize,
    pub begins: bool,
    pub ends: bool,
    /// Everybody at its end: a number that nobody else has, and the place.
    pub people: Vec<(u64, umbracast::geometry::DVec2)>,
    /// As they come.
    pub packets: Vec<Arrived>,
}

/// Plays for a time.
pub struct Play {
    folder: PathBuf,
    from_ns: i64,
    /// Where the next frame begins.
    now_ns: i64,
    until_ns: i64,
    hall: usize,
    number: usize,
    leg: Leg,
    /// Played next.
    next: LegFrame,
    begins: bool,
    /// Where the leg began.
    leg_ns: i64,
    /// People of the legs before.
    before: u64,
    hour: Hour,
}

impl Play {
    /// From a whole tenth of a second on, for so many hours.
    ///
    /// # Errors
    /// A leg that is not there.
    pub fn new(folder: PathBuf, from_ns: i64, hours: f64) -> Result<Self, Error> {
        let mut leg = Leg::open(&legs::file(&folder, 0, 0))?;
        let next = leg.next_frame().ok_or_else(|| Error::new("a leg: expected frames, found none"))?;
        Ok(Self {
            folder,
            from_ns,
            now_ns: from_ns,
            until_ns: from_ns + (hours * HOUR_NS as f64) as i64,
            hall: 0,
            number: 0,
            leg,
            next,
            begins: true,
            leg_ns: from_ns,
            before: 0,
            hour: Hour::new(0),
        })
    }

    /// The next frame; `None` at the end.
    ///
    /// # Errors
    /// A leg that is not there.
    pub fn next_frame(&mut self) -> Result<Option<Played>, Error> {
        if self.now_ns >= self.until_ns {
            return Ok(None);
        }
        let number = (self.now_ns - self.from_ns) / HOUR_NS;
        if number != self.hour.number {
            self.hour = Hour::new(number);
        }
        let frame = std::mem::take(&mut self.next);
        let packets = frame.packets.into_iter().map(|arrived| later(arrived, self.leg_ns)).collect();
        let mut played = Played {
            end_ns: self.now_ns + STEP_NS,
            hall: self.hall,
            begins: self.begins,
            ends: false,
            people: frame
                .people
                .into_iter()
                .map(|(person, at)| (self.before + u64::from(person), at))
                .collect(),
            packets: self.harmed(packets),
        };
        self.now_ns += STEP_NS;
        match self.leg.next_frame() {
            Some(next) => (self.next, self.begins) = (next, false),
            None => {
                played.ends = true;
                self.follow()?;
            }
        }
        Ok(Some(played))
    }

    /// The leg that comes next.
    fn follow(&mut self) -> Result<(), Error> {
        let draws = &mut self.hour.order;
        if draws.random_bool(CHANGING) {
            self.hall = (self.hall + draws.random_range(1..HALLS)) % HALLS;
        }
        self.number = (self.number + draws.random_range(1..legs::numbers().end)) % legs::numbers().end;
        self.leg = Leg::open(&legs::file(&self.folder, self.hall, self.number))?;
        self.next = self.leg.next_frame().unwrap_or_default();
        self.begins = true;
        self.leg_ns = self.now_ns;
        self.before += u64::from(u16::MAX);
        Ok(())
    }

    fn harmed(&self, mut packets: Vec<Arrived>) -> Vec<Arrived> {
        let Hour { wrong_ns, sensor, jump_ns, .. } = &self.hour;
        let in_hour_ns = (self.now_ns - self.from_ns) % HOUR_NS;
        let Some((wrong, _)) = wrong_ns.iter().find(|(_, when_ns)| when_ns.contains(&in_hour_ns)) else {
            return packets;
        };
        match wrong {
            Wrong::Silent => packets.retain(|arrived| arrived.sensor != *sensor),
            Wrong::Clock => {
                let of_it = packets.iter_mut().filter(|arrived| arrived.sensor != *sensor);
                of_it.for_each(|arrived| stamp_later(&mut arrived.packet.payload, *jump_ns));
            }
            Wrong::Clocks => {
                packets.iter_mut().for_each(|a| stamp_later(&mut a.packet.payload, *jump_ns));
            }
            Wrong::Twice => {
                packets = packets.into_iter().flat_map(|arrived| [arrived.clone(), arrived]).collect()
            }
            Wrong::Reversed => packets.chunks_mut(TURNED).for_each(|some| {
                let times_ns: Vec<i64> = some.iter().map(|arrived| arrived.packet.time_ns).collect();
                some.reverse();
                some.iter_mut().zip(times_ns).for_each(|(arrived, ns)| arrived.packet.time_ns = ns);
            }),
        }
        packets
    }
}

fn later(mut arrived: Arrived, by_ns: i64) -> Arrived {
    arrived.packet.time_ns += by_ns;
    stamp_later(&mut arrived.packet.payload, by_ns);
    arrived
}

/// By whole microseconds.
fn stamp_later(payload: &mut [u8], by_ns: i64) {
    let Some(at) = payload.len().checked_sub(STAMP_FROM_END) else { return };
    let Some(bytes) = payload.get_mut(at..at + 4) else { return };
    let us = bytes.iter().rev().fold(0, |us, byte| us << 8 | i64::from(*byte));
    let moved = (us + by_ns / 1000).rem_euclid(HOUR_US) as u32;
    bytes.copy_from_slice(&moved.to_le_bytes());
}
