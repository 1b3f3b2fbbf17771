//! A sensor's packet, and the codec: bytes to columns and back. The families' files have the layouts.

use super::model::Refused;
pub use super::velodyne::PAYLOAD_BYTES;
use super::{Column, Model};
use crate::Health;

/// A sensor's UDP payload with the time it was received (simulation: sent).
///
/// ```
/// use umbracast::lidar::{Packet, packet::PAYLOAD_BYTES};
///
/// // As it comes from a socket: the bytes, and the host's time at which they came.
/// let packet = Packet { time_ns: 1_700_000_000_000_000_000, payload: vec![0; PAYLOAD_BYTES] };
/// assert_eq!(packet.payload.len(), 1206);
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// Host time at reception; settles what the packet's own clock leaves open, as the hour of a Velodyne's.
    pub time_ns: i64,
    /// The payload: 1206 bytes of a Velodyne, 1080 of an XT32, up to 33,024 of an Ouster.
    pub payload: Vec<u8>,
}

/// How many columns a whole packet of a sensor holds.
#[doc(hidden)] // For what sends packets: the simulator and tests.
pub fn columns_per_packet(model: &Model) -> usize {
    model.format.columns_per_packet(model)
}

/// Decodes one packet: calls `sink` for each column with its ranges in metres (0 for no return) and
/// reflectivities, one a beam in firing order. What cannot be understood is counted and skipped as a whole; what
/// holds no ranges (a Velodyne's position, an Ouster's motion) is skipped.
///
/// Where a sensor gives two returns a firing, the stronger is given: of a Velodyne and an XT32 the more reflecting, of
/// an Ouster the first, which is the strongest unless the sensor is told another order.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let packet = packets(1).remove(0);
/// use umbracast::{Health, lidar::{Model, packet::decode}};
///
/// let mut health = Health::default();
/// let mut returns = 0;
/// decode(&Model::hdl_32e(), &packet, &mut health, |_column, range_m, _reflectivity| {
///     returns += range_m.iter().filter(|&&range_m| range_m > 0.0).count();
/// });
/// assert_eq!(returns, 12 * 32);
/// ```
pub fn decode(
    model: &Model,
    packet: &Packet,
    health: &mut Health,
    mut sink: impl FnMut(Column, &[f32], &[u8]),
) {
    match model.format.decode(model, packet.time_ns, &packet.payload, &mut sink) {
        Ok(()) | Err(Refused::NoRanges) => {}
        Err(Refused::WrongSize) => health.packets_wrong_size += 1,
        Err(Refused::NotUnderstood) => health.packets_not_understood += 1,
    }
}

/// Encodes columns that follow one another as the packet that their sensor would send: 12 of an HDL-32E, 24 of a
/// VLP-16, 16 of an Ouster, 8 of an XT32. Ranges and reflectivities stand column by column, beams in firing order; 0 is
/// no return, and so is what the format cannot hold. Fewer columns are filled up with columns without returns.
///
/// # Panics
/// When there is no column or more than a packet holds, or when ranges or reflectivities are not one a column
/// and beam.
#[doc(hidden)] // For what sends packets: the simulator and tests.
pub fn encode(
    model: &Model,
    columns: &[Column],
    range_m: &[f32],
    reflectivity: &[u8],
    packet_time_ns: i64,
) -> Packet {
    assert!(
        (1..=columns_per_packet(model)).contains(&columns.len()),
        "{} columns in a packet",
        columns.len()
    );
    assert_eq!(range_m.len(), columns.len() * model.beams.len(), "one range a column and beam");
    assert_eq!(reflectivity.len(), range_m.len(), "one reflectivity a range");
    Packet { time_ns: packet_time_ns, payload: model.format.encode(model, columns, range_m, reflectivity) }
}

/// The packet of columns without any return: what the sensor says of their times and azimuths.
///
/// # Panics
/// When there is no column or more than a packet holds.
#[doc(hidden)] // See `encode`.
pub fn encode_columns(model: &Model, columns: &[Column], packet_time_ns: i64) -> Packet {
    assert!(
        (1..=columns_per_packet(model)).contains(&columns.len()),
        "{} columns in a packet",
        columns.len()
    );
    Packet { time_ns: packet_time_ns, payload: model.format.encode(model, columns, &[], &[]) }
}

#[cfg(test)]
#[path = "packet_tests.rs"]
pub(super) mod tests;
