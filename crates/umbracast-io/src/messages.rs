//! The messages of a recording: names, definitions as ROS 2 prints them, and their CDR. Those of rows are in `wire`.

use std::borrow::Cow;

use umbracast::Site;
use umbracast::geometry::Pose;
use umbracast::lidar::{Cloud, Packet, Scan};

use crate::cdr::{Decoder, Encoder};
use crate::clouds::azimuths;
use crate::rows::{PeopleLinkRow, PeopleRow};

/// Bytes of a Velodyne packet, fixed in `velodyne_msgs/VelodynePacket`.
pub const PACKET_BYTES: usize = 1206;

/// A message type: its name and its definition with those it is made of.
#[derive(Debug, Clone)]
pub struct Schema {
    /// As `package/msg/Type`.
    pub name: Cow<'static, str>,
    /// In the concatenated form of ROS 2 bags.
    pub definition: Cow<'static, str>,
}

impl Schema {
    const fn new(name: &'static str, definition: &'static str) -> Self {
        Self { name: Cow::Borrowed(name), definition: Cow::Borrowed(definition) }
    }
}

/// A definition with `std_msgs/Header` behind it.
macro_rules! with_header {
    ($text:literal) => {
        concat!(
            $text,
            "================================================================================\n",
            "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
            "================================================================================\n",
            "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
        )
    };
}

/// What stands behind every definition with a header.
pub(crate) const HEADER_DEFINITIONS: &str = with_header!("");

/// The configuration, the first message of a recording.
pub const CONFIG: Schema = Schema::new("std_msgs/msg/String", "string data\n");

/// One sensor's packets of one frame.
pub const SCAN: Schema = Schema::new(
    "velodyne_msgs/msg/VelodyneScan",
    with_header!(
        "std_msgs/Header header\nVelodynePacket[] packets\n\
         ================================================================================\n\
         MSG: velodyne_msgs/VelodynePacket\nbuiltin_interfaces/Time stamp\nuint8[1206] data\n"
    ),
);

/// One sensor's packets of one frame, of any length: `velodyne_msgs` has room for Velodynes alone.
pub const SENSOR_PACKETS: Schema = Schema::new(
    "umbracast_msgs/msg/SensorPackets",
    with_header!(
        "# UDP payloads of one sensor, as they came; header.frame_id is the sensor's name.\n\
         std_msgs/Header header\nSensorPacket[] packets\n\
         ================================================================================\n\
         MSG: umbracast_msgs/SensorPacket\n# When it was received.\nbuiltin_interfaces/Time stamp\nuint8[] data\n"
    ),
);

/// Poses of the sensors.
pub const TRANSFORMS: Schema = Schema::new(
    "tf2_msgs/msg/TFMessage",
    with_header!(
        "geometry_msgs/TransformStamped[] transforms\n\
         ================================================================================\n\
         MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\nTransform transform\n\
         ================================================================================\n\
         MSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n\
         ================================================================================\n\
         MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n\
         ================================================================================\n\
         MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"
    ),
);

/// A sensor's points of one frame.
pub const CLOUD: Schema = Schema::new(
    "sensor_msgs/msg/PointCloud2",
    with_header!(
        "std_msgs/Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\n\
         uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n\
         ================================================================================\n\
         MSG: sensor_msgs/PointField\nuint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\n\
         uint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\n\
         uint8 datatype\nuint32 count\n"
    ),
);

/// Truth: everybody in one frame.
pub const PEOPLE: Schema = Schema::new(
    "umbracast_msgs/msg/People",
    with_header!(
        "# Everybody in the scene at the end of a frame.\n\
         std_msgs/Header header\nuint64 frame\nPerson[] people\n\
         ================================================================================\n\
         MSG: umbracast_msgs/Person\nuint32 person\nfloat64 x_m\nfloat64 y_m\nfloat64 vx_mps\nfloat64 vy_mps\n\
         float64 heading_rad\nfloat64 height_m\nbool arrived\nuint32 returns\n"
    ),
);

/// Truth: every link in one frame.
pub const LINKS: Schema = Schema::new(
    "umbracast_msgs/msg/Links",
    with_header!(
        "# Every link at the end of a frame.\n\
         std_msgs/Header header\nuint64 frame\nLink[] links\n\
         ================================================================================\n\
         MSG: umbracast_msgs/Link\nstring access_point\nuint32 person\nbool blocked\nbool static_blocked\n\
         uint8 UNKNOWN=2\nuint8 self_blocked # 0 no, 1 yes, 2 while the UE is inside the body\n"
    ),
);

/// `std_msgs/String`
pub fn text(value: &str) -> Vec<u8> {
    let mut e = Encoder::default();
    e.string(value);
    e.finish()
}

/// The packets of one frame; a packet of another length cannot be recorded in this message and is left out.
pub fn scan(time_ns: i64, sensor: &str, packets: &[Packet]) -> Vec<u8> {
    let mut e = Encoder::with_room(room(sensor, packets));
    e.header(time_ns, sensor);
    let whole = || packets.iter().filter(|packet| packet.payload.len() == PACKET_BYTES);
    e.u32(whole().count() as u32);
    for packet in whole() {
        e.time(packet.time_ns);
        e.array(&packet.payload);
    }
    e.finish()
}

/// The packets of one frame in a [`SENSOR_PACKETS`] message.
pub fn sensor_packets(time_ns: i64, sensor: &str, packets: &[Packet]) -> Vec<u8> {
    let mut e = Encoder::with_room(room(sensor, packets));
    e.header(time_ns, sensor);
    e.u32(packets.len() as u32);
    for packet in packets {
        e.time(packet.time_ns);
        e.u32(packet.payload.len() as u32);
        e.array(&packet.payload);
    }
    e.finish()
}

/// Bytes that a message of packets has at most: header and length, and each packet with its time, its length and what aligns
/// the next.
fn room(sensor: &str, packets: &[Packet]) -> usize {
    32 + sensor.len() + packets.iter().map(|packet| packet.payload.len() + 16).sum::<usize>()
}

/// The packets of [`sensor_packets`], or `None` where the bytes are something else.
pub fn read_sensor_packets(bytes: &[u8]) -> Option<Vec<Packet>> {
    let mut d = Decoder::new(bytes)?;
    d.time()?;
    d.string()?;
    let count = d.u32()?;
    (0..count)
        .map(|_| {
            let time_ns = d.time()?;
            let length = d.u32()? as usize;
            Some(Packet { time_ns, payload: d.array(length)?.to_vec() })
        })
        .collect()
}

/// The packets of [`scan`], or `None` where the bytes are something else.
pub fn read_scan(bytes: &[u8]) -> Option<Vec<Packet>> {
    let mut d = Decoder::new(bytes)?;
    d.time()?;
    d.string()?;
    let count = d.u32()?;
    (0..count)
        .map(|_| Some(Packet { time_ns: d.time()?, payload: d.array(PACKET_BYTES)?.to_vec() }))
        .collect()
}

/// The pose of every sensor in the frame `site`, from this time on.
pub fn transforms(site: &Site, time_ns: i64) -> Vec<u8> {
    let mut e = Encoder::default();
    e.u32(site.sensors.len() as u32);
    for sensor in &site.sensors {
        let Pose { rotation, translation_m: t } = sensor.site_from_sensor();
        let q = glam::DQuat::from_mat3(&rotation);
        e.header(time_ns, "site");
        e.string(&sensor.name);
        [t.x, t.y, t.z, q.x, q.y, q.z, q.w].into_iter().for_each(|value| e.f64(value));
    }
    e.finish()
}

/// An organised cloud: one row a beam from the lowest up, NaN where nothing came back. Fields x y z intensity
/// (f32), ring (u16), t (u32, nanoseconds after the stamp, which is the frame's start).
pub fn cloud(stamp_ns: i64, sensor: &str, scan: &Scan) -> Vec<u8> {
    const POINT_STEP: usize = 22;
    let Cloud::Organised(image) = &scan.cloud else { return Vec::new() };
    let (beams, columns) = (image.beams.len(), image.columns.len());
    let mut data = vec![0; beams * columns * POINT_STEP];
    for c in 0..columns {
        for (b, beam) in image.beams.iter().enumerate() {
            let i = c * beams + b;
            let range_m = image.range_m[i];
            let p = if range_m > 0.0 {
                image.tabled_point_m(azimuths(), c, b, f64::from(range_m)).as_vec3()
            } else {
                glam::Vec3::NAN
            };
            let after_ns = (image.time_ns(c, b) - stamp_ns).max(0) as u32;
            let at = (usize::from(beam.ring) * columns + c) * POINT_STEP;
            let point = &mut data[at..at + POINT_STEP];
            for (k, value) in [p.x, p.y, p.z, f32::from(image.reflectivity[i])].into_iter().enumerate() {
                point[4 * k..4 * k + 4].copy_from_slice(&value.to_le_bytes());
            }
            point[16..18].copy_from_slice(&beam.ring.to_le_bytes());
            point[18..22].copy_from_slice(&after_ns.to_le_bytes());
        }
    }
    let mut e = Encoder::default();
    e.header(stamp_ns, sensor);
    e.u32(beams as u32);
    e.u32(columns as u32);
    let fields = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("ring", 16, 4), ("t", 18, 6)];
    point_fields(&fields, &mut e);
    e.bool(false);
    e.u32(POINT_STEP as u32);
    e.u32((POINT_STEP * columns) as u32);
    e.u32(data.len() as u32);
    e.array(&data);
    e.bool(false);
    e.finish()
}

/// The fields of a `sensor_msgs/PointCloud2`, one value each: name, offset and datatype.
pub(crate) fn point_fields(fields: &[(&str, u32, u8)], e: &mut Encoder) {
    e.u32(fields.len() as u32);
    for &(name, offset, datatype) in fields {
        e.string(name);
        e.u32(offset);
        e.u8(datatype);
        e.u32(1);
    }
}

/// Truth of a frame: people.
pub fn people(time_ns: i64, frame: u64, rows: &[PeopleRow]) -> Vec<u8> {
    let mut e = Encoder::default();
    e.header(time_ns, "site");
    e.u64(frame);
    e.u32(rows.len() as u32);
    for row in rows {
        e.u32(row.person);
        for value in [row.x_m, row.y_m, row.vx_mps, row.vy_mps, row.heading_rad, row.height_m] {
            e.f64(value);
        }
        e.bool(row.arrived);
        e.u32(row.returns);
    }
    e.finish()
}

/// Truth of a frame: links.
pub fn links(time_ns: i64, frame: u64, rows: &[PeopleLinkRow], site: &Site) -> Vec<u8> {
    let mut e = Encoder::default();
    e.header(time_ns, "site");
    e.u64(frame);
    e.u32(rows.len() as u32);
    for row in rows {
        e.string(site.access_points.get(row.access_point as usize).map_or("", |ap| &ap.name));
        e.u32(row.person);
        e.bool(row.blocked);
        e.bool(row.static_blocked);
        e.u8(row.self_blocked.map_or(2, u8::from));
    }
    e.finish()
}
