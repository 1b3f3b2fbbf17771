//! Ouster OS0, OS1 and OS2. Layouts of packets and the way from a range to a point are those of the manufacturer's
//! library (`ouster-sdk`, `parsing.cpp` and `xyzlut.cpp`) and firmware manual; all numbers little-endian.
//!
//! A payload is a header of 32 bytes, the columns, and a footer of 32 (profile LEGACY: the columns alone). A column
//! is its time in nanoseconds (u64), its number in the revolution (u16), a status whose lowest bit says that it was
//! measured, and one cell a beam from the highest down; a profile says what a cell holds ([`Profile`]). Legacy
//! columns hold a frame number and an encoder count as well, and their status behind the cells. Profile, beams and
//! columns determine the length of a packet; the sensor's own metadata has all three.
//!
//! All beams of a column fire at once. Column n of N looks along n / N of a turn, counted from behind the sensor; a
//! beam looks to the right of it by its azimuth angle. The range is counted from the middle of the lidar through the
//! beam's own origin, which the head carries around the middle (`lidar_origin_to_beam_origin_mm`), so that a point is
//! not exactly at the range along the beam.
//!
//! Of the two returns of a dual profile the decoder returns the first, which is the strongest unless the sensor was
//! told another order. If there is no first return, it returns the second. Packets about the sensor's motion (48
//! bytes) hold no ranges.

mod geometry;
mod metadata;

use std::sync::Arc;

use super::beam::{beam, ranked};
use super::model::{Format, Refused, Setting, Sink, TIME_LIMIT_NS, TURN_CDEG, Turn, units_of};
use super::{Column, Model};
use crate::geometry::DVec3;
use crate::{Error, STEP_NS};
use geometry::{BEAMS_MAX, Geometry, Layout, Profile};

/// Where the sensors send their packets unless told otherwise.
pub(super) const UDP_PORT: u16 = 7502;

const MOTION_BYTES: usize = 48;
const RANGE_UNIT_M: f32 = 0.001;
/// Encoder counts in a turn, in legacy packets.
const ENCODER_TURN: u64 = 90_112;

pub(super) fn model(setting: &Setting) -> Result<Model, Error> {
    let geometry = match setting.calibration {
        Some(text) => metadata::read(text, setting.name).map_err(|e| e.within("calibration"))?,
        None => Geometry::nominal(setting.name, setting.rate_hz),
    };
    let before_m =
        if geometry.lift_m == 0.0 { geometry.arm_m } else { geometry.arm_m.hypot(geometry.lift_m) };
    let angles = geometry.elevation_deg.iter().zip(&geometry.azimuth_deg);
    let beams = angles.map(|(&elevation_deg, &azimuth_deg)| {
        let mut beam = beam(elevation_deg, azimuth_deg, DVec3::ZERO);
        let start_m = DVec3::new(geometry.arm_m, 0.0, geometry.lift_m + geometry.up_m);
        beam.origin_m = start_m - before_m * beam.direction;
        beam
    });
    Ok(Model {
        name: setting.name,
        beams: ranked(beams.collect()),
        column_period_ns: 1e9 / (f64::from(geometry.columns) * geometry.rate_hz),
        turn: Some(Turn {
            columns: geometry.columns,
            first_cdeg: (-geometry.yaw_rad.to_degrees() * 100.0).rem_euclid(f64::from(TURN_CDEG)),
        }),
        format: Arc::new(Ouster {
            profile: geometry.profile,
            columns_per_packet: geometry.columns_per_packet,
        }),
    })
}

/// The codec.
#[derive(Debug)]
struct Ouster {
    profile: Profile,
    columns_per_packet: usize,
}

impl Ouster {
    /// Bytes of a packet's header, of a column's, of a column's footer and of the packet's.
    fn frame_bytes(&self) -> [usize; 4] {
        match self.profile.layout {
            Layout::Legacy => [0, 16, 4, 0],
            Layout::Standard | Layout::FunctionalSafety => [32, 12, 0, 32],
        }
    }

    fn column_bytes(&self, beams: usize) -> usize {
        let [_, head, foot, _] = self.frame_bytes();
        head + beams * self.profile.cell_bytes + foot
    }

    /// Time and number of a column, or none where it was not measured.
    fn stamp(&self, bytes: &[u8]) -> Option<(u64, u16)> {
        let status_at = if self.profile.layout == Layout::Legacy { bytes.len() - 4 } else { 10 };
        let mut time_ns = [0; 8];
        time_ns.copy_from_slice(&bytes[..8]);
        let measured = bytes[status_at] & 1 == 1;
        measured.then(|| (u64::from_le_bytes(time_ns), u16::from_le_bytes([bytes[8], bytes[9]])))
    }

    /// Range and reflectivity of the stronger return of a cell.
    fn cell(&self, cell: &[u8]) -> (f32, u8) {
        let profile = &self.profile;
        let range_mm = |at: usize| {
            let word = u32::from_le_bytes([cell[at], cell[at + 1], cell[at + 2], cell[at + 3]]);
            (word & ((1 << profile.range_bits) - 1)) * profile.range_mm
        };
        let reflectivity = |at: usize| match profile.layout {
            // Two bytes: what is brighter than a Lambertian sheet of white paper is as bright.
            Layout::Legacy => u16::from_le_bytes([cell[at], cell[at + 1]]).min(255) as u8,
            _ => cell[at],
        };
        let (first_mm, second_at) = (range_mm(0), profile.second_at);
        match second_at {
            Some(second_at) if first_mm == 0 => (range_mm(4) as f32 * RANGE_UNIT_M, reflectivity(second_at)),
            _ => (first_mm as f32 * RANGE_UNIT_M, reflectivity(profile.reflectivity_at)),
        }
    }
}

impl Format for Ouster {
    fn columns_per_packet(&self, _: &Model) -> usize {
        self.columns_per_packet
    }

    fn packet_bytes(&self, model: &Model) -> usize {
        let [head, _, _, foot] = self.frame_bytes();
        head + self.columns_per_packet * self.column_bytes(model.beams.len()) + foot
    }

    fn decode(&self, model: &Model, _: i64, payload: &[u8], sink: Sink) -> Result<(), Refused> {
        match payload.len() {
            length if length == self.packet_bytes(model) => {}
            MOTION_BYTES => return Err(Refused::NoRanges),
            _ => return Err(Refused::WrongSize),
        }
        let beams = model.beams.len();
        let Some(turn) = model.turn.filter(|_| beams <= BEAMS_MAX) else {
            return Err(Refused::NotUnderstood);
        };
        let [packet_head, column_head, ..] = self.frame_bytes();
        let columns =
            || payload[packet_head..].chunks_exact(self.column_bytes(beams)).take(self.columns_per_packet);

        // Times rise and lie within a frame's length, so that a broken one takes no others along.
        let mut times: Option<(u64, u64)> = None;
        for (time_ns, number) in columns().filter_map(|bytes| self.stamp(bytes)) {
            let (first_ns, last_ns) = times.unwrap_or((time_ns, time_ns));
            let rises = times.is_none() || time_ns > last_ns;
            let soon = time_ns.saturating_sub(first_ns) < STEP_NS.unsigned_abs();
            if !(rises && soon && time_ns < TIME_LIMIT_NS && u32::from(number) < turn.columns) {
                return Err(Refused::NotUnderstood);
            }
            times = Some((first_ns, time_ns));
        }

        let column_cdeg = f64::from(TURN_CDEG) / f64::from(turn.columns);
        let rate_cdeg_per_ns = column_cdeg / model.column_period_ns;
        let (mut range_m, mut reflectivity) = ([0.0; BEAMS_MAX], [0; BEAMS_MAX]);
        for bytes in columns() {
            let Some((time_ns, number)) = self.stamp(bytes) else { continue };
            let cells = bytes[column_head..].chunks_exact(self.profile.cell_bytes);
            for ((cell, range_m), reflectivity) in cells.zip(&mut range_m[..beams]).zip(&mut reflectivity) {
                (*range_m, *reflectivity) = self.cell(cell);
            }
            let azimuth_cdeg = (turn.first_cdeg + f64::from(number) * column_cdeg) % f64::from(TURN_CDEG);
            let column = Column {
                time_ns: time_ns as i64,
                azimuth_cdeg: azimuth_cdeg as f32,
                azimuth_rate_cdeg_per_ns: rate_cdeg_per_ns as f32,
            };
            sink(column, &range_m[..beams], &reflectivity[..beams]);
        }
        Ok(())
    }

    fn encode(&self, model: &Model, columns: &[Column], range_m: &[f32], reflectivity: &[u8]) -> Vec<u8> {
        let profile = &self.profile;
        let turn = model.turn.unwrap_or(Turn { columns: 1, first_cdeg: 0.0 });
        let number = |column: &Column| {
            let passed_cdeg = f64::from(column.azimuth_cdeg) - turn.first_cdeg;
            let number = (passed_cdeg / f64::from(TURN_CDEG) * f64::from(turn.columns)).round() as i64;
            number.rem_euclid(i64::from(turn.columns))
        };
        // Frames are counted from the column number 0 that is nearest to time 0.
        let before_ns = number(&columns[0]) as f64 * model.column_period_ns;
        let turn_ns = f64::from(turn.columns) * model.column_period_ns;
        let frame = ((columns[0].time_ns as f64 - before_ns) / turn_ns).round() as i64 as u32;

        let mut payload = Vec::with_capacity(self.packet_bytes(model));
        match profile.layout {
            Layout::Legacy => {}
            Layout::Standard => {
                payload.extend_from_slice(&1_u16.to_le_bytes());
                payload.extend_from_slice(&(frame as u16).to_le_bytes());
                payload.resize(32, 0);
            }
            Layout::FunctionalSafety => {
                payload.extend_from_slice(&[1, 0, 0, 0]);
                payload.extend_from_slice(&frame.to_le_bytes());
                payload.resize(32, 0);
            }
        }
        let beams = model.beams.len();
        for c in 0..self.columns_per_packet {
            let column = columns.get(c);
            let number = column.map_or(0, number) as u64;
            let time_ns = column.map_or(0, |column| column.time_ns.max(0) as u64);
            payload.extend_from_slice(&time_ns.to_le_bytes());
            payload.extend_from_slice(&(number as u16).to_le_bytes());
            match profile.layout {
                Layout::Legacy => {
                    payload.extend_from_slice(&(frame as u16).to_le_bytes());
                    let encoder = (number * ENCODER_TURN / u64::from(turn.columns)) as u32;
                    payload.extend_from_slice(&encoder.to_le_bytes());
                }
                _ => payload.extend_from_slice(&u16::from(column.is_some()).to_le_bytes()),
            }
            for i in c * beams..(c + 1) * beams {
                let unit_m = RANGE_UNIT_M * profile.range_mm as f32;
                let range_m = range_m.get(i).copied().unwrap_or(0.0);
                let units = units_of(range_m, unit_m, (1 << profile.range_bits) - 1);
                let cell = payload.len();
                payload.resize(cell + profile.cell_bytes, 0);
                payload[cell..cell + 4].copy_from_slice(&units.to_le_bytes());
                payload[cell + profile.reflectivity_at] |= reflectivity.get(i).copied().unwrap_or(0);
            }
            if profile.layout == Layout::Legacy {
                let status = if column.is_some() { u32::MAX } else { 0 };
                payload.extend_from_slice(&status.to_le_bytes());
            }
        }
        payload.resize(self.packet_bytes(model), 0);
        payload
    }
}

#[cfg(test)]
mod tests;
