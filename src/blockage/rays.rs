//! The rays of one link at one step, a sample each, and which samples of a body come near them: in single precision with
//! room to spare, so that only those are asked exactly ([`super::crossing`]) that may meet.

use super::figure::{Band, Extent, Figure};
use super::trajectories::Trajectories;
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
        let plan = Plan {
            base_m: [base.x as f32, base.y as f32],
            reach_m: other.reach_m as f32 + ROOM_M,
            ahead: [other.ahead[step].x as f32, other.ahead[step].y as f32],
            extent: figure.extent(band),
            off_m: [&other.off_x_m[row.clone()], &other.off_y_m[row]],
            turn: [&other.gait.turn[0][of.clone()], &other.gait.turn[1][of.clone()]],
            height_m: &other.height_m[of.clone()],
            width: &other.width_scale[of.clone()],
            swing: &other.gait.swing_hz[of.clone()],
            to: [&self.to[0][of.clone()], &self.to[1][of.clone()]],
            length_m: &self.length_m[of],
        };
        plan.near_widely()
    }
}

/// Samples of a word in which a body may meet the ray, and those of them in which it does for sure.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    pub(super) maybe: u64,
    pub(super) surely: u64,
}

/// What [`Rays::near`] looks at: a word of samples in plan view.
struct Plan<'a> {
    base_m: [f32; 2],
    reach_m: f32,
    ahead: [f32; 2],
    extent: Extent,
    off_m: [&'a [f32]; 2],
    turn: [&'a [f64]; 2],
    height_m: &'a [f64],
    width: &'a [f64],
    swing: &'a [f64],
    to: [&'a [f32]; 2],
    length_m: &'a [f32],
}

impl Plan<'_> {
    /// [`Plan::near`], once more for processors with wider registers; both give the same bits.
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
        let (height_m, width, swing) = (&self.height_m[..n], &self.width[..n], &self.swing[..n]);
        let (mut room, mut sure) = ([-1.0_f32; WORD], [-1.0_f32; WORD]);
        let ([base_x, base_y], [ahead_x, ahead_y], extent) = (self.base_m, self.ahead, &self.extent);
        for k in 0..n {
            let (x, y) = (base_x + off_x[k], base_y + off_y[k]);
            let left_of_ray = to_x[k] * y - to_y[k] * x;
            let along = to_x[k] * x + to_y[k] * y;
            let beyond = larger32(along - length_m[k], -along);
            let (turn_x, turn_y) = (turn_x[k] as f32, turn_y[k] as f32);
            let (own_x, own_y) = (ahead_x * turn_x - ahead_y * turn_y, ahead_y * turn_x + ahead_x * turn_y);
            // How far the body reaches across the ray to either side, from its axis.
            let (across, with) = (to_x[k] * own_y - to_y[k] * own_x, to_x[k] * own_x + to_y[k] * own_y);
            let (h, w, u) = (height_m[k] as f32, width[k] as f32, swing[k] as f32);
            let ahead = extent.depth + extent.depth_per_width * w + extent.ahead_per_swing * u;
            let back = extent.depth + extent.depth_per_width * w + extent.back_per_swing * u;
            let aside = (extent.side + extent.side_per_width * w) * with.abs();
            let left_m = h * (larger32(ahead * across, -back * across) + aside) + ROOM_M;
            let right_m = h * (larger32(back * across, -ahead * across) + aside) + ROOM_M;
            // The ray passes through a slice's ellipse where it is nearer to its middle than the ellipse reaches.
            let (depth, side) = (extent.core[0] * across, extent.core[1] * with);
            let off = extent.core_off[0] * across.abs() + extent.core_off[1] * with.abs();
            let through_m = h * (w * (depth * depth + side * side).sqrt() - off) - ROOM_M;
            sure[k] = smaller32(through_m - left_of_ray.abs(), -self.reach_m - beyond);
            room[k] =
                smaller32(smaller32(left_m + left_of_ray, right_m - left_of_ray), self.reach_m - beyond);
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
fn smaller32(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn larger32(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
