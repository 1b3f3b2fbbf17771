//! Umbracast on many hosts: the stages as nodes over Zenoh.

pub mod role;
pub mod keys;
pub mod network;
pub mod hall;
pub mod front;
pub mod join;
pub mod lead;
pub mod chain;
pub mod back;
pub mod watch;
pub mod share;
pub mod node;

pub use node::{Node, Settings, Source};
