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

/// The parts of a body within a band, seen from above, in single precision and shares of the height.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    /// Half axes, ahead and aside, of an ellipse that holds every slice of the band for a width scale of 1, and of one that
    /// every slice holds; 0 where there is none.
    pub(super) around: [f32; 2],
    pub(super) within: [f32; 2],
    /// The slices' middles are so far ahead of the axis, and by so much more or less.
    pub(super) ahead: f32,
    pub(super) ahead_by: f32,
    /// Ends of the arms' rods from above down, those of rods outside the band left out: ahead, ahead for each swing, out.
    pub(super) joints: [[f32; 3]; 3],
    /// Of the thicker rod; without arms in the band so negative that nothing is near.
    pub(super) radius: f32,
    pub(super) sway: [f32; 2],
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
            arms: body.arms,
            sway_left: body.sway_left,
            sway_ahead: body.sway_ahead,
        }
    }

    /// What of the body is within a band.
    pub(super) fn plan(&self, band: Band) -> Plan {
        let (mut around, mut within, mut bottom) = ([0.0_f64; 2], [f64::MAX; 2], 0.0);
        let (mut least, mut most) = (f64::MAX, f64::MIN);
        for slice in &self.slices {
            if band.meets(bottom, slice.top) {
                let half = [slice.half_depth, slice.half_width];
                around = [around[0].max(half[0]), around[1].max(half[1])];
                within = [within[0].min(half[0]), within[1].min(half[1])];
                (least, most) = (least.min(slice.ahead), most.max(slice.ahead));
            }
            bottom = slice.top;
        }
        if around[0] == 0.0 {
            (least, most) = (0.0, 0.0);
        }
        if around[0] == 0.0 || band.low < 0.0 || band.high > bottom {
            within = [0.0; 2];
        }
        let [upper, fore] = self.arms.rods();
        let ends = match (upper.is_within(band), fore.is_within(band)) {
            (true, true) => [upper.upper, upper.lower, fore.lower],
            (true, false) => [upper.upper, upper.lower, upper.lower],
            (false, _) => [fore.upper, fore.lower, fore.lower],
        };
        let armed = upper.is_within(band) || fore.is_within(band);
        Plan {
            around: around.map(|half| half as f32),
            within: within.map(|half| half as f32),
            ahead: (0.5 * (least + most)) as f32,
            ahead_by: (0.5 * (most - least)) as f32,
            joints: ends.map(|joint| [joint.ahead, joint.swing, joint.out].map(|x| x as f32)),
            radius: if armed { upper.radius.max(fore.radius) as f32 } else { NOWHERE },
            sway: [self.sway_ahead as f32, self.sway_left as f32],
        }
    }
}

/// A radius of what is not there.
const NOWHERE: f32 = -1e3;

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
