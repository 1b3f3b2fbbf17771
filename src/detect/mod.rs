//! Stage 1, first half: from a frame to detections of people (paper, section IV-A).
//!
//! Foreground: the points that do not belong to the empty scene, in the site frame. Clusters: groups of them in
//! plan view, split and merged until each is one person. Detections: position and boxes of each.

mod cluster;
mod first_sight;
mod range_model;
mod presence;
mod cloud_limits;
mod sensor_model;
mod voxel;
mod placed;
mod background;
#[doc(hidden)] // What the network of the pose reads, for its fit.
pub mod pose_view;
mod dp_means;
mod part;
mod shape;
mod guided;
mod memory;
mod means;
mod canopy;
mod arms;
mod expected;
mod evidence;
mod split_merge;
#[doc(hidden)] // The network that looks at one body, for its fit and for the command that shows it.
pub mod point_network;
#[doc(hidden)]
pub mod pose;
#[doc(hidden)] // What the fit of the usual outline reads.
pub mod outline;
mod looks;
mod measure;
mod clocks;
mod doubled;

pub use background::Background;
#[doc(hidden)] // For who joins the foreground of several front ends.
pub use background::keep_most;
pub use canopy::Overhead;
pub use clocks::Clocks;
pub use doubled::doubled;
pub(crate) use expected::{PRESSED_APART_M, PRESSED_M, press};
pub use measure::Measurer;
#[doc(hidden)] // For the card of the network of the pose.
pub use measure::SHIFT_M;
pub use outline::{LEVELS, Reach};
pub use pose::Facing;
pub use shape::{BANDS, Moments, Shape};
pub use split_merge::Clusterer;

use crate::gait::Gait;
use crate::geometry::{Aabb, DVec2, DVec3, Obb};
use crate::site::Hall;

/// A foreground point.
///
/// ```
/// use umbracast::{detect::Point, geometry::DVec3};
///
/// let point = Point { position_m: DVec3::new(1.0, 2.0, 1.5), time_ns: 90_000_000, sensor: 1 };
/// assert_eq!(point.position_m.truncate().to_array(), [1.0, 2.0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// In the site frame.
    pub position_m: DVec3,
    /// When it was measured.
    pub time_ns: i64,
    /// Which sensor of the site saw it.
    pub sensor: u16,
}

/// Where a person is expected: a track of the last step, predicted to the frame's time.
///
/// ```
/// use umbracast::{Config, track::Tracker};
///
/// // The tracker says whom it expects where: nobody, before the first frame.
/// let config = Config::default();
/// let mut priors = Vec::new();
/// Tracker::new(&config.track, &config.site).priors(100_000_000, &mut priors);
/// assert!(priors.is_empty());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Predicted ground point of the body axis.
    pub position_m: DVec2,
    /// Its velocity.
    pub velocity_mps: DVec2,
    /// One standard deviation of the position, the larger axis, metres.
    pub position_sigma_m: f64,
    /// Standing height as the track knows it.
    pub height_m: f64,
    /// True once the track is confirmed.
    pub confirmed: bool,
    /// True of who was seen to walk.
    pub walked: bool,
    /// True of what has been there for long and never walked: nobody, but something that was put there.
    pub is_furniture: bool,
    /// How the points of the body lie, where it was learned.
    pub shape: Option<Shape>,
}

/// Points of one person: indices into the foreground, ascending.
pub type Cluster = Vec<u32>;

/// One person in one frame (the paper's D, without identity).
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// let found = detection(3.0, 0);
/// assert_eq!((found.position_m.x, found.aabb.size_m().z), (3.0, 1.7));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Ground point of the body axis, corrected for the side that was seen where the config says so.
    pub position_m: DVec2,
    /// Covariance of its error in a single frame, the sway of the body included, m^2; `None` where the position was
    /// found by a method that does not tell.
    pub covariance_m2: Option<[[f64; 2]; 2]>,
    /// Mean height of the points above the floor below them (`hdl` tracks x, y and z).
    pub z_m: f64,
    /// Mean time of the points.
    pub time_ns: i64,
    /// How many points.
    pub points: u32,
    /// False for points that do not look like a person, but lie where one is expected: legs, a head behind others.
    pub full_body: bool,
    /// Highest point above the floor.
    pub top_m: f64,
    /// Diagonal in plan view of what lies at most 0.2 m below the highest point: a head is small, a cupboard's top is not.
    pub top_diagonal_m: f64,
    /// What hangs over it, such as an umbrella: the top need not be a head.
    pub overhead: Option<Overhead>,
    /// Which way somebody known faces who stands.
    pub facing: Option<Facing>,
    /// Where in the stride somebody known is who walks, and how far each hand swings.
    pub gait: Option<Gait>,
    /// How far the body of somebody known reaches, by sensor and level.
    pub reaches: Vec<Reach>,
    /// How the points lie about the position, band by band, along the site's axes.
    pub bands: [Moments; BANDS],
    /// Box along the site's axes, in the site frame.
    pub aabb: Aabb,
    /// Box along the cluster's axes, the same.
    pub obb: Obb,
}

#[cfg(test)]
impl Detection {
    /// A whole body whose points fill a box that stands on the floor at the origin.
    pub(crate) fn of_box(aabb: Aabb) -> Self {
        Self {
            position_m: DVec2::ZERO,
            covariance_m2: None,
            z_m: 0.5 * aabb.max_m.z,
            time_ns: 0,
            points: 40,
            full_body: true,
            top_m: aabb.max_m.z,
            top_diagonal_m: 0.2,
            overhead: None,
            facing: None,
            gait: None,
            reaches: Vec::new(),
            bands: Default::default(),
            aabb,
            obb: Obb::from_aabb(&aabb),
        }
    }
}

/// A place with its height above the floor below it: whoever walks on a ramp is upright there.
fn above_floor(hall: &Hall, at_m: DVec3) -> DVec3 {
    DVec3 { z: at_m.z - hall.floor_m(at_m.truncate()), ..at_m }
}
