//! Fresnel integrals from a table, for losses that are asked a hundred thousand times a frame.

use super::fresnel::integrals;

/// Entries of the table for each unit of the argument; a straight line between two of them is 2e-4 off at most.
const PER_UNIT: f32 = 256.0;
/// Beyond, an edge is so far that what comes round it is 0.013 of the field at most. It counts as none.
const FARTHEST: f32 = 24.0;

/// C and S of arguments from 0 to [`FARTHEST`].
#[derive(Debug, Clone)]
pub(super) struct Table {
    entries: Vec<[f32; 2]>,
}

impl Table {
    pub(super) fn new() -> Self {
        let last = (FARTHEST * PER_UNIT) as usize;
        let entry = |i: usize| integrals(i as f64 / f64::from(PER_UNIT)).map(|part| part as f32);
        Self { entries: (0..=last + 1).map(entry).collect() }
    }

    /// C and S, to 2e-4; a half each beyond [`FARTHEST`].
    #[inline(always)]
    pub(super) fn integrals(&self, x: f32) -> [f32; 2] {
        let size = x.abs();
        let of_size = if size < FARTHEST {
            let at = size * PER_UNIT;
            let i = at as usize;
            let share = at - i as f32;
            let (a, b) = (self.entries[i], self.entries[i + 1]);
            [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
        } else {
            [0.5, 0.5]
        };
        of_size.map(|part| part.copysign(x))
    }
}

/// The same in double precision.
#[cfg(test)]
fn exact(x: f32) -> [f64; 2] {
    integrals(f64::from(x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_integral() {
        let table = Table::new();
        for i in -11500..11500 {
            let x = i as f32 * 2.043e-3;
            let (found, expected) = (table.integrals(x), exact(x));
            let off = f64::hypot(f64::from(found[0]) - expected[0], f64::from(found[1]) - expected[1]);
            assert!(off < 2e-4, "{x}: {found:?} {expected:?}");
        }
        assert_eq!(table.integrals(-25.0), [-0.5, -0.5]);
    }
}
