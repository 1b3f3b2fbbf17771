//! What is done to packets on their way while something fails.

use umbracast::lidar::Packet;
use umbracast_live::receive::Arrived;

/// Gives what becomes of a packet; packets may be held back for later.
pub type Harm = fn(Arrived, &mut Vec<Arrived>) -> Vec<Arrived>;

const HOUR_NS: u64 = 3_600_000_000_000;

pub fn none(arrived: Arrived, _: &mut Vec<Arrived>) -> Vec<Arrived> {
    vec![arrived]
}

pub fn silent(arrived: Arrived, _: &mut Vec<Arrived>) -> Vec<Arrived> {
    if arrived.sensor == 0 { vec![] } else { vec![arrived] }
}

/// About one packet of so many is lost.
pub fn lost<const OF: u64>(arrived: Arrived, _: &mut Vec<Arrived>) -> Vec<Arrived> {
    if one_of(OF, &arrived) { vec![] } else { vec![arrived] }
}

/// About one packet of so many is changed, every 97th byte of it.
pub fn corrupted<const OF: u64>(mut arrived: Arrived, _: &mut Vec<Arrived>) -> Vec<Arrived> {
    if one_of(OF, &arrived) {
        let bytes = arrived.packet.payload.iter_mut().step_by(97);
        bytes.for_each(|byte| *byte = byte.wrapping_mul(29).wrapping_add(113));
    }
    vec![arrived]
}

pub fn cut_in_half(mut arrived: Arrived, _: &mut Vec<Arrived>) -> Vec<Arrived> {
    arrived.packet.payload.truncate(arrived.packet.payload.len() / 2);
    vec![arrived]
}

pub fn eight_in_reverse(arrived: Arrived, held: &mut Vec<Arrived>) -> Vec<Arrived> {
    held.push(arrived);
    if held.len() < 8 { vec![] } else { held.drain(..).rev().collect() }
}

pub fn ten_times(arrived: Arrived, _: &mut Vec<Arrived>) -> Vec<Arrived> {
    vec![arrived; 10]
}

pub fn zeros_beside(arrived: Arrived, _: &mut Vec<Arrived>) -> Vec<Arrived> {
    let zeros = Packet { payload: vec![0; arrived.packet.payload.len()], ..arrived.packet };
    vec![Arrived { packet: zeros, ..arrived }, arrived]
}

/// The microseconds within the hour that a Velodyne's packet ends with, moved: half an hour is as far as it can be told.
pub fn velodyne_half_an_hour_off(mut arrived: Arrived, _: &mut Vec<Arrived>) -> Vec<Arrived> {
    let at = arrived.packet.payload.len() - 6;
    if arrived.sensor == 0
        && let Some(bytes) = arrived.packet.payload.get_mut(at..at + 4)
    {
        let us = u64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
        let moved = (us + HOUR_NS / 2000) % (HOUR_NS / 1000);
        bytes.copy_from_slice(&(moved as u32).to_le_bytes());
    }
    vec![arrived]
}

/// The nanoseconds that each of the 16 columns of an Ouster's packet begins with, between a header and a footer of 32 bytes.
pub fn ouster_an_hour_off(mut arrived: Arrived, _: &mut Vec<Arrived>) -> Vec<Arrived> {
    let column_bytes = (arrived.packet.payload.len() - 64) / 16;
    if arrived.sensor == 0 {
        for column in arrived.packet.payload[32..].chunks_exact_mut(column_bytes) {
            let mut time_ns = [0; 8];
            time_ns.copy_from_slice(&column[..8]);
            column[..8].copy_from_slice(&(u64::from_le_bytes(time_ns) + HOUR_NS).to_le_bytes());
        }
    }
    vec![arrived]
}

/// Whether this packet is among those chosen: about one of so many, by a hash of time and sensor.
fn one_of(many: u64, arrived: &Arrived) -> bool {
    let mixed = (arrived.packet.time_ns as u64 ^ arrived.sensor as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (mixed >> 33).is_multiple_of(many)
}
