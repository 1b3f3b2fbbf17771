//! The residual network, its loss with the gradient written out, and its fit: the same equations as
//! `umbracast::forecast::residual`, which runs it.

use std::array::from_fn;
use std::f64::consts::{PI, TAU};

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use umbracast::forecast::constant_velocity::ACCELERATION_PSD_M2PS3;
use umbracast::forecast::inputs::{INPUTS, mirror};
use umbracast::forecast::residual::{
    COEFFICIENT_M, COEFFICIENTS, LOG_DENSITY_LIMIT, LOG_FACTOR_LIMIT, OUTPUTS, RHO_LIMIT, SPREAD, UNITS,
};
use umbracast::{Error, STEP_S, STEPS};

use crate::adam::Adam;
use crate::layer::Layer;
use crate::samples::Sample;
use crate::weights::to_safetensors;

/// Names of the layers in a weights file, with their inputs and outputs.
const LAYERS: [(&str, usize, usize); 3] =
    [("first", INPUTS, UNITS), ("second", UNITS, UNITS), ("head", UNITS, OUTPUTS)];
/// Steps with the present.
const TIMES: usize = STEPS + 1;
/// Weight of the mean distance, in nats a metre, beside the likelihood: this one cares for those who walk straight
/// on, whom it knows to the centimetre; a mean must be right for those as well who do not.
const DISTANCE_WEIGHT: f64 = 10.0;
/// Rounds the distance off at 0, square metres.
const ROUNDED_M2: f64 = 1e-4;
/// Longest gradient an update follows.
const CLIP: f64 = 1.0;
const LEARNING_RATE: f64 = 2e-3;
const BATCH: usize = 512;
/// Samples of a batch that a thread takes at once: summed in order, so that threads do not change the sum.
const PART: usize = 64;

/// How long and from where it is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FitOptions {
    /// Of the first weights and the order of the samples.
    pub seed: u64,
    /// Passes over the samples.
    pub epochs: usize,
}

/// Fits the network; each epoch sees every sample once, mirrored or not. Returns the weights file. `epoch_done` is
/// called with each epoch's mean loss.
///
/// # Errors
/// Too few samples.
pub fn fit(
    samples: &[Sample],
    options: FitOptions,
    mut epoch_done: impl FnMut(f64),
) -> Result<Vec<u8>, Error> {
    let batches = samples.len() / BATCH;
    if batches == 0 {
        return Err(Error::new(format!("training: expected {BATCH} samples, found {}", samples.len())));
    }
    let mut network = Network::fresh(options.seed);
    // It starts as the filter's own forecast.
    network.layers[2].weight.iter_mut().for_each(|weight| *weight *= 0.1);
    network.layers[2].bias.fill(0.0);
    let mut adam = Adam::new(network.numbers().count());
    let mut order: Vec<usize> = (0..samples.len()).collect();
    let mut rng = Pcg64::seed_from_u64(options.seed);
    for _ in 0..options.epochs {
        order.shuffle(&mut rng);
        let mut total = 0.0;
        for batch in order.chunks_exact(BATCH) {
            let batch: Vec<Case> = batch.iter().map(|&i| Case::of(&samples[i], rng.random())).collect();
            let (loss, gradient) = network.gradient(&batch);
            total += loss;
            let done = f64::from(adam.updates()) / (options.epochs * batches) as f64;
            let rate = LEARNING_RATE * 0.5 * (1.0 + (PI * done).cos());
            let length = gradient.numbers().map(|slope| slope * slope).sum::<f64>().sqrt();
            let shortened = if length > CLIP { CLIP / length } else { 1.0 };
            adam.update(network.numbers_mut(), gradient.numbers().map(|slope| slope * shortened), rate);
        }
        epoch_done(total / batches as f64);
    }
    network.to_safetensors()
}

/// A sample as the network is trained on it, as it is or mirrored.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    inputs: [f64; INPUTS],
    /// Of position along and across, m, and of velocity along and across, m/s.
    sigmas: [f64; 4],
    /// Along and across, at each time, metres.
    departure_m: [[f64; TIMES]; 2],
}

impl Case {
    /// Of a sample.
    pub fn of(sample: &Sample, mirrored: bool) -> Self {
        let signs = if mirrored { mirror() } else { [1.0; INPUTS] };
        let across = if mirrored { -1.0 } else { 1.0 };
        Self {
            inputs: from_fn(|i| f64::from(sample.seen.inputs[i] * signs[i])),
            sigmas: sample.seen.sigmas,
            departure_m: [(0, 1.0), (1, across)]
                .map(|(axis, sign)| from_fn(|time| sign * f64::from(sample.departure_m[time][axis]))),
        }
    }
}

/// A network, or anything with one number for each of its weights: its gradient.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    layers: [Layer; 3],
}

impl Network {
    /// As PyTorch starts its layers: every weight and bias uniform within one over the root of its layer's inputs.
    pub fn fresh(seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        Self { layers: LAYERS.map(|(_, inputs, outputs)| Layer::fresh(inputs, outputs, &mut rng)) }
    }

    /// The weights file, PyTorch's layout.
    ///
    /// # Errors
    /// None that a network of these shapes can cause.
    pub fn to_safetensors(&self) -> Result<Vec<u8>, Error> {
        let entries = LAYERS.iter().zip(&self.layers).flat_map(|((name, ..), layer)| layer.entries(name));
        to_safetensors(entries.collect(), None)
    }

    /// Every weight in a fixed order.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        self.layers.iter().flat_map(Layer::numbers)
    }

    /// The same, to be changed.
    pub fn numbers_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        self.layers.iter_mut().flat_map(Layer::numbers_mut)
    }

    /// What the network says.
    pub fn outputs(&self, inputs: &[f64; INPUTS]) -> [f64; OUTPUTS] {
        self.pass(inputs).outputs
    }

    /// The mean over cases and times of the negative log-likelihood, nats, and of the weighed distance; and its
    /// gradient.
    pub fn gradient(&self, cases: &[Case]) -> (f64, Self) {
        let zeros =
            || (0.0, Self { layers: LAYERS.map(|(_, inputs, outputs)| Layer::zeros(inputs, outputs)) });
        let share = 1.0 / (cases.len() * TIMES) as f64;
        let parts: Vec<(f64, Self)> = cases
            .par_chunks(PART)
            .map(|part| {
                let (mut loss, mut gradient) = zeros();
                part.iter().for_each(|case| loss += self.add_gradient(case, share, &mut gradient));
                (loss, gradient)
            })
            .collect();
        parts.iter().fold(zeros(), |(loss, mut sum), (part_loss, part)| {
            sum.numbers_mut().zip(part.numbers()).for_each(|(sum, slope)| *sum += slope);
            (loss + part_loss, sum)
        })
    }

    /// `share` of the sum over a case's times of its loss; adds as much of the gradient.
    fn add_gradient(&self, case: &Case, share: f64, gradient: &mut Self) -> f64 {
        let pass = self.pass(&case.inputs);
        let (loss, to_outputs) = loss(&pass.outputs, case);
        let [first, second, head] = &self.layers;
        let [to_first, to_second, to_head] = &mut gradient.layers;
        let to_hidden = head.back(&pass.bent[1], &to_outputs.map(|slope| share * slope), to_head);
        let to_hidden = second.back(&pass.bent[0], &unbent(&pass.straight[1], to_hidden), to_second);
        first.back(&case.inputs, &unbent(&pass.straight[0], to_hidden), to_first);
        share * loss
    }

    fn pass(&self, inputs: &[f64; INPUTS]) -> Pass {
        let [first, second, head] = &self.layers;
        // x sigmoid(x), as the runtime has it.
        let bend = |sums: &[f64; UNITS]| sums.map(|x| x / (1.0 + (-x).exp()));
        let one = first.of(inputs);
        let bent_one = bend(&one);
        let two = second.of(&bent_one);
        let bent_two = bend(&two);
        Pass { straight: [one, two], bent: [bent_one, bent_two], outputs: head.of(&bent_two) }
    }
}

/// What the way back needs of the way there.
struct Pass {
    /// The hidden layers' sums.
    straight: [[f64; UNITS]; 2],
    /// The same after their non-linearity.
    bent: [[f64; UNITS]; 2],
    outputs: [f64; OUTPUTS],
}

/// From the gradient to what a hidden layer gives, the gradient to its sums.
fn unbent(sums: &[f64; UNITS], to_bent: [f64; UNITS]) -> [f64; UNITS] {
    from_fn(|unit| {
        let sigmoid = 1.0 / (1.0 + (-sums[unit]).exp());
        to_bent[unit] * sigmoid * (1.0 + sums[unit] * (1.0 - sigmoid))
    })
}

/// The sum over a case's times of the negative log-likelihood, nats, and of the weighed distance; and its gradient to
/// the network's outputs.
fn loss(outputs: &[f64; OUTPUTS], case: &Case) -> (f64, [f64; OUTPUTS]) {
    let (mut loss, mut to_outputs) = (0.0, [0.0; OUTPUTS]);
    let spreads = [0, 1].map(|axis| Spread::of(outputs, case, axis));
    for time in 0..TIMES {
        let t = time as f64 * STEP_S;
        let share = time as f64 / STEPS as f64;
        // The mean's slope to each of its coefficients.
        let powers: [f64; COEFFICIENTS] = from_fn(|k| COEFFICIENT_M * share.powi(k as i32 + 1));
        let off_m = [0, 1].map(|axis| {
            let mean_m: f64 = (0..COEFFICIENTS).map(|k| powers[k] * outputs[axis * COEFFICIENTS + k]).sum();
            case.departure_m[axis][time] - mean_m
        });
        let distance_m = (off_m[0] * off_m[0] + off_m[1] * off_m[1] + ROUNDED_M2).sqrt();
        loss += DISTANCE_WEIGHT * distance_m;
        for axis in 0..2 {
            let (variance_m2, to_spread) = spreads[axis].variance_m2(t);
            let squares = off_m[axis] * off_m[axis] / variance_m2;
            loss += 0.5 * (squares + variance_m2.ln() + TAU.ln());
            let to_mean = -off_m[axis] * (1.0 / variance_m2 + DISTANCE_WEIGHT / distance_m);
            (0..COEFFICIENTS).for_each(|k| to_outputs[axis * COEFFICIENTS + k] += to_mean * powers[k]);
            let to_variance = 0.5 * (1.0 - squares) / variance_m2;
            let at = 2 * COEFFICIENTS + axis * SPREAD;
            (0..SPREAD).for_each(|k| to_outputs[at + k] += to_variance * to_spread[k]);
        }
    }
    (loss, to_outputs)
}

/// What the variance along an axis is made of: terms that count 1, 2 t, t^2 and t^3 / 3 times after t seconds.
struct Spread {
    /// Of the position's error now, of both errors together, of the velocity's, and of the acceleration to come.
    terms: [f64; 4],
    /// Of each term to each of the axis' outputs.
    slopes: [[f64; SPREAD]; 4],
}

impl Spread {
    fn of(outputs: &[f64; OUTPUTS], case: &Case, axis: usize) -> Self {
        let said = &outputs[2 * COEFFICIENTS + axis * SPREAD..][..SPREAD];
        // Beyond its limit an output moves nothing.
        let factor = |log: f64, limit: f64| {
            let moves = if log.abs() < limit { 1.0 } else { 0.0 };
            (log.clamp(-limit, limit).exp(), moves)
        };
        let (position, moves_position) = factor(said[0], LOG_FACTOR_LIMIT);
        let (velocity, moves_velocity) = factor(said[1], LOG_FACTOR_LIMIT);
        let (density, moves_density) = factor(2.0 * said[3], LOG_DENSITY_LIMIT);
        let (position_m, velocity_mps) = (case.sigmas[axis] * position, case.sigmas[2 + axis] * velocity);
        let squashed = said[2].tanh();
        let rho = RHO_LIMIT * squashed;
        let to_rho = RHO_LIMIT * (1.0 - squashed * squashed);
        let (position_m2, velocity_m2ps2) = (position_m * position_m, velocity_mps * velocity_mps);
        let (both, density_m2ps3) = (position_m * velocity_mps, ACCELERATION_PSD_M2PS3 * density);
        Self {
            terms: [position_m2, rho * both, velocity_m2ps2, density_m2ps3],
            slopes: [
                [2.0 * position_m2 * moves_position, 0.0, 0.0, 0.0],
                [rho * both * moves_position, rho * both * moves_velocity, to_rho * both, 0.0],
                [0.0, 2.0 * velocity_m2ps2 * moves_velocity, 0.0, 0.0],
                [0.0, 0.0, 0.0, 2.0 * density_m2ps3 * moves_density],
            ],
        }
    }

    /// After `t` seconds, and its slopes to the axis' outputs.
    fn variance_m2(&self, t: f64) -> (f64, [f64; SPREAD]) {
        let times = [1.0, 2.0 * t, t * t, t.powi(3) / 3.0];
        let sum = |of: &dyn Fn(usize) -> f64| (0..4).map(|term| times[term] * of(term)).sum::<f64>();
        (sum(&|term| self.terms[term]), from_fn(|output| sum(&|term| self.slopes[term][output])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::forecast::inputs::Seen;
    use umbracast::geometry::DVec2;

    fn cases() -> Vec<Case> {
        let mut rng = Pcg64::seed_from_u64(5);
        // More than one part.
        (0..PART + 7)
            .map(|i| {
                let seen = Seen {
                    ahead: DVec2::X,
                    inputs: from_fn(|_| rng.random_range(-2.0..2.0)),
                    sigmas: [0.03, 0.02, 0.2, 0.1],
                };
                let departure_m = from_fn(|_| from_fn(|_| rng.random_range(-0.2..0.2)));
                Case::of(&Sample { seen, departure_m }, i % 2 == 0)
            })
            .collect()
    }

    /// One that says something.
    fn network() -> Network {
        let mut network = Network::fresh(6);
        network.layers[2].weight.iter_mut().for_each(|weight| *weight *= 4.0);
        network
    }

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        const MOVED: f64 = 1e-6;
        let (network, cases) = (network(), cases());
        let (_, gradient) = network.gradient(&cases);
        let largest = gradient.numbers().fold(0.0_f64, |largest, slope| largest.max(slope.abs()));
        // Prime steps through every layer's weights, and every bias.
        let count = network.numbers().count();
        let mut seen = 0;
        for i in (0..count).step_by(37).chain(count - OUTPUTS..count) {
            let moved = |by: f64| {
                let mut network = network.clone();
                *network.numbers_mut().nth(i).unwrap() += by;
                network.gradient(&cases).0
            };
            let expected = (moved(MOVED) - moved(-MOVED)) / (2.0 * MOVED);
            let found = gradient.numbers().nth(i).unwrap();
            assert!((found - expected).abs() < 1e-6 * largest, "weight {i}: {found}, expected {expected}");
            seen += usize::from(found.abs() > 1e-4 * largest);
        }
        assert!(seen > 100, "only {seen} of the slopes tell anything");
    }

    #[test]
    fn what_lies_beyond_a_limit_moves_nothing() {
        let mut network = network();
        let spread = 2 * COEFFICIENTS;
        for (output, beyond) in [(0, 30.0), (1, -30.0), (3, 30.0)] {
            network.layers[2].bias[spread + output] = beyond;
        }
        let (_, gradient) = network.gradient(&cases());
        let to_bias = &gradient.layers[2].bias[spread..];
        assert!(to_bias[0] == 0.0 && to_bias[1] == 0.0 && to_bias[3] == 0.0, "{to_bias:?}");
        assert!(to_bias[SPREAD..].iter().all(|slope| *slope != 0.0), "{to_bias:?}");
    }

    #[test]
    fn any_number_of_threads_gives_the_same_gradient() {
        let (network, cases) = (network(), cases());
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| network.gradient(&cases))
        };
        assert!(on(1) == on(3));
    }
}
