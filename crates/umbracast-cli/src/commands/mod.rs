//! One module a command.

pub mod config;
pub mod demo;
pub mod evaluate;
pub mod inspect;
pub mod run;
pub mod simulate;
#[cfg(feature = "train")]
pub mod train;
