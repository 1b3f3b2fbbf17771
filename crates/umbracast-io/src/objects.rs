//! Lists of objects from another perception system, which replace stage 1 up to the detections, or all of it where the system
//! follows people itself.
//!
//! A list is JSON, in the frame of the site:
//!
//! ```json
//! { "time_ns": 1700000000100000000,
//!   "objects": [ { "id": 17, "position_m": [3.1, 4.0, 0.0], "size_m": [0.4, 0.6, 1.7],
//!                  "velocity_mps": [1.2, 0.1, 0.0], "heading_rad": 0.1, "sigma_m": 0.08 } ] }
//! ```
//!
//! `position_m` is the point on the floor below the middle, `size_m` length, width and height. Velocity, heading and
//! sigma (of x and of y) may be missing, and so may the third number of position and velocity. `id` and other fields
//! are not read: our tracker decides who is who.
//!
//! With `"tracked": true` beside `time_ns` the system has followed its objects: numbers, positions and velocities are kept as they
//! are. `id` is then a whole number that stays with its person, the velocity must be there, and size, heading and sigma may be
//! missing.

use serde::Deserialize;
use serde_json::Value;
use umbracast::detect::Detection;
use umbracast::geometry::{Aabb, DMat3, DVec2, DVec3, Obb};
use umbracast::site::Hall;
use umbracast::track::Track;

/// What a list may hold: more is no list of one hall.
const OBJECTS_MAX: usize = 4096;
/// Farther than any hall reaches, metres.
const FARTHEST_M: f64 = 1e4;
/// Edges of what can be a person, alone or in a wheelchair, metres.
const EDGE_M: std::ops::RangeInclusive<f64> = 0.05..=3.0;
/// Objects are moved on to the frame's end by their velocity for so long at most, seconds.
const MOVED_S: f64 = 0.5;
/// Points that a person in free sight gives one HDL-32E at 10 m: a list does not tell how many there were.
const POINTS: u32 = 60;
/// How sure a heading and a height are that somebody else has measured, one standard deviation.
const HEADING_SIGMA_RAD: f64 = 0.3;
const HEIGHT_SIGMA_M: f64 = 0.05;

/// A list as it was sent.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ObjectList {
    /// When it holds, in the time of the hall's sensors.
    pub time_ns: i64,
    /// Whether the sender has followed its objects, so that numbers and velocities are to be kept.
    #[serde(default)]
    pub tracked: bool,
    /// Everybody and everything that was seen.
    pub objects: Vec<Object>,
}

/// Somebody or something.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Object {
    /// Of a list that is tracked: the number that stays with somebody. Others may say here what they like.
    #[serde(default)]
    pub id: Value,
    /// On the floor, below the middle: x, y and perhaps z.
    pub position_m: Vec<f64>,
    /// Length, width, height.
    #[serde(default)]
    pub size_m: Option<[f64; 3]>,
    /// Perhaps: x, y and perhaps z.
    #[serde(default)]
    pub velocity_mps: Vec<f64>,
    /// Of the length, counter-clockwise from +x.
    #[serde(default)]
    pub heading_rad: Option<f64>,
    /// Standard deviation of x and of y, if the sender knows it.
    #[serde(default)]
    pub sigma_m: Option<f64>,
}

/// Reads a list; `None` where the bytes are something else.
pub fn read(json: &[u8]) -> Option<ObjectList> {
    let list: ObjectList = serde_json::from_slice(json).ok()?;
    (list.objects.len() <= OBJECTS_MAX).then_some(list)
}

/// The detections of a list at a frame's end, and how many objects were none: of a size that no person has, or with
/// numbers that cannot be.
pub fn detections(list: &ObjectList, time_ns: i64) -> (Vec<Detection>, u64) {
    let after_s = after_s(list, time_ns);
    let found: Vec<Detection> =
        list.objects.iter().filter_map(|object| detection(object, after_s, time_ns)).collect();
    let none = (list.objects.len() - found.len()) as u64;
    (found, none)
}

/// The tracks of a list at a frame's end, in order of number, and how many objects were none: without a number or a velocity,
/// with the number of another, of a size that no person has, or with numbers that cannot be.
pub fn tracks(list: &ObjectList, time_ns: i64, hall: &Hall) -> (Vec<Track>, u64) {
    let after_s = after_s(list, time_ns);
    let mut found: Vec<Track> =
        list.objects.iter().filter_map(|object| track(object, after_s, hall)).collect();
    found.sort_by_key(|track| track.id);
    found.dedup_by_key(|track| track.id);
    let none = (list.objects.len() - found.len()) as u64;
    (found, none)
}

fn track(object: &Object, after_s: f64, hall: &Hall) -> Option<Track> {
    let (id, velocity_mps) = (object.id.as_u64()?, plane(&object.velocity_mps)?);
    if !is_known(object) {
        return None;
    }
    let mut track = Track::new(id, plane(&object.position_m)? + after_s * velocity_mps, velocity_mps);
    if let Some(sigma_m) = object.sigma_m {
        (track.covariance[0][0], track.covariance[1][1]) = (sigma_m.powi(2), sigma_m.powi(2));
    }
    if let Some(heading_rad) = object.heading_rad {
        (track.heading_rad, track.heading_sigma_rad) = (heading_rad, HEADING_SIGMA_RAD);
    }
    if let Some([_, _, height_m]) = object.size_m {
        (track.height_m, track.height_sigma_m) = (height_m, HEIGHT_SIGMA_M);
    }
    track.stand_up(hall.floor_m(track.position_m));
    Some(track)
}

/// How long after the list a frame ends, seconds.
fn after_s(list: &ObjectList, time_ns: i64) -> f64 {
    (time_ns.saturating_sub(list.time_ns) as f64 * 1e-9).clamp(-MOVED_S, MOVED_S)
}

/// Whether size, heading and sigma, where they are there, are those of somebody.
fn is_known(object: &Object) -> bool {
    object.size_m.is_none_or(|size_m| size_m.iter().all(|edge_m| EDGE_M.contains(edge_m)))
        && object.heading_rad.is_none_or(f64::is_finite)
        && object.sigma_m.is_none_or(|s| s > 0.0 && s < FARTHEST_M)
}

fn detection(object: &Object, after_s: f64, time_ns: i64) -> Option<Detection> {
    let position_m = plane(&object.position_m)?;
    let velocity_mps =
        if object.velocity_mps.is_empty() { DVec2::ZERO } else { plane(&object.velocity_mps)? };
    if !is_known(object) {
        return None;
    }
    let half_m = 0.5 * DVec3::from_array(object.size_m?);
    let heading_rad = object.heading_rad.unwrap_or(0.0);
    let position_m = position_m + after_s * velocity_mps;
    let obb = Obb {
        center_m: position_m.extend(half_m.z),
        half_m,
        site_from_box: DMat3::from_rotation_z(heading_rad),
    };
    let (sin, cos) = heading_rad.sin_cos();
    let (sin, cos) = (sin.abs(), cos.abs());
    let reach_m = DVec3::new(cos * half_m.x + sin * half_m.y, sin * half_m.x + cos * half_m.y, half_m.z);
    Some(Detection {
        position_m,
        covariance_m2: object.sigma_m.map(|sigma_m| [[sigma_m.powi(2), 0.0], [0.0, sigma_m.powi(2)]]),
        z_m: half_m.z,
        time_ns,
        points: POINTS,
        full_body: true,
        top_m: 2.0 * half_m.z,
        top_diagonal_m: 0.0, // Nobody says: what is listed is somebody.
        gait: None,
        reaches: Vec::new(),
        bands: Default::default(),
        overhead: None,
        facing: None,
        aabb: Aabb { min_m: obb.center_m - reach_m, max_m: obb.center_m + reach_m },
        obb,
    })
}

/// The first two of two or three numbers that can be.
fn plane(values: &[f64]) -> Option<DVec2> {
    let (&[x, y] | &[x, y, _]) = values else { return None };
    (x.abs() < FARTHEST_M && y.abs() < FARTHEST_M).then_some(DVec2::new(x, y))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIST: &str = r#"{ "time_ns": 900, "vendor": "x", "objects": [
        { "id": 17, "position_m": [3.0, 4.0, 0.0], "size_m": [0.4, 0.6, 1.7], "velocity_mps": [1.0, 0.0, 0.0],
          "heading_rad": 1.5707963267948966, "sigma_m": 0.1 },
        { "id": "car", "position_m": [9.0, 4.0], "size_m": [4.2, 1.8, 1.5] },
        { "position_m": [5.0, 6.0], "size_m": [0.5, 0.5, 1.6] } ] }"#;

    #[test]
    fn people_of_a_list_are_detections_at_the_frames_end() {
        let list = read(LIST.as_bytes()).unwrap();
        let (found, none) = detections(&list, 200_000_900);
        assert_eq!((found.len(), none), (2, 1), "a car is nobody");
        let first = &found[0];
        assert!(first.position_m.abs_diff_eq(DVec2::new(3.2, 4.0), 1e-9));
        assert!(first.aabb.size_m().abs_diff_eq(DVec3::new(0.6, 0.4, 1.7), 1e-9), "turned by a right angle");
        assert_eq!((first.covariance_m2.unwrap()[0][0], first.time_ns), (0.1 * 0.1, 200_000_900));
        assert_eq!((found[1].covariance_m2, found[1].top_m), (None, 1.6));
    }

    #[test]
    fn a_tracked_list_keeps_numbers_places_and_velocities() {
        let hall = umbracast::Config::default().site.hall;
        let list = read(
            br#"{ "time_ns": 300000000, "tracked": true, "objects": [
            { "id": 9, "position_m": [3.0, 4.0, 0.0], "velocity_mps": [1.0, 0.5], "size_m": [0.4, 0.6, 1.5], "sigma_m": 0.1 },
            { "id": 2, "position_m": [5.0, 6.0], "velocity_mps": [0.0, 0.0], "heading_rad": 1.0 },
            { "id": 9, "position_m": [7.0, 6.0], "velocity_mps": [0.0, 0.0] },
            { "id": "x", "position_m": [7.0, 6.0], "velocity_mps": [0.0, 0.0] },
            { "id": 4, "position_m": [7.0, 6.0] },
            { "id": 5, "position_m": [7.0, 1e300], "velocity_mps": [0.0, 0.0] } ] }"#,
        )
        .unwrap();
        let (found, none) = tracks(&list, 300_000_000, &hall);
        assert_eq!((found.iter().map(|track| track.id).collect::<Vec<_>>(), none), (vec![2, 9], 4));
        let walks = &found[1];
        assert_eq!((walks.position_m, walks.velocity_mps), (DVec2::new(3.0, 4.0), DVec2::new(1.0, 0.5)));
        assert_eq!((walks.height_m, walks.covariance[0][0], found[0].heading_rad), (1.5, 0.1 * 0.1, 1.0));
        let (moved, _) = tracks(&list, 340_000_000, &hall);
        assert!(moved[1].position_m.abs_diff_eq(DVec2::new(3.04, 4.02), 1e-9), "to the frame's end");
    }

    #[test]
    fn a_number_is_read_to_its_last_bit() {
        let list = r#"{ "time_ns": 0, "objects": [{ "position_m": [-1.9855232961837246, 0.0], "size_m": [0.5, 0.5, 1.7] }] }"#;
        assert_eq!(
            read(list.as_bytes()).unwrap().objects[0].position_m[0].to_string(),
            "-1.9855232961837246"
        );
    }

    #[test]
    fn numbers_that_cannot_be_are_left_out() {
        let of = |object: &str| {
            let list = read(format!("{{\"time_ns\": 0, \"objects\": [{object}]}}").as_bytes())?;
            Some(detections(&list, i64::MAX))
        };
        for object in [
            r#"{ "position_m": [1e300, 0.0], "size_m": [0.5, 0.5, 1.7] }"#,
            r#"{ "position_m": [0.0], "size_m": [0.5, 0.5, 1.7] }"#,
            r#"{ "position_m": [0.0, 0.0], "size_m": [0.5, 0.5, -1.7] }"#,
            r#"{ "position_m": [0.0, 0.0], "size_m": [0.5, 0.5, 1.7], "sigma_m": -1.0 }"#,
        ] {
            assert_eq!(of(object), Some((Vec::new(), 1)), "{object}");
        }
        assert!(of("7").is_none() && read(b"\xff").is_none() && read(b"{}").is_none());
    }
}
