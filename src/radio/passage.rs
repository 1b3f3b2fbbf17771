//! Where a radio path passes a body, and what of the body stands across it.

use crate::geometry::{DVec2, DVec3};

/// Half depth and half width of a trunk of usual width with its arms, half width of a head, for a body of [`USUAL_M`].
pub(super) const TRUNK_M: [f64; 2] = [0.13, 0.28];
pub(super) const HEAD_M: f64 = 0.10;
pub(super) const USUAL_M: f64 = 1.72;
/// Where the shoulders end, as a share of the height.
pub(super) const SHOULDERS: f64 = 0.82;

/// A path past the vertical axis of a body, seen from above and from the side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// From the transmitter to where the body is nearest, along the path in plan view, metres.
    pub from_tx_m: f64,
    /// From there to the receiver, in plan view, metres.
    pub to_rx_m: f64,
    /// How far the body's axis is to the left of the path, seen from the receiver, metres.
    pub aside_m: f64,
    /// How high the path is there, above the floor that the body stands on, metres.
    pub height_m: f64,
    /// How much the path rises in each metre of plan view, toward the transmitter.
    pub slope: f64,
}

impl Passage {
    /// The path from `tx_m` to `rx_m` past an axis that stands at `foot_m` on a floor at `floor_m`. `None` where the axis is
    /// not between both ends: model B and the knife edges lose nothing there.
    ///
    /// ```
    /// use umbracast::{geometry::{DVec2, DVec3}, radio::Passage};
    ///
    /// let (ap_m, ue_m) = (DVec3::new(10.0, 0.0, 3.0), DVec3::new(0.0, 0.0, 1.2));
    /// let passage = Passage::new(ap_m, ue_m, DVec2::new(1.0, 0.1), 0.0).unwrap();
    /// assert_eq!((passage.from_tx_m, passage.to_rx_m, passage.aside_m), (9.0, 1.0, 0.1));
    /// assert!((passage.height_m - 1.38).abs() < 1e-12);
    /// assert!(Passage::new(ap_m, ue_m, DVec2::new(-1.0, 0.1), 0.0).is_none(), "behind the receiver");
    /// ```
    pub fn new(tx_m: DVec3, rx_m: DVec3, foot_m: DVec2, floor_m: f64) -> Option<Self> {
        let way_m = (tx_m - rx_m).truncate();
        let length_m = way_m.length();
        let along = way_m / length_m;
        let off_m = foot_m - rx_m.truncate();
        let to_rx_m = along.dot(off_m);
        if !(to_rx_m > 0.0 && to_rx_m < length_m) {
            return None;
        }
        let slope = (tx_m.z - rx_m.z) / length_m;
        Some(Self {
            from_tx_m: length_m - to_rx_m,
            to_rx_m,
            aside_m: along.perp_dot(off_m),
            height_m: rx_m.z + slope * to_rx_m - floor_m,
            slope,
        })
    }

    /// A metre of plan view along the path.
    pub(super) fn slant(&self) -> f64 {
        self.slope.hypot(1.0)
    }

    /// A part of a body that is `half_width_m` to each side of the axis and stands from `bottom_m` to `top_m` above the floor.
    pub fn rectangle(&self, half_width_m: f64, bottom_m: f64, top_m: f64) -> Rectangle {
        Rectangle {
            across_m: [self.aside_m - half_width_m, self.aside_m + half_width_m],
            up_m: [bottom_m - self.height_m, top_m - self.height_m],
        }
    }

    /// A trunk and a head, as wide as they show across the path. `turned` is how much of the body's depth and of its width lie
    /// across: sine and cosine between its heading and the path. `width_scale` is that of its tracks.
    pub fn trunk_and_head(&self, height_m: f64, width_scale: f64, turned: [f64; 2]) -> [Rectangle; 2] {
        let (scale, shoulders_m) = (height_m / USUAL_M * width_scale, SHOULDERS * height_m);
        let half_m = scale * (TRUNK_M[0] * turned[0]).hypot(TRUNK_M[1] * turned[1]);
        [self.rectangle(half_m, 0.0, shoulders_m), self.rectangle(HEAD_M * scale, shoulders_m, height_m)]
    }
}

/// An upright rectangle across a path; its edges are measured from the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// The right and the left edge, positive to the left, metres.
    pub across_m: [f64; 2],
    /// The lower and the upper edge, positive upward, metres.
    pub up_m: [f64; 2],
}
