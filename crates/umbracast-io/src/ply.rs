//! Point clouds as PLY files, for CloudCompare, MeshLab and Open3D: binary, little-endian, a property for each field.
//! Format: Greg Turk, "The PLY Polygon File Format".
//!
//! Written by hand: a header and records of numbers.

use crate::pcd::{PcdCloud, PcdKind};

/// The bytes of the file. `told` is a line of comment for who opens it. Whole numbers of 8 bytes, which PLY lacks, become floating
/// point.
pub fn write_ply(cloud: &PcdCloud, told: &str) -> Vec<u8> {
    let points = cloud.width * cloud.height;
    let told = told.replace(['\r', '\n'], " ");
    let mut header =
        format!("ply\nformat binary_little_endian 1.0\ncomment {told}\nelement vertex {points}\n");
    let fields: Vec<_> = cloud.fields.iter().filter(|field| field.count == 1).collect();
    for field in &fields {
        header += &format!("property {} {}\n", name_of(kind(field.kind)), field.name);
    }
    let mut bytes = (header + "end_header\n").into_bytes();
    for p in 0..points {
        fields.iter().for_each(|field| kind(field.kind).push(field.values[p], &mut bytes));
    }
    bytes
}

fn kind(kind: PcdKind) -> PcdKind {
    if matches!(kind, PcdKind::I64 | PcdKind::U64) { PcdKind::F64 } else { kind }
}

fn name_of(kind: PcdKind) -> &'static str {
    match kind {
        PcdKind::I8 => "char",
        PcdKind::I16 => "short",
        PcdKind::I32 => "int",
        PcdKind::U8 => "uchar",
        PcdKind::U16 => "ushort",
        PcdKind::U32 => "uint",
        PcdKind::F32 => "float",
        PcdKind::I64 | PcdKind::U64 | PcdKind::F64 => "double",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pcd::PcdField;

    #[test]
    fn every_field_is_a_property_of_its_own_kind() {
        let field = |name: &str, kind, values: [f64; 2]| PcdField {
            name: name.to_owned(),
            kind,
            count: 1,
            values: values.into(),
        };
        let cloud = PcdCloud {
            width: 2,
            height: 1,
            viewpoint: [0.0; 7],
            fields: vec![
                field("x", PcdKind::F32, [1.5, -2.0]),
                field("sensor", PcdKind::U16, [0.0, 513.0]),
                field("track", PcdKind::U64, [7.0, 8.0]),
            ],
        };
        let bytes = write_ply(&cloud, "site\nframe");
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let header = String::from_utf8(bytes[..end].to_vec()).unwrap();
        let lines: Vec<&str> = header.lines().collect();
        assert_eq!(lines[..3], ["ply", "format binary_little_endian 1.0", "comment site frame"]);
        let properties =
            ["element vertex 2", "property float x", "property ushort sensor", "property double track"];
        assert_eq!(lines[3..7], properties);
        let second = &bytes[end + 14..];
        assert_eq!(second[..4], (-2.0_f32).to_le_bytes());
        assert_eq!(second[4..6], 513_u16.to_le_bytes());
        assert_eq!(second[6..], 8.0_f64.to_le_bytes());
    }
}
