//! A body for the loops over samples: which of its parts stand between two heights, and how far they reach.

use super::body_model::{Arms, BodyModel, Slice};

/// Heights between which rays may meet a body, as shares of its height.
#[derive(Debug, Clone, Copy)]
pub(super) struct Band {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Band {
    pub(super) fn meets(&self, bottom: f64, top: f64) -> bool {
        top >= self.low && bottom <= self.high
    }
}

/// How far the parts of a body within a band reach from the axis, as shares of its height: all alike, and what a width
/// scale and a swing of 1 add.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Extent {
    pub(super) depth: f32,
    pub(super) depth_per_width: f32,
    pub(super) ahead_per_swing: f32,
    pub(super) back_per_swing: f32,
    pub(super) side: f32,
    pub(super) side_per_width: f32,
    /// Half axes of an ellipse that every slice of the band holds for a width scale of 1, and how far from the axis its
    /// middle may be; without a half axis where the band leaves the trunk.
    pub(super) core: [f32; 2],
    pub(super) core_off: [f32; 2],
}

/// The body's numbers as the loops want them.
#[derive(Debug, Clone)]
pub(super) struct Figure {
    pub(super) slices: Vec<Slice>,
    pub(super) arms: Arms,
    pub(super) sway_left: f64,
    pub(super) sway_ahead: f64,
}

impl Figure {
    pub(super) fn new(body: &BodyModel) -> Self {
        Self {
            slices: body.slices.clone(),
            arms: body.arms.clone(),
            sway_left: body.sway_left,
            sway_ahead: body.sway_ahead,
        }
    }

    /// How far the parts within a band reach.
    pub(super) fn extent(&self, band: Band) -> Extent {
        let mut of = Extent { core: [f32::MAX; 2], ..Extent::default() };
        let mut bottom = 0.0;
        for slice in &self.slices {
            if band.meets(bottom, slice.top) {
                of.depth = of.depth.max(slice.ahead.abs() as f32);
                of.depth_per_width = of.depth_per_width.max(slice.half_depth as f32);
                of.side_per_width = of.side_per_width.max(slice.half_width as f32);
                of.core[0] = of.core[0].min(slice.half_depth as f32);
                of.core[1] = of.core[1].min(slice.half_width as f32);
            }
            bottom = slice.top;
        }
        of.core_off = [of.depth + self.sway_ahead.abs() as f32, self.sway_left.abs() as f32];
        if band.low < 0.0 || band.high > bottom {
            of.core = [0.0; 2];
        }
        for rod in self.arms.rods().into_iter().filter(|rod| rod.is_within(band)) {
            for joint in [rod.upper, rod.lower] {
                of.side = of.side.max(joint.out.abs() as f32);
                of.ahead_per_swing = of.ahead_per_swing.max((joint.ahead.abs() + joint.swing.abs()) as f32);
                of.back_per_swing = of.back_per_swing.max((joint.swing.abs() - joint.ahead) as f32);
            }
            of.depth_per_width = of.depth_per_width.max(rod.radius as f32);
            of.side_per_width = of.side_per_width.max(rod.radius as f32);
        }
        of.depth += self.sway_ahead.abs() as f32;
        of.side += self.sway_left.abs() as f32;
        of
    }
}

/// One of the two rods of an arm.
pub(super) struct Rod {
    pub(super) upper: Joint,
    pub(super) lower: Joint,
    pub(super) radius: f64,
}

impl Rod {
    pub(super) fn is_within(&self, band: Band) -> bool {
        // No width is more than twice the usual one.
        let radius = 2.0 * self.radius;
        band.meets(self.upper.up.min(self.lower.up) - radius, self.upper.up.max(self.lower.up) + radius)
    }
}

/// Where an arm's shoulder, elbow or hand is.
#[derive(Clone, Copy)]
pub(super) struct Joint {
    pub(super) up: f64,
    pub(super) out: f64,
    pub(super) ahead: f64,
    pub(super) swing: f64,
}

impl Arms {
    pub(super) fn rods(&self) -> [Rod; 2] {
        let shoulder = Joint { up: self.shoulder_up, out: self.shoulder_out, ahead: 0.0, swing: 0.0 };
        let elbow = Joint { up: self.elbow_up, out: self.elbow_out, ahead: 0.0, swing: self.elbow_swing };
        let hand =
            Joint { up: self.hand_up, out: self.hand_out, ahead: self.hand_ahead, swing: self.hand_swing };
        [
            Rod { upper: shoulder, lower: elbow, radius: self.upper_radius },
            Rod { upper: elbow, lower: hand, radius: self.fore_radius },
        ]
    }
}
