//! Tests of Ouster packets and metadata; those of all models stand beside the codec.

use super::geometry::PROFILES;
use super::*;

/// Metadata of an OS-1-32 of this profile, as firmware 2 spells them.
fn old_metadata(profile: &str) -> String {
    let angles = |at: fn(usize) -> f64| (0..32).map(|row| at(row).to_string()).collect::<Vec<_>>().join(", ");
    format!(
        "{{\"beam_altitude_angles\": [{}], \"beam_azimuth_angles\": [{}], \"lidar_mode\": \"512x20\",
          \"lidar_origin_to_beam_origin_mm\": 15.8, \"prod_line\": \"OS-1-32-U2\",
          \"lidar_to_sensor_transform\": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36.18, 0, 0, 0, 1],
          \"data_format\": {{\"pixels_per_column\": 32, \"columns_per_packet\": 16, \"columns_per_frame\": 512,
                             \"udp_profile_lidar\": \"{profile}\"}}}}",
        angles(|row| 21.0 - row as f64 * 1.3),
        angles(|row| [4.2, 1.4, -1.4, -4.2][row % 4]),
    )
}

fn of(text: &str) -> Result<Model, Error> {
    model(&Setting { name: "os1-32", rate_hz: 10.0, calibration: Some(text) })
}

#[test]
fn lengths_follow_from_profile_beams_and_columns() {
    let lengths = PROFILES.map(|profile| {
        let model = of(&old_metadata(profile.name)).unwrap();
        (profile.name, model.packet_bytes())
    });
    let expected = [
        ("LEGACY", 16 * (20 + 32 * 12)),
        ("RNG15_RFL8_NIR8", 64 + 16 * (12 + 32 * 4)),
        ("RNG15_RFL8_NIR8_DUAL", 64 + 16 * (12 + 32 * 8)),
        ("RNG19_RFL8_SIG16_NIR16", 64 + 16 * (12 + 32 * 12)),
        ("RNG19_RFL8_SIG16_NIR16_DUAL", 64 + 16 * (12 + 32 * 16)),
        ("FUSA_RNG15_RFL8_NIR8_DUAL", 64 + 16 * (12 + 32 * 8)),
    ];
    assert_eq!(lengths, expected);
}

#[test]
fn both_spellings_of_the_metadata_say_the_same() {
    let old: serde_json::Value = serde_json::from_str(&old_metadata("RNG15_RFL8_NIR8")).unwrap();
    let new = serde_json::json!({
        "beam_intrinsics": {
            "beam_altitude_angles": old["beam_altitude_angles"],
            "beam_azimuth_angles": old["beam_azimuth_angles"],
            "beam_to_lidar_transform": [1, 0, 0, 15.8, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
        },
        "lidar_intrinsics": { "lidar_to_sensor_transform": old["lidar_to_sensor_transform"] },
        "lidar_data_format": old["data_format"],
        "config_params": { "lidar_mode": "512x20" },
        "sensor_info": { "prod_line": "OS-1-32" },
    });
    let (old, new) = (of(&old.to_string()).unwrap(), of(&new.to_string()).unwrap());
    assert_eq!((&old.beams, old.turn, old.column_period_ns), (&new.beams, new.turn, new.column_period_ns));
    assert_eq!(old.column_period_ns, 1e9 / (512.0 * 20.0));
    assert_eq!((old.beams[0].ring, old.beams[31].ring), (31, 0));
}

#[test]
fn a_point_is_where_the_manual_puts_it() {
    // Firmware manual, lidar range to XYZ: n = 15.8 mm, range 5000 mm, column 100 of 512, beam 7.
    let model = of(&old_metadata("RNG15_RFL8_NIR8")).unwrap();
    let (n, r) = (15.8, 5000.0);
    let encoder = std::f64::consts::TAU * (1.0 - 100.0 / 512.0);
    let azimuth = -std::f64::consts::TAU * (-4.2 / 360.0);
    let altitude = std::f64::consts::TAU * ((21.0 - 7.0 * 1.3) / 360.0);
    let x = (r - n) * (encoder + azimuth).cos() * altitude.cos() + n * encoder.cos();
    let y = (r - n) * (encoder + azimuth).sin() * altitude.cos() + n * encoder.sin();
    let z = (r - n) * altitude.sin();
    let expected_m = DVec3::new(-x, -y, z + 36.18) * 1e-3;
    let head_cdeg = 18_000.0 + 100.0 / 512.0 * 36_000.0;
    let found_m = model.beams[7].point_m(f64::sin_cos(f64::to_radians(head_cdeg * 0.01)), 5.0);
    assert!((found_m - expected_m).length() < 1e-9, "{found_m} {expected_m}");
}

#[test]
fn of_two_returns_the_first_is_given_and_the_second_where_it_is_none() {
    for profile in PROFILES.into_iter().filter(|profile| profile.second_at.is_some()) {
        let model = of(&old_metadata(profile.name)).unwrap();
        let column = Column { time_ns: 5, azimuth_cdeg: 18_000.0, azimuth_rate_cdeg_per_ns: 0.0 };
        let mut ranges_m = [2.0; 32];
        ranges_m[1] = 0.0;
        let mut payload = model.format.encode(&model, &[column], &ranges_m, &[7; 32]);
        for row in 0..2 {
            let cell = 32 + 12 + row * profile.cell_bytes;
            payload[cell + 4..cell + 6].copy_from_slice(&(4000_u16 / profile.range_mm as u16).to_le_bytes());
            payload[cell + profile.second_at.unwrap()] = 99;
        }
        let mut found = Vec::new();
        let mut sink =
            |_: Column, r: &[f32], f: &[u8]| found.extend([(r[0], f[0]), (r[1], f[1]), (r[2], f[2])]);
        model.format.decode(&model, 0, &payload, &mut sink).unwrap();
        assert_eq!(found, [(2.0, 7), (4.0, 99), (2.0, 7)], "{}", profile.name);
    }
}

#[test]
fn a_column_that_was_not_measured_is_left_out_and_broken_times_are_refused() {
    let model = Model::by_name("os0-32").unwrap();
    let period_ns = model.column_period_ns;
    let column = |c: usize| Column {
        time_ns: 1_000_000 + (c as f64 * period_ns) as i64,
        azimuth_cdeg: 18_000.0 + c as f32 * 36_000.0 / 1024.0,
        azimuth_rate_cdeg_per_ns: 3.6e-4,
    };
    let columns: Vec<Column> = (0..16).map(column).collect();
    let whole = model.format.encode(&model, &columns, &[1.0; 16 * 32], &[1; 16 * 32]);
    let at = |c: usize| 32 + c * (12 + 32 * 4);
    let decoded = |change: &dyn Fn(&mut Vec<u8>)| {
        let (mut payload, mut count) = (whole.clone(), 0);
        change(&mut payload);
        let taken =
            model.format.decode(&model, 0, &payload, &mut |_: Column, _: &[f32], _: &[u8]| count += 1);
        taken.map(|()| count)
    };
    assert_eq!(decoded(&|_| {}), Ok(16));
    assert_eq!(decoded(&|p| p[at(3) + 10] = 0), Ok(15));
    assert_eq!(decoded(&|p| (0..16).for_each(|c| p[at(c) + 10] = 0)), Ok(0));
    assert_eq!(decoded(&|p| p.truncate(48)), Err(Refused::NoRanges));
    assert_eq!(decoded(&|p| p.push(0)), Err(Refused::WrongSize));
    assert_eq!(decoded(&|p| p[at(3) + 9] = 0xff), Err(Refused::NotUnderstood), "a column beyond the turn");
    assert_eq!(decoded(&|p| p[at(3) + 7] = 0xff), Err(Refused::NotUnderstood), "a time beyond all");
    assert_eq!(decoded(&|p| p[at(3) + 4] = 1), Err(Refused::NotUnderstood), "a time seconds after");
    assert_eq!(
        decoded(&|p| p.copy_within(at(2)..at(2) + 8, at(3))),
        Err(Refused::NotUnderstood),
        "a time twice"
    );
}

#[test]
fn metadata_that_cannot_be_are_refused_with_the_key() {
    let whole = old_metadata("RNG15_RFL8_NIR8");
    let message = |from: &str, to: &str| {
        assert!(whole.contains(from), "{from}");
        of(&whole.replace(from, to)).unwrap_err().to_string()
    };
    for (from, to, story) in [
        ("{\"beam", "[\"beam", "expected the sensor's metadata as JSON, found"),
        ("\"OS-1-32-U2\"", "\"OS-0-32\"", "prod_line: expected os1-32's, found \"OS-0-32\""),
        ("512x20", "512", "lidar_mode: expected columns and revolutions a second as 1024x10, found \"512\""),
        ("512x20", "1024x20", "columns_per_frame: expected 1024 as in lidar_mode, found 512"),
        ("512x20", "99999999x20", "lidar_mode: expected"),
        ("RNG15_RFL8_NIR8", "RNG15", "udp_profile_lidar: expected one of LEGACY, "),
        (
            "\"columns_per_packet\": 16",
            "\"columns_per_packet\": 512",
            "columns_per_packet: expected packets of at",
        ),
        (
            "\"columns_per_packet\": 16",
            "\"columns_per_packet\": 0",
            "columns_per_packet: expected a whole number",
        ),
        ("[21,", "[", "beams: expected 32 as an os1-32 has, found 31 beam_altitude_angles, 32 beam_azimuth"),
        ("[21,", "[91,", "beam_altitude_angles: expected -90 to 90 degrees, found 91"),
        ("[21,", "[\"high\",", "beam_altitude_angles: expected a list of numbers, found [\"high\""),
        ("beam_azimuth_angles", "azimuth", "beam_azimuth_angles: expected one angle a beam, found none"),
        ("_mm\": 15.8", "_mm\": \"far\"", "lidar_origin_to_beam_origin_mm: expected a length, found \"far\""),
        ("[-1, 0,", "[-1, 0.1,", "lidar_to_sensor_transform: expected a turn about z and a step along z"),
        ("[-1, 0,", "[-1,", "lidar_to_sensor_transform: expected 16 numbers below 1000, found 15"),
    ] {
        let found = message(from, to);
        assert!(found.starts_with(&format!("calibration: {story}")), "{found}");
    }
}

#[test]
fn every_profile_gives_back_what_was_put_into_it() {
    for profile in PROFILES {
        let model = of(&old_metadata(profile.name)).unwrap();
        let column = |c: i64| Column {
            time_ns: 1_700_000_000_000_000_123 + (c as f64 * model.column_period_ns) as i64,
            azimuth_cdeg: ((18_000.0 + (500 + c) as f64 * 36_000.0 / 512.0) % 36_000.0) as f32,
            azimuth_rate_cdeg_per_ns: 7.2e-4,
        };
        // Over the end of the turn.
        let columns: Vec<Column> = (0..16).map(column).collect();
        let range_m: Vec<f32> = (0..16 * 32_u16).map(|i| f32::from(i * 31) * 0.008).collect();
        let reflectivity: Vec<u8> = (0..16 * 32_u32).map(|i| (i % 256) as u8).collect();
        let payload = model.format.encode(&model, &columns, &range_m, &reflectivity);
        assert_eq!(payload.len(), model.packet_bytes());
        let (mut got, mut ranges_m, mut reflectivities) = (Vec::new(), Vec::new(), Vec::new());
        let mut sink = |column: Column, range_m: &[f32], reflectivity: &[u8]| {
            got.push(column);
            ranges_m.extend_from_slice(range_m);
            reflectivities.extend_from_slice(reflectivity);
        };
        model.format.decode(&model, 0, &payload, &mut sink).unwrap();
        assert!(
            ranges_m.iter().zip(&range_m).all(|(got, sent)| (got - sent).abs() < 1e-5),
            "{}",
            profile.name
        );
        // Of a second return without a first nothing is known.
        let known = |i: usize| range_m[i] > 0.0 || profile.second_at.is_none();
        let same = |i: usize| !known(i) || reflectivities[i] == reflectivity[i];
        assert!((0..reflectivity.len()).all(same), "{}", profile.name);
        for (got, sent) in got.iter().zip(&columns) {
            assert_eq!(
                (got.time_ns, got.azimuth_cdeg),
                (sent.time_ns, sent.azimuth_cdeg),
                "{}",
                profile.name
            );
        }
    }
}
