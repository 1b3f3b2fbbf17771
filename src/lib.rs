//! Umbracast detects people with LiDARs, forecasts where each person will be within the next second, and says which
//! radio links a human body will block, with what probability, and when.
//!
//! Data flows one way: packets, scan, frame, foreground, clusters, detections, tracks, forecasts, blockages.
//! [`pipeline::Pipeline::step`] is that sentence as code. The modules below have the same order, and each uses only
//! modules above it.
//!
//! These pages show what a user needs. Items that only the crates beside this one need (training, scores, the
//! simulator) are public, hidden here, and may change with any version. `docs/METHODS.md` of the repository has the
//! equations of every stage.
//!
//! ```
//! use std::time::Duration;
//!
//! use umbracast::{Config, Health, Mode, Pipeline, lidar::Assembler};
//!
//! let config = Config::for_mode(Mode::Default);
//! let mut assembler = Assembler::new(&config.site)?;
//! let mut pipeline = Pipeline::new(&config, None)?;
//! let mut health = Health::default();
//! # let packets: Vec<(usize, umbracast::lidar::Packet)> = Vec::new();
//! for (sensor, packet) in &packets {
//!     assembler.push(*sensor, packet, &mut health);
//!     while let Some(frame) = assembler.pop() {
//!         for link in &pipeline.step(&frame).blockages {
//!             let p = link.p_within(Duration::from_millis(300));
//!             println!("track {} blocked within 300 ms: {p:.2}", link.track);
//!         }
//!     }
//! }
//! # Ok::<(), umbracast::Error>(())
//! ```

mod elementary;
mod shared;
pub mod error;
mod tensors;
pub mod geometry;
pub mod health;
pub mod site;
pub mod lidar;
pub mod config;
#[doc(hidden)] // For who calls the stages one by one, as `Pipeline` does.
pub mod mounting;
#[doc(hidden)] // What walking bodies have in common, for tracks, casts and their scores; users meet `track::Gait`.
pub mod gait;
pub mod detect;
pub mod track;
pub mod forecast;
pub mod blockage;
pub mod radio;
pub mod decide;
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

/// The README's examples are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
