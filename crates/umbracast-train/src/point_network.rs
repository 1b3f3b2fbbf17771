//! The network that looks at the points of one body, its gradient written out, and its fit: the same equations as
//! `umbracast::detect::point_network`, which runs it.

use std::f64::consts::PI;

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use umbracast::Error;
use umbracast::detect::point_network::{BODY_UNITS, OUTPUTS, POINT_UNITS, POOLED};
use umbracast::detect::pose_view::{OF_BODY, OF_POINT, POINTS, PoseView};

use crate::adam::Adam;
use crate::layer::Layer;
use crate::truth::Truth;
use crate::weights::to_safetensors;

pub(crate) const EPOCHS: usize = 20;
pub(crate) const SEED: u64 = 1;
const BATCH: usize = 512;
/// Samples of a batch that a thread takes at once: summed in order, so that threads do not change the sum.
const PART: usize = 64;
const RATE: f64 = 3e-3;
/// The rate rises for this share of the fit, then falls to nothing.
const RISES: f64 = 0.3;
/// Of this share of the samples the body is made so much smaller or larger, for people of every size come.
const SCALED: f64 = 0.2;
const SCALES: std::ops::Range<f64> = 0.55..1.1;
const FIRST: usize = POINT_UNITS[0];
const SECOND: usize = POINT_UNITS[1];
const THIRD: usize = POINT_UNITS[2];
const FOURTH: usize = BODY_UNITS[0];
const FIFTH: usize = BODY_UNITS[1];
/// Names of the layers in a weights file, with their inputs and outputs.
const LAYERS: [(&str, usize, usize); 6] = [
    ("points.0", OF_POINT, FIRST),
    ("points.1", FIRST, SECOND),
    ("points.2", SECOND, THIRD),
    ("body.0", POOLED, FOURTH),
    ("body.1", FOURTH, FIFTH),
    ("body.2", FIFTH, OUTPUTS),
];

/// A body as it was seen, and what the network shall say of it.
#[derive(Debug, Clone)]
pub(crate) struct Sample {
    pub(crate) view: PoseView,
    pub(crate) truth: Truth,
}

/// Fits a network with Adam on the negative log-likelihood; returns the weights file.
///
/// # Errors
/// Fewer samples than a batch.
pub(crate) fn fit(samples: &[Sample]) -> Result<Vec<u8>, Error> {
    let batches = samples.len() / BATCH;
    if batches == 0 {
        return Err(Error::new(format!("training: expected {BATCH} samples, found {}", samples.len())));
    }
    let mut rng = Pcg64::seed_from_u64(SEED);
    let mut network = Network { layers: LAYERS.map(|(_, i, o)| Layer::fresh(i, o, &mut rng)) };
    let mut adam = Adam::new(network.numbers().count());
    let mut order: Vec<usize> = (0..samples.len()).collect();
    for _ in 0..EPOCHS {
        order.shuffle(&mut rng);
        for batch in order.chunks_exact(BATCH) {
            let batch: Vec<Sample> = batch.iter().map(|&i| resized(&samples[i], &mut rng)).collect();
            let gradient = network.gradient(&batch);
            let done = f64::from(adam.updates()) / (EPOCHS * batches) as f64;
            let rate = match done < RISES {
                true => RATE * (0.04 + 0.96 * done / RISES),
                false => RATE * 0.5 * (1.0 + (PI * (done - RISES) / (1.0 - RISES)).cos()),
            };
            adam.update(network.numbers_mut(), gradient.numbers(), rate);
        }
    }
    let entries = LAYERS.iter().zip(&network.layers).flat_map(|((name, ..), layer)| layer.entries(name));
    to_safetensors(entries.collect(), None)
}

fn resized(sample: &Sample, rng: &mut Pcg64) -> Sample {
    if !rng.random_bool(SCALED) {
        return sample.clone();
    }
    let share = rng.random_range(SCALES);
    Sample { view: sample.view.scaled(share as f32), truth: sample.truth.scaled(share) }
}

/// A network, or anything with one number for each of its weights: its gradient.
#[derive(Debug, Clone)]
struct Network {
    layers: [Layer; 6],
}

impl Network {
    fn zeros() -> Self {
        Self { layers: LAYERS.map(|(_, inputs, outputs)| Layer::zeros(inputs, outputs)) }
    }

    fn numbers(&self) -> impl Iterator<Item = f64> {
        self.layers.iter().flat_map(Layer::numbers)
    }

    fn numbers_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        self.layers.iter_mut().flat_map(Layer::numbers_mut)
    }

    /// Of the mean loss of a batch.
    fn gradient(&self, batch: &[Sample]) -> Self {
        let share = 1.0 / batch.len() as f64;
        let parts: Vec<Self> = batch
            .par_chunks(PART)
            .map(|part| {
                let mut gradient = Self::zeros();
                for sample in part {
                    let pass = self.pass(&sample.view);
                    let to_outputs = sample.truth.loss(&pass.outputs).1.map(|slope| share * slope);
                    self.add_gradient(&sample.view, &pass, &to_outputs, &mut gradient);
                }
                gradient
            })
            .collect();
        parts.iter().fold(Self::zeros(), |mut sum, part| {
            sum.numbers_mut().zip(part.numbers()).for_each(|(sum, slope)| *sum += slope);
            sum
        })
    }

    umbracast::wide! {
        /// Adds the gradient to the weights of a pass, from that to its outputs.
        fn add_gradient(&self, view: &PoseView, pass: &Pass, to_outputs: &[f64; OUTPUTS], gradient: &mut Self)
            = add_gradient_avx2 or add_gradient_portably
    }

    #[inline(always)]
    fn add_gradient_portably(
        &self,
        view: &PoseView,
        pass: &Pass,
        to_outputs: &[f64; OUTPUTS],
        gradient: &mut Self,
    ) {
        let [first, second, third, fourth, fifth, head] = &self.layers;
        let [to_first, to_second, to_third, to_fourth, to_fifth, to_head] = &mut gradient.layers;
        let back = head.back(&pass.fifth, to_outputs, to_head);
        let back = fifth.back(&pass.fourth, &rectified(&pass.fifth, back), to_fifth);
        let to_pooled: [f64; POOLED] = fourth.back(&pass.pooled, &rectified(&pass.fourth, back), to_fourth);
        let n = view.of_points().len();
        for (k, point) in view.of_points().iter().enumerate() {
            let to_point: [f64; THIRD] = std::array::from_fn(|u| {
                let of_largest = if pass.largest[u] == k { to_pooled[u] } else { 0.0 };
                of_largest + to_pooled[THIRD + u] / n as f64
            });
            let back = third.back(&pass.second[k], &to_point, to_third);
            let back = second.back(&pass.first[k], &rectified(&pass.second[k], back), to_second);
            first.back(&point.map(f64::from), &rectified(&pass.first[k], back), to_first);
        }
    }

    umbracast::wide! {
        fn pass(&self, view: &PoseView) -> Pass = pass_avx2 or pass_portably
    }

    #[inline(always)]
    fn pass_portably(&self, view: &PoseView) -> Pass {
        let [first, second, third, fourth, fifth, head] = &self.layers;
        let mut pass = Pass {
            first: [[0.0; FIRST]; POINTS],
            second: [[0.0; SECOND]; POINTS],
            largest: [0; THIRD],
            pooled: [0.0; POOLED],
            fourth: [0.0; FOURTH],
            fifth: [0.0; FIFTH],
            outputs: [0.0; OUTPUTS],
        };
        let share = 1.0 / view.of_points().len().max(1) as f64;
        pass.pooled[..THIRD].fill(f64::MIN);
        for (k, point) in view.of_points().iter().enumerate() {
            pass.first[k] = rectify(first.of(&point.map(f64::from)));
            pass.second[k] = rectify(second.of(&pass.first[k]));
            let given: [f64; THIRD] = third.of(&pass.second[k]);
            for u in 0..THIRD {
                if given[u] > pass.pooled[u] {
                    (pass.pooled[u], pass.largest[u]) = (given[u], k);
                }
                pass.pooled[THIRD + u] += share * given[u];
            }
        }
        pass.pooled[2 * THIRD..].copy_from_slice(&view.of_body.map(f64::from)[..OF_BODY]);
        pass.fourth = rectify(fourth.of(&pass.pooled));
        pass.fifth = rectify(fifth.of(&pass.fourth));
        pass.outputs = head.of(&pass.fifth);
        pass
    }
}

/// What the way back needs of the way there.
struct Pass {
    /// Of each point.
    first: [[f64; FIRST]; POINTS],
    second: [[f64; SECOND]; POINTS],
    /// The point that gave the largest of each number.
    largest: [usize; THIRD],
    pooled: [f64; POOLED],
    fourth: [f64; FOURTH],
    fifth: [f64; FIFTH],
    outputs: [f64; OUTPUTS],
}

#[inline(always)]
fn rectify<const N: usize>(sums: [f64; N]) -> [f64; N] {
    sums.map(|x| x.max(0.0))
}

/// From the gradient to what a layer gives after it was rectified, the gradient to its sums.
#[inline(always)]
fn rectified<const N: usize>(given: &[f64; N], to_given: [f64; N]) -> [f64; N] {
    std::array::from_fn(|u| if given[u] > 0.0 { to_given[u] } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use umbracast::detect::point_network::PointNetwork;
    use umbracast::detect::pose::UNIT_M;
    use umbracast::detect::{Point, SHIFT_M};
    use umbracast::geometry::{DVec2, DVec3};

    use crate::pose::pose;

    /// Somebody of some points on a disc of a radius that its height tells, before a sensor: the axis is the disc's middle.
    fn sample(rng: &mut Pcg64) -> Sample {
        let sensor_m = DVec3::new(-10.0, 0.0, 5.0);
        let middle_m = DVec2::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
        let radius_m = rng.random_range(0.05..0.2);
        let points: Vec<Point> = (0..40)
            .map(|_| {
                let at_m = middle_m - DVec2::from_angle(rng.random_range(-1.5..1.5)) * radius_m;
                let position_m = at_m.extend(10.0 * radius_m * rng.random_range(0.2..1.0));
                Point { position_m, time_ns: 0, sensor: 0 }
            })
            .collect();
        let view = PoseView::new(&mut Vec::new(), points.iter(), &[sensor_m], 0.0, SHIFT_M, None);
        Sample { truth: Truth::at_offset(&view, middle_m - view.base_m), view }
    }

    fn samples(n: usize) -> Vec<Sample> {
        let mut rng = Pcg64::seed_from_u64(2);
        (0..n).map(|_| sample(&mut rng)).collect()
    }

    #[test]
    fn a_law_is_learned_and_the_runtime_says_what_was_fitted() {
        let all = samples(8 * BATCH + 100);
        let (training, held_out) = all.split_at(8 * BATCH);
        let model = PointNetwork::from_safetensors(&fit(training).unwrap()).unwrap();
        let rmse_m = |of: &dyn Fn(&Sample) -> DVec2| {
            let squares: f64 = held_out.iter().map(|s| of(s).length_squared()).sum();
            (squares / held_out.len() as f64).sqrt()
        };
        let off_m = |s: &Sample| (s.view.along * s.truth.off[0] + s.view.across * s.truth.off[1]) * UNIT_M;
        let (before_m, after_m) =
            (rmse_m(&off_m), rmse_m(&|s| pose(&model, &s.view).position_m - s.view.base_m - off_m(s)));
        assert!(after_m < 0.5 * before_m, "{after_m} m, {before_m} m before");
    }

    #[test]
    fn the_slope_is_that_of_finite_differences() {
        const MOVED: f64 = 1e-6;
        let mut rng = Pcg64::seed_from_u64(3);
        let network = Network { layers: LAYERS.map(|(_, i, o)| Layer::fresh(i, o, &mut rng)) };
        let sample = &samples(1)[0];
        let mut slope = Network::zeros();
        let pass = network.pass(&sample.view);
        network.add_gradient(&sample.view, &pass, &sample.truth.loss(&pass.outputs).1, &mut slope);
        let largest = slope.numbers().fold(0.0_f64, |largest, slope| largest.max(slope.abs()));
        assert!(largest > 0.1, "a slope that tells something");
        for (i, found) in slope.numbers().enumerate().step_by(7) {
            let moved = |by: f64| {
                let mut network = network.clone();
                *network.numbers_mut().nth(i).unwrap() += by;
                sample.truth.loss(&network.pass(&sample.view).outputs).0
            };
            let expected = (moved(MOVED) - moved(-MOVED)) / (2.0 * MOVED);
            assert!((found - expected).abs() < 1e-5 * largest, "weight {i}: {found}, expected {expected}");
        }
    }
}
