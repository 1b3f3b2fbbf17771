//! Arithmetic for loops that run in vector registers: nothing calls out, nothing branches.

/// Samples of a word: a bit each.
pub(super) const WORD: usize = 32;

// `f32::min` and `max` ask for NaN as well, which no lane holds: these are one instruction.

#[inline(always)]
pub(super) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
pub(super) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A bit for each number that is not negative.
#[inline(always)]
pub(super) fn bits_of(numbers: &[f32; WORD]) -> u32 {
    let mut bits = [0; WORD];
    for k in 0..WORD {
        bits[k] = if numbers[k] >= 0.0 { 1_u32 << k } else { 0 };
    }
    bits.iter().fold(0, |all, bit| all | bit)
}

/// The largest.
#[inline(always)]
pub(super) fn most_of(numbers: &[f32; WORD]) -> f32 {
    let (mut most, (eights, _)) = ([f32::MIN; 8], numbers.as_chunks::<8>());
    for eight in eights {
        for k in 0..8 {
            most[k] = larger(most[k], eight[k]);
        }
    }
    let four: [f32; 4] = std::array::from_fn(|k| larger(most[k], most[k + 4]));
    larger(larger(four[0], four[2]), larger(four[1], four[3]))
}

/// Samples `word * WORD` and on of an array that has whole words.
#[inline(always)]
pub(super) fn word_of(values: &[f32], word: usize) -> &[f32; WORD] {
    let (words, _) = values.as_chunks::<WORD>();
    &words[word]
}

#[inline(always)]
pub(super) fn word_of_mut(values: &mut [f32], word: usize) -> &mut [f32; WORD] {
    let (words, _) = values.as_chunks_mut::<WORD>();
    &mut words[word]
}

/// Cosines and sines of angles of a few turns, to 1e-6. The first array holds the angles before, in radians.
#[inline(always)]
pub(super) fn cos_sin([cos, sin]: &mut [Vec<f32>; 2]) {
    // Adding this and taking it away rounds to whole numbers; meanwhile the last bits are those of the whole number.
    const WHOLE: f32 = 12_582_912.0;
    // A quarter of a turn in two parts, the first with few bits, so that whole multiples of it are exact.
    const QUARTER_RAD: [f32; 2] = [1.570_312_5, 4.838_268e-4];
    sin.resize(cos.len(), 0.0);
    for (cos, sin) in cos.iter_mut().zip(sin) {
        let rounded = *cos * std::f32::consts::FRAC_2_PI + WHOLE;
        let (quarter, quarters) = (rounded.to_bits(), rounded - WHOLE);
        let x = *cos - quarters * QUARTER_RAD[0] - quarters * QUARTER_RAD[1];
        // Both series within an eighth of a turn.
        let x2 = x * x;
        let c = 1.0 - x2 * (0.5 - x2 * (1.0 / 24.0 - x2 * (1.0 / 720.0 - x2 / 40_320.0)));
        let s = x * (1.0 - x2 * (1.0 / 6.0 - x2 * (1.0 / 120.0 - x2 * (1.0 / 5_040.0 - x2 / 362_880.0))));
        let (c, s) = if quarter & 1 == 0 { (c, s) } else { (s, c) };
        let sign = |bits: u32| f32::from_bits((bits & 2) << 30);
        *cos = f32::from_bits(c.to_bits() ^ sign(quarter.wrapping_add(1)).to_bits());
        *sin = f32::from_bits(s.to_bits() ^ sign(quarter).to_bits());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosines_and_sines_are_those_of_the_library() {
        let angles: Vec<f32> = (-2000..2000).map(|i| i as f32 * 0.01).collect();
        let mut found = [angles.clone(), Vec::new()];
        cos_sin(&mut found);
        for (i, angle) in angles.iter().enumerate() {
            let (sin, cos) = f64::from(*angle).sin_cos();
            let off = (f64::from(found[0][i]) - cos).hypot(f64::from(found[1][i]) - sin);
            assert!(off < 1e-6, "{angle}: {off}");
        }
    }

    #[test]
    fn a_bit_stands_for_what_is_not_negative() {
        let mut numbers = [-1.0; WORD];
        (numbers[0], numbers[9], numbers[31]) = (0.0, 2.0, 1e-9);
        assert_eq!(bits_of(&numbers), 1 | 1 << 9 | 1 << 31);
    }
}
