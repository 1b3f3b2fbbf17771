//! One module for each command.

pub mod ablate;
pub mod calibrate;
pub mod cast;
pub mod export;
pub mod compare;
pub mod coverage;
pub mod evaluate;
#[cfg(feature = "node")]
pub mod fleet;
pub mod demo;
pub mod inspect;
pub mod live;
pub mod config;
pub mod network;
#[cfg(feature = "node")]
pub mod node;
pub mod check;
pub mod plan;
pub mod replay;
pub mod reproduce;
pub mod run;
pub mod simulate;
pub mod train;
pub mod view;
