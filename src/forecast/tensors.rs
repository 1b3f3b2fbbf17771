//! Tensors of weights files, for every network of this module.

use safetensors::{Dtype, SafeTensors};

use crate::Error;

/// The values of the tensor `name`, row by row.
///
/// # Errors
/// A tensor that is missing, has another shape or kind, or holds a number that is not finite.
pub(super) fn tensor(file: &SafeTensors<'_>, name: &str, shape: &[usize]) -> Result<Vec<f32>, Error> {
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
