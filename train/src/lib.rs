//! Fits the paper's LSTM: windows are cut from ORCA ways, the network is rolled out on them, and Adam follows the
//! gradient of the paper's loss. The result is a weights file that the runtime reads, and a card with its origin.

pub mod network;
pub mod adam;
pub mod gradient;
pub mod weights;
pub mod card;
pub mod train;

pub use train::{Processor, Progress, TrainOptions, TrainedModel, train};
