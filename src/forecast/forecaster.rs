//! One forecast a track, by the method of the config.

use super::{Forecast, Weights};
use crate::Error;
use crate::config::ForecastConfig;
use crate::track::Track;

/// Foresees.
#[derive(Debug)]
pub struct Forecaster {}

impl Forecaster {
    /// `weights` are needed by the method `lstm` only.
    ///
    /// # Errors
    /// The method needs weights and there are none.
    pub fn new(_config: &ForecastConfig, _weights: Option<&Weights>) -> Result<Self, Error> {
        Ok(Self {})
    }

    /// One forecast for each track, in the order of the tracks.
    pub fn forecast(&mut self, _tracks: &[Track], forecasts: &mut Vec<Forecast>) {
        forecasts.clear();
    }
}
