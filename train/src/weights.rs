//! Networks to and from safetensors.

use burn::tensor::{Device, Tensor, TensorData};
use safetensors::{Dtype, SafeTensors};
use umbracast::Error;
use umbracast_train::weights::{Entry, story};

use crate::network::{NAMES, Network, Size, TENSORS};

/// Networks as one safetensors file, each tensor's name after its network's prefix; biases have one dimension.
/// `state`, if any, goes into the file's metadata.
///
/// # Errors
/// A tensor that cannot be read back from its device.
pub fn to_safetensors(networks: &[(&str, &Network)], state: Option<String>) -> Result<Vec<u8>, Error> {
    let mut entries = Vec::new();
    for (prefix, network) in networks {
        for (name, tensor) in NAMES.iter().zip(&network.tensors) {
            let [rows, columns] = tensor.dims();
            let shape = if name.contains("weight") { vec![rows, columns] } else { vec![columns] };
            let values: Vec<f32> = tensor.clone().into_data().try_to_vec().map_err(|e| story(&e))?;
            entries.push((format!("{prefix}{name}"), Entry::new(&shape, values)));
        }
    }
    umbracast_train::weights::to_safetensors(entries, state)
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
        tensors.push(Tensor::from_data(TensorData::new(values, shape), device));
    }
    let tensors = tensors.try_into().map_err(|_| Error::new("weights: expected eight tensors"))?;
    Ok(Network { tensors })
}
