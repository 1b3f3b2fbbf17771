//! How many dB a body costs a path: the models of the field, each as its source defines it.
//!
//! All losses are in dB and positive where power is lost. Model B is never negative, as its standard says; the others may be,
//! for a wave that passes beside an edge can be stronger than one in free space.

use std::f64::consts::{FRAC_PI_2, PI};

use super::fresnel::{Complex, integrals, multiply, power};
use super::passage::{Passage, Rectangle};

/// How the screen of model B stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stand {
    /// Upright, as a person does.
    Upright,
    /// At a right angle to the path, as TR 38.901 has it.
    Leaning,
}

/// How the fields round the two sides of a knife edge are put together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sum {
    /// With their phases, which a millimetre of a body's place turns.
    Coherent,
    /// As powers: the mean over such millimetres.
    Power,
    /// The stronger one alone.
    Stronger,
}

/// 3GPP TR 38.901 v19.4, 7.6.4.2, eq. 7.6-29 and 7.6-30 for the line of sight: a screen of `width_m` from the floor to `top_m`.
pub fn model_b(wavelength_m: f64, passage: &Passage, width_m: f64, top_m: f64, stand: Stand) -> f64 {
    let screen = passage.rectangle(0.5 * width_m, 0.0, top_m);
    let plan = PI / wavelength_m;
    let widths = edges(plan, screen.across_m, |edge_m| detour_m(edge_m, passage.from_tx_m, passage.to_rx_m));
    let heights = match stand {
        Stand::Upright => {
            // Both ways from an upright edge, whose foot is on the path's plan.
            let length_m = |end_m: f64, rises_m: f64| end_m.hypot(rises_m);
            let (tx_m, rx_m) = (passage.from_tx_m, passage.to_rx_m);
            let straight_m = (tx_m + rx_m) * passage.slant();
            edges(plan, screen.up_m, |edge_m| {
                let to_tx_m = length_m(tx_m, edge_m - passage.slope * tx_m);
                to_tx_m + length_m(rx_m, edge_m + passage.slope * rx_m) - straight_m
            })
        }
        Stand::Leaning => {
            // The screen turns about its middle; its edges are then on one line across the path.
            let slant = passage.slant();
            let middle_m = 0.5 * top_m - passage.height_m;
            let along_m = passage.slope * middle_m / slant;
            let (tx_m, rx_m) = (passage.from_tx_m * slant - along_m, passage.to_rx_m * slant + along_m);
            let across_m = middle_m / slant;
            edges(plan, [across_m - 0.5 * top_m, across_m + 0.5 * top_m], |edge_m| {
                detour_m(edge_m, tx_m, rx_m)
            })
        }
    };
    loss_of_share(widths * heights)
}

/// The same of several upright rectangles one above another, such as a trunk and a head: their shares of the field add. This is
/// ours; the standard adds the dB of screens, which counts a stacked body twice. Distances are along the path.
pub fn model_b_of(wavelength_m: f64, passage: &Passage, rectangles: &[Rectangle]) -> f64 {
    let [tx_m, rx_m] = [passage.from_tx_m, passage.to_rx_m].map(|m| m * passage.slant());
    let share = |of: [f64; 2]| edges(PI / wavelength_m, of, |edge_m| detour_m(edge_m, tx_m, rx_m));
    loss_of_share(rectangles.iter().map(|r| share(r.across_m) * share(r.up_m)).sum())
}

/// Two edges to the side of a path, infinitely high (Kunisch and Pamp 2008; MacCartney et al., arXiv 1607.00226). Distances are
/// those of the plan view.
pub fn double_knife_edge(wavelength_m: f64, passage: &Passage, width_m: f64, sum: Sum) -> f64 {
    let per_m = nu_per_m(wavelength_m, passage.from_tx_m, passage.to_rx_m);
    let [a, b] = [0.5 * width_m - passage.aside_m, 0.5 * width_m + passage.aside_m]
        .map(|covered_m| edge_field(per_m * covered_m));
    let left = match sum {
        Sum::Coherent => power([a[0] + b[0], a[1] + b[1]]),
        Sum::Power => power(a) + power(b),
        Sum::Stronger => power(a).max(power(b)),
    };
    -10.0 * left.log10()
}

/// Kirchhoff's integral over upright rectangles that do not overlap: what is left of the field is one less what would have come
/// through them. Distances are along the path.
pub fn kirchhoff(wavelength_m: f64, passage: &Passage, rectangles: &[Rectangle]) -> f64 {
    -10.0 * kirchhoff_power(wavelength_m, passage, rectangles, 0.0).log10()
}

/// The mean power of that over places of the body within `within_m` to either side: phases that a millimetre turns are averaged
/// as the body's width is not known to a millimetre.
pub fn kirchhoff_mean(wavelength_m: f64, passage: &Passage, rectangles: &[Rectangle], within_m: f64) -> f64 {
    const PLACES: usize = 17;
    let off_m = |place: usize| within_m * (2.0 * place as f64 / (PLACES - 1) as f64 - 1.0);
    let sum: f64 =
        (0..PLACES).map(|place| kirchhoff_power(wavelength_m, passage, rectangles, off_m(place))).sum();
    -10.0 * (sum / PLACES as f64).log10()
}

fn kirchhoff_power(wavelength_m: f64, passage: &Passage, rectangles: &[Rectangle], off_m: f64) -> f64 {
    let slant = passage.slant();
    let per_m = nu_per_m(wavelength_m, passage.from_tx_m * slant, passage.to_rx_m * slant);
    let between = |[from_m, to_m]: [f64; 2]| {
        let ([c0, s0], [c1, s1]) = (integrals(per_m * from_m), integrals(per_m * to_m));
        [c1 - c0, s0 - s1]
    };
    let mut through = [0.0, 0.0];
    for Rectangle { across_m, up_m } in rectangles {
        let of = multiply(between(across_m.map(|m| m + off_m)), between(*up_m));
        through = [through[0] + of[0], through[1] + of[1]];
    }
    // E / E0 = 1 - (j / 2) times the sum.
    power([1.0 + 0.5 * through[1], -0.5 * through[0]])
}

/// The loss behind one edge of a screen without end, ITU-R P.526-16, 4.1: `nu` is positive where the path is covered.
///
/// ```
/// assert!((umbracast::radio::models::knife_edge(0.0) - 6.0206).abs() < 1e-4);
/// assert!((umbracast::radio::models::knife_edge(2.4) - 20.6182).abs() < 1e-4);
/// ```
pub fn knife_edge(nu: f64) -> f64 {
    -10.0 * power(edge_field(nu)).log10()
}

/// How the losses round the three free edges of a screen that stands on the floor are put together, ITU-R P.526-16, 5.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ThreeEdges {
    /// As powers.
    Average,
    /// In phase: the least loss.
    Minimum,
}

/// ITU-R P.526-16, 5.1: a screen of `width_m` on the floor, `top_m` high. Distances are along the path.
pub fn three_edges(wavelength_m: f64, passage: &Passage, width_m: f64, top_m: f64, sum: ThreeEdges) -> f64 {
    let slant = passage.slant();
    let per_m = nu_per_m(wavelength_m, passage.from_tx_m * slant, passage.to_rx_m * slant);
    let half_m = 0.5 * width_m;
    let covered_m = [half_m - passage.aside_m, half_m + passage.aside_m, top_m - passage.height_m];
    let powers = covered_m.map(|covered_m| power(edge_field(per_m * covered_m)));
    match sum {
        ThreeEdges::Average => -10.0 * powers.iter().sum::<f64>().log10(),
        ThreeEdges::Minimum => -20.0 * powers.iter().map(|power| power.sqrt()).sum::<f64>().log10(),
    }
}

/// What comes round an edge, as a share of the field in free space: (1 + j) / 2 [(1/2 - C) - j (1/2 - S)].
fn edge_field(nu: f64) -> Complex {
    let [c, s] = integrals(nu);
    multiply([0.5, 0.5], [0.5 - c, s - 0.5])
}

/// Fresnel's parameter for each metre across the path.
pub(super) fn nu_per_m(wavelength_m: f64, to_tx_m: f64, to_rx_m: f64) -> f64 {
    (2.0 / wavelength_m * (1.0 / to_tx_m + 1.0 / to_rx_m)).sqrt()
}

/// How much longer the way over a point beside the path is.
fn detour_m(off_m: f64, to_tx_m: f64, to_rx_m: f64) -> f64 {
    to_tx_m.hypot(off_m) + to_rx_m.hypot(off_m) - (to_tx_m + to_rx_m)
}

/// The sum of F over two edges of eq. 7.6-30. Where the path passes beside the screen the nearer edge counts with the other sign.
fn edges(per_m: f64, [low_m, high_m]: [f64; 2], detour_m: impl Fn(f64) -> f64) -> f64 {
    let f = |edge_m: f64| (FRAC_PI_2 * (per_m * detour_m(edge_m).max(0.0)).sqrt()).atan() / PI;
    let (low, high) = (f(low_m), f(high_m));
    if low_m < 0.0 && high_m > 0.0 { low + high } else { (high - low).abs() }
}

/// What a share of the field costs that does not arrive.
fn loss_of_share(share: f64) -> f64 {
    (-20.0 * (1.0 - share).log10()).max(0.0)
}

#[cfg(test)]
#[path = "models_tests.rs"]
mod tests;
