//! The packet codec: bytes to columns and back.

use super::{Column, Model};
use crate::Health;

/// A sensor's UDP payload with the time it was received (simulation: sent).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// Host time at reception; settles the hour that the packet's own clock leaves open.
    pub time_ns: i64,
    /// The payload, 1206 bytes when whole.
    pub payload: Vec<u8>,
}

/// Decodes one packet: calls `sink` for each column with its ranges in metres (0 for no return) and
/// reflectivities, one a beam in firing order. What cannot be understood is counted and skipped.
pub fn decode(
    _model: &Model,
    _packet: &Packet,
    _health: &mut Health,
    _sink: impl FnMut(Column, &[f32], &[u8]),
) {
}
