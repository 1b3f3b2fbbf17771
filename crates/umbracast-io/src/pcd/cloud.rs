//! A cloud as a PCD file holds it: fields of numbers of any kind.

use umbracast::Error;
use umbracast::lidar::SensorPoint;

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
    pub(super) fn point(&self, p: usize) -> &[f64] {
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
    pub(super) fn value(self, bytes: &[u8]) -> f64 {
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

    pub(crate) fn push(self, value: f64, bytes: &mut Vec<u8>) {
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
    pub(super) fn to_text(self, value: f64) -> String {
        match self {
            Self::F32 => (value as f32).to_string(),
            _ => value.to_string(),
        }
    }
}
