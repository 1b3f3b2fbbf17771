//! Fits what the program learns from data. Each fit gives a file, or lines for a file, and a card with their origin.
//!
//! Small networks have their gradients written out here: the pose of a body (stage 1), the default forecast's residual
//! (stage 2). The predictor's body and the thresholds (stage 3) are found by search. The paper's LSTM needs a
//! framework and is fitted in `train/`, a workspace of its own. Its training data and its scores need no framework
//! and are here, so that every test run scores the weights that ship.

pub mod adam;
pub mod weights;
mod layer;
mod bodies;
mod stages;
mod sightings;
mod truth;
mod point_network;
pub mod pose;
pub mod samples;
pub mod residual;
pub mod departures;
pub mod outline;
pub mod body;
pub mod thresholds;
pub mod windows;
pub mod score;

pub use windows::Noise;

/// Seeds that training may draw scenes from (docs/CONVENTIONS.md).
pub const SCENE_SEEDS: std::ops::Range<u64> = 1..100_000;
