//! Constant velocity from the filtered state: where a person will be with unchanged velocity, and the spread of the
//! error.

use super::{Coupling, Forecast, Gaussian2};
use crate::STEP_S;
use crate::geometry::DVec2;
use crate::track::Track;

/// Spectral density of the acceleration that nobody can foresee, white, each axis. It adds psd t^3 / 3 to the variance of a
/// position, 5 cm (one sigma, each axis) at 900 ms. From the true state ORCA's people would need 0.004 (orca-03), 0.011
/// (orca-06), 0.034 (mixed); most go straight on and few turn sharply.
pub const ACCELERATION_PSD_M2PS3: f64 = 0.01;

/// Carries a track's state on.
pub fn forecast(track: &Track) -> Forecast {
    let coupling =
        Coupling { state: track.covariance, acceleration_psd_m2ps3: alike(ACCELERATION_PSD_M2PS3) };
    let steps = std::array::from_fn(|i| {
        let ahead_s = (i + 1) as f64 * STEP_S;
        position_at(track.position_m, track.velocity_mps, &coupling, ahead_s)
    });
    Forecast { track: track.id, steps, coupling }
}

/// A spectral density that is the same along every axis, as [`Coupling`] has it.
pub fn alike(density: f64) -> [[f64; 2]; 2] {
    [[density, 0.0], [0.0, density]]
}

/// The position `ahead_s` seconds from now. With P the state's covariance and q the acceleration's density:
/// `P_pp + t (P_pv + P_vp) + t^2 P_vv + q t^3 / 3` (white acceleration, integrated twice).
pub fn position_at(position_m: DVec2, velocity_mps: DVec2, coupling: &Coupling, ahead_s: f64) -> Gaussian2 {
    let (p, t) = (&coupling.state, ahead_s);
    let carried = |i: usize, j: usize| p[i][j] + t * (p[i][j + 2] + p[i + 2][j]) + t * t * p[i + 2][j + 2];
    let unforeseen = |i: usize, j: usize| coupling.acceleration_psd_m2ps3[i][j] * t.powi(3) / 3.0;
    Gaussian2 {
        mean_m: position_m + velocity_mps * t,
        xx_m2: carried(0, 0) + unforeseen(0, 0),
        xy_m2: carried(0, 1) + unforeseen(0, 1),
        yy_m2: carried(1, 1) + unforeseen(1, 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    const STATE: [[f64; 4]; 4] = [
        [0.0025, 0.0004, 0.0030, 0.0006],
        [0.0004, 0.0036, 0.0002, 0.0040],
        [0.0030, 0.0002, 0.0100, 0.0010],
        [0.0006, 0.0040, 0.0010, 0.0144],
    ];

    /// Lower triangular L with L L^T = `STATE`.
    fn cholesky() -> [[f64; 4]; 4] {
        let mut l = [[0.0_f64; 4]; 4];
        for i in 0..4 {
            for j in 0..=i {
                let rest = STATE[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
                l[i][j] = if i == j { rest.sqrt() } else { rest / l[j][j] };
            }
        }
        l
    }

    #[test]
    fn covariance_is_that_of_simulated_walkers() {
        // White acceleration in slices of 2 ms on a state drawn from its covariance.
        const SLICE_S: f64 = 0.002;
        const WALKERS: usize = 20_000;
        let coupling = Coupling { state: STATE, acceleration_psd_m2ps3: alike(0.2) };
        let mut rng = Pcg64::seed_from_u64(7);
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        let l = cholesky();
        let ahead_s = 0.9;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for _ in 0..WALKERS {
            let z: [f64; 4] = std::array::from_fn(|_| draw());
            let state: [f64; 4] = std::array::from_fn(|i| (0..4).map(|k| l[i][k] * z[k]).sum());
            let (mut p, mut v) = (DVec2::new(state[0], state[1]), DVec2::new(state[2], state[3]));
            for _ in 0..(ahead_s / SLICE_S) as usize {
                let push =
                    DVec2::new(draw(), draw()) * (coupling.acceleration_psd_m2ps3[0][0] * SLICE_S).sqrt();
                p += (v + push * 0.5) * SLICE_S;
                v += push;
            }
            (xx, xy, yy) = (xx + p.x * p.x, xy + p.x * p.y, yy + p.y * p.y);
        }
        let n = WALKERS as f64;
        let found = position_at(DVec2::ZERO, DVec2::ZERO, &coupling, ahead_s);
        // The standard error of a variance is sqrt(2 / n) = 1 % of it.
        assert!((found.xx_m2 / (xx / n) - 1.0).abs() < 0.04, "{} against {}", found.xx_m2, xx / n);
        assert!((found.yy_m2 / (yy / n) - 1.0).abs() < 0.04, "{} against {}", found.yy_m2, yy / n);
        assert!((found.xy_m2 - xy / n).abs() < 0.04 * found.xx_m2, "{} against {}", found.xy_m2, xy / n);
    }

    #[test]
    fn walks_straight_on() {
        let coupling = Coupling { state: STATE, acceleration_psd_m2ps3: alike(0.0) };
        let ahead = position_at(DVec2::new(1.0, 2.0), DVec2::new(-1.0, 0.5), &coupling, 0.4);
        assert!(ahead.mean_m.abs_diff_eq(DVec2::new(0.6, 2.2), 1e-12));
    }
}
