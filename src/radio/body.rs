//! What one sample of a body costs one sample of a link, fast: the models of [`super::models`] on a body that is a trunk and
//! a head, as wide as they show.

use std::f32::consts::{FRAC_PI_2, PI};

use super::fresnel::integrals_f32;
use super::passage;
use crate::blockage::lanes::{larger, smaller};
use crate::elementary::wide;
use crate::site::{LossModel, Radio};

/// The body of [`super::Passage::trunk_and_head`].
const TRUNK_M: [f32; 2] = [passage::TRUNK_M[0] as f32, passage::TRUNK_M[1] as f32];
const HEAD_M: f32 = passage::HEAD_M as f32;
const USUAL_M: f32 = passage::USUAL_M as f32;
const SHOULDERS: f32 = passage::SHOULDERS as f32;
/// 3GPP TR 38.901: the human that blocks, and the adult of the sensing channel; width and height.
const HUMAN_M: [f32; 2] = [0.3, 1.7];
const ADULT_M: [f32; 2] = [0.5, 1.75];
/// Kirchhoff's fringes are centimetres wide, and nobody's edge is known so well: powers are averaged over places of the body
/// within 4 cm to either side. Places and weights are those of Gauss and Legendre: even ones would fall in step with a fringe.
const PLACES_M: [(f32, f32); 5] = [
    (-0.036_25, 0.118_46),
    (-0.021_54, 0.239_31),
    (0.0, 0.284_44),
    (0.021_54, 0.239_31),
    (0.036_25, 0.118_46),
];
/// So far beyond an edge, in Fresnel's parameter, a path is as free as any: its loss swings by .4 dB about nothing.
const CLEAR_NU: f32 = 3.0;
/// Nothing loses more: diffraction round a body, and what comes by other ways, leave at least this.
const LEAST_POWER: f32 = 1e-5;
/// Nobody holds an antenna nearer to an edge.
const NEAREST_M: f32 = 0.05;

/// A body across a link, of one sample.
#[derive(Debug, Clone, Copy)]
struct Across {
    from_tx_m: f32,
    to_rx_m: f32,
    aside_m: f32,
    path_m: f32,
    slope: f32,
    height_m: f32,
}

/// What is known of a body across a link: how far along the path it is from both ends, in plan view; how far its axis is to the left of
/// the path; how high the path is above the floor that the body stands on, and how much it rises toward the transmitter in a metre; how
/// much of the body's depth and of its width lie across the path, as sine and cosine between its heading and the path; its height; and
/// how much wider it is than a usual body ([`Wave::scale`]).
pub(super) const NUMBERS: usize = 9;

/// Bodies across one link, by sample, each number beside those of others, for loops in vector registers.
#[derive(Debug, Clone, Default)]
pub(super) struct Crossings {
    /// Which power a body takes its share of.
    at: Vec<u32>,
    numbers: [Vec<f32>; NUMBERS],
    passes: Vec<f32>,
}

impl Crossings {
    /// None yet.
    pub(super) fn clear(&mut self) {
        self.at.clear();
        self.numbers.iter_mut().for_each(Vec::clear);
    }

    /// One more body, which takes its share of the power at this place.
    #[inline(always)]
    pub(super) fn push(&mut self, at: usize, across: [f32; NUMBERS]) {
        self.at.push(at as u32);
        self.numbers.iter_mut().zip(across).for_each(|(numbers, number)| numbers.push(number));
    }

    /// Works out the share of the power that passes each body: a trunk and a head, as half widths, bottoms and tops.
    #[inline(always)]
    fn work_out(&mut self, power: impl Fn(&Across, &[[f32; 3]; 2]) -> f32) {
        let count = self.at.len();
        self.passes.clear();
        self.passes.resize(count, 1.0);
        let of = self.numbers.each_ref().map(|numbers| &numbers[..count]);
        for (k, passes) in self.passes.iter_mut().enumerate() {
            let [from_tx_m, to_rx_m, aside_m, path_m, slope, depth, width, height_m, scale] =
                of.map(|n| n[k]);
            let across = Across { from_tx_m, to_rx_m, aside_m, path_m, slope, height_m };
            let shoulders_m = SHOULDERS * height_m;
            let trunk = [half_trunk_m(scale, depth, width), 0.0, shoulders_m];
            let power = power(&across, &[trunk, [HEAD_M * scale, shoulders_m, height_m]]);
            *passes = held(power, from_tx_m, to_rx_m);
        }
    }
}

/// A radio's numbers.
#[derive(Debug, Clone)]
pub(super) struct Wave {
    per_wavelength: f32,
    model: LossModel,
    /// A body loses nothing worth telling when its axis is farther from a path, and when the path is so high above its head.
    pub(super) beside_m: f64,
    pub(super) above_m: f64,
}

/// No trunk that carries nothing reaches farther from its axis, whatever its width scale.
const WIDEST_M: f64 = 0.5;

impl Wave {
    /// Of links up to so long.
    pub(super) fn new(radio: &Radio, longest_m: f64) -> Self {
        let wavelength_m = radio.wavelength_m();
        // The first Fresnel zone half way, sqrt(lambda d / 4): half a zone beyond an edge a path is as free as any.
        let zone_m = 0.5 * (wavelength_m * longest_m).sqrt();
        Self {
            per_wavelength: (1.0 / wavelength_m) as f32,
            model: radio.loss_model,
            beside_m: WIDEST_M + 1.5 * zone_m,
            above_m: 1.5 * zone_m,
        }
    }

    /// How much wider a body is than a usual one.
    #[inline(always)]
    pub(super) fn scale(height_m: f32, width_scale: f32) -> f32 {
        height_m / USUAL_M * width_scale
    }

    /// Whether a body stands so far beside a path that what it costs is not worth telling, whichever way it faces.
    #[inline(always)]
    pub(super) fn is_clear(&self, scale: f32, aside_m: f32, from_tx_m: f32, to_rx_m: f32) -> bool {
        // Beyond the trunk's edge by CLEAR_NU of Fresnel's parameter, sqrt(2 / lambda (1 / d1 + 1 / d2)), squared.
        let beyond_m = aside_m.abs() - larger(TRUNK_M[1], 0.5 * ADULT_M[0]) * scale;
        let lengths_m = from_tx_m + to_rx_m;
        (beyond_m > 0.0)
            & (2.0 * self.per_wavelength * lengths_m * beyond_m * beyond_m
                > CLEAR_NU * CLEAR_NU * from_tx_m * to_rx_m)
    }

    wide! {
        /// Takes from powers what bodies cost.
        pub(super) fn pass(&self, crossings: &mut Crossings, powers: &mut [f32]) = pass_avx2 or pass_portably
    }

    #[inline(always)]
    fn pass_portably(&self, crossings: &mut Crossings, powers: &mut [f32]) {
        let screen = |[width_m, top_m]: [f32; 2]| [[0.5 * width_m, 0.0, top_m]];
        match self.model {
            LossModel::Kirchhoff => self.pass_lanes(crossings),
            LossModel::ModelB => crossings.work_out(|across, _| self.model_b(across, &screen(HUMAN_M))),
            LossModel::ModelBAdult => crossings.work_out(|across, _| self.model_b(across, &screen(ADULT_M))),
            LossModel::ModelBBody => crossings.work_out(|across, body| self.model_b(across, body)),
            LossModel::KnifeEdges => crossings.work_out(|across, body| self.edges(across, body[0][0], None)),
            LossModel::ThreeEdges => {
                crossings.work_out(|across, body| self.edges(across, body[0][0], Some(across.height_m)));
            }
        }
        for (at, passes) in crossings.at.iter().zip(&crossings.passes) {
            powers[*at as usize] *= passes;
        }
    }

    /// Works out Kirchhoff's integral for several bodies at a time. No closure stands between here and the arithmetic: a closure is
    /// not compiled for the wider registers.
    #[inline(always)]
    fn pass_lanes(&self, crossings: &mut Crossings) {
        let Crossings { at, numbers, passes } = crossings;
        let whole = at.len().next_multiple_of(LANES);
        passes.clear();
        passes.resize(whole, 1.0);
        // What fills the last of them is worked out and left.
        numbers.iter_mut().for_each(|numbers| numbers.resize(whole, 1.0));
        for first in (0..whole).step_by(LANES) {
            let mut of = [[0.0; LANES]; NUMBERS];
            for (of, numbers) in of.iter_mut().zip(&*numbers) {
                of.copy_from_slice(&numbers[first..first + LANES]);
            }
            let power = self.kirchhoff(&of);
            for k in 0..LANES {
                passes[first + k] = held(power[k], of[0][k], of[1][k]);
            }
        }
    }

    /// Fresnel's parameter for a metre across the path.
    #[inline(always)]
    fn nu_per_m(&self, across: &Across, slant: f32) -> f32 {
        let near = 1.0 / across.from_tx_m + 1.0 / across.to_rx_m;
        (2.0 * self.per_wavelength * near / slant).sqrt()
    }

    /// Kirchhoff's integral, so many samples at a time: each line is a loop over them.
    #[inline(always)]
    fn kirchhoff(&self, of: &[Lanes; NUMBERS]) -> Lanes {
        let [from_tx_m, to_rx_m, aside_m, path_m, slope, depth, width, height_m, scale] = of;
        let per_m = each(|k| {
            let near = 1.0 / from_tx_m[k] + 1.0 / to_rx_m[k];
            (2.0 * self.per_wavelength * near / (1.0 + slope[k] * slope[k]).sqrt()).sqrt()
        });
        let trunk_m = each(|k| half_trunk_m(scale[k], depth[k], width[k]));
        let head_m = each(|k| HEAD_M * scale[k]);
        // The trunk ends where the head begins.
        let foot = integrals(&each(|k| -per_m[k] * path_m[k]));
        let shoulders = integrals(&each(|k| per_m[k] * (SHOULDERS * height_m[k] - path_m[k])));
        let top = integrals(&each(|k| per_m[k] * (height_m[k] - path_m[k])));
        let up = [between(&foot, &shoulders), between(&shoulders, &top)];
        let mut power = [0.0; LANES];
        for (off_m, weight) in PLACES_M {
            let mut through = [[0.0; LANES]; 2];
            for (half_m, up) in [&trunk_m, &head_m].into_iter().zip(&up) {
                let right = integrals(&each(|k| per_m[k] * (aside_m[k] + off_m - half_m[k])));
                let left = integrals(&each(|k| per_m[k] * (aside_m[k] + off_m + half_m[k])));
                let side = between(&right, &left);
                for k in 0..LANES {
                    through[0][k] += side[0][k] * up[0][k] - side[1][k] * up[1][k];
                    through[1][k] += side[0][k] * up[1][k] + side[1][k] * up[0][k];
                }
            }
            for k in 0..LANES {
                // E / E0 = 1 - (j / 2) times the sum.
                let (re, im) = (1.0 + 0.5 * through[1][k], -0.5 * through[0][k]);
                power[k] += weight * (re * re + im * im);
            }
        }
        power
    }

    #[inline(always)]
    fn model_b<const N: usize>(&self, across: &Across, parts: &[[f32; 3]; N]) -> f32 {
        let slant = slant(across);
        let (tx_m, rx_m) = (across.from_tx_m * slant, across.to_rx_m * slant);
        let detour_m = |off_m: f32| {
            let round = |m: f32| (m * m + off_m * off_m).sqrt() - m;
            round(tx_m) + round(rx_m)
        };
        let f = |edge_m: f32| {
            let root = (PI * self.per_wavelength * larger(detour_m(edge_m), 0.0)).sqrt();
            atan(FRAC_PI_2 * root) / PI
        };
        let sum = |low_m: f32, high_m: f32| {
            let (low, high) = (f(low_m), f(high_m));
            if low_m < 0.0 && high_m > 0.0 { low + high } else { (high - low).abs() }
        };
        let mut share = 0.0;
        for &[half_m, bottom_m, top_m] in parts {
            let widths = sum(across.aside_m - half_m, across.aside_m + half_m);
            share += widths * sum(bottom_m - across.path_m, top_m - across.path_m);
        }
        let left = 1.0 - larger(share, 0.0);
        left * left
    }

    /// Round both sides, and over the top where there is one: powers.
    #[inline(always)]
    fn edges(&self, across: &Across, half_m: f32, top_m: Option<f32>) -> f32 {
        let per_m = self.nu_per_m(across, if top_m.is_some() { slant(across) } else { 1.0 });
        let round = |covered_m: f32| {
            let [c, s] = integrals_f32(per_m * covered_m);
            let (re, im) = (0.5 - c, 0.5 - s);
            0.5 * (re * re + im * im)
        };
        let over = top_m.map_or(0.0, |top_m| round(top_m - across.path_m));
        // Beside the body the sum of powers is that of a free path and of what the far edge adds.
        smaller(round(half_m - across.aside_m) + round(half_m + across.aside_m) + over, 1.0)
    }
}

/// A share of the power as it may be; all of it past a body that stands at an end of the path.
#[inline(always)]
fn held(power: f32, from_tx_m: f32, to_rx_m: f32) -> f32 {
    let is_near = smaller(from_tx_m, to_rx_m) < NEAREST_M;
    if is_near { 1.0 } else { smaller(larger(power, LEAST_POWER), 2.0) }
}

/// So many samples are worked out at a time.
const LANES: usize = 16;
type Lanes = [f32; LANES];

#[inline(always)]
fn each(number: impl Fn(usize) -> f32) -> Lanes {
    let mut all = [0.0; LANES];
    for (k, of) in all.iter_mut().enumerate() {
        *of = number(k);
    }
    all
}

/// C and S.
#[inline(always)]
fn integrals(x: &Lanes) -> [Lanes; 2] {
    let mut all = [[0.0; LANES]; 2];
    for k in 0..LANES {
        let [c, s] = integrals_f32(x[k]);
        (all[0][k], all[1][k]) = (c, s);
    }
    all
}

/// K(a, b) = C(b) - C(a) - j (S(b) - S(a)) of the integrals at a and b: what comes through between two edges, but for a factor.
#[inline(always)]
fn between(a: &[Lanes; 2], b: &[Lanes; 2]) -> [Lanes; 2] {
    [each(|k| b[0][k] - a[0][k]), each(|k| a[1][k] - b[1][k])]
}

/// Half of what a trunk shows across the path.
#[inline(always)]
fn half_trunk_m(scale: f32, depth: f32, width: f32) -> f32 {
    scale * (TRUNK_M[0] * TRUNK_M[0] * depth * depth + TRUNK_M[1] * TRUNK_M[1] * width * width).sqrt()
}

#[inline(always)]
fn slant(across: &Across) -> f32 {
    (1.0 + across.slope * across.slope).sqrt()
}

/// The angle whose tangent a number from 0 on is, to 1e-5: a polynomial of Abramowitz and Stegun, 4.4.49, which runs alike on
/// every machine.
#[inline(always)]
fn atan(x: f32) -> f32 {
    let (small, folded) = (x <= 1.0, if x <= 1.0 { x } else { 1.0 / x });
    let square = folded * folded;
    let poly = 0.999_866
        + square * (-0.330_299_5 + square * (0.180_141 + square * (-0.085_133 + square * 0.020_835_1)));
    let angle = folded * poly;
    if small { angle } else { FRAC_PI_2 - angle }
}

#[cfg(test)]
#[path = "body_tests.rs"]
mod tests;
