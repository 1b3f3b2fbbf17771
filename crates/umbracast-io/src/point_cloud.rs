//! `sensor_msgs/PointCloud2`, of any layout: fields of any type in any order, either byte order, rows with or without
//! a gap. The reader uses the points' times if there are any: `t` (whole nanoseconds after the stamp, Ouster), `time`
//! (seconds after the stamp, Velodyne), `timestamp` (seconds since 1970, Hesai and RoboSense), `offset_time`
//! (nanoseconds, Livox).

use umbracast::lidar::SensorPoint;

use crate::cdr::Decoder;

/// A cloud in its sensor's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCloud {
    /// The message's time.
    pub stamp_ns: i64,
    /// The frame that the points are in.
    pub frame_id: String,
    /// Points that are finite.
    pub points: Vec<SensorPoint>,
    /// How many were not.
    pub dropped: u64,
}

/// A field of a point: where it stands, and its type as the message numbers it.
#[derive(Debug, Clone, Copy)]
struct Field {
    offset: usize,
    datatype: u8,
}

/// Types of fields as messages number them.
const UINT32: u8 = 6;
const FLOAT32: u8 = 7;

/// Reads a message; `None` for bytes that are none, or a cloud without x, y and z.
pub fn read(bytes: &[u8]) -> Option<PointCloud> {
    let mut d = Decoder::new(bytes)?;
    let stamp_ns = d.time()?;
    let frame_id = d.string()?.to_owned();
    let (height, width) = (d.u32()? as usize, d.u32()? as usize);
    let mut fields: Vec<(&str, Field)> = Vec::new();
    for _ in 0..d.u32()? {
        let (name, offset, datatype, _count) = (d.string()?, d.u32()? as usize, d.u8()?, d.u32()?);
        fields.push((name, Field { offset, datatype }));
    }
    let big_endian = d.bool()?;
    let (point_step, row_step) = (d.u32()? as usize, d.u32()? as usize);
    let length = d.u32()? as usize;
    let data = d.array(length)?;
    let row_step = if height > 1 { row_step } else { point_step.checked_mul(width)? };
    if point_step == 0
        || row_step < point_step.checked_mul(width)?
        || data.len() < row_step.checked_mul(height)?
    {
        return None;
    }
    let field =
        |names: &[&str]| fields.iter().find(|(name, _)| names.contains(name)).map(|(_, field)| *field);
    let [x, y, z] = [field(&["x"])?, field(&["y"])?, field(&["z"])?];
    let layout = Layout {
        position: [x, y, z],
        reflectivity: field(&["intensity", "reflectivity"]),
        time: match (field(&["t", "offset_time"]), field(&["time"]), field(&["timestamp"])) {
            (Some(field), _, _) => Time::Nanoseconds(field),
            (_, Some(field), _) => Time::Seconds(field),
            (_, _, Some(field)) => Time::Since1970(field),
            _ => Time::OfMessage,
        },
        stamp_ns,
    };
    // Three numbers of a point take twelve bytes in nearly every cloud; where they take fewer, the list grows.
    let points = Vec::with_capacity(height.saturating_mul(width).min(data.len() / 12));
    let mut cloud = PointCloud { stamp_ns, frame_id, points, dropped: 0 };
    // A cloud without columns has no points, however many rows it names.
    let rows = if width == 0 { 0 } else { height };
    let points =
        (0..rows).flat_map(|row| data[row * row_step..][..width * point_step].chunks_exact(point_step));
    let mut take = |point: SensorPoint| match point.position_m.iter().all(|m| m.is_finite()) {
        true => cloud.points.push(point),
        false => cloud.dropped += 1,
    };
    if layout.is_usual(big_endian, point_step) {
        points.for_each(|point| take(layout.usual_point(point)));
    } else {
        for point in points {
            take(layout.point(point, big_endian)?);
        }
    }
    Some(cloud)
}

/// Where a point's numbers stand.
struct Layout {
    position: [Field; 3],
    reflectivity: Option<Field>,
    time: Time,
    stamp_ns: i64,
}

/// What tells a point's time.
enum Time {
    /// After the message's.
    Nanoseconds(Field),
    /// After the message's.
    Seconds(Field),
    Since1970(Field),
    OfMessage,
}

impl Layout {
    /// `None` where a number cannot be read.
    fn point(&self, point: &[u8], big_endian: bool) -> Option<SensorPoint> {
        let value = |field: Field| field.value(point, big_endian);
        let time_ns = match self.time {
            Time::Nanoseconds(field) => self.stamp_ns.saturating_add(value(field)? as i64),
            Time::Seconds(field) => self.stamp_ns.saturating_add((value(field)? * 1e9) as i64),
            Time::Since1970(field) => (value(field)? * 1e9) as i64,
            Time::OfMessage => self.stamp_ns,
        };
        let [x, y, z] = self.position;
        let position_m = [value(x)? as f32, value(y)? as f32, value(z)? as f32];
        let reflectivity = self.reflectivity.and_then(value).unwrap_or(0.0) as f32;
        Some(SensorPoint { position_m, time_ns, reflectivity })
    }

    /// Whether [`Self::usual_point`] reads the points: all within their bytes and of the types that nearly every driver writes.
    fn is_usual(&self, big_endian: bool, point_step: usize) -> bool {
        let whole = |field: &Field, datatype: u8| {
            field.datatype == datatype && field.offset.checked_add(4).is_some_and(|end| end <= point_step)
        };
        let time = match &self.time {
            Time::Nanoseconds(field) => whole(field, UINT32),
            Time::OfMessage => true,
            Time::Seconds(_) | Time::Since1970(_) => false,
        };
        !big_endian
            && time
            && self.position.iter().chain(&self.reflectivity).all(|field| whole(field, FLOAT32))
    }

    /// [`Self::point`] without a look at types.
    #[inline(always)]
    fn usual_point(&self, point: &[u8]) -> SensorPoint {
        let bytes = |field: Field| point[field.offset..].first_chunk().copied().unwrap_or_default();
        let number = |field: Field| f32::from_le_bytes(bytes(field));
        let after_ns = match self.time {
            Time::Nanoseconds(field) => u32::from_le_bytes(bytes(field)),
            _ => 0,
        };
        SensorPoint {
            position_m: self.position.map(number),
            time_ns: self.stamp_ns.saturating_add(after_ns.into()),
            reflectivity: self.reflectivity.map_or(0.0, number),
        }
    }
}

impl Field {
    /// `None` for a type that there is not, or a field that leaves its point.
    #[inline]
    fn value(self, point: &[u8], big_endian: bool) -> Option<f64> {
        // Nearly every field is one of these.
        match (self.datatype, big_endian, point.get(self.offset..)?.first_chunk()) {
            (FLOAT32, false, Some(bytes)) => Some(f64::from(f32::from_le_bytes(*bytes))),
            (UINT32, false, Some(bytes)) => Some(f64::from(u32::from_le_bytes(*bytes))),
            _ => self.any_value(point, big_endian),
        }
    }

    fn any_value(self, point: &[u8], big_endian: bool) -> Option<f64> {
        let size = [1, 1, 2, 2, 4, 4, 4, 8][usize::from(self.datatype.checked_sub(1)?).min(7)];
        let mut bytes = [0; 8];
        let own = &mut bytes[..size];
        own.copy_from_slice(point.get(self.offset..self.offset.checked_add(size)?)?);
        if big_endian {
            own.reverse();
        }
        let word = u64::from_le_bytes(bytes);
        Some(match self.datatype {
            1 => f64::from(word as u8 as i8),
            2 => f64::from(word as u8),
            3 => f64::from(word as u16 as i16),
            4 => f64::from(word as u16),
            5 => f64::from(word as u32 as i32),
            6 => f64::from(word as u32),
            7 => f64::from(f32::from_bits(word as u32)),
            8 => f64::from_bits(word),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr::Encoder;

    const STAMP_NS: i64 = 1_700_000_000_100_000_000;

    /// Two points (1, 2, 3) and (NaN, 0, 0) with fields of these names, types and bytes.
    fn message(time: (&str, u8, &[u8]), big_endian: bool) -> Vec<u8> {
        let order =
            |bytes: [u8; 4]| if big_endian { bytes.into_iter().rev().collect() } else { bytes.to_vec() };
        let f32s =
            |values: [f32; 3]| values.into_iter().flat_map(|v| order(v.to_le_bytes())).collect::<Vec<u8>>();
        let mut e = Encoder::default();
        e.header(STAMP_NS, "lidar");
        e.u32(1);
        e.u32(2);
        let (name, datatype, bytes) = time;
        let fields = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), (name, 14, datatype)];
        e.u32(fields.len() as u32);
        for (name, offset, datatype) in fields {
            e.string(name);
            e.u32(offset);
            e.u8(datatype);
            e.u32(1);
        }
        e.bool(big_endian);
        e.u32(22);
        e.u32(44);
        let mut data = Vec::new();
        for position in [[1.0, 2.0, 3.0], [f32::NAN, 0.0, 0.0]] {
            let mut point = f32s(position);
            point.resize(14, 0);
            point.extend_from_slice(bytes);
            point.resize(22, 0);
            data.extend(point);
        }
        e.u32(data.len() as u32);
        e.array(&data);
        e.bool(false);
        e.finish()
    }

    #[test]
    fn fields_of_any_type_are_read_and_points_that_are_none_counted() {
        for (time, after_ns) in [
            (("t", 6, &7_000_u32.to_le_bytes()[..]), 7000),
            (("offset_time", 6, &9_000_u32.to_le_bytes()), 9000),
            (("time", 7, &(-0.0625_f32).to_le_bytes()), -62_500_000),
            (("timestamp", 8, &1_700_000_000.5_f64.to_le_bytes()), 400_000_000),
            (("ring", 4, &[3, 0]), 0),
        ] {
            let cloud = read(&message(time, false)).unwrap();
            assert_eq!((cloud.points.len(), cloud.dropped, cloud.frame_id.as_str()), (1, 1, "lidar"));
            assert_eq!(cloud.points[0].position_m, [1.0, 2.0, 3.0]);
            assert_eq!(cloud.points[0].time_ns - STAMP_NS, after_ns, "{}", time.0);
        }
        let cloud = read(&message(("t", 6, &7_000_u32.to_be_bytes()), true)).unwrap();
        assert_eq!((cloud.points[0].position_m, cloud.points[0].time_ns), ([1.0, 2.0, 3.0], STAMP_NS + 7000));
    }

    #[test]
    fn a_usual_point_is_read_as_any_other() {
        let field = |offset, datatype| Field { offset, datatype };
        let numbers = [1.5_f32, -0.25, 3e-39, 17.0].map(f32::to_le_bytes).concat();
        let point = [&numbers[..], &4_000_000_007_u32.to_le_bytes()].concat();
        for (time, reflectivity) in
            [(Time::Nanoseconds(field(16, UINT32)), Some(field(12, FLOAT32))), (Time::OfMessage, None)]
        {
            let position = [0, 4, 8].map(|offset| field(offset, FLOAT32));
            let layout = Layout { position, reflectivity, time, stamp_ns: STAMP_NS };
            assert!(layout.is_usual(false, 20) && !layout.is_usual(true, 20) && !layout.is_usual(false, 11));
            assert_eq!(Some(layout.usual_point(&point)), layout.point(&point, false));
        }
    }

    #[test]
    fn rows_without_columns_are_no_work() {
        let mut e = Encoder::default();
        e.header(STAMP_NS, "lidar");
        e.u32(u32::MAX);
        e.u32(0);
        e.u32(3);
        for (name, offset) in [("x", 0), ("y", 4), ("z", 8)] {
            e.string(name);
            e.u32(offset);
            e.u8(7);
            e.u32(1);
        }
        e.bool(false);
        e.u32(12);
        e.u32(0);
        e.u32(0);
        e.array(&[]);
        e.bool(false);
        assert_eq!(read(&e.finish()).map(|cloud| cloud.points.len()), Some(0));
    }

    #[test]
    fn any_bytes_give_points_or_none() {
        let whole = message(("t", 6, &[0; 4]), false);
        let mut state = 7_u64;
        for _ in 0..50_000 {
            let mut bytes = whole.clone();
            for _ in 0..4 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let at = (state >> 33) as usize % bytes.len();
                bytes[at] = (state >> 25) as u8;
            }
            if let Some(cloud) = read(&bytes) {
                assert!(cloud.points.iter().all(|p| p.position_m.iter().all(|m| m.is_finite())));
            }
        }
        assert!((0..whole.len() - 4).all(|cut| read(&whole[..cut]).is_none()));
    }
}
