//! A first glance at the bodies that may stand in the way of a link: all steps at once, in single precision. In doubt a body is
//! kept for [`super::shadows`], which looks more closely at it if the link is still open then.

use super::lanes::{bits_of, larger, smaller};
use super::trajectories::{MOMENTS, Trajectories};
use crate::geometry::DVec3;

/// Steps in whole registers; what the lanes beyond the last step hold does no harm.
const LANES: usize = MOMENTS.next_multiple_of(8);
/// Rounding errs by less, out to a kilometre.
const ROOM_M: f64 = 1e-3;

type Steps = [f32; LANES];

/// A body as it looks from an access point, by step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Look {
    /// Where the mean of its samples is, in plan view.
    at_m: [Steps; 2],
    /// No part of a sample's body is farther from there,
    reach_m: Steps,
    /// nor higher above the access point.
    top_m: Steps,
}

/// All rays of a link, by step, as lines from the access point.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Way {
    /// The unit vector along their middle.
    along: [Steps; 2],
    /// Shares of the shortest and of the longest of them in a metre.
    per_m: [Steps; 2],
    /// How far their ends lie from the middle's end, to the left and to the right.
    ends_m: [Steps; 2],
    /// How far the ray that rises least does over its whole length, and how far it falls.
    rise_m: Steps,
    fall_m: Steps,
}

/// Who may be in the way.
pub(super) struct Near {
    /// At which steps, a bit each.
    pub(super) steps: u32,
    /// How far from the middle ray, by step.
    pub(super) off_m: Steps,
}

impl Look {
    pub(super) fn of(p: &Trajectories, ap_m: DVec3) -> Self {
        let mut look = Self::default();
        for step in 0..MOMENTS {
            let at_m = p.mean_m[step] - ap_m.truncate();
            [look.at_m[0][step], look.at_m[1][step]] = at_m.to_array().map(|m| m as f32);
            look.reach_m[step] = (p.reach_m + p.spread[step].radius_m + ROOM_M) as f32;
            look.top_m[step] = (p.floor_m[step] - ap_m.z + p.top * p.heights_m[1] + ROOM_M) as f32;
        }
        look
    }
}

impl Way {
    /// The rays of a step: as [`super::shadows::Bundle`] has them.
    #[inline(always)]
    pub(super) fn set(
        &mut self,
        step: usize,
        along: [f64; 2],
        [shortest_m, longest_m]: [f64; 2],
        ends_m: [f64; 2],
        rise_m: f64,
    ) {
        // What reaches beyond the end of a ray that is as short as rounding may be meets any part of it.
        let per_m = [1.0 / shortest_m.max(ROOM_M), 1.0 / longest_m];
        for i in 0..2 {
            self.along[i][step] = along[i] as f32;
            self.per_m[i][step] = per_m[i] as f32;
            self.ends_m[i][step] = ends_m[i] as f32;
        }
        (self.rise_m[step], self.fall_m[step]) = (rise_m.max(0.0) as f32, (-rise_m).max(0.0) as f32);
    }

    /// At which steps some ray may come near a body.
    #[inline(always)]
    pub(super) fn near(&self, body: &Look) -> Near {
        let (mut way_m, mut off_m) = ([0.0; LANES], [0.0; LANES]);
        let ([x, y], [along_x, along_y]) = (&body.at_m, &self.along);
        for i in 0..LANES {
            way_m[i] = along_x[i] * x[i] + along_y[i] * y[i];
            off_m[i] = along_x[i] * y[i] - along_y[i] * x[i];
        }
        // Between those shares of their length rays may meet it.
        let (mut last_m, mut near, mut far) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let [per_shortest, per_longest] = &self.per_m;
        for i in 0..LANES {
            last_m[i] = way_m[i] + body.reach_m[i];
            near[i] = (way_m[i] - body.reach_m[i]) * per_longest[i];
            far[i] = smaller(last_m[i] * per_shortest[i], 1.0);
        }
        let (mut room, [left_m, right_m]) = ([0.0; LANES], &self.ends_m);
        for i in 0..LANES {
            let aside_m = smaller(far[i] * left_m[i] - off_m[i], far[i] * right_m[i] + off_m[i]);
            let above_m = body.top_m[i] + self.fall_m[i] * far[i] - self.rise_m[i] * larger(near[i], 0.0);
            let within = smaller(last_m[i], 1.0 - near[i]);
            room[i] = smaller(within, smaller(aside_m + body.reach_m[i], above_m));
            off_m[i] = off_m[i].abs();
        }
        Near { steps: bits_of(&room) & ((1 << MOMENTS) - 1), off_m }
    }
}
