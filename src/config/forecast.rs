//! Choices of `forecast`.

use serde::{Deserialize, Serialize};

use super::mechanism::Mechanism;

/// See `config/default.toml` for every value and its reason.
///
/// ```
/// assert_eq!(umbracast::Config::default().forecast.seed, 1);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForecastConfig {
    /// The method of the forecast.
    pub method: ForecastMethod,
    /// How the LSTM goes on from one step to the next.
    pub rollout: Rollout,
    /// Of the draws.
    pub seed: u64,
    /// Mechanisms left out.
    pub without: Vec<Mechanism>,
}

/// Who foresees.
///
/// ```
/// use umbracast::{Config, config::ForecastMethod};
///
/// assert_eq!(Config::default().forecast.method, ForecastMethod::Residual);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ForecastMethod {
    /// The filtered state carried on.
    ConstantVelocity,
    /// The same, and what a small network says of the departure from it.
    Residual,
    /// The paper's network.
    Lstm,
}

/// What an LSTM step feeds to the next.
///
/// ```
/// use umbracast::{Config, config::Rollout};
///
/// assert_eq!(Config::default().forecast.rollout, Rollout::Mean);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rollout {
    /// The mean of its Gaussian.
    Mean,
    /// A draw from it.
    Draw,
}
