//! From true ranges to measured ones: noise, drop-outs and the limits of the sensor.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use umbracast::site::{DarkCloth, MixedReturns, Sensor, Simulation};

use super::edges;
use super::view::{NOBODY, View};
use crate::random::stream;

/// A range errs as its data sheet says where the surface is near and faces the sensor. What comes back is less farther away and
/// from slant surfaces (by the cosine of the angle of incidence: Soudarissanane et al. 2011, "Scanning geometry"), and ranges err
/// by the root of how much less: at this distance by 1.4 times as much,
const TWICE_AT_M: f32 = 30.0;
/// and by so many times at most.
const MOST: f32 = 4.0;
/// Dark cloth returns a quarter of what other cloth does.
const DARK: f32 = 4.0;

/// How one sensor errs. Every frame has generators of its own, and every ray takes one draw whether or not
/// anything is there: what one ray meets changes the noise of no other.
#[derive(Debug, Clone)]
pub struct Noise {
    range_noise_m: f32,
    range_bias_m: f32,
    dropout: f64,
    mixed_returns: Option<MixedReturns>,
    dark_cloth: Option<DarkCloth>,
    range_limits_m: std::ops::RangeInclusive<f32>,
    seed: u64,
    sensor: u64,
}

impl Noise {
    /// For the sensor that stands at place `number` in the site.
    pub fn new(sensor: &Sensor, simulation: &Simulation, seed: u64, number: u64) -> Self {
        Self {
            range_noise_m: sensor.range_noise_m as f32,
            range_bias_m: simulation.range_bias_m.get(&sensor.name).map_or(0.0, |&bias_m| bias_m as f32),
            dropout: simulation.dropout,
            mixed_returns: simulation.mixed_returns,
            dark_cloth: simulation.dark_cloth,
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
    pub fn measure(&self, frame: u64, view: &mut View) {
        let scene_and_sensor = stream(self.seed, "sensor", self.sensor).next_u64();
        if let Some(mixed) = &self.mixed_returns {
            edges::mix(view, mixed, &mut stream(scene_and_sensor, "edges", frame));
        }
        if let Some(dark) = &self.dark_cloth {
            self.swallow(dark, view, &mut stream(scene_and_sensor, "dark cloth", frame));
        }
        let mut scales = std::mem::take(&mut view.scales);
        self.scales(view, &mut scales);
        let image = &mut view.image;
        let mut range_draws = stream(scene_and_sensor, "range noise", frame);
        let mut loss_draws = stream(scene_and_sensor, "drop-outs", frame);
        // The draw is below this for the given share of 64-bit numbers; the cast saturates.
        let lost_below = (self.dropout * 2.0_f64.powi(64)) as u64;
        for ((range_m, reflectivity), scale) in
            image.range_m.iter_mut().zip(&mut image.reflectivity).zip(&scales)
        {
            let noise: f32 = StandardNormal.sample(&mut range_draws);
            *range_m += self.range_bias_m + self.range_noise_m * scale * noise;
            let lost = loss_draws.next_u64() < lost_below;
            if lost || !self.range_limits_m.contains(range_m) {
                (*range_m, *reflectivity) = (0.0, 0);
            }
        }
        view.scales = scales;
    }

    /// Writes how many times as much as the data sheet says each pixel's range errs.
    pub(super) fn scales(&self, view: &View, scales: &mut Vec<f32>) {
        let mut dark =
            self.dark_cloth.map(|dark| Wearers { share: dark.people, seed: self.seed, wears: Vec::new() });
        let per_column_rad = view.step_rad() as f32;
        view.slopes_m(scales);
        // Without a branch, for vector registers.
        for (scale, &range_m) in scales.iter_mut().zip(&view.image.range_m) {
            let slope = *scale / (range_m * per_column_rad);
            let per_cosine = (1.0 + slope * slope).sqrt();
            *scale = (1.0 + (range_m / TWICE_AT_M).powi(2)) * per_cosine;
        }
        if let Some(dark) = &mut dark {
            for (scale, &owner) in scales.iter_mut().zip(&view.owner) {
                *scale *= if dark.has(owner) { DARK } else { 1.0 };
            }
        }
        scales.iter_mut().for_each(|less| *less = less.sqrt().min(MOST));
    }

    /// Loses a share of what comes back of those who wear dark cloth: the same people for every sensor.
    fn swallow(&self, dark: &DarkCloth, view: &mut View, draws: &mut impl Rng) {
        let mut wearers = Wearers { share: dark.people, seed: self.seed, wears: Vec::new() };
        for (range_m, &owner) in view.image.range_m.iter_mut().zip(&view.owner) {
            let is_lost = draws.random::<f64>() < dark.dropout;
            if is_lost && wearers.has(owner) {
                *range_m = f32::INFINITY;
            }
        }
    }
}

/// Who wears dark cloth: the same people for every sensor.
struct Wearers {
    share: f64,
    seed: u64,
    /// By person, once drawn.
    wears: Vec<Option<bool>>,
}

impl Wearers {
    fn has(&mut self, owner: u32) -> bool {
        if owner == NOBODY {
            return false;
        }
        let person = owner as usize;
        if self.wears.len() <= person {
            self.wears.resize(person + 1, None);
        }
        let draw = || stream(self.seed, "wears dark cloth", owner.into()).random::<f64>() < self.share;
        *self.wears[person].get_or_insert_with(draw)
    }
}
