//! What one sample of a body costs one sample of a link, fast: the models of [`super::models`] on a body that is a trunk and
//! a head, as wide as they show.

use std::f32::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use super::fresnel::integrals_f32;
use super::kirchhoff::{
    Across, CLEAR_NU, HEAD_M, NEAREST_M, SHOULDERS, TRUNK_M, Table, USUAL_M, Word, half_trunk_m, loss_db,
};
use crate::blockage::lanes::{WORD, larger, smaller};
use crate::site::{LossModel, Radio};

/// 3GPP TR 38.901: the human that blocks, and the adult of the sensing channel; width and height.
const HUMAN_M: [f32; 2] = [0.3, 1.7];
const ADULT_M: [f32; 2] = [0.5, 1.75];

/// A radio's numbers.
#[derive(Debug, Clone)]
pub(super) struct Wave {
    per_wavelength: f32,
    model: Model,
}

#[derive(Debug, Clone)]
enum Model {
    Kirchhoff(Arc<Table>),
    /// Model B on a screen of this width and height.
    Screen([f32; 2]),
    /// Model B on a trunk and a head.
    Body,
    /// Round both sides.
    KnifeEdges,
    /// And over the top.
    ThreeEdges,
}

impl Wave {
    /// Of links up to so long.
    pub(super) fn new(radio: &Radio, longest_m: f64) -> Self {
        let wavelength_m = radio.wavelength_m();
        let per_wavelength = (1.0 / wavelength_m) as f32;
        let model = match radio.loss_model {
            LossModel::Kirchhoff => Model::Kirchhoff(Arc::new(Table::new(per_wavelength, longest_m as f32))),
            LossModel::ModelB => Model::Screen(HUMAN_M),
            LossModel::ModelBAdult => Model::Screen(ADULT_M),
            LossModel::ModelBBody => Model::Body,
            LossModel::KnifeEdges => Model::KnifeEdges,
            LossModel::ThreeEdges => Model::ThreeEdges,
        };
        Self { per_wavelength, model }
    }

    /// Half of what a body shows of itself at most, whichever way it faces.
    #[inline(always)]
    pub(super) fn half_m(scale: f32) -> f32 {
        larger(TRUNK_M[1], 0.5 * ADULT_M[0]) * scale
    }

    /// So far beyond an edge a body costs nothing that is worth telling, at a place of a path that is so long.
    pub(super) fn zone_m(&self, from_start_m: f64, length_m: f64) -> f64 {
        // Of the table's widest slice; Fresnel's parameter is sqrt(2 / lambda (1 / d1 + 1 / d2)) for a metre.
        const OF_SLICE: f64 = 1.1;
        let product_m2 = from_start_m * (length_m - from_start_m).max(0.0);
        let nu_m = (product_m2 / (2.0 * f64::from(self.per_wavelength) * length_m)).sqrt();
        OF_SLICE * f64::from(CLEAR_NU) * nu_m
    }

    /// How much wider a body is than a usual one.
    #[inline(always)]
    pub(super) fn scale(height_m: f32, width_scale: f32) -> f32 {
        height_m / USUAL_M * width_scale
    }

    /// Whether what a body costs is not worth telling, whichever way it faces: it stands far beside a path, or at an end of it.
    #[inline(always)]
    pub(super) fn is_clear(&self, scale: f32, aside_m: f32, from_tx_m: f32, to_rx_m: f32) -> bool {
        // Beyond the trunk's edge by CLEAR_NU of Fresnel's parameter, sqrt(2 / lambda (1 / d1 + 1 / d2)), squared.
        let beyond_m = aside_m.abs() - Self::half_m(scale);
        let lengths_m = from_tx_m + to_rx_m;
        let is_beside = (beyond_m > 0.0)
            & (2.0 * self.per_wavelength * lengths_m * beyond_m * beyond_m
                > CLEAR_NU * CLEAR_NU * from_tx_m * to_rx_m);
        is_beside | (smaller(from_tx_m, to_rx_m) < NEAREST_M)
    }

    /// What bodies cost, dB; nothing where a sample's bit is not `open`.
    #[inline(always)]
    pub(super) fn losses_db(&self, of: &Across<Word>, open: u32) -> Word {
        match &self.model {
            Model::Kirchhoff(table) => table.losses_db(of, open),
            Model::Screen([width_m, top_m]) => {
                work_out(of, open, |across, _| self.model_b(across, &[[0.5 * width_m, 0.0, *top_m]]))
            }
            Model::Body => work_out(of, open, |across, body| self.model_b(across, body)),
            Model::KnifeEdges => work_out(of, open, |across, body| self.edges(across, body[0][0], None)),
            Model::ThreeEdges => {
                work_out(of, open, |across, body| self.edges(across, body[0][0], Some(across.height_m)))
            }
        }
    }

    /// Fresnel's parameter for a metre across the path.
    #[inline(always)]
    fn nu_per_m(&self, across: &Across<f32>, slant: f32) -> f32 {
        let near = 1.0 / across.from_tx_m + 1.0 / across.to_rx_m;
        (2.0 * self.per_wavelength * near / slant).sqrt()
    }

    #[inline(always)]
    fn model_b<const N: usize>(&self, across: &Across<f32>, parts: &[[f32; 3]; N]) -> f32 {
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
    fn edges(&self, across: &Across<f32>, half_m: f32, top_m: Option<f32>) -> f32 {
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

/// What the bodies cost of which `power` passes, given a trunk and a head: half widths, bottoms and tops.
#[inline(always)]
fn work_out(of: &Across<Word>, open: u32, power: impl Fn(&Across<f32>, &[[f32; 3]; 2]) -> f32) -> Word {
    let mut db = [0.0; WORD];
    for k in (0..WORD).filter(|k| open >> k & 1 == 1) {
        let across = Across {
            from_tx_m: of.from_tx_m[k],
            to_rx_m: of.to_rx_m[k],
            aside_m: of.aside_m[k],
            path_m: of.path_m[k],
            slope: of.slope[k],
            depth: of.depth[k],
            width: of.width[k],
            height_m: of.height_m[k],
            scale: of.scale[k],
        };
        let shoulders_m = SHOULDERS * across.height_m;
        let trunk = [half_trunk_m(across.scale, across.depth, across.width), 0.0, shoulders_m];
        db[k] = loss_db(power(&across, &[trunk, [HEAD_M * across.scale, shoulders_m, across.height_m]]));
    }
    db
}

#[inline(always)]
fn slant(across: &Across<f32>) -> f32 {
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
