//! From true ranges to measured ones: noise, drop-outs and the limits of the sensor.

use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use umbracast::lidar::RangeImage;
use umbracast::site::Sensor;

/// How one sensor errs. Every frame has generators of its own, and every ray takes one draw whether or not
/// anything is there: what one ray meets changes the noise of no other.
#[derive(Debug, Clone)]
pub struct Noise {
    range_noise_m: f32,
    dropout: f64,
    range_limits_m: std::ops::RangeInclusive<f32>,
    seed: u64,
    sensor: u64,
}

impl Noise {
    /// For the sensor that stands at place `number` in the site.
    pub fn new(sensor: &Sensor, seed: u64, number: u64) -> Self {
        Self {
            range_noise_m: sensor.range_noise_m as f32,
            dropout: sensor.dropout,
            // Nearer than a packet's unit of 2 mm is no return.
            range_limits_m: sensor.range_min_m.max(0.002) as f32..=sensor.range_max_m as f32,
            seed,
            sensor: number,
        }
    }

    /// Another scene.
    pub fn reseed(&mut self, seed: u64) {
        self.seed = seed;
    }

    /// Turns true ranges into measured ones; 0 where nothing comes back.
    pub fn measure(&self, frame: u64, image: &mut RangeImage) {
        let mut range_draws = self.generator(b"range___", frame);
        let mut loss_draws = self.generator(b"dropout_", frame);
        // The draw is below this for the given share of 64-bit numbers; the cast saturates.
        let lost_below = (self.dropout * 2.0_f64.powi(64)) as u64;
        for (range_m, reflectivity) in image.range_m.iter_mut().zip(&mut image.reflectivity) {
            let noise: f32 = StandardNormal.sample(&mut range_draws);
            *range_m += self.range_noise_m * noise;
            let lost = loss_draws.next_u64() < lost_below;
            if lost || !self.range_limits_m.contains(range_m) {
                (*range_m, *reflectivity) = (0.0, 0);
            }
        }
    }

    fn generator(&self, purpose: &[u8; 8], frame: u64) -> Pcg64Mcg {
        let mut seed = [0; 16];
        let key = [self.seed, u64::from_le_bytes(*purpose), self.sensor, frame];
        let mixed = key.iter().fold(0, |hash, &part| split_mix(hash ^ part));
        seed[..8].copy_from_slice(&mixed.to_le_bytes());
        seed[8..].copy_from_slice(&split_mix(mixed).to_le_bytes());
        Pcg64Mcg::from_seed(seed)
    }
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): neighbouring keys give unrelated states.
fn split_mix(key: u64) -> u64 {
    let mut z = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
