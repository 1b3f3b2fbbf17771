//! What both sides of a comparison read and write: arrays as NumPy files, times as JSON.

use std::path::Path;
use std::time::Instant;

/// Times of ours on each case of a row, and what the work found, for the peer's to be held against.
#[derive(Default)]
pub struct Answer {
    cases: Vec<String>,
}

impl Answer {
    /// Notes a case ("100 people") with its times in ms and figures of what was found ("hits").
    pub fn case(&mut self, name: &str, ms: &[f64], found: &[(&str, f64)]) {
        let found: Vec<String> = found.iter().map(|(name, value)| format!("\"{name}\": {value}")).collect();
        self.cases
            .push(format!("{{\"case\": \"{name}\", \"ms\": {ms:?}, \"found\": {{{}}}}}", found.join(", ")));
    }

    /// One object on one line.
    pub fn json(&self) -> String {
        format!("{{\"cases\": [{}]}}", self.cases.join(", "))
    }
}

/// Wall times in ms of `tries` runs, after one that is not counted. `prepare` is not timed.
pub fn times<T>(tries: usize, mut prepare: impl FnMut() -> T, mut work: impl FnMut(&mut T)) -> Vec<f64> {
    let mut once = || {
        let mut prepared = prepare();
        took_ms(|| work(&mut prepared))
    };
    once();
    (0..tries).map(|_| once()).collect()
}

/// Wall time of one run.
#[expect(clippy::disallowed_methods, reason = "a benchmark measures its own speed")]
pub fn took_ms(work: impl FnOnce()) -> f64 {
    let from = Instant::now();
    work();
    1e3 * from.elapsed().as_secs_f64()
}

/// Numbers from 0 to 1 that do not depend on a crate (SplitMix64).
pub fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let word = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((word ^ (word >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Writes an array of `f64` as `NAME.npy` (format 1.0) in the folder, row after row.
pub fn write_f64(folder: &Path, name: &str, shape: &[usize], values: &[f64]) {
    write(folder, name, "<f8", shape, values.len(), values.iter().flat_map(|value| value.to_le_bytes()));
}

/// Writes an array of `f32`.
pub fn write_f32(folder: &Path, name: &str, shape: &[usize], values: &[f32]) {
    write(folder, name, "<f4", shape, values.len(), values.iter().flat_map(|value| value.to_le_bytes()));
}

/// Writes an array of `u32`.
pub fn write_u32(folder: &Path, name: &str, shape: &[usize], values: &[u32]) {
    write(folder, name, "<u4", shape, values.len(), values.iter().flat_map(|value| value.to_le_bytes()));
}

fn write(
    folder: &Path,
    name: &str,
    kind: &str,
    shape: &[usize],
    count: usize,
    bytes: impl Iterator<Item = u8>,
) {
    assert_eq!(shape.iter().product::<usize>(), count, "{name}: the shape holds every value");
    let shape: String = shape.iter().map(|extent| format!("{extent}, ")).collect();
    let mut head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
    // The magic, the version and the length take ten bytes; the head ends with a line at a multiple of 64.
    let length = (head.len() + 11).next_multiple_of(64) - 10;
    head.extend(std::iter::repeat_n(' ', length - head.len() - 1));
    head.push('\n');
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((length as u16).to_le_bytes());
    file.extend(head.as_bytes());
    file.extend(bytes);
    let path = folder.join(format!("{name}.npy"));
    std::fs::write(&path, file).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}
