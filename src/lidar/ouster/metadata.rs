//! A sensor's metadata as the sensor writes them: one JSON object. Firmware before 3.0 has them at the top level
//! (`beam_altitude_angles`, `data_format`, `lidar_mode`), later firmware in objects (`beam_intrinsics`,
//! `lidar_data_format`, `config_params`). This module reads either form.

use serde_json::Value;

use super::geometry::{BEAMS_MAX, Geometry, Layout, PROFILES, Profile};
use crate::Error;
use crate::lidar::model::letters;

/// A UDP datagram holds no more.
const DATAGRAM_BYTES: usize = 65_507;
/// The finest mode there is has 4096 columns.
const COLUMNS_MAX: u64 = 8192;

/// The geometry of a sensor named `model` in the site file.
pub(super) fn read(text: &str, model: &'static str) -> Result<Geometry, Error> {
    let value: Value = serde_json::from_str(text)
        .map_err(|e| Error::new(format!("expected the sensor's metadata as JSON, found {e}")))?;
    let metadata = Metadata(&value);
    if let Some(line) = metadata.find(&["sensor_info"], "prod_line").and_then(Value::as_str)
        && !letters(line).starts_with(&letters(model))
    {
        return Err(Error::new(format!("prod_line: expected {model}'s, found {line:?}")));
    }
    let (mode_columns, rate_hz) = metadata.mode()?;
    let format = &["lidar_data_format", "data_format"];
    let columns = metadata.count(format, "columns_per_frame", COLUMNS_MAX)?.unwrap_or(mode_columns);
    if columns != mode_columns {
        return Err(Error::new(format!(
            "columns_per_frame: expected {mode_columns} as in lidar_mode, found {columns}"
        )));
    }
    let elevation_deg = metadata.angles("beam_altitude_angles", 90.0)?;
    let azimuth_deg = metadata.angles("beam_azimuth_angles", 180.0)?;
    let beams = elevation_deg.len();
    let expected = model.rsplit('-').next().and_then(|rows| rows.parse().ok()).unwrap_or(beams);
    let rows = metadata.count(format, "pixels_per_column", BEAMS_MAX as u64)?.unwrap_or(beams as u64);
    if [beams, azimuth_deg.len(), rows as usize].iter().any(|&found| found != expected) {
        let azimuths = azimuth_deg.len();
        return Err(Error::new(format!(
            "beams: expected {expected} as an {model} has, found {beams} beam_altitude_angles, {azimuths} \
             beam_azimuth_angles and {rows} pixels_per_column"
        )));
    }
    let (arm_m, lift_m) = metadata.beam_origin()?;
    let (yaw_rad, up_m) = metadata.lidar_to_sensor()?;
    let profile = metadata.profile()?;
    let columns_per_packet = metadata.count(format, "columns_per_packet", columns)?.unwrap_or(16) as usize;
    let around = if profile.layout == Layout::Legacy { 20 } else { 12 };
    let packet_bytes = 64 + columns_per_packet * (around + beams * profile.cell_bytes);
    if packet_bytes > DATAGRAM_BYTES {
        return Err(Error::new(format!(
            "columns_per_packet: expected packets of at most {DATAGRAM_BYTES} bytes, found {packet_bytes}"
        )));
    }
    Ok(Geometry {
        profile,
        columns: columns as u32,
        columns_per_packet,
        rate_hz,
        elevation_deg,
        azimuth_deg,
        arm_m,
        lift_m,
        yaw_rad,
        up_m,
    })
}

struct Metadata<'a>(&'a Value);

impl<'a> Metadata<'a> {
    /// The value of a key in the first of the objects that has it, or at the top.
    fn find(&self, objects: &[&str], key: &str) -> Option<&'a Value> {
        let within = objects.iter().find_map(|object| self.0.get(object)?.get(key));
        within.or_else(|| self.0.get(key)).filter(|value| !value.is_null())
    }

    fn count(&self, objects: &[&str], key: &str, most: u64) -> Result<Option<u64>, Error> {
        let Some(value) = self.find(objects, key) else { return Ok(None) };
        match value.as_u64() {
            Some(count) if (1..=most).contains(&count) => Ok(Some(count)),
            _ => Err(Error::new(format!(
                "{key}: expected a whole number from 1 to {most}, found {}",
                short(value)
            ))),
        }
    }

    fn numbers(&self, objects: &[&str], key: &str) -> Result<Option<Vec<f64>>, Error> {
        let Some(value) = self.find(objects, key) else { return Ok(None) };
        let numbers = value.as_array().and_then(|all| all.iter().map(Value::as_f64).collect());
        let story = || Error::new(format!("{key}: expected a list of numbers, found {}", short(value)));
        numbers.map(Some).ok_or_else(story)
    }

    fn angles(&self, key: &str, most_deg: f64) -> Result<Vec<f64>, Error> {
        let angles = self.numbers(&["beam_intrinsics"], key)?;
        let angles =
            angles.ok_or_else(|| Error::new(format!("{key}: expected one angle a beam, found none")))?;
        if let Some(angle) = angles.iter().find(|angle| angle.abs() > most_deg) {
            return Err(Error::new(format!(
                "{key}: expected -{most_deg} to {most_deg} degrees, found {angle}"
            )));
        }
        Ok(angles)
    }

    /// Columns a revolution and revolutions a second.
    fn mode(&self) -> Result<(u64, f64), Error> {
        let value = self.find(&["config_params", "sensor_info"], "lidar_mode");
        let mode = value.and_then(Value::as_str).and_then(|mode| {
            let (columns, rate_hz) = mode.split_once('x')?;
            let (columns, rate_hz) = (columns.parse::<u64>().ok()?, rate_hz.parse::<u32>().ok()?);
            ((1..=COLUMNS_MAX).contains(&columns) && (1..=50).contains(&rate_hz))
                .then_some((columns, rate_hz))
        });
        let (columns, rate_hz) = mode.ok_or_else(|| {
            let found = value.map_or("none".to_owned(), short);
            Error::new(format!(
                "lidar_mode: expected columns and revolutions a second as 1024x10, found {found}"
            ))
        })?;
        Ok((columns, f64::from(rate_hz)))
    }

    /// Without a word of a profile the sensor is older than profiles.
    fn profile(&self) -> Result<Profile, Error> {
        let objects = &["lidar_data_format", "data_format", "config_params"];
        let Some(value) = self.find(objects, "udp_profile_lidar") else { return Ok(PROFILES[0]) };
        let found = value.as_str().and_then(|name| PROFILES.into_iter().find(|profile| profile.name == name));
        found.ok_or_else(|| {
            let known = PROFILES.map(|profile| profile.name).join(", ");
            Error::new(format!("udp_profile_lidar: expected one of {known}, found {}", short(value)))
        })
    }

    /// From the lidar's middle to where a beam starts: outwards and up, metres.
    fn beam_origin(&self) -> Result<(f64, f64), Error> {
        let intrinsics = &["beam_intrinsics"];
        if let Some(m) = self.matrix(intrinsics, "beam_to_lidar_transform")? {
            let turned = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
            let turn = [m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]];
            if turn != turned || m[7] != 0.0 {
                return Err(Error::new("beam_to_lidar_transform: expected no turn and no step aside"));
            }
            return Ok((m[3] * 1e-3, m[11] * 1e-3));
        }
        let key = "lidar_origin_to_beam_origin_mm";
        let value = self.find(intrinsics, key);
        let arm_mm = value.and_then(Value::as_f64).filter(|mm| mm.abs() < 1000.0);
        let found = || value.map_or("none".to_owned(), short);
        let arm_mm =
            arm_mm.ok_or_else(|| Error::new(format!("{key}: expected a length, found {}", found())))?;
        Ok((arm_mm * 1e-3, 0.0))
    }

    /// From the lidar's frame to the sensor's: a turn about z and a step up, metres.
    fn lidar_to_sensor(&self) -> Result<(f64, f64), Error> {
        let key = "lidar_to_sensor_transform";
        let Some(m) = self.matrix(&["lidar_intrinsics"], key)? else {
            return Err(Error::new(format!("{key}: expected 16 numbers, found none")));
        };
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        let upright = [m[2], m[6], m[8], m[9]].iter().all(|&a| near(a, 0.0)) && near(m[10], 1.0);
        let turns = near(m[0], m[5]) && near(m[1], -m[4]) && near(m[0].hypot(m[4]), 1.0);
        if !(upright && turns && near(m[3], 0.0) && near(m[7], 0.0)) {
            return Err(Error::new(format!("{key}: expected a turn about z and a step along z")));
        }
        Ok((m[4].atan2(m[0]), m[11] * 1e-3))
    }

    fn matrix(&self, objects: &[&str], key: &str) -> Result<Option<[f64; 16]>, Error> {
        let Some(numbers) = self.numbers(objects, key)? else { return Ok(None) };
        let count = numbers.len();
        let matrix = numbers.try_into().ok().filter(|m: &[f64; 16]| m.iter().all(|mm| mm.abs() < 1000.0));
        let story = || Error::new(format!("{key}: expected 16 numbers below 1000, found {count}"));
        matrix.map(Some).ok_or_else(story)
    }
}

/// A value as a message shows it.
fn short(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(40) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}
