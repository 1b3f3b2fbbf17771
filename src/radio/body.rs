//! What one sample of a body costs one sample of a link, fast: the models of [`super::models`] on a body that is a trunk and
//! a head, as wide as they show.

use std::f32::consts::{FRAC_PI_2, PI};

use super::passage;
use super::table::Table;
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
pub(super) struct Across {
    /// Along the path in plan view, from its ends.
    pub(super) from_tx_m: f32,
    pub(super) to_rx_m: f32,
    /// The body's axis to the left of the path.
    pub(super) aside_m: f32,
    /// The path above the floor that the body stands on, and how much it rises toward the transmitter in a metre.
    pub(super) path_m: f32,
    pub(super) slope: f32,
    /// How much of the body's depth and of its width lie across the path: sine and cosine between its heading and the path.
    pub(super) turned: [f32; 2],
    pub(super) height_m: f32,
    /// How much wider than a usual body: [`Wave::scale`].
    pub(super) scale: f32,
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
        beyond_m > 0.0
            && 2.0 * self.per_wavelength * lengths_m * beyond_m * beyond_m
                > CLEAR_NU * CLEAR_NU * from_tx_m * to_rx_m
    }

    /// The share of the power that passes.
    #[inline(always)]
    pub(super) fn passing(&self, table: &Table, across: &Across) -> f32 {
        if across.from_tx_m < NEAREST_M || across.to_rx_m < NEAREST_M {
            return 1.0;
        }
        let scale = across.scale;
        let [depth, width] = across.turned;
        let half_m = scale
            * (TRUNK_M[0] * TRUNK_M[0] * depth * depth + TRUNK_M[1] * TRUNK_M[1] * width * width).sqrt();
        let shoulders_m = SHOULDERS * across.height_m;
        let body = [[half_m, 0.0, shoulders_m], [HEAD_M * scale, shoulders_m, across.height_m]];
        let screen = |[width_m, top_m]: [f32; 2]| [[0.5 * width_m, 0.0, top_m]];
        let power = match self.model {
            LossModel::Kirchhoff => self.kirchhoff(table, across, &body),
            LossModel::ModelB => self.model_b(across, &screen(HUMAN_M)),
            LossModel::ModelBAdult => self.model_b(across, &screen(ADULT_M)),
            LossModel::ModelBBody => self.model_b(across, &body),
            LossModel::KnifeEdges => self.edges(table, across, half_m, None),
            LossModel::ThreeEdges => self.edges(table, across, half_m, Some(across.height_m)),
        };
        power.clamp(LEAST_POWER, 2.0)
    }

    /// Fresnel's parameter for a metre across the path.
    #[inline(always)]
    fn nu_per_m(&self, across: &Across, slant: f32) -> f32 {
        let near = 1.0 / across.from_tx_m + 1.0 / across.to_rx_m;
        (2.0 * self.per_wavelength * near / slant).sqrt()
    }

    #[inline(always)]
    fn kirchhoff(&self, table: &Table, across: &Across, parts: &[[f32; 3]; 2]) -> f32 {
        let per_m = self.nu_per_m(across, slant(across));
        let edge = |height_m: f32| table.integrals(per_m * (height_m - across.path_m));
        // The trunk ends where the head begins.
        let [foot, shoulders, top] = [parts[0][1], parts[1][1], parts[1][2]].map(edge);
        let up = [between(foot, shoulders), between(shoulders, top)];
        let mut power = 0.0;
        for (off_m, weight) in PLACES_M {
            let at_m = across.aside_m + off_m;
            let mut through = [0.0; 2];
            for ([half_m, ..], up) in parts.iter().zip(&up) {
                let [right, left] = [at_m - half_m, at_m + half_m].map(|m| table.integrals(per_m * m));
                let side = between(right, left);
                through[0] += side[0] * up[0] - side[1] * up[1];
                through[1] += side[0] * up[1] + side[1] * up[0];
            }
            // E / E0 = 1 - (j / 2) times the sum.
            let (re, im) = (1.0 + 0.5 * through[1], -0.5 * through[0]);
            power += weight * (re * re + im * im);
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
    fn edges(&self, table: &Table, across: &Across, half_m: f32, top_m: Option<f32>) -> f32 {
        let per_m = self.nu_per_m(across, if top_m.is_some() { slant(across) } else { 1.0 });
        let round = |covered_m: f32| {
            let [c, s] = table.integrals(per_m * covered_m);
            let (re, im) = (0.5 - c, 0.5 - s);
            0.5 * (re * re + im * im)
        };
        let over = top_m.map_or(0.0, |top_m| round(top_m - across.path_m));
        // Beside the body the sum of powers is that of a free path and of what the far edge adds.
        smaller(round(half_m - across.aside_m) + round(half_m + across.aside_m) + over, 1.0)
    }
}

/// K(a, b) = C(b) - C(a) - j (S(b) - S(a)) of the integrals at a and b: what comes through between two edges, but for a factor.
#[inline(always)]
fn between([c0, s0]: [f32; 2], [c1, s1]: [f32; 2]) -> [f32; 2] {
    [c1 - c0, s0 - s1]
}

#[inline(always)]
fn slant(across: &Across) -> f32 {
    (1.0 + across.slope * across.slope).sqrt()
}

fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
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
