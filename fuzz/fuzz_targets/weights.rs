//! Any bytes give a network or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use umbracast::forecast::{Residual, Weights};

fuzz_target!(|bytes: &[u8]| {
    let _ = Weights::from_safetensors(bytes);
    let _ = Residual::from_safetensors(bytes);
});
