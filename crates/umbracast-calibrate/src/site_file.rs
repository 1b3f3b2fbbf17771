//! Writes what was found into a user's site file and leaves the rest as it stands, comments too.

use toml_edit::{Array, ArrayOfTables, DocumentMut, Formatted, InlineTable, Item, Table, Value, value};
use umbracast::site::Sensor;
use umbracast::{Error, Site};

use crate::calibration::{Calibration, Found};

/// The text of a site file with the poses and clocks that were found. A file that names no sensors gets those of `site`.
///
/// # Errors
/// A text that is not TOML, or sensors that are not a list of tables.
pub fn write_into(text: &str, site: &Site, found: &Calibration) -> Result<String, Error> {
    let mut file: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| Error::new(e.to_string()))?;
    let place = file.entry("site").or_insert_with(implicit);
    let place = place.as_table_like_mut().ok_or_else(|| Error::new("site: expected a table"))?;
    if place.get("sensors").is_none() {
        let mut tables = ArrayOfTables::new();
        site.sensors.iter().for_each(|sensor| tables.push(table_of(sensor)));
        place.insert("sensors", Item::ArrayOfTables(tables));
    }
    let wrong = || Error::new("site.sensors: expected a list of tables");
    let sensors = place.get_mut("sensors").ok_or_else(wrong)?;
    match sensors {
        Item::ArrayOfTables(tables) => {
            tables.iter_mut().for_each(|table| put(table, &found.sensors));
        }
        Item::Value(Value::Array(array)) => {
            for entry in array.iter_mut() {
                put(entry.as_inline_table_mut().ok_or_else(wrong)?, &found.sensors);
            }
        }
        _ => return Err(wrong()),
    }
    Ok(file.to_string())
}

fn implicit() -> Item {
    let mut table = Table::new();
    table.set_implicit(true);
    Item::Table(table)
}

/// What a site file must say of a sensor, and what this one's says beside the defaults of every sensor.
fn table_of(sensor: &Sensor) -> Table {
    let mut table = Table::new();
    table.insert("name", value(&sensor.name));
    table.insert("model", value(&sensor.model));
    for (key, number) in [
        ("rate_hz", sensor.rate_hz),
        ("cut_deg", sensor.cut_deg),
        ("range_min_m", sensor.range_min_m),
        ("range_max_m", sensor.range_max_m),
        ("range_noise_m", sensor.range_noise_m),
    ] {
        table.insert(key, value(number));
    }
    for (key, text) in [
        ("calibration_file", &sensor.calibration_file),
        ("calibration", &sensor.calibration),
        ("address", &sensor.address),
    ] {
        text.iter().for_each(|text| {
            table.insert(key, value(text));
        });
    }
    if let Some(port) = sensor.udp_port {
        table.insert("udp_port", value(i64::from(port)));
    }
    match sensor.time {
        umbracast::site::TimeSource::Sensor => {}
        umbracast::site::TimeSource::Ptp => {
            table.insert("time", value("ptp"));
        }
        umbracast::site::TimeSource::Arrival => {
            table.insert("time", value("arrival"));
        }
    }
    table
}

/// Sets the numbers of a sensor, each where it stands, with the comment behind it.
fn put(table: &mut dyn toml_edit::TableLike, found: &[Found]) {
    let name = table.get("name").and_then(Item::as_str).map(str::to_owned);
    let Some(found) = found.iter().find(|found| Some(&found.sensor) == name.as_ref()) else { return };
    let position: Array = found.position_m.iter().map(|&m| rounded(m, 4)).collect();
    set(table, "position_m", Value::Array(position));
    let turn = found.rotation_deg;
    let mut rotation = InlineTable::new();
    for (key, deg) in [("yaw", turn.yaw), ("pitch", turn.pitch), ("roll", turn.roll)] {
        rotation.insert(key, rounded(deg, 4));
    }
    set(table, "rotation_deg", Value::InlineTable(rotation));
    let offset = rounded(found.clock_offset_ms, 2);
    if offset.as_float() != Some(0.0) || table.get("clock_offset_ms").is_some() {
        set(table, "clock_offset_ms", offset);
    }
}

fn set(table: &mut dyn toml_edit::TableLike, key: &str, mut new: Value) {
    if let Some(old) = table.get(key).and_then(Item::as_value) {
        *new.decor_mut() = old.decor().clone();
    }
    table.insert(key, Item::Value(new));
}

/// A tenth of a millimetre, a ten-thousandth of a degree: finer than any of it is known.
fn rounded(number: f64, digits: i32) -> Value {
    let unit = 10.0_f64.powi(digits);
    Value::Float(Formatted::new((number * unit).round() / unit + 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::{Frame, Sigma};
    use umbracast::site::Rotation;
    use umbracast::{Config, Mode};

    fn found(sensor: &str, clock_offset_ms: f64) -> Found {
        Found {
            sensor: sensor.to_owned(),
            position_m: [1.5, -2.25, 3.0],
            rotation_deg: Rotation { yaw: 12.0, pitch: 34.5, roll: -0.25 },
            clock_offset_ms,
            sigma: Sigma::default(),
            frame: Frame::SiteFile,
            with: Vec::new(),
            people: 0,
            turned_deg: 0.0,
            moved_m: 0.0,
        }
    }

    fn calibration(sensors: Vec<Found>) -> Calibration {
        Calibration {
            sensors,
            joint_sightings: 0,
            apart_m: 0.0,
            weak: vec![],
            told: vec![],
            doubts: vec![],
            seen: vec![],
        }
    }

    #[test]
    fn a_file_keeps_what_is_not_the_poses() {
        let text = "# Our lab.\n[site]\nname = \"lab\" # second floor\n\n[[site.sensors]]\nname = \"door\" # by the door\n\
                    position_m = [0.0, 0.0, 2.9] # by tape\nrotation_deg = { yaw = 10.0, pitch = 30.0, roll = 0.0 }\n\n\
                    [[site.sensors]]\nname = \"window\"\nposition_m = [4.0, 0.0, 2.9]\n\
                    rotation_deg = { yaw = 190.0, pitch = 30.0, roll = 0.0 }\nudp_port = 2370\n";
        let site = Config::with_overlay(Mode::Default, text, "lab.toml").unwrap().site;
        let calibration = calibration(vec![found("door", 0.0), found("window", 20.5)]);
        let written = write_into(text, &site, &calibration).unwrap();
        for kept in ["# Our lab.", "# second floor", "# by the door", "# by tape", "udp_port = 2370"] {
            assert!(written.contains(kept), "{written}");
        }
        let again = Config::with_overlay(Mode::Default, &written, "lab.toml").unwrap().site;
        assert_eq!(again.sensors[1].position_m, [1.5, -2.25, 3.0]);
        assert_eq!(again.sensors[0].rotation_deg, found("door", 0.0).rotation_deg);
        assert_eq!((again.sensors[0].clock_offset_ms, again.sensors[1].clock_offset_ms), (0.0, 20.5));
        assert!(!written.contains("clock_offset_ms = 0"), "{written}");
    }

    #[test]
    fn a_file_without_sensors_gets_those_of_the_site() {
        let site = Config::default().site;
        let calibration = calibration(vec![found("lidar_east", 0.0), found("lidar_west", -3.0)]);
        for text in
            ["", "[site]\nname = \"lab\"\n", "[site.hall]\nlength_m = 40.0\nwidth_m = 34.0\nheight_m = 9.5\n"]
        {
            let written = write_into(text, &site, &calibration).unwrap();
            let again = Config::with_overlay(Mode::Default, &written, "lab.toml").unwrap().site;
            assert_eq!(again.sensors.len(), 2, "{written}");
            assert_eq!(again.sensors[1].position_m, [1.5, -2.25, 3.0], "{written}");
            assert_eq!(again.sensors[1].clock_offset_ms, -3.0);
        }
    }
}
