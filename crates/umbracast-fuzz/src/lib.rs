//! What no input may do. A target gives bytes to a reader, a decoder or a stage, and panics where the promise at its
//! head is broken. libFuzzer (`fuzz/`) and the mutator ([`run`], the program of this crate) call the same targets.
//!
//! A promise is more than "no panic": an input that is understood gives numbers that the next stage can use, and an
//! input that is not understood gives an error.

pub mod mutate;
mod given;
pub mod targets;
pub mod bounded;
pub mod run;

pub use targets::{TARGETS, Target, target};
