//! Tensors of weights files, and the layers that networks are built of.

use std::array::from_fn;

use safetensors::{Dtype, SafeTensors};

use crate::Error;

/// The values of the tensor `name`, row by row.
///
/// # Errors
/// A tensor that is missing, has another shape or kind, or holds a number that is not finite.
pub(crate) fn tensor(file: &SafeTensors<'_>, name: &str, shape: &[usize]) -> Result<Vec<f32>, Error> {
    let wrong = |found: String| {
        Error::new(format!("weights: {name}: expected f32 of shape {shape:?}, found {found}"))
    };
    let view = file.tensor(name).map_err(|_| wrong("no such tensor".to_owned()))?;
    if view.dtype() != Dtype::F32 || view.shape() != shape {
        return Err(wrong(format!("{:?} of shape {:?}", view.dtype(), view.shape())));
    }
    let values: Vec<f32> =
        view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    match values.iter().position(|value| !value.is_finite()) {
        Some(at) => Err(wrong(format!("{} at place {at}", values[at]))),
        None => Ok(values),
    }
}

/// One layer of a network: the weights of each input in turn, so that sums run side by side, and the biases.
#[derive(Debug, Clone)]
pub(crate) struct Layer<const IN: usize, const OUT: usize> {
    weights: Vec<[f32; OUT]>,
    bias: [f32; OUT],
}

impl<const IN: usize, const OUT: usize> Layer<IN, OUT> {
    /// From the tensors `name.weight` `[OUT, IN]` and `name.bias` `[OUT]`, as PyTorch lays them out.
    ///
    /// # Errors
    /// As [`tensor`].
    pub(crate) fn read(file: &SafeTensors<'_>, name: &str) -> Result<Self, Error> {
        let weights = tensor(file, &format!("{name}.weight"), &[OUT, IN])?;
        let bias = tensor(file, &format!("{name}.bias"), &[OUT])?;
        Ok(Self {
            weights: (0..IN).map(|input| from_fn(|output| weights[output * IN + input])).collect(),
            bias: from_fn(|output| bias[output]),
        })
    }

    #[inline(always)]
    pub(crate) fn of(&self, inputs: &[f32; IN]) -> [f32; OUT] {
        let mut sums = self.bias;
        for (weights, input) in self.weights.iter().zip(inputs) {
            add(&mut sums, weights, *input);
        }
        sums
    }
}

/// Inputs that a [`WideLayer`] takes at once, and sums of each that are in registers at a time: ten of AVX2's sixteen hold sums.
pub(crate) const SEVERAL: usize = 5;
const WIDTH: usize = 16;

/// A layer whose weights take longer to read than to multiply by. They are read once for several inputs, in the order in which they lie.
#[derive(Debug, Clone)]
pub(crate) struct WideLayer<const IN: usize, const OUT: usize> {
    /// Of [`WIDTH`] outputs after another, by input.
    weights: Vec<[[f32; WIDTH]; IN]>,
    bias: [f32; OUT],
}

impl<const IN: usize, const OUT: usize> WideLayer<IN, OUT> {
    /// As [`Layer::read`].
    pub(crate) fn read(file: &SafeTensors<'_>, name: &str) -> Result<Self, Error> {
        const { assert!(OUT.is_multiple_of(WIDTH)) };
        let Layer { weights, bias } = Layer::<IN, OUT>::read(file, name)?;
        let of_chunk = |chunk| from_fn(|input| from_fn(|k| weights[input][chunk * WIDTH + k]));
        Ok(Self { weights: (0..OUT / WIDTH).map(of_chunk).collect(), bias })
    }

    #[inline(always)]
    pub(crate) fn of(&self, inputs: [&[f32; IN]; SEVERAL]) -> [[f32; OUT]; SEVERAL] {
        let mut sums = [[0.0; OUT]; SEVERAL];
        for (chunk, (weights, bias)) in self.weights.iter().zip(self.bias.as_chunks::<WIDTH>().0).enumerate()
        {
            // Written out, for sums in an array of arrays stay in memory.
            let [mut a, mut b, mut c, mut d, mut e] = [*bias; SEVERAL];
            for (input, weights) in weights.iter().enumerate() {
                add(&mut a, weights, inputs[0][input]);
                add(&mut b, weights, inputs[1][input]);
                add(&mut c, weights, inputs[2][input]);
                add(&mut d, weights, inputs[3][input]);
                add(&mut e, weights, inputs[4][input]);
            }
            for (sums, of_chunk) in sums.iter_mut().zip([a, b, c, d, e]) {
                sums.as_chunks_mut().0[chunk] = of_chunk;
            }
        }
        sums
    }
}

#[inline(always)]
fn add<const N: usize>(sums: &mut [f32; N], weights: &[f32; N], input: f32) {
    sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * input);
}
