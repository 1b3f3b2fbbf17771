//! Poses, boxes and the slab test. Metres, radians, right-handed, z up.

pub mod pose;
pub mod aabb;
pub mod obb;
pub mod slab;

pub use aabb::Aabb;
pub use glam::{DMat3, DVec2, DVec3};
pub use obb::Obb;
pub use pose::Pose;
