//! Stage 1, second half: detections of frame after frame joined to tracks (paper, section IV-A).
//!
//! [`mixture`] is our tracker, [`paper`] that of the paper's authors; the method chooses.

pub mod gaussian;
pub mod association;
pub mod numbers;
mod sway;
pub mod kalman;
mod limb_phase;
pub mod visibility;
mod height;
pub mod width;
mod followed;
mod person;
pub mod mixture;
pub mod paper;

pub use followed::{OBSERVED, Observed, Track, WIDTH_SCALE_SIGMA};
pub use mixture::MixtureTracker;
pub use numbers::Numbers;
pub use paper::{PaperTracker, Variant};

use crate::config::{TrackConfig, TrackMethod};
use crate::detect::{Detection, Prior};
use crate::{Frame, Site};

/// Follows people by the method of the config.
#[derive(Debug, Clone)]
pub struct Tracker(Method);

#[derive(Debug, Clone)]
enum Method {
    Mixture(Box<MixtureTracker>),
    Paper(PaperTracker),
}

impl Tracker {
    /// Needs the site to know what each sensor can see.
    pub fn new(config: &TrackConfig, site: &Site) -> Self {
        Self(match config.method {
            TrackMethod::Mixture => Method::Mixture(Box::new(MixtureTracker::new(config, site))),
            TrackMethod::Paper => Method::Paper(PaperTracker::new(Variant::Paper)),
            TrackMethod::Hdl => Method::Paper(PaperTracker::new(Variant::Hdl)),
        })
    }

    /// Last step's tracks predicted to `time_ns`; none by the paper's method, whose detection asks for none.
    pub fn priors(&self, time_ns: i64) -> Vec<Prior> {
        match &self.0 {
            Method::Mixture(tracker) => tracker.priors(time_ns),
            Method::Paper(_) => Vec::new(),
        }
    }

    /// Takes a frame's detections; `tracks` is every track alive at the frame's time, in order of `id`. A frame
    /// that is not later than the last one changes nothing.
    pub fn update(&mut self, frame: &Frame, detections: &[Detection], tracks: &mut Vec<Track>) {
        match &mut self.0 {
            Method::Mixture(tracker) => tracker.update(frame, detections, tracks),
            Method::Paper(tracker) => tracker.update(frame, detections, tracks),
        }
    }
}
