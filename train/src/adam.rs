//! The framework's Adam, with gradients clipped by their common norm as PyTorch's `clip_grad_norm_` does. The
//! framework's own clipping treats each tensor alone.

use burn::optim::{AdamConfig, AdamState, AdaptiveMomentumState, Optimizer};
use burn::tensor::{Gradients, Tensor};

use crate::network::{Network, TENSORS};

/// The framework's default is 1e-5, the paper of Adam and PyTorch have this.
const EPSILON: f32 = 1e-8;

/// Running moments of every weight; none before the first update.
#[derive(Clone, Default)]
pub struct Moments(Option<[AdamState<2>; TENSORS]>);

impl Moments {
    /// Those of the gradients and of their squares after so many updates.
    pub fn after(updates: usize, first: Network, second: Network) -> Self {
        if updates == 0 {
            return Self(None);
        }
        let mut second = second.tensors.into_iter();
        Self(Some(first.tensors.map(|first| {
            let second = second.next().expect("as many tensors");
            AdamState::new(AdaptiveMomentumState::new(updates, first, second))
        })))
    }

    /// Updates so far.
    pub fn updates(&self) -> usize {
        self.0.as_ref().map_or(0, |states| states[0].momentum.time)
    }

    /// Of the gradients and of their squares, in the shape of a network.
    pub fn networks(&self, network: &Network) -> [Network; 2] {
        let of = |part: fn(&AdaptiveMomentumState<2>) -> &Tensor<2>| Network {
            tensors: std::array::from_fn(|i| match &self.0 {
                Some(states) => part(&states[i].momentum).clone(),
                None => network.tensors[i].zeros_like(),
            }),
        };
        [of(|momentum| &momentum.moment_1), of(|momentum| &momentum.moment_2)]
    }

    /// The network after one step against its gradients, which are shortened to `longest` where they are longer.
    pub fn update(&mut self, network: Network, gradients: Network, rate: f64, longest: f64) -> Network {
        let squares = gradients.tensors.iter().map(|g| g.clone().square().sum().into_scalar::<f32>());
        let length = squares.map(f64::from).sum::<f64>().sqrt();
        let shortened = if length > longest { longest / length } else { 1.0 };
        let adam = AdamConfig::new().with_epsilon(EPSILON).build();
        let mut gradients = gradients.tensors.into_iter();
        let mut states = self.0.take().map(<[_; TENSORS]>::into_iter);
        let stepped = network.tensors.map(|weight| {
            let gradient = gradients.next().expect("as many tensors") * shortened;
            let (weight, state) = adam.step(rate, weight, gradient, states.as_mut().and_then(Iterator::next));
            (weight, state.expect("Adam keeps a state"))
        });
        self.0 = Some(stepped.each_ref().map(|(_, state)| state.clone()));
        Network { tensors: stepped.map(|(weight, _)| weight) }
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
