//! A day through assembler and stages, as fast as it goes. A row an hour says whether memory, time, tracks and numbers stay what
//! they were in the first.

use std::collections::VecDeque;
use std::path::Path;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};
use umbracast::detect::Point;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::lidar::Assembler;
use umbracast::site::Furniture;
use umbracast::{Config, Error, Health, Outcome, Pipeline, STEP_NS};
use umbracast_live::latency::Latencies;

use super::halls::{HALLS, Hall};
use super::legs;
use super::memory::resident_mib;
use super::play::{HOUR_NS, Play, Played, S_NS};
use super::tally::Tally;
use super::verdict::Verdict;

/// In so many frames that begin or end a leg nobody is near: what then shows of a thing is not learned.
const FRAMES: usize = 10;
/// Mean points of a thing that shows.
const SHOWS: f64 = 2.0;
/// A thing's points lie within this of it.
const AROUND_M: f64 = 0.08;

type Count = fn(&Health) -> u64;

/// What is counted of faults, in the order of the columns.
const COUNTED: [(&str, Count); 5] = [
    ("missing", |health| health.sensors_missing),
    ("jumps", |health| health.clock_jumps),
    ("twice", |health| health.packets_duplicate),
    ("late", |health| health.packets_late),
    ("skipped", |health| health.frames_out_of_order + health.packets_not_understood),
];

/// What an hour was like.
#[derive(Debug, Default, Clone)]
struct Hour {
    mib: f64,
    steps: Latencies,
    tally: Tally,
    things: Learned,
    counted: [u64; COUNTED.len()],
}

/// What became of things that were put in.
#[derive(Debug, Default, Clone, Copy)]
struct Learned {
    /// How many were, and how many of those showed at first.
    put_in: u64,
    showed: u64,
    /// How many were there at ends of legs, and how many of those were part of the hall by then.
    there: u64,
    known: u64,
}

/// Looks at things that were put in.
struct Things {
    halls: [Hall; HALLS],
    /// Of the leg, and whether it is another one than before.
    hall: usize,
    is_other: bool,
    learned: Learned,
    /// Points of each thing in the last frames, newest last; frames of the leg.
    points: VecDeque<Vec<u64>>,
    frames: usize,
}

/// Plays the day, tells it, and says what is not as it must be.
///
/// # Errors
/// A leg that is not there, a setting that cannot work.
pub fn run(folder: &Path, hours: f64) -> Result<Verdict, Error> {
    let config = Config::default();
    let mut pipeline = Pipeline::new(&config, None)?;
    legs::empty_frames(folder, &config)?.iter().for_each(|frame| pipeline.learn_empty(frame));
    let mut assembler = Assembler::new(&config.site)?;
    let mut play = Play::new(folder.to_owned(), 0, hours)?;
    let mut things = Things::new();
    tell_head(hours);
    let (mut hours, mut hour, mut health) = (Vec::new(), Hour::default(), Health::default());
    let mut counted_before = [0; COUNTED.len()];
    // A frame closes with its last packet, or with the first of the next one.
    let mut before = Played::default();
    while let Some(mut played) = play.next_frame()? {
        for arrived in std::mem::take(&mut played.packets) {
            assembler.push(arrived.sensor, &arrived.packet, &mut health);
            while let Some(frame) = assembler.pop() {
                let (outcome, took) = timed(|| pipeline.step(&frame));
                hour.steps.add(took);
                let is_before = arrived.packet.time_ns < played.end_ns - STEP_NS / 2;
                let of_frame = if is_before { &before } else { &played };
                hour.tally.count(&confirmed(outcome), &of_frame.people);
                things.look(&outcome.foreground);
                hour.counted = counted(&outcome.health, &health);
            }
        }
        things.follow(&played);
        if hours.is_empty() && played.end_ns == S_NS {
            println!("{:>13.1}  a second later", resident_mib());
        }
        if played.end_ns % HOUR_NS == 0 {
            let until_now = hour.counted;
            hour.counted = std::array::from_fn(|k| until_now[k] - counted_before[k]);
            counted_before = until_now;
            hour.mib = resident_mib();
            hour.things = std::mem::take(&mut things.learned);
            hour.tell(hours.len() + 1);
            let tally = hour.tally.followed_on();
            hours.push(std::mem::replace(&mut hour, Hour { tally, ..Hour::default() }));
        }
        before = played;
    }
    Ok(judge(&hours))
}

fn confirmed(outcome: &Outcome) -> Vec<(u64, DVec2)> {
    let confirmed = outcome.tracks.iter().filter(|track| track.confirmed);
    confirmed.map(|track| (track.id, track.position_m)).collect()
}

fn counted(of_stages: &Health, of_assembler: &Health) -> [u64; COUNTED.len()] {
    let mut all = *of_stages;
    all.add(of_assembler);
    COUNTED.map(|(_, count)| count(&all))
}

/// Time of this thread alone, as if nothing else ran on its core.
fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let now = || {
        let now = clock_gettime(ClockId::ThreadCPUTime);
        Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
    };
    let before = now();
    let done = work();
    (done, now() - before)
}

impl Things {
    fn new() -> Self {
        let halls = std::array::from_fn(Hall::of);
        Self {
            halls,
            hall: 0,
            is_other: false,
            learned: Learned::default(),
            points: VecDeque::new(),
            frames: 0,
        }
    }

    /// How much shows of each.
    fn look(&mut self, foreground: &[Point]) {
        let of_thing = |thing: &Furniture| {
            foreground.iter().filter(|point| is_of(thing, point.position_m)).count() as u64
        };
        if self.points.len() == FRAMES {
            self.points.pop_front();
        }
        self.points.push_back(self.halls[self.hall].put_in.iter().map(of_thing).collect());
    }

    /// Takes note of the first frames of a leg and of its last.
    fn follow(&mut self, played: &Played) {
        if played.begins {
            self.is_other = played.hall != self.hall;
            (self.hall, self.frames) = (played.hall, 0);
            self.points.clear();
        }
        self.frames += 1;
        let things = self.halls[self.hall].put_in.len() as u64;
        if self.is_other && self.frames == FRAMES {
            self.learned.put_in += things;
            self.learned.showed += self.shown();
        }
        if played.ends {
            self.learned.there += things;
            self.learned.known += things - self.shown();
        }
    }

    /// How many things show in the last frames.
    fn shown(&self) -> u64 {
        let shows = |thing: &usize| {
            let points: u64 = self.points.iter().filter_map(|points| points.get(*thing)).sum();
            points as f64 >= SHOWS * self.points.len() as f64
        };
        (0..self.halls[self.hall].put_in.len()).filter(shows).count() as u64
    }
}

fn is_of(thing: &Furniture, at_m: DVec3) -> bool {
    let [length_m, width_m, height_m] = thing.size_m;
    let from_middle_m = at_m.truncate() - DVec2::from_array(thing.position_m);
    let own_m = DVec2::from_angle(-thing.yaw_deg.to_radians()).rotate(from_middle_m).abs();
    own_m.x < length_m / 2.0 + AROUND_M && own_m.y < width_m / 2.0 + AROUND_M && at_m.z < height_m + AROUND_M
}

fn tell_head(hours: f64) {
    println!("Through assembler and stages, {hours} h, as fast as it goes; a step by the time of its thread");
    print!(
        "hour  frames    MiB  median, ms  99 %, ms  worst, ms  people  followed  outlasting, s  nobody's, s  came  numbers  \
         changed  put in  showed  there  known"
    );
    println!("{}", COUNTED.map(|(name, _)| format!("{name:>9}")).concat());
    println!("{:>13.1}  before the first frame", resident_mib());
}

impl Hour {
    fn step_ms(&self, share: f64) -> f64 {
        self.steps.quantile_ms(share)
    }

    fn tell(&self, number: usize) {
        let Self { mib, steps, tally, things, counted, .. } = self;
        print!(
            "{number:4} {:7} {mib:6.1} {:11.2} {:9.2} {:10.2} {:7.1} {:9.4} {:14.1} {:12.1} {:5} \
             {:8} {:8} {:7} {:7} {:6} {:6}",
            tally.frames,
            self.step_ms(0.5),
            self.step_ms(0.99),
            1e3 * steps.longest().as_secs_f64(),
            tally.at_once(),
            tally.share_followed(),
            tally.outlasting_s(),
            tally.nobodys_s(),
            tally.came,
            tally.given(),
            tally.changes,
            things.put_in,
            things.showed,
            things.there,
            things.known,
        );
        println!("{}", counted.map(|count| format!("{count:9}")).concat());
    }
}

/// What has to be so of the hours: the last quarter of them is as the first.
fn judge(hours: &[Hour]) -> Verdict {
    let mut verdict = Verdict::default();
    let (Some(first), Some(last)) = (hours.first(), hours.last()) else {
        verdict.expect("an hour or more", 0.0, 1.0..);
        return verdict;
    };
    let quarter = hours.len().div_ceil(4);
    let mean = |hours: &[Hour], of: &dyn Fn(&Hour) -> f64| {
        hours.iter().map(of).sum::<f64>() / hours.len().max(1) as f64
    };
    let grown =
        |of: &dyn Fn(&Hour) -> f64| mean(&hours[hours.len() - quarter..], of) / mean(&hours[..quarter], of);
    let least = |of: &dyn Fn(&Hour) -> f64| hours.iter().map(of).fold(f64::INFINITY, f64::min);
    verdict.expect("frames of each hour, at least", least(&|hour| hour.tally.frames as f64), 35_990.0..);
    verdict.expect("memory, last hour / first", last.mib / first.mib, ..1.02);
    verdict.expect("median step, last quarter / first", grown(&|hour| hour.step_ms(0.5)), ..1.15);
    verdict.expect("99 % of steps, last quarter / first", grown(&|hour| hour.step_ms(0.99)), ..1.25);
    verdict.expect("followed, least of the hours", least(&|hour| hour.tally.share_followed()), 0.97..);
    verdict.expect("followed, last quarter / first", grown(&|hour| hour.tally.share_followed()), 0.995..);
    verdict.expect("nobody's seconds, last quarter / first", grown(&|hour| hour.tally.nobodys_s()), ..1.5);
    let a_head = |hour: &Hour| hour.tally.given() as f64 / hour.tally.came as f64;
    verdict.expect("numbers given a person, last quarter / first", grown(&a_head), ..1.15);
    let known = |hours: &[Hour]| {
        let sum = |of: &dyn Fn(&Hour) -> u64| hours.iter().map(of).sum::<u64>() as f64;
        sum(&|hour| hour.things.known) / sum(&|hour| hour.things.there)
    };
    verdict.expect("share of things that are known at ends of legs", known(hours), 0.9..);
    let counted = |k: usize| least(&|hour: &Hour| hour.counted[k] as f64);
    verdict.expect("scans missed in each hour, at least", counted(0), 590.0..);
    verdict.expect("clock jumps of each hour, at least", counted(1), 4.0..);
    verdict.expect("packets found twice in each hour, at least", counted(2), 100_000.0..);
    verdict
}
