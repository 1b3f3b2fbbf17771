//! Stage 2: where each person will be at the next [`STEPS`] steps (paper, section IV-B).

mod gaussian;
#[doc(hidden)] // The baseline of every score; `Forecaster` chooses by the config.
pub mod constant_velocity;
#[doc(hidden)] // What the residual network reads, for its training.
pub mod inputs;
#[doc(hidden)] // The residual network, for its training.
pub mod residual;
mod lstm_cell;
#[doc(hidden)] // The shape of the LSTM, for its training; users meet `Weights`.
pub mod lstm;
mod forecaster;

pub use forecaster::Forecaster;
pub use gaussian::Gaussian2;
pub use lstm::Weights;
#[doc(hidden)] // For its training and for the command that shows it.
pub use residual::Residual;

use crate::STEPS;

/// The next second of one track.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let tracks = walker();
/// # let forecasts = forecasts_of(&tracks);
/// // How much farther somebody is in 900 ms who walks 1.2 m/s.
/// let way_m = forecasts[0].steps[8].mean_m - tracks[0].position_m;
/// assert!((0.8..1.3).contains(&way_m.x), "{way_m}");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// Whose.
    pub track: u64,
    /// Position at steps 1..=9 after the frame, each 100 ms on.
    pub steps: [Gaussian2; STEPS],
    /// How the errors of the steps hang together, for windows: see [`Coupling`].
    pub coupling: Coupling,
}

/// The joint distribution of the steps' errors. The error at time t after the frame is that of the position
/// now, plus t times that of the velocity now, plus what an unforeseen acceleration adds (white, spectral
/// density `acceleration_psd_m2ps3`). [`Gaussian2`] of each step is the marginal of the same. The LSTM gives marginals
/// only; with it this is the filter's.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let tracks = walker();
/// # let forecasts = forecasts_of(&tracks);
/// // Step h is the marginal at its time: P_pp + 2 t P_pv + t^2 P_vv + q t^3 / 3.
/// let (joint, t_s) = (&forecasts[0].coupling, 0.3);
/// let [p, v, both] = [joint.state[0][0], joint.state[2][2], joint.state[0][2]];
/// let xx_m2 = p + 2.0 * t_s * both + t_s * t_s * v + joint.acceleration_psd_m2ps3[0][0] * t_s.powi(3) / 3.0;
/// assert!((forecasts[0].steps[2].xx_m2 - xx_m2).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Covariance of (x, y, vx, vy) now.
    pub state: [[f64; 4]; 4],
    /// Over x and y, m^2/s^3; symmetric.
    pub acceleration_psd_m2ps3: [[f64; 2]; 2],
}
