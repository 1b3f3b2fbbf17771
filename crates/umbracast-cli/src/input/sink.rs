//! Where frames go, whatever they come from.

use umbracast::Error;
use umbracast::lidar::{Assembler, Frame};

/// Takes every frame.
pub type Sink<'a> = &'a mut dyn FnMut(&Frame) -> Result<(), Error>;

/// Hands on what an assembler has closed.
pub fn drain(assembler: &mut Assembler, sink: Sink) -> Result<(), Error> {
    while let Some(frame) = assembler.pop() {
        sink(&frame)?;
    }
    Ok(())
}
