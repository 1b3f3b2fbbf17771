//! The page: one line a stage.

use crate::blockage::{Blockage, Caster};
use crate::detect::{Background, Cluster, Clusterer, Detection, Measurer, Point};
use crate::forecast::{Forecast, Forecaster, Weights};
use crate::track::{Track, Tracker};
use crate::{Config, Error, Frame, Health};

/// Everything the stages made of one frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outcome {
    /// The frame's.
    pub frame: u64,
    /// The frame's; every position below is given at it.
    pub time_ns: i64,
    /// Points that do not belong to the empty scene.
    pub foreground: Vec<Point>,
    /// One a person, as indices into `foreground`.
    pub clusters: Vec<Cluster>,
    /// Those clusters that have a person's size.
    pub detections: Vec<Detection>,
    /// Everybody followed, in order of id.
    pub tracks: Vec<Track>,
    /// One a track, in the same order.
    pub forecasts: Vec<Forecast>,
    /// One an access point and confirmed track.
    pub blockages: Vec<Blockage>,
    /// What was skipped since the start.
    pub health: Health,
    last_ns: Option<i64>,
}

impl Outcome {
    /// Takes the frame's number and time. False, counted, and everything emptied for a frame that does not lie
    /// after the last one.
    fn begin(&mut self, frame: &Frame) -> bool {
        let later = self.last_ns.is_none_or(|last_ns| frame.time_ns > last_ns);
        if later {
            self.last_ns = Some(frame.time_ns);
        } else {
            let health = Health { frames_out_of_order: self.health.frames_out_of_order + 1, ..self.health };
            *self = Self { health, last_ns: self.last_ns, ..Self::default() };
        }
        (self.frame, self.time_ns) = (frame.index, frame.time_ns);
        later
    }
}

/// The three stages with what each remembers. A clone goes on by itself: one that has learned the empty scene
/// serves many recordings.
#[derive(Debug, Clone)]
pub struct Pipeline {
    background: Background,
    clusterer: Clusterer,
    measurer: Measurer,
    tracker: Tracker,
    forecaster: Forecaster,
    caster: Caster,
    outcome: Outcome,
}

impl Pipeline {
    /// Sets up every stage. `weights` are the LSTM's, needed by the modes that forecast with it.
    ///
    /// # Errors
    /// A setting that cannot work, with what was expected and found.
    pub fn new(config: &Config, weights: Option<&Weights>) -> Result<Self, Error> {
        Ok(Self {
            background: Background::new(&config.detect, &config.site),
            clusterer: Clusterer::new(&config.detect, &config.site),
            measurer: Measurer::new(&config.detect, &config.site),
            tracker: Tracker::new(&config.track, &config.site),
            forecaster: Forecaster::new(&config.forecast, weights)?,
            caster: Caster::new(&config.blockage, &config.site),
            outcome: Outcome::default(),
        })
    }

    /// Learns the empty scene from a frame without people. Without any, the background is learned on the way.
    pub fn learn_empty(&mut self, frame: &Frame) {
        self.background.learn_empty(frame);
    }

    /// One frame through all stages.
    pub fn step(&mut self, frame: &Frame) -> &Outcome {
        let o = &mut self.outcome;
        if !o.begin(frame) {
            return o;
        }
        let priors = self.tracker.priors(frame.time_ns);
        self.background.foreground(frame, &priors, &mut o.health, &mut o.foreground);
        self.clusterer.clusters(&o.foreground, &priors, &mut o.clusters);
        self.measurer.detections(&o.foreground, &o.clusters, &priors, &mut o.detections);
        self.tracker.update(frame, &o.detections, &mut o.tracks);
        self.forecaster.forecast(&o.tracks, &mut o.forecasts);
        self.caster.cast(&o.tracks, &o.forecasts, &mut o.blockages);
        o
    }
}
