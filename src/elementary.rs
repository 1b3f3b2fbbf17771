//! Elementary functions for loops that run in vector registers: no branch and no call, and the same bits on every machine,
//! which the mathematics library of a system does not promise. And how such loops are compiled.

/// A method that does what another, always inlined, does, compiled once more for processors with wider registers, which all have
/// instructions that find and count bits, too. No instruction that rounds otherwise is used (fused multiply-add is another
/// feature), so both give the same bits.
#[doc(hidden)] // For the fit of the networks.
#[macro_export]
macro_rules! wide {
    ($(#[$doc:meta])* $vis:vis fn $name:ident $(<$life:lifetime>)? (&mut self $($rest:tt)*) $($what:tt)*) => {
        $crate::wide! { @ [$(#[$doc])* $vis] $name [$(<$life>)?] self [&mut self] ($($rest)*) $($what)* }
    };
    ($(#[$doc:meta])* $vis:vis fn $name:ident (&self $($rest:tt)*) $($what:tt)*) => {
        $crate::wide! { @ [$(#[$doc])* $vis] $name [] self [&self] ($($rest)*) $($what)* }
    };
    (@ [$($before:tt)*] $name:ident [$($life:tt)*] $this:ident [$($receiver:tt)*] (
        $(, $arg:ident: $kind:ty)* $(,)?
    ) $(-> $out:ty)? = $wide:ident or $portable:ident) => {
        $($before)* fn $name $($life)* ($($receiver)* $(, $arg: $kind)*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            if std::arch::is_x86_feature_detected!("avx2")
                && std::arch::is_x86_feature_detected!("bmi1")
                && std::arch::is_x86_feature_detected!("bmi2")
                && std::arch::is_x86_feature_detected!("popcnt")
            {
                // SAFETY: the processor has just said that it has what the function was compiled for.
                return unsafe { $this.$wide($($arg),*) };
            }
            $this.$portable($($arg),*)
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,bmi1,bmi2,popcnt")]
        fn $wide $($life)* ($($receiver)* $(, $arg: $kind)*) $(-> $out)? {
            $this.$portable($($arg),*)
        }
    };
}
pub(crate) use crate::wide;

/// Adding it rounds to a whole number, which then stands in the low bits.
const WHOLE: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts, the first with so few bits that whole multiples of it are exact.
const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];

/// Whole numbers below 2^52 stand in the low bits of this and them.
const TWO_52: f64 = 4_503_599_627_370_496.0;

/// The whole part of a number from 0 to below 2^51: neither a call nor a cast, which is not done in vector registers.
#[inline(always)]
pub(crate) fn whole(x: f64) -> f64 {
    let rounded = (x + TWO_52) - TWO_52;
    rounded - if rounded > x { 1.0 } else { 0.0 }
}

/// The same as an index; of any other number it is no less than 2^51.
#[inline(always)]
pub(crate) fn index(x: f64) -> u64 {
    (whole(x) + TWO_52).to_bits().wrapping_sub(TWO_52.to_bits())
}

/// e^x to 3e-16 of it, for x held between -708 and 709: x = n ln 2 + r, the series of e^r, 2^n put into the exponent.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    let x = if x > -708.0 { x } else { -708.0 };
    let x = if x < 709.0 { x } else { 709.0 };
    let rounded = x * std::f64::consts::LOG2_E + WHOLE;
    let n = rounded - WHOLE;
    let r = x - n * LN_2[0] - n * LN_2[1];
    // r is within half of ln 2: the first term left out is 1.7e-16.
    let mut sum = 1.0 / 479_001_600.0;
    for factorial in
        [39_916_800.0, 3_628_800.0, 362_880.0, 40_320.0, 5_040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0, 1.0]
    {
        sum = sum * r + 1.0 / factorial;
    }
    sum * f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52)
}

/// The natural logarithm of a positive number that is not subnormal, to 3e-16 of the larger of it and 1: x = 2^n m with m
/// about 1, the series of the area tangent.
#[inline(always)]
pub(crate) fn ln(x: f64) -> f64 {
    const ONE: u64 = 1023 << 52;
    const ROOT_OF_HALF: u64 = std::f64::consts::FRAC_1_SQRT_2.to_bits();
    let above = x.to_bits().wrapping_add(ONE - ROOT_OF_HALF);
    let n = f64::from_bits(above >> 52 | TWO_52.to_bits()) - (TWO_52 + 1023.0);
    let m = f64::from_bits(x.to_bits().wrapping_sub((above >> 52 << 52).wrapping_sub(ONE)));
    let t = (m - 1.0) / (m + 1.0);
    let t2 = t * t;
    // t is within 0.172: the first term left out is 1e-17.
    let mut sum = 1.0 / 19.0;
    for odd in [17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0] {
        sum = sum * t2 + 1.0 / odd;
    }
    n * LN_2[0] + (2.0 * t * sum + n * LN_2[1])
}

/// a b + c; `FUSED`: in one rounding, for code that is compiled for processors that have that.
#[inline(always)]
pub(crate) fn multiply_add_f32<const FUSED: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// 1 / (1 + e^-x), to 2 units in the last place.
#[inline(always)]
pub(crate) fn sigmoid_f32<const FUSED: bool>(x: f32) -> f32 {
    1.0 / (1.0 + exp_f32::<FUSED>(-x))
}

/// The hyperbolic tangent, to 3e-7.
#[inline(always)]
pub(crate) fn tanh_f32<const FUSED: bool>(x: f32) -> f32 {
    2.0 * sigmoid_f32::<FUSED>(2.0 * x) - 1.0
}

/// e^x to 2 units in the last place, as [`exp`] (coefficients: Cephes, `expf`).
#[inline(always)]
fn exp_f32<const FUSED: bool>(x: f32) -> f32 {
    const WHOLE: f32 = 12_582_912.0;
    const LN_2_HIGH: f32 = 0.693_359_4;
    const LN_2_LOW: f32 = -2.121_944_4e-4;
    let x = x.clamp(-87.0, 87.0);
    let rounded = multiply_add_f32::<FUSED>(x, std::f32::consts::LOG2_E, WHOLE);
    let n = rounded - WHOLE;
    let r = multiply_add_f32::<FUSED>(n, -LN_2_LOW, multiply_add_f32::<FUSED>(n, -LN_2_HIGH, x));
    let mut p = 1.987_569_1e-4;
    for coefficient in [1.398_2e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5, 1.0, 1.0] {
        p = multiply_add_f32::<FUSED>(p, r, coefficient);
    }
    let two_to_n = f32::from_bits((rounded.to_bits() << 23).wrapping_add(1.0_f32.to_bits()));
    p * two_to_n
}

/// The natural logarithm of a positive number that is not subnormal, to 2e-7 of the larger of it and 1, as [`ln`].
#[inline(always)]
pub(crate) fn ln_f32(x: f32) -> f32 {
    const ONE: u32 = 127 << 23;
    const ROOT_OF_HALF: u32 = std::f32::consts::FRAC_1_SQRT_2.to_bits();
    let n = x.to_bits().wrapping_add(ONE - ROOT_OF_HALF) >> 23;
    let m = f32::from_bits(x.to_bits().wrapping_sub((n << 23).wrapping_sub(ONE)));
    let t = (m - 1.0) / (m + 1.0);
    let t2 = t * t;
    // t is within 0.172: the first term left out is 2e-9.
    let sum = (((1.0 / 9.0 * t2 + 1.0 / 7.0) * t2 + 1.0 / 5.0) * t2 + 1.0 / 3.0) * t2;
    (n as i32 - 127) as f32 * std::f32::consts::LN_2 + 2.0 * (t + t * sum)
}

/// Cosine and sine of an angle of a few turns, to 1e-6.
#[inline(always)]
pub(crate) fn cos_sin_f32(rad: f32) -> (f32, f32) {
    // The last bits of the sum are those of the number of quarters.
    const WHOLE: f32 = 12_582_912.0;
    // A quarter of a turn in two parts, the first with few bits, so that whole multiples of it are exact.
    const QUARTER_RAD: [f32; 2] = [1.570_312_5, 4.838_268e-4];
    let rounded = rad * std::f32::consts::FRAC_2_PI + WHOLE;
    let (quarter, quarters) = (rounded.to_bits(), rounded - WHOLE);
    let x = rad - quarters * QUARTER_RAD[0] - quarters * QUARTER_RAD[1];
    // Both series within an eighth of a turn.
    let x2 = x * x;
    let c = 1.0 - x2 * (0.5 - x2 * (1.0 / 24.0 - x2 * (1.0 / 720.0 - x2 / 40_320.0)));
    let s = x * (1.0 - x2 * (1.0 / 6.0 - x2 * (1.0 / 120.0 - x2 * (1.0 / 5_040.0 - x2 / 362_880.0))));
    let (c, s) = if quarter & 1 == 0 { (c, s) } else { (s, c) };
    let sign = |bits: u32| (bits & 2) << 30;
    let with = |value: f32, sign: u32| f32::from_bits(value.to_bits() ^ sign);
    (with(c, sign(quarter.wrapping_add(1))), with(s, sign(quarter)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_those_of_the_library() {
        for i in -7000..=7000 {
            let x = f64::from(i) * 0.1;
            assert!((exp(x) / x.exp() - 1.0).abs() < 4e-16, "exp({x}) = {}, not {}", exp(x), x.exp());
            let (x, known) = (x.exp(), x.exp().ln());
            assert!((ln(x) - known).abs() < 4e-16 * known.abs().max(1.0), "ln({x}) = {}, not {known}", ln(x));
            let x = f64::from(i) * 0.003;
            let near_1 = 1.0 + x * 1e-3;
            assert!((ln(near_1) - near_1.ln()).abs() < 4e-16, "ln({near_1})");
        }
        assert!(exp(-1e9) < 1e-300 && exp(1e9) > 1e300 && exp(f64::NEG_INFINITY) > 0.0);
    }

    #[test]
    fn the_whole_part_is_that_of_a_cast_where_there_is_one() {
        for i in 0..100_000 {
            let x = f64::from(i) * 0.37;
            for x in [x, x.floor(), x.floor() + 0.5, x.ceil().next_down().max(0.0), x * 1e9] {
                assert_eq!((whole(x), index(x)), (x.floor(), x as u64), "{x}");
            }
        }
        let beyond =
            [-f64::MIN_POSITIVE, -0.3, -0.5, -7.0, -1e30, 1e16, 1e300, f64::INFINITY, f64::NAN, -f64::NAN];
        assert!(beyond.iter().all(|&x| index(x) >= 1 << 51), "{beyond:?}");
    }

    #[test]
    fn functions_of_single_precision_are_exact_to_it() {
        for i in -4000..=4000 {
            let x = i as f32 * 0.02;
            let (found, expected) = (f64::from(exp_f32::<false>(x)), f64::from(x).exp());
            assert!((found / expected - 1.0).abs() < 3e-7, "exp({x}) = {found}, expected {expected}");
            let (found, expected) = (f64::from(tanh_f32::<false>(x)), f64::from(x).tanh());
            assert!((found - expected).abs() < 3e-7, "tanh({x}) = {found}, expected {expected}");
        }
        for i in -4000..=4000 {
            let x = (i as f32 * 0.02).exp();
            let (found, expected) = (f64::from(ln_f32(x)), f64::from(x).ln());
            assert!(
                (found - expected).abs() < 2e-7 * expected.abs().max(1.0),
                "ln({x}) = {found}, expected {expected}"
            );
        }
        assert_eq!(sigmoid_f32::<false>(1000.0), 1.0);
        assert!(sigmoid_f32::<false>(-1000.0) < 1e-37);
    }

    #[test]
    fn cosines_and_sines_are_those_of_the_library() {
        for i in -2000..2000 {
            let rad = i as f32 * 0.01;
            let ((cos, sin), (expected_sin, expected_cos)) = (cos_sin_f32(rad), f64::from(rad).sin_cos());
            let off = (f64::from(cos) - expected_cos).hypot(f64::from(sin) - expected_sin);
            assert!(off < 1e-6, "{rad}: {off}");
        }
    }
}
