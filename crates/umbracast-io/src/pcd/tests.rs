//! Tests of the PCD reader and writer.

use super::*;

const ENCODINGS: [PcdEncoding; 3] = [PcdEncoding::Ascii, PcdEncoding::Binary, PcdEncoding::BinaryCompressed];

/// All kinds, one field of three values a point, x y z not in front.
fn cloud() -> PcdCloud {
    let kinds = [
        ("ring", PcdKind::U16, 1),
        ("z", PcdKind::F32, 1),
        ("intensity", PcdKind::U8, 1),
        ("y", PcdKind::F64, 1),
        ("normal", PcdKind::F32, 3),
        ("a", PcdKind::I8, 1),
        ("b", PcdKind::I16, 1),
        ("c", PcdKind::I32, 1),
        ("d", PcdKind::I64, 1),
        ("t", PcdKind::U32, 1),
        ("stamp", PcdKind::U64, 1),
        ("x", PcdKind::F32, 1),
    ];
    let points = 60;
    let value = |kind: PcdKind, i: usize| match kind {
        PcdKind::I8 | PcdKind::I16 | PcdKind::I32 | PcdKind::I64 => i as f64 - 100.0,
        PcdKind::U8 => i as f64,
        PcdKind::U16 => i as f64 * 300.0,
        PcdKind::U32 | PcdKind::U64 => i as f64 * 20_000_000.0,
        PcdKind::F32 => f64::from(i as f32 * 0.1 - 3.0),
        PcdKind::F64 => i as f64 / 3.0,
    };
    let field = |&(name, kind, count): &(&str, PcdKind, usize)| PcdField {
        name: name.to_owned(),
        kind,
        count,
        values: (0..points * count).map(|i| value(kind, i)).collect(),
    };
    PcdCloud {
        width: 20,
        height: 3,
        viewpoint: [1.0, 2.0, 3.5, 0.5, 0.5, 0.5, 0.5],
        fields: kinds.iter().map(field).collect(),
    }
}

#[test]
fn every_kind_survives_every_encoding() {
    for encoding in ENCODINGS {
        assert!(read_pcd(&write_pcd(&cloud(), encoding), "a.pcd").unwrap() == cloud(), "{encoding:?}");
    }
}

#[test]
fn points_come_from_fields_in_any_order() {
    let (points, dropped) = cloud().sensor_points(42).unwrap();
    assert_eq!((points.len(), dropped), (60, 0));
    let p = points[7];
    assert_eq!(p.position_m, [7.0 * 0.1 - 3.0, (7.0_f64 / 3.0) as f32, 7.0 * 0.1 - 3.0]);
    assert_eq!((p.time_ns, p.reflectivity), (42, 7.0));
}

#[test]
fn a_missing_intensity_is_zero_and_points_that_are_not_finite_are_counted() {
    let text = "VERSION .5\nCOLUMNS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 4\nDATA ascii\n\
                1 2 3\nnan nan nan\n\n4 5 6e0\n0 inf 0\n";
    let (points, dropped) = read_pcd(text.as_bytes(), "a.pcd").unwrap().sensor_points(0).unwrap();
    assert_eq!(points.iter().map(|p| p.position_m).collect::<Vec<_>>(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    assert_eq!((dropped, points[0].reflectivity), (2, 0.0));
}

#[test]
fn an_empty_cloud_is_a_cloud() {
    let mut empty = PcdCloud { width: 0, height: 1, ..cloud() };
    empty.fields.iter_mut().for_each(|f| f.values.clear());
    for encoding in ENCODINGS {
        assert_eq!(read_pcd(&write_pcd(&empty, encoding), "a.pcd").unwrap(), empty);
    }
}

#[test]
fn errors_name_place_expected_and_found() {
    let text = String::from_utf8(write_pcd(&cloud(), PcdEncoding::Ascii)).unwrap();
    let message = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        read_pcd(text.replacen(from, to, 1).as_bytes(), "a.pcd").unwrap_err().to_string()
    };
    assert_eq!(message("WIDTH 20", "WIDTH many"), "a.pcd: line 7, WIDTH: expected a number, found \"many\"");
    assert_eq!(message("COUNT 1 1", "COUNT 1"), "a.pcd: line 6, COUNT: expected 12 values, found 11");
    assert_eq!(message("POINTS 60", "POINTS 61"), "a.pcd: POINTS: expected WIDTH 20 x HEIGHT 3, found 61");
    assert!(message("COUNT 1 1", "COUNT 0 1").starts_with("a.pcd: COUNT: expected one"));
    assert_eq!(message("SIZE 2 4", "SIZE 3 4").split(", ").last(), Some("found U3"));
    assert_eq!(
        message("FIELDS", "FILEDS"),
        "a.pcd: line 3: expected a key of a PCD header, found \"FILEDS\""
    );
    assert_eq!(
        message("DATA ascii", "DATA zip"),
        "a.pcd: DATA: expected ascii, binary or binary_compressed, found \"zip\""
    );
    let first_line = message("\n0 -3 0 ", "\n0 -3 x ");
    assert_eq!(first_line, "a.pcd: line 12, field \"intensity\": expected a number, found \"x\"");
    let cut = &text.as_bytes()[..text.len() - 300];
    assert!(read_pcd(cut, "a.pcd").unwrap_err().to_string().starts_with("a.pcd: "));
    assert_eq!(
        read_pcd(b"VERSION 0.7\n", "a.pcd").unwrap_err().to_string(),
        "a.pcd: line 2: expected DATA, found the file's end"
    );
    let mut no_x = cloud();
    no_x.fields.truncate(2);
    let message = no_x.sensor_points(0).unwrap_err().to_string();
    assert_eq!(message, "expected a field \"x\", found ring z");
}

#[test]
fn cut_binary_data_says_how_much_is_there() {
    let whole = write_pcd(&cloud(), PcdEncoding::Binary);
    let message = read_pcd(&whole[..whole.len() - 1], "a.pcd").unwrap_err().to_string();
    assert_eq!(message, "a.pcd: data: expected 60 points of 58 bytes, found 3479 bytes");
    let whole = write_pcd(&cloud(), PcdEncoding::BinaryCompressed);
    let message = read_pcd(&whole[..whole.len() - 1], "a.pcd").unwrap_err().to_string();
    assert!(message.starts_with("a.pcd: compressed data: expected "), "{message}");
}

/// The property of the fuzz target `pcd`, over files with random bytes changed.
#[test]
fn any_bytes_give_a_cloud_or_an_error() {
    let mut state = 5_u64;
    let mut next = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    for encoding in ENCODINGS {
        let whole = write_pcd(&cloud(), encoding);
        for _ in 0..5_000 {
            let mut bytes = whole.clone();
            for _ in 0..1 + next() % 6 {
                let at = next() % bytes.len();
                bytes[at] = if next() % 2 == 0 { b'9' } else { next() as u8 };
            }
            if let Ok(cloud) = read_pcd(&bytes, "a.pcd") {
                let points = cloud.width * cloud.height;
                assert!(cloud.fields.iter().all(|f| f.values.len() == points * f.count));
            }
        }
    }
}
