//! Point clouds as LAS files, for CloudCompare, QGIS and PDAL: LAS 1.2, point format 1, coordinates in whole millimetres. Fields
//! that LAS has no place for are extra bytes. Format: ASPRS, "LAS Specification Version 1.2", and for extra bytes 1.4 R15.
//!
//! Written by hand: a header of numbers and records of 28 bytes; a test reads it back with the crate `las`.

use umbracast::Error;

use crate::pcd::{PcdCloud, PcdField, PcdKind};

const HEADER_BYTES: u16 = 227;
const VLR_HEADER_BYTES: usize = 54;
const EXTRA_BYTES: usize = 192;
const RECORD_BYTES: usize = 28;
const UNIT_M: f64 = 0.001;
/// One return of one.
const ONLY_RETURN: u8 = 0b0000_1001;

/// The bytes of the file. Fields `x`, `y`, `z` are coordinates in metres, `intensity` and `time_s` (as GPS time) have places of
/// their own, and others become extra bytes of their kind and name.
///
/// # Errors
/// A cloud without x, y or z, or coordinates that are no numbers or more than 2000 km apart.
pub fn write_las(cloud: &PcdCloud) -> Result<Vec<u8>, Error> {
    let axis = |name: &str| {
        cloud
            .field(name)
            .filter(|f| f.count == 1)
            .ok_or_else(|| Error::new(format!("LAS: expected a field {name:?}, found none")))
    };
    let axes = [axis("x")?, axis("y")?, axis("z")?];
    let bounds = axes.map(|axis| {
        let fold = |start: f64, with: fn(f64, f64) -> f64| axis.values.iter().copied().fold(start, with);
        [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)]
    });
    let bounds = if axes[0].values.is_empty() { [[0.0; 2]; 3] } else { bounds };
    let offset_m = bounds.map(|[low, _]| low.floor());
    let (intensity, time_s) = (cloud.field("intensity"), cloud.field("time_s"));
    let own = ["x", "y", "z", "intensity", "time_s"];
    let extra: Vec<&PcdField> =
        cloud.fields.iter().filter(|field| field.count == 1 && !own.contains(&field.name.as_str())).collect();
    let record_bytes = RECORD_BYTES + extra.iter().map(|field| field.kind.size()).sum::<usize>();
    let count = axes[0].values.len() as u32;
    let mut bytes = header(count, record_bytes as u16, extra.len(), offset_m, bounds);
    describe(&extra, &mut bytes);
    for p in 0..count as usize {
        for (axis, offset_m) in axes.iter().zip(offset_m) {
            let units = ((axis.values[p] - offset_m) / UNIT_M).round();
            if !(0.0..=f64::from(i32::MAX)).contains(&units) {
                let found = axis.values[p];
                let story = format!(
                    "LAS: field {:?} of point {p}: expected a number near the others, found {found}",
                    axis.name
                );
                return Err(Error::new(story));
            }
            bytes.extend_from_slice(&(units as i32).to_le_bytes());
        }
        let value = |field: Option<&PcdField>| field.map_or(0.0, |field| field.values[p]);
        // The cast takes what does not fit to the nearest that does.
        bytes.extend_from_slice(&(value(intensity).round() as u16).to_le_bytes());
        bytes.extend_from_slice(&[ONLY_RETURN, 0, 0, 0, 0, 0]);
        bytes.extend_from_slice(&value(time_s).to_le_bytes());
        extra.iter().for_each(|field| field.kind.push(field.values[p], &mut bytes));
    }
    Ok(bytes)
}

fn header(count: u32, record_bytes: u16, extra: usize, offset_m: [f64; 3], bounds: [[f64; 2]; 3]) -> Vec<u8> {
    let vlr_bytes = if extra == 0 { 0 } else { VLR_HEADER_BYTES + EXTRA_BYTES * extra };
    let mut bytes = b"LASF".to_vec();
    // Source, encoding and the project's number: none.
    bytes.extend_from_slice(&[0; 20]);
    bytes.extend_from_slice(&[1, 2]);
    bytes.extend_from_slice(&padded::<32>("EXTRACTION"));
    bytes.extend_from_slice(&padded::<32>("umbracast"));
    // No day of creation: equal clouds are equal bytes.
    bytes.extend_from_slice(&[0; 4]);
    bytes.extend_from_slice(&HEADER_BYTES.to_le_bytes());
    bytes.extend_from_slice(&(u32::from(HEADER_BYTES) + vlr_bytes as u32).to_le_bytes());
    bytes.extend_from_slice(&u32::from(extra > 0).to_le_bytes());
    bytes.push(1);
    bytes.extend_from_slice(&record_bytes.to_le_bytes());
    [count, count, 0, 0, 0, 0].iter().for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
    let units_m = [UNIT_M; 3].into_iter().chain(offset_m);
    let bounds = bounds.into_iter().flat_map(|[low, high]| [high, low]);
    units_m.chain(bounds).for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
    bytes
}

/// The record that names extra bytes.
fn describe(extra: &[&PcdField], bytes: &mut Vec<u8>) {
    if extra.is_empty() {
        return;
    }
    bytes.extend_from_slice(&[0; 2]);
    bytes.extend_from_slice(&padded::<16>("LASF_Spec"));
    bytes.extend_from_slice(&4_u16.to_le_bytes());
    bytes.extend_from_slice(&((EXTRA_BYTES * extra.len()) as u16).to_le_bytes());
    bytes.extend_from_slice(&padded::<32>("extra bytes"));
    for field in extra {
        let kind = match field.kind {
            PcdKind::U8 => 1,
            PcdKind::I8 => 2,
            PcdKind::U16 => 3,
            PcdKind::I16 => 4,
            PcdKind::U32 => 5,
            PcdKind::I32 => 6,
            PcdKind::U64 => 7,
            PcdKind::I64 => 8,
            PcdKind::F32 => 9,
            PcdKind::F64 => 10,
        };
        bytes.extend_from_slice(&[0, 0, kind, 0]);
        bytes.extend_from_slice(&padded::<32>(&field.name));
        // Neither bounds, scale nor offset.
        bytes.extend_from_slice(&[0; 124]);
        bytes.extend_from_slice(&padded::<32>(""));
    }
}

/// A text in its place, cut where it is longer.
fn padded<const N: usize>(text: &str) -> [u8; N] {
    let mut place = [0; N];
    let length = text.len().min(N - 1);
    place[..length].copy_from_slice(&text.as_bytes()[..length]);
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(x: [f64; 3]) -> PcdCloud {
        let field = |name: &str, kind, values: [f64; 3]| PcdField {
            name: name.to_owned(),
            kind,
            count: 1,
            values: values.into(),
        };
        PcdCloud {
            width: 3,
            height: 1,
            viewpoint: [0.0; 7],
            fields: vec![
                field("x", PcdKind::F32, x),
                field("y", PcdKind::F32, [500.25, 500.5, 512.0]),
                field("z", PcdKind::F32, [0.0, 1.75, -0.125]),
                field("intensity", PcdKind::F32, [0.0, 12.4, 255.0]),
                field("time_s", PcdKind::F64, [1_700_000_000.0, 1_700_000_000.05, 1_700_000_000.1]),
                field("sensor", PcdKind::U16, [0.0, 1.0, 2.0]),
            ],
        }
    }

    #[test]
    fn another_reader_finds_every_point_with_its_fields() {
        let bytes = write_las(&cloud([-3.5, 2.001, 17.0])).unwrap();
        let mut reader = las::Reader::new(std::io::Cursor::new(bytes)).unwrap();
        let header = reader.header().clone();
        assert_eq!((header.number_of_points(), header.version()), (3, las::Version::new(1, 2)));
        let (bounds, extra) = (header.bounds(), header.vlrs().iter().find(|vlr| vlr.record_id == 4).unwrap());
        assert_eq!((bounds.min.x, bounds.max.y, bounds.min.z), (-3.5, 512.0, -0.125));
        assert!(extra.data.len() == 192 && extra.data[4..].starts_with(b"sensor\0") && extra.data[2] == 3);
        let points: Vec<las::Point> = reader.read_all().unwrap().points().map(Result::unwrap).collect();
        assert!((points[1].x - 2.001).abs() < 1e-9 && (points[1].z - 1.75).abs() < 1e-9);
        assert_eq!((points[1].intensity, points[1].return_number, points[1].number_of_returns), (12, 1, 1));
        assert_eq!((points[2].gps_time, &points[2].extra_bytes[..]), (Some(1_700_000_000.1), &[2, 0][..]));
    }

    #[test]
    fn coordinates_that_no_file_holds_are_refused() {
        for x in [[0.0, f64::NAN, 1.0], [0.0, f64::INFINITY, 1.0], [0.0, 1.0, 3e6]] {
            let told = write_las(&cloud(x)).unwrap_err().to_string();
            assert!(told.starts_with("LAS: field \"x\" of point"), "{told}");
        }
        let mut none = cloud([0.0; 3]);
        none.fields.iter_mut().for_each(|field| field.values.clear());
        assert_eq!(
            las::Reader::new(std::io::Cursor::new(write_las(&none).unwrap()))
                .unwrap()
                .header()
                .number_of_points(),
            0
        );
        none.fields.remove(2);
        assert_eq!(write_las(&none).unwrap_err().to_string(), "LAS: expected a field \"z\", found none");
    }
}
