//! The floor plan of the hall: a rectangle centred on the origin, or any simple polygon anywhere in the frame. It
//! answers where the floor ends and how high it is.

use glam::DVec2;
use serde::{Deserialize, Serialize};

/// Half a stride from a step a body is between two levels,
const STEP_REACH_M: f64 = 0.4;
/// if they are so far apart; less is no more than a floor's unevenness.
const STEP_M: f64 = 0.03;

/// A room: walls, floor and ceiling.
///
/// ```
/// let site = umbracast::Config::default().site;
/// assert_eq!((site.hall.length_m, site.hall.height_m), (34.0, 10.0));
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hall {
    /// Of a rectangle centred on the origin: along x, metres. Not read where there is an outline.
    pub length_m: f64,
    /// The same along y, metres.
    pub width_m: f64,
    /// Floor to ceiling, metres.
    pub height_m: f64,
    /// Corners of any other hall, metres, in order round it, either way; edges do not touch but at corners.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outline_m: Vec<[f64; 2]>,
    /// What of the floor is not at z = 0: ramps and platforms. Where two overlap, the later one is walked on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub floors: Vec<Floor>,
}

/// A plane piece of floor. A ramp leads from one to the next; where neighbours differ in height there is a step.
///
/// ```
/// use umbracast::{geometry::DVec2, site::Floor};
///
/// // 12 m long, rising by 5 %.
/// let outline_m = vec![[0.0, 0.0], [12.0, 0.0], [12.0, 2.0], [0.0, 2.0]];
/// let ramp = Floor { outline_m, height_m: 0.0, slope: [0.05, 0.0] };
/// assert_eq!(ramp.height_at_m(DVec2::new(12.0, 1.0)), 0.6000000000000001);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Floor {
    /// Its corners, metres, in order round it, either way.
    pub outline_m: Vec<[f64; 2]>,
    /// How high its first corner is, metres.
    pub height_m: f64,
    /// How much it rises in a metre along x and in one along y; a level one need not say.
    #[serde(default)]
    pub slope: [f64; 2],
}

impl Floor {
    /// How high its plane is, also beyond its outline.
    ///
    /// ```
    /// use umbracast::{geometry::DVec2, site::Floor};
    ///
    /// let outline_m = vec![[2.0, 0.0], [6.0, 0.0], [6.0, 4.0]];
    /// let ramp = Floor { outline_m, height_m: 0.5, slope: [0.0, 0.125] };
    /// assert_eq!(ramp.height_at_m(DVec2::new(3.0, 2.0)), 0.75);
    /// ```
    pub fn height_at_m(&self, place_m: DVec2) -> f64 {
        let from_m = self.outline_m.first().copied().map_or(DVec2::ZERO, DVec2::from_array);
        self.height_m + DVec2::from_array(self.slope).dot(place_m - from_m)
    }

    /// Each edge from corner to corner, in their order.
    #[doc(hidden)] // For simulated steps.
    pub fn edges(&self) -> impl Iterator<Item = [DVec2; 2]> {
        let corner = |i: usize| DVec2::from_array(self.outline_m[i % self.outline_m.len()]);
        (0..self.outline_m.len()).map(move |i| [corner(i), corner(i + 1)])
    }
}

impl Hall {
    /// How high the floor is at a place, metres: 0 where no other is given.
    ///
    /// ```
    /// use umbracast::{geometry::DVec2, site::Floor};
    ///
    /// let mut hall = umbracast::Config::default().site.hall;
    /// let stage = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
    /// hall.floors = vec![Floor { outline_m: stage, height_m: 0.4, slope: [0.0, 0.0] }];
    /// assert_eq!([1.0, -1.0].map(|x| hall.floor_m(DVec2::new(x, 2.0))), [0.4, 0.0]);
    /// ```
    #[inline]
    pub fn floor_m(&self, place_m: DVec2) -> f64 {
        self.floor_at(place_m).map_or(0.0, |floor| self.floors[floor].height_at_m(place_m))
    }

    /// Whether the floor has a step so near to a place that somebody there may stand on either level.
    pub(crate) fn has_step_about(&self, place_m: DVec2) -> bool {
        let here = self.floor_at(place_m);
        let level_m =
            |floor: Option<usize>| floor.map_or(0.0, |floor| self.floors[floor].height_at_m(place_m));
        let is_step = |away_m: DVec2| {
            let there = self.floor_at(place_m + away_m * STEP_REACH_M);
            there != here && (level_m(there) - level_m(here)).abs() > STEP_M
        };
        !self.floors.is_empty() && [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y].into_iter().any(is_step)
    }

    /// Which of the floors a place is on; `None` for the one at z = 0.
    #[doc(hidden)] // For simulated beams, and for who lays real ones on the floor.
    #[inline]
    pub fn floor_at(&self, place_m: DVec2) -> Option<usize> {
        self.floors.iter().rposition(|floor| is_within(place_m, &floor.outline_m))
    }

    /// The corners of the floor, counter-clockwise.
    ///
    /// ```
    /// let mut hall = umbracast::Config::default().site.hall;
    /// assert_eq!(hall.corners()[0].to_array(), [-17.0, -17.0]);
    /// hall.outline_m = vec![[1000.0, 0.0], [1000.0, 6.0], [1008.0, 0.0]];
    /// assert_eq!(hall.corners()[0].to_array(), [1008.0, 0.0], "the file gave them clockwise");
    /// ```
    pub fn corners(&self) -> Vec<DVec2> {
        if self.outline_m.is_empty() {
            let half = DVec2::new(self.length_m, self.width_m) * 0.5;
            return vec![-half, DVec2::new(half.x, -half.y), half, DVec2::new(-half.x, half.y)];
        }
        let mut corners: Vec<DVec2> = self.outline_m.iter().copied().map(DVec2::from_array).collect();
        if doubled_area_m2(&corners) < 0.0 {
            corners.reverse();
        }
        corners
    }

    /// Each wall from corner to corner, counter-clockwise.
    ///
    /// ```
    /// let walls = umbracast::Config::default().site.hall.walls();
    /// assert_eq!(walls.map(|[from, to]| from.distance(to)).sum::<f64>(), 4.0 * 34.0);
    /// ```
    pub fn walls(&self) -> impl Iterator<Item = [DVec2; 2]> + use<> {
        let corners = self.corners();
        (0..corners.len()).map(move |i| [corners[i], corners[(i + 1) % corners.len()]])
    }

    /// The least and the greatest x and y of the floor.
    ///
    /// ```
    /// let [least, most] = umbracast::Config::default().site.hall.bounds_m();
    /// assert_eq!((least.to_array(), most.to_array()), ([-17.0, -17.0], [17.0, 17.0]));
    /// ```
    pub fn bounds_m(&self) -> [DVec2; 2] {
        let start = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        self.corners().into_iter().fold(start, |[least, most], p| [least.min(p), most.max(p)])
    }

    /// The middle of those bounds: a rectangle's is the origin.
    ///
    /// ```
    /// assert_eq!(umbracast::Config::default().site.hall.middle_m().to_array(), [0.0, 0.0]);
    /// ```
    pub fn middle_m(&self) -> DVec2 {
        let [least, most] = self.bounds_m();
        0.5 * (least + most)
    }

    /// Whether a place is on the floor.
    ///
    /// ```
    /// use umbracast::geometry::DVec2;
    ///
    /// let mut hall = umbracast::Config::default().site.hall;
    /// assert!(hall.contains(DVec2::new(17.0, -17.0)) && !hall.contains(DVec2::new(17.1, 0.0)));
    /// // An L: its upper right quarter is not floor.
    /// hall.outline_m = vec![[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [4.0, 4.0], [4.0, 8.0], [0.0, 8.0]];
    /// assert!(hall.contains(DVec2::new(2.0, 6.0)) && !hall.contains(DVec2::new(6.0, 6.0)));
    /// ```
    pub fn contains(&self, place_m: DVec2) -> bool {
        if self.outline_m.is_empty() {
            return place_m.x.abs() <= self.length_m * 0.5 && place_m.y.abs() <= self.width_m * 0.5;
        }
        is_within(place_m, &self.outline_m)
    }

    /// How far from the nearest wall a place on the floor is, metres; negative for one that is not on it.
    ///
    /// ```
    /// use umbracast::geometry::DVec2;
    ///
    /// let hall = umbracast::Config::default().site.hall;
    /// assert_eq!(hall.clearance_m(DVec2::new(16.0, 3.0)), 1.0);
    /// assert_eq!(hall.clearance_m(DVec2::new(19.0, 3.0)), -2.0);
    /// ```
    pub fn clearance_m(&self, place_m: DVec2) -> f64 {
        let nearest_m = self.walls().map(|wall| from_segment_m(place_m, wall)).fold(f64::INFINITY, f64::min);
        if self.contains(place_m) { nearest_m } else { -nearest_m }
    }
}

/// Whether a place is within an outline of three corners or more.
fn is_within(place_m: DVec2, outline_m: &[[f64; 2]]) -> bool {
    // A line from the place to the right crosses the outline an odd number of times.
    let mut before = outline_m.last().copied().map_or(DVec2::ZERO, DVec2::from_array);
    let mut inside = false;
    for &corner in outline_m {
        let corner = DVec2::from_array(corner);
        if (corner.y > place_m.y) != (before.y > place_m.y) {
            let share = (place_m.y - corner.y) / (before.y - corner.y);
            inside ^= place_m.x < corner.x + share * (before.x - corner.x);
        }
        before = corner;
    }
    inside
}

/// How far a place is from the nearest of a straight piece.
pub(crate) fn from_segment_m(at_m: DVec2, [from, to]: [DVec2; 2]) -> f64 {
    let along = to - from;
    let share = (at_m - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
    at_m.distance(from + along * share.clamp(0.0, 1.0))
}

/// Twice the area within corners; negative where they go clockwise.
pub(crate) fn doubled_area_m2(corners: &[DVec2]) -> f64 {
    let Some(&first) = corners.first() else { return 0.0 };
    // From the first corner, so that nothing is lost far from the origin.
    corners.windows(2).map(|pair| (pair[0] - first).perp_dot(pair[1] - first)).sum()
}
