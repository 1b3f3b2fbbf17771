//! The floor plan of what is watched: a rectangle centred on the origin, or any simple polygon anywhere in the frame.
//! Whoever asks where the floor ends asks here.

use glam::DVec2;
use serde::{Deserialize, Serialize};

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
}

impl Hall {
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
        // A line from the place to the right crosses the outline an odd number of times.
        let outline = &self.outline_m;
        let mut before = DVec2::from_array(outline[outline.len() - 1]);
        let mut inside = false;
        for &corner in outline {
            let corner = DVec2::from_array(corner);
            if (corner.y > place_m.y) != (before.y > place_m.y) {
                let share = (place_m.y - corner.y) / (before.y - corner.y);
                inside ^= place_m.x < corner.x + share * (before.x - corner.x);
            }
            before = corner;
        }
        inside
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
