//! The samples of a word in which a body comes near its ray, asked exactly what [`super::body::blocks`] asks one ray, in
//! loops over samples. Sums stand in another order: where a ray only touches a body, to some 1e-12 of its height, the answer may
//! be another.

use super::body_model::Slice;
use super::figure::{Band, Figure, Joint, Rod};
use super::rays::{Rays, WORD};
use super::trajectories::Trajectories;
use crate::gait::{FOREMOST_RAD, LEFTMOST_RAD};
use crate::geometry::{DVec2, DVec3};

/// A rise that is none, as a share of a body's height over the whole ray.
const LEVEL: f64 = 1e-12;

type Lane = [f64; WORD];

/// Samples of a word in which a body comes near its ray, each in the body's own frame: shares of its height, from its
/// swaying axis, x ahead and y to the left.
#[derive(Debug, Clone)]
pub(super) struct Crossing {
    samples: Vec<u8>,
    /// Where the body and the ray's end are, then what is worked out of it.
    position: [Lane; 2],
    end: [Lane; 3],
    turn: [Lane; 2],
    height: Lane,
    width: Lane,
    sway: Lane,
    swing: Lane,
    phase: [Lane; 2],
    from: [Lane; 3],
    along: [Lane; 3],
    /// How far the ray misses the body, in no unit: touching is 0.
    miss: Lane,
}

impl Default for Crossing {
    fn default() -> Self {
        let [none, one] = [[0.0; WORD], [1.0; WORD]];
        Self {
            samples: Vec::with_capacity(WORD),
            position: [none; 2],
            end: [none; 3],
            turn: [none; 2],
            height: one,
            width: one,
            sway: none,
            swing: none,
            phase: [none; 2],
            from: [none; 3],
            along: [none; 3],
            miss: none,
        }
    }
}

impl Crossing {
    /// Of the samples in `asked`, a word of bits, those whose ray the body meets.
    pub(super) fn blocked(
        &mut self,
        figure: &Figure,
        rays: &Rays,
        other: &Trajectories,
        step: usize,
        word: usize,
        asked: u64,
        band: Band,
    ) -> u64 {
        if asked == 0 {
            return 0;
        }
        self.gather(rays, other, step, word, asked);
        self.cross_widely(figure, rays.start_m, other.ahead[step], band);
        let met = self.samples.iter().zip(&self.miss).filter(|(_, miss)| **miss <= 0.0);
        met.fold(0, |bits, (sample, _)| bits | 1 << sample)
    }

    /// Takes what is asked for out of the arrays of rays and body.
    fn gather(&mut self, rays: &Rays, other: &Trajectories, step: usize, word: usize, asked: u64) {
        self.samples.clear();
        let (row, gait) = (step * other.samples, &other.gait);
        let mut left = asked;
        for lane in 0..WORD {
            if left == 0 {
                break;
            }
            let bit = left.trailing_zeros() as usize;
            left &= left - 1;
            self.samples.push(bit as u8);
            let k = word * WORD + bit;
            let i = row + k;
            (self.position[0][lane], self.position[1][lane]) = (other.x_m[i], other.y_m[i]);
            (self.end[0][lane], self.end[1][lane]) = (rays.end_m[0][k], rays.end_m[1][k]);
            self.end[2][lane] = rays.end_m[2][k];
            (self.turn[0][lane], self.turn[1][lane]) = (gait.turn[0][k], gait.turn[1][k]);
            (self.height[lane], self.width[lane]) = (other.height_m[k], other.width_scale[k]);
            (self.sway[lane], self.swing[lane]) = (gait.sway[k], gait.swing_hz[k]);
            (self.phase[0][lane], self.phase[1][lane]) = (gait.phase[0][i], gait.phase[1][i]);
        }
    }

    /// [`Crossing::cross`], once more for processors with wider registers. No instruction that rounds otherwise is used
    /// (fused multiply-add is another feature), so both give the same bits.
    fn cross_widely(&mut self, figure: &Figure, start_m: DVec3, ahead: DVec2, band: Band) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has just said that it has what the function was compiled for.
            return unsafe { self.cross_avx2(figure, start_m, ahead, band) };
        }
        self.cross(figure, start_m, ahead, band);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn cross_avx2(&mut self, figure: &Figure, start_m: DVec3, ahead: DVec2, band: Band) {
        self.cross(figure, start_m, ahead, band);
    }

    #[inline(always)]
    fn cross(&mut self, figure: &Figure, start_m: DVec3, ahead: DVec2, band: Band) {
        self.turn_to_body(figure, start_m, ahead);
        self.miss = [f64::INFINITY; WORD];
        let mut bottom = 0.0;
        for slice in &figure.slices {
            if band.meets(bottom, slice.top) {
                self.cross_slice(slice, bottom);
            }
            bottom = slice.top;
        }
        if self.miss[..self.lanes()].iter().all(|miss| *miss <= 0.0) {
            return;
        }
        for rod in figure.arms.rods().into_iter().filter(|rod| rod.is_within(band)) {
            self.cross_rod(&rod, -1.0);
            self.cross_rod(&rod, 1.0);
        }
    }

    /// How many lanes are in use.
    #[inline(always)]
    fn lanes(&self) -> usize {
        self.samples.len().min(WORD)
    }

    /// Each ray into the frame of its body, whose trunk rides over the foot that stands, once a stride, and goes ahead
    /// and back with every step.
    #[inline(always)]
    fn turn_to_body(&mut self, figure: &Figure, start_m: DVec3, ahead: DVec2) {
        let n = self.lanes();
        let (leftmost, foremost) = (DVec2::from_angle(LEFTMOST_RAD), DVec2::from_angle(FOREMOST_RAD));
        for i in 0..n {
            let turned_x = ahead.x * self.turn[0][i] - ahead.y * self.turn[1][i];
            let turned_y = ahead.y * self.turn[0][i] + ahead.x * self.turn[1][i];
            let share = 1.0 / self.height[i];
            let (cos, sin) = (self.phase[0][i], self.phase[1][i]);
            let from_foremost = cos * foremost.x + sin * foremost.y;
            let sway_ahead = figure.sway_ahead * self.sway[i] * (2.0 * from_foremost * from_foremost - 1.0);
            let sway_left = figure.sway_left * self.sway[i] * (cos * leftmost.x + sin * leftmost.y);
            let (from_x, from_y) = (start_m.x - self.position[0][i], start_m.y - self.position[1][i]);
            let (along_x, along_y) = (self.end[0][i] - start_m.x, self.end[1][i] - start_m.y);
            self.from[0][i] = (turned_x * from_x + turned_y * from_y) * share - sway_ahead;
            self.from[1][i] = (turned_x * from_y - turned_y * from_x) * share - sway_left;
            self.from[2][i] = start_m.z * share;
            self.along[0][i] = (turned_x * along_x + turned_y * along_y) * share;
            self.along[1][i] = (turned_x * along_y - turned_y * along_x) * share;
            self.along[2][i] = (self.end[2][i] - start_m.z) * share;
        }
    }

    /// The ray at the height of a slice against its ellipse: in the space where that is the unit circle, the ray comes
    /// nearest at `nearest` and is inside where `|s + t d|^2 <= 1`.
    #[inline(always)]
    fn cross_slice(&mut self, slice: &Slice, bottom: f64) {
        let n = self.lanes();
        for i in 0..n {
            // A level ray is taken to rise by next to nothing.
            let up = self.along[2][i];
            let per_up = 1.0 / if up.abs() < LEVEL { LEVEL } else { up };
            let (a, b) = ((bottom - self.from[2][i]) * per_up, (slice.top - self.from[2][i]) * per_up);
            let (enter, leave) = (larger(smaller(a, b), 0.0), smaller(larger(a, b), 1.0));
            let width = 1.0 / self.width[i];
            let (per_depth, per_width) = (width / slice.half_depth, width / slice.half_width);
            let (sx, sy) = ((self.from[0][i] - slice.ahead) * per_depth, self.from[1][i] * per_width);
            let (dx, dy) = (self.along[0][i] * per_depth, self.along[1][i] * per_width);
            let squared = larger(dx * dx + dy * dy, f64::MIN_POSITIVE);
            let nearest = larger(smaller(-(sx * dx + sy * dy) / squared, leave), enter);
            let (x, y) = (sx + nearest * dx, sy + nearest * dy);
            // Where the ray is nowhere at the slice's height, it enters after it leaves.
            let miss = larger(x * x + y * y - 1.0, enter - leave);
            self.miss[i] = smaller(self.miss[i], miss);
        }
    }

    /// The ray against a rod of an arm on the left (`side` 1) or the right. Arms swing against the leg of their side, and
    /// farther ahead than back because the elbow bends.
    #[inline(always)]
    fn cross_rod(&mut self, rod: &Rod, side: f64) {
        let (n, Rod { upper, lower, radius }) = (self.lanes(), rod);
        for i in 0..n {
            let wave = side * self.phase[0][i];
            let ahead = |joint: &Joint| self.swing[i] * (joint.ahead + joint.swing * wave);
            let (upper_ahead, lower_ahead) = (ahead(upper), ahead(lower));
            let d = [self.along[0][i], self.along[1][i], self.along[2][i]];
            let e = [lower_ahead - upper_ahead, side * (lower.out - upper.out), lower.up - upper.up];
            let r = [
                self.from[0][i] - upper_ahead,
                self.from[1][i] - side * upper.out,
                self.from[2][i] - upper.up,
            ];
            let squared = nearest_of_segments(r, d, e);
            let width = radius * self.width[i];
            self.miss[i] = smaller(self.miss[i], squared - width * width);
        }
    }
}

/// Square of the smallest distance between the segments p + t d and q + u e, where r = p - q.
#[inline(always)]
fn nearest_of_segments(r: [f64; 3], d: [f64; 3], e: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (a, b, c) = (larger(dot(d, d), f64::MIN_POSITIVE), dot(d, e), larger(dot(e, e), f64::MIN_POSITIVE));
    let (f, g) = (dot(d, r), dot(e, r));
    let parallel = a * c - b * b;
    let on_d = if parallel > 0.0 { share((b * g - c * f) / parallel) } else { 0.0 };
    let on_e = share((b * on_d + g) / c);
    let on_d = share((b * on_e - f) / a);
    let apart: [f64; 3] = [
        r[0] + on_d * d[0] - on_e * e[0],
        r[1] + on_d * d[1] - on_e * e[1],
        r[2] + on_d * d[2] - on_e * e[2],
    ];
    dot(apart, apart)
}

#[inline(always)]
fn share(t: f64) -> f64 {
    smaller(larger(t, 0.0), 1.0)
}

// `f64::min` and `max` ask for NaN as well, which no lane holds: these are one instruction.

#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
