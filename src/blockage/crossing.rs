//! Tests the samples in which a body comes near its ray. It asks what [`super::body::blocks`] asks of one ray, in
//! loops over samples and in single precision. If a ray passes within 0.1 mm of touching a body, the two answers may
//! differ.

use std::ops::Range;

use super::body_model::Slice;
use super::figure::{Band, Figure, Joint, Rod};
use super::lanes::{WORD, bits_of, larger, smaller, word_of};
use super::rays::Rays;
use super::shadows::Meeting;
use super::trajectories::Trajectories;

/// A rise that is none, as a share of a body's height over the whole ray.
const LEVEL: f32 = 1e-12;
/// Loops run over whole registers; what the lanes beyond the last sample hold does no harm.
const REGISTER: usize = 8;

type Lane = [f32; WORD];

/// Up to a word of samples, from any of a body's words, each in the body's own frame: shares of its height, from its swaying
/// axis, x ahead and y to the left.
#[derive(Debug, Clone, Default)]
pub(super) struct Crossing {
    /// The numbers of those that were taken, and of which of them the trunk and the arms are asked, a bit each.
    samples: [u32; WORD],
    taken: usize,
    asks: [u32; 2],
    /// Where the body's swaying axis is, which way it faces, and where the ray ends, then what is worked out of it.
    axis: [Lane; 2],
    own: [Lane; 2],
    end: [Lane; 3],
    start_z: f32,
    height: Lane,
    width: Lane,
    swing: Lane,
    wave: Lane,
    from: [Lane; 3],
    along: [Lane; 3],
    /// How far the ray misses the body, in no unit: touching is 0.
    miss: Lane,
}

impl Crossing {
    /// Adds to `blocked` those samples in some words whose ray the trunk meets, of the samples in `trunk`, bits, and those whose
    /// ray an arm meets, of the samples in `arms`.
    #[inline(always)]
    pub(super) fn ask(
        &mut self,
        figure: &Figure,
        rays: &Rays,
        meeting: &Meeting,
        other: &Trajectories,
        words: Range<usize>,
        [trunk, arms]: [&[u32]; 2],
        blocked: &mut [u32],
    ) {
        let step = meeting.step as usize;
        let base_m = rays.to_mean_m(other, step);
        // Heights are from the floor that the body stands on.
        let (gait, floor_m) = (&other.gait, other.floor_m[step]);
        self.start_z = (rays.start_m.z - floor_m) as f32;
        for word in words {
            let (trunk, arms) = (trunk[word], arms[word]);
            let mut left = trunk | arms;
            if left == 0 {
                continue;
            }
            let of_step = step * (other.samples / WORD) + word;
            let axis_m = [0, 1].map(|i| word_of(&gait.axis_m[i], of_step));
            let own = [0, 1].map(|i| word_of(&gait.own[i], of_step));
            let end_m = [0, 1, 2].map(|i| word_of(&rays.end_m[i], word));
            let (height_m, width) = (word_of(&other.height_m, word), word_of(&other.width_scale, word));
            let (swing_hz, wave_hz) = (word_of(&gait.swing_hz, word), word_of(&gait.wave_hz, of_step));
            while left != 0 {
                // Both are below anyway: so nothing is asked of the arrays' ends.
                let (k, lane) = (left.trailing_zeros() as usize % WORD, self.taken % WORD);
                left &= left - 1;
                for i in 0..2 {
                    self.axis[i][lane] = base_m[i] + axis_m[i][k];
                    self.own[i][lane] = own[i][k];
                }
                for i in 0..3 {
                    self.end[i][lane] = end_m[i][k];
                }
                self.end[2][lane] -= floor_m as f32;
                (self.height[lane], self.width[lane]) = (height_m[k], width[k]);
                (self.swing[lane], self.wave[lane]) = (swing_hz[k], wave_hz[k]);
                self.samples[lane] = (word * WORD + k) as u32;
                for (asks, bits) in self.asks.iter_mut().zip([trunk, arms]) {
                    *asks |= (bits >> k & 1) << lane;
                }
                self.taken += 1;
                if self.taken == WORD {
                    self.answer(figure, other.swings, meeting.band, blocked);
                }
            }
        }
        self.answer(figure, other.swings, meeting.band, blocked);
    }

    /// Asks those that were taken.
    #[inline(always)]
    fn answer(&mut self, figure: &Figure, swings: [f64; 2], band: Band, blocked: &mut [u32]) {
        if self.taken == 0 {
            return;
        }
        self.turn_to_body();
        let [trunk, arms] = std::mem::take(&mut self.asks);
        let mut met = if trunk != 0 { trunk & self.cross_trunk(figure, band) } else { 0 };
        if arms & !met != 0 {
            met |= arms & self.cross_arms(figure, swings, band);
        }
        while met != 0 {
            let sample = self.samples[met.trailing_zeros() as usize % WORD] as usize;
            met &= met - 1;
            blocked[sample / WORD] |= 1 << (sample % WORD);
        }
        self.taken = 0;
    }

    #[inline(always)]
    fn cross_trunk(&mut self, figure: &Figure, band: Band) -> u32 {
        self.miss = [f32::INFINITY; WORD];
        let mut bottom = 0.0;
        for slice in &figure.slices {
            if band.meets(bottom, slice.top) {
                self.cross_slice(slice, bottom as f32);
            }
            bottom = slice.top;
        }
        self.met()
    }

    #[inline(always)]
    fn cross_arms(&mut self, figure: &Figure, swings: [f64; 2], band: Band) -> u32 {
        self.miss = [f32::INFINITY; WORD];
        for rod in figure.rods.iter().filter(|rod| rod.is_within(band)) {
            self.cross_rod(rod, swings, -1.0);
            self.cross_rod(rod, swings, 1.0);
        }
        self.met()
    }

    /// A bit for each ray that does not miss.
    #[inline(always)]
    fn met(&self) -> u32 {
        let mut met = [0.0; WORD];
        for k in 0..WORD {
            met[k] = -self.miss[k];
        }
        bits_of(&met)
    }

    /// How many lanes are in use, up to whole registers.
    #[inline(always)]
    fn lanes(&self) -> usize {
        self.taken.next_multiple_of(REGISTER).min(WORD)
    }

    #[inline(always)]
    fn turn_to_body(&mut self) {
        let start_z = self.start_z;
        for register in 0..self.lanes() / REGISTER {
            let of = |lane: &Lane| lane.as_chunks::<REGISTER>().0[register];
            let (height, [own_x, own_y]) = (of(&self.height), self.own.each_ref().map(of));
            let ([axis_x, axis_y], [end_x, end_y, end_z]) =
                (self.axis.each_ref().map(of), self.end.each_ref().map(of));
            let (mut from, mut along) = ([[0.0; REGISTER]; 3], [[0.0; REGISTER]; 3]);
            for i in 0..REGISTER {
                let share = 1.0 / height[i];
                from[0][i] = -(own_x[i] * axis_x[i] + own_y[i] * axis_y[i]) * share;
                from[1][i] = (own_y[i] * axis_x[i] - own_x[i] * axis_y[i]) * share;
                from[2][i] = start_z * share;
                along[0][i] = (own_x[i] * end_x[i] + own_y[i] * end_y[i]) * share;
                along[1][i] = (own_x[i] * end_y[i] - own_y[i] * end_x[i]) * share;
                along[2][i] = (end_z[i] - start_z) * share;
            }
            for i in 0..3 {
                self.from[i].as_chunks_mut::<REGISTER>().0[register] = from[i];
                self.along[i].as_chunks_mut::<REGISTER>().0[register] = along[i];
            }
        }
    }

    /// The ray at the height of a slice against its ellipse: in the space where that is the unit circle, the ray comes
    /// nearest at `nearest` and is inside where `|s + t d|^2 <= 1`.
    #[inline(always)]
    fn cross_slice(&mut self, slice: &Slice, bottom: f32) {
        let [top, ahead, left] = [slice.top, slice.ahead, slice.left].map(|share| share as f32);
        let [depth, side] = [1.0 / slice.half_depth as f32, 1.0 / slice.half_width as f32];
        for i in 0..self.lanes() {
            // A level ray is taken to rise by next to nothing.
            let up = self.along[2][i];
            let per_up = 1.0 / if up.abs() < LEVEL { LEVEL } else { up };
            let (a, b) = ((bottom - self.from[2][i]) * per_up, (top - self.from[2][i]) * per_up);
            let (enter, leave) = (larger(smaller(a, b), 0.0), smaller(larger(a, b), 1.0));
            let width = 1.0 / self.width[i];
            let (per_depth, per_width) = (width * depth, width * side);
            let (sx, sy) = ((self.from[0][i] - ahead) * per_depth, (self.from[1][i] - left) * per_width);
            let (dx, dy) = (self.along[0][i] * per_depth, self.along[1][i] * per_width);
            let squared = larger(dx * dx + dy * dy, f32::MIN_POSITIVE);
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
    fn cross_rod(&mut self, rod: &Rod, swings: [f64; 2], side: f32) {
        let numbers = |joint: &Joint| {
            let (i, side) = (usize::from(side > 0.0), f64::from(side));
            [swings[i] * joint.ahead, swings[i] * joint.swing * side, joint.out[i] * side, joint.up]
                .map(|x| x as f32)
        };
        let (upper, lower, radius) = (numbers(&rod.upper), numbers(&rod.lower), rod.radius as f32);
        for i in 0..self.lanes() {
            let ahead = |joint: [f32; 4]| self.swing[i] * joint[0] + self.wave[i] * joint[1];
            let (upper_ahead, lower_ahead) = (ahead(upper), ahead(lower));
            let d = [self.along[0][i], self.along[1][i], self.along[2][i]];
            let e = [lower_ahead - upper_ahead, lower[2] - upper[2], lower[3] - upper[3]];
            let r = [self.from[0][i] - upper_ahead, self.from[1][i] - upper[2], self.from[2][i] - upper[3]];
            let squared = nearest_of_segments(r, d, e);
            let width = radius * self.width[i];
            self.miss[i] = smaller(self.miss[i], squared - width * width);
        }
    }
}

/// Square of the smallest distance between the segments p + t d and q + u e, where r = p - q.
#[inline(always)]
fn nearest_of_segments(r: [f32; 3], d: [f32; 3], e: [f32; 3]) -> f32 {
    let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (a, b, c) = (larger(dot(d, d), f32::MIN_POSITIVE), dot(d, e), larger(dot(e, e), f32::MIN_POSITIVE));
    let (f, g) = (dot(d, r), dot(e, r));
    let parallel = a * c - b * b;
    let on_d = if parallel > 0.0 { share((b * g - c * f) / parallel) } else { 0.0 };
    let on_e = share((b * on_d + g) / c);
    let on_d = share((b * on_e - f) / a);
    let apart: [f32; 3] = [
        r[0] + on_d * d[0] - on_e * e[0],
        r[1] + on_d * d[1] - on_e * e[1],
        r[2] + on_d * d[2] - on_e * e[2],
    ];
    dot(apart, apart)
}

#[inline(always)]
fn share(t: f32) -> f32 {
    smaller(larger(t, 0.0), 1.0)
}
