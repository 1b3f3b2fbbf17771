//! Losses behind knife edges for many bodies at once, in vector registers.

use std::f32::consts::TAU;

use super::passage::Passage;
use crate::elementary::{cos_sin_f32, ln_f32, wide};

/// Passages that are worked out together.
const WORD: usize = 32;

/// A screen that stands for a body, for many bodies: [`double_knife_edge`](super::models::double_knife_edge) with powers that
/// add, or, where it has a top, [`three_edges`](super::models::three_edges) with their average. Losses are those to 1e-4 dB.
///
/// ```
/// use umbracast::{geometry::{DVec2, DVec3}, radio::Passage};
/// use umbracast::radio::{KnifeEdges, models::{Sum, double_knife_edge}};
///
/// let (ap_m, ue_m) = (DVec3::new(10.0, 0.0, 3.0), DVec3::new(0.0, 0.0, 1.2));
/// let passage = |x: f64, y: f64| Passage::new(ap_m, ue_m, DVec2::new(x, y), 0.0);
/// let edges = KnifeEdges { wavelength_m: 0.0107, width_m: 0.56, top_m: None };
/// let mut losses_db = Vec::new();
/// edges.losses_db([passage(1.0, 0.1), passage(-1.0, 0.1)], &mut losses_db);
/// let one_db = double_knife_edge(0.0107, &passage(1.0, 0.1).unwrap(), 0.56, Sum::Power);
/// assert!((losses_db[0] - one_db).abs() < 1e-4);
/// assert_eq!(losses_db[1], 0.0, "behind the receiver");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnifeEdges {
    /// Of the carrier.
    pub wavelength_m: f64,
    /// From one side of the screen to the other.
    pub width_m: f64,
    /// The upper edge above the floor; without one the screen is infinitely high, and distances are those of the plan view.
    pub top_m: Option<f64>,
}

/// Passages, number by number.
struct Word {
    from_tx_m: [f64; WORD],
    to_rx_m: [f64; WORD],
    aside_m: [f64; WORD],
    height_m: [f64; WORD],
    slope: [f64; WORD],
}

impl KnifeEdges {
    /// What each body costs its path, dB, appended in their order; 0 where no body is between the ends.
    pub fn losses_db(&self, passages: impl IntoIterator<Item = Option<Passage>>, losses_db: &mut Vec<f64>) {
        // A body behind the transmitter.
        let none = Passage { from_tx_m: -1.0, to_rx_m: 1.0, aside_m: 0.0, height_m: 0.0, slope: 0.0 };
        let none_of = || [0.0; WORD];
        let mut word = Word {
            from_tx_m: none_of(),
            to_rx_m: none_of(),
            aside_m: none_of(),
            height_m: none_of(),
            slope: none_of(),
        };
        let mut filled = 0;
        for passage in passages {
            let passage = passage.unwrap_or(none);
            word.from_tx_m[filled] = passage.from_tx_m;
            word.to_rx_m[filled] = passage.to_rx_m;
            word.aside_m[filled] = passage.aside_m;
            word.height_m[filled] = passage.height_m;
            word.slope[filled] = passage.slope;
            filled += 1;
            if filled == WORD {
                losses_db.extend_from_slice(&self.of_word(&word));
                filled = 0;
            }
        }
        losses_db.extend_from_slice(&self.of_word(&word)[..filled]);
    }

    wide! {
        fn of_word(&self, of: &Word) -> [f64; WORD] = of_word_wide or of_word_portable
    }

    /// Where edges are is worked out in double precision, and so is the phase, of which far from an edge only the last turn counts.
    #[inline(always)]
    fn of_word_portable(&self, of: &Word) -> [f64; WORD] {
        let half_m = 0.5 * self.width_m;
        // Fresnel's parameter of each edge, positive where it covers the path, and the phase. The far side of a body always does.
        let [mut near, mut far, mut top] = [[0.0_f32; WORD]; 3];
        let [mut near_turns, mut top_turns] = [[0.0_f32; WORD]; 2];
        for k in 0..WORD {
            let slant = if self.top_m.is_some() { (1.0 + of.slope[k] * of.slope[k]).sqrt() } else { 1.0 };
            let between_m2 = of.from_tx_m[k] * of.to_rx_m[k] * slant * self.wavelength_m;
            let per_m = (2.0 * (of.from_tx_m[k] + of.to_rx_m[k]) / between_m2).sqrt();
            let aside_m = of.aside_m[k].abs();
            (near[k], near_turns[k]) = nu_and_turns(per_m * (half_m - aside_m));
            far[k] = (per_m * (half_m + aside_m)) as f32;
            if let Some(top_m) = self.top_m {
                (top[k], top_turns[k]) = nu_and_turns(per_m * (top_m - of.height_m[k]));
            }
        }
        let mut power = [0.0_f32; WORD];
        for k in 0..WORD {
            power[k] = round_edge(near[k], near_turns[k]) + round_covered_edge(far[k]);
        }
        if self.top_m.is_some() {
            for k in 0..WORD {
                power[k] += round_edge(top[k], top_turns[k]);
            }
        }
        let mut losses_db = [0.0; WORD];
        for k in 0..WORD {
            let db = -10.0 / std::f32::consts::LN_10 * ln_f32(power[k]);
            let is_between = (of.from_tx_m[k] > 0.0) & (of.to_rx_m[k] > 0.0);
            losses_db[k] = if is_between { f64::from(db) } else { 0.0 };
        }
        losses_db
    }
}

/// Fresnel's parameter, and nu^2 / 4 but for whole turns.
#[inline(always)]
fn nu_and_turns(nu: f64) -> (f32, f32) {
    /// Adding it rounds to a whole number.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    let turns = 0.25 * nu * nu;
    (nu as f32, (turns - (turns + WHOLE - WHOLE)) as f32)
}

/// Farther from the edge, less than 1e-9 of the power or all of it arrives.
const FARTHEST: f32 = 1e4;

/// What comes round an edge, as a share of the power in free space: ((1/2 - C)^2 + (1/2 - S)^2) / 2. With the auxiliary functions
/// f and g (Abramowitz and Stegun, 7.3.9 and 7.3.10) this is (f^2 + g^2) / 2 behind the edge; before it the wave itself adds.
#[inline(always)]
fn round_edge(nu: f32, turns: f32) -> f32 {
    // Quotients of polynomials that are f and g to 1e-6 of f. As no coefficient is negative, nothing cancels.
    const F: [f32; 7] =
        [0.499_999_6, 1.385_860_4, 1.403_551_5, 1.154_786_3, 0.681_200_7, 0.282_191_57, 0.131_816_16];
    const G: [f32; 5] = [0.499_999_6, 0.385_888, 0.201_747_63, 0.092_472_16, 0.041_815_538];
    const BELOW: [f32; 8] =
        [1.0, 2.771_673_7, 4.378_05, 4.573_575_5, 3.627_457_6, 2.139_701_6, 0.886_550_07, 0.414_112_4];
    let size = if nu.abs() < FARTHEST { nu.abs() } else { FARTHEST };
    let over = 1.0 / polynomial(&BELOW, size);
    let (f, g) = (polynomial(&F, size) * over, polynomial(&G, size) * over);
    let behind = 0.5 * (f * f + g * g);
    let (cos, sin) = cos_sin_f32(TAU * turns);
    let before = 1.0 + behind + f * (sin - cos) - g * (sin + cos);
    if nu < 0.0 { before } else { behind }
}

/// [`round_edge`] where `nu` is not negative: (f^2 + g^2) / 2 in one quotient, to 1e-6 of itself.
#[inline(always)]
fn round_covered_edge(nu: f32) -> f32 {
    const ABOVE: [f32; 6] =
        [0.500_000_2, 0.423_198_9, 0.357_607_5, 0.223_040_86, 0.076_818_66, 0.044_153_146];
    const BELOW: [f32; 8] =
        [1.0, 2.846_456_8, 4.406_615_7, 4.628_764, 3.499_194_6, 2.203_215_1, 0.758_125_9, 0.435_774_27];
    let size = if nu < FARTHEST { nu } else { FARTHEST };
    0.5 * polynomial(&ABOVE, size) / polynomial(&BELOW, size)
}

/// The first coefficient is the constant.
#[inline(always)]
fn polynomial<const N: usize>(coefficients: &[f32; N], x: f32) -> f32 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radio::models::{Sum, ThreeEdges, double_knife_edge, knife_edge, three_edges};

    #[test]
    fn one_edge_is_that_of_the_exact_integrals() {
        for i in -30_000..30_000 {
            let nu = f64::from(i) * 4.03e-3;
            let (single, turns) = nu_and_turns(nu);
            // What single precision leaves of the parameter itself is no error of the edge.
            let expected_db = knife_edge(f64::from(single));
            let db = |power: f32| -10.0 * f64::from(power).log10();
            assert!((db(round_edge(single, turns)) - expected_db).abs() < 3e-5, "{nu}");
            if nu >= 0.0 {
                assert!((db(round_covered_edge(single)) - expected_db).abs() < 3e-5, "{nu}");
            }
        }
        assert!((round_edge(-1e9, 0.3) - 1.0).abs() < 1e-4 && round_edge(1e9, 0.3) < 1e-9);
    }

    #[test]
    fn many_bodies_lose_what_each_does_to_a_ten_thousandth_of_a_db() {
        let mut passages = Vec::new();
        for (i, ghz) in (0..).zip([6.0, 28.0, 60.0, 140.0]) {
            for k in 0..1501 {
                let part = |step: f64| (f64::from(k + i) * step).fract();
                let length_m = 0.5 + 60.0 * part(0.618_034);
                let to_rx_m = length_m * (0.01 + 0.98 * part(0.414_214));
                let passage = Passage {
                    from_tx_m: length_m - to_rx_m,
                    to_rx_m,
                    aside_m: 6.0 * part(0.732_051) - 3.0,
                    height_m: 3.0 * part(0.236_068),
                    slope: 3.0 * part(0.645_751) - 1.5,
                };
                passages.push((k % 7 != 0).then_some(passage));
            }
            let wavelength_m = 0.299_792_458 / ghz;
            for top_m in [None, Some(1.72)] {
                let mut losses_db = Vec::new();
                let edges = KnifeEdges { wavelength_m, width_m: 0.56, top_m };
                edges.losses_db(passages.iter().copied(), &mut losses_db);
                assert_eq!(losses_db.len(), passages.len());
                for (passage, loss_db) in passages.iter().zip(losses_db) {
                    let expected_db = passage.map_or(0.0, |passage| match top_m {
                        None => double_knife_edge(wavelength_m, &passage, 0.56, Sum::Power),
                        Some(top_m) => three_edges(wavelength_m, &passage, 0.56, top_m, ThreeEdges::Average),
                    });
                    assert!(
                        (loss_db - expected_db).abs() < 1e-4,
                        "{passage:?}: {loss_db}, not {expected_db}"
                    );
                }
            }
        }
    }
}
