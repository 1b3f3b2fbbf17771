//! Crowds, walking bodies, simulated LiDARs and ground truth.
//!
//! The simulator uses the runtime's types (site, poses, sensor models, packets) and never its algorithms, because
//! truth and prediction must not share a bug.

pub mod random;
pub mod crowd;
pub mod body;
pub mod sensor;
pub mod truth;
pub mod scene;
