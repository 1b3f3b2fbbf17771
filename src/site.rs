//! Where everything stands: hall, sensors, access points, and where on a body the UE is. SI units, site frame,
//! z up, floor at z = 0. Read from the `site` part of a configuration file; see `config/default.toml`.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::geometry::Pose;

/// The place that is watched.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Site {
    /// A name for reports.
    pub name: String,
    /// Walls, floor and ceiling.
    pub hall: Hall,
    /// Round pillars from floor to ceiling.
    pub pillars: Vec<Pillar>,
    /// Boxes that stand on the floor.
    pub furniture: Vec<Furniture>,
    /// The LiDARs.
    pub sensors: Vec<Sensor>,
    /// The access points.
    pub access_points: Vec<AccessPoint>,
    /// Where on a body the UE is.
    pub ue: Ue,
    /// What only a simulator reads.
    pub simulation: Simulation,
}

/// A rectangular room centred on the origin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hall {
    /// Along x, metres.
    pub length_m: f64,
    /// Along y, metres.
    pub width_m: f64,
    /// Floor to ceiling, metres.
    pub height_m: f64,
}

/// A round pillar.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pillar {
    /// Its axis on the floor, metres.
    pub position_m: [f64; 2],
    /// Its radius, metres.
    pub radius_m: f64,
}

/// A box on the floor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Furniture {
    /// The middle of its base, metres.
    pub position_m: [f64; 2],
    /// Edge lengths, metres.
    pub size_m: [f64; 3],
    /// Turn about the vertical, degrees.
    pub yaw_deg: f64,
}

/// A LiDAR on the wall.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Its name, also the topic's.
    pub name: String,
    /// `hdl-32e`, `vlp-16`, or `points` for a sensor known only by its clouds.
    #[serde(default = "hdl_32e")]
    pub model: String,
    /// Where it hangs, metres.
    pub position_m: [f64; 3],
    /// How it is turned, applied Z-Y'-X''; positive pitch looks down.
    pub rotation_deg: Rotation,
    /// Revolutions a second.
    #[serde(default = "ten_hz")]
    pub rate_hz: f64,
    /// The cut between two revolutions, degrees of azimuth clockwise from ahead: 180 is behind the sensor.
    #[serde(default = "behind_deg")]
    pub cut_deg: f64,
    /// Shortest range it reports, metres.
    #[serde(default = "nearest_m")]
    pub range_min_m: f64,
    /// Longest range it reports, metres.
    #[serde(default = "farthest_m")]
    pub range_max_m: f64,
    /// Standard deviation of its range, metres: how near the background a return may lie and still be new follows.
    #[serde(default = "noise_m")]
    pub range_noise_m: f64,
}

// What a site file need not say of a sensor: an HDL-32E as it is delivered, cut behind, as the default site has two.
fn hdl_32e() -> String {
    "hdl-32e".to_owned()
}
fn ten_hz() -> f64 {
    10.0
}
fn behind_deg() -> f64 {
    180.0
}
fn nearest_m() -> f64 {
    0.5
}
fn farthest_m() -> f64 {
    50.0
}
fn noise_m() -> f64 {
    0.02
}

/// How simulated sensors fail.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulation {
    /// Share of returns that are lost.
    pub dropout: f64,
    /// Sensors that fall silent for good, by name: after how many seconds.
    pub lost_after_s: BTreeMap<String, f64>,
}

/// Yaw, pitch and roll in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rotation {
    /// About z, counter-clockwise from above.
    pub yaw: f64,
    /// About y', positive looks down.
    pub pitch: f64,
    /// About x''.
    pub roll: f64,
}

/// An access point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AccessPoint {
    /// Its name in every table.
    pub name: String,
    /// Its antenna, metres.
    pub position_m: [f64; 3],
}

/// Where the UE is, from the body axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ue {
    /// Ahead of the body axis along the heading, metres.
    pub forward_m: f64,
    /// Left of the body axis, metres.
    pub left_m: f64,
    /// Above the floor as a share of the standing height.
    pub height_share: f64,
}

impl Ue {
    /// The UE of a body that stands at `position_m`, looks along `heading_rad` and is `height_m` tall.
    pub fn on_body(&self, position_m: glam::DVec2, heading_rad: f64, height_m: f64) -> DVec3 {
        let (sin, cos) = heading_rad.sin_cos();
        DVec3::new(
            position_m.x + self.forward_m * cos - self.left_m * sin,
            position_m.y + self.forward_m * sin + self.left_m * cos,
            self.height_share * height_m,
        )
    }
}

/// The models that a site file may name; of `points` only clouds are known.
pub const SENSOR_MODELS: [&str; 3] = ["hdl-32e", "vlp-16", "points"];

/// The model of that name, with or without capitals and dashes: `vlp-16` of `VLP-16` and `vlp16`.
pub fn sensor_model(name: &str) -> Option<&'static str> {
    let letters = |name: &str| name.to_ascii_lowercase().replace(['-', '_', ' '], "");
    SENSOR_MODELS.into_iter().find(|model| letters(model) == letters(name))
}

impl Sensor {
    /// The pose of the sensor's frame in the site.
    pub fn site_from_sensor(&self) -> Pose {
        let Rotation { yaw, pitch, roll } = self.rotation_deg;
        Pose::from_yaw_pitch_roll_deg(DVec3::from_array(self.position_m), yaw, pitch, roll)
    }
}

impl AccessPoint {
    /// The antenna's place.
    pub fn position(&self) -> DVec3 {
        DVec3::from_array(self.position_m)
    }
}
