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
        let (whole, rest) = sums.as_chunks_mut::<AT_ONCE>();
        for (chunk, sums) in whole.iter_mut().enumerate() {
            // A copy stays in registers while all weights pass.
            let mut kept = *sums;
            for (weights, input) in self.weights.iter().zip(inputs) {
                add(&mut kept, &weights.as_chunks::<AT_ONCE>().0[chunk], input);
            }
            *sums = kept;
        }
        for (weights, input) in self.weights.iter().zip(inputs) {
            add(rest, weights.as_chunks::<AT_ONCE>().1, input);
        }
        sums
    }
}

/// Sums that the registers of a processor hold: eight of AVX2.
const AT_ONCE: usize = 64;

#[inline(always)]
fn add(sums: &mut [f32], weights: &[f32], input: &f32) {
    sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * input);
}
