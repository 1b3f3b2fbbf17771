//! The positions of everything: hall, sensors, access points, and the UE on a body. SI units, site frame, z up, floor
//! at z = 0 unless the hall says otherwise. Read from the `site` part of a configuration file; see
//! `config/default.toml`.

mod hall;
mod handover;
mod optics;
mod radio;
mod reflections;

use std::collections::BTreeMap;

use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::geometry::Pose;

pub use hall::{Floor, Hall};
pub(crate) use hall::{doubled_area_m2, from_segment_m};
pub use handover::{Costs, Handover, Procedure};
pub use optics::{DarkCloth, MixedReturns, Pane, Surface};
pub use radio::{LossModel, Radio};
pub use reflections::{Material, Reflections};

/// The place that is watched.
///
/// ```
/// let site = umbracast::Config::default().site;
/// assert_eq!((site.sensors.len(), site.access_points[0].name.as_str()), (2, "side"));
/// ```
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
    /// What changing to another access point costs; without it nothing is decided.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub handover: Option<Handover>,
    /// What reflects radio; without it beams are pointed straight at devices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reflections: Option<Reflections>,
    /// What only a simulator reads.
    pub simulation: Simulation,
}

impl Site {
    /// The UE of a body that stands at `position_m`, looks along `heading_rad` and is `height_m` tall, in the site frame.
    ///
    /// ```
    /// use umbracast::geometry::{DVec2, DVec3};
    ///
    /// let site = umbracast::Config::default().site;
    /// assert_eq!(site.ue_m(DVec2::new(2.0, 1.0), 0.0, 1.8), DVec3::new(2.0, 1.0, 0.9));
    /// ```
    pub fn ue_m(&self, position_m: DVec2, heading_rad: f64, height_m: f64) -> DVec3 {
        self.ue.on_body(position_m, heading_rad, height_m) + DVec3::Z * self.hall.floor_m(position_m)
    }

    /// Whether any access point has a radio, so that links have losses.
    ///
    /// ```
    /// assert!(!umbracast::Config::default().site.has_radio());
    /// ```
    pub fn has_radio(&self) -> bool {
        self.access_points.iter().any(|ap| ap.radio.is_some())
    }

    /// Whether devices are advised as well: the site says what changes cost.
    ///
    /// ```
    /// assert!(!umbracast::Config::default().site.has_decisions());
    /// ```
    pub fn has_decisions(&self) -> bool {
        self.has_radio() && self.handover.is_some()
    }
}

/// A round pillar.
///
/// ```
/// let site = umbracast::Config::default().site;
/// assert_eq!(site.pillars[0].position_m, [11.5, 11.5]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pillar {
    /// Its axis on the floor, metres.
    pub position_m: [f64; 2],
    /// Its radius, metres.
    pub radius_m: f64,
}

/// A box on the floor.
///
/// ```
/// let site = umbracast::Config::default().site;
/// let counter = site.furniture[0];
/// assert_eq!((counter.position_m, counter.size_m), ([0.0, 15.8], [6.0, 0.8, 1.1]));
/// ```
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

impl Furniture {
    /// The corners of its base, counter-clockwise.
    ///
    /// ```
    /// let counter = umbracast::Config::default().site.furniture[0];
    /// assert_eq!(counter.corners()[0].to_array(), [-3.0, 15.4]);
    /// ```
    pub fn corners(&self) -> [DVec2; 4] {
        let half_m = 0.5 * DVec2::new(self.size_m[0], self.size_m[1]);
        let turned = DVec2::from_angle(self.yaw_deg.to_radians());
        [DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::ONE, DVec2::new(-1.0, 1.0)]
            .map(|corner| DVec2::from_array(self.position_m) + turned.rotate(corner * half_m))
    }
}

/// A LiDAR on the wall.
///
/// ```
/// use umbracast::{Config, Mode};
///
/// // A model, ranges and rate need not be given: an HDL-32E as it is delivered.
/// let file = "[[site.sensors]]\nname = \"door\"\nposition_m = [0.0, 0.0, 3.0]\n\
///             rotation_deg = { yaw = 0.0, pitch = 20.0, roll = 0.0 }";
/// let config = Config::with_overlay(Mode::Default, file, "hall.toml")?;
/// assert_eq!((config.site.sensors.len(), config.site.sensors[0].model.as_str()), (1, "hdl-32e"));
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Its name, also the topic's.
    pub name: String,
    /// As `lidar::sensor_models` names them: `hdl-32e`, `os0-128`, ..., or `points` for a sensor known only by its
    /// clouds.
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
    /// Standard deviation of its range on a surface nearby that faces it, metres. Simulated sensors err by it; what is new
    /// follows from what the sensor itself is seen to err by.
    #[serde(default = "noise_m")]
    pub range_noise_m: f64,
    /// The sensor's own file, which says where its beams look: an Ouster's metadata, an XT32's angles. Whoever reads
    /// the site file reads it and puts its text into `calibration`; the path goes from the site file's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration_file: Option<String>,
    /// The text of that file; without one the beams look as the manufacturer designs them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<String>,
    /// The UDP port that its packets go to, where it is not its model's usual one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub udp_port: Option<u16>,
    /// The IPv4 address that its packets come from, where several sensors send to one port.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub address: Option<String>,
    /// Which clock its points are timed by.
    #[serde(default, skip_serializing_if = "TimeSource::is_sensor")]
    pub time: TimeSource,
    /// How far its times run ahead of those of the first sensor, milliseconds, as `umbracast calibrate` finds it: so
    /// much is taken from them.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub clock_offset_ms: f64,
}

/// Which clock a sensor's points are timed by.
///
/// ```
/// use umbracast::{Config, Mode, site::TimeSource};
///
/// let file = "[[site.sensors]]\nname = \"door\"\nposition_m = [0.0, 0.0, 3.0]\n\
///             rotation_deg = { yaw = 0.0, pitch = 20.0, roll = 0.0 }\ntime = \"arrival\"";
/// let config = Config::with_overlay(Mode::Default, file, "hall.toml")?;
/// assert_eq!(config.site.sensors[0].time, TimeSource::Arrival);
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TimeSource {
    /// Its own. One that is more than 100 ms from where the time of reception puts it is shifted there, alone.
    #[default]
    Sensor,
    /// Its own, which others of this kind share (PTP, gPTP): when all of them are set, one shift serves all, and they
    /// stay together to the nanosecond.
    Ptp,
    /// The host's, at reception. Its own clock spaces its columns and need not be set; the packets that were under way
    /// for the shortest time tell what it reads.
    Arrival,
}

impl TimeSource {
    fn is_sensor(&self) -> bool {
        *self == Self::Sensor
    }
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
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

/// How simulated sensors fail, and where simulated people come from.
///
/// ```
/// let site = umbracast::Config::default().site;
/// assert_eq!(site.simulation.dropout, 0.02);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulation {
    /// Share of returns that are lost.
    pub dropout: f64,
    /// Where a drawn crowd comes in and leaves, metres. Without any everybody is there from the start and stays.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub entrances_m: Vec<[f64; 2]>,
    /// Where people of a mixed crowd stop on their way, and queue behind each other, metres.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places_m: Vec<[f64; 2]>,
    /// Sensors that fall silent for good, by name: after how many seconds.
    pub lost_after_s: BTreeMap<String, f64>,
    /// Sensors whose clock runs ahead of true time, by name: by how many milliseconds.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub clock_ahead_ms: BTreeMap<String, f64>,
    /// Sensors that hang elsewhere than the site says, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub slip: BTreeMap<String, Slip>,
    /// What is put in while people are there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub put_in: Option<PutIn>,
    /// Sensors whose ranges are too long, by name: by how many metres.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub range_bias_m: BTreeMap<String, f64>,
    /// Beams that meet an edge; without it they are lines.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mixed_returns: Option<MixedReturns>,
    /// Who is hard to see.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark_cloth: Option<DarkCloth>,
    /// Glass and mirrors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub panes: Vec<Pane>,
}

/// Furniture that is not there from the start.
///
/// ```
/// use umbracast::{Config, Mode};
///
/// let file = "[site.simulation.put_in]\nafter_s = 5.0\nfurniture = [{ position_m = [0.0, -13.0], size_m = [7.0, 2.5, 3.0], yaw_deg = 0.0 }]";
/// let site = Config::with_overlay(Mode::Default, file, "lorry.toml")?.site;
/// assert_eq!(site.simulation.put_in.unwrap().furniture[0].size_m[2], 3.0);
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PutIn {
    /// When it comes, all at once.
    pub after_s: f64,
    /// As the site's own.
    pub furniture: Vec<Furniture>,
}

/// How a simulated sensor comes to hang elsewhere.
///
/// ```
/// use umbracast::{Config, Mode};
///
/// let file = "[site.simulation]\nslip = { lidar_west = { after_s = 10.0, turned_deg = [0.0, 1.0, 0.0] } }";
/// let site = Config::with_overlay(Mode::Default, file, "slip.toml")?.site;
/// assert_eq!(site.simulation.slip["lidar_west"].shifted_m, [0.0; 3]);
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slip {
    /// When it slips; 0: it never hung right.
    pub after_s: f64,
    /// About the site's x, y and z axes, as one turn about the sum of them.
    #[serde(default)]
    pub turned_deg: [f64; 3],
    /// Along the site's axes.
    #[serde(default)]
    pub shifted_m: [f64; 3],
}

impl Slip {
    /// Where a sensor hangs afterwards.
    ///
    /// ```
    /// use umbracast::{geometry::Pose, site::Slip};
    ///
    /// let slip = Slip { after_s: 0.0, turned_deg: [0.0; 3], shifted_m: [0.0, 0.0, -0.1] };
    /// assert_eq!(slip.slipped(&Pose::IDENTITY).translation_m.z, -0.1);
    /// ```
    pub fn slipped(&self, site_from_sensor: &Pose) -> Pose {
        let turn = DVec3::from_array(self.turned_deg.map(f64::to_radians));
        let rotation = match turn.length() {
            0.0 => DMat3::IDENTITY,
            angle => DMat3::from_axis_angle(turn / angle, angle),
        };
        Pose {
            rotation: rotation * site_from_sensor.rotation,
            translation_m: site_from_sensor.translation_m + DVec3::from_array(self.shifted_m),
        }
    }
}

/// Yaw, pitch and roll in degrees.
///
/// ```
/// let east = umbracast::Config::default().site.sensors[0].clone();
/// assert_eq!((east.rotation_deg.yaw, east.rotation_deg.pitch), (180.0, 35.0));
/// ```
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
///
/// ```
/// let side = umbracast::site::AccessPoint { name: "side".to_owned(), position_m: [14.0, 0.0, 2.0], radio: None };
/// assert_eq!(side.position().z, 2.0);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AccessPoint {
    /// Its name in every table.
    pub name: String,
    /// Its antenna, metres.
    pub position_m: [f64; 3],
    /// What it sends; without it no dB are told of its links.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radio: Option<Radio>,
}

/// Where the UE is, from the body axis.
///
/// ```
/// use umbracast::site::Ue;
///
/// // A phone at the ear of somebody, a little left of the axis.
/// let ear = Ue { forward_m: 0.0, left_m: 0.09, height_share: 0.924, spread_m: 0.0 };
/// assert!((ear.on_body(umbracast::geometry::DVec2::ZERO, 0.0, 1.75).z - 1.617).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ue {
    /// Ahead of the body axis along the heading, metres.
    pub forward_m: f64,
    /// Left of the body axis, metres.
    pub left_m: f64,
    /// Above the floor that is stood on, as a share of the standing height.
    pub height_share: f64,
    /// How far from there the device of one person or another is, and comes to be as hands move: one standard deviation along
    /// each axis, metres.
    #[serde(default)]
    pub spread_m: f64,
}

impl Ue {
    /// The UE of a body that stands at `position_m`, looks along `heading_rad` and is `height_m` tall, above its feet: on
    /// a floor at z = 0 its place.
    ///
    /// ```
    /// use umbracast::geometry::{DVec2, DVec3};
    ///
    /// let ue = umbracast::site::Ue { forward_m: 0.3, left_m: 0.0, height_share: 0.5, spread_m: 0.0 };
    /// assert_eq!(ue.on_body(DVec2::new(2.0, 1.0), 0.0, 1.8), DVec3::new(2.3, 1.0, 0.9));
    /// ```
    pub fn on_body(&self, position_m: DVec2, heading_rad: f64, height_m: f64) -> DVec3 {
        let (sin, cos) = heading_rad.sin_cos();
        DVec3::new(
            position_m.x + self.forward_m * cos - self.left_m * sin,
            position_m.y + self.forward_m * sin + self.left_m * cos,
            self.height_share * height_m,
        )
    }

    /// Whether it is above the person's position, whichever way the person faces.
    pub(crate) fn is_on_axis(&self) -> bool {
        self.forward_m == 0.0 && self.left_m == 0.0 && self.spread_m == 0.0
    }

    /// How far from the axis it may be in a sample, and how far above or below its mean height.
    pub(crate) fn reach_m(&self) -> [f64; 2] {
        // Of a thousand quantiles the last is 3.3 standard deviations off.
        const MOST: f64 = 3.3;
        let aside_m = std::f64::consts::SQRT_2 * MOST * self.spread_m;
        [self.forward_m.abs() + self.left_m.abs() + aside_m, MOST * self.spread_m]
    }
}

impl Sensor {
    /// The pose of the sensor's frame in the site.
    ///
    /// ```
    /// let east = &umbracast::Config::default().site.sensors[0];
    /// assert_eq!(east.site_from_sensor().translation_m.to_array(), [16.0, 0.0, 9.0]);
    /// ```
    pub fn site_from_sensor(&self) -> Pose {
        let Rotation { yaw, pitch, roll } = self.rotation_deg;
        Pose::from_yaw_pitch_roll_deg(DVec3::from_array(self.position_m), yaw, pitch, roll)
    }

    /// The four numbers of its address; none where the site file names none, or no address.
    ///
    /// ```
    /// let mut east = umbracast::Config::default().site.sensors[0].clone();
    /// assert_eq!(east.address_bytes(), None);
    /// east.address = Some("192.168.1.201".to_owned());
    /// assert_eq!(east.address_bytes(), Some([192, 168, 1, 201]));
    /// ```
    pub fn address_bytes(&self) -> Option<[u8; 4]> {
        let numbers: Vec<u8> =
            self.address.as_deref()?.split('.').map(|number| number.parse().ok()).collect::<Option<_>>()?;
        numbers.try_into().ok()
    }
}

impl AccessPoint {
    /// The antenna's place.
    ///
    /// ```
    /// let side = &umbracast::Config::default().site.access_points[0];
    /// assert_eq!(side.position().to_array(), [14.0, 0.0, 2.0]);
    /// ```
    pub fn position(&self) -> DVec3 {
        DVec3::from_array(self.position_m)
    }
}
