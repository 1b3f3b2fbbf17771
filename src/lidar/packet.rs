//! The packet codec: bytes to columns and back. Layout, timing and units are those of the Velodyne HDL-32E and
//! VLP-16 manuals; all numbers little-endian.
//!
//! A payload is 12 blocks of 100 bytes, then the time of the first firing in microseconds within the hour (u32),
//! the return mode and the model's byte. A block is the flag `FF EE`, the azimuth of its first firing in
//! hundredths of a degree (u16), and 32 returns: distance in 2 mm (u16, 0 for none) and reflectivity (u8). A
//! block holds one column of an HDL-32E, two of a VLP-16.

use super::{Column, Model};
use crate::Health;

/// Length of a whole payload, bytes.
pub const PAYLOAD_BYTES: usize = 1206;

const BLOCKS: usize = 12;
const BLOCK_BYTES: usize = 100;
const RETURNS_PER_BLOCK: usize = 32;
const FLAG: [u8; 2] = [0xff, 0xee];
const STRONGEST: u8 = 0x37;
const LAST: u8 = 0x38;
const DUAL: u8 = 0x39;
const RANGE_UNIT_M: f32 = 0.002;
const TURN_CDEG: u32 = 36_000;
const HOUR_NS: i64 = 3_600_000_000_000;
/// Times beyond this (146 years from the epoch) are no sensor's; below it sums of times cannot overflow.
pub(super) const TIME_LIMIT_NS: u64 = 1 << 62;

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
    /// Host time at reception; settles the hour that the packet's own clock leaves open.
    pub time_ns: i64,
    /// The payload, 1206 bytes when whole.
    pub payload: Vec<u8>,
}

/// How many columns a whole packet of a sensor holds.
#[doc(hidden)] // For what sends packets: the simulator and tests.
pub fn columns_per_packet(model: &Model) -> usize {
    BLOCKS * model.columns_per_block
}

/// Decodes one packet: calls `sink` for each column with its ranges in metres (0 for no return) and
/// reflectivities, one a beam in firing order. What cannot be understood is counted and skipped as a whole.
///
/// A column's time is the packet's own, in the hour that brings it nearest to the time of reception. Between the
/// azimuths that the packet gives the head turns at the packet's own rate.
///
/// Packets with two returns a firing hold each column twice, the last return in the even block and the strongest,
/// or the second strongest where the last one is the strongest, in the odd one. Of the two the more reflecting is
/// given.
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
    let Ok(payload) = <&[u8; PAYLOAD_BYTES]>::try_from(packet.payload.as_slice()) else {
        health.packets_wrong_size += 1;
        return;
    };
    let Some(head) = Head::read(model, packet.time_ns, payload) else {
        health.packets_not_understood += 1;
        return;
    };
    let beams = model.beams.len();
    for firing in 0..BLOCKS / head.blocks_per_firing {
        let mut range_m = [0.0; RETURNS_PER_BLOCK];
        let mut reflectivity = [0; RETURNS_PER_BLOCK];
        let first = firing * head.blocks_per_firing;
        for b in first..first + head.blocks_per_firing {
            for (i, bytes) in block(payload, b)[4..].chunks_exact(3).enumerate() {
                let distance = u16::from_le_bytes([bytes[0], bytes[1]]);
                if distance != 0 && bytes[2] >= reflectivity[i] {
                    range_m[i] = f32::from(distance) * RANGE_UNIT_M;
                    reflectivity[i] = bytes[2];
                }
            }
        }
        for k in 0..model.columns_per_block {
            let after_block_ns = k as f64 * model.column_period_ns;
            let after_packet_ns = (firing * model.columns_per_block + k) as f64 * model.column_period_ns;
            let azimuth_cdeg =
                f64::from(azimuth_cdeg(block(payload, first))) + head.rate_cdeg_per_ns * after_block_ns;
            let column = Column {
                time_ns: head.time_ns + after_packet_ns.round() as i64,
                azimuth_cdeg: (azimuth_cdeg % f64::from(TURN_CDEG)) as f32,
                azimuth_rate_cdeg_per_ns: head.rate_cdeg_per_ns as f32,
            };
            sink(column, &range_m[k * beams..][..beams], &reflectivity[k * beams..][..beams]);
        }
    }
}

/// Encodes columns that follow one another as the packet that their sensor would send: 12 of an HDL-32E, 24 of a
/// VLP-16. Ranges and reflectivities stand column by column, beams in firing order; 0 is no return, and so is
/// what the format cannot hold. Fewer columns are filled up with columns without returns.
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
    let beams = model.beams.len();
    assert!(
        (1..=columns_per_packet(model)).contains(&columns.len()),
        "{} columns in a packet",
        columns.len()
    );
    assert_eq!(range_m.len(), columns.len() * beams, "one range a column and beam");
    assert_eq!(reflectivity.len(), range_m.len(), "one reflectivity a range");

    let mut payload = Vec::with_capacity(PAYLOAD_BYTES);
    for b in 0..BLOCKS {
        let first = b * model.columns_per_block;
        payload.extend_from_slice(&FLAG);
        payload.extend_from_slice(&azimuth_of(model, columns, first).to_le_bytes());
        for i in first * beams..(first + model.columns_per_block) * beams {
            let range_m = range_m.get(i).copied().unwrap_or(0.0);
            // The cast takes what is negative or not a number to 0.
            let distance = (range_m / RANGE_UNIT_M).round() as u32;
            payload.extend_from_slice(&u16::try_from(distance).unwrap_or(0).to_le_bytes());
            payload.push(reflectivity.get(i).copied().unwrap_or(0));
        }
    }
    let within_hour_us = columns[0].time_ns.rem_euclid(HOUR_NS) / 1000;
    payload.extend_from_slice(&(within_hour_us as u32).to_le_bytes());
    payload.extend_from_slice(&[STRONGEST, model.product_id]);
    Packet { time_ns: packet_time_ns, payload }
}

/// What a packet says once.
struct Head {
    /// When the first column fired.
    time_ns: i64,
    /// How fast the head turns.
    rate_cdeg_per_ns: f64,
    /// 2 when each column comes with two returns.
    blocks_per_firing: usize,
}

impl Head {
    /// None for a packet that no sensor of this model sends.
    fn read(model: &Model, received_ns: i64, payload: &[u8; PAYLOAD_BYTES]) -> Option<Self> {
        let tail = &payload[BLOCKS * BLOCK_BYTES..];
        let blocks_per_firing = match tail[4] {
            STRONGEST | LAST => 1,
            DUAL => 2,
            _ => return None,
        };
        let blocks_ok = (0..BLOCKS)
            .map(|b| block(payload, b))
            .all(|block| block[..2] == FLAG && azimuth_cdeg(block) < TURN_CDEG);
        let pairs_ok = (0..BLOCKS).all(|b| {
            azimuth_cdeg(block(payload, b)) == azimuth_cdeg(block(payload, b - b % blocks_per_firing))
        });
        let model_ok =
            tail[5] == model.product_id && model.beams.len() * model.columns_per_block == RETURNS_PER_BLOCK;
        let within_hour_ns = i64::from(u32::from_le_bytes([tail[0], tail[1], tail[2], tail[3]])) * 1000;
        let time_ok = within_hour_ns < HOUR_NS && received_ns.unsigned_abs() < TIME_LIMIT_NS;
        if !(blocks_ok && pairs_ok && model_ok && time_ok) {
            return None;
        }
        let hour = (received_ns - within_hour_ns + HOUR_NS / 2).div_euclid(HOUR_NS);
        let last = BLOCKS - blocks_per_firing;
        let turned_cdeg =
            (azimuth_cdeg(block(payload, last)) + TURN_CDEG - azimuth_cdeg(block(payload, 0))) % TURN_CDEG;
        let columns = last / blocks_per_firing * model.columns_per_block;
        Some(Self {
            time_ns: hour * HOUR_NS + within_hour_ns,
            rate_cdeg_per_ns: f64::from(turned_cdeg) / (columns as f64 * model.column_period_ns),
            blocks_per_firing,
        })
    }
}

fn block(payload: &[u8; PAYLOAD_BYTES], b: usize) -> &[u8] {
    &payload[b * BLOCK_BYTES..][..BLOCK_BYTES]
}

fn azimuth_cdeg(block: &[u8]) -> u32 {
    u32::from(u16::from_le_bytes([block[2], block[3]]))
}

/// Azimuth of column `c` as a packet holds it; past the last one the head turns on.
fn azimuth_of(model: &Model, columns: &[Column], c: usize) -> u16 {
    let last = c.min(columns.len() - 1);
    let past_ns = (c - last) as f64 * model.column_period_ns;
    let column = &columns[last];
    let azimuth_cdeg = f64::from(column.azimuth_cdeg) + f64::from(column.azimuth_rate_cdeg_per_ns) * past_ns;
    (azimuth_cdeg.round() as i64).rem_euclid(i64::from(TURN_CDEG)) as u16
}

#[cfg(test)]
#[path = "packet_tests.rs"]
mod tests;
