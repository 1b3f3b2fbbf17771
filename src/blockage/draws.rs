//! The random numbers behind a person's samples, spread evenly: in every coordinate each sample has its own share of
//! the distribution (Latin hypercube). A few such samples replace many independent ones.

use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::lanes::WORD;
use crate::STEPS;

/// By coordinate, then by sample: standard normal, or even in (0, 1) where said. Samples fill whole words; those after
/// the last that was asked for lie in the middle of every distribution.
#[derive(Debug, Clone)]
pub(super) struct Draws {
    pub(super) state: [Vec<f32>; 4],
    pub(super) process_noise: [[Vec<f32>; 2]; STEPS],
    pub(super) height: Vec<f32>,
    pub(super) width: Vec<f32>,
    pub(super) heading: Vec<f32>,
    /// Even.
    pub(super) phase: Vec<f32>,
    /// Even.
    pub(super) arm_swing: Vec<f32>,
    /// How far ahead, left and up the device is from its mean place.
    pub(super) device: [Vec<f32>; 3],
}

impl Draws {
    /// Those of a track: by seed and id alone.
    pub(super) fn new(quantiles: &Quantiles, seed: u64, track: u64) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(seed ^ track.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let mut normal = || shuffled(&quantiles.normal, 0.0, &mut random);
        let state = std::array::from_fn(|_| normal());
        let process_noise = std::array::from_fn(|_| std::array::from_fn(|_| normal()));
        let (height, width, heading) = (normal(), normal(), normal());
        let mut even = || shuffled(&quantiles.even, 0.5, &mut random);
        let (phase, arm_swing) = (even(), even());
        let device = std::array::from_fn(|_| shuffled(&quantiles.normal, 0.0, &mut random));
        Self { state, process_noise, height, width, heading, phase, arm_swing, device }
    }
}

/// What each of so many samples has of a distribution.
#[derive(Debug, Clone)]
pub(crate) struct Quantiles {
    even: Vec<f32>,
    normal: Vec<f32>,
}

impl Quantiles {
    pub(crate) fn new(samples: usize) -> Self {
        Self { even: even(samples), normal: normal(samples) }
    }

    /// A coordinate of its own for whatever `key` names: standard normal.
    pub(crate) fn normal(&self, key: u64) -> Vec<f32> {
        shuffled(&self.normal, 0.0, &mut Pcg64Mcg::seed_from_u64(key))
    }
}

/// In any order, with the middle up to a whole word.
fn shuffled(values: &[f32], middle: f32, random: &mut impl Rng) -> Vec<f32> {
    let mut values = values.to_vec();
    values.shuffle(random);
    values.resize(values.len().next_multiple_of(WORD), middle);
    values
}

/// Middles of n equal shares of (0, 1).
fn even(n: usize) -> Vec<f32> {
    (0..n).map(|k| ((k as f64 + 0.5) / n as f64) as f32).collect()
}

/// The standard normal distribution's quantiles at those middles, its density added up from the left.
fn normal(n: usize) -> Vec<f32> {
    const STEP: f64 = 1e-3;
    const FIRST: f64 = -6.0;
    let density = |z: f64| (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    let (mut z, mut below) = (FIRST, 0.0);
    even(n)
        .into_iter()
        .map(|share| {
            while below < f64::from(share) && z < -FIRST {
                below += STEP * density(z + 0.5 * STEP);
                z += STEP;
            }
            z as f32
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_draws_are_the_quantiles_of_tables() {
        // Phi^-1 of 0.25 and 0.75; of 0.05, 0.15, ...
        assert!(normal(2).iter().zip([-0.6745, 0.6745]).all(|(z, known)| (z - known).abs() < 2e-3));
        let ten = normal(10);
        assert!((ten[0] + 1.6449).abs() < 2e-3 && (ten[9] - 1.6449).abs() < 2e-3, "{ten:?}");
    }

    #[test]
    fn every_coordinate_has_each_quantile_once_in_an_order_of_its_own() {
        let draws = Draws::new(&Quantiles::new(64), 1, 7);
        let sorted = |values: &[f32]| {
            let mut values = values.to_vec();
            values.sort_by(f32::total_cmp);
            values
        };
        assert_eq!(sorted(&draws.state[0]), sorted(&draws.process_noise[8][1]));
        assert_ne!(draws.state[0], draws.state[1]);
        assert_ne!(draws.state[0], Draws::new(&Quantiles::new(64), 1, 8).state[0]);
        assert_eq!(draws.phase, Draws::new(&Quantiles::new(64), 1, 7).phase);
    }
}
