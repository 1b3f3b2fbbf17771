//! ROS 2 without an installation of ROS: topics as `rmw_zenoh` puts them on Zenoh, made so that `ros2 topic list` and `echo`
//! see ours, and the packets and clouds of existing drivers are read. Tried with clients in Python (`tests/peers.rs`), not with a
//! C++ `rmw_zenoh`.
//!
//! What `rmw_zenoh` 0.2 and later (Jazzy, Kilted, Rolling) agree on, and what is here for it:
//!
//! | | |
//! |---|---|
//! | key of a topic: domain, topic, type, hash of the type | [`names`] |
//! | liveliness tokens of nodes, publishers and subscribers | [`names`] |
//! | attachment of a message: number, time, sender | [`names`] |
//! | hash of a type, `RIHS01`, from its definition | [`type_hash()`] |
//! | payload: CDR, as in our recordings | `umbracast_io` |
//!
//! Written by hand, because it is little code: `hiroz` 0.2 does the same with nodes, services, actions and generated
//! types of its own beside our definitions, and calls itself experimental; `ros2-client` 0.12 sends a hash of zeros
//! for every type outside a small table, which `rmw_zenoh` need not accept.

mod type_hash;
pub mod names;
mod topics;
mod face;
mod drivers;

pub use drivers::{clouds, packets};
pub use face::Face;
pub use topics::{Node, Publisher, Subscriber};
pub use type_hash::type_hash;
