//! The whole system on one page, with one line for each stage.

use crate::blockage::{Blockage, Caster};
use crate::decide::{Decider, Decision};
use crate::detect::{Background, Clocks, Cluster, Clusterer, Detection, Measurer, Point, Prior};
use crate::forecast::{Forecast, Forecaster, Weights};
use crate::lidar::{Views, is_time};
use crate::mounting::Mountings;
use crate::radio::{Binder, Binding, Fader, Listener, Loss, Outages, Report};
use crate::track::{Track, Tracker, Windows};
use crate::{Config, Error, Frame, Health};

/// Everything the stages made of one frame.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let config = umbracast::Config::default();
/// use umbracast::Pipeline;
///
/// let mut pipeline = Pipeline::new(&config, None)?;
/// pipeline.learn_empty(&ray(0, 15.5));
/// // What a step gives is overwritten by the next one: a clone may be kept.
/// let kept = pipeline.step(&ray(1, 14.0)).clone();
/// assert_eq!((kept.frame, kept.foreground.len(), kept.tracks.len()), (1, 1, 0));
/// # Ok::<(), umbracast::Error>(())
/// ```
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
    /// One an access point with a radio and confirmed track, in the same order; none where the method draws no samples.
    pub losses: Vec<Loss>,
    /// Who may carry which device that was heard ([`Pipeline::hear`]), devices in order, likeliest first.
    pub bindings: Vec<Binding>,
    /// One a confirmed track, where the site says what changes cost.
    pub decisions: Vec<Decision>,
    /// What was skipped since the start.
    pub health: Health,
    last_ns: Option<i64>,
}

impl Outcome {
    /// Takes the frame's number and time. False, counted, and everything emptied for a frame that does not lie
    /// after the last one, or at no time that a clock shows.
    fn begin(&mut self, frame: &Frame) -> bool {
        let later = is_time(frame.time_ns) && self.last_ns.is_none_or(|last_ns| frame.time_ns > last_ns);
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
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let config = umbracast::Config::default();
/// use umbracast::Pipeline;
///
/// let mut pipeline = Pipeline::new(&config, None)?;
/// pipeline.learn_empty(&ray(0, 15.5));
/// for k in 1..4 {
///     let outcome = pipeline.step(&ray(k, 14.0));
///     assert_eq!(outcome.foreground.len(), 1);
/// }
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Pipeline {
    /// None where the configuration has sensors hang as the site says, whatever they see.
    mountings: Mountings,
    background: Background,
    clocks: Clocks,
    clusterer: Clusterer,
    measurer: Measurer,
    views: Views,
    priors: Vec<Prior>,
    tracker: Tracker,
    /// Of tracks from elsewhere.
    windows: Windows,
    forecaster: Forecaster,
    caster: Caster,
    fader: Fader,
    binder: Binder,
    listener: Listener,
    decider: Decider,
    outcome: Outcome,
}

impl Pipeline {
    /// Sets up every stage. `weights` are the LSTM's, needed by the modes that forecast with it.
    ///
    /// ```
    /// use umbracast::{Config, Mode, Pipeline};
    ///
    /// assert!(Pipeline::new(&Config::default(), None).is_ok());
    /// assert!(Pipeline::new(&Config::for_mode(Mode::Paper), None).is_err(), "the paper's network needs weights");
    /// ```
    ///
    /// # Errors
    /// A setting that cannot work, with what was expected and found.
    pub fn new(config: &Config, weights: Option<&Weights>) -> Result<Self, Error> {
        Ok(Self {
            mountings: Mountings::new(&config.detect, &config.site),
            background: Background::new(&config.detect, &config.site),
            clocks: Clocks::new(&config.detect, &config.site),
            clusterer: Clusterer::new(&config.detect, &config.site),
            measurer: Measurer::new(&config.detect, &config.site),
            views: Views::default(),
            priors: Vec::new(),
            tracker: Tracker::new(&config.track, &config.site),
            windows: Windows::default(),
            forecaster: Forecaster::new(&config.forecast, weights)?,
            caster: Caster::new(&config.blockage, &config.site),
            fader: Fader::new(&config.site),
            binder: Binder::new(&config.site),
            listener: Listener::new(&config.site),
            decider: Decider::new(&config.site),
            outcome: Outcome::default(),
        })
    }

    /// Lets so many threads share scans and links of a frame that has many; one does it all from the start. What a step gives does
    /// not depend on it.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// use umbracast::Pipeline;
    ///
    /// let mut alone = Pipeline::new(&umbracast::Config::default(), None)?;
    /// let mut shared = alone.clone();
    /// shared.use_threads(8);
    /// assert_eq!(alone.step(&ray(1, 14.0)), shared.step(&ray(1, 14.0)));
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn use_threads(&mut self, threads: usize) {
        self.background.use_threads(threads);
        self.caster.use_threads(threads);
    }

    /// Learns the empty scene from a frame without people. Without any, the background is learned on the way.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// use umbracast::Pipeline;
    ///
    /// let mut pipeline = Pipeline::new(&config, None)?;
    /// pipeline.learn_empty(&ray(0, 15.5));
    /// assert!(pipeline.step(&ray(1, 15.5)).foreground.is_empty());
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn learn_empty(&mut self, frame: &Frame) {
        let health = &mut self.outcome.health;
        self.background.learn_empty(&self.mountings.follow(&frame.usable(health), health));
    }

    /// Takes what access points heard of devices since the last step, and which of them serve whom. Reports may be half a second
    /// late; what is of no use is skipped and counted ([`Binder::skipped`]).
    ///
    /// ```
    /// use umbracast::{Config, Pipeline, radio::Report};
    ///
    /// let mut pipeline = Pipeline::new(&Config::default(), None)?;
    /// // Access points of the default site have no radio, so nothing can be made of it.
    /// pipeline.hear(&[Report { time_ns: 0, access_point: 0, device: 7, power_dbm: -61.0, serves: false }]);
    /// assert_eq!(pipeline.binder().skipped(), 1);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn hear(&mut self, reports: &[Report]) {
        self.binder.hear(reports);
    }

    /// What compares devices with tracks.
    pub fn binder(&self) -> &Binder {
        &self.binder
    }

    /// One frame through all stages.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// use umbracast::Pipeline;
    ///
    /// let mut pipeline = Pipeline::new(&config, None)?;
    /// assert_eq!(pipeline.step(&ray(5, 15.5)).frame, 5);
    /// // A frame that is not later than the last one is counted and gives nothing.
    /// assert_eq!(pipeline.step(&ray(4, 15.5)).health.frames_out_of_order, 1);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn step(&mut self, frame: &Frame) -> &Outcome {
        let o = &mut self.outcome;
        if !o.begin(frame) {
            return &self.outcome;
        }
        let frame = &*frame.usable(&mut o.health);
        let frame = &*self.mountings.follow(frame, &mut o.health);
        self.mountings.moved().iter().for_each(|&sensor| self.background.forget(sensor));
        self.tracker.priors(frame.time_ns, &mut self.priors);
        self.background.foreground(frame, &self.priors, &mut o.health, &mut o.foreground);
        self.clocks.put_right(&mut o.foreground);
        self.clusterer.clusters(&o.foreground, &self.priors, &mut o.clusters);
        self.clocks.follow(&o.foreground, &o.clusters, &self.priors);
        self.measurer.detections(&o.foreground, &o.clusters, &self.priors, &mut o.detections);
        self.views.take(frame);
        self.tracker.update(&self.views, &o.detections, &mut o.tracks);
        self.forecaster.forecast(&o.tracks, &mut o.forecasts);
        o.health.clocks_corrected = self.clocks.corrected();
        self.links()
    }

    /// The tracks of another program through stages 2 and 3, for who follows people by other means: positions and velocities in
    /// the site's frame ([`Track::new`]), in order of id. The observation windows are kept here. A person who is missing in a
    /// frame is somebody new afterwards.
    ///
    /// ```
    /// use umbracast::{Config, Pipeline, geometry::DVec2, track::Track};
    ///
    /// let mut pipeline = Pipeline::new(&Config::default(), None)?;
    /// for k in 0..20 {
    ///     let walks = Track::new(3, DVec2::new(0.12 * k as f64, 0.0), DVec2::new(1.2, 0.0));
    ///     let outcome = pipeline.step_tracks(k, (k as i64 + 1) * umbracast::STEP_NS, &[walks]);
    ///     assert_eq!((outcome.forecasts.len(), outcome.blockages.len()), (1, 2), "two access points");
    /// }
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn step_tracks(&mut self, frame: u64, time_ns: i64, tracks: &[Track]) -> &Outcome {
        if !self.take_tracks(frame, time_ns, tracks) {
            return &self.outcome;
        }
        self.forecaster.forecast(&self.outcome.tracks, &mut self.outcome.forecasts);
        self.links()
    }

    /// The same with forecasts of one's own: one for each track, in the same order.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// use umbracast::{Config, Pipeline};
    ///
    /// let (tracks, mut pipeline) = (two_people(), Pipeline::new(&Config::default(), None)?);
    /// let mut forecasts = forecasts_of(&tracks);
    /// // The one in front is about to step aside.
    /// forecasts[1].steps[8].mean_m.y += 3.0;
    /// assert_eq!(pipeline.step_forecasts(0, 100_000_000, &tracks, &forecasts).forecasts, forecasts);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn step_forecasts(
        &mut self,
        frame: u64,
        time_ns: i64,
        tracks: &[Track],
        forecasts: &[Forecast],
    ) -> &Outcome {
        if !self.take_tracks(frame, time_ns, tracks) {
            return &self.outcome;
        }
        self.outcome.forecasts.clear();
        self.outcome.forecasts.extend_from_slice(forecasts);
        self.links()
    }

    /// A frame that holds nothing but tracks. False where it does not lie after the last one.
    fn take_tracks(&mut self, frame: u64, time_ns: i64, tracks: &[Track]) -> bool {
        let frame = Frame { index: frame, time_ns, scans: Vec::new() };
        let later = self.outcome.begin(&frame);
        if later {
            self.outcome.tracks.clear();
            self.outcome.tracks.extend_from_slice(tracks);
            self.windows.follow(time_ns, &mut self.outcome.tracks);
        }
        later
    }

    /// Stage 3 and what follows it, on the outcome's tracks and forecasts.
    fn links(&mut self) -> &Outcome {
        let o = &mut self.outcome;
        self.caster.cast(&o.tracks, &o.forecasts, &mut o.blockages);
        self.fader.fade(&self.caster, &mut o.losses);
        self.binder.bind(o.time_ns, &o.tracks, &o.losses, &mut o.bindings);
        self.listener.sharpen(o.time_ns, &o.tracks, &self.caster, &self.binder, &mut o.blockages);
        self.binder.served().for_each(|served| self.decider.serve(&served));
        self.decider.decide(o.time_ns, &o.tracks, &o.losses, self.fader.outages(), &mut o.decisions);
        let fewer = self.caster.took_fewer_samples() || self.fader.took_fewer_samples();
        o.health.frames_with_fewer_samples += u64::from(fewer);
        o
    }

    /// How far sensors' clocks were found apart.
    ///
    /// ```
    /// use umbracast::{Config, Pipeline};
    ///
    /// assert_eq!(Pipeline::new(&Config::default(), None)?.clocks().corrected(), 0, "nothing was seen");
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn clocks(&self) -> &Clocks {
        &self.clocks
    }

    /// The samples of the last step: in which of them each link is out, and when.
    pub fn outages(&self) -> &Outages {
        self.fader.outages()
    }

    /// From the next step on links are those of this configuration's access points, UE and stage 3; everybody stays
    /// followed. Whatever else differs needs a pipeline of its own.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let mut config = umbracast::Config::default();
    /// use umbracast::Pipeline;
    ///
    /// let mut pipeline = Pipeline::new(&config, None)?;
    /// pipeline.step(&ray(0, 15.5));
    /// config.site.access_points.truncate(1);
    /// pipeline.take_over_links(&config);
    /// assert_eq!(pipeline.step(&ray(1, 15.5)).frame, 1);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn take_over_links(&mut self, config: &Config) {
        let threads = self.caster.threads();
        self.caster = Caster::new(&config.blockage, &config.site);
        self.caster.use_threads(threads);
        self.fader = Fader::new(&config.site);
        self.binder = Binder::new(&config.site);
        self.listener = Listener::new(&config.site);
        self.decider = Decider::new(&config.site);
    }
}
