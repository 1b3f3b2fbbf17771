//! Windows of ten observed and nine coming positions, drawn from simulated crowds without bodies or sensors.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use umbracast::forecast::lstm::OBSERVED_DISPLACEMENTS;
use umbracast::geometry::DVec2;
use umbracast::track::OBSERVED;
use umbracast::{STEP_NS, STEPS};
use umbracast_sim::crowd::{Preset, circle_crossing};

/// Positions of a window.
const POSITIONS: usize = OBSERVED + STEPS;

/// What a tracker adds to the observed positions. Both zero: exact positions, as the paper trains on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of what is new in each frame, each axis: drawn for each window between 0 and this.
    pub white_m: f64,
    /// The same of what lasts, 0.9 of it from frame to frame, as a cluster's offset from the body axis does.
    pub lasting_m: f64,
}

/// One window: displacements in metres a frame, oldest first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Observed.
    pub observed_m: [DVec2; OBSERVED_DISPLACEMENTS],
    /// To come. The first starts at the last observed position, noise included.
    pub coming_m: [DVec2; STEPS],
}

/// Ways on the frames' instants, each from its start to its arrival.
#[derive(Debug, Clone)]
pub struct Ways {
    ways: Vec<Vec<DVec2>>,
    /// Windows up to and with each way.
    ends: Vec<usize>,
}

impl Ways {
    /// Of the people of some scenes, each with its seed and preset.
    pub fn simulate(scenes: &[(u64, Preset)], people: usize, radius_m: f64) -> Self {
        let mut ways = Vec::new();
        for &(seed, preset) in scenes {
            for trajectory in circle_crossing(preset, people, radius_m, seed).trajectories {
                let frames = (1..).map_while(|frame| {
                    let time_ns = frame * STEP_NS;
                    let arrived = trajectory.arrived_ns.is_some_and(|arrived_ns| time_ns > arrived_ns);
                    trajectory.at(time_ns).filter(|_| !arrived).map(|(position_m, _)| position_m)
                });
                ways.push(frames.collect::<Vec<_>>());
            }
        }
        let mut windows = 0;
        let ends = ways.iter().map(|way| {
            windows += (way.len() + 1).saturating_sub(POSITIONS);
            windows
        });
        Self { ends: ends.collect(), ways }
    }

    /// How many windows there are.
    pub fn windows(&self) -> usize {
        self.ends.last().copied().unwrap_or(0)
    }

    /// A window by its number, with noise.
    pub fn window(&self, number: usize, noise: Noise, rng: &mut Pcg64) -> Window {
        let way = self.ends.partition_point(|&end| end <= number);
        let first = number - if way == 0 { 0 } else { self.ends[way - 1] };
        let mut positions_m: [DVec2; POSITIONS] = self.ways[way][first..][..POSITIONS].try_into().unwrap();
        if noise.white_m > 0.0 || noise.lasting_m > 0.0 {
            disturb(&mut positions_m[..OBSERVED], noise, rng);
        }
        Window {
            observed_m: std::array::from_fn(|i| positions_m[i + 1] - positions_m[i]),
            coming_m: std::array::from_fn(|i| positions_m[OBSERVED + i] - positions_m[OBSERVED + i - 1]),
        }
    }

    /// Windows drawn at random; the same for the same seed.
    pub fn draw(&self, count: usize, noise: Noise, seed: u64) -> Vec<Window> {
        let mut rng = Pcg64::seed_from_u64(seed);
        (0..count)
            .map(|_| {
                let number = rng.random_range(0..self.windows());
                self.window(number, noise, &mut rng)
            })
            .collect()
    }
}

fn disturb(positions_m: &mut [DVec2], noise: Noise, rng: &mut Pcg64) {
    const KEPT: f64 = 0.9;
    let (white_m, lasting_m) = (noise.white_m * rng.random::<f64>(), noise.lasting_m * rng.random::<f64>());
    let mut normal = || DVec2::new(StandardNormal.sample(&mut *rng), StandardNormal.sample(&mut *rng));
    let mut lasting = normal() * lasting_m;
    for position_m in positions_m {
        *position_m += lasting + normal() * white_m;
        lasting = lasting * KEPT + normal() * (lasting_m * (1.0 - KEPT * KEPT).sqrt());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXACT: Noise = Noise { white_m: 0.0, lasting_m: 0.0 };

    fn ways() -> Ways {
        Ways::simulate(&[(1, Preset::Orca03), (2, Preset::Orca03)], 3, 5.0)
    }

    #[test]
    fn every_window_lies_within_one_way() {
        let (ways, mut rng) = (ways(), Pcg64::seed_from_u64(1));
        assert!(ways.windows() > 200);
        for number in 0..ways.windows() {
            let window = ways.window(number, EXACT, &mut rng);
            for displacement_m in window.observed_m.iter().chain(&window.coming_m) {
                assert!(displacement_m.length() < 0.11, "1 m/s at most: {displacement_m}");
            }
        }
    }

    #[test]
    fn noise_stays_in_what_is_observed() {
        let ways = ways();
        let noise = Noise { white_m: 0.1, lasting_m: 0.1 };
        let mut rng = Pcg64::seed_from_u64(1);
        let (exact, noisy) = (ways.window(50, EXACT, &mut rng), ways.window(50, noise, &mut rng));
        assert_ne!(exact.observed_m[0], noisy.observed_m[0]);
        assert_ne!(exact.coming_m[0], noisy.coming_m[0]);
        assert_eq!(exact.coming_m[1..], noisy.coming_m[1..]);
    }
}
