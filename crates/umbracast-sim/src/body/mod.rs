//! Walking bodies: articulated meshes of published proportions with a gait that follows the speed.

pub mod build;
mod loft;
mod individual;
pub mod gait;
mod skeleton;
mod shape;
mod feet;
mod device;
mod facing;
mod fidget;
mod walk;
pub mod kind;
mod things;
mod carried;
mod gestures;
mod sitting;
mod recorded;
pub mod meshes;
mod walker;
mod bodies;

pub use bodies::Bodies;
pub use meshes::Meshes;
pub use recorded::Gait;
pub use shape::Surface;
pub use walker::{PersonState, Walker};

#[cfg(test)]
mod tests;
#[cfg(test)]
mod kind_tests;
#[cfg(test)]
mod carried_tests;
