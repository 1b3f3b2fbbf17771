//! Fits the paper's LSTM: windows are cut from ORCA ways, the network is rolled out on them, and Adam follows the
//! gradient of the paper's loss. What comes out is a weights file that the runtime reads, and a card that says where
//! it comes from.

pub mod network;
pub mod adam;
pub mod gradient;
pub mod weights;
pub mod card;
pub mod train;

pub use train::{Processor, Progress, TrainOptions, TrainedModel, train};
