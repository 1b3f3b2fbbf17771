//! The loss of a batch and its gradient: recorded by burn on any processor, or written out for the CPU, where that
//! takes less work and uses all threads.
//!
//! Written out, the cell's input and hidden state stand side by side, so that a step is one product of matrices
//! forwards and one backwards, and the cell's weights get their gradient from one product over all steps. The products
//! are burn's; what the cell does between them is a loop, which spares a dozen passes over the gates.

use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};
use rayon::prelude::*;
use umbracast::STEPS;
use umbracast::geometry::DVec2;
use umbracast_train::windows::Window;

use crate::adam::gradients;
use crate::network::{Network, loss};

/// Parts of a batch, side by side: a fixed number, summed in order, so that threads do not change the sum.
const PARTS: usize = 4;

/// Displacements of windows by frame, oldest first, [windows, 2] each: the observed ones and those to come.
pub fn frames(windows: &[Window], device: &Device) -> (Vec<Tensor<2>>, Vec<Tensor<2>>) {
    let frame = |displacement_m: &dyn Fn(&Window) -> DVec2| {
        let values = windows.iter().flat_map(|window| displacement_m(window).as_vec2().to_array()).collect();
        tensor(values, windows.len(), device)
    };
    let observed = (0..windows[0].observed_m.len()).map(|i| frame(&|window| window.observed_m[i])).collect();
    (observed, (0..STEPS).map(|i| frame(&|window| window.coming_m[i])).collect())
}

/// Mean negative log-likelihood of the windows, and its gradient, as burn records them.
pub fn recorded(network: &Network, windows: &[Window], device: &Device) -> (f64, Network) {
    let tracked = network.tracked();
    let (observed_m, coming_m) = frames(windows, device);
    let loss = loss(tracked.roll_out(&observed_m, STEPS), coming_m);
    let gradient = gradients(&tracked, loss.backward());
    (loss.into_scalar::<f32>().into(), gradient)
}

/// The same, written out for the plain processor and spread over the threads of the pool it is called from.
pub fn written_out(network: &Network, windows: &[Window], device: &Device) -> (f64, Network) {
    let [.., weight_ih, weight_hh, bias_ih, bias_hh, _, _] = &network.tensors;
    let layer = Layer {
        rows: Tensor::cat(vec![weight_ih.clone(), weight_hh.clone()], 1),
        columns: Tensor::cat(vec![weight_ih.clone().transpose(), weight_hh.clone().transpose()], 0),
        bias: values(bias_ih.clone() + bias_hh.clone()),
    };
    let parts: Vec<(f64, Network)> = windows
        .par_chunks(windows.len().div_ceil(PARTS))
        .map(|part| layer.gradient(network, part, part.len() as f64 / windows.len() as f64, device))
        .collect();
    let sum = |(loss, sum): (f64, Network), (part, gradient): (f64, Network)| {
        let mut gradient = gradient.tensors.into_iter();
        (loss + part, Network { tensors: sum.tensors.map(|sum| sum + gradient.next().unwrap()) })
    };
    parts.into_iter().reduce(sum).expect("a batch of at least one window")
}

/// The LSTM layer's weights, input and hidden state side by side, laid out for both directions.
struct Layer {
    /// [4 units, embedded + units], for the way back.
    rows: Tensor<2>,
    /// [embedded + units, 4 units], for the way there.
    columns: Tensor<2>,
    /// [4 units].
    bias: Vec<f32>,
}

/// What the way back needs of a step; all of it by window.
struct Step {
    displacement_m: Tensor<2>,
    /// Embedded displacement and hidden state before the step.
    inputs: Tensor<2>,
    cell: Cell,
    /// After the step.
    hidden: Tensor<2>,
}

impl Layer {
    /// `share` of the loss of some windows and of its gradient.
    fn gradient(&self, network: &Network, windows: &[Window], share: f64, device: &Device) -> (f64, Network) {
        let [emb_weight, emb_bias, weight_ih, _, _, _, dec_weight, dec_bias] = &network.tensors;
        let (embedded, units) = (weight_ih.dims()[1], self.bias.len() / 4);
        let (observed_m, coming_m) = frames(windows, device);
        let count = windows.len();

        let mut steps: Vec<Step> = Vec::new();
        let mut outputs: Vec<Tensor<2>> = Vec::new();
        let mut hidden = Tensor::zeros([count, units], device);
        let mut content = vec![0.0; count * units];
        while outputs.len() < STEPS {
            let displacement_m = match outputs.last() {
                Some(output) => output.clone().narrow(1, 0, 2),
                None => observed_m[steps.len()].clone(),
            };
            let embedding =
                relu(displacement_m.clone().matmul(emb_weight.clone().transpose()) + emb_bias.clone());
            let inputs = Tensor::cat(vec![embedding, hidden], 1);
            let gates = values(inputs.clone().matmul(self.columns.clone()));
            let (cell, content_after, hidden_after) = Cell::step(gates, &self.bias, content);
            content = content_after;
            hidden = tensor(hidden_after, count, device);
            steps.push(Step { displacement_m, inputs, cell, hidden: hidden.clone() });
            if steps.len() >= observed_m.len() {
                outputs.push(hidden.clone().matmul(dec_weight.clone().transpose()) + dec_bias.clone());
            }
        }

        // The loss alone is burn's to record: a few numbers a window.
        let outputs = Network { tensors: <[_; STEPS]>::try_from(outputs).unwrap() }.tracked();
        let loss = loss(outputs.tensors.to_vec(), coming_m) * share;
        let to_outputs = gradients(&outputs, loss.backward()).tensors;

        // `to_x` is the gradient of the loss to x.
        let mut to_hidden = Tensor::zeros([count, units], device);
        let mut to_content = vec![0.0; count * units];
        let mut to_displacement = Tensor::zeros([count, 2], device);
        let [mut embedding, mut layer, mut head] = [(); 3].map(|()| Linear::default());
        while let Some(Step { displacement_m, inputs, cell, hidden }) = steps.pop() {
            if let Some(output) = (steps.len() + 1).checked_sub(observed_m.len()) {
                // The next step went by this one's mean.
                let [mean, spread] =
                    [(0, 2), (2, 3)].map(|(at, width)| to_outputs[output].clone().narrow(1, at, width));
                let to_output = Tensor::cat(vec![mean + to_displacement, spread], 1);
                to_hidden = to_hidden + to_output.clone().matmul(dec_weight.clone());
                head.add(to_output, hidden);
            }
            let to_gates = tensor(cell.back(units, &values(to_hidden), &mut to_content), count, device);
            let to_inputs = to_gates.clone().matmul(self.rows.clone());
            let open = inputs.clone().narrow(1, 0, embedded).sign();
            let to_embedding = to_inputs.clone().narrow(1, 0, embedded) * open;
            to_hidden = to_inputs.narrow(1, embedded, units);
            to_displacement = to_embedding.clone().matmul(emb_weight.clone());
            layer.add(to_gates, inputs);
            embedding.add(to_embedding, displacement_m);
        }
        let [[emb_weight, emb_bias], [weight, bias], [dec_weight, dec_bias]] =
            [embedding, layer, head].map(Linear::gradient);
        let weight_ih = weight.clone().narrow(1, 0, embedded);
        let weight_hh = weight.narrow(1, embedded, units);
        let tensors = [emb_weight, emb_bias, weight_ih, weight_hh, bias.clone(), bias, dec_weight, dec_bias];
        (loss.into_scalar::<f32>().into(), Network { tensors })
    }
}

/// What a linear layer's gradient is summed from: the gradient to its outputs, and its inputs, of each step.
#[derive(Default)]
struct Linear {
    to_outputs: Vec<Tensor<2>>,
    inputs: Vec<Tensor<2>>,
}

impl Linear {
    fn add(&mut self, to_output: Tensor<2>, input: Tensor<2>) {
        self.to_outputs.push(to_output);
        self.inputs.push(input);
    }

    /// Of weight and bias.
    fn gradient(self) -> [Tensor<2>; 2] {
        let to_outputs = Tensor::cat(self.to_outputs, 0);
        let weight = to_outputs.clone().transpose().matmul(Tensor::cat(self.inputs, 0));
        [weight, to_outputs.sum_dim(0)]
    }
}

/// A step between its products, window by window.
struct Cell {
    /// i f g o after their non-linearities, [windows, 4 units].
    gates: Vec<f32>,
    /// The cell state before the step, [windows, units].
    before: Vec<f32>,
    /// The tanh of the one after it.
    squashed: Vec<f32>,
}

impl Cell {
    /// From the gates' weighted sums, their bias and the cell state before; also the cell and the hidden state after.
    fn step(mut gates: Vec<f32>, bias: &[f32], before: Vec<f32>) -> (Self, Vec<f32>, Vec<f32>) {
        let units = bias.len() / 4;
        let [mut after, mut squashed, mut hidden] = [before.clone(), before.clone(), before.clone()];
        for (row, gates) in gates.chunks_exact_mut(4 * units).enumerate() {
            gates.iter_mut().zip(bias).for_each(|(gate, bias)| *gate += bias);
            let [i, f, g, o] = quarters(gates);
            let row = row * units..(row + 1) * units;
            let (after, squashed) = (&mut after[row.clone()], &mut squashed[row.clone()]);
            let hidden = &mut hidden[row];
            for k in 0..units {
                (i[k], f[k], g[k], o[k]) = (sigmoid(i[k]), sigmoid(f[k]), tanh(g[k]), sigmoid(o[k]));
                after[k] = f[k] * after[k] + i[k] * g[k];
                squashed[k] = tanh(after[k]);
                hidden[k] = o[k] * squashed[k];
            }
        }
        (Self { gates, before, squashed }, after, hidden)
    }

    /// The gradient to the gates' weighted sums, from those to the hidden and the cell state after the step; the
    /// latter becomes the one to the cell state before.
    fn back(mut self, units: usize, to_hidden: &[f32], to_content: &mut [f32]) -> Vec<f32> {
        for (row, gates) in self.gates.chunks_exact_mut(4 * units).enumerate() {
            let [i, f, g, o] = quarters(gates);
            let row = row * units..(row + 1) * units;
            let (before, squashed) = (&self.before[row.clone()], &self.squashed[row.clone()]);
            let (to_hidden, to_content) = (&to_hidden[row.clone()], &mut to_content[row]);
            for k in 0..units {
                let to_cell = to_content[k] + to_hidden[k] * o[k] * (1.0 - squashed[k] * squashed[k]);
                to_content[k] = to_cell * f[k];
                (i[k], f[k], g[k], o[k]) = (
                    to_cell * g[k] * i[k] * (1.0 - i[k]),
                    to_cell * before[k] * f[k] * (1.0 - f[k]),
                    to_cell * i[k] * (1.0 - g[k] * g[k]),
                    to_hidden[k] * squashed[k] * o[k] * (1.0 - o[k]),
                );
            }
        }
        self.gates
    }
}

/// Each gate's units of a row.
fn quarters(gates: &mut [f32]) -> [&mut [f32]; 4] {
    let units = gates.len() / 4;
    let (i, rest) = gates.split_at_mut(units);
    let (f, rest) = rest.split_at_mut(units);
    let (g, o) = rest.split_at_mut(units);
    [i, f, g, o]
}

fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + (-x).exp())
}

/// As the runtime's cell has it: exact to about a rounding of one.
fn tanh(x: f32) -> f32 {
    2.0 * sigmoid(2.0 * x) - 1.0
}

fn tensor(values: Vec<f32>, rows: usize, device: &Device) -> Tensor<2> {
    let columns = values.len() / rows;
    Tensor::from_data(TensorData::new(values, [rows, columns]), device)
}

/// Of a tensor on the plain processor, row by row.
fn values(tensor: Tensor<2>) -> Vec<f32> {
    tensor.into_data().try_into_vec().expect("f32 at hand")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::{NAMES, Size};
    use umbracast_sim::crowd::Preset;
    use umbracast_train::windows::{Noise, Ways};

    /// Seven windows: parts of two, and one of one.
    fn case() -> (Network, Vec<Window>, Device) {
        let device = Device::flex();
        let ways = Ways::simulate(&[(1, Preset::Orca03)], 3, 5.0);
        let windows = ways.draw(7, Noise { white_m: 0.1, lasting_m: 0.1 }, 1);
        (Network::fresh(Size { embedded: 4, units: 8 }, 1, &device), windows, device)
    }

    fn numbers(network: Network) -> Vec<Vec<f32>> {
        network.tensors.map(values).into()
    }

    #[test]
    fn the_gradient_written_out_is_the_one_recorded() {
        let (network, windows, device) = case();
        let (expected_loss, expected) = recorded(&network, &windows, &device);
        let (loss, found) = written_out(&network, &windows, &device);
        assert!((loss - expected_loss).abs() < 1e-5, "loss {loss}, expected {expected_loss}");
        for (name, (found, expected)) in NAMES.iter().zip(numbers(found).iter().zip(numbers(expected))) {
            let largest = expected.iter().fold(0.0_f32, |largest, value| largest.max(value.abs()));
            assert!(largest > 0.0, "{name} has no gradient");
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() < 1e-4 * largest, "{name}: {found}, expected {expected}");
            }
        }
    }

    #[test]
    fn any_number_of_threads_gives_the_same_gradient() {
        let (network, windows, device) = case();
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (loss, gradient) = pool.install(|| written_out(&network, &windows, &device));
            (loss, numbers(gradient))
        };
        assert!(on(1) == on(3));
    }
}
