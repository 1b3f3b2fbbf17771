//! Messages for viewers: a frame's results as standard messages for Foxglove, RViz and Rerun. They are in the frame
//! `site` and have the frame's time.
//!
//! | topic | type | holds |
//! |---|---|---|
//! | `/umbracast/markers` | `visualization_msgs/msg/MarkerArray` | see [`markers`] |
//! | `/umbracast/people` | `vision_msgs/msg/Detection3DArray` | everybody followed, by the number of the track |
//! | `/umbracast/foreground` | `sensor_msgs/msg/PointCloud2` | the points that do not belong to the empty scene |
//!
//! Definitions are those of ROS 2 Jazzy (`common_interfaces`; `vision_msgs` 4.1), without comments.

use glam::{DMat3, DQuat, DVec2};
use umbracast::detect::Point;
use umbracast::{STEPS, Site};

use crate::cdr::Encoder;
use crate::messages::{Schema, point_fields};
use crate::rows::{LinkRow, TrackRow};

/// Where [`markers`] are published and recorded.
pub const MARKERS_TOPIC: &str = "/umbracast/markers";
/// Where [`people`] are.
pub const PEOPLE_TOPIC: &str = "/umbracast/people";
/// Where the [`foreground`] is.
pub const FOREGROUND_TOPIC: &str = "/umbracast/foreground";

/// Everything that is drawn, anew in each message: the first marker deletes what the last message drew.
///
/// | namespace | id | what |
/// |---|---|---|
/// | `box`, `name` | track | the box of a confirmed track, its number above it |
/// | `way` | track | from where it stands through the means of the next steps |
/// | `in_300ms`, `in_600ms`, `in_900ms` | track | where the body is then nine times of ten |
/// | `rays` | 0 | every link, green through amber to red by how likely it is blocked within 900 ms |
/// | `blocked` | 0 | the links that are blocked now, thick |
/// | `access_points` | 0 | the ends of the rays |
pub fn markers(time_ns: i64, site: &Site, tracks: &[TrackRow], links: &[LinkRow]) -> Vec<u8> {
    let mut markers = vec![Marker { action: DELETE_ALL, ..Marker::default() }];
    tracks.iter().filter(|track| track.confirmed).for_each(|track| of_track(track, &mut markers));
    let mut rays = Marker { ns: "rays", kind: LINE_LIST, scale_m: [0.015, 0.0, 0.0], ..Marker::default() };
    let mut blocked = Marker { ns: "blocked", scale_m: [0.06, 0.0, 0.0], colour: BLOCKED, ..rays.clone() };
    for link in links {
        let (Some(ap), Some(track)) = (
            site.access_points.get(link.access_point as usize),
            tracks.iter().find(|track| track.track == link.track),
        ) else {
            continue;
        };
        let ue_m = site.ue_m(DVec2::new(track.x_m, track.y_m), track.heading_rad, track.height_m).to_array();
        rays.points_m.extend([ap.position_m, ue_m]);
        rays.colours.extend([of_probability(link.p_of_any(STEPS)); 2]);
        if link.is_blocked() {
            blocked.points_m.extend([ap.position_m, ue_m]);
        }
    }
    // Viewers complain of lists without points.
    markers.extend([rays, blocked].into_iter().filter(|list| !list.points_m.is_empty()));
    markers.push(Marker {
        ns: "access_points",
        kind: SPHERE_LIST,
        scale_m: [0.3; 3],
        colour: ACCESS_POINT,
        points_m: site.access_points.iter().map(|ap| ap.position_m).collect(),
        ..Marker::default()
    });
    let mut e = Encoder::default();
    e.u32(markers.len() as u32);
    markers.iter().for_each(|marker| marker.encode(time_ns, &mut e));
    e.finish()
}

/// Confirmed tracks: where the body stands and how sure that is, its box, and the track's number as the id that is the
/// same in every message. The height of the pose is half of the body's.
pub fn people(time_ns: i64, tracks: &[TrackRow]) -> Vec<u8> {
    let confirmed = || tracks.iter().filter(|track| track.confirmed);
    let mut e = Encoder::default();
    e.header(time_ns, FRAME);
    e.u32(confirmed().count() as u32);
    for track in confirmed() {
        e.header(time_ns, FRAME);
        e.u32(1);
        e.string("person");
        e.f64(1.0);
        pose([track.x_m, track.y_m, 0.5 * track.height_m], DQuat::from_rotation_z(track.heading_rad), &mut e);
        covariance(track).as_flattened().iter().for_each(|&value| e.f64(value));
        let (center_m, half_m, rotation) = obb(track);
        pose(center_m, rotation, &mut e);
        half_m.iter().for_each(|half_m| e.f64(2.0 * half_m));
        e.string(&track.track.to_string());
    }
    e.finish()
}

/// Fields x y z (f32), time (f32, seconds after the stamp, which is the frame's time: none is later) and sensor (u16, its
/// place in the site).
pub fn foreground(time_ns: i64, points: &[Point]) -> Vec<u8> {
    const F32: u8 = 7;
    const U16: u8 = 4;
    const POINT_STEP: usize = 18;
    let mut e = Encoder::default();
    e.header(time_ns, FRAME);
    e.u32(1);
    e.u32(points.len() as u32);
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32), ("time", 12, F32), ("sensor", 16, U16)];
    point_fields(&fields, &mut e);
    e.bool(false);
    e.u32(POINT_STEP as u32);
    e.u32((POINT_STEP * points.len()) as u32);
    e.u32((POINT_STEP * points.len()) as u32);
    for point in points {
        let [x, y, z] = point.position_m.as_vec3().to_array();
        let after_s = (point.time_ns - time_ns) as f32 * 1e-9;
        [x, y, z, after_s].iter().for_each(|value| e.array(&value.to_le_bytes()));
        e.array(&point.sensor.to_le_bytes());
    }
    e.bool(true);
    e.finish()
}

/// The schema of [`markers`].
pub fn markers_schema() -> Schema {
    definition(
        "visualization_msgs/msg/MarkerArray",
        "visualization_msgs/Marker[] markers\n",
        &["visualization_msgs/Marker", "visualization_msgs/UVCoordinate", "visualization_msgs/MeshFile"],
        &["std_msgs/ColorRGBA", "builtin_interfaces/Duration", "sensor_msgs/CompressedImage"],
    )
}

/// The schema of [`people`].
pub fn people_schema() -> Schema {
    definition(
        "vision_msgs/msg/Detection3DArray",
        "std_msgs/Header header\nvision_msgs/Detection3D[] detections\n",
        &["vision_msgs/Detection3D", "vision_msgs/ObjectHypothesisWithPose", "vision_msgs/ObjectHypothesis"],
        &["vision_msgs/BoundingBox3D", "geometry_msgs/PoseWithCovariance"],
    )
}

const FRAME: &str = "site";

const CUBE: i32 = 1;
const CYLINDER: i32 = 3;
const LINE_STRIP: i32 = 4;
const LINE_LIST: i32 = 5;
const SPHERE_LIST: i32 = 7;
const TEXT: i32 = 9;
const DELETE_ALL: i32 = 3;

/// As on the page: red, green, blue, opacity.
const CLEAR: [f32; 4] = [0.23, 0.49, 0.27, 1.0];
const WARNING: [f32; 4] = [0.72, 0.43, 0.0, 1.0];
const BLOCKED: [f32; 4] = [0.75, 0.15, 0.18, 1.0];
const PERSON: [f32; 4] = [0.5, 0.69, 1.0, 0.6];
const ACCESS_POINT: [f32; 4] = [0.6, 0.6, 0.6, 1.0];

/// One thing that is drawn; what is not said is empty.
#[derive(Debug, Clone)]
struct Marker {
    ns: &'static str,
    id: i32,
    kind: i32,
    action: i32,
    position_m: [f64; 3],
    rotation: DQuat,
    scale_m: [f64; 3],
    colour: [f32; 4],
    points_m: Vec<[f64; 3]>,
    /// One a point, or none.
    colours: Vec<[f32; 4]>,
    text: String,
}

impl Default for Marker {
    fn default() -> Self {
        Self {
            ns: "",
            id: 0,
            kind: CUBE,
            action: 0,
            position_m: [0.0; 3],
            rotation: DQuat::IDENTITY,
            scale_m: [1.0; 3],
            colour: PERSON,
            points_m: Vec::new(),
            colours: Vec::new(),
            text: String::new(),
        }
    }
}

impl Marker {
    fn encode(&self, time_ns: i64, e: &mut Encoder) {
        e.header(time_ns, FRAME);
        e.string(self.ns);
        [self.id, self.kind, self.action].iter().for_each(|&value| e.i32(value));
        pose(self.position_m, self.rotation, e);
        self.scale_m.iter().for_each(|&value| e.f64(value));
        self.colour.iter().for_each(|&value| e.f32(value));
        e.time(0); // Lifetime: until it is deleted.
        e.bool(false);
        e.u32(self.points_m.len() as u32);
        self.points_m.as_flattened().iter().for_each(|&value| e.f64(value));
        e.u32(self.colours.len() as u32);
        self.colours.as_flattened().iter().for_each(|&value| e.f32(value));
        // No texture: its name, image (stamp, frame, format, data) and coordinates.
        e.string("");
        e.header(0, "");
        e.string("");
        e.u32(0);
        e.u32(0);
        e.string(&self.text);
        // No mesh: its name, file (name, data), and whether its own materials are used.
        e.string("");
        e.string("");
        e.u32(0);
        e.bool(false);
    }
}

fn of_track(track: &TrackRow, markers: &mut Vec<Marker>) {
    let id = track.track as i32; // Wraps after two thousand million people.
    let (position_m, half_m, rotation) = obb(track);
    let scale_m = half_m.map(|half_m| 2.0 * half_m);
    markers.push(Marker { ns: "box", id, position_m, rotation, scale_m, ..Marker::default() });
    markers.push(Marker {
        ns: "name",
        id,
        kind: TEXT,
        position_m: [track.x_m, track.y_m, track.height_m + 0.25],
        scale_m: [0.0, 0.0, 0.3],
        colour: [PERSON[0], PERSON[1], PERSON[2], 1.0],
        text: track.track.to_string(),
        ..Marker::default()
    });
    let here = [track.x_m, track.y_m];
    let means = track.steps.iter().map(|&[x_m, y_m, ..]| [x_m, y_m]);
    markers.push(Marker {
        ns: "way",
        id,
        kind: LINE_STRIP,
        scale_m: [0.04, 0.0, 0.0],
        points_m: std::iter::once(here).chain(means).map(|[x_m, y_m]| [x_m, y_m, ON_FLOOR_M]).collect(),
        ..Marker::default()
    });
    for (ns, step) in [("in_300ms", 3), ("in_600ms", 6), ("in_900ms", 9)] {
        let [x_m, y_m, xx_m2, xy_m2, yy_m2] = track.steps[step - 1];
        let ([long_m, short_m], turn_rad) = ellipse(xx_m2, xy_m2, yy_m2);
        markers.push(Marker {
            ns,
            id,
            kind: CYLINDER,
            position_m: [x_m, y_m, ON_FLOOR_M],
            rotation: DQuat::from_rotation_z(turn_rad),
            scale_m: [2.0 * long_m, 2.0 * short_m, ON_FLOOR_M],
            colour: [PERSON[0], PERSON[1], PERSON[2], 0.2],
            ..Marker::default()
        });
    }
}

/// What lies on the floor is drawn so high, to be seen.
const ON_FLOOR_M: f64 = 0.01;

/// Half the axes, metres, and the direction of the longer one, of the ellipse that holds 90 % of a Gaussian.
fn ellipse(xx_m2: f64, xy_m2: f64, yy_m2: f64) -> ([f64; 2], f64) {
    /// Of the squared distance from the mean in units of the covariance: -2 ln(1 - 0.9).
    const REACH_90: f64 = 4.605_170_185_988_091;
    let (middle, root) = (0.5 * (xx_m2 + yy_m2), (0.5 * (xx_m2 - yy_m2)).hypot(xy_m2));
    // A body that is known exactly is still drawn.
    let half_m = |variance_m2: f64| (REACH_90 * variance_m2.max(0.0)).sqrt().max(ON_FLOOR_M);
    ([half_m(middle + root), half_m(middle - root)], 0.5 * (2.0 * xy_m2).atan2(xx_m2 - yy_m2))
}

/// Green, amber in the middle, red.
fn of_probability(p: f64) -> [f32; 4] {
    let p = p.clamp(0.0, 1.0) as f32;
    let (from, to, share) =
        if p < 0.5 { (CLEAR, WARNING, 2.0 * p) } else { (WARNING, BLOCKED, 2.0 * p - 1.0) };
    std::array::from_fn(|k| from[k] + share * (to[k] - from[k]))
}

/// Of (x, y, z, roll, pitch, yaw): position, height and heading; what a walker does not do is known to be nothing.
fn covariance(track: &TrackRow) -> [[f64; 6]; 6] {
    let [xx, xy, _, _, yy, ..] = track.covariance;
    let mut covariance = [[0.0; 6]; 6];
    covariance[0][0] = xx;
    (covariance[0][1], covariance[1][0]) = (xy, xy);
    covariance[1][1] = yy;
    covariance[2][2] = (0.5 * track.height_sigma_m).powi(2);
    covariance[5][5] = track.heading_sigma_rad.powi(2);
    covariance
}

/// Centre, half the edges and rotation of a track's box.
fn obb(track: &TrackRow) -> ([f64; 3], [f64; 3], DQuat) {
    let [x, y, z, half_x, half_y, half_z, rotation @ ..] = track.obb;
    let rotation = DQuat::from_mat3(&DMat3::from_cols_array(&rotation));
    ([x, y, z], [half_x, half_y, half_z], rotation)
}

/// `geometry_msgs/Pose`
fn pose(position_m: [f64; 3], rotation: DQuat, e: &mut Encoder) {
    position_m.iter().chain(&rotation.to_array()).for_each(|&value| e.f64(value));
}

/// A definition with those of its parts, and of a header and a pose, which all have.
fn definition(name: &'static str, fields: &str, own: &[&str], parts: &[&str]) -> Schema {
    const ALL: [&str; 6] = [
        "std_msgs/Header",
        "builtin_interfaces/Time",
        "geometry_msgs/Pose",
        "geometry_msgs/Point",
        "geometry_msgs/Quaternion",
        "geometry_msgs/Vector3",
    ];
    let rule = "=".repeat(80);
    let mut definition = fields.to_owned();
    for part in own.iter().chain(parts).chain(&ALL) {
        let fields = PARTS.iter().find(|(name, _)| name == part).map_or("", |(_, fields)| fields);
        definition.push_str(&format!("{rule}\nMSG: {part}\n{fields}"));
    }
    Schema { name: name.into(), definition: definition.into() }
}

const PARTS: [(&str, &str); 17] = [
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"),
    ("std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"),
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"),
    ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"),
    ("geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"),
    (
        "visualization_msgs/Marker",
        "int32 ARROW=0\nint32 CUBE=1\nint32 SPHERE=2\nint32 CYLINDER=3\nint32 LINE_STRIP=4\nint32 LINE_LIST=5\n\
         int32 CUBE_LIST=6\nint32 SPHERE_LIST=7\nint32 POINTS=8\nint32 TEXT_VIEW_FACING=9\nint32 MESH_RESOURCE=10\n\
         int32 TRIANGLE_LIST=11\nint32 ARROW_STRIP=12\nint32 ADD=0\nint32 MODIFY=0\nint32 DELETE=2\n\
         int32 DELETEALL=3\nstd_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n\
         geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n\
         builtin_interfaces/Duration lifetime\nbool frame_locked\ngeometry_msgs/Point[] points\n\
         std_msgs/ColorRGBA[] colors\nstring texture_resource\nsensor_msgs/CompressedImage texture\n\
         visualization_msgs/UVCoordinate[] uv_coordinates\nstring text\nstring mesh_resource\n\
         visualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials\n",
    ),
    ("visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"),
    ("visualization_msgs/MeshFile", "string filename\nuint8[] data\n"),
    (
        "vision_msgs/Detection3D",
        "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\nvision_msgs/BoundingBox3D bbox\n\
         string id\n",
    ),
    (
        "vision_msgs/ObjectHypothesisWithPose",
        "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n",
    ),
    ("vision_msgs/ObjectHypothesis", "string class_id\nfloat64 score\n"),
    ("vision_msgs/BoundingBox3D", "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_of_a_definition_is_defined_in_it() {
        for schema in [markers_schema(), people_schema()] {
            let text = schema.definition;
            let types = text.lines().filter_map(|line| line.split_once(' ')).map(|(kind, _)| kind);
            for kind in types.filter(|kind| kind.contains('/')) {
                let kind = kind.trim_end_matches("[]");
                let part = text.split(&format!("MSG: {kind}\n")).nth(1);
                assert!(part.is_some_and(|part| !part.starts_with('=') && !part.is_empty()), "{kind}");
            }
        }
    }

    #[test]
    fn an_ellipse_lies_along_its_longer_axis() {
        // Turned by 30 degrees, standard deviations 0.5 m and 0.2 m.
        let (sin, cos) = 30_f64.to_radians().sin_cos();
        let (long, short) = (0.25, 0.04);
        let xx = long * cos * cos + short * sin * sin;
        let yy = long * sin * sin + short * cos * cos;
        let ([long_m, short_m], turn_rad) = ellipse(xx, (long - short) * sin * cos, yy);
        let reach = (-2.0 * 0.1_f64.ln()).sqrt();
        assert!((long_m - 0.5 * reach).abs() < 1e-12 && (short_m - 0.2 * reach).abs() < 1e-12);
        assert!((turn_rad.to_degrees() - 30.0).abs() < 1e-9);
    }

    #[test]
    fn probabilities_go_from_green_through_amber_to_red() {
        assert_eq!([0.0, 0.5, 1.0, 7.0].map(of_probability), [CLEAR, WARNING, BLOCKED, BLOCKED]);
    }
}
