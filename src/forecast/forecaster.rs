//! One forecast a track, by the method of the config.

use super::{Forecast, Weights, constant_velocity};
use crate::Error;
use crate::config::{ForecastConfig, ForecastMethod};
use crate::track::Track;

/// Foresees.
#[derive(Debug)]
pub struct Forecaster {
    config: ForecastConfig,
}

impl Forecaster {
    /// `weights` are needed by the method `lstm` only.
    ///
    /// # Errors
    /// The method needs weights and there are none, or the spread is no number.
    pub fn new(config: &ForecastConfig, weights: Option<&Weights>) -> Result<Self, Error> {
        let psd = config.acceleration_psd_m2ps3;
        if !psd.is_finite() || psd < 0.0 {
            return Err(Error::new(format!(
                "forecast.acceleration_psd_m2ps3: expected a number not below 0, found {psd}"
            )));
        }
        if config.method == ForecastMethod::Lstm && weights.is_none() {
            return Err(Error::new("forecast.method = \"lstm\": expected the network's weights, found none"));
        }
        Ok(Self { config: config.clone() })
    }

    /// One forecast for each track, in the order of the tracks.
    pub fn forecast(&mut self, tracks: &[Track], forecasts: &mut Vec<Forecast>) {
        forecasts.clear();
        let psd = self.config.acceleration_psd_m2ps3;
        forecasts.extend(tracks.iter().map(|track| constant_velocity::forecast(track, psd)));
    }
}
