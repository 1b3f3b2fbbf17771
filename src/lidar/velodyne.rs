//! Velodyne HDL-32E and VLP-16. Layout, timing, elevations and units are those of the manuals; all numbers
//! little-endian. The z offsets, by which beams miss the sensor's origin, are those of the manufacturer's calibration
//! files: the VLP-16 manual rounds them to 0.1 mm, in an HDL-32E and a VLP-16 they come to 28.97 and 41.91 mm x
//! tan(-elevation).
//!
//! A payload is 12 blocks of 100 bytes, then the time of the first firing in microseconds within the hour (u32),
//! the return mode and the model's byte. A block is the flag `FF EE`, the azimuth of its first firing in
//! hundredths of a degree (u16), and 32 returns: distance in 2 mm (u16, 0 for none) and reflectivity (u8). A
//! block holds one column of an HDL-32E, two of a VLP-16.
//!
//! A column's time is the packet's own, in the hour that brings it nearest to the time of reception. Between the
//! azimuths that the packet gives the head turns at the packet's own rate.
//!
//! Packets with two returns a firing hold each column twice, the last return in the even block and the strongest, or
//! the second strongest where the last one is the strongest, in the odd one. The decoder returns the one with the
//! higher reflectivity. Position packets (512 bytes, sent if a GPS receiver is connected) hold no ranges.

use std::sync::Arc;

use super::beam::{beam, ranked};
use super::model::{Format, Refused, Setting, Sink, TIME_LIMIT_NS, TURN_CDEG, units_of, whole_azimuth_cdeg};
use super::{Beam, Column, Model};
use crate::Error;
use crate::geometry::DVec3;

/// Where the sensors send their packets unless told otherwise.
pub(super) const UDP_PORT: u16 = 2368;
/// Length of a whole payload of a Velodyne, bytes.
pub const PAYLOAD_BYTES: usize = 1206;

const POSITION_BYTES: usize = 512;
const BLOCKS: usize = 12;
const BLOCK_BYTES: usize = 100;
const RETURNS_PER_BLOCK: usize = 32;
const FLAG: [u8; 2] = [0xff, 0xee];
const STRONGEST: u8 = 0x37;
const LAST: u8 = 0x38;
const DUAL: u8 = 0x39;
const RANGE_UNIT_M: f32 = 0.002;
const HOUR_NS: i64 = 3_600_000_000_000;

/// What differs between the models.
#[derive(Debug)]
struct Velodyne {
    /// The model's byte.
    product_id: u8,
    /// Columns in one block of a packet.
    columns_per_block: usize,
}

pub(super) fn hdl_32e(setting: &Setting) -> Result<Model, Error> {
    const ELEVATION_DEG: [f64; 32] = [
        -30.67, -9.33, -29.33, -8.00, -28.00, -6.67, -26.67, -5.33, -25.33, -4.00, -24.00, -2.67, -22.67,
        -1.33, -21.33, 0.00, -20.00, 1.33, -18.67, 2.67, -17.33, 4.00, -16.00, 5.33, -14.67, 6.67, -13.33,
        8.00, -12.00, 9.33, -10.67, 10.67,
    ];
    const Z_OFFSET_MM: [f64; 32] = [
        17.17, 4.76, 16.27, 4.07, 15.40, 3.38, 14.54, 2.70, 13.71, 2.02, 12.89, 1.35, 12.09, 0.67, 11.31,
        0.00, 10.54, -0.67, 9.78, -1.35, 9.04, -2.02, 8.30, -2.70, 7.58, -3.38, 6.86, -4.07, 6.15, -4.76,
        5.45, -5.45,
    ];
    let velodyne = Velodyne { product_id: 0x21, columns_per_block: 1 };
    model(setting, beams(&ELEVATION_DEG, &Z_OFFSET_MM, 1152), 46_080.0, velodyne)
}

pub(super) fn vlp_16(setting: &Setting) -> Result<Model, Error> {
    const ELEVATION_DEG: [f64; 16] =
        [-15.0, 1.0, -13.0, 3.0, -11.0, 5.0, -9.0, 7.0, -7.0, 9.0, -5.0, 11.0, -3.0, 13.0, -1.0, 15.0];
    const Z_OFFSET_MM: [f64; 16] = [
        11.23, -0.73, 9.68, -2.20, 8.15, -3.67, 6.64, -5.15, 5.15, -6.64, 3.67, -8.15, 2.20, -9.68, 0.73,
        -11.23,
    ];
    let velodyne = Velodyne { product_id: 0x22, columns_per_block: 2 };
    model(setting, beams(&ELEVATION_DEG, &Z_OFFSET_MM, 2304), 55_296.0, velodyne)
}

fn model(
    setting: &Setting,
    beams: Arc<[Beam]>,
    column_period_ns: f64,
    velodyne: Velodyne,
) -> Result<Model, Error> {
    if setting.calibration.is_some() {
        let name = setting.name;
        return Err(Error::new(format!(
            "calibration: expected none, because all {name} have the same beams"
        )));
    }
    Ok(Model { name: setting.name, beams, column_period_ns, turn: None, format: Arc::new(velodyne) })
}

fn beams(elevation_deg: &[f64], z_offset_mm: &[f64], fire_period_ns: u32) -> Arc<[Beam]> {
    let made = elevation_deg.iter().zip(z_offset_mm).enumerate().map(|(i, (&elevation_deg, &z_mm))| {
        let fired_ns = i as u32 * fire_period_ns;
        // The manufacturer's decoder interpolates each beam's azimuth and rounds it to hundredths of a degree.
        let beam = beam(elevation_deg, 0.0, DVec3::new(0.0, -0.0, z_mm * 1e-3));
        Beam { fire_offset_ns: fired_ns, turned_ns: fired_ns, whole_cdeg: true, ..beam }
    });
    ranked(made.collect())
}

impl Format for Velodyne {
    fn columns_per_packet(&self, _: &Model) -> usize {
        BLOCKS * self.columns_per_block
    }

    fn packet_bytes(&self, _: &Model) -> usize {
        PAYLOAD_BYTES
    }

    fn decode(&self, model: &Model, received_ns: i64, payload: &[u8], sink: Sink) -> Result<(), Refused> {
        let payload = match <&[u8; PAYLOAD_BYTES]>::try_from(payload) {
            Ok(payload) => payload,
            Err(_) if payload.len() == POSITION_BYTES => return Err(Refused::NoRanges),
            Err(_) => return Err(Refused::WrongSize),
        };
        let head = self.head(model, received_ns, payload).ok_or(Refused::NotUnderstood)?;
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
            for k in 0..self.columns_per_block {
                let after_block_ns = k as f64 * model.column_period_ns;
                let after_packet_ns = (firing * self.columns_per_block + k) as f64 * model.column_period_ns;
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
        Ok(())
    }

    fn encode(&self, model: &Model, columns: &[Column], range_m: &[f32], reflectivity: &[u8]) -> Vec<u8> {
        // Columns that are missing have no returns, which is 0.
        let mut payload = vec![0; PAYLOAD_BYTES];
        let (blocks, tail) = payload.split_at_mut(BLOCKS * BLOCK_BYTES);
        let mut pixels = range_m.iter().zip(reflectivity);
        for (b, block) in blocks.chunks_exact_mut(BLOCK_BYTES).enumerate() {
            block[..2].copy_from_slice(&FLAG);
            let azimuth_cdeg = whole_azimuth_cdeg(model, columns, b * self.columns_per_block);
            block[2..4].copy_from_slice(&azimuth_cdeg.to_le_bytes());
            for (bytes, (&range_m, &reflectivity)) in block[4..].chunks_exact_mut(3).zip(&mut pixels) {
                let distance = units_of(range_m, RANGE_UNIT_M, u32::from(u16::MAX)) as u16;
                let [low, high] = distance.to_le_bytes();
                bytes.copy_from_slice(&[low, high, reflectivity]);
            }
        }
        let within_hour_us = columns[0].time_ns.rem_euclid(HOUR_NS) / 1000;
        tail[..4].copy_from_slice(&(within_hour_us as u32).to_le_bytes());
        tail[4..].copy_from_slice(&[STRONGEST, self.product_id]);
        payload
    }
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

impl Velodyne {
    /// None for a packet that no sensor of this model sends.
    fn head(&self, model: &Model, received_ns: i64, payload: &[u8; PAYLOAD_BYTES]) -> Option<Head> {
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
        let within_hour_ns = i64::from(u32::from_le_bytes([tail[0], tail[1], tail[2], tail[3]])) * 1000;
        let time_ok = within_hour_ns < HOUR_NS && received_ns.unsigned_abs() < TIME_LIMIT_NS;
        if !(blocks_ok && pairs_ok && tail[5] == self.product_id && time_ok) {
            return None;
        }
        let hour = (received_ns - within_hour_ns + HOUR_NS / 2).div_euclid(HOUR_NS);
        let last = BLOCKS - blocks_per_firing;
        let turned_cdeg =
            (azimuth_cdeg(block(payload, last)) + TURN_CDEG - azimuth_cdeg(block(payload, 0))) % TURN_CDEG;
        let columns = last / blocks_per_firing * self.columns_per_block;
        Some(Head {
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

#[cfg(test)]
#[path = "velodyne_tests.rs"]
mod tests;
