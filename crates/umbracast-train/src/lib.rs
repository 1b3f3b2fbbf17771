//! Fits the forecasters.
//!
//! The paper's LSTM: windows are cut from ORCA ways, the network is rolled out on them, and Adam follows the
//! gradient of the paper's loss. The default's residual network: scenes are run through stage 1, and it learns where
//! people went from what was seen of them. What comes out is a weights file that the runtime reads, and a card that
//! says where it comes from.

pub mod windows;
pub mod network;
pub mod adam;
pub mod gradient;
pub mod weights;
pub mod score;
pub mod card;
pub mod train;
pub mod samples;
pub mod residual;
pub mod departures;

pub use train::{Processor, Progress, TrainOptions, TrainedModel, train};
pub use windows::Noise;
