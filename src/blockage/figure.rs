//! A body for the loops over samples: its parts between two heights, and how far they reach.

use super::body_model::{Arms, BodyModel, Slice};
use super::lanes::larger;
use crate::detect::{LEVELS, outline::LEVEL_TOPS};
use crate::track::outline::LevelOutline;
use crate::track::{Canopy, Track};

/// Heights between which rays may meet a body, as shares of its height.
#[derive(Debug, Clone, Copy)]
pub(super) struct Band {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Band {
    #[inline(always)]
    pub(super) fn meets(&self, bottom: f64, top: f64) -> bool {
        top >= self.low && bottom <= self.high
    }
}

/// The parts of a body within a band, seen from above, in single precision and shares of the height.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    /// Half axes, ahead and aside, of an ellipse that holds every slice of the band for a width scale of 1, and of one that
    /// every slice holds.
    pub(super) around: [f32; 2],
    pub(super) within: [f32; 2],
    /// The slices' middles are so far ahead of the axis, and by so much more or less.
    pub(super) ahead: f32,
    pub(super) ahead_by: f32,
    /// The same to the left.
    pub(super) left: f32,
    pub(super) left_by: f32,
    /// Ends of the arms' rods from above down, those of rods outside the band left out: ahead, ahead for each swing, out on the right, out on
    /// the left.
    pub(super) joints: [[f32; 4]; 3],
    /// Of the thicker rod; without arms in the band so negative that nothing is near.
    pub(super) radius: f32,
    /// How far the trunk sways, ahead and aside together.
    sway: f32,
}

impl Plan {
    /// No part of it is farther from the body's position, as a share of the height, where its arms are no farther than that.
    #[inline(always)]
    pub(super) fn reach(&self, width_max: f64, arms: f64) -> f64 {
        let half = f64::from(larger(self.around[0], self.around[1]));
        let off = self.ahead.abs() + self.ahead_by + self.left.abs() + self.left_by;
        let trunk = half * width_max + f64::from(off);
        trunk.max(arms) + f64::from(self.sway)
    }

    /// The same of the arms, which are one of [`RODS`] choices in every stretch of slices.
    pub(super) fn arms_reach(&self, width_max: f64, fastest_hz: f64) -> f64 {
        let joint = |[fixed, swings, right, left]: [f32; 4]| {
            let out = larger(right, left);
            let ahead = fastest_hz * f64::from(fixed.abs() + swings.abs());
            (ahead * ahead + f64::from(out * out)).sqrt()
        };
        self.joints.map(joint).into_iter().fold(0.0, f64::max) + f64::from(self.radius) * width_max
    }
}

/// Heights that are compared at once.
const REGISTER: usize = 8;

/// The body's numbers as the loops want them.
#[derive(Debug, Clone)]
pub(super) struct Figure {
    pub(super) slices: Vec<Slice>,
    pub(super) rods: [Rod; 2],
    /// Tops of all slices but the last, in whole registers; what is left of the last one holds no numbers.
    tops: Vec<[f64; REGISTER]>,
    /// Between which heights each rod is.
    rods_up: [[f64; 2]; 2],
    /// Of every stretch of slices, with every choice of rods.
    pub(super) plans: Vec<Plan>,
    pub(super) sway_left: f64,
    pub(super) sway_ahead: f64,
    /// What of `slices` is somebody's own: for whom it was worked out.
    outline_m: [LevelOutline; LEVELS],
    canopy: Option<Canopy>,
    of_height_m: f64,
}

/// What reaches aside at these levels of a usual body is the arm: hand and elbow. Where somebody reaches less far, it is an arm that
/// is elsewhere, and the trunk is narrower by this share only.
const ARMS_AT: [usize; 2] = [1, 2];
const OF_TRUNK: f64 = 0.4;
/// No part of a body is thinner than this share of the usual one.
const THINNEST: f64 = 0.6;

impl Figure {
    pub(super) fn new(body: &BodyModel) -> Self {
        let mut figure = Self {
            slices: body.slices.clone(),
            rods: body.arms.rods(),
            tops: Vec::new(),
            rods_up: [[0.0; 2]; 2],
            plans: Vec::new(),
            sway_left: body.sway_left,
            sway_ahead: body.sway_ahead,
            outline_m: Default::default(),
            canopy: None,
            of_height_m: 0.0,
        };
        figure.look_from_above();
        figure
    }

    /// Takes the outline of a track in place of that of a `usual` body, and what it carries over the head.
    pub(super) fn take_outline(&mut self, usual: &Self, track: &Track) {
        if track.part_of.is_some() {
            return self.take_box(usual, track);
        }
        let (outline_m, canopy, height_m) = (&track.outline_m, track.canopy, track.height_m);
        let is_same = self.outline_m == *outline_m && self.canopy == canopy && self.of_height_m == height_m;
        if is_same && !self.plans.is_empty() {
            return;
        }
        (self.outline_m, self.canopy, self.of_height_m) = (*outline_m, canopy, height_m);
        self.slices.clone_from(&usual.slices);
        let mut bottom = 0.0;
        for slice in &mut self.slices {
            let middle = 0.5 * (bottom + slice.top);
            bottom = slice.top;
            let level = LEVEL_TOPS.iter().position(|top| middle < *top).unwrap_or(LEVELS - 1);
            let [ahead, _, round, oblong] = outline_m[level].map(|m| m / height_m);
            slice.ahead += ahead;
            slice.half_depth = (slice.half_depth + round + oblong).max(THINNEST * slice.half_depth);
            let [right, left] =
                aside(&outline_m[level], height_m).map(|out| match out < 0.0 && ARMS_AT.contains(&level) {
                    true => OF_TRUNK * out,
                    false => out,
                });
            slice.left += 0.5 * (left - right);
            slice.half_width = (slice.half_width + 0.5 * (left + right)).max(THINNEST * slice.half_width);
        }
        self.rods = usual.rods;
        let [hand, elbow] = ARMS_AT.map(|level| aside(&outline_m[level], height_m));
        let [upper, fore] = &mut self.rods;
        for side in 0..2 {
            for (joint, moves) in
                [(&mut upper.lower, elbow), (&mut fore.upper, elbow), (&mut fore.lower, hand)]
            {
                joint.out[side] = (joint.out[side] + moves[side]).max(0.0);
            }
        }
        self.slices.extend(canopy.into_iter().flat_map(|canopy| slices_of_canopy(&canopy, height_m)));
        self.look_from_above();
    }

    /// Takes the box of somebody's thing: as thick from the floor to its top, and without arms.
    fn take_box(&mut self, usual: &Self, track: &Track) {
        let half_m = 0.5 * track.aabb.size_m().truncate();
        let half = (OF_BOX * (half_m.x * half_m.y).sqrt() / track.height_m).max(LEAST);
        let slice = |of: &Slice| Slice { half_depth: half, half_width: half, ahead: 0.0, left: 0.0, ..*of };
        self.slices.clear();
        self.slices.extend(usual.slices.iter().map(slice));
        self.rods = usual.rods.map(|rod| Rod { radius: 0.0, ..rod });
        // Should it turn out to be a person, nothing is known of an outline.
        self.of_height_m = 0.0;
        self.look_from_above();
    }

    /// The highest part of the body, as a share of its height.
    pub(super) fn top(&self) -> f64 {
        self.slices.last().map_or(1.0, |slice| slice.top)
    }

    fn look_from_above(&mut self) {
        let n = self.slices.len();
        let tops =
            |slices: &[Slice]| std::array::from_fn(|i| slices.get(i).map_or(f64::NAN, |slice| slice.top));
        self.tops.clear();
        self.tops.extend(self.slices[..n.saturating_sub(1)].chunks(REGISTER).map(tops));
        self.rods_up = self.rods.map(|rod| rod.between());
        let arms: [_; RODS] = std::array::from_fn(|rods| self.arms(rods));
        let sway = (self.sway_ahead + self.sway_left) as f32;
        self.plans.clear();
        for low in 0..n {
            let mut trunk = Extent::of(&self.slices[low]);
            for high in 0..n {
                // Nobody asks for those that end below their beginning.
                if high > low {
                    trunk.take(&self.slices[high]);
                }
                self.plans.extend(arms.map(|arms| trunk.with(arms, sway)));
            }
        }
    }

    /// What of the body is within a band: one of [`Figure::plans`].
    #[inline(always)]
    pub(super) fn plan_of(&self, band: Band) -> usize {
        // Slices stand one upon another.
        let (mut low, mut high) = (0, 0);
        for tops in &self.tops {
            low += tops.iter().map(|top| usize::from(*top < band.low)).sum::<usize>();
            high += tops.iter().map(|top| usize::from(*top <= band.high)).sum::<usize>();
        }
        let rod = |i: usize| usize::from(band.meets(self.rods_up[i][0], self.rods_up[i][1])) << i;
        (low * self.slices.len() + high.max(low)) * RODS + rod(0) + rod(1)
    }

    /// True where a band lies between the floor and the top of the head of everybody.
    #[inline(always)]
    pub(super) fn holds(&self, band: Band) -> bool {
        band.low >= 0.0 && band.high <= self.top()
    }

    /// Joints and radius of a plan with those rods whose bit is set.
    fn arms(&self, rods: usize) -> ([[f32; 4]; 3], f32) {
        let [upper, fore] = &self.rods;
        let ends = match rods {
            0b11 => [upper.upper, upper.lower, fore.lower],
            0b01 => [upper.upper, upper.lower, upper.lower],
            _ => [fore.upper, fore.lower, fore.lower],
        };
        let radius = if rods == 0 { NOWHERE } else { upper.radius.max(fore.radius) as f32 };
        (ends.map(|joint| [joint.ahead, joint.swing, joint.out[0], joint.out[1]].map(|x| x as f32)), radius)
    }
}

/// The most and the least of slices: half depth, half width, how far ahead and left of the axis.
struct Extent {
    most: [f64; 4],
    least: [f64; 4],
}

impl Extent {
    fn of(slice: &Slice) -> Self {
        let all = [slice.half_depth, slice.half_width, slice.ahead, slice.left];
        Self { most: all, least: all }
    }

    fn take(&mut self, slice: &Slice) {
        let other = Self::of(slice);
        for i in 0..4 {
            self.most[i] = self.most[i].max(other.most[i]);
            self.least[i] = self.least[i].min(other.least[i]);
        }
    }

    fn with(&self, (joints, radius): ([[f32; 4]; 3], f32), sway: f32) -> Plan {
        let [most, least] = [self.most, self.least];
        let middle = |i: usize| (0.5 * (most[i] + least[i])) as f32;
        let by = |i: usize| (0.5 * (most[i] - least[i])) as f32;
        Plan {
            around: [most[0], most[1]].map(|m| m as f32),
            within: [least[0], least[1]].map(|m| m as f32),
            ahead: middle(2),
            ahead_by: by(2),
            left: middle(3),
            left_by: by(3),
            joints,
            radius,
            sway,
        }
    }
}

/// The slices of a track's body from the floor up, shares of its height: as rays meet it.
#[doc(hidden)] // For who draws it.
pub fn slices_of(body: &BodyModel, track: &Track) -> Vec<Slice> {
    let usual = Figure::new(body);
    let mut own = usual.clone();
    own.take_outline(&usual, track);
    own.slices
}

/// A canopy as slices above the head: what is free below it, and a dome of two.
fn slices_of_canopy(canopy: &Canopy, height_m: f64) -> [Slice; 3] {
    let (at, radius) = (canopy.center_m / height_m, canopy.radius_m / height_m);
    let low = (canopy.low_m / height_m).max(1.0 + LEAST);
    let top = (canopy.top_m / height_m).max(low + LEAST);
    let slice = |top: f64, share: f64| {
        let half = (radius * share).max(LEAST);
        Slice { top, half_depth: half, half_width: half, ahead: at.x, left: at.y }
    };
    [slice(low, 0.0), slice(0.5 * (low + top), 1.0), slice(top, UPPER_HALF)]
}

/// No slice is thinner, nor lower: shares of the height.
const LEAST: f64 = 1e-3;
/// Boxes are averaged over frames with something else in them, and things do not fill them.
const OF_BOX: f64 = 0.7;
/// As wide is the upper half of a dome on the mean.
const UPPER_HALF: f64 = 0.6;

/// How much farther than usual a level reaches to the right and to the left, as shares of the height.
fn aside([_, left, round, oblong]: &LevelOutline, height_m: f64) -> [f64; 2] {
    [(round - oblong - left) / height_m, (round - oblong + left) / height_m]
}

/// Which of the two rods: two bits.
pub(super) const RODS: usize = 4;

/// A radius of what is not there.
const NOWHERE: f32 = -1e3;

/// One of the two rods of an arm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rod {
    pub(super) upper: Joint,
    pub(super) lower: Joint,
    pub(super) radius: f64,
}

impl Rod {
    #[inline(always)]
    pub(super) fn is_within(&self, band: Band) -> bool {
        let [low, high] = self.between();
        band.meets(low, high)
    }

    /// No part of it is below the first or above the second.
    fn between(&self) -> [f64; 2] {
        // No width is more than twice the usual one.
        let radius = 2.0 * self.radius;
        [self.upper.up.min(self.lower.up) - radius, self.upper.up.max(self.lower.up) + radius]
    }
}

/// Where an arm's shoulder, elbow or hand is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Joint {
    pub(super) up: f64,
    /// Of the right one, of the left one.
    pub(super) out: [f64; 2],
    pub(super) ahead: f64,
    pub(super) swing: f64,
}

impl Arms {
    pub(super) fn rods(&self) -> [Rod; 2] {
        let shoulder = Joint { up: self.shoulder_up, out: [self.shoulder_out; 2], ahead: 0.0, swing: 0.0 };
        let elbow =
            Joint { up: self.elbow_up, out: [self.elbow_out; 2], ahead: 0.0, swing: self.elbow_swing };
        let hand = Joint {
            up: self.hand_up,
            out: [self.hand_out; 2],
            ahead: self.hand_ahead,
            swing: self.hand_swing,
        };
        [
            Rod { upper: shoulder, lower: elbow, radius: self.upper_radius },
            Rod { upper: elbow, lower: hand, radius: self.fore_radius },
        ]
    }
}
