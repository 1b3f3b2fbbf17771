//! Umbracast on many hosts: the stages as nodes over Zenoh.

pub mod role;
pub mod keys;
pub mod secrets;
pub mod access;
pub mod ros2;
pub mod mqtt;
pub mod outward;
pub mod runtime;
pub mod network;
pub mod meet;
pub mod hall;
pub mod worker;
pub mod terms;
pub mod front;
pub mod bounds;
pub mod timekeeper;
pub mod join;
pub mod objects;
pub mod lead;
pub mod seat;
pub mod chain;
mod outlets;
pub mod back;
pub mod watch;
pub mod share;
pub mod summary;
pub mod node;
pub mod fleet;

pub use node::{Node, Settings, Source};
pub use zenoh::Session;
