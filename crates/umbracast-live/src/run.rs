//! The whole of a live run: receive, assemble, step, publish, record. One thread each, a queue between.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use umbracast::forecast::Weights;
use umbracast::lidar::Assembler;
use umbracast::{Config, Error, Frame, Health, Pipeline};
use umbracast_io::reports;

use crate::advice::Advised;
use crate::clock::HostClock;
use crate::heard::Inbox;
use crate::latency::Latencies;
use crate::published::{self, Published};
use crate::queue::{Queue, WhenFull};
use crate::receive::{Arrived, Door, Receivers};
use crate::record::{RecordSettings, RecordStatus, Recorder};
use crate::warnings::{Event, Warnings};
use crate::whole::Whole;

/// Packets that wait for the assembler: a second of four HDL-32E.
pub const PACKETS_WAITING: usize = 8192;
/// They have so many bytes at most: two seconds of two OS0-128, whose packets are twenty times as long.
pub const PACKETS_BYTES: usize = 64 << 20;
/// Frames that wait for the pipeline: as many as one packet can close at once, when a sensor falls silent. Then the newest
/// takes the place of the oldest.
const FRAMES_WAITING: usize = 3;

/// What a live run is made of.
pub struct Settings {
    /// Site and method.
    pub config: Config,
    /// The network's, for modes that forecast with it.
    pub weights: Option<Weights>,
    /// The hall without people; the background is learned on the way where there is none.
    pub empty: Vec<Frame>,
    /// Where the sensors' packets come in.
    pub doors: Vec<Door>,
    /// Whether and where all is recorded.
    pub record: Option<RecordSettings>,
    /// So many may share a frame ([`Pipeline::use_threads`]).
    pub threads: usize,
    /// What packets are stamped with.
    pub clock: HostClock,
    /// Where it counts.
    pub counters: Arc<Counters>,
    /// Where whole frames are left for somebody who looks at them.
    pub whole: Arc<Whole>,
}

/// Who is told of every frame. Called on the pipeline's thread: it must not wait for anybody.
pub type Listener = Box<dyn Fn(&Arc<Published>) + Send>;

/// A live run: threads that go on until [`Live::stop`].
pub struct Live {
    receivers: Receivers,
    packets: Arc<Queue<Arrived>>,
    frames: Arc<Queue<Closed>>,
    /// The threads; none once they have ended.
    assembling: Option<JoinHandle<()>>,
    stepping: Option<JoinHandle<()>>,
    recorder: Option<Arc<Recorder>>,
    counters: Arc<Counters>,
    /// What the pipeline takes over before its next frame.
    next: Arc<Mutex<Option<Config>>>,
}

/// What is counted while it runs, for `/metrics` and the summary.
#[derive(Debug, Default)]
pub struct Counters {
    /// Packets that came from sensors.
    pub packets: AtomicU64,
    /// The same of each.
    pub of_sensors: Mutex<Vec<u64>>,
    /// What access points heard, on its way to the pipeline.
    pub heard: Inbox,
    /// Reports of which nothing could be made, as of the last frame.
    pub reports_skipped: AtomicU64,
    /// Packets that the system gave up before they were received, as of the last [`Live::summary`].
    pub dropped_by_system: AtomicU64,
    /// Frames that were published.
    pub frames: AtomicU64,
    /// From the last packet of a frame to its results.
    pub latencies: Mutex<Latencies>,
    /// Of the stages alone.
    pub steps: Mutex<Latencies>,
    /// Of assembler and stages, as of the last frame.
    pub health: Mutex<Health>,
    /// How the recorder does.
    pub recorder: Arc<Mutex<RecordStatus>>,
}

impl Counters {
    /// Counts a frame that is published.
    pub fn count(&self, published: &Published) {
        self.frames.fetch_add(1, Ordering::Relaxed);
        lock(&self.latencies).add(published.latency);
        lock(&self.steps).add(published.step);
        *lock(&self.health) = published.health;
    }

    /// How the recorder does now.
    pub fn recorder(&self) -> RecordStatus {
        lock(&self.recorder).clone()
    }
}

/// A run's account.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    /// Packets that came from sensors.
    pub packets: u64,
    /// The same of each sensor.
    pub of_sensors: Vec<u64>,
    /// Packets that the system gave up because nobody received them in time.
    pub dropped_by_system: u64,
    /// Packets given up because the assembler was busy.
    pub packets_lost: u64,
    /// Packets from addresses that no sensor has.
    pub strangers: u64,
    /// Frames that were published.
    pub frames: u64,
    /// Frames given up because the pipeline was busy.
    pub frames_skipped: u64,
    /// From the last packet of a frame to its results.
    pub latencies: Latencies,
    /// Of the stages alone.
    pub steps: Latencies,
    /// Of assembler and stages, as of the last frame.
    pub health: Health,
    /// The recorder's.
    pub recorded: RecordStatus,
}

/// A frame that closed, and what the assembler knew then.
struct Closed {
    frame: Frame,
    /// When its last packet came.
    arrived_ns: i64,
    health: Health,
}

impl Live {
    /// Opens sockets and files and begins; every frame is told to `listener`.
    ///
    /// # Errors
    /// A setting that cannot work, a port that is taken, a folder that cannot be made.
    pub fn start(settings: Settings, listener: Listener) -> Result<Self, Error> {
        let Settings { config, weights, empty, doors, record, threads, clock, counters, whole } = settings;
        let mut pipeline = Pipeline::new(&config, weights.as_ref())?;
        pipeline.use_threads(threads);
        empty.iter().for_each(|frame| pipeline.learn_empty(frame));
        let assembler = Assembler::new(&config.site)?;
        let points = record.as_ref().is_some_and(|record| record.points);
        let start = |record| Recorder::start(record, &config, counters.recorder.clone());
        let recorder = record.map(start).transpose()?.map(Arc::new);
        let packets = Queue::of_bytes(PACKETS_WAITING, PACKETS_BYTES, Arrived::bytes, WhenFull::DropNewest);
        let packets = Arc::new(packets);
        let frames = Arc::new(Queue::new(FRAMES_WAITING, WhenFull::DropOldest));
        let receivers = Receivers::start(&doors, clock, &packets)?;
        let assembling = {
            let (packets, frames, recorder) = (packets.clone(), frames.clone(), recorder.clone());
            let counters = counters.clone();
            std::thread::spawn(move || {
                assemble(assembler, &packets, &frames, recorder.as_deref(), &counters, clock);
                frames.close();
            })
        };
        let sensors = config.site.sensors.len();
        *lock(&counters.of_sensors) = vec![0; sensors];
        let next = Arc::new(Mutex::new(None));
        let stepping = {
            let (frames, recorder, counters) = (frames.clone(), recorder.clone(), counters.clone());
            let publish = Publish {
                clock,
                sensors,
                points,
                recorder,
                counters,
                listener,
                warnings: Warnings::default(),
                advised: Advised::default(),
                access_points: published::access_points(&config.site),
                reloads: 0,
                next: next.clone(),
                whole,
                left: Vec::new(),
            };
            std::thread::spawn(move || step(pipeline, &frames, publish))
        };
        let (assembling, stepping) = (Some(assembling), Some(stepping));
        Ok(Self { receivers, packets, frames, assembling, stepping, recorder, counters, next })
    }

    /// Another configuration of the same sensors from the next frame on: access points, UE and stage 3 are taken over
    /// ([`Pipeline::take_over_links`]), nobody is lost, and a recording goes on in a new file. Whoever calls it sees that
    /// nothing else differs: [`needs_restart`].
    pub fn take_over(&self, config: Config) {
        *lock(&self.next) = Some(config);
    }

    /// The sockets.
    pub fn receivers(&self) -> &Receivers {
        &self.receivers
    }

    /// True while every thread works. One that does not is a bug: then everything had better end and be started anew.
    pub fn is_well(&self) -> bool {
        let recording = self.recorder.as_ref().is_none_or(|recorder| recorder.is_well());
        let works =
            |thread: &Option<JoinHandle<()>>| thread.as_ref().is_some_and(|thread| !thread.is_finished());
        recording && works(&self.assembling) && works(&self.stepping)
    }

    /// How it goes.
    pub fn summary(&self) -> Summary {
        self.count_dropped();
        let counters = &self.counters;
        Summary {
            packets: counters.packets.load(Ordering::Relaxed),
            of_sensors: lock(&counters.of_sensors).clone(),
            dropped_by_system: counters.dropped_by_system.load(Ordering::Relaxed),
            packets_lost: self.packets.lost(),
            strangers: self.receivers.strangers(),
            frames: counters.frames.load(Ordering::Relaxed),
            frames_skipped: self.frames.lost(),
            latencies: lock(&counters.latencies).clone(),
            steps: lock(&counters.steps).clone(),
            health: *lock(&counters.health),
            recorded: counters.recorder(),
        }
    }

    /// What the system says of the sockets; it forgets it when they are closed.
    fn count_dropped(&self) {
        let dropped = self.receivers.dropped_by_system().unwrap_or(0);
        self.counters.dropped_by_system.fetch_max(dropped, Ordering::Relaxed);
    }

    /// Ends in the order of the data, so that what has come is finished, published and recorded.
    pub fn stop(mut self) -> Summary {
        let ended = |thread: &mut Option<JoinHandle<()>>| thread.take().map(JoinHandle::join);
        self.count_dropped();
        self.receivers.stop();
        self.packets.close();
        let _ = ended(&mut self.assembling);
        self.frames.close(); // Also where the assembler panicked: the pipeline must not wait for it.
        let _ = ended(&mut self.stepping);
        let recorded = self.recorder.take().and_then(Arc::into_inner).map(Recorder::stop).unwrap_or_default();
        Summary { recorded, ..self.summary() }
    }
}

/// What of `new` a run of `old` cannot take over while it goes on, by key; empty where it can take over all.
pub fn needs_restart(old: &Config, new: &Config) -> Vec<&'static str> {
    let (a, b) = (&old.site, &new.site);
    let differs = [
        ("mode", old.mode != new.mode),
        ("site.name", a.name != b.name),
        ("site.hall", a.hall != b.hall),
        ("site.pillars", a.pillars != b.pillars),
        ("site.furniture", a.furniture != b.furniture),
        ("site.sensors", a.sensors != b.sensors),
        ("detect", old.detect != new.detect),
        ("track", old.track != new.track),
        ("forecast", old.forecast != new.forecast),
    ];
    differs.into_iter().filter(|(_, differs)| *differs).map(|(key, _)| key).collect()
}

/// What a thread that panicked left is whole: every change is one assignment.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Packets to frames. Stamps are made strictly increasing, so that a recording, which keeps a list for each sensor,
/// gives them back in this order.
fn assemble(
    mut assembler: Assembler,
    packets: &Queue<Arrived>,
    frames: &Queue<Closed>,
    recorder: Option<&Recorder>,
    counters: &Counters,
    clock: HostClock,
) {
    let mut health = Health::default();
    let mut before_ns = i64::MIN;
    while let Some(mut arrived) = packets.pop() {
        counters.packets.fetch_add(1, Ordering::Relaxed);
        if let Some(count) = lock(&counters.of_sensors).get_mut(arrived.sensor) {
            *count += 1;
        }
        let came_ns = arrived.packet.time_ns.max(before_ns.saturating_add(1));
        arrived.packet.time_ns = came_ns;
        assembler.push(arrived.sensor, &arrived.packet, &mut health);
        while let Some(frame) = assembler.pop() {
            let is_last = before_ns == i64::MIN || assembler.closed_by_its_own();
            let arrived_ns = if is_last { came_ns } else { before_ns };
            frames.push(Closed { frame, arrived_ns, health });
        }
        before_ns = came_ns;
        if let Some(recorder) = recorder {
            recorder.packet(arrived);
        }
    }
    assembler.finish();
    // That nothing more comes to them is known since now, however long the sensors have been silent.
    let ended_ns = clock.now_ns();
    while let Some(frame) = assembler.pop() {
        frames.push(Closed { frame, arrived_ns: ended_ns, health });
    }
}

/// What is done with every outcome.
struct Publish {
    clock: HostClock,
    sensors: usize,
    /// Whether the recorder wants the foreground.
    points: bool,
    recorder: Option<Arc<Recorder>>,
    counters: Arc<Counters>,
    listener: Listener,
    warnings: Warnings,
    advised: Advised,
    access_points: Arc<[String]>,
    reloads: u64,
    next: Arc<Mutex<Option<Config>>>,
    whole: Arc<Whole>,
    /// What happened to links that are no more, told with the next frame.
    left: Vec<Event>,
}

fn step(mut pipeline: Pipeline, frames: &Queue<Closed>, mut publish: Publish) {
    while let Some(Closed { frame, arrived_ns, health }) = frames.pop() {
        publish.take_over(&mut pipeline);
        let begun_ns = publish.clock.now_ns();
        let heard = publish.counters.heard.take(frame.time_ns, arrived_ns);
        pipeline.hear(&heard);
        let outcome = pipeline.step(&frame);
        let stepped_ns = publish.clock.now_ns();
        let mut published = Published::of(outcome, &frame, publish.sensors, &publish.access_points);
        published.reports = reports::rows(frame.index, frame.time_ns, &heard);
        published.foreground = publish.points.then(|| outcome.foreground.clone());
        published.health.add(&health);
        published.frames_skipped = frames.lost();
        published.reloads = publish.reloads;
        published.events = std::mem::take(&mut publish.left);
        published.events.extend(publish.warnings.changes(&published.links, &publish.access_points));
        published.advice = publish.advised.changes(&published.decisions, &publish.access_points);
        published.step = Duration::from_nanos((stepped_ns - begun_ns).max(0) as u64);
        published.published_ns = publish.clock.now_ns();
        published.latency = Duration::from_nanos((published.published_ns - arrived_ns).max(0) as u64);
        publish.counters.reports_skipped.store(pipeline.binder().skipped(), Ordering::Relaxed);
        publish.out(published);
        publish.whole.give(frame, publish.clock.now_ns());
    }
}

impl Publish {
    /// The configuration that waits, if one does.
    fn take_over(&mut self, pipeline: &mut Pipeline) {
        let Some(config) = lock(&self.next).take() else { return };
        pipeline.take_over_links(&config);
        let after = published::access_points(&config.site);
        self.left = self.warnings.rename(&self.access_points, &after);
        self.access_points = after;
        self.advised = Advised::default(); // Indices may now mean others.
        self.reloads += 1;
        if let Some(recorder) = &self.recorder {
            recorder.take_over(&config);
        }
    }

    fn out(&self, published: Published) {
        self.counters.count(&published);
        let published = Arc::new(published);
        (self.listener)(&published);
        if let Some(recorder) = &self.recorder {
            recorder.result(published);
        }
    }
}
