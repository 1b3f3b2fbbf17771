//! Forecasts from everybody's true state, computed once for each mode of the error budget. Rolling out the LSTM takes
//! most of its time.

use umbracast::Error;
use umbracast::config::{ForecastConfig, ForecastMethod};
use umbracast::forecast::{Forecast, Forecaster, Weights};
use umbracast::track::Track;

/// Those of one scene with one network, kept for the next mode.
#[derive(Debug, Default)]
pub struct TrueForecasts {
    /// By whom, and by frame.
    last: Option<(ForecastConfig, Vec<Vec<Forecast>>)>,
}

impl TrueForecasts {
    /// By frame. The last mode's serve again where the LSTM made them with the same settings: all that it reads is
    /// the truth's. (The residual reads headings, and who stands has that of the mode's track.)
    ///
    /// # Errors
    /// The forecast needs weights and there are none.
    pub fn of(
        &mut self,
        config: &ForecastConfig,
        weights: Option<&Weights>,
        tracks: &[Vec<Track>],
    ) -> Result<&[Vec<Forecast>], Error> {
        let by_lstm = config.method == ForecastMethod::Lstm;
        let last = self.last.take().filter(|(by, _)| by_lstm && by == config);
        let made = match last {
            Some(same) => same,
            None => {
                let mut forecaster = Forecaster::new(config, weights)?;
                let mut forecast = |tracks: &Vec<Track>| {
                    let mut forecasts = Vec::new();
                    forecaster.forecast(tracks, &mut forecasts);
                    forecasts
                };
                (config.clone(), tracks.iter().map(&mut forecast).collect())
            }
        };
        Ok(&self.last.insert(made).1)
    }
}
