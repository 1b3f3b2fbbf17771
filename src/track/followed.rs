//! What the tracker reports of one person.

use std::collections::VecDeque;

use super::outline::LevelOutline;
use super::remembered::{Remembered, Words};
use super::shape::Canopy;
use crate::detect::LEVELS;
use crate::gait::Gait;
use crate::geometry::{Aabb, DVec2, Obb};

/// Positions of the observation window: 10 frames (paper, section V-B).
pub const OBSERVED: usize = 10;
/// One standard deviation of the width scale of adults: of trunks' widths over heights, on simulated people.
pub const WIDTH_SCALE_SIGMA: f64 = 0.058;

/// One person followed over time, at the frame's instant.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let config = umbracast::Config::default();
/// # let (mut tracker, mut tracks) = (umbracast::track::Tracker::new(&config.track, &config.site), Vec::new());
/// # tracker.update(&views(0), &[detection(1.0, views(0).time_ns)], &mut tracks);
/// for track in tracks.iter().filter(|track| !track.confirmed) {
///     let sigma_m = track.covariance[0][0].sqrt();
///     assert!(track.id == 0 && track.position_m.x == 1.0 && sigma_m < 0.1);
/// }
/// ```
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
    /// One standard deviation of `heading_rad`: what the velocity's covariance leaves open while walking, what the body
    /// shows does while standing, and 1.81 (any direction) for who never walked nor was seen alone.
    pub heading_sigma_rad: f64,
    /// Probability that the trunk faces the other way: bodies look nearly alike from the front and from behind.
    pub heading_behind: f64,
    /// Standing height, shoes and hair included; by the paper's method the last detection's highest point.
    pub height_m: f64,
    /// One standard deviation of `height_m`.
    pub height_sigma_m: f64,
    /// Depths and widths of the body beside those of a usual one of this height; 1 by our tracker, whose outline says more.
    pub width_scale: f64,
    /// One standard deviation of `width_scale`.
    pub width_scale_sigma: f64,
    /// How the outline of each level differs from that of a usual body: ahead, left, round, oblong, metres.
    pub outline_m: [LevelOutline; LEVELS],
    /// What is carried over the head, such as an umbrella.
    pub canopy: Option<Canopy>,
    /// Where in the stride, as arms and legs tell it.
    pub gait: Gait,
    /// Points of this frame's detection; 0 while it coasts.
    pub points: u32,
    /// False until the track has been seen often enough to be believed, while it has been out of sight so long that its
    /// position says little, and from when on it is taken for furniture, for it never walked.
    pub confirmed: bool,
    /// Whose pram, walking frame or other thing it is, the `id` of a track: it is nobody and has no link, but it stands in the way
    /// of everybody else's.
    pub part_of: Option<u64>,
    /// The person's box along the site's axes, at `position_m`.
    pub aabb: Aabb,
    /// The person's oriented box, at `position_m`.
    pub obb: Obb,
    /// The last states, oldest first, this frame's last: at most [`OBSERVED`].
    pub observed: VecDeque<Observed>,
}

/// A track's state at a frame of the observation window, as the filter held it then.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let config = umbracast::Config::default();
/// # let (mut tracker, mut tracks) = (umbracast::track::Tracker::new(&config.track, &config.site), Vec::new());
/// # tracker.update(&views(0), &[detection(1.0, views(0).time_ns)], &mut tracks);
/// let now = tracks[0].observed.back().expect("a track was seen at least once");
/// assert_eq!((now.time_ns, now.position_m), (100_000_000, tracks[0].position_m));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observed {
    /// The frame's.
    pub time_ns: i64,
    /// Position.
    pub position_m: DVec2,
    /// Velocity.
    pub velocity_mps: DVec2,
}

/// The observation window of a track.
#[derive(Debug, Clone, Default)]
pub(super) struct Observations(pub(super) VecDeque<Observed>);

impl Remembered for Observations {
    fn visit(&mut self, words: &mut impl Words) {
        let blank = Observed { time_ns: 0, position_m: DVec2::ZERO, velocity_mps: DVec2::ZERO };
        let count = words.count(self.0.len(), OBSERVED);
        self.0.resize(count, blank);
        for observed in &mut self.0 {
            words.i64(&mut observed.time_ns);
            words.vec2(&mut observed.position_m);
            words.vec2(&mut observed.velocity_mps);
        }
    }
}

impl Observations {
    pub(super) fn push(&mut self, time_ns: i64, position_m: DVec2, velocity_mps: DVec2) {
        if self.0.len() == OBSERVED {
            self.0.pop_front();
        }
        self.0.push_back(Observed { time_ns, position_m, velocity_mps });
    }
}

pub(super) fn seconds(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}
