//! Adam (Kingma and Ba, 2015, Algorithm 1), with gradients clipped by their common length.

use burn::tensor::Gradients;

use crate::network::{Network, TENSORS};

const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// Running moments of every weight.
#[derive(Debug, Clone)]
pub struct Adam<const N: usize = TENSORS> {
    /// Of the gradients.
    pub first: Network<N>,
    /// Of their squares.
    pub second: Network<N>,
    /// Updates so far.
    pub updates: u64,
}

impl<const N: usize> Adam<N> {
    /// Before the first update.
    pub fn new(network: &Network<N>) -> Self {
        let zero = Network { tensors: network.tensors.each_ref().map(|t| t.zeros_like()) };
        Self { first: zero.clone(), second: zero, updates: 0 }
    }

    /// The network after one step against its gradients, which are shortened to `longest` where they are longer.
    pub fn update(
        &mut self,
        network: Network<N>,
        gradients: Network<N>,
        rate: f64,
        longest: f64,
    ) -> Network<N> {
        self.updates += 1;
        let squares = gradients.tensors.iter().map(|g| g.clone().square().sum().into_scalar::<f32>());
        let length = squares.map(f64::from).sum::<f64>().sqrt();
        let shortened = if length > longest { longest / length } else { 1.0 };
        let corrected = |beta: f64| 1.0 - beta.powf(self.updates as f64);
        let step = rate / corrected(BETA_1);
        let root = corrected(BETA_2).sqrt();
        let Network { tensors } = gradients;
        let mut moments = self.first.tensors.iter_mut().zip(&mut self.second.tensors);
        let mut tensors = tensors.into_iter();
        Network {
            tensors: network.tensors.map(|weight| {
                let ((first, second), gradient) = (moments.next().unwrap(), tensors.next().unwrap());
                let gradient = gradient * shortened;
                *first = first.clone() * BETA_1 + gradient.clone() * (1.0 - BETA_1);
                *second = second.clone() * BETA_2 + gradient.square() * (1.0 - BETA_2);
                weight - first.clone() / (second.clone().sqrt() / root + EPSILON) * step
            }),
        }
    }
}

/// The gradient of every weight of a tracked network.
pub fn gradients<const N: usize>(network: &Network<N>, mut gradients: Gradients) -> Network<N> {
    Network {
        tensors: network.tensors.each_ref().map(|weight| {
            weight.grad_remove(&mut gradients).unwrap_or_else(|| weight.clone().inner().zeros_like())
        }),
    }
}
