//! Umbracast sees people with LiDARs, foresees where each will be in the next second, and tells which radio
//! links a human body is about to block, how likely, and when.
//!
//! Data flows one way: packets, scan, frame, foreground, clusters, detections, tracks, forecasts, blockages.
//! [`pipeline::Pipeline::step`] is that sentence as code. The modules below stand in the same order, and each
//! uses only what stands above it.

pub mod error;
pub mod geometry;
pub mod health;
pub mod site;
pub mod config;
pub mod lidar;
pub mod detect;
pub mod track;
pub mod forecast;
pub mod blockage;
pub mod pipeline;

pub use config::{Config, Mode};
pub use error::Error;
pub use health::Health;
pub use lidar::Frame;
pub use pipeline::{Outcome, Pipeline};
pub use site::Site;

/// How many forecast steps, and so the longest window: 9 steps of 100 ms (paper, Table I).
pub const STEPS: usize = 9;
/// One filter step and one forecast step, nanoseconds: 100 ms at the sensors' 10 Hz.
pub const STEP_NS: i64 = 100_000_000;
/// The same in seconds.
pub const STEP_S: f64 = 0.1;
