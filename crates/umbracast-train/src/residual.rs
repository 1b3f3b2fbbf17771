//! The residual network as tensors, its loss, and its fit: the same equations as `umbracast::forecast::residual`,
//! which runs it.

use std::f64::consts::{PI, TAU};

use burn::tensor::activation::silu;
use burn::tensor::{Device, Tensor, TensorData};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use umbracast::forecast::inputs::{INPUTS, mirror};
use umbracast::forecast::residual::{
    COEFFICIENT_M, COEFFICIENTS, DENSITY_M2PS3, LOG_DENSITY_LIMIT, LOG_FACTOR_LIMIT, OUTPUTS, RHO_LIMIT,
    SPREAD, UNITS,
};
use umbracast::{Error, STEP_S, STEPS};

use crate::adam::{Adam, gradients};
use crate::network::Network;
use crate::samples::Sample;
use crate::weights::to_safetensors;

/// Of the network's tensors in a weights file.
pub const NAMES: [&str; 6] =
    ["first.weight", "first.bias", "second.weight", "second.bias", "head.weight", "head.bias"];
/// Steps with the present.
const TIMES: usize = STEPS + 1;
/// Weight of the mean distance, in nats a metre, beside the likelihood: this one cares for those who walk straight
/// on, whom it knows to the centimetre; a mean must be right for those as well who do not.
const DISTANCE_WEIGHT: f64 = 10.0;
/// Longest gradient an update follows.
const CLIP: f64 = 1.0;
const LEARNING_RATE: f64 = 2e-3;
const BATCH: usize = 512;

/// How long and from where it is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FitOptions {
    /// Of the first weights and the order of the samples.
    pub seed: u64,
    /// Passes over the samples.
    pub epochs: usize,
}

/// Fits the network; each epoch sees every sample once, mirrored or not. Returns the weights file. `told` is called
/// with each epoch's mean loss.
///
/// # Errors
/// Too few samples, or tensors that cannot be read back.
pub fn fit(samples: &[Sample], options: FitOptions, mut told: impl FnMut(f64)) -> Result<Vec<u8>, Error> {
    let batches = samples.len() / BATCH;
    if batches == 0 {
        return Err(Error::new(format!("training: expected {BATCH} samples, found {}", samples.len())));
    }
    let device = Device::flex();
    let shapes = [[UNITS, INPUTS], [1, UNITS], [UNITS, UNITS], [1, UNITS], [OUTPUTS, UNITS], [1, OUTPUTS]];
    let fan = [INPUTS, INPUTS, UNITS, UNITS, UNITS, UNITS];
    let mut network = Network::uniform(shapes, fan, options.seed, &device);
    // It starts as the filter's own forecast.
    network.tensors[4] = network.tensors[4].clone() * 0.1;
    network.tensors[5] = network.tensors[5].zeros_like();
    let mut adam = Adam::new(&network);
    let mut order: Vec<usize> = (0..samples.len()).collect();
    let mut rng = Pcg64::seed_from_u64(options.seed);
    for _ in 0..options.epochs {
        order.shuffle(&mut rng);
        let mut total = 0.0;
        for batch in order.chunks_exact(BATCH) {
            let batch = Batch::of(samples, batch, &mut rng, &device);
            let tracked = network.tracked();
            let loss = batch.loss(outputs(&tracked, batch.inputs.clone()));
            let gradients = gradients(&tracked, loss.backward());
            total += f64::from(loss.into_scalar::<f32>());
            let done = adam.updates as f64 / (options.epochs * batches) as f64;
            let rate = LEARNING_RATE * 0.5 * (1.0 + (PI * done).cos());
            network = adam.update(network, gradients, rate, CLIP);
        }
        told(total / batches as f64);
    }
    to_safetensors(&NAMES, &[("", &network)], None)
}

/// What the network says, [samples, OUTPUTS].
pub fn outputs(network: &Network<6>, inputs: Tensor<2>) -> Tensor<2> {
    let [first, first_bias, second, second_bias, head, head_bias] = &network.tensors;
    let layer = |x: Tensor<2>, weight: &Tensor<2>, bias: &Tensor<2>| {
        x.matmul(weight.clone().transpose()) + bias.clone()
    };
    let hidden = silu(layer(silu(layer(inputs, first, first_bias)), second, second_bias));
    layer(hidden, head, head_bias)
}

/// Samples side by side.
struct Batch {
    inputs: Tensor<2>,
    /// Of position and velocity, along and across: [samples, 1] each.
    sigmas: [[Tensor<2>; 2]; 2],
    /// Along and across, [samples, TIMES].
    departure_m: [Tensor<2>; 2],
}

impl Batch {
    fn of(samples: &[Sample], chosen: &[usize], rng: &mut Pcg64, device: &Device) -> Self {
        let signs = mirror();
        let (mut inputs, mut sigmas) = (Vec::new(), [const { Vec::new() }; 4]);
        let mut departures = [const { Vec::new() }; 2];
        for &i in chosen {
            let sample = &samples[i];
            let mirrored = rng.random::<bool>();
            let sign = |i: usize| if mirrored { signs[i] } else { 1.0 };
            inputs.extend((0..INPUTS).map(|i| sample.seen.inputs[i] * sign(i)));
            sigmas.iter_mut().zip(sample.seen.sigmas).for_each(|(all, sigma)| all.push(sigma as f32));
            let across = if mirrored { -1.0 } else { 1.0 };
            departures[0].extend(sample.departure_m.map(|d| d[0]));
            departures[1].extend(sample.departure_m.map(|d| d[1] * across));
        }
        let rows = chosen.len();
        let columns = |values: Vec<f32>| {
            let shape = [rows, values.len() / rows];
            Tensor::from_data(TensorData::new(values, shape), device)
        };
        let [along, across, along_mps, across_mps] = sigmas.map(columns);
        Self {
            inputs: columns(inputs),
            sigmas: [[along, along_mps], [across, across_mps]],
            departure_m: departures.map(columns),
        }
    }

    /// The mean over samples and times of the negative log-likelihood, nats, and of the weighed distance.
    fn loss(&self, outputs: Tensor<2>) -> Tensor<1> {
        let device = outputs.device();
        let times = |of: &dyn Fn(f64) -> f64| -> Tensor<2> {
            let values: Vec<f32> = (0..TIMES).map(|step| of(step as f64 * STEP_S) as f32).collect();
            Tensor::from_data(TensorData::new(values, [1, TIMES]), &device)
        };
        let column = |at: usize| outputs.clone().narrow(1, at, 1);
        let share = |t: f64| t / (STEPS as f64 * STEP_S);
        let [(along, along_m2), (across, across_m2)] = [0, 1].map(|axis| {
            let mean = |power: i32| {
                column(axis * COEFFICIENTS + power as usize - 1)
                    .matmul(times(&|t| COEFFICIENT_M * share(t).powi(power)))
            };
            let off_m = self.departure_m[axis].clone() - (mean(1) + mean(2) + mean(3));
            let spread = |at: usize| column(2 * COEFFICIENTS + axis * SPREAD + at);
            let factor = |log: Tensor<2>| log.clamp(-LOG_FACTOR_LIMIT, LOG_FACTOR_LIMIT).exp();
            let position_m = self.sigmas[axis][0].clone() * factor(spread(0));
            let velocity_mps = self.sigmas[axis][1].clone() * factor(spread(1));
            let both = spread(2).tanh() * RHO_LIMIT * position_m.clone() * velocity_mps.clone();
            let density =
                (spread(3) * 2.0).clamp(-LOG_DENSITY_LIMIT, LOG_DENSITY_LIMIT).exp() * DENSITY_M2PS3;
            let variance_m2 = position_m.square().matmul(times(&|_| 1.0))
                + both.matmul(times(&|t| 2.0 * t))
                + velocity_mps.square().matmul(times(&|t| t * t))
                + density.matmul(times(&|t| t.powi(3) / 3.0));
            let squared = off_m.square();
            let nats = (squared.clone() / variance_m2.clone() + variance_m2.log() + TAU.ln()) * 0.5;
            (nats, squared)
        });
        // Smooth at 0.
        let distance_m = (along_m2 + across_m2 + 1e-4).sqrt();
        (along + across + distance_m * DISTANCE_WEIGHT).mean()
    }
}
