//! Fresnel integrals, on which every diffraction formula of this room rests.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::elementary::cos_sin_f32;

/// A complex number: real and imaginary part.
pub type Complex = [f64; 2];

/// Up to here the power series is used. Its largest term is then about 90, so 14 digits are left.
const SERIES_MAX: f64 = 2.0;
/// Fractions and series end where a further term changes nothing.
const TERMS_MAX: usize = 200;

/// C(x) and S(x), the integrals of cos(pi t^2 / 2) and of sin(pi t^2 / 2) from 0 to x, to 1e-12 (Abramowitz and Stegun,
/// 7.3.1 and 7.3.2).
///
/// ```
/// use umbracast::radio::fresnel::integrals;
///
/// let [c, s] = integrals(1.0);
/// assert!((c - 0.779_893_400_376_823).abs() < 1e-12 && (s - 0.438_259_147_390_355).abs() < 1e-12);
/// assert_eq!(integrals(-1.0), [-c, -s]);
/// ```
pub fn integrals(x: f64) -> Complex {
    let size = x.abs();
    let of_size = if size < SERIES_MAX { series(size) } else { fraction(size) };
    of_size.map(|part| part.copysign(x))
}

/// C and S in single precision, to 1.5e-4, without a branch. C = 1/2 + f sin - g cos and
/// S = 1/2 - f cos - g sin of pi x^2 / 2 (Abramowitz and Stegun, 7.3.9 and 7.3.10); f and g are smooth, and here polynomials in
/// 1 / (1 + 0.8 x) whose largest error is the least.
#[inline(always)]
pub(super) fn integrals_f32(x: f32) -> [f32; 2] {
    const F: [f32; 8] =
        [0.251_458, 0.300_926_3, 0.260_458_65, -2.138_432_3, 12.546_953, -24.620_909, 19.295_562, -5.396_075];
    const G: [f32; 8] = [
        0.007_737_244,
        -0.238_270_66,
        2.488_258_1,
        -11.225_687,
        26.836_37,
        -29.262_285,
        14.593_053,
        -2.699_097_3,
    ];
    /// Farther out both are a half, and the phase is not known in single precision.
    const FARTHEST: f32 = 1000.0;
    /// Adding it rounds to a whole number.
    const WHOLE: f32 = 12_582_912.0;
    let size = if x.abs() < FARTHEST { x.abs() } else { FARTHEST };
    let u = 1.0 / (1.0 + 0.8 * size);
    let of = |parts: &[f32; 8]| u * parts.iter().rev().fold(0.0, |sum, part| sum * u + part);
    let (f, g) = (of(&F), of(&G));
    let turns = 0.25 * size * size;
    let (cos, sin) = cos_sin_f32(std::f32::consts::TAU * (turns - (turns + WHOLE - WHOLE)));
    [0.5 + f * sin - g * cos, 0.5 - f * cos - g * sin].map(|part| part.copysign(x))
}

/// The power series of both (7.3.11 and 7.3.13), as one sum over the powers of i pi x^2 / 2.
fn series(x: f64) -> Complex {
    let square = FRAC_PI_2 * x * x;
    let (mut power, mut sum) = (x, [x, 0.0]);
    for n in 1..TERMS_MAX {
        power *= square / n as f64;
        let term = power / (2 * n + 1) as f64;
        let sign = if n % 4 < 2 { 1.0 } else { -1.0 };
        sum[n % 2] += sign * term;
        if term < f64::EPSILON {
            break;
        }
    }
    sum
}

/// C + i S = (1 + i) / 2 erf(z) with z = (1 - i) sqrt(pi) x / 2 (7.3.22), the complement of erf by its continued fraction
/// (7.1.14), which is worked out from the end that is far enough.
fn fraction(x: f64) -> Complex {
    // With z^2 = -i pi x^2 / 2 the even part of the fraction is 2z / (2z^2 + 1 - 1*2 / (2z^2 + 5 - 3*4 / (2z^2 + 9 - ...))).
    let twice_square = [0.0, -PI * x * x];
    let terms = 12 + (160.0 / (x * x)) as usize;
    let mut tail = [0.0, 0.0];
    for n in (1..=terms.min(TERMS_MAX)).rev() {
        let below = add(add(twice_square, [(4 * n + 1) as f64, 0.0]), tail);
        tail = divide([-(((2 * n - 1) * 2 * n) as f64), 0.0], below);
    }
    let below = add(add(twice_square, [1.0, 0.0]), tail);
    // erfc(z) = exp(-z^2) / sqrt(pi) * fraction, and 2z / sqrt(pi) = (1 - i) x.
    let (sin, cos) = (FRAC_PI_2 * x * x).sin_cos();
    let complement = multiply([cos, sin], divide([x, -x], below));
    multiply([0.5, 0.5], [1.0 - complement[0], -complement[1]])
}

fn add(a: Complex, b: Complex) -> Complex {
    [a[0] + b[0], a[1] + b[1]]
}

/// The product.
pub(super) fn multiply(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn divide(a: Complex, b: Complex) -> Complex {
    let square = b[0] * b[0] + b[1] * b[1];
    [(a[0] * b[0] + a[1] * b[1]) / square, (a[1] * b[0] - a[0] * b[1]) / square]
}

/// The square of the absolute value.
pub(super) fn power(a: Complex) -> f64 {
    a[0] * a[0] + a[1] * a[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_and_fraction_agree_where_they_meet() {
        for x in [1.6, 1.8, 2.0, 2.2, 2.4] {
            let (a, b) = (series(x), fraction(x));
            assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12, "{x}: {a:?} {b:?}");
        }
    }

    #[test]
    fn single_precision_is_near() {
        for i in -30_000..30_000 {
            let x = i as f32 * 2.043e-3;
            let (found, expected) = (integrals_f32(x), integrals(f64::from(x)));
            let off = (f64::from(found[0]) - expected[0]).hypot(f64::from(found[1]) - expected[1]);
            assert!(off < 1.5e-4, "{x}: {found:?} {expected:?}");
        }
        assert!(integrals_f32(-1e9).iter().all(|part| (part + 0.5).abs() < 1e-3));
    }

    #[test]
    fn far_out_both_are_a_half() {
        // Abramowitz and Stegun, table 7.7.
        let [c, s] = integrals(5.0);
        assert!((c - 0.563_631_188_704_012).abs() < 1e-12 && (s - 0.499_191_381_917_116).abs() < 1e-12);
        let [c, s] = integrals(1e6);
        assert!((c - 0.5).abs() < 1e-6 && (s - 0.5).abs() < 1e-6);
    }
}
