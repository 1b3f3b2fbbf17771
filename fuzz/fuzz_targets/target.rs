//! libFuzzer before the target of this program's name. The targets are those of `crates/umbracast-fuzz`.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use umbracast_fuzz::Target;

static TARGET: LazyLock<&Target> =
    LazyLock::new(|| umbracast_fuzz::target(env!("CARGO_BIN_NAME")).expect("a target of this name"));

fuzz_target!(|bytes: &[u8]| {
    (TARGET.check)(bytes);
});
