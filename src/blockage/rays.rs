//! The rays of one link at one step, a sample each, and which samples of a body come near them: in single precision with
//! room to spare, so that only those are asked exactly ([`super::crossing`]) that may meet.

use super::figure::{Band, Figure, Plan};
use super::trajectories::Trajectories;
use crate::gait::{FOREMOST_RAD, LEFTMOST_RAD};
use crate::geometry::{DVec2, DVec3};
use crate::site::Ue;

/// Bits of a word of samples.
pub(super) const WORD: usize = 64;
/// Single precision errs by less, out to a kilometre.
const ROOM_M: f32 = 1e-3;

/// The rays of a link at a step.
#[derive(Debug, Clone, Default)]
pub(super) struct Rays {
    pub(super) start_m: DVec3,
    /// By sample: where the ray ends.
    pub(super) end_m: [Vec<f64>; 3],
    /// By sample: the unit vector to the end in plan view, and how far it is.
    to: [Vec<f32>; 2],
    length_m: Vec<f32>,
}

impl Rays {
    /// From an access point to the UE of `person` in every sample.
    pub(super) fn aim(&mut self, ap_m: DVec3, ue: &Ue, person: &Trajectories, step: usize, samples: usize) {
        self.start_m = ap_m;
        let row = step * person.samples..step * person.samples + samples;
        let (x_m, y_m) = (&person.x_m[row.clone()], &person.y_m[row]);
        let [end_x, end_y, end_z] = &mut self.end_m;
        if ue.forward_m == 0.0 && ue.left_m == 0.0 {
            end_x.clear();
            end_x.extend_from_slice(x_m);
            end_y.clear();
            end_y.extend_from_slice(y_m);
        } else {
            end_x.resize(samples, 0.0);
            end_y.resize(samples, 0.0);
            for k in 0..samples {
                let heading_rad = person.ahead[step].to_angle() + person.turn_rad[k];
                let end_m = ue.on_body(DVec2::new(x_m[k], y_m[k]), heading_rad, 0.0);
                (end_x[k], end_y[k]) = (end_m.x, end_m.y);
            }
        }
        end_z.clear();
        end_z.extend(person.height_m[..samples].iter().map(|height_m| ue.height_share * height_m));
        let [to_x, to_y] = &mut self.to;
        [&mut *to_x, to_y, &mut self.length_m].into_iter().for_each(|of| of.resize(samples, 0.0));
        let (to_x, to_y, length_m) =
            (&mut to_x[..samples], &mut to_y[..samples], &mut self.length_m[..samples]);
        let (end_x, end_y) = (&end_x[..samples], &end_y[..samples]);
        for k in 0..samples {
            let (x, y) = ((end_x[k] - ap_m.x) as f32, (end_y[k] - ap_m.y) as f32);
            let length = (x * x + y * y).sqrt();
            let per = 1.0 / if length > 1e-6 { length } else { 1e-6 };
            (to_x[k], to_y[k], length_m[k]) = (x * per, y * per, length);
        }
    }

    /// What of a word of samples is known of the body of `other`, whose gait is known, without asking exactly.
    pub(super) fn near(
        &self,
        figure: &Figure,
        other: &Trajectories,
        step: usize,
        word: usize,
        band: Band,
    ) -> Near {
        let samples = self.length_m.len();
        let of = word * WORD..samples.min((word + 1) * WORD);
        let row = step * other.samples + of.start..step * other.samples + of.end;
        let base = other.discs[step].center_m - self.start_m.truncate();
        let rough = &other.gait.rough;
        let from_above = FromAbove {
            base_m: [base.x as f32, base.y as f32],
            reach_m: other.reach_m as f32 + ROOM_M,
            ahead: [other.ahead[step].x as f32, other.ahead[step].y as f32],
            plan: figure.plan(band),
            off_m: [&other.off_x_m[row.clone()], &other.off_y_m[row.clone()]],
            turn: [&rough.turn[0][of.clone()], &rough.turn[1][of.clone()]],
            phase: [&rough.phase[0][row.clone()], &rough.phase[1][row]],
            height_m: &rough.height_m[of.clone()],
            width: &rough.width[of.clone()],
            sway: &rough.sway[of.clone()],
            swing: &rough.swing[of.clone()],
            to: [&self.to[0][of.clone()], &self.to[1][of.clone()]],
            length_m: &self.length_m[of],
        };
        from_above.near_widely()
    }
}

/// Samples of a word in which a body may meet the ray, and those of them in which it does for sure.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    pub(super) maybe: u64,
    pub(super) surely: u64,
}

/// What [`Rays::near`] looks at: a word of samples.
struct FromAbove<'a> {
    base_m: [f32; 2],
    reach_m: f32,
    ahead: [f32; 2],
    plan: Plan,
    off_m: [&'a [f32]; 2],
    turn: [&'a [f32]; 2],
    phase: [&'a [f32]; 2],
    height_m: &'a [f32],
    width: &'a [f32],
    sway: &'a [f32],
    swing: &'a [f32],
    to: [&'a [f32]; 2],
    length_m: &'a [f32],
}

impl FromAbove<'_> {
    /// [`FromAbove::near`], once more for processors with wider registers; both give the same bits.
    fn near_widely(&self) -> Near {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has just said that it has what the function was compiled for.
            return unsafe { self.near_avx2() };
        }
        self.near()
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn near_avx2(&self) -> Near {
        self.near()
    }

    #[inline(always)]
    fn near(&self) -> Near {
        let n = self.length_m.len().min(WORD);
        let (off_x, off_y) = (&self.off_m[0][..n], &self.off_m[1][..n]);
        let (to_x, to_y, length_m) = (&self.to[0][..n], &self.to[1][..n], &self.length_m[..n]);
        let (turn_x, turn_y) = (&self.turn[0][..n], &self.turn[1][..n]);
        let (phase_x, phase_y) = (&self.phase[0][..n], &self.phase[1][..n]);
        let (height_m, width) = (&self.height_m[..n], &self.width[..n]);
        let (sway, swing) = (&self.sway[..n], &self.swing[..n]);
        let (mut room, mut sure) = ([-1.0_f32; WORD], [-1.0_f32; WORD]);
        let ([base_x, base_y], [ahead_x, ahead_y], plan) = (self.base_m, self.ahead, &self.plan);
        let [leftmost, foremost] = [LEFTMOST_RAD, FOREMOST_RAD].map(|at| [at.cos() as f32, at.sin() as f32]);
        let per_depth = plan.ahead_by / if plan.within[0] > 0.0 { plan.within[0] } else { 1.0 };
        for k in 0..n {
            let (x, y) = (base_x + off_x[k], base_y + off_y[k]);
            let along = to_x[k] * x + to_y[k] * y;
            let beyond = larger(along - length_m[k], -along);
            let own_x = ahead_x * turn_x[k] - ahead_y * turn_y[k];
            let own_y = ahead_y * turn_x[k] + ahead_x * turn_y[k];
            // Across the ray, to the left: what a step ahead and one aside are, and where the swaying axis is, in heights.
            let (ahead, aside) = (to_x[k] * own_y - to_y[k] * own_x, to_x[k] * own_x + to_y[k] * own_y);
            let from_foremost = phase_x[k] * foremost[0] + phase_y[k] * foremost[1];
            let sway_ahead = plan.sway[0] * sway[k] * (2.0 * from_foremost * from_foremost - 1.0);
            let sway_left = plan.sway[1] * sway[k] * (phase_x[k] * leftmost[0] + phase_y[k] * leftmost[1]);
            let per_m = 1.0 / height_m[k];
            let room_own = ROOM_M * per_m;
            let axis = (to_x[k] * y - to_y[k] * x) * per_m + ahead * sway_ahead + aside * sway_left;
            // The ray cuts an ellipse where its middle is nearer than the ellipse reaches; ellipses whose middles are apart
            // along one half axis all hold one that is smaller by that share of the half axis.
            let off = (axis + ahead * plan.ahead).abs();
            let reach = |half: [f32; 2]| {
                let (depth, side) = (half[0] * ahead, half[1] * aside);
                (depth * depth + side * side).sqrt()
            };
            let trunk = width[k] * reach(plan.around) + plan.ahead_by * ahead.abs() - off;
            let core = (width[k] - per_depth) * reach(plan.within) - off;
            // An arm is near where the ray passes between its ends.
            let wave = phase_x[k];
            let arm = |side: f32| {
                let end = |[fixed, swings, out]: [f32; 3]| {
                    axis + ahead * swing[k] * (fixed + swings * side * wave) + aside * side * out
                };
                let [a, b, c] = [end(plan.joints[0]), end(plan.joints[1]), end(plan.joints[2])];
                plan.radius * width[k] + smaller(larger(larger(a, b), c), -smaller(smaller(a, b), c))
            };
            let near = larger(trunk, larger(arm(1.0), arm(-1.0))) + room_own;
            let beyond = (self.reach_m - beyond, -self.reach_m - beyond);
            room[k] = smaller(near, beyond.0);
            sure[k] = smaller(core - room_own, beyond.1);
        }
        Near { maybe: bits_of(&room), surely: bits_of(&sure) }
    }
}

/// A bit for each number that is not negative.
#[inline(always)]
fn bits_of(numbers: &[f32; WORD]) -> u64 {
    let mut bits = 0;
    for (byte, eight) in numbers.chunks_exact(8).enumerate() {
        let mut eight_bits = 0_u8;
        for (i, number) in eight.iter().enumerate() {
            eight_bits |= u8::from(*number >= 0.0) << i;
        }
        bits |= u64::from(eight_bits) << (8 * byte);
    }
    bits
}

#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
