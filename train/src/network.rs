//! The paper's network as tensors, for its gradients: the same equations as `umbracast::forecast::lstm`, which
//! runs it.

use std::f64::consts::TAU;

use burn::tensor::activation::{relu, sigmoid, softplus, tanh};
use burn::tensor::{Device, Tensor, TensorData};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use umbracast::forecast::lstm::{HEAD, RHO_LIMIT, SIGMA_FLOOR_M, SIGMA_SCALE_M};

/// How many tensors the network has.
pub const TENSORS: usize = 8;
/// Their names in a weights file, in the order of [`Network::tensors`].
pub const NAMES: [&str; TENSORS] = [
    "emb.weight",
    "emb.bias",
    "enc.weight_ih",
    "enc.weight_hh",
    "enc.bias_ih",
    "enc.bias_hh",
    "dec.weight",
    "dec.bias",
];

/// Widths of the layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Of the embedding; the paper has 64.
    pub embedded: usize,
    /// Of the hidden state; the paper has 512.
    pub units: usize,
}

impl Size {
    /// Rows and columns of each tensor, as PyTorch has them; a bias is a row.
    pub fn shapes(self) -> [[usize; 2]; TENSORS] {
        let (e, h) = (self.embedded, self.units);
        [[e, 2], [1, e], [4 * h, e], [4 * h, h], [1, 4 * h], [1, 4 * h], [HEAD, h], [1, HEAD]]
    }
}

/// A network, or anything with one number for each of its weights (a gradient, a moment). By default the paper's.
#[derive(Debug, Clone)]
pub struct Network<const N: usize = TENSORS> {
    /// In the order of their names.
    pub tensors: [Tensor<2>; N],
}

impl<const N: usize> Network<N> {
    /// As PyTorch starts its layers: every weight and bias uniform within one over the root of its layer's inputs
    /// (for an LSTM: of its units). `shapes` are rows and columns; a bias is a row.
    pub fn uniform(shapes: [[usize; 2]; N], fan: [usize; N], seed: u64, device: &Device) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        Self {
            tensors: std::array::from_fn(|i| {
                let bound = 1.0 / (fan[i] as f32).sqrt();
                let count = shapes[i][0] * shapes[i][1];
                let values: Vec<f32> = (0..count).map(|_| rng.random_range(-bound..bound)).collect();
                Tensor::from_data(TensorData::new(values, shapes[i]), device)
            }),
        }
    }

    /// The same with gradients recorded.
    pub fn tracked(&self) -> Self {
        Self { tensors: self.tensors.each_ref().map(|t| t.clone().autodiff().require_grad()) }
    }
}

/// What an LSTM layer carries from step to step, each [windows, units].
struct State {
    hidden: Tensor<2>,
    cell: Tensor<2>,
}

impl Network {
    /// The paper's network before training.
    pub fn fresh(size: Size, seed: u64, device: &Device) -> Self {
        let fan = [2, 2, size.units, size.units, size.units, size.units, size.units, size.units];
        Self::uniform(size.shapes(), fan, seed, device)
    }

    /// Raw outputs of the head, [windows, 5] for each of `steps`, from the observed displacements, [windows, 2]
    /// each, oldest first. Fed with its own mean after the last of them.
    pub fn roll_out(&self, observed_m: &[Tensor<2>], steps: usize) -> Vec<Tensor<2>> {
        let windows = observed_m[0].dims()[0];
        let inputs = self.input_part(Tensor::cat(observed_m.to_vec(), 0));
        let units = self.tensors[3].dims()[1];
        let zero = Tensor::zeros([windows, units], &inputs.device());
        let mut state = State { hidden: zero.clone(), cell: zero };
        for input in inputs.split(windows, 0) {
            state = self.step(input, state);
        }
        let mut outputs = vec![self.head(&state)];
        while outputs.len() < steps {
            let mean_m = outputs[outputs.len() - 1].clone().narrow(1, 0, 2);
            state = self.step(self.input_part(mean_m), state);
            outputs.push(self.head(&state));
        }
        outputs
    }

    /// Eq. (1a), e = ReLU(W_emb dx), and its part of the gates.
    fn input_part(&self, displacements_m: Tensor<2>) -> Tensor<2> {
        let [emb_weight, emb_bias, weight_ih, _, bias_ih, bias_hh, ..] = &self.tensors;
        let embedded = relu(displacements_m.matmul(emb_weight.clone().transpose()) + emb_bias.clone());
        embedded.matmul(weight_ih.clone().transpose()) + (bias_ih.clone() + bias_hh.clone())
    }

    /// Eq. (1b), h = LSTM(h, e; W_enc). Gates stand in the order i f g o.
    fn step(&self, input_part: Tensor<2>, state: State) -> State {
        let gates = input_part + state.hidden.matmul(self.tensors[3].clone().transpose());
        let units = gates.dims()[1] / 4;
        let gate = |index: usize| gates.clone().narrow(1, index * units, units);
        let cell = sigmoid(gate(1)) * state.cell + sigmoid(gate(0)) * tanh(gate(2));
        State { hidden: sigmoid(gate(3)) * tanh(cell.clone()), cell }
    }

    /// Eq. (2), [mu, sigma, rho] = W_dec h, before sigma and rho are squashed.
    fn head(&self, state: &State) -> Tensor<2> {
        state.hidden.clone().matmul(self.tensors[6].clone().transpose()) + self.tensors[7].clone()
    }
}

/// Mean negative log-likelihood of a displacement (the paper's loss), from raw outputs and true displacements of
/// as many steps, [windows, 5] and [windows, 2] each.
pub fn loss(outputs: Vec<Tensor<2>>, truth_m: Vec<Tensor<2>>) -> Tensor<1> {
    let (raw, truth_m) = (Tensor::cat(outputs, 0), Tensor::cat(truth_m, 0));
    let sigma_m = softplus(raw.clone().narrow(1, 2, 2), 1.0) * SIGMA_SCALE_M + SIGMA_FLOOR_M;
    let rho = tanh(raw.clone().narrow(1, 4, 1)) * RHO_LIMIT;
    let z = (truth_m - raw.narrow(1, 0, 2)) / sigma_m.clone();
    let (z_x, z_y) = (z.clone().narrow(1, 0, 1), z.narrow(1, 1, 1));
    let kept = -(rho.clone() * rho.clone()) + 1.0;
    let mahalanobis =
        (z_x.clone() * z_x.clone() + z_y.clone() * z_y.clone() - rho * z_x * z_y * 2.0) / kept.clone();
    let log_area = sigma_m.log().sum_dim(1) + kept.log() * 0.5 + TAU.ln();
    (log_area + mahalanobis * 0.5).mean()
}
