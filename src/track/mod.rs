//! Stage 1, second half: joins the detections of successive frames to tracks (paper, section IV-A).
//!
//! `mixture` is our tracker and `paper` that of the paper's authors; the setting `method` chooses.

mod remembered;
mod gaussian;
mod frontier;
mod shortlist;
#[doc(hidden)] // Assignments, for scores that match tracks with people.
pub mod association;
#[doc(hidden)] // Measurements, for the fit of its numbers.
pub mod outline;
#[doc(hidden)] // What tests and ablations turn.
pub mod numbers;
mod sway;
mod kalman;
mod stride;
#[doc(hidden)] // For fits that need to know who is in free sight.
pub mod visibility;
mod height;
mod heading;
mod noise;
mod shape;
mod followed;
mod origin;
mod neighbours;
mod attached;
mod person;
mod given;
mod mixture;
mod paper;

pub use crate::gait::Gait;
pub use followed::{OBSERVED, Observed, Track, WIDTH_SCALE_SIGMA};
#[doc(hidden)] // For tracks that come over a wire, where stages are processes.
pub use given::Windows;
#[doc(hidden)] // Tests turn its numbers; `Tracker` chooses by the config.
pub use mixture::MixtureTracker;
#[doc(hidden)] // What tests and ablations turn.
pub use numbers::Numbers;
use paper::{PaperTracker, Variant};
use remembered::{Reading, Remembered, Words, Writing};
pub use shape::Canopy;

use crate::Site;
use crate::config::{TrackConfig, TrackMethod};
use crate::detect::{Detection, Prior};
use crate::lidar::Views;

/// Follows people by the method of the config.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let config = umbracast::Config::default();
/// use umbracast::track::Tracker;
///
/// // Somebody walks along x, 0.12 m a frame.
/// let (mut tracker, mut tracks) = (Tracker::new(&config.track, &config.site), Vec::new());
/// for k in 0..20 {
///     let views = views(k);
///     tracker.update(&views, &[detection(0.12 * k as f64, views.time_ns)], &mut tracks);
/// }
/// assert_eq!(tracks.len(), 1);
/// assert!(tracks[0].confirmed && (tracks[0].velocity_mps.x - 1.2).abs() < 0.1);
/// ```
#[derive(Debug, Clone)]
pub struct Tracker(Method);

#[derive(Debug, Clone)]
enum Method {
    Mixture(Box<MixtureTracker>),
    Paper(PaperTracker),
}

impl Tracker {
    /// Needs the site to know what each sensor can see.
    ///
    /// ```
    /// use umbracast::{Config, Mode, track::Tracker};
    ///
    /// let paper = Config::for_mode(Mode::Paper);
    /// let mut priors = Vec::new();
    /// Tracker::new(&paper.track, &paper.site).priors(0, &mut priors);
    /// assert!(priors.is_empty());
    /// ```
    pub fn new(config: &TrackConfig, site: &Site) -> Self {
        Self(match config.method {
            TrackMethod::Mixture => Method::Mixture(Box::new(MixtureTracker::new(config, site))),
            TrackMethod::Paper => Method::Paper(PaperTracker::new(Variant::Paper)),
            TrackMethod::Hdl => Method::Paper(PaperTracker::new(Variant::Hdl)),
        })
    }

    /// Last step's tracks predicted to `time_ns`; none by the paper's method, whose detection asks for none.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// use umbracast::track::Tracker;
    ///
    /// let (mut tracker, mut tracks) = (Tracker::new(&config.track, &config.site), Vec::new());
    /// for k in 0..20 {
    ///     let views = views(k);
    ///     tracker.update(&views, &[detection(0.12 * k as f64, views.time_ns)], &mut tracks);
    /// }
    /// let mut priors = Vec::new();
    /// tracker.priors(views(20).time_ns, &mut priors);
    /// let expected = &priors[0];
    /// assert!((expected.position_m.x - 0.12 * 20.0).abs() < 0.05 && expected.confirmed);
    /// ```
    pub fn priors(&self, time_ns: i64, priors: &mut Vec<Prior>) {
        match &self.0 {
            Method::Mixture(tracker) => tracker.priors(time_ns, priors),
            Method::Paper(_) => priors.clear(),
        }
    }

    /// All that it remembers, for a tracker elsewhere that goes on from here. Only this version of the program
    /// understands it.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// use umbracast::track::Tracker;
    ///
    /// let (mut tracker, mut tracks) = (Tracker::new(&config.track, &config.site), Vec::new());
    /// tracker.update(&views(0), &[detection(1.0, views(0).time_ns)], &mut tracks);
    /// let mut other = Tracker::new(&config.track, &config.site);
    /// assert!(other.take_up(&tracker.state()));
    /// // From here on both say the same.
    /// let mut same = Vec::new();
    /// tracker.update(&views(1), &[detection(1.1, views(1).time_ns)], &mut tracks);
    /// other.update(&views(1), &[detection(1.1, views(1).time_ns)], &mut same);
    /// assert_eq!(same, tracks);
    /// ```
    pub fn state(&self) -> Vec<u8> {
        let (mut writing, mut copy) = (Writing::default(), self.clone());
        copy.visit(&mut writing);
        writing.0
    }

    /// Remembers what another tracker of the same configuration did ([`Self::state`]). False, and nothing is changed,
    /// where the bytes are something else.
    ///
    /// ```
    /// use umbracast::{Config, track::Tracker};
    ///
    /// let config = Config::default();
    /// let mut tracker = Tracker::new(&config.track, &config.site);
    /// assert!(!tracker.take_up(b"something else"));
    /// ```
    pub fn take_up(&mut self, state: &[u8]) -> bool {
        let (mut reading, mut copy) = (Reading { bytes: state, whole: true }, self.clone());
        copy.visit(&mut reading);
        let whole = reading.whole && reading.bytes.is_empty();
        if whole {
            *self = copy;
        }
        whole
    }

    /// The `id` of who is born next.
    ///
    /// ```
    /// use umbracast::{Config, track::Tracker};
    ///
    /// let config = Config::default();
    /// let mut tracker = Tracker::new(&config.track, &config.site);
    /// tracker.renumber(|id| id, 5);
    /// assert_eq!((tracker.next_id(), tracker.ids()), (5, Vec::new()));
    /// ```
    pub fn next_id(&self) -> u64 {
        match &self.0 {
            Method::Mixture(tracker) => tracker.next_id(),
            Method::Paper(tracker) => tracker.next_id(),
        }
    }

    /// The `id` of everybody followed, ascending.
    pub fn ids(&self) -> Vec<u64> {
        match &self.0 {
            Method::Mixture(tracker) => tracker.ids().collect(),
            Method::Paper(tracker) => tracker.ids().collect(),
        }
    }

    /// Gives everybody another `id`, in the same order, and who is born next `next_id`: for trackers on several hosts that
    /// numbered people apart.
    pub fn renumber(&mut self, id: impl Fn(u64) -> u64, next_id: u64) {
        match &mut self.0 {
            Method::Mixture(tracker) => tracker.renumber(id, next_id),
            Method::Paper(tracker) => tracker.renumber(id, next_id),
        }
    }

    fn visit(&mut self, words: &mut impl Words) {
        match &mut self.0 {
            Method::Mixture(tracker) => tracker.visit(words),
            Method::Paper(tracker) => tracker.visit(words),
        }
    }

    /// Takes a frame's detections; `tracks` is every track alive at the frame's time, in order of `id`. A frame
    /// that is not later than the last one changes nothing.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// use umbracast::track::Tracker;
    ///
    /// let (mut tracker, mut tracks) = (Tracker::new(&config.track, &config.site), Vec::new());
    /// tracker.update(&views(0), &[detection(1.0, views(0).time_ns)], &mut tracks);
    /// assert!(!tracks[0].confirmed, "one sighting is not enough");
    /// tracker.update(&views(1), &[detection(1.0, views(1).time_ns)], &mut tracks);
    /// assert!(tracks[0].confirmed);
    /// ```
    pub fn update(&mut self, views: &Views, detections: &[Detection], tracks: &mut Vec<Track>) {
        match &mut self.0 {
            Method::Mixture(tracker) => tracker.update(views, detections, tracks),
            Method::Paper(tracker) => tracker.update(views.time_ns, detections, tracks),
        }
    }
}
