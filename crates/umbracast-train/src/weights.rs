//! Networks to and from safetensors.

use std::borrow::Cow;
use std::collections::HashMap;

use burn::tensor::{Device, TensorData};
use safetensors::{Dtype, SafeTensors, View, serialize};
use umbracast::Error;

use crate::network::{NAMES, Network, Size, TENSORS};

const STATE: &str = "state";

/// A tensor's bytes, as the format wants them.
struct Entry {
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl View for Entry {
    fn dtype(&self) -> Dtype {
        Dtype::F32
    }
    fn shape(&self) -> &[usize] {
        &self.shape
    }
    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.bytes)
    }
    fn data_len(&self) -> usize {
        self.bytes.len()
    }
}

/// Networks as one safetensors file, each tensor's name after its network's prefix; biases have one dimension.
/// `names` are those of each network's tensors. `state`, if any, goes into the file's metadata.
///
/// # Errors
/// A tensor that cannot be read back from its device.
pub fn to_safetensors<const N: usize>(
    names: &[&str; N],
    networks: &[(&str, &Network<N>)],
    state: Option<String>,
) -> Result<Vec<u8>, Error> {
    let mut entries = Vec::new();
    for (prefix, network) in networks {
        for (name, tensor) in names.iter().zip(&network.tensors) {
            let [rows, columns] = tensor.dims();
            let shape = if name.ends_with("weight") || name.contains("weight_") {
                vec![rows, columns]
            } else {
                vec![columns]
            };
            let values: Vec<f32> = tensor.clone().into_data().try_to_vec().map_err(|e| story(&e))?;
            let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            entries.push((format!("{prefix}{name}"), Entry { shape, bytes }));
        }
    }
    // One key only: a hash map's order is not the same from run to run.
    let metadata = state.map(|state| HashMap::from([(STATE.to_owned(), state)]));
    serialize(entries, metadata).map_err(|e| story(&e))
}

/// The `state` that a file was written with.
///
/// # Errors
/// Bytes that are no safetensors file.
pub fn state(bytes: &[u8]) -> Result<Option<String>, Error> {
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(|e| story(&e))?;
    Ok(metadata.metadata().as_ref().and_then(|metadata| metadata.get(STATE).cloned()))
}

/// The network whose tensors' names start with `prefix`.
///
/// # Errors
/// A tensor that is missing or has another kind or shape.
pub fn from_safetensors(bytes: &[u8], prefix: &str, size: Size, device: &Device) -> Result<Network, Error> {
    let file = SafeTensors::deserialize(bytes).map_err(|e| story(&e))?;
    let mut tensors = Vec::with_capacity(TENSORS);
    for (name, shape) in NAMES.iter().zip(size.shapes()) {
        let view = file.tensor(&format!("{prefix}{name}")).map_err(|e| story(&e))?;
        let values: Vec<f32> =
            view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        if view.dtype() != Dtype::F32 || values.len() != shape[0] * shape[1] {
            let found = format!("{:?} of shape {:?}", view.dtype(), view.shape());
            return Err(Error::new(format!(
                "{prefix}{name}: expected f32 of shape {shape:?}, found {found}"
            )));
        }
        tensors.push(burn::tensor::Tensor::from_data(TensorData::new(values, shape), device));
    }
    let tensors = tensors.try_into().map_err(|_| Error::new("weights: expected eight tensors"))?;
    Ok(Network { tensors })
}

fn story(error: &dyn std::fmt::Debug) -> Error {
    Error::new(format!("weights: {error:?}"))
}
