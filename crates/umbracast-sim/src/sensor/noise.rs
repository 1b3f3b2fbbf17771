//! From true ranges to measured ones: noise, drop-outs and the limits of the sensor.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use umbracast::lidar::RangeImage;
use umbracast::site::Sensor;

use crate::random::stream;

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
    /// For the sensor that stands at place `number` in the site, of whose returns a share drops out.
    pub fn new(sensor: &Sensor, dropout: f64, seed: u64, number: u64) -> Self {
        Self {
            range_noise_m: sensor.range_noise_m as f32,
            dropout,
            // Nearer than a packet's unit of 2 mm is no return.
            range_limits_m: sensor.range_min_m.max(0.002) as f32..=sensor.range_max_m as f32,
            seed,
            sensor: number,
        }
    }

    /// How many returns a surface gives a ray on the mean.
    pub fn mean_returns(&self, range_m: f32) -> f64 {
        if self.range_limits_m.contains(&range_m) { 1.0 - self.dropout } else { 0.0 }
    }

    /// Another scene.
    pub fn reseed(&mut self, seed: u64) {
        self.seed = seed;
    }

    /// Turns true ranges into measured ones; 0 where nothing comes back.
    pub fn measure(&self, frame: u64, image: &mut RangeImage) {
        let scene_and_sensor = stream(self.seed, "sensor", self.sensor).next_u64();
        let mut range_draws = stream(scene_and_sensor, "range noise", frame);
        let mut loss_draws = stream(scene_and_sensor, "drop-outs", frame);
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
}
