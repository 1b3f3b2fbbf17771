//! Crowds, walking bodies, simulated LiDARs and ground truth.
//!
//! Uses the runtime's types (site, poses, sensor models, packets), never its algorithms: truth and prediction
//! must not share a bug.

pub mod random;
pub mod crowd;
pub mod body;
pub mod sensor;
pub mod truth;
pub mod scene;
