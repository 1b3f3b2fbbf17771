//! LZF, the compression inside PCD files (format: liblzf's `lzf_d.c`): a control byte below 32 starts that many
//! plus one literal bytes; any other holds the length of a copy (3 bits, 7: one more byte follows) and the
//! upper 5 bits of its distance, the lower 8 follow.
//!
//! Written by hand: only PCD needs this page of code, and a false length must not claim all memory.

const LITERALS_MAX: usize = 32;
const COPY_MIN: usize = 3;
const COPY_MAX: usize = 2 + 7 + 255;
const DISTANCE_MAX: usize = 1 << 13;

/// What was compressed to `input`; None unless it is exactly `length` bytes.
pub fn decompress(input: &[u8], length: usize) -> Option<Vec<u8>> {
    // A control byte and two more give COPY_MAX bytes at most: a false length cannot claim all memory.
    if length > input.len().saturating_mul(COPY_MAX) {
        return None;
    }
    let mut output = Vec::with_capacity(length);
    let mut rest = input;
    while let Some((&control, tail)) = rest.split_first() {
        rest = tail;
        let control = usize::from(control);
        if control < LITERALS_MAX {
            let literals = rest.get(..=control)?;
            output.extend_from_slice(literals);
            rest = &rest[literals.len()..];
        } else {
            let mut take = || {
                let (&byte, tail) = rest.split_first()?;
                rest = tail;
                Some(usize::from(byte))
            };
            let copied = 2 + if control >> 5 == 7 { 7 + take()? } else { control >> 5 };
            let distance = 1 + ((control & 0x1f) << 8) + take()?;
            let start = output.len().checked_sub(distance)?;
            // Byte by byte, as a copy may run into what it writes.
            for i in start..start + copied {
                output.push(output[i]);
            }
        }
        if output.len() > length {
            return None;
        }
    }
    (output.len() == length).then_some(output)
}

/// Compresses greedily, by the last place where the next three bytes stood.
pub fn compress(input: &[u8]) -> Vec<u8> {
    let mut output = Vec::with_capacity(input.len() / 2);
    let mut last_seen = vec![usize::MAX; 1 << 14];
    let mut literals_from = 0;
    let mut at = 0;
    while at + COPY_MIN <= input.len() {
        let next = u32::from_le_bytes([input[at], input[at + 1], input[at + 2], 0]);
        let slot = (next.wrapping_mul(0x9e37_79b1) >> 18) as usize;
        let from = std::mem::replace(&mut last_seen[slot], at);
        let copied = match at.checked_sub(from) {
            Some(distance) if distance <= DISTANCE_MAX => {
                let same = input[at..].iter().zip(&input[from..]).take_while(|(a, b)| a == b).count();
                same.min(COPY_MAX)
            }
            _ => 0,
        };
        if copied < COPY_MIN {
            at += 1;
            continue;
        }
        push_literals(&mut output, &input[literals_from..at]);
        let (length, distance) = (copied - 2, at - from - 1);
        output.push(((length.min(7) << 5) | (distance >> 8)) as u8);
        if length >= 7 {
            output.push((length - 7) as u8);
        }
        output.push(distance as u8);
        at += copied;
        literals_from = at;
    }
    push_literals(&mut output, &input[literals_from..]);
    output
}

fn push_literals(output: &mut Vec<u8>, literals: &[u8]) {
    for run in literals.chunks(LITERALS_MAX) {
        output.push((run.len() - 1) as u8);
        output.extend_from_slice(run);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pseudo_random(length: usize, values: u64) -> Vec<u8> {
        let mut state = 7_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) % values) as u8
        };
        (0..length).map(|_| next()).collect()
    }

    #[test]
    fn what_is_compressed_comes_back() {
        for length in [0, 1, 2, 3, 31, 32, 33, 300, 9000, 50_000] {
            for values in [1, 2, 5, 256] {
                let input = pseudo_random(length, values);
                assert_eq!(decompress(&compress(&input), length), Some(input));
            }
        }
        assert!(compress(&[7; 9000]).len() < 150);
    }

    #[test]
    fn a_copy_may_run_into_what_it_writes() {
        assert_eq!(decompress(&[0, b'a', 0xe0, 1, 0], 11), Some(vec![b'a'; 11]));
    }

    #[test]
    fn broken_input_gives_nothing() {
        let input = pseudo_random(2000, 3);
        let whole = compress(&input);
        assert_eq!(decompress(&whole, 1999), None, "too long");
        assert_eq!(decompress(&whole, 2001), None, "too short");
        assert_eq!(decompress(&[0x20, 0], 3), None, "a copy from before the start");
        assert_eq!(decompress(&[5, 1], 6), None, "cut literals");
        assert_eq!(decompress(&[0], usize::MAX), None, "a length without data");
    }
}
