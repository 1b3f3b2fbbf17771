//! Packets of several sensors, cut into frames by time.

use super::{Frame, Packet};
use crate::{Error, Health, Site};

/// Collects packets and gives frames. A frame closes when every sensor has gone past its end.
#[derive(Debug)]
pub struct Assembler {}

impl Assembler {
    /// For the sensors of a site.
    ///
    /// # Errors
    /// A sensor model that is not known.
    pub fn new(_site: &Site) -> Result<Self, Error> {
        Ok(Self {})
    }

    /// Takes one packet of `site.sensors[sensor]`.
    pub fn push(&mut self, _sensor: usize, _packet: &Packet, _health: &mut Health) {}

    /// The next closed frame.
    pub fn pop(&mut self) -> Option<Frame> {
        None
    }

    /// At the end of the input: closes what is open.
    pub fn finish(&mut self) {}
}
