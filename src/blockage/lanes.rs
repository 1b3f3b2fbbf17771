//! Arithmetic for loops that run in vector registers: nothing calls out, nothing branches.

use crate::elementary::cos_sin_f32;

/// Samples of a word: a bit each.
pub(crate) const WORD: usize = 32;

// `f32::min` and `max` ask for NaN as well, which no lane holds: these are one instruction.

#[inline(always)]
pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A bit for each number that is not negative, of up to a word of them in whole fours.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn bits_of<const N: usize>(numbers: &[f32; N]) -> u32 {
    use std::arch::x86_64::{_mm_cmpge_ps, _mm_movemask_ps, _mm_setr_ps, _mm_setzero_ps};
    // The instruction that does this is none that the compiler finds.
    let (fours, _) = numbers.as_chunks::<4>();
    fours.iter().enumerate().fold(0, |bits, (i, &[a, b, c, d])| {
        // SAFETY: there is no processor of this kind without SSE.
        let four = unsafe { _mm_movemask_ps(_mm_cmpge_ps(_mm_setr_ps(a, b, c, d), _mm_setzero_ps())) };
        bits | (four as u32) << (4 * i)
    })
}

/// A bit for each number that is not negative, of up to a word of them in whole fours.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub(crate) fn bits_of<const N: usize>(numbers: &[f32; N]) -> u32 {
    numbers.iter().enumerate().fold(0, |bits, (k, number)| bits | u32::from(*number >= 0.0) << k)
}

/// Samples `word * WORD` and on of an array that has whole words.
#[inline(always)]
pub(crate) fn word_of(values: &[f32], word: usize) -> &[f32; WORD] {
    let (words, _) = values.as_chunks::<WORD>();
    &words[word]
}

#[inline(always)]
pub(super) fn word_of_mut(values: &mut [f32], word: usize) -> &mut [f32; WORD] {
    let (words, _) = values.as_chunks_mut::<WORD>();
    &mut words[word]
}

/// Cosines and sines of angles of a few turns. The first array holds the angles before, in radians.
#[inline(always)]
pub(crate) fn cos_sin([cos, sin]: &mut [Vec<f32>; 2]) {
    sin.resize(cos.len(), 0.0);
    for (cos, sin) in cos.iter_mut().zip(sin) {
        (*cos, *sin) = cos_sin_f32(*cos);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bit_stands_for_what_is_not_negative() {
        let mut numbers = [-1.0; WORD];
        (numbers[0], numbers[9], numbers[31]) = (0.0, 2.0, 1e-9);
        assert_eq!(bits_of(&numbers), 1 | 1 << 9 | 1 << 31);
    }
}
