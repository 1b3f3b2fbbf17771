//! Any bytes must be a message that is written again as it was read, or be refused.
#![no_main]

use libfuzzer_sys::fuzz_target;
use umbracast_io::fields::{Message, decode, encode};
use umbracast_io::nodes::{Followed, Foreground, NodeHealth, Priors, TrackerState, Warning};

fn again<M: Message>(bytes: &[u8]) {
    if let Some(mut message) = decode::<M>(bytes) {
        let written = encode(&mut message);
        let mut read = decode::<M>(&written).expect("a message of ours");
        assert_eq!(encode(&mut read), written);
    }
}

fuzz_target!(|input: (u8, Vec<u8>)| {
    let (kind, mut bytes) = input;
    bytes.splice(0..0, [0, 1, 0, 0]);
    match kind % 6 {
        0 => again::<Foreground>(&bytes),
        1 => again::<Priors>(&bytes),
        2 => again::<Followed>(&bytes),
        3 => again::<TrackerState>(&bytes),
        4 => again::<Warning>(&bytes),
        _ => again::<NodeHealth>(&bytes),
    }
});
