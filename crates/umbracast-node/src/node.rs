//! One process of a hall with its stages, from start to end.

mod feed;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use umbracast::forecast::Weights;
use umbracast::{Config, Error, Frame, Health};
use umbracast_io::nodes::NodeHealth;
use umbracast_io::point_cloud::PointCloud;
use umbracast_live::latency::Latencies;
use umbracast_live::queue::Queue;
use umbracast_live::receive::{Arrived, Door, Receivers};
use umbracast_live::record::{RecordSettings, RecordStatus, Recorder};
use umbracast_live::run::Listener;
use umbracast_live::{HostClock, Published};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;

use crate::back::{Back, Counted};
use crate::chain::{Chain, Row};
use crate::hall::{Hall, Outlet, Urgency};
use crate::role::Role;
use crate::ros2;
use crate::share::{Shared, Sharing, keep_state, site_number};
use crate::summary::{Summary, load};
use crate::watch::Watch;

/// What a node is made of.
pub struct Settings {
    /// What it does.
    pub stages: Vec<Role>,
    /// Site and method.
    pub config: Config,
    /// The network's, for modes that forecast with it.
    pub weights: Option<Weights>,
    /// A front end's: places of its sensors in the site,
    pub sensors: Vec<usize>,
    /// where their packets come from,
    pub source: Source,
    /// and the hall without people; learned on the way where there is none.
    pub empty: Vec<Frame>,
    /// A frame waits so long for a front end.
    pub wait: Duration,
    /// Where a front end records packets, and who looks on results.
    pub record: Option<RecordSettings>,
    /// Who is told of every frame, where the node serves.
    pub listener: Option<Listener>,
    /// What it answers when it is asked.
    pub shared: Shared,
    /// So many may share a frame's links ([`umbracast::blockage::Caster::use_threads`]).
    pub threads: usize,
    /// The host's.
    pub clock: HostClock,
}

/// Where packets come from.
pub enum Source {
    /// Sockets.
    Doors(Vec<Door>),
    /// Topics of a domain of ROS 2, one for each sensor, whose place in the site stands before it: of packets, or of clouds for
    /// a sensor that is known by them.
    Ros2(u32, Vec<(usize, String)>),
    /// A recording, so many times as fast as it was, once front ends of all sensors and all stages are there.
    Replay(Box<dyn Iterator<Item = Arrived> + Send>, f64),
}

/// A running node.
pub struct Node {
    hall: Hall,
    stop: Arc<AtomicBool>,
    receivers: Option<Receivers>,
    packets: Option<Arc<Queue<Arrived>>>,
    clouds: Option<Arc<Queue<PointCloud>>>,
    front: Option<JoinHandle<()>>,
    /// Asks for the empty hall until it comes.
    asks: Option<JoinHandle<()>>,
    empty_hall: Arc<AtomicBool>,
    fed: Option<JoinHandle<()>>,
    front_counted: Arc<FrontCounted>,
    backs: Vec<Back>,
    watch: Option<Watch>,
    /// As ROS 2 sees a front end that reads its topics.
    driven: Option<ros2::Node>,
    drivers: Vec<ros2::Subscriber>,
    recorder: Option<Arc<Recorder>>,
    record_status: Arc<Mutex<RecordStatus>>,
    stages: Vec<Role>,
    site: u64,
    started_ns: i64,
    clock: HostClock,
    health: Vec<Outlet>,
    _sharing: Vec<Sharing>,
    _tokens: Vec<LivelinessToken>,
    _subscribers: Vec<Subscriber<()>>,
}

/// What the front end counts.
#[derive(Debug, Default)]
struct FrontCounted {
    /// Packets, or clouds.
    packets: AtomicU64,
    /// Messages of drivers that hold none.
    broken: AtomicU64,
    frames: AtomicU64,
    priors_late: AtomicU64,
    health: Mutex<Health>,
    latency: Mutex<Latencies>,
}

impl Node {
    /// Opens what it needs and begins.
    ///
    /// # Errors
    /// A setting that cannot work, a port that is taken, a folder that cannot be made.
    pub fn start(hall: Hall, settings: Settings) -> Result<Self, Error> {
        let Settings {
            stages,
            config,
            weights,
            sensors,
            source,
            empty,
            wait,
            record,
            listener,
            shared,
            threads,
            clock,
        } = settings;
        let has = |role| stages.contains(&role);
        let record_status = Arc::<Mutex<RecordStatus>>::default();
        let points = record.as_ref().is_some_and(|record| record.points) || has(Role::Serve);
        let start = |record| Recorder::start(record, &config, record_status.clone());
        let recorder = record.map(start).transpose()?.map(Arc::new);
        let mut node = Self {
            stop: Arc::default(),
            receivers: None,
            packets: None,
            clouds: None,
            front: None,
            asks: None,
            empty_hall: Arc::new(AtomicBool::new(!empty.is_empty())),
            fed: None,
            front_counted: Arc::default(),
            backs: Vec::new(),
            watch: None,
            driven: None,
            drivers: Vec::new(),
            recorder,
            record_status,
            site: site_number(&config.site),
            started_ns: clock.now_ns(),
            clock,
            health: Vec::new(),
            _sharing: vec![shared.answer(&hall)?],
            _tokens: Vec::new(),
            _subscribers: Vec::new(),
            stages,
            hall,
        };
        for row in Row::of(&node.stages) {
            let chain = Chain::new(&config, weights.as_ref(), row, threads)?;
            node.backs.push(Back::start(&node.hall, &config, chain, row, wait, clock)?);
        }
        // A tracker keeps its own; a front end may be a small machine.
        let keeps = [Role::Forecast, Role::Cast, Role::Record, Role::Serve];
        if !node.stages.contains(&Role::Track) && has_any(&node.stages, &keeps) {
            node._sharing.push(keep_state(&node.hall)?);
        }
        if has_any(&node.stages, &[Role::Record, Role::Serve]) {
            node.look_on(&config, points, listener)?;
        }
        if node.stages.contains(&Role::Sensor) {
            node.open_front(&config, &sensors, &empty, source)?;
        }
        for &role in &node.stages {
            let names: Vec<&str> = match role {
                Role::Sensor => sensors.iter().map(|&s| config.site.sensors[s].name.as_str()).collect(),
                _ => Vec::new(),
            };
            match &names[..] {
                [] => node._tokens.push(node.hall.show(role, None)?),
                names => {
                    for name in names {
                        node._tokens.push(node.hall.show(role, Some(name))?);
                    }
                }
            }
            let key = node.hall.keys().health(role, &node.hall.id());
            node.health.push(node.hall.outlet(&key, Urgency::Rest)?);
        }
        Ok(node)
    }

    /// The page and the recorder.
    fn look_on(&mut self, config: &Config, points: bool, listener: Option<Listener>) -> Result<(), Error> {
        let recorder = self.recorder.clone().filter(|_| self.stages.contains(&Role::Record));
        let told: Listener = Box::new(move |published: &Arc<Published>| {
            if let Some(listener) = &listener {
                listener(published);
            }
            if let Some(recorder) = &recorder {
                recorder.result(published.clone());
            }
        });
        self.watch = Some(Watch::start(&self.hall, config, self.clock, points, told)?);
        Ok(())
    }

    /// The session with the others.
    pub fn hall(&self) -> &Hall {
        &self.hall
    }

    /// Where each sensor's packets come in; none of a replay.
    pub fn receivers(&self) -> Option<&Receivers> {
        self.receivers.as_ref()
    }

    /// Whether the hall without people is known; a front end without it asks for it, and learns the background meanwhile.
    pub fn has_empty_hall(&self) -> bool {
        self.empty_hall.load(Ordering::Relaxed)
    }

    /// True once a replay has ended and all of it is published.
    pub fn is_done(&self) -> bool {
        self.fed.is_some() && self.front.as_ref().is_some_and(JoinHandle::is_finished)
    }

    /// True while every thread works.
    pub fn is_well(&self) -> bool {
        let front = self.fed.is_some() || self.front.as_ref().is_none_or(|front| !front.is_finished());
        let recording = self.recorder.as_ref().is_none_or(|recorder| recorder.is_well());
        front
            && recording
            && self.backs.iter().all(|back| back.worker.is_well())
            && self.watch.as_ref().is_none_or(|watch| watch.worker.is_well())
    }

    /// How it goes.
    pub fn summary(&self) -> Summary {
        let front = &self.front_counted;
        let mut summary = Summary {
            packets: front.packets.load(Ordering::Relaxed),
            packets_lost: self.packets.as_ref().map_or(0, |packets| packets.lost())
                + self.clouds.as_ref().map_or(0, |clouds| clouds.lost()),
            frames: front.frames.load(Ordering::Relaxed),
            priors_late: front.priors_late.load(Ordering::Relaxed),
            broken: front.broken.load(Ordering::Relaxed),
            published: self.hall.published(),
            latency: lock(&front.latency).clone(),
            health: *lock(&front.health),
            recorded: lock(&self.record_status).clone(),
            empty_hall: self.empty_hall.load(Ordering::Relaxed),
            ..Summary::default()
        };
        if let Some(watch) = &self.watch {
            summary.frames = watch.frames.load(Ordering::Relaxed);
            summary.incomplete = watch.incomplete.load(Ordering::Relaxed);
        }
        for back in &self.backs {
            let counted: &Counted = &back.counted;
            let count = |of: &AtomicU64| of.load(Ordering::Relaxed);
            summary.frames = count(&counted.frames);
            summary.skipped += count(&counted.skipped);
            summary.incomplete += count(&counted.incomplete);
            summary.late += count(&counted.late);
            summary.broken += count(&counted.broken);
            summary.troubles.extend(lock(&counted.troubles).iter().cloned());
            summary.leads |= counted.leads.load(Ordering::Relaxed);
            summary.latency = lock(&counted.latency).clone();
            summary.wire = lock(&counted.wire).clone();
            summary.health = *lock(&counted.health);
        }
        summary
    }

    /// Tells the others how it goes; whoever runs the node calls it once a second.
    pub fn tell_health(&self, host: &str) {
        let summary = self.summary();
        let ms = |of: &Latencies| [0.5, 0.99].map(|share| of.quantile_ms(share));
        let (cpu_s, resident_bytes) = load().unwrap_or_default();
        let mut health = NodeHealth {
            time_ns: self.clock.now_ns(),
            node: self.hall.id(),
            host: host.to_owned(),
            stages: self.stages.iter().map(|role| role.name().to_owned()).collect(),
            up_s: (self.clock.now_ns() - self.started_ns) as f64 * 1e-9,
            cpu_s,
            resident_bytes,
            frames: summary.frames,
            frames_skipped: summary.skipped + summary.packets_lost,
            frames_incomplete: summary.incomplete,
            messages_late: summary.late,
            messages_broken: summary.broken,
            bytes_out: summary.published.1,
            messages_out: summary.published.0,
            latency_ms: ms(&summary.latency),
            wire_ms: ms(&summary.wire),
            leads: summary.leads,
            site: self.site,
            health: summary.health,
            empty_hall: summary.empty_hall,
            troubles: summary.troubles,
        };
        self.health.iter().for_each(|outlet| outlet.put(&mut health));
    }

    /// Ends in the order of the data, so that what has come is finished, published and recorded.
    pub fn stop(mut self) -> Summary {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(receivers) = &mut self.receivers {
            receivers.stop();
        }
        self.drivers.clear();
        if let Some(packets) = &self.packets {
            packets.close();
        }
        if let Some(clouds) = &self.clouds {
            clouds.close();
        }
        for thread in [self.front.take(), self.fed.take(), self.asks.take()].into_iter().flatten() {
            let _ = thread.join(); // One that panicked is a bug; the others end all the same.
        }
        self.backs.iter_mut().for_each(|back| back.worker.stop());
        if let Some(watch) = &mut self.watch {
            watch.worker.stop();
        }
        let mut summary = self.summary();
        self.watch = None; // It holds the recorder.
        if let Some(recorder) = self.recorder.take().and_then(Arc::into_inner) {
            summary.recorded = recorder.stop();
        }
        summary
    }
}

fn has_any(stages: &[Role], any: &[Role]) -> bool {
    stages.iter().any(|stage| any.contains(stage))
}

/// What a thread that panicked left is whole: every change is one assignment.
fn lock<T>(shared: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
