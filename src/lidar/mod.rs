//! From a sensor's packets to a frame: sensor models, the packet codec, one revolution ([`Scan`]) and all
//! sensors together ([`Frame`]). Nothing after this module knows a sensor model.

mod model;
mod scan;
pub mod packet;
mod assemble;

pub use assemble::Assembler;
pub use model::{Beam, Model};
pub use packet::Packet;
#[doc(hidden)]
// A table for those who place a hundred thousand points a frame: the voxels and the simulator.
pub use scan::Azimuths;
pub use scan::{Cloud, Column, Frame, RangeImage, Scan, SensorPoint};
