//! Hesai PandarXT-32 (XT32). Layout, timing and units are those of the user manual, as tier4/nebula reads them; all
//! numbers little-endian.
//!
//! A payload is a header of 12 bytes (flag `EE FF`, version, 32 lasers, 8 blocks, the unit of distances in mm, returns
//! a firing, flags), 8 blocks, a tail of 24 (return mode, speed, date and time in UTC, microseconds within the second)
//! and a sequence number (u32), which old firmware leaves out. A block is the azimuth of a firing in hundredths of a
//! degree (u16) and 32 cells from the highest beam down: distance (u16, 0 for none), reflectivity, confidence.
//!
//! The packet's time is 5.632 us before the last firing. Firings follow each other after 50 us at any speed, lasers of a
//! firing after 1.512 us, the first of them 0.368 us after the firing's begin.
//!
//! A beam's azimuth is the sum of its block's azimuth and its own offset from the angle file. The first manual of
//! this model says so, and so does the decoder that tests compare with. Later manuals add the turn of the head
//! between the lasers of a firing, 0.17 degrees to the last one at 10 Hz; `turned_ns` would express it.
//!
//! Packets with two returns a firing hold each in a block of its own, one after the other, at the same azimuth. The
//! decoder returns the one with the higher reflectivity. Position packets (512 bytes) hold no ranges.

use std::sync::Arc;

use super::beam::{beam, ranked};
use super::model::{Format, Refused, Setting, Sink, TIME_LIMIT_NS, TURN_CDEG, units_of, whole_azimuth_cdeg};
use super::{Beam, Column, Model};
use crate::Error;
use crate::geometry::DVec3;

/// Where the sensors send their packets unless told otherwise.
pub(super) const UDP_PORT: u16 = 2368;

const POSITION_BYTES: usize = 512;
const HEAD_BYTES: usize = 12;
const BEAMS: usize = 32;
const BLOCKS: usize = 8;
const BLOCK_BYTES: usize = 2 + 4 * BEAMS;
const TAIL_AT: usize = HEAD_BYTES + BLOCKS * BLOCK_BYTES;
const TAIL_BYTES: usize = 24;
const SEQUENCE_BYTES: usize = 4;
const FLAG: [u8; 2] = [0xee, 0xff];
const FIRING_NS: i64 = 50_000;
const LAST_FIRING_NS: i64 = 5632;
const FIRST_LASER_NS: i64 = 368;
const LASER_NS: u32 = 1512;
/// The unit of distances that the manual names, and those that are believed.
const RANGE_MM: u8 = 4;
const RANGE_UNITS_MM: std::ops::RangeInclusive<u8> = 1..=10;
/// First, second, strongest, last.
const ONE_RETURN: [u8; 4] = [0x33, 0x34, 0x37, 0x38];
/// Last and strongest, first and second, first and last, first and strongest, strongest and second strongest.
const TWO_RETURNS: [u8; 5] = [0x39, 0x3a, 0x3b, 0x3c, 0x3e];
const STRONGEST: u8 = 0x37;
const DAY_S: i64 = 86_400;

/// The XT32: of its angle file or, without one, of the manual's design values: 15 to -16 degrees, all straight ahead.
pub(super) fn xt32(setting: &Setting) -> Result<Model, Error> {
    let angles_deg = match setting.calibration {
        Some(text) => angles(text).map_err(|e| e.within("calibration"))?,
        None => (0..BEAMS).map(|channel| (15.0 - channel as f64, 0.0)).collect(),
    };
    let beams = angles_deg.into_iter().enumerate().map(|(channel, (elevation_deg, azimuth_deg))| {
        // The head's azimuths come as whole hundredths of a degree, the offset does not.
        let beam = beam(elevation_deg, azimuth_deg, DVec3::ZERO);
        Beam { fire_offset_ns: channel as u32 * LASER_NS, whole_cdeg: true, ..beam }
    });
    Ok(Model {
        name: setting.name,
        beams: ranked(beams.collect()),
        column_period_ns: FIRING_NS as f64,
        turn: None,
        format: Arc::new(Xt32),
    })
}

/// Elevation and azimuth of each channel, from the text of an angle file: a line of titles and one a channel.
fn angles(text: &str) -> Result<Vec<(f64, f64)>, Error> {
    let mut angles_deg = Vec::new();
    for (line, number) in text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty()) {
        let words: Vec<&str> = line.split(',').map(str::trim).collect();
        if angles_deg.is_empty() && words[0].eq_ignore_ascii_case("channel") {
            continue;
        }
        let value = |i: usize, most: f64| {
            let value = words.get(i)?.parse::<f64>().ok()?;
            (value.abs() <= most).then_some(value)
        };
        let channel = words[0].parse() == Ok(angles_deg.len() + 1);
        match (value(1, 90.0), value(2, 180.0)) {
            (Some(elevation), Some(azimuth)) if channel && angles_deg.len() < BEAMS => {
                angles_deg.push((elevation, azimuth));
            }
            _ => {
                let expected =
                    format!("channel {} of {BEAMS}, its elevation and azimuth", angles_deg.len() + 1);
                return Err(Error::new(format!("line {number}: expected {expected}, found {line:?}")));
            }
        }
    }
    match angles_deg.len() {
        BEAMS => Ok(angles_deg),
        found => Err(Error::new(format!("expected an angle file of {BEAMS} channels, found {found}"))),
    }
}

#[derive(Debug)]
struct Xt32;

impl Format for Xt32 {
    fn columns_per_packet(&self, _: &Model) -> usize {
        BLOCKS
    }

    fn packet_bytes(&self, _: &Model) -> usize {
        TAIL_AT + TAIL_BYTES + SEQUENCE_BYTES
    }

    fn decode(&self, _: &Model, _: i64, payload: &[u8], sink: Sink) -> Result<(), Refused> {
        match payload.len().checked_sub(TAIL_AT + TAIL_BYTES) {
            Some(0 | SEQUENCE_BYTES) => {}
            _ if payload.len() == POSITION_BYTES => return Err(Refused::NoRanges),
            _ => return Err(Refused::WrongSize),
        }
        let head = Head::read(payload).ok_or(Refused::NotUnderstood)?;
        for first in (0..BLOCKS).step_by(head.blocks_per_firing) {
            let (mut range_m, mut reflectivity) = ([0.0; BEAMS], [0; BEAMS]);
            for b in first..first + head.blocks_per_firing {
                for (i, cell) in block(payload, b)[2..].chunks_exact(4).enumerate() {
                    let distance = u16::from_le_bytes([cell[0], cell[1]]);
                    if distance != 0 && cell[2] >= reflectivity[i] {
                        range_m[i] = f32::from(distance) * head.range_unit_m;
                        reflectivity[i] = cell[2];
                    }
                }
            }
            let after = ((BLOCKS - 1 - first) / head.blocks_per_firing) as i64;
            let column = Column {
                time_ns: head.time_ns + LAST_FIRING_NS + FIRST_LASER_NS - after * FIRING_NS,
                azimuth_cdeg: azimuth_cdeg(block(payload, first)) as f32,
                azimuth_rate_cdeg_per_ns: head.rate_cdeg_per_ns as f32,
            };
            sink(column, &range_m, &reflectivity);
        }
        Ok(())
    }

    fn encode(&self, model: &Model, columns: &[Column], range_m: &[f32], reflectivity: &[u8]) -> Vec<u8> {
        let mut payload = Vec::with_capacity(self.packet_bytes(model));
        payload.extend_from_slice(&FLAG);
        // Version 6.1; of one return a firing, with a sequence number.
        payload.extend_from_slice(&[6, 1, 0, 0, BEAMS as u8, BLOCKS as u8, 1, RANGE_MM, 1, 1]);
        for b in 0..BLOCKS {
            payload.extend_from_slice(&whole_azimuth_cdeg(model, columns, b).to_le_bytes());
            for i in b * BEAMS..(b + 1) * BEAMS {
                let range_m = range_m.get(i).copied().unwrap_or(0.0);
                let distance = units_of(range_m, f32::from(RANGE_MM) * 1e-3, u32::from(u16::MAX)) as u16;
                payload.extend_from_slice(&distance.to_le_bytes());
                payload.extend_from_slice(&[reflectivity.get(i).copied().unwrap_or(0), 0]);
            }
        }
        let to_packet_ns = (BLOCKS as i64 - 1) * FIRING_NS - LAST_FIRING_NS - FIRST_LASER_NS;
        let time_us = (columns[0].time_ns + to_packet_ns).div_euclid(1000);
        let turns_per_minute = f64::from(columns[0].azimuth_rate_cdeg_per_ns) * 6e10 / f64::from(TURN_CDEG);
        payload.extend_from_slice(&[0; 10]);
        payload.push(STRONGEST);
        payload.extend_from_slice(&(turns_per_minute.round() as u16).to_le_bytes());
        payload.extend_from_slice(&date_of(time_us.div_euclid(1_000_000)));
        payload.extend_from_slice(&(time_us.rem_euclid(1_000_000) as u32).to_le_bytes());
        payload.push(0x42);
        let sequence = columns[0].time_ns.div_euclid(BLOCKS as i64 * FIRING_NS);
        payload.extend_from_slice(&(sequence as u32).to_le_bytes());
        payload
    }
}

/// What a packet says once.
struct Head {
    time_ns: i64,
    rate_cdeg_per_ns: f64,
    range_unit_m: f32,
    /// 2 when each firing comes with two returns.
    blocks_per_firing: usize,
}

impl Head {
    /// None for a packet that no XT32 sends.
    fn read(payload: &[u8]) -> Option<Self> {
        let tail = &payload[TAIL_AT..TAIL_AT + TAIL_BYTES];
        let blocks_per_firing = match tail[10] {
            mode if ONE_RETURN.contains(&mode) => 1,
            mode if TWO_RETURNS.contains(&mode) => 2,
            _ => return None,
        };
        let azimuth = |b: usize| azimuth_cdeg(block(payload, b));
        let azimuths_ok =
            (0..BLOCKS).all(|b| azimuth(b) < TURN_CDEG && azimuth(b) == azimuth(b - b % blocks_per_firing));
        let head_ok =
            payload[..2] == FLAG && usize::from(payload[6]) == BEAMS && usize::from(payload[7]) == BLOCKS;
        let within_second_us = u32::from_le_bytes([tail[19], tail[20], tail[21], tail[22]]);
        let seconds = seconds_of(tail[13..19].try_into().ok()?)?;
        // A second may hold a leap second's microseconds too.
        if !(azimuths_ok && head_ok && RANGE_UNITS_MM.contains(&payload[9]) && within_second_us < 2_000_000) {
            return None;
        }
        let last = BLOCKS - blocks_per_firing;
        let turned_cdeg = (azimuth(last) + TURN_CDEG - azimuth(0)) % TURN_CDEG;
        let time_ns = seconds * 1_000_000_000 + i64::from(within_second_us) * 1000;
        (time_ns.unsigned_abs() < TIME_LIMIT_NS).then(|| Self {
            time_ns,
            rate_cdeg_per_ns: f64::from(turned_cdeg) / ((last / blocks_per_firing) as f64 * FIRING_NS as f64),
            range_unit_m: f32::from(payload[9]) * 1e-3,
            blocks_per_firing,
        })
    }
}

fn block(payload: &[u8], b: usize) -> &[u8] {
    &payload[HEAD_BYTES + b * BLOCK_BYTES..][..BLOCK_BYTES]
}

fn azimuth_cdeg(block: &[u8]) -> u32 {
    u32::from(u16::from_le_bytes([block[0], block[1]]))
}

/// Seconds since 1970 of a year from 1900 on, month, day, hour, minute and second; none for what is no date.
fn seconds_of([year, month, day, hour, minute, second]: [u8; 6]) -> Option<i64> {
    let real =
        (1..=12).contains(&month) && (1..=31).contains(&day) && hour < 24 && minute < 60 && second < 61;
    // Days since the first of March of year 0: years end with February, the month whose length changes.
    let (year, month) = (1900 + i64::from(year) - i64::from(month < 3), (i64::from(month) + 9) % 12);
    let days = year * 365 + year / 4 - year / 100 + year / 400 + (month * 153 + 2) / 5 + i64::from(day) - 1;
    let within_day_s = (i64::from(hour) * 60 + i64::from(minute)) * 60 + i64::from(second);
    real.then(|| (days - DAYS_TO_1970) * DAY_S + within_day_s)
}

/// From the first of March of year 0 to the first of January 1970.
const DAYS_TO_1970: i64 = 719_468;

/// The date that [`seconds_of`] reads; of a time before 1900 or after 2155 the nearest year.
fn date_of(seconds: i64) -> [u8; 6] {
    let (days, within_day_s) = (seconds.div_euclid(DAY_S) + DAYS_TO_1970, seconds.rem_euclid(DAY_S));
    // The year is found from above: it is at most one too many.
    let mut year = days * 400 / 146_097 + 1;
    let begin = |year: i64| year * 365 + year / 4 - year / 100 + year / 400;
    while begin(year) > days {
        year -= 1;
    }
    let of_year = days - begin(year);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (month * 153 + 2) / 5 + 1;
    let year = year + i64::from(month >= 10) - 1900;
    let hours = [within_day_s / 3600, within_day_s / 60 % 60, within_day_s % 60];
    let [hour, minute, second] = hours.map(|part| part as u8);
    [year.clamp(0, 255) as u8, ((month + 2) % 12 + 1) as u8, day as u8, hour, minute, second]
}

#[cfg(test)]
#[path = "hesai_tests.rs"]
mod tests;
