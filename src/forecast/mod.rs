//! Stage 2: where each person will be at the next [`STEPS`] steps (paper, section IV-B).

pub mod gaussian;
pub mod constant_velocity;
mod tensors;
pub mod inputs;
pub mod residual;
mod lstm_cell;
pub mod lstm;
pub mod forecaster;

pub use forecaster::Forecaster;
pub use gaussian::Gaussian2;
pub use lstm::Weights;
pub use residual::Residual;

use crate::STEPS;

/// The next second of one track.
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Covariance of (x, y, vx, vy) now.
    pub state: [[f64; 4]; 4],
    /// Over x and y, m^2/s^3; symmetric.
    pub acceleration_psd_m2ps3: [[f64; 2]; 2],
}
