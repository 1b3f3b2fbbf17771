//! Fits the forecasters: the paper's LSTM on trajectories of simulated crowds.
//!
//! Windows are cut from ORCA ways, a network is rolled out on them, and Adam follows the gradient of the paper's
//! loss. What comes out is a weights file that the runtime reads, and a card that says where it comes from.

pub mod windows;
pub mod network;
pub mod adam;
pub mod weights;
pub mod score;
pub mod card;
pub mod train;

pub use train::{Processor, Progress, TrainOptions, TrainedModel, train};
pub use windows::Noise;
