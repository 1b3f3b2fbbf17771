//! Point clouds from and to PCD files: every version up to 0.7, every encoding, every field type, fields in any
//! order. Format: pointclouds.org, "The PCD file format".
//!
//! By hand: any field of any type is read by its name, and errors say line, expected and found.

mod header;

use umbracast::Error;
use umbracast::lidar::SensorPoint;

use crate::lzf;
use header::Header;

/// A file's points, field by field.
#[derive(Debug, Clone, PartialEq)]
pub struct PcdCloud {
    /// Points in a row; all of them where the cloud is unorganised.
    pub width: usize,
    /// Rows; 1 where the cloud is unorganised.
    pub height: usize,
    /// Where the sensor stood: x y z in metres, then the quaternion w x y z.
    pub viewpoint: [f64; 7],
    /// In the file's order.
    pub fields: Vec<PcdField>,
}

/// One field of all points.
#[derive(Debug, Clone, PartialEq)]
pub struct PcdField {
    /// Its name: `x`, `intensity` ...
    pub name: String,
    /// How the file stores it.
    pub kind: PcdKind,
    /// Values a point.
    pub count: usize,
    /// `count` values for each point. Whole numbers above 2^53 are rounded.
    pub values: Vec<f64>,
}

/// How a file stores a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum PcdKind {
    I8,
    I16,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
    F32,
    F64,
}

/// How a file stores its points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PcdEncoding {
    /// A line a point.
    Ascii,
    /// Packed records, little-endian.
    Binary,
    /// All values of a field, then those of the next, compressed with LZF.
    BinaryCompressed,
}

/// Reads a PCD file. `name` is the file's, for messages.
///
/// # Errors
/// What does not fit the format, with file, line or field, what was expected and what was found.
pub fn read_pcd(bytes: &[u8], name: &str) -> Result<PcdCloud, Error> {
    read(bytes).map_err(|e| e.within(name))
}

/// Writes a cloud as PCD 0.7.
pub fn write_pcd(cloud: &PcdCloud, encoding: PcdEncoding) -> Vec<u8> {
    let mut bytes = header::text(cloud, encoding).into_bytes();
    let points = cloud.width * cloud.height;
    match encoding {
        PcdEncoding::Ascii => {
            for p in 0..points {
                let values = cloud.fields.iter().flat_map(|f| f.point(p).iter().map(|&v| f.kind.to_text(v)));
                bytes.extend_from_slice(values.collect::<Vec<_>>().join(" ").as_bytes());
                bytes.push(b'\n');
            }
        }
        PcdEncoding::Binary => {
            for p in 0..points {
                for field in &cloud.fields {
                    field.point(p).iter().for_each(|&value| field.kind.push(value, &mut bytes));
                }
            }
        }
        PcdEncoding::BinaryCompressed => {
            let mut raw = Vec::new();
            for field in &cloud.fields {
                field.values.iter().for_each(|&value| field.kind.push(value, &mut raw));
            }
            let compressed = lzf::compress(&raw);
            bytes.extend_from_slice(&(compressed.len() as u32).to_le_bytes());
            bytes.extend_from_slice(&(raw.len() as u32).to_le_bytes());
            bytes.extend_from_slice(&compressed);
        }
    }
    bytes
}

impl PcdCloud {
    /// The field of this name.
    pub fn field(&self, name: &str) -> Option<&PcdField> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// The points in the sensor's frame, all at `time_ns` (the unit of a time field is nowhere laid down), with
    /// `intensity` where there is one and 0 where not; and how many were dropped as not finite.
    ///
    /// # Errors
    /// A cloud without x, y or z.
    pub fn sensor_points(&self, time_ns: i64) -> Result<(Vec<SensorPoint>, u64), Error> {
        let axis = |name: &str| {
            self.field(name).filter(|f| f.count == 1).ok_or_else(|| {
                let found: Vec<_> = self.fields.iter().map(|f| f.name.as_str()).collect();
                Error::new(format!("expected a field {name:?}, found {}", found.join(" ")))
            })
        };
        let (x, y, z) = (axis("x")?, axis("y")?, axis("z")?);
        let intensity = self.field("intensity").filter(|f| f.count == 1);
        let points: Vec<_> = (0..x.values.len())
            .map(|p| SensorPoint {
                position_m: [x, y, z].map(|axis| axis.values[p] as f32),
                time_ns,
                reflectivity: intensity.map_or(0.0, |f| f.values[p] as f32),
            })
            .filter(|point| point.position_m.iter().all(|v| v.is_finite()))
            .collect();
        let dropped = (x.values.len() - points.len()) as u64;
        Ok((points, dropped))
    }
}

impl PcdField {
    fn point(&self, p: usize) -> &[f64] {
        &self.values[p * self.count..][..self.count]
    }
}

impl PcdKind {
    /// Bytes of one value.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// `bytes` are exactly one value's.
    fn value(self, bytes: &[u8]) -> f64 {
        let mut eight = [0; 8];
        eight[..bytes.len()].copy_from_slice(bytes);
        let bits = u64::from_le_bytes(eight);
        match self {
            Self::I8 => f64::from(bits as i8),
            Self::I16 => f64::from(bits as i16),
            Self::I32 => f64::from(bits as i32),
            Self::I64 => bits as i64 as f64,
            Self::U8 | Self::U16 | Self::U32 | Self::U64 => bits as f64,
            Self::F32 => f64::from(f32::from_bits(bits as u32)),
            Self::F64 => f64::from_bits(bits),
        }
    }

    fn push(self, value: f64, bytes: &mut Vec<u8>) {
        match self {
            Self::I8 => bytes.extend_from_slice(&(value as i8).to_le_bytes()),
            Self::I16 => bytes.extend_from_slice(&(value as i16).to_le_bytes()),
            Self::I32 => bytes.extend_from_slice(&(value as i32).to_le_bytes()),
            Self::I64 => bytes.extend_from_slice(&(value as i64).to_le_bytes()),
            Self::U8 => bytes.push(value as u8),
            Self::U16 => bytes.extend_from_slice(&(value as u16).to_le_bytes()),
            Self::U32 => bytes.extend_from_slice(&(value as u32).to_le_bytes()),
            Self::U64 => bytes.extend_from_slice(&(value as u64).to_le_bytes()),
            Self::F32 => bytes.extend_from_slice(&(value as f32).to_le_bytes()),
            Self::F64 => bytes.extend_from_slice(&value.to_le_bytes()),
        }
    }

    /// Enough digits to come back as the same number.
    fn to_text(self, value: f64) -> String {
        match self {
            Self::F32 => (value as f32).to_string(),
            _ => value.to_string(),
        }
    }
}

fn read(bytes: &[u8]) -> Result<PcdCloud, Error> {
    let (header, data) = Header::read(bytes)?;
    let mut cloud = header.cloud;
    let points = cloud.width * cloud.height;
    let record: usize = cloud.fields.iter().map(|f| f.count * f.kind.size()).sum();
    match header.encoding {
        PcdEncoding::Ascii => read_ascii(&mut cloud.fields, points, data, header.lines)?,
        PcdEncoding::Binary => {
            let data = exactly(data, points, record)?;
            let mut at = 0;
            for field in &mut cloud.fields {
                let (kind, bytes) = (field.kind, field.count * field.kind.size());
                let values =
                    data.chunks_exact(record).flat_map(|r| r[at..at + bytes].chunks_exact(kind.size()));
                field.values = values.map(|value| kind.value(value)).collect();
                at += bytes;
            }
        }
        PcdEncoding::BinaryCompressed => {
            let size = |at: usize| {
                let bytes = data.get(at..at + 4).and_then(|b| b.try_into().ok());
                bytes.map(u32::from_le_bytes).ok_or_else(|| Error::new("compressed data: no sizes before it"))
            };
            let (packed, unpacked) = (size(0)? as usize, size(4)? as usize);
            let packed = data[8..].get(..packed).ok_or_else(|| {
                Error::new(format!("compressed data: expected {packed} bytes, found {}", data.len() - 8))
            })?;
            let raw = lzf::decompress(packed, unpacked)
                .ok_or_else(|| Error::new(format!("compressed data: does not unpack to {unpacked} bytes")))?;
            let mut raw = exactly(&raw, points, record)?;
            for field in &mut cloud.fields {
                let (column, rest) = raw.split_at(points * field.count * field.kind.size());
                field.values = column.chunks_exact(field.kind.size()).map(|v| field.kind.value(v)).collect();
                raw = rest;
            }
        }
    }
    Ok(cloud)
}

/// The bytes of all records; more may follow them.
fn exactly(data: &[u8], points: usize, record: usize) -> Result<&[u8], Error> {
    points.checked_mul(record).and_then(|bytes| data.get(..bytes)).ok_or_else(|| {
        let found = data.len();
        Error::new(format!("data: expected {points} points of {record} bytes, found {found} bytes"))
    })
}

fn read_ascii(fields: &mut [PcdField], points: usize, data: &[u8], header_lines: usize) -> Result<(), Error> {
    let lines = data.split(|&byte| byte == b'\n').zip(header_lines + 1..);
    let mut lines = lines.filter(|(line, _)| !line.trim_ascii().is_empty());
    for p in 0..points {
        let (line, number) =
            lines.next().ok_or_else(|| Error::new(format!("data: expected {points} points, found {p}")))?;
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        for field in &mut *fields {
            for _ in 0..field.count {
                let word = words.next().map(String::from_utf8_lossy).unwrap_or_default();
                let value: f64 = word.parse().map_err(|_| {
                    let place = format!("line {number}, field {:?}", field.name);
                    Error::new(format!("{place}: expected a number, found {word:?}"))
                })?;
                field.values.push(if field.kind == PcdKind::F32 { f64::from(value as f32) } else { value });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
