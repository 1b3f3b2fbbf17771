//! Umbracast on many hosts: the stages as nodes over Zenoh.

pub mod role;
pub mod keys;
pub mod access;
pub mod network;
pub mod ros2;
