//! Kirchhoff's loss of a trunk and a head, worked out for a grid of bodies and paths when a radio is set up. Every sample then looks
//! its own up.

use super::fresnel::integrals_f32;
use super::passage;
use crate::blockage::lanes::{WORD, larger, smaller};
use crate::elementary::ln;

/// The body of [`super::Passage::trunk_and_head`].
pub(super) const TRUNK_M: [f32; 2] = [passage::TRUNK_M[0] as f32, passage::TRUNK_M[1] as f32];
pub(super) const HEAD_M: f32 = passage::HEAD_M as f32;
pub(super) const USUAL_M: f32 = passage::USUAL_M as f32;
pub(super) const SHOULDERS: f32 = passage::SHOULDERS as f32;

/// A number of each sample of a word, for loops in vector registers.
pub(super) type Word = [f32; WORD];

/// A body across a link: of one sample, or of a word of them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Across<T> {
    /// Along the path in plan view, from its ends.
    pub(super) from_tx_m: T,
    pub(super) to_rx_m: T,
    /// The body's axis to the left of the path.
    pub(super) aside_m: T,
    /// The path above the floor that the body stands on, and how much it rises toward the transmitter in a metre.
    pub(super) path_m: T,
    pub(super) slope: T,
    /// How much of the body's depth and of its width lie across the path: sine and cosine between its heading and the path.
    pub(super) depth: T,
    pub(super) width: T,
    pub(super) height_m: T,
    /// How much wider than a usual body: [`super::body::Wave::scale`].
    pub(super) scale: T,
}

/// Losses over a grid: how fine the fringes are (the square of Fresnel's parameter for a metre), half the trunk's width, how far the
/// body's axis is beside the path, and how far the top of its head is above it. Lengths are those of a body of the usual height. The
/// grid leaves out that a head is wider where a person is: this and the grid move a loss by less than a dB, a body's shape by five. Who
/// is much wider than others is held to the widest.
#[derive(Debug, Clone)]
pub(super) struct Table {
    per_wavelength: f32,
    /// Of the first slice, without the bits that tell no slice.
    least_bits: u32,
    slices: Vec<Slice>,
    /// By slice, place beside, place above and width, so that what one look-up reads lies together: [`STEP_DB`] above [`LEAST_DB`].
    losses: Vec<u16>,
}

/// Where the grid of one fineness lies.
#[derive(Debug, Clone, Copy)]
struct Slice {
    lowest_m: f32,
    beside_per_m: f32,
    above_per_m: f32,
}

/// A slice for each quarter of an octave: two bits behind a number's exponent say which.
const SLICE_BITS: u32 = 21;
/// Trunks of thin people from the side, and of wide ones from the front.
const HALF_M: [f32; 2] = [0.1, 0.36];
const WIDTHS: usize = 8;
const PLACES: usize = 32;
/// So far above a path the top of a head may be: then the path passes the trunk alone, unless fringes are so wide that its feet count.
const ABOVE_M: f32 = 0.9;
/// So far beyond an edge, in Fresnel's parameter, a path is as free as any: its loss swings by .4 dB about nothing. Here the grid ends.
pub(super) const CLEAR_NU: f32 = 3.0;
/// What stands nearer to an end of the path cannot be told from who holds it: it costs nothing.
pub(super) const NEAREST_M: f32 = 0.05;
const LEAST_DB: f32 = -4.0;
const STEP_DB: f32 = 1e-3;

/// Kirchhoff's fringes are centimetres wide, and nobody's edge is known so well: powers are averaged over places of the body
/// within 4 cm to either side. Places and weights are those of Gauss and Legendre: even ones would fall in step with a fringe.
const SHIFTS_M: [(f32, f32); 9] = [
    (-0.038_726, 0.040_637),
    (-0.033_441, 0.090_324),
    (-0.024_535, 0.130_305),
    (-0.012_970, 0.156_174),
    (0.0, 0.165_12),
    (0.012_970, 0.156_174),
    (0.024_535, 0.130_305),
    (0.033_441, 0.090_324),
    (0.038_726, 0.040_637),
];

/// Nothing loses more: diffraction round a body, and what comes by other ways, leave at least this.
const LEAST_POWER: f32 = 1e-5;
/// dB from a natural logarithm of a power.
const DB: f32 = 10.0 / std::f32::consts::LN_10;

/// In dB, of a share of the power, as it may be.
#[inline(always)]
pub(super) fn loss_db(power: f32) -> f32 {
    -DB * ln(f64::from(smaller(larger(power, LEAST_POWER), 2.0))) as f32
}

/// Half of what a trunk shows across the path.
#[inline(always)]
pub(super) fn half_trunk_m(scale: f32, depth: f32, width: f32) -> f32 {
    scale * (TRUNK_M[0] * TRUNK_M[0] * depth * depth + TRUNK_M[1] * TRUNK_M[1] * width * width).sqrt()
}

impl Table {
    /// For paths up to so long.
    pub(super) fn new(per_wavelength: f32, longest_m: f32) -> Self {
        // Squares of Fresnel's parameter for a metre, on a child half way along the longest path, and beside an antenna.
        let least = 0.4 * 2.0 * per_wavelength * 4.0 / larger(longest_m, 1.0);
        let most = 2.0 * per_wavelength / NEAREST_M;
        let least_bits = least.to_bits() >> SLICE_BITS;
        let past_bits = (most.to_bits() >> SLICE_BITS).max(least_bits) + 1;
        let mut table = Self { per_wavelength, least_bits, slices: Vec::new(), losses: Vec::new() };
        for bits in least_bits..past_bits {
            // The middle of what falls into the slice.
            table.add(f32::from_bits(bits << SLICE_BITS | 1 << (SLICE_BITS - 1)).sqrt());
        }
        table
    }

    /// A slice more, of this Fresnel's parameter for a metre.
    fn add(&mut self, nu_per_m: f32) {
        let last = (PLACES - 1) as f32;
        let beyond_m = CLEAR_NU / nu_per_m;
        let beside_m = (HALF_M[1] + beyond_m) / last;
        let highest_m = if beyond_m < USUAL_M - ABOVE_M { ABOVE_M } else { USUAL_M };
        let above_m = (highest_m + beyond_m) / last;
        self.slices.push(Slice {
            lowest_m: -beyond_m,
            beside_per_m: 1.0 / beside_m,
            above_per_m: 1.0 / above_m,
        });
        // K(a, b) = C(b) - C(a) - j (S(b) - S(a)): what comes through between two edges, but for a factor.
        let through = |from_m: f32, to_m: f32| {
            let [from, to] = [from_m, to_m].map(|m| integrals_f32(nu_per_m * m));
            [to[0] - from[0], from[1] - to[1]]
        };
        // The trunk ends where the head begins.
        let ups: Vec<[[f32; 2]; 2]> = (0..PLACES)
            .map(|place| {
                let top_m = above_m * place as f32 - beyond_m;
                let shoulders_m = top_m - (1.0 - SHOULDERS) * USUAL_M;
                [through(top_m - USUAL_M, shoulders_m), through(shoulders_m, top_m)]
            })
            .collect();
        let halves_m: [f32; WIDTHS] = std::array::from_fn(|width| {
            HALF_M[0] + (HALF_M[1] - HALF_M[0]) * width as f32 / (WIDTHS - 1) as f32
        });
        for place in 0..PLACES {
            let sides = halves_m.map(|half_m| {
                SHIFTS_M.map(|(shift_m, _)| {
                    let aside_m = beside_m * place as f32 + shift_m;
                    [half_m, HEAD_M].map(|half_m| through(aside_m - half_m, aside_m + half_m))
                })
            });
            for (above, up) in ups.iter().enumerate() {
                // What lies farther out is looked up here: it is free, not on the fringe that happens to be there.
                let is_free = above == 0 || place == PLACES - 1;
                self.losses.extend(sides.iter().map(|sides| {
                    let powers =
                        sides.iter().zip(SHIFTS_M).map(|(side, (_, weight))| weight * passed(side, up));
                    let db = if is_free { 0.0 } else { loss_db(powers.sum()) };
                    ((db - LEAST_DB) / STEP_DB).round() as u16
                }));
            }
        }
    }

    /// What bodies cost, dB; nothing where a sample's bit is not `open`. Between the eight points of the grid about each place: what
    /// looks up runs sample by sample, what works out runs in vector registers.
    #[inline(always)]
    pub(super) fn losses_db(&self, of: &Across<Word>, open: u32) -> Word {
        const OF_PLACE: usize = PLACES * WIDTHS;
        let Across { from_tx_m, to_rx_m, aside_m, path_m, slope, depth, width, height_m, scale } = of;
        let last = self.slices.len() as u32 - 1;
        let mut numbers = [0_u32; WORD];
        let [mut wide, mut beside, mut above] = [[0.0; WORD]; 3];
        for k in 0..WORD {
            let size = height_m[k] / USUAL_M;
            let near = 1.0 / from_tx_m[k] + 1.0 / to_rx_m[k];
            let slant = (1.0 + slope[k] * slope[k]).sqrt();
            let bits = (2.0 * self.per_wavelength * near / slant * size * size).to_bits() >> SLICE_BITS;
            numbers[k] = bits.saturating_sub(self.least_bits).min(last);
            let half_m = half_trunk_m(scale[k] / size, depth[k], width[k]);
            wide[k] = held((half_m - HALF_M[0]) * ((WIDTHS - 1) as f32 / (HALF_M[1] - HALF_M[0])), WIDTHS);
            beside[k] = aside_m[k].abs() / size;
            above[k] = (height_m[k] - path_m[k]) / size;
        }
        let [mut lowest_m, mut beside_per_m, mut above_per_m] = [[0.0; WORD]; 3];
        for k in 0..WORD {
            let slice = &self.slices[numbers[k] as usize];
            lowest_m[k] = slice.lowest_m;
            beside_per_m[k] = slice.beside_per_m;
            above_per_m[k] = slice.above_per_m;
        }
        let mut places = [0_u32; WORD];
        for k in 0..WORD {
            beside[k] = held(beside[k] * beside_per_m[k], PLACES);
            above[k] = held((above[k] - lowest_m[k]) * above_per_m[k], PLACES);
            let (w, b, a) = (wide[k] as i32, beside[k] as i32, above[k] as i32);
            places[k] = (numbers[k] * PLACES as u32 + b as u32) * OF_PLACE as u32
                + a as u32 * WIDTHS as u32
                + w as u32;
            (wide[k], beside[k], above[k]) = (wide[k] - w as f32, beside[k] - b as f32, above[k] - a as f32);
        }
        // Of each place the four pairs of neighbours in width.
        let mut pairs = [[[0_u16; 2]; WORD]; 4];
        for k in 0..WORD {
            let at = places[k] as usize;
            let losses = &self.losses[at..at + OF_PLACE + WIDTHS + 2];
            pairs[0][k] = [losses[0], losses[1]];
            pairs[1][k] = [losses[WIDTHS], losses[WIDTHS + 1]];
            pairs[2][k] = [losses[OF_PLACE], losses[OF_PLACE + 1]];
            pairs[3][k] = [losses[OF_PLACE + WIDTHS], losses[OF_PLACE + WIDTHS + 1]];
        }
        let mut losses_db = [0.0; WORD];
        for k in 0..WORD {
            let near = between(row(pairs[0][k], wide[k]), row(pairs[1][k], wide[k]), above[k]);
            let far = between(row(pairs[2][k], wide[k]), row(pairs[3][k], wide[k]), above[k]);
            let db = LEAST_DB + STEP_DB * between(near, far, beside[k]);
            losses_db[k] = if open >> k & 1 == 1 { db } else { 0.0 };
        }
        losses_db
    }
}

/// A place of the grid, held within its so many points.
#[inline(always)]
fn held(place: f32, count: usize) -> f32 {
    smaller(larger(place, 0.0), (count - 1) as f32 - 1e-3)
}

#[inline(always)]
fn between(from: f32, to: f32, share: f32) -> f32 {
    from + share * (to - from)
}

#[inline(always)]
fn row([from, to]: [u16; 2], share: f32) -> f32 {
    between(f32::from(from), f32::from(to), share)
}

/// |E / E0|^2 = |1 - (j / 2) sum|^2 of a trunk and a head: what comes through beside each times what comes through above.
fn passed(side: &[[f32; 2]; 2], up: &[[f32; 2]; 2]) -> f32 {
    let mut sum = [0.0; 2];
    for (side, up) in side.iter().zip(up) {
        sum[0] += side[0] * up[0] - side[1] * up[1];
        sum[1] += side[0] * up[1] + side[1] * up[0];
    }
    let (re, im) = (1.0 + 0.5 * sum[1], -0.5 * sum[0]);
    re * re + im * im
}
