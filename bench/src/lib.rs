//! What the benchmarks work on: frames of a simulated hall, and the stages in the middle of following people.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};
use umbracast::blockage::{Blockage, Caster};
use umbracast::detect::{Background, Cluster, Clusterer, Detection, Measurer, Point, Prior};
use umbracast::forecast::{Forecast, Forecaster, Weights};
use umbracast::lidar::Views;
use umbracast::track::{Track, Tracker};
use umbracast::{Config, Error, Frame, Health, Pipeline};

/// The hall with people that the examples have too.
#[path = "../../examples/simulated/mod.rs"]
pub mod simulated;

/// The stages of a pipeline one by one, with what each was given and gave: `Pipeline::step` laid open.
#[derive(Clone)]
pub struct Stages {
    /// Foreground.
    pub background: Background,
    /// Clusters.
    pub clusterer: Clusterer,
    /// Detections.
    pub measurer: Measurer,
    /// Tracks.
    pub tracker: Tracker,
    /// Forecasts.
    pub forecaster: Forecaster,
    /// Blockages.
    pub caster: Caster,
    /// Where people are expected in the frame.
    pub priors: Vec<Prior>,
    /// What the sensors could see.
    pub views: Views,
    /// What was skipped.
    pub health: Health,
    /// Of the background.
    pub foreground: Vec<Point>,
    /// Of the clusterer.
    pub clusters: Vec<Cluster>,
    /// Of the measurer.
    pub detections: Vec<Detection>,
    /// Of the tracker.
    pub tracks: Vec<Track>,
    /// Of the forecaster.
    pub forecasts: Vec<Forecast>,
    /// Of the caster.
    pub blockages: Vec<Blockage>,
}

impl Stages {
    /// Before the first frame, with the empty hall learned.
    ///
    /// # Errors
    /// A setting that cannot work.
    pub fn new(config: &Config, empty: &[Frame]) -> Result<Self, Error> {
        let mut background = Background::new(&config.detect, &config.site);
        empty.iter().for_each(|frame| background.learn_empty(frame));
        Ok(Self {
            background,
            clusterer: Clusterer::new(&config.detect, &config.site),
            measurer: Measurer::new(&config.detect, &config.site),
            tracker: Tracker::new(&config.track, &config.site),
            forecaster: Forecaster::new(&config.forecast, None)?,
            caster: Caster::new(&config.blockage, &config.site),
            priors: Vec::new(),
            views: Views::default(),
            health: Health::default(),
            foreground: Vec::new(),
            clusters: Vec::new(),
            detections: Vec::new(),
            tracks: Vec::new(),
            forecasts: Vec::new(),
            blockages: Vec::new(),
        })
    }

    /// As a pipeline does.
    pub fn use_threads(&mut self, threads: usize) {
        self.background.use_threads(threads);
        self.caster.use_threads(threads);
    }

    /// Where people are expected.
    pub fn expect(&mut self, frame: &Frame) {
        self.tracker.priors(frame.time_ns, &mut self.priors);
    }

    /// The first stage.
    pub fn foreground(&mut self, frame: &Frame) {
        self.background.foreground(frame, &self.priors, &mut self.health, &mut self.foreground);
    }

    /// The second.
    pub fn clusters(&mut self) {
        self.clusterer.clusters(&self.foreground, &self.priors, &mut self.clusters);
    }

    /// The third.
    pub fn detections(&mut self) {
        self.measurer.detections(&self.foreground, &self.clusters, &self.priors, &mut self.detections);
    }

    /// The fourth.
    pub fn update(&mut self, frame: &Frame) {
        self.views.take(frame);
        self.tracker.update(&self.views, &self.detections, &mut self.tracks);
    }

    /// The fifth.
    pub fn forecast(&mut self) {
        self.forecaster.forecast(&self.tracks, &mut self.forecasts);
    }

    /// The last.
    pub fn cast(&mut self) {
        self.caster.cast(&self.tracks, &self.forecasts, &mut self.blockages);
    }

    /// All of them.
    pub fn step(&mut self, frame: &Frame) {
        self.expect(frame);
        self.foreground(frame);
        self.clusters();
        self.detections();
        self.update(frame);
        self.forecast();
        self.cast();
    }
}

/// The whole pipeline at the same point: the empty hall learned, `before` seen.
///
/// # Errors
/// A setting that cannot work.
pub fn pipeline(
    config: &Config,
    weights: Option<&Weights>,
    empty: &[Frame],
    before: &[Frame],
) -> Result<Pipeline, Error> {
    let mut pipeline = Pipeline::new(config, weights)?;
    empty.iter().for_each(|frame| pipeline.learn_empty(frame));
    for frame in before {
        pipeline.step(frame);
    }
    Ok(pipeline)
}

/// Time of this thread alone, as if nothing else ran on its core.
pub fn timed(work: impl FnOnce()) -> Duration {
    let now = || {
        let now = clock_gettime(ClockId::ThreadCPUTime);
        Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
    };
    let before = now();
    work();
    now() - before
}
