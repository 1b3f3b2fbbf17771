//! Fresnel integrals added up once, by Simpson's rule.

use std::f64::consts::FRAC_PI_2;

/// Between two entries.
const STEP: f64 = 1.0 / 512.0;
/// Beyond, the integrals are within 0.011 of a half.
const FARTHEST: f64 = 30.0;

/// C and S from 0 on.
#[derive(Debug, Clone)]
pub(crate) struct Fresnel {
    sums: Vec<[f64; 2]>,
}

impl Fresnel {
    pub(crate) fn new() -> Self {
        let at = |t: f64| {
            let (sin, cos) = (FRAC_PI_2 * t * t).sin_cos();
            [cos, sin]
        };
        let mut sums = vec![[0.0; 2]];
        for i in 0..(FARTHEST / STEP) as usize {
            let (from, middle, to) =
                (at(i as f64 * STEP), at((i as f64 + 0.5) * STEP), at((i + 1) as f64 * STEP));
            let last = sums[i];
            sums.push(
                [0, 1].map(|part| last[part] + STEP / 6.0 * (from[part] + 4.0 * middle[part] + to[part])),
            );
        }
        Self { sums }
    }

    /// C(x) and S(x).
    pub(crate) fn at(&self, x: f64) -> [f64; 2] {
        let place = x.abs() / STEP;
        let i = place as usize;
        let of_size = match (self.sums.get(i), self.sums.get(i + 1)) {
            (Some(a), Some(b)) => [0, 1].map(|part| a[part] + place.fract() * (b[part] - a[part])),
            _ => [0.5; 2],
        };
        of_size.map(|part| part.copysign(x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sums_are_those_of_tables() {
        // Abramowitz and Stegun, table 7.7.
        let fresnel = Fresnel::new();
        for (x, c, s) in [
            (0.5, 0.492_344_2, 0.064_732_4),
            (1.0, 0.779_893_4, 0.438_259_1),
            (5.0, 0.563_631_2, 0.499_191_4),
        ] {
            let found = fresnel.at(x);
            assert!((found[0] - c).abs() < 1e-5 && (found[1] - s).abs() < 1e-5, "{x}: {found:?}");
            assert_eq!(fresnel.at(-x), found.map(|part| -part));
        }
    }
}
