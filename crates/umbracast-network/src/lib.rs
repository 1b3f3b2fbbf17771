//! What a radio network gains from forecasts of blockage: access points, devices on people, procedures that take time and lose
//! commands, and policies that decide when to change. A closed loop, by simulation.
//!
//! Radio truth is made here, every 10 ms, from the silhouettes of the simulated meshes, by formulas and code of its own: nothing
//! of the runtime's `radio` is used for it, so that truth and prediction share no fault.

mod fresnel;
mod silhouette;
mod reflection;
pub mod truth;
pub mod foreseen;
pub mod device;
pub mod reports;
pub mod bound;
pub mod oracle;
pub mod policy;
pub mod case;
pub mod hall;
pub mod experiment;
pub mod fades;
pub mod passages;
pub mod trace;
pub mod dataset;
pub mod measured;
pub mod report;
