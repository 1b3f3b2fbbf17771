//! From a sensor's packets to a frame: sensor models, a codec for each family of them, one revolution ([`Scan`]) and
//! all sensors together ([`Frame`]). Nothing after this module knows a sensor model.
//!
//! A family is one file (`velodyne`, `ouster`, `hesai`): bytes to columns and back. The table in `table` names the
//! models. A new sensor takes a line there, and a file if its packets are new.

mod beam;
mod scan;
mod abreast;
mod views;
mod model;
mod usable;
mod velodyne;
mod ouster;
mod hesai;
mod table;
pub mod packet;
mod clock;
mod assemble;

pub(crate) use abreast::{ABREAST, Abreast, Lanes};
pub use assemble::Assembler;
pub use beam::Beam;
pub use model::{Model, Turn};
pub use packet::Packet;
#[doc(hidden)]
// A table for those who place a hundred thousand points a frame: the voxels and the simulator.
pub use scan::Azimuths;
pub use scan::{Cloud, Column, Frame, RangeImage, Scan, SensorPoint};
pub use table::{sensor_model, sensor_models, udp_port};
#[doc(hidden)] // For times that other programs give.
pub use usable::is_time;
pub(crate) use views::sector;
pub use views::{Fan, SECTORS, View, Views};
