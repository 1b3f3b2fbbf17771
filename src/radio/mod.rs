//! What bodies cost radio links, in dB: now, and at each step of the forecast.

pub mod fresnel;
mod passage;
pub mod models;
mod edges;
mod kirchhoff;
mod body;
mod reflection;
mod report;
mod outages;
mod legs;
mod beyond;
mod links;
mod level;
mod bindings;
mod listener;

pub use bindings::Binder;
pub use edges::KnifeEdges;
pub use links::{Fader, Loss};
pub use listener::Listener;
pub use outages::Outages;
pub use passage::{Passage, Rectangle};
pub use reflection::{Reflection, Surface, reflections};
pub use report::{Binding, Report, Served};
