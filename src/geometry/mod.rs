//! Poses, boxes and the slab test. Metres, radians, right-handed, z up.

mod pose;
mod aabb;
mod obb;
mod linear;
mod sectors;
#[doc(hidden)] // For the truth, the ladder and the benchmark; a user asks the caster.
pub mod slab;

pub use aabb::Aabb;
pub use glam::{DMat3, DVec2, DVec3};
pub(crate) use linear::cholesky;
pub use obb::Obb;
pub use pose::Pose;
pub(crate) use sectors::{Covered, Sectors};
