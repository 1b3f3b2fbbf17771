//! Writes networks as safetensors.

use std::borrow::Cow;
use std::collections::HashMap;

use safetensors::{Dtype, SafeTensors, View, serialize};
use umbracast::Error;

const STATE: &str = "state";

/// A tensor of f32, as the format wants it.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Rows and columns, or one number for a bias.
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl Entry {
    /// From its numbers, row by row.
    pub fn new(shape: &[usize], values: impl IntoIterator<Item = f32>) -> Self {
        Self { shape: shape.to_vec(), bytes: values.into_iter().flat_map(f32::to_le_bytes).collect() }
    }
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

/// Named tensors as one safetensors file. `state`, if any, goes into the file's metadata.
///
/// # Errors
/// A shape that does not fit its numbers.
pub fn to_safetensors(entries: Vec<(String, Entry)>, state: Option<String>) -> Result<Vec<u8>, Error> {
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

/// What is wrong with weights.
pub fn story(error: &dyn std::fmt::Debug) -> Error {
    Error::new(format!("weights: {error:?}"))
}
