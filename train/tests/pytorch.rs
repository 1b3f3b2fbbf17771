//! The same numbers as PyTorch on the same weights (`fixtures/pytorch.py`), and as the runtime.

use burn::tensor::{Device, Tensor, TensorData};
use safetensors::SafeTensors;
use umbracast::STEPS;
use umbracast::forecast::Weights;
use umbracast::forecast::lstm::{OBSERVED_DISPLACEMENTS, RHO_LIMIT, SIGMA_FLOOR_M, SIGMA_SCALE_M};
use umbracast::geometry::DVec2;
use umbracast_train_lstm::adam::{Moments, gradients};
use umbracast_train_lstm::network::{NAMES, Network, Size, loss};
use umbracast_train_lstm::weights::{from_safetensors, to_safetensors};

const FIXTURE: &[u8] = include_bytes!("../fixtures/pytorch.safetensors");
const SIZE: Size = Size { embedded: 8, units: 16 };
const WINDOWS: usize = 3;

fn numbers(name: &str) -> Vec<f32> {
    let file = SafeTensors::deserialize(FIXTURE).unwrap();
    let view = file.tensor(name).unwrap();
    view.data().chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

/// Displacements of 18 frames, [windows, 2] each.
fn frames(device: &Device) -> Vec<Tensor<2>> {
    let all = numbers("displacements");
    all.chunks_exact(2 * WINDOWS)
        .map(|frame| Tensor::from_data(TensorData::new(frame.to_vec(), [WINDOWS, 2]), device))
        .collect()
}

fn network_loss(network: &Network, device: &Device) -> Tensor<1> {
    let frames = frames(device);
    let (observed, coming) = frames.split_at(OBSERVED_DISPLACEMENTS);
    loss(network.roll_out(observed, STEPS), coming.to_vec())
}

/// Largest difference of a network's numbers from those of the fixture, as a share of the fixture's largest.
fn farthest(network: &Network, prefix: &str) -> f32 {
    let mut farthest = 0.0_f32;
    for (name, tensor) in NAMES.iter().zip(&network.tensors) {
        let expected = numbers(&format!("{prefix}{name}"));
        let found: Vec<f32> = tensor.clone().into_data().try_to_vec().unwrap();
        let largest = expected.iter().fold(0.0_f32, |largest, value| largest.max(value.abs()));
        for (found, expected) in found.iter().zip(&expected) {
            farthest = farthest.max((found - expected).abs() / largest);
        }
    }
    farthest
}

#[test]
fn loss_and_gradients_are_those_of_pytorch() {
    let device = Device::flex();
    let network = from_safetensors(FIXTURE, "", SIZE, &device).unwrap().tracked();
    let loss = network_loss(&network, &device);
    let gradients = gradients(&network, loss.backward());
    let (found, expected) = (loss.into_scalar::<f32>(), numbers("loss")[0]);
    assert!((found - expected).abs() < 1e-4, "loss {found}, expected {expected}");
    let farthest = farthest(&gradients, "gradient.");
    assert!(farthest < 1e-4, "a gradient is off by {farthest} of its tensor's largest");
}

#[test]
fn three_clipped_updates_are_those_of_pytorch() {
    let device = Device::flex();
    let mut network = from_safetensors(FIXTURE, "", SIZE, &device).unwrap();
    let mut moments = Moments::default();
    for _ in 0..3 {
        let tracked = network.tracked();
        let gradients = gradients(&tracked, network_loss(&tracked, &device).backward());
        network = moments.update(network, gradients, 1e-3, 0.5);
    }
    let farthest = farthest(&network, "updated.");
    assert!(farthest < 1e-4, "a weight is off by {farthest} of its tensor's largest");
}

#[test]
fn the_runtime_rolls_out_as_the_trainer_does() {
    let device = Device::flex();
    for (size, seed) in [(SIZE, 3), (Size { embedded: 64, units: 512 }, 4)] {
        let network = Network::fresh(size, seed, &device);
        let outputs = network.roll_out(&frames(&device)[..OBSERVED_DISPLACEMENTS], STEPS);
        let weights = Weights::from_safetensors(&to_safetensors(&[("", &network)], None).unwrap()).unwrap();
        let all = numbers("displacements");
        let observed: Vec<[DVec2; OBSERVED_DISPLACEMENTS]> = (0..WINDOWS)
            .map(|window| {
                std::array::from_fn(|frame| {
                    let at = 2 * (frame * WINDOWS + window);
                    DVec2::new(all[at].into(), all[at + 1].into())
                })
            })
            .collect();
        let foreseen = weights.roll_out(&observed, |_, displacement| displacement.mean_m);
        for (step, output) in outputs.into_iter().enumerate() {
            let raw: Vec<f32> = output.into_data().try_to_vec().unwrap();
            for (window, raw) in raw.chunks_exact(5).enumerate() {
                let found = foreseen[window][step];
                let sigma = |raw: f32| f64::from(SIGMA_FLOOR_M + SIGMA_SCALE_M * raw.exp().ln_1p());
                let (sigma_x, sigma_y) = (sigma(raw[2]), sigma(raw[3]));
                let xy = f64::from(RHO_LIMIT * raw[4].tanh()) * sigma_x * sigma_y;
                let mean = DVec2::new(raw[0].into(), raw[1].into());
                assert!(found.mean_m.abs_diff_eq(mean, 1e-5), "{found:?}, expected {mean}");
                assert!((found.xx_m2.sqrt() - sigma_x).abs() < 1e-5);
                assert!((found.yy_m2.sqrt() - sigma_y).abs() < 1e-5);
                assert!((found.xy_m2 - xy).abs() < 1e-5 * sigma_x.max(sigma_y));
            }
        }
    }
}
