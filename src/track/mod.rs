//! Stage 1, second half: detections of frame after frame joined to tracks (paper, section IV-A).
//!
//! `mixture.rs` is our tracker, `paper.rs` that of the paper's authors; the method chooses.

mod gaussian;
#[doc(hidden)] // Assignments, for scores that match tracks with people.
pub mod association;
#[doc(hidden)] // What tests and ablations turn.
pub mod numbers;
mod sway;
mod kalman;
mod limb_phase;
#[doc(hidden)] // For fits that need to know who is in free sight.
pub mod visibility;
mod height;
mod width;
mod person;
mod mixture;
mod paper;

pub use crate::gait::GaitPhase;
#[doc(hidden)] // Tests turn its numbers; `Tracker` chooses by the config.
pub use mixture::MixtureTracker;
#[doc(hidden)] // What tests and ablations turn.
pub use numbers::Numbers;
use paper::{PaperTracker, Variant};

use std::collections::VecDeque;

use crate::config::{TrackConfig, TrackMethod};
use crate::detect::{Detection, Prior};
use crate::geometry::{Aabb, DVec2, Obb};
use crate::{Frame, Site};

/// Positions of the observation window: 10 frames (paper, section V-B).
pub const OBSERVED: usize = 10;
/// Variance of a heading that may be any: even over a turn.
const ANY_HEADING_RAD2: f64 = std::f64::consts::PI * std::f64::consts::PI / 3.0;
/// How fast who stands may turn away from the last heading: 40 degrees (one sigma) in a second. A guess: nothing
/// that is measured here tells it.
const STANDING_TURN_RAD2PS: f64 = 0.5;

/// One standard deviation of the width scale of adults of whom nothing is known.
pub const WIDTH_SCALE_SIGMA: f64 = width::PRIOR_SIGMA;

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
///     let frame = frame(k);
///     tracker.update(&frame, &[detection(0.12 * k as f64, frame.time_ns)], &mut tracks);
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
    /// assert!(Tracker::new(&paper.track, &paper.site).priors(0).is_empty());
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
    ///     let frame = frame(k);
    ///     tracker.update(&frame, &[detection(0.12 * k as f64, frame.time_ns)], &mut tracks);
    /// }
    /// let expected = &tracker.priors(frame(20).time_ns)[0];
    /// assert!((expected.position_m.x - 0.12 * 20.0).abs() < 0.05 && expected.confirmed);
    /// ```
    pub fn priors(&self, time_ns: i64) -> Vec<Prior> {
        match &self.0 {
            Method::Mixture(tracker) => tracker.priors(time_ns),
            Method::Paper(_) => Vec::new(),
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
    /// tracker.update(&frame(0), &[detection(1.0, frame(0).time_ns)], &mut tracks);
    /// assert!(!tracks[0].confirmed, "one sighting is not enough");
    /// tracker.update(&frame(1), &[detection(1.0, frame(1).time_ns)], &mut tracks);
    /// assert!(tracks[0].confirmed);
    /// ```
    pub fn update(&mut self, frame: &Frame, detections: &[Detection], tracks: &mut Vec<Track>) {
        match &mut self.0 {
            Method::Mixture(tracker) => tracker.update(frame, detections, tracks),
            Method::Paper(tracker) => tracker.update(frame, detections, tracks),
        }
    }
}

/// One person followed over time, at the frame's instant.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let config = umbracast::Config::default();
/// # let (mut tracker, mut tracks) = (umbracast::track::Tracker::new(&config.track, &config.site), Vec::new());
/// # tracker.update(&frame(0), &[detection(1.0, frame(0).time_ns)], &mut tracks);
/// for track in tracks.iter().filter(|track| !track.confirmed) {
///     let sigma_m = track.covariance[0][0].sqrt();
///     assert!(track.id == 0 && track.position_m.x == 1.0 && sigma_m < 0.1);
/// }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Never used twice in a run.
    pub id: u64,
    /// Ground point of the body axis.
    pub position_m: DVec2,
    /// Its velocity.
    pub velocity_mps: DVec2,
    /// Of (x, y, vx, vy); metres and seconds.
    pub covariance: [[f64; 4]; 4],
    /// The trunk's, counter-clockwise from +x: the velocity's while walking, held while standing.
    pub heading_rad: f64,
    /// One standard deviation of `heading_rad`: what the velocity's covariance leaves open while walking, more
    /// with the time while standing, and 1.81 (any direction) for who has never walked.
    pub heading_sigma_rad: f64,
    /// Standing height, shoes and hair included; by the paper's method the last detection's highest point.
    pub height_m: f64,
    /// One standard deviation of `height_m`.
    pub height_sigma_m: f64,
    /// Depths and widths of the body beside those of a usual one of this height: 1.
    pub width_scale: f64,
    /// One standard deviation of `width_scale`.
    pub width_scale_sigma: f64,
    /// Where in the stride, as arms and legs tell it.
    pub gait: GaitPhase,
    /// Points of this frame's detection; 0 while it coasts.
    pub points: u32,
    /// False until the track has been seen often enough to be believed, and while it has been out of sight so long
    /// that its position says little.
    pub confirmed: bool,
    /// The person's box along the site's axes, at `position_m`.
    pub aabb: Aabb,
    /// The person's oriented box, at `position_m`.
    pub obb: Obb,
    /// The last states, oldest first, this frame's last: at most [`OBSERVED`].
    pub observed: VecDeque<Observed>,
}

/// A track's state at a frame of the observation window, as the filter held it then.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let config = umbracast::Config::default();
/// # let (mut tracker, mut tracks) = (umbracast::track::Tracker::new(&config.track, &config.site), Vec::new());
/// # tracker.update(&frame(0), &[detection(1.0, frame(0).time_ns)], &mut tracks);
/// let now = tracks[0].observed.back().expect("a track was seen at least once");
/// assert_eq!((now.time_ns, now.position_m), (100_000_000, tracks[0].position_m));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observed {
    /// The frame's.
    pub time_ns: i64,
    /// Position.
    pub position_m: DVec2,
    /// Velocity.
    pub velocity_mps: DVec2,
}

/// The observation window of a track.
#[derive(Debug, Clone, Default)]
struct Observations(VecDeque<Observed>);

impl Observations {
    fn push(&mut self, time_ns: i64, position_m: DVec2, velocity_mps: DVec2) {
        if self.0.len() == OBSERVED {
            self.0.pop_front();
        }
        self.0.push_back(Observed { time_ns, position_m, velocity_mps });
    }
}

fn seconds(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}
