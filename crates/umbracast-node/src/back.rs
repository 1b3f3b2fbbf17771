//! The thread of a [`Chain`]: it receives the input of the first stage and publishes the results of all its stages.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use umbracast::forecast::Weights;
use umbracast::{Config, Error, Health};
use umbracast_io::fields;
use umbracast_io::nodes::{Followed, Priors, TrackerState};
use umbracast_io::objects;
use umbracast_io::wire;
use umbracast_live::HostClock;
use umbracast_live::latency::Latencies;
use umbracast_live::queue::{Popped, Queue, WhenFull};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable};

use crate::chain::{Chain, Made, Row};
use crate::front;
use crate::hall::{Hall, Outlet, Urgency};
use crate::join::{Join, Joined};
use crate::lead::Lead;
use crate::objects::Lists;
use crate::role::Role;
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

/// What comes to the thread.
pub(crate) enum Heard {
    /// A front end's message, and the key that it came with.
    Foreground(String, ZBytes),
    Followed(ZBytes),
    Priors(ZBytes),
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
    /// Messages that were not understood, of another site, or of no use.
    pub broken: AtomicU64,
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
        weights: Option<&Weights>,
        row: Row,
        wait: Duration,
        clock: HostClock,
    ) -> Result<Self, Error> {
        let queue = Arc::new(Queue::new(WAITING, WhenFull::DropOldest));
        let counted = Arc::new(Counted::default());
        let chain = Chain::new(config, weights, row)?;
        let outlets = Outlets::new(hall, config, row)?;
        let mut stages = Stages {
            chain,
            outlets,
            join: Join::new(&config.site, wait),
            lists: Lists::new(&config.site),
            lead: Lead::new(hall.id()),
            others: Vec::new(),
            used_ns: clock.now_ns(),
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
        if row.track {
            let (seen, own) = (queue.clone(), hall.id());
            subscribers.push(hall.watch_nodes(Role::Track, move |id, here| {
                if !id.ends_with(&own) {
                    seen.push((Heard::Tracker(id.to_owned(), here), clock.now_ns()));
                }
            })?);
            subscribers.push(hear("priors", Heard::Priors)?);
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
            if hall.nodes(Role::Track, ANSWER).iter().all(|id| id.ends_with(&hall.id())) {
                stages.take_over();
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

/// Where results leave.
struct Outlets {
    priors: Option<Outlet>,
    state: Option<Outlet>,
    detections: Option<Outlet>,
    followed: Option<Outlet>,
    links: Option<Outlet>,
    /// Where the site has a radio.
    losses: Option<Outlet>,
    /// Where it says what changes cost.
    decisions: Option<Outlet>,
    /// Of each access point.
    warnings: Vec<(String, Outlet)>,
    access_points: Vec<String>,
    tracker: String,
}

impl Outlets {
    fn new(hall: &Hall, config: &Config, row: Row) -> Result<Self, Error> {
        let keys = hall.keys();
        let outlet = |wanted: bool, key: &str, urgency| {
            wanted.then(|| hall.outlet(&keys.of(key), urgency)).transpose()
        };
        let access_points: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
        let warnings = access_points.iter().filter(|_| row.cast).map(|name| {
            let chunk = crate::network::chunk(name).map_err(|e| e.within("site.access_points"))?;
            Ok((name.clone(), hall.outlet(&keys.warnings(&chunk), Urgency::Warning)?))
        });
        let tracks = if row.forecast { "tracks" } else { "followed" };
        Ok(Self {
            priors: outlet(row.track, "priors", Urgency::Result)?,
            state: outlet(row.track, "state", Urgency::Rest)?,
            detections: outlet(row.track, "detections", Urgency::Rest)?,
            followed: outlet(row.track || row.forecast, tracks, Urgency::Stage)?,
            links: outlet(row.cast, "links", Urgency::Result)?,
            losses: outlet(row.cast && config.site.has_radio(), "losses", Urgency::Result)?,
            decisions: outlet(row.cast && config.site.has_decisions(), "decisions", Urgency::Warning)?,
            warnings: warnings.collect::<Result<_, Error>>()?,
            access_points,
            tracker: hall.id(),
        })
    }

    /// Warnings and decisions first, then what other stages wait for, then what is looked at.
    fn put(&self, mut made: Made, leads_since_ns: i64) {
        for warning in &mut made.warnings {
            if let Some((_, outlet)) = self.warnings.iter().find(|(name, _)| *name == warning.access_point) {
                outlet.put(warning);
            }
        }
        let names = &self.access_points;
        if let (Some(outlet), Some(_)) = (&self.decisions, &made.links) {
            outlet.put_bytes(wire::encode(made.time_ns, made.frame, &made.decisions, names));
        }
        if let (Some(outlet), Some(followed)) = (&self.followed, &mut made.followed) {
            outlet.put(followed);
        }
        if let (Some(outlet), Some(priors)) = (&self.priors, &mut made.priors) {
            (priors.tracker, priors.leads_since_ns) = (self.tracker.clone(), leads_since_ns);
            outlet.put(priors);
        }
        if let (Some(outlet), Some(links)) = (&self.links, &made.links) {
            outlet.put_bytes(wire::encode(made.time_ns, made.frame, links, names));
            if let Some(outlet) = &self.losses {
                outlet.put_bytes(wire::encode(made.time_ns, made.frame, &made.losses, names));
            }
        }
        if let (Some(outlet), Some(detections)) = (&self.detections, &made.detections) {
            outlet.put_bytes(wire::encode(made.time_ns, made.frame, detections, names));
        }
    }
}

/// What the thread has.
struct Stages {
    chain: Chain,
    outlets: Outlets,
    join: Join,
    lists: Lists,
    lead: Lead<Made>,
    /// Other trackers that are there.
    others: Vec<String>,
    /// When a message was of use last.
    used_ns: i64,
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
        let due_ns = [self.join.due_ns(), self.lead.due_ns()].into_iter().flatten().min();
        let left_ns = due_ns.map_or(i64::MAX, |due_ns| due_ns - self.clock.now_ns()).max(0);
        Duration::from_nanos(left_ns as u64).min(REST)
    }

    fn hear(&mut self, heard: Heard, now_ns: i64) {
        match heard {
            Heard::Foreground(key, bytes) => match front::heard(&key, &bytes.to_bytes()) {
                Some(foreground) => self.join.push(foreground, now_ns),
                None => self.broken(),
            },
            Heard::Followed(bytes) => match fields::decode::<Followed>(&bytes.to_bytes()) {
                Some(followed) => self.followed(followed),
                None => self.broken(),
            },
            Heard::Priors(bytes) => match fields::decode::<Priors>(&bytes.to_bytes()) {
                Some(priors) => {
                    self.lead.hear(&priors);
                }
                None => self.broken(),
            },
            Heard::Asked(query) => {
                if let Some(mut state) = self.chain.state() {
                    // Who asked and is gone needs no answer.
                    let _ = query.reply(query.key_expr().clone(), fields::encode(&mut state)).wait();
                }
            }
            Heard::Objects(source, bytes) => match objects::read(&bytes.to_bytes()) {
                Some(list) => {
                    let joined = self.lists.joined(&source, &list, now_ns);
                    joined.into_iter().for_each(|joined| self.joined(joined));
                }
                None => self.broken(),
            },
            Heard::Tracker(id, here) => {
                self.others.retain(|other| *other != id);
                if here {
                    self.others.push(id);
                } else if self.others.is_empty() {
                    self.take_over();
                }
            }
        }
    }

    /// Whatever is due.
    fn go_on(&mut self) {
        let clock = self.clock;
        while let Some(joined) = self.join.pop(clock.now_ns()) {
            self.joined(joined);
        }
        if self.lead.is_overdue(clock.now_ns()) {
            self.take_over();
        }
        let counts = &self.join.counts;
        self.counted.incomplete.store(counts.incomplete, Ordering::Relaxed);
        self.counted.late.store(counts.late, Ordering::Relaxed);
        self.counted.leads.store(self.lead.since_ns().is_some(), Ordering::Relaxed);
    }

    /// A frame of front ends, or of another perception.
    fn joined(&mut self, joined: Joined) {
        let clock = self.clock;
        if let Some(made) = self.chain.joined(joined, || clock.now_ns()) {
            self.count(&made);
            let priors_ns = made.priors.as_ref().map_or(0, |priors| priors.time_ns);
            if let Some(made) = self.lead.done(priors_ns, made, clock.now_ns()) {
                self.publish(made);
            }
        }
    }

    fn followed(&mut self, followed: Followed) {
        let clock = self.clock;
        if clock.now_ns() - self.used_ns > SILENCE_NS {
            self.chain.forget_time();
        }
        if let Some(made) = self.chain.followed(followed, || clock.now_ns()) {
            self.used_ns = clock.now_ns();
            self.count(&made);
            self.outlets.put(made, 0);
        }
    }

    fn take_over(&mut self) {
        let kept = self.lead.take_over(self.clock.now_ns());
        kept.into_iter().for_each(|made| self.publish(made));
    }

    fn publish(&mut self, made: Made) {
        let kept = made.frame.is_multiple_of(STATE_EVERY);
        self.outlets.put(made, self.lead.since_ns().unwrap_or(0));
        if let (true, Some(outlet), Some(mut state)) = (kept, &self.outlets.state, self.chain.state()) {
            outlet.put(&mut state);
        }
    }

    /// Goes on from the newest state that somebody knows.
    fn take_up(&mut self, hall: &Hall) {
        let known = hall.ask(&hall.keys().of("state"), ANSWER);
        let states = known.iter().filter_map(|(_, bytes)| fields::decode::<TrackerState>(bytes));
        if let Some(newest) = states.max_by_key(|state| state.time_ns) {
            let taken = self.chain.take_up(&newest);
            self.counted.broken.fetch_add(u64::from(!taken), Ordering::Relaxed);
        }
    }

    fn count(&self, made: &Made) {
        let counted = &self.counted;
        counted.frames.fetch_add(1, Ordering::Relaxed);
        let latency_ns = (self.clock.now_ns() - made.closed_ns).max(0);
        let time = |ns: i64| Duration::from_nanos(ns.max(0) as u64);
        let lock = |of: &Mutex<Latencies>, took| of.lock().unwrap_or_else(PoisonError::into_inner).add(took);
        lock(&counted.latency, time(latency_ns));
        lock(&counted.wire, time(latency_ns - made.took_ns));
        if let Some(followed) = &made.followed {
            *counted.health.lock().unwrap_or_else(PoisonError::into_inner) = followed.health;
        }
    }

    fn broken(&self) {
        self.counted.broken.fetch_add(1, Ordering::Relaxed);
    }
}
