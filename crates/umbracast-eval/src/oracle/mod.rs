//! Stage 3 with parts of the truth: the baselines, the error budget, and the ladder of oracles.

pub mod true_forecasts;
pub mod replaced;
pub mod true_bodies;
pub mod ladder;
