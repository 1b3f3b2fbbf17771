//! A layer of a network, with its gradient written out.

use rand::RngExt;
use rand_pcg::Pcg64;

use crate::weights::Entry;

/// [outputs, inputs] row by row, and a bias for each output; or anything with one number for each of them: their gradient.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layer {
    pub(crate) weight: Vec<f64>,
    pub(crate) bias: Vec<f64>,
}

impl Layer {
    pub(crate) fn zeros(inputs: usize, outputs: usize) -> Self {
        Self { weight: vec![0.0; inputs * outputs], bias: vec![0.0; outputs] }
    }

    /// As PyTorch starts its layers: every weight and bias uniform within one over the root of the inputs.
    pub(crate) fn fresh(inputs: usize, outputs: usize, rng: &mut Pcg64) -> Self {
        let bound = 1.0 / (inputs as f32).sqrt();
        let mut draw = |count| (0..count).map(|_| f64::from(rng.random_range(-bound..bound))).collect();
        Self { weight: draw(inputs * outputs), bias: draw(outputs) }
    }

    /// For a weights file, in PyTorch's layout.
    pub(crate) fn entries(&self, name: &str) -> [(String, Entry); 2] {
        let entry = |shape: &[usize], values: &[f64]| Entry::new(shape, values.iter().map(|&v| v as f32));
        let outputs = self.bias.len();
        [
            (format!("{name}.weight"), entry(&[outputs, self.weight.len() / outputs], &self.weight)),
            (format!("{name}.bias"), entry(&[outputs], &self.bias)),
        ]
    }

    /// Every number in a fixed order.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> {
        self.weight.iter().chain(&self.bias).copied()
    }

    /// The same, to be changed.
    pub(crate) fn numbers_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        self.weight.iter_mut().chain(&mut self.bias)
    }

    #[inline(always)]
    pub(crate) fn of<const IN: usize, const OUT: usize>(&self, inputs: &[f64; IN]) -> [f64; OUT] {
        std::array::from_fn(|output| self.bias[output] + dot(&self.weight[output * IN..][..IN], inputs))
    }

    /// Adds the gradient to the layer's weights; returns the one to its inputs.
    #[inline(always)]
    pub(crate) fn back<const IN: usize, const OUT: usize>(
        &self,
        inputs: &[f64; IN],
        to_outputs: &[f64; OUT],
        gradient: &mut Self,
    ) -> [f64; IN] {
        let mut to_inputs = [0.0; IN];
        let rows = self.weight.chunks_exact(IN).zip(gradient.weight.chunks_exact_mut(IN));
        for ((row, to_row), (to_bias, to_output)) in rows.zip(gradient.bias.iter_mut().zip(to_outputs)) {
            *to_bias += to_output;
            for k in 0..IN {
                to_row[k] += to_output * inputs[k];
                to_inputs[k] += to_output * row[k];
            }
        }
        to_inputs
    }
}

/// In eight sums side by side, which the processor adds at once.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a_eights, b_eights) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_eights.remainder().iter().zip(b_eights.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; 8];
    for (a, b) in a_eights.zip(b_eights) {
        (0..8).for_each(|k| sums[k] += a[k] * b[k]);
    }
    sums.iter().sum::<f64>() + rest
}
