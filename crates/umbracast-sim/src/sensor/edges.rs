//! Beams have a width, so a beam that meets an edge sees two surfaces.
//!
//! If both are within a pulse's length of each other, their echoes merge and the range lies between them, weighted by
//! the returned power of each. Otherwise the sensor reports the stronger one. The site file sets width and length. We
//! assume 3 mrad and 6 ns (0.9 m) for a spinning sensor.
//!
//! The search for edges runs along a beam's sweep, where columns lie about a beam's width apart, and between two
//! columns. It ignores neighbours above and below, because beams lie ten times their width above each other.

use rand::RngExt;
use rand_pcg::Pcg64;
use umbracast::site::MixedReturns;

use super::view::View;

/// Ranges of neighbours that are apart by less lie on one surface.
const EDGE_M: f32 = 0.1;
/// And by less than so many times as those beside them: a surface that is met flatly.
const STEEPER: f32 = 3.0;

/// Mixes what is seen at edges. Every pixel takes one draw, so that what stands somewhere changes no other's.
pub fn mix(view: &mut View, mixed: &MixedReturns, draws: &mut Pcg64) {
    let (beams, columns) = (view.image.beams.len(), view.image.columns.len());
    let step_mrad = (view.azimuth_at(1.0) - view.azimuth_at(0.0)) * (std::f64::consts::PI / 18.0);
    let half = (0.5 * mixed.divergence_mrad / step_mrad) as f32;
    let pure = view.clone();
    let range_m = |c: usize, b: usize| pure.image.range_m[c * beams + b];
    for c in 1..columns.saturating_sub(2) {
        for b in 0..beams {
            // Where between this column and the next the edge is, in columns.
            let edge: f32 = draws.random();
            let jump_m = (range_m(c + 1, b) - range_m(c, b)).abs();
            let beside_m =
                (range_m(c, b) - range_m(c - 1, b)).abs().max((range_m(c + 2, b) - range_m(c + 1, b)).abs());
            // Not a number between two beams that meet nothing.
            if !(jump_m > EDGE_M && (jump_m > STEEPER * beside_m || beside_m.is_infinite())) {
                continue;
            }
            // Of the beam's width, the part beyond the edge.
            for (own, other, off) in [(c, c + 1, edge), (c + 1, c, 1.0 - edge)] {
                if off < half {
                    blend(
                        view,
                        &pure,
                        own * beams + b,
                        other * beams + b,
                        (half - off) / (2.0 * half),
                        mixed.pulse_m,
                    );
                }
            }
        }
    }
}

/// What a pixel returns of whose beam `share` falls on what its neighbour shows.
fn blend(view: &mut View, pure: &View, own: usize, other: usize, share: f32, pulse_m: f64) {
    let power = |pixel: usize, share: f32| {
        let range_m = pure.image.range_m[pixel];
        share * f32::from(pure.image.reflectivity[pixel]) / (range_m * range_m)
    };
    let (own_m, other_m) = (pure.image.range_m[own], pure.image.range_m[other]);
    let (own_power, other_power) = (power(own, 1.0 - share), power(other, share));
    if f64::from((own_m - other_m).abs()) < pulse_m {
        let weight = other_power / (own_power + other_power).max(f32::MIN_POSITIVE);
        view.image.range_m[own] = own_m + weight * (other_m - own_m);
    } else if other_power > own_power {
        view.image.range_m[own] = other_m;
        view.image.reflectivity[own] = pure.image.reflectivity[other];
        view.owner[own] = pure.owner[other];
    }
}
