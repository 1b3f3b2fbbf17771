//! Stage 1, second half: detections of frame after frame joined to tracks (paper, section IV-A).

pub mod gait;
pub mod girth;
pub mod kalman;
mod stride;
pub mod association;
pub mod visibility;
mod height;
mod person;
pub mod tracker;

pub use gait::Gait;
pub use tracker::Tracker;

use std::collections::VecDeque;

use crate::geometry::{Aabb, DVec2, Obb};

/// Positions of the observation window: 10 frames (paper, section V-B).
pub const OBSERVED: usize = 10;

/// One person followed over time, at the frame's instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Never used twice in a run.
    pub id: u64,
    /// Ground point of the body axis.
    pub position_m: DVec2,
    /// Its velocity.
    pub velocity_mps: DVec2,
    /// Of (x, y, vx, vy); metres and seconds.
    pub covariance: [[f64; 4]; 4],
    /// The trunk's, counter-clockwise from +x: the velocity's while walking, held while standing.
    pub heading_rad: f64,
    /// One standard deviation of `heading_rad`: what the velocity's covariance leaves open while walking, more
    /// with the time while standing, and 1.81 (any direction) for who has never walked.
    pub heading_sigma_rad: f64,
    /// Standing height, shoes and hair included.
    pub height_m: f64,
    /// One standard deviation of `height_m`.
    pub height_sigma_m: f64,
    /// Depths and widths of the body beside those of a usual one of this height: 1.
    pub girth: f64,
    /// One standard deviation of `girth`.
    pub girth_sigma: f64,
    /// Where in the stride, as the sway of the trunk tells it.
    pub gait: Gait,
    /// Points of this frame's detection; 0 while it coasts.
    pub points: u32,
    /// False until the track has been seen often enough to be believed, and while it has been out of sight so long
    /// that its position says little.
    pub confirmed: bool,
    /// The person's box along the site's axes, at `position_m`.
    pub aabb: Aabb,
    /// The person's oriented box, at `position_m`.
    pub obb: Obb,
    /// The last states, oldest first, this frame's last: at most [`OBSERVED`].
    pub observed: VecDeque<Observed>,
}

/// A track's state at a frame of the observation window, as the filter held it then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observed {
    /// The frame's.
    pub time_ns: i64,
    /// Position.
    pub position_m: DVec2,
    /// Velocity.
    pub velocity_mps: DVec2,
}
