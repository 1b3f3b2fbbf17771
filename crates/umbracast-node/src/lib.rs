//! Umbracast on many hosts: the stages as nodes over Zenoh.

pub mod ros2;
