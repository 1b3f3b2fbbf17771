//! The thread of a [`Chain`]: it receives the input of the first stage and publishes the results of all its stages.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use umbracast::geometry::DVec2;
use umbracast::{Config, Error, Health};
use umbracast_io::fields;
use umbracast_io::nodes::{Followed, Foreground, Priors, TrackerState};
use umbracast_io::objects::{self, ObjectList};
use umbracast_io::reports;
use umbracast_live::HostClock;
use umbracast_live::heard::Inbox;
use umbracast_live::latency::Latencies;
use umbracast_live::queue::{Popped, Queue, WhenFull};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable};

use crate::bounds::{Bounds, Refused};
use crate::chain::{Chain, Made, Row};
use crate::front;
use crate::hall::Hall;
use crate::join::{Join, Joined};
use crate::lead::{Frame, Lead, Said};
use crate::objects::Lists;
use crate::outlets::Outlets;
use crate::role::Role;
use crate::seat::{Seat, Work};
use crate::terms::Terms;
use crate::timekeeper::{Timekeeper, Verdict};
use crate::worker::Worker;

/// Messages that wait for the stages: more than a second of four front ends.
const WAITING: usize = 64;
/// The longest rest: how often the end may be asked for.
const REST: Duration = Duration::from_millis(50);
/// How long others may take to answer at the start.
const ANSWER: Duration = Duration::from_millis(500);
/// The tracker's state is published with every so many frames.
const STATE_EVERY: u64 = 5;
/// When nothing that could be used has come for so long, time is taken as it comes.
const SILENCE_NS: i64 = 1_000_000_000;
/// Results that are later than this are of use to nobody, if frames wait no longer for front ends.
const STALE_NS: i64 = 1_000_000_000;
/// A list of another perception stands for all sensors.
const ALL_SENSORS: u32 = u32::MAX;

/// What comes to the thread.
pub(crate) enum Heard {
    /// A front end's message, and the key that it came with.
    Foreground(String, ZBytes),
    Followed(ZBytes),
    Priors(ZBytes),
    State(ZBytes),
    /// A list of another perception, and whose.
    Objects(String, ZBytes),
    /// Another tracker came or went.
    Tracker(String, bool),
    /// Somebody asks for the tracker's state.
    Asked(Query),
}

/// What a row counts.
#[derive(Debug, Default)]
pub struct Counted {
    /// Frames that it has done.
    pub frames: AtomicU64,
    /// Messages given up because it was busy.
    pub skipped: AtomicU64,
    /// Frames that waited in vain for a front end.
    pub incomplete: AtomicU64,
    /// Messages that came too late.
    pub late: AtomicU64,
    /// Messages that were not understood, of another site, of no use, or out of bounds.
    pub broken: AtomicU64,
    /// Who sent what was refused of late, and why, in words.
    pub troubles: Mutex<Vec<String>>,
    /// Whether it leads.
    pub leads: AtomicBool,
    /// From the close of a frame to its results.
    pub latency: Mutex<Latencies>,
    /// Of that what was not spent in a stage.
    pub wire: Mutex<Latencies>,
    /// Of front ends and stages.
    pub health: Mutex<Health>,
}

/// A running row.
pub struct Back {
    /// Its thread.
    pub(crate) worker: Worker<(Heard, i64)>,
    /// What it counts.
    pub counted: Arc<Counted>,
    _subscribers: Vec<Subscriber<()>>,
    _queryable: Option<Queryable<()>>,
}

impl Back {
    /// Begins.
    ///
    /// # Errors
    /// A setting that cannot work, a key that is none.
    pub fn start(
        hall: &Hall,
        config: &Config,
        chain: Chain,
        row: Row,
        wait: Duration,
        clock: HostClock,
    ) -> Result<Self, Error> {
        let queue = Arc::new(Queue::new(WAITING, WhenFull::DropOldest));
        let counted = Arc::new(Counted::default());
        let outlets = Outlets::new(hall, config, row)?;
        let wait_ns = wait.as_nanos() as i64;
        let lead = Lead::new(hall.id(), STALE_NS.max(wait_ns));
        let mut stages = Stages {
            seat: Seat::new(Tracking { chain, clock, counted: counted.clone() }, lead),
            outlets,
            bounds: Bounds::new(&config.site),
            timekeeper: Timekeeper::new(wait_ns),
            refused: Refused::default(),
            terms: Terms::default(),
            join: Join::new(&config.site, wait),
            lists: Lists::new(&config.site),
            others: Vec::new(),
            used_ns: clock.now_ns(),
            foreground_ns: None,
            reports: Arc::default(),
            misunderstood: 0,
            clock,
            counted: counted.clone(),
        };
        let hear = |key: &str, kind: fn(ZBytes) -> Heard| {
            let queue = queue.clone();
            hall.hear(&hall.keys().of(key), move |_, bytes| {
                queue.push((kind(bytes.clone()), clock.now_ns()));
            })
        };
        let (mut subscribers, mut queryable) = (Vec::new(), None);
        if row.cast && config.site.has_radio() {
            // Beside the queue: however many reports come, no frame is given up for them.
            let (inbox, site) = (stages.reports.clone(), config.site.clone());
            subscribers.push(hall.hear(
                &hall.keys().of("reports/*"),
                move |_, bytes| match reports::from_json(&bytes.to_bytes(), &site, clock.now_ns()) {
                    Ok(heard) => inbox.push(&heard),
                    Err(_) => inbox.refuse(),
                },
            )?);
        }
        if row.track {
            let (seen, own) = (queue.clone(), hall.id());
            subscribers.push(hall.watch_nodes(Role::Track, move |id, here| {
                if !id.ends_with(&own) {
                    seen.push((Heard::Tracker(id.to_owned(), here), clock.now_ns()));
                }
            })?);
            subscribers.push(hear("priors", Heard::Priors)?);
            subscribers.push(hear("state", Heard::State)?);
            // What comes meanwhile waits in the queue.
            let foregrounds = queue.clone();
            subscribers.push(hall.hear(&hall.keys().of("sensor/*/foreground"), move |key, bytes| {
                foregrounds.push((Heard::Foreground(key.to_owned(), bytes.clone()), clock.now_ns()));
            })?);
            let lists = queue.clone();
            subscribers.push(hall.hear(&hall.keys().of("objects/*"), move |key, bytes| {
                let source = key.rsplit('/').next().unwrap_or_default().to_owned();
                lists.push((Heard::Objects(source, bytes.clone()), clock.now_ns()));
            })?);
            stages.take_up(hall);
            let alone = hall.nodes(Role::Track, ANSWER).iter().all(|id| id.ends_with(&hall.id()));
            stages.seat.lead.others(!alone);
            if alone {
                let kept = stages.seat.take_over(clock.now_ns());
                kept.into_iter().for_each(|made| stages.publish(made));
            }
            let asked = queue.clone();
            queryable = Some(hall.answer(&hall.keys().of("state"), move |query| {
                asked.push((Heard::Asked(query), clock.now_ns()));
            })?);
        } else {
            subscribers.push(hear(if row.forecast { "followed" } else { "tracks" }, Heard::Followed)?);
        }
        let worker = Worker::start(queue, move |items| stages.run(items));
        Ok(Self { worker, counted, _subscribers: subscribers, _queryable: queryable })
    }
}

/// A tracker's stages, as one of several in its hall.
struct Tracking {
    chain: Chain,
    clock: HostClock,
    counted: Arc<Counted>,
}

impl Work for Tracking {
    type Input = Joined;
    type Results = Made;
    type State = TrackerState;

    fn step(&mut self, joined: Joined) -> Option<Frame<Made>> {
        let clock = self.clock;
        let made = self.chain.joined(joined, || clock.now_ns())?;
        self.counted.count(&made, clock.now_ns());
        let (priors_ns, places_m) = made.priors.as_ref().map(places).unwrap_or_default();
        Some(Frame {
            said: Said { priors_ns, numbers: made.digest(), places_m },
            next_number: self.chain.next_number(),
            closed_ns: made.closed_ns,
            results: made,
        })
    }

    fn next_number(&self) -> u64 {
        self.chain.next_number()
    }

    fn take_up(&mut self, state: &TrackerState) -> bool {
        self.chain.take_up(state)
    }

    fn numbers(&self) -> Vec<u64> {
        self.chain.numbers()
    }

    fn renumber(&mut self, number: impl Fn(u64) -> u64, next: u64) {
        self.chain.renumber(number, next);
    }

    fn numbers_of(made: &Made) -> &[u64] {
        &made.numbers
    }

    fn renumber_results(made: &mut Made, number: impl Fn(u64) -> u64) {
        made.renumber(number);
    }
}

/// What the thread has.
struct Stages {
    seat: Seat<Tracking>,
    outlets: Outlets,
    bounds: Bounds,
    timekeeper: Timekeeper,
    refused: Refused,
    terms: Terms,
    join: Join,
    lists: Lists,
    /// Other trackers that are there.
    others: Vec<String>,
    /// When a message was of use last, and one of a front end.
    used_ns: i64,
    foreground_ns: Option<i64>,
    /// What access points heard.
    reports: Arc<Inbox>,
    misunderstood: u64,
    clock: HostClock,
    counted: Arc<Counted>,
}

impl Stages {
    fn run(&mut self, queue: &Queue<(Heard, i64)>) {
        loop {
            match queue.pop_within(self.rest()) {
                Popped::Item((heard, now_ns)) => self.hear(heard, now_ns),
                Popped::Nothing => {}
                Popped::Closed => return,
            }
            self.go_on();
            self.counted.skipped.store(queue.lost(), Ordering::Relaxed);
        }
    }

    /// Until something is due.
    fn rest(&self) -> Duration {
        let due_ns = [self.join.due_ns(), self.seat.lead.due_ns()].into_iter().flatten().min();
        let left_ns = due_ns.map_or(i64::MAX, |due_ns| due_ns - self.clock.now_ns()).max(0);
        Duration::from_nanos(left_ns as u64).min(REST)
    }

    fn hear(&mut self, heard: Heard, now_ns: i64) {
        match heard {
            Heard::Foreground(key, bytes) => match front::heard(&key, &bytes.to_bytes()) {
                Some(foreground) => self.foreground(&key, foreground, now_ns),
                None => self.misunderstood += 1,
            },
            Heard::Followed(bytes) => match fields::decode::<Followed>(&bytes.to_bytes()) {
                Some(followed) => self.followed(followed, now_ns),
                None => self.misunderstood += 1,
            },
            Heard::Priors(bytes) => match fields::decode::<Priors>(&bytes.to_bytes()) {
                Some(priors) => self.priors(&priors, now_ns),
                None => self.misunderstood += 1,
            },
            Heard::State(bytes) => match fields::decode::<TrackerState>(&bytes.to_bytes()) {
                Some(state) => self.seat.hear_state(state.term, &state, now_ns),
                None => self.misunderstood += 1,
            },
            Heard::Asked(query) => {
                // What is known here may be out of date: then it is the leader's to answer.
                let known = (!self.seat.lead.is_out_of_step()).then(|| self.state()).flatten();
                if let Some(mut state) = known {
                    // Who asked and is gone needs no answer.
                    let _ = query.reply(query.key_expr().clone(), fields::encode(&mut state)).wait();
                }
            }
            Heard::Objects(source, bytes) => match objects::read(&bytes.to_bytes()) {
                Some(list) => self.objects(&source, list, now_ns),
                None => self.misunderstood += 1,
            },
            Heard::Tracker(id, here) => {
                self.others.retain(|other| *other != id);
                if here {
                    self.others.push(id);
                }
                self.seat.lead.others(!self.others.is_empty());
            }
        }
    }

    /// Whatever is due.
    fn go_on(&mut self) {
        let clock = self.clock;
        while let Some(joined) = self.join.pop(clock.now_ns()) {
            self.joined(joined);
        }
        let kept = self.seat.go_on(clock.now_ns());
        kept.into_iter().for_each(|made| self.publish(made));
        let (counts, counted) = (&self.join.counts, &self.counted);
        counted.incomplete.store(counts.incomplete, Ordering::Relaxed);
        counted.late.store(counts.late, Ordering::Relaxed);
        let of_reports = self.reports.lost() + self.seat.work.chain.reports_skipped();
        let broken = self.misunderstood + self.refused.count + of_reports;
        counted.leads.store(self.seat.lead.term().is_some(), Ordering::Relaxed);
        counted.broken.store(broken, Ordering::Relaxed);
        *lock(&counted.troubles) = self.refused.words(clock.now_ns());
    }

    fn foreground(&mut self, key: &str, foreground: Foreground, now_ns: i64) {
        let sender = sender(key);
        if let Err(why) = self.bounds.foreground(&foreground) {
            return self.refused.note(sender, why, now_ns);
        }
        if self.is_of_now(sender, foreground.time_ns, &foreground.covers, now_ns) {
            self.foreground_ns = Some(now_ns);
            self.join.push(foreground, now_ns);
        }
    }

    /// A list of another perception: only where no front end speaks.
    fn objects(&mut self, source: &str, mut list: ObjectList, now_ns: i64) {
        let sender = format!("objects/{source}");
        if self.foreground_ns.is_some_and(|heard_ns| now_ns - heard_ns <= SILENCE_NS) {
            return self.refused.note(&sender, "a list beside front ends", now_ns);
        }
        if !self.is_of_now(&sender, list.time_ns, &[ALL_SENSORS], now_ns) {
            return;
        }
        if let Err(why) = self.bounds.objects(&mut list) {
            self.refused.note(&sender, why, now_ns);
        }
        let joined = self.lists.joined(source, &list, now_ns);
        joined.into_iter().for_each(|joined| self.joined(joined));
    }

    /// Whether a message is of the hall's time; else it is refused.
    fn is_of_now(&mut self, sender: &str, time_ns: i64, sensors: &[u32], now_ns: i64) -> bool {
        match self.timekeeper.judge(time_ns, sensors, now_ns) {
            Verdict::Believed => {}
            Verdict::Anew => {
                self.join.begin_anew();
                self.lists.begin_anew();
                self.seat.work.chain.forget_time();
            }
            Verdict::Apart(ahead_ns) => {
                let side = if ahead_ns < 0 { "behind" } else { "ahead of" };
                self.refused.note(
                    sender,
                    &format!("its time is {} {side} the hall's", span(ahead_ns)),
                    now_ns,
                );
                return false;
            }
        }
        true
    }

    fn priors(&mut self, priors: &Priors, now_ns: i64) {
        if let Err(why) = self.bounds.priors(priors) {
            return self.refused.note(&format!("tracker {}", priors.tracker), why, now_ns);
        }
        let (priors_ns, places_m) = places(priors);
        let said = Said { priors_ns, numbers: priors.numbers, places_m };
        if self.seat.hear(&priors.tracker, priors.term, said) {
            // Those who heard the other one have heard other warnings.
            self.seat.work.chain.say_again();
        }
    }

    /// A frame of front ends, or of another perception.
    fn joined(&mut self, joined: Joined) {
        let clock = self.clock;
        let heard = self.reports.take(joined.views.time_ns, joined.closed_ns);
        self.seat.work.chain.hear(&heard);
        if let Some(made) = self.seat.frame(joined, || clock.now_ns()) {
            self.publish(made);
        }
    }

    fn followed(&mut self, followed: Followed, now_ns: i64) {
        let sender = "tracks of another stage";
        if let Err(why) = self.bounds.followed(&followed) {
            return self.refused.note(sender, why, now_ns);
        }
        if !self.terms.takes(followed.term, now_ns)
            || !self.is_of_now(sender, followed.time_ns, &[ALL_SENSORS], now_ns)
        {
            return;
        }
        let (clock, chain) = (self.clock, &mut self.seat.work.chain);
        if clock.now_ns() - self.used_ns > SILENCE_NS {
            chain.forget_time();
        }
        chain.hear(&self.reports.take(followed.time_ns, followed.closed_ns));
        if let Some(made) = chain.followed(followed, || clock.now_ns()) {
            self.used_ns = clock.now_ns();
            self.counted.count(&made, self.used_ns);
            self.outlets.put(made);
        }
    }

    fn publish(&mut self, mut made: Made) {
        made.term = self.seat.lead.term().unwrap_or(0);
        let kept = made.frame.is_multiple_of(STATE_EVERY);
        self.outlets.put(made);
        if let (true, Some(outlet), Some(mut state)) = (kept, &self.outlets.state, self.state()) {
            outlet.put(&mut state);
        }
    }

    fn state(&self) -> Option<TrackerState> {
        self.seat.work.chain.state(self.seat.lead.newest().unwrap_or(0))
    }

    /// Goes on from the newest state that somebody knows.
    fn take_up(&mut self, hall: &Hall) {
        let known = hall.ask(&hall.keys().of("state"), ANSWER);
        let states = known.iter().filter_map(|(_, bytes)| fields::decode::<TrackerState>(bytes));
        if let Some(newest) = states.max_by_key(|state| (state.term, state.time_ns)) {
            match self.seat.work.chain.take_up(&newest) {
                true => self.seat.lead.take_up(newest.term, self.seat.work.chain.next_number()),
                false => self.misunderstood += 1,
            }
        }
    }
}

impl Counted {
    fn count(&self, made: &Made, now_ns: i64) {
        self.frames.fetch_add(1, Ordering::Relaxed);
        let latency_ns = now_ns.saturating_sub(made.closed_ns).max(0);
        let time = |ns: i64| Duration::from_nanos(ns.max(0) as u64);
        lock(&self.latency).add(time(latency_ns));
        lock(&self.wire).add(time(latency_ns - made.took_ns));
        if let Some(followed) = &made.followed {
            *lock(&self.health) = followed.health;
        }
    }
}

/// Of which instant priors are, and where they are.
fn places(priors: &Priors) -> (i64, Vec<DVec2>) {
    (priors.time_ns, priors.priors.iter().map(|prior| prior.position_m).collect())
}

/// Of a front end's key what tells it from others.
fn sender(key: &str) -> &str {
    let end = key.find("/sensor/").map_or(key, |at| &key[at + 1..]);
    end.trim_end_matches("/foreground")
}

/// A length of time in words; coarse, so that messages of one sender are counted together.
fn span(span_ns: i64) -> String {
    match span_ns.unsigned_abs() / 1_000_000_000 {
        0 => "less than a second".to_owned(),
        span_s @ 1..100 => format!("{span_s} s"),
        span_s => format!("{:.1} h", span_s as f64 / 3600.0),
    }
}

/// What a thread that panicked left is whole: every change is one assignment.
fn lock<T>(shared: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
