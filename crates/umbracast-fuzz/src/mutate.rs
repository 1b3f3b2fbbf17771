//! Damages whole inputs. The same seed gives the same damage.
//!
//! It uses nothing but the standard library, because `xtask` includes this file.

/// Numbers that lengths and counts are not expected to be.
const EXTREME: [u64; 8] = [0, 1, 0x7f, 0xff, 0x7fff_ffff, 0xffff_ffff, 1 << 62, u64::MAX];
/// The same for numbers that are written as text.
const EXTREME_TEXT: [&str; 10] = [
    "0",
    "-1",
    "nan",
    "inf",
    "1e308",
    "-1e-308",
    "4294967296",
    "9223372036854775807",
    "18446744073709551616",
    "1.7976931348623157e308",
];
/// Heads and tails hold the lengths: half of the damage is done within so many bytes of them.
const HEAD_BYTES: usize = 512;

/// Marsaglia's xorshift.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Neighbouring seeds give unlike numbers.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// The next number.
    pub fn draw(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// A number below `most`; 0 where there is none.
    pub fn below(&mut self, most: usize) -> usize {
        (self.draw() >> 16) as usize % most.max(1)
    }
}

/// Puts `whole` with one to four damages into `bytes`, in place of what is there.
pub fn damage(whole: &[u8], random: &mut Random, bytes: &mut Vec<u8>) {
    bytes.clear();
    bytes.extend_from_slice(whole);
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = match random.below(4) {
            0 => random.below(bytes.len().min(HEAD_BYTES)),
            1 => bytes.len() - 1 - random.below(bytes.len().min(HEAD_BYTES)),
            _ => random.below(bytes.len()),
        };
        match random.below(8) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.draw() as u8,
            2 => bytes.truncate(at),
            3 => {
                let inserted: Vec<u8> = (0..random.below(16)).map(|_| random.draw() as u8).collect();
                bytes.splice(at..at, inserted);
            }
            4 => drop(bytes.drain(at..(at + random.below(16)).min(bytes.len()))),
            5 => again(bytes, at, random),
            6 => number(bytes, at, random),
            _ => {
                let width = [1, 2, 4, 8][random.below(4)].min(bytes.len() - at);
                let extreme = EXTREME[random.below(EXTREME.len())].to_le_bytes();
                bytes[at..at + width].copy_from_slice(&extreme[..width]);
            }
        }
    }
}

/// Repeats a part of the input in another place: a record or a key that comes twice.
fn again(bytes: &mut Vec<u8>, to: usize, random: &mut Random) {
    let from = random.below(bytes.len());
    let part = bytes[from..bytes.len().min(from + 1 + random.below(64))].to_vec();
    bytes.splice(to..to, part);
}

/// Puts another number in place of the next one that is written as text.
fn number(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    let is_of_number = |byte: &u8| byte.is_ascii_digit() || b"+-.".contains(byte);
    let near = &bytes[at..bytes.len().min(at + 64)];
    let Some(start) = near.iter().position(u8::is_ascii_digit).map(|start| at + start) else { return };
    let length = bytes[start..].iter().take_while(|byte| is_of_number(byte)).count();
    let text = EXTREME_TEXT[random.below(EXTREME_TEXT.len())];
    bytes.splice(start..start + length, text.bytes());
}
