//! Predict, associate, correct, birth, death.

use super::Track;
use crate::config::TrackConfig;
use crate::detect::{Detection, Prior};
use crate::{Frame, Site};

/// Follows people.
#[derive(Debug)]
pub struct Tracker {}

impl Tracker {
    /// Needs the site to know what each sensor can see.
    pub fn new(_config: &TrackConfig, _site: &Site) -> Self {
        Self {}
    }

    /// Last step's tracks predicted to `time_ns`.
    pub fn priors(&self, _time_ns: i64) -> Vec<Prior> {
        Vec::new()
    }

    /// Takes a frame's detections; `tracks` is every track alive at the frame's time, in order of `id`.
    pub fn update(&mut self, _frame: &Frame, _detections: &[Detection], tracks: &mut Vec<Track>) {
        tracks.clear();
    }
}
