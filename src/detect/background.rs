//! Removes the points that belong to the empty scene.

use super::{Point, Prior};
use crate::config::DetectConfig;
use crate::{Error, Frame, Health, Site};

/// What the empty scene looks like to each sensor.
#[derive(Debug)]
pub struct Background {}

impl Background {
    /// Knows nothing yet.
    ///
    /// # Errors
    /// A setting that contradicts the site.
    pub fn new(_config: &DetectConfig, _site: &Site) -> Result<Self, Error> {
        Ok(Self {})
    }

    /// Learns from a frame without people (the paper's global map).
    pub fn learn_empty(&mut self, _frame: &Frame) {}

    /// The points that are new, in the site frame. Where no empty scan was learned, the background is learned
    /// on the way, but not where a person is expected.
    pub fn foreground(
        &mut self,
        _frame: &Frame,
        _priors: &[Prior],
        health: &mut Health,
        points: &mut Vec<Point>,
    ) {
        let _ = health;
        points.clear();
    }
}
