//! The columns that the search for a path may settle next, and arithmetic on blocks of numbers.

/// Numbers of a block: nearly the root of a thousand columns.
pub(super) const BLOCK: usize = 32;

/// How far columns are. It knows the least distance of each block of columns, so that the nearest is found with few looks.
#[derive(Debug, Clone, Default)]
pub(super) struct Frontier {
    /// Infinite where no path leads. Not a number where a column is settled: no path to it is shorter, and it is no nearest one.
    distances: Vec<[f64; BLOCK]>,
    /// The least of each block, in blocks as well.
    least: Vec<[f64; BLOCK]>,
}

impl Frontier {
    /// Nothing is reached of so many columns.
    #[inline(always)]
    pub(super) fn begin(&mut self, columns: usize) {
        let blocks = columns.div_ceil(BLOCK);
        refill(&mut self.distances, blocks, [f64::INFINITY; BLOCK]);
        refill(&mut self.least, blocks.div_ceil(BLOCK), [f64::INFINITY; BLOCK]);
    }

    /// Whether a path is the shortest to a column so far; it is kept then.
    #[inline(always)]
    pub(super) fn shorten(&mut self, column: usize, distance: f64) -> bool {
        let known = &mut self.distances[column / BLOCK][column % BLOCK];
        let is_shorter = distance < *known;
        if is_shorter {
            *known = distance;
            let least = self.least_mut(column / BLOCK);
            *least = smaller(distance, *least);
        }
        is_shorter
    }

    /// The nearest column with its distance; of several that are as near the first.
    #[inline(always)]
    pub(super) fn nearest(&self) -> Option<(f64, usize)> {
        let mut least = f64::INFINITY;
        for blocks in &self.least {
            least = smaller(least_of(blocks), least);
        }
        if least == f64::INFINITY {
            return None;
        }
        let limit = least.next_up();
        let (mut blocks, mut bits) = (0, below(&self.least[0], limit));
        while bits == 0 {
            blocks += 1;
            bits = below(&self.least[blocks], limit);
        }
        let block = blocks * BLOCK + bits.trailing_zeros() as usize;
        Some((least, block * BLOCK + below(&self.distances[block], limit).trailing_zeros() as usize))
    }

    /// A column is done with.
    #[inline(always)]
    pub(super) fn settle(&mut self, column: usize) {
        let block = &mut self.distances[column / BLOCK];
        block[column % BLOCK] = f64::NAN;
        *self.least_mut(column / BLOCK) = least_of(&self.distances[column / BLOCK]);
    }

    #[inline(always)]
    fn least_mut(&mut self, block: usize) -> &mut f64 {
        &mut self.least[block / BLOCK][block % BLOCK]
    }
}

/// The least number of a block; infinite where there is none.
#[inline(always)]
fn least_of(numbers: &[f64; BLOCK]) -> f64 {
    let mut least = [f64::INFINITY; BLOCK];
    for k in 0..BLOCK {
        least[k] = smaller(numbers[k], least[k]);
    }
    let mut half = BLOCK / 2;
    while half > 0 {
        for k in 0..half {
            least[k] = smaller(least[k + half], least[k]);
        }
        half /= 2;
    }
    least[0]
}

/// A bit for each number of a block that is less than the limit.
#[inline(always)]
pub(super) fn below(numbers: &[f64; BLOCK], limit: f64) -> u32 {
    let mut bits = [0; BLOCK];
    for k in 0..BLOCK {
        bits[k] = if numbers[k] < limit { 1_u32 << k } else { 0 };
    }
    let mut half = BLOCK / 2;
    while half > 0 {
        for k in 0..half {
            bits[k] |= bits[k + half];
        }
        half /= 2;
    }
    bits[0]
}

/// The smaller number, in one instruction; `b` where `a` is none.
#[inline(always)]
pub(super) fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// So many times a value in the memory of before.
pub(super) fn refill<T: Clone>(memory: &mut Vec<T>, n: usize, value: T) {
    memory.clear();
    memory.resize(n, value);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_settled_by_distance_and_then_in_their_order() {
        // More than a block of blocks; nothing leads to the last column.
        let columns = BLOCK * BLOCK + 40;
        let mut frontier = Frontier::default();
        frontier.begin(columns);
        assert_eq!(frontier.nearest(), None);
        let distance = |c: usize| (c * 37 % 11) as f64 - 5.0;
        for c in (0..columns - 1).rev() {
            assert!(frontier.shorten(c, distance(c) + 1.0) && frontier.shorten(c, distance(c)));
            assert!(!frontier.shorten(c, distance(c)));
        }
        let mut expected: Vec<(f64, usize)> = (0..columns - 1).map(|c| (distance(c), c)).collect();
        expected.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for nearest in expected {
            assert_eq!(frontier.nearest(), Some(nearest));
            frontier.settle(nearest.1);
            assert!(!frontier.shorten(nearest.1, -100.0), "settled");
        }
        assert_eq!(frontier.nearest(), None);
    }
}
