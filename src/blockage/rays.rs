//! The rays of one link at one step, one for each sample, and the samples of a body that come near them. The test is
//! seen from above and has a margin. Only samples that may meet are then tested height by height
//! ([`super::crossing`]).

use std::ops::Range;

use super::figure::{Figure, Plan};
use super::lanes::{WORD, bits_of, larger, smaller, word_of, word_of_mut};
use super::shadows::Meeting;
use super::trajectories::Trajectories;
use crate::geometry::DVec3;
use crate::site::Ue;

/// Rounding errs by less, out to a kilometre.
const ROOM_M: f32 = 1e-3;

/// The rays of a link at a step; plan coordinates are from the access point.
#[derive(Debug, Clone, Default)]
pub(super) struct Rays {
    pub(super) start_m: DVec3,
    /// By sample: where the ray ends; its height is the site's.
    pub(super) end_m: [Vec<f32>; 3],
    /// By sample: the unit vector to the end in plan view, and how far it is.
    to: [Vec<f32>; 2],
    length_m: Vec<f32>,
}

impl Rays {
    /// From an access point to the UE of `person` in some words of samples. Where the UE is off the axis, the person's gait
    /// is known.
    #[inline(always)]
    pub(super) fn aim(
        &mut self,
        ap_m: DVec3,
        ue: &Ue,
        person: &Trajectories,
        step: usize,
        words: Range<usize>,
    ) {
        self.start_m = ap_m;
        let [base_x, base_y] = self.to_mean_m(person, step);
        let of_step = step * (person.samples / WORD);
        let (height_share, floor_m) = (ue.height_share as f32, person.floor_m[step] as f32);
        let [end_x, end_y, end_z] = &mut self.end_m;
        let [to_x, to_y] = &mut self.to;
        for of in [&mut *end_x, end_y, end_z, to_x, to_y, &mut self.length_m] {
            of.resize(person.samples, 0.0);
        }
        for word in words {
            let (off_x, off_y) =
                (word_of(&person.off_m[0], of_step + word), word_of(&person.off_m[1], of_step + word));
            let (end_x, end_y) = (word_of_mut(end_x, word), word_of_mut(end_y, word));
            for k in 0..WORD {
                (end_x[k], end_y[k]) = (base_x + off_x[k], base_y + off_y[k]);
            }
            if !ue.is_on_axis() {
                let [forward_m, left_m] = [0, 1].map(|i| word_of(&person.device_m[i], word));
                let [own_x, own_y] = [0, 1].map(|i| word_of(&person.gait.own[i], of_step + word));
                for k in 0..WORD {
                    end_x[k] += forward_m[k] * own_x[k] - left_m[k] * own_y[k];
                    end_y[k] += forward_m[k] * own_y[k] + left_m[k] * own_x[k];
                }
            }
            const LEVEL: [f32; WORD] = [0.0; WORD];
            let up_m = if ue.is_on_axis() { &LEVEL } else { word_of(&person.device_m[2], word) };
            let (end_z, height_m) = (word_of_mut(end_z, word), word_of(&person.height_m, word));
            let (to_x, to_y) = (word_of_mut(to_x, word), word_of_mut(to_y, word));
            let length_m = word_of_mut(&mut self.length_m, word);
            for k in 0..WORD {
                end_z[k] = height_share * height_m[k] + floor_m + up_m[k];
                let length = (end_x[k] * end_x[k] + end_y[k] * end_y[k]).sqrt();
                let per = 1.0 / larger(length, 1e-6);
                (to_x[k], to_y[k], length_m[k]) = (end_x[k] * per, end_y[k] * per, length);
            }
        }
    }

    /// From the access point to the mean round which a person's samples lie at a step.
    #[inline(always)]
    pub(super) fn to_mean_m(&self, person: &Trajectories, step: usize) -> [f32; 2] {
        (person.mean_m[step] - self.start_m.truncate()).to_array().map(|m| m as f32)
    }

    /// What of a word of samples, of those whose bits are set in `open`, is known of the body of `other`, whose gait is known,
    /// without asking height by height.
    #[inline(always)]
    pub(super) fn near(
        &self,
        figure: &Figure,
        meeting: &Meeting,
        other: &Trajectories,
        word: usize,
        open: u32,
    ) -> Near {
        let step = meeting.step as usize;
        let of_step = step * (other.samples / WORD) + word;
        let gait = &other.gait;
        let from_above = FromAbove {
            base_m: self.to_mean_m(other, step),
            reach_m: meeting.reach_m + ROOM_M,
            plan: &figure.plans[meeting.plan as usize],
            swings: other.swings.map(|swing| swing as f32),
            holds: meeting.holds,
            axis_m: [word_of(&gait.axis_m[0], of_step), word_of(&gait.axis_m[1], of_step)],
            own: [word_of(&gait.own[0], of_step), word_of(&gait.own[1], of_step)],
            wave_hz: word_of(&gait.wave_hz, of_step),
            swing_hz: word_of(&gait.swing_hz, word),
            height_m: word_of(&other.height_m, word),
            width: word_of(&other.width_scale, word),
            to: [word_of(&self.to[0], word), word_of(&self.to[1], word)],
            length_m: word_of(&self.length_m, word),
        };
        from_above.near(open)
    }
}

/// Samples of a word in which the trunk or an arm may meet the ray, and those in which the trunk does for sure.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Near {
    pub(super) trunk: u32,
    pub(super) arms: u32,
    pub(super) surely: u32,
}

/// What [`Rays::near`] looks at: a word of samples.
struct FromAbove<'a> {
    base_m: [f32; 2],
    reach_m: f32,
    plan: &'a Plan,
    /// Factors on how far the arms swing, right and left.
    swings: [f32; 2],
    holds: bool,
    axis_m: [&'a [f32; WORD]; 2],
    own: [&'a [f32; WORD]; 2],
    wave_hz: &'a [f32; WORD],
    swing_hz: &'a [f32; WORD],
    height_m: &'a [f32; WORD],
    width: &'a [f32; WORD],
    to: [&'a [f32; WORD]; 2],
    length_m: &'a [f32; WORD],
}

impl FromAbove<'_> {
    #[inline(always)]
    fn near(&self, open: u32) -> Near {
        // How far to the left of the ray the swaying axis is, and how far before its start or behind its end.
        let (mut axis, mut beyond, mut within) = ([0.0; WORD], [0.0; WORD], [0.0; WORD]);
        let ([to_x, to_y], [base_x, base_y]) = (self.to, self.base_m);
        for k in 0..WORD {
            let (x, y) = (base_x + self.axis_m[0][k], base_y + self.axis_m[1][k]);
            let along = to_x[k] * x + to_y[k] * y;
            axis[k] = to_x[k] * y - to_y[k] * x;
            beyond[k] = larger(along - self.length_m[k], -along);
            within[k] = self.reach_m - larger(axis[k].abs(), beyond[k]);
        }
        let open = open & bits_of(&within);
        if open == 0 {
            return Near::default();
        }
        // Across the ray, to the left: what a step ahead and one aside are.
        let (mut ahead, mut aside) = ([0.0; WORD], [0.0; WORD]);
        let [own_x, own_y] = self.own;
        for k in 0..WORD {
            ahead[k] = to_x[k] * own_y[k] - to_y[k] * own_x[k];
            aside[k] = to_x[k] * own_x[k] + to_y[k] * own_y[k];
        }
        let (trunk, surely) = self.trunk(&axis, &beyond, &ahead, &aside);
        let (surely, left) = (surely & open, open & !surely);
        let asks_arms = self.plan.radius > 0.0 && left != 0;
        let arms = if asks_arms { self.arms(&axis, &within, &ahead, &aside) } else { 0 };
        Near { trunk: trunk & left, arms: arms & left, surely }
    }

    /// The ray cuts an ellipse where its middle is nearer than the ellipse reaches; ellipses whose middles are apart along
    /// one half axis all hold one that is smaller by that share of the half axis.
    #[inline(always)]
    fn trunk(
        &self,
        axis: &[f32; WORD],
        beyond: &[f32; WORD],
        ahead: &[f32; WORD],
        aside: &[f32; WORD],
    ) -> (u32, u32) {
        let (plan, mut near, mut off) = (self.plan, [0.0; WORD], [0.0; WORD]);
        let reach = |half: [f32; 2], k: usize| {
            let (depth, side) = (half[0] * ahead[k], half[1] * aside[k]);
            (depth * depth + side * side).sqrt()
        };
        for k in 0..WORD {
            let height_m = self.height_m[k];
            off[k] = (axis[k] + height_m * (ahead[k] * plan.ahead + aside[k] * plan.left)).abs();
            let apart = plan.ahead_by * ahead[k].abs() + plan.left_by * aside[k].abs();
            let around = self.width[k] * reach(plan.around, k) + apart;
            near[k] = smaller(height_m * around - off[k] + ROOM_M, self.reach_m - beyond[k]);
        }
        let near = bits_of(&near);
        if near == 0 || !self.holds {
            return (near, 0);
        }
        let mut sure = [0.0; WORD];
        let smaller_by = plan.ahead_by / plan.within[0] + plan.left_by / plan.within[1];
        for k in 0..WORD {
            let within = (self.width[k] - smaller_by) * reach(plan.within, k);
            sure[k] = smaller(self.height_m[k] * within - off[k] - ROOM_M, -self.reach_m - beyond[k]);
        }
        (near, bits_of(&sure))
    }

    /// An arm is near where the ray passes between its ends.
    #[inline(always)]
    fn arms(
        &self,
        axis: &[f32; WORD],
        within: &[f32; WORD],
        ahead: &[f32; WORD],
        aside: &[f32; WORD],
    ) -> u32 {
        let (plan, mut near) = (self.plan, [0.0; WORD]);
        for k in 0..WORD {
            let height_m = self.height_m[k];
            let arm = |side: f32| {
                let end = |[fixed, swings, right, left]: [f32; 4]| {
                    let i = usize::from(side > 0.0);
                    let (out, swing) = ([right, left][i], self.swings[i]);
                    let forward = swing * (fixed * self.swing_hz[k] + swings * side * self.wave_hz[k]);
                    ahead[k] * forward + aside[k] * side * out
                };
                let [a, b, c] = [end(plan.joints[0]), end(plan.joints[1]), end(plan.joints[2])];
                let (most, least) = (larger(larger(a, b), c), smaller(smaller(a, b), c));
                smaller(axis[k] + height_m * most, -axis[k] - height_m * least)
            };
            let room_m = plan.radius * self.width[k] * height_m + larger(arm(1.0), arm(-1.0)) + ROOM_M;
            near[k] = smaller(room_m, within[k]);
        }
        bits_of(&near)
    }
}
