//! Where frames of all inputs go.

use umbracast::Error;
use umbracast::lidar::{Assembler, Frame, Packet};

/// Takes every frame.
pub type Sink<'a> = &'a mut dyn FnMut(&Frame) -> Result<(), Error>;

/// Takes every packet, with its sensor's place in the site.
pub type PacketSink<'a> = &'a mut dyn FnMut(usize, Packet) -> Result<(), Error>;

/// Hands on what an assembler has closed.
pub fn drain(assembler: &mut Assembler, sink: Sink) -> Result<(), Error> {
    while let Some(frame) = assembler.pop() {
        sink(&frame)?;
    }
    Ok(())
}
