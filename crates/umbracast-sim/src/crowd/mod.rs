//! People's paths: ORCA crowds and replayed trajectories.

mod trajectory;
mod preset;
pub mod orca;
mod crossing;
mod whims;
pub mod mixed;
pub mod circle;
pub mod floor;
mod steering;
mod places;
mod indoors;
mod ground;
mod strolling;
mod speed_augmentation;
pub mod replay;
mod apart;

pub use apart::move_apart;
pub use circle::circle_crossing;
pub use ground::{Ground, drawn};
pub use mixed::pairs;
pub use preset::Preset;
pub use replay::{Recorded, replay};
pub use speed_augmentation::speed_augmented;
pub use strolling::{Stroll, strolling};
pub use trajectory::{Crowd, Trajectory};
