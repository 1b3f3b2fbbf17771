//! From a sensor's packets to a frame: sensor models, the packet codec, one revolution ([`Scan`]) and all
//! sensors together ([`Frame`]). Nothing after this module knows a sensor model.

pub mod model;
pub mod scan;
pub mod packet;
pub mod assemble;

pub use assemble::Assembler;
pub use model::{Beam, Model};
pub use packet::Packet;
pub use scan::{Azimuths, Cloud, Column, Frame, RangeImage, Scan, SensorPoint};
