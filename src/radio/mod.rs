//! What a body costs a radio path, in dB.

pub mod fresnel;
mod passage;
pub mod models;

pub use passage::{Passage, Rectangle};
