//! The pairs that an assignment looks at: all of a row that may be made, or the cheapest of them.

use super::frontier::{BLOCK, below, smaller};
use crate::elementary::wide;

/// A list of a row of a matrix has about so many pairs. The best assignment of random costs takes hardly any dearer one.
const FIRST: usize = 12;
/// A list that was too short gets so many times its length.
const GROWTH: usize = 4;

/// A column that a row may have.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub(super) column: usize,
    pub(super) cost: f64,
}

/// Where a row's list lies.
#[derive(Debug, Clone, Copy)]
struct List {
    from: usize,
    to: usize,
    /// No pair that is not listed costs less, with its column's price taken off. As prices only fall, this stays so.
    others: f64,
}

/// A list for each row. Pairs from 0 on are never listed, for a row that stays alone costs nothing.
#[derive(Debug, Clone, Default)]
pub(super) struct Lists {
    lists: Vec<List>,
    pairs: Vec<Pair>,
    asked: Vec<f64>,
    sorted: Vec<f64>,
}

impl Lists {
    pub(super) fn clear(&mut self) {
        self.lists.clear();
        self.pairs.clear();
    }

    /// How many rows there are.
    pub(super) fn len(&self) -> usize {
        self.lists.len()
    }

    /// A row's list, the columns in their order.
    #[inline(always)]
    pub(super) fn pairs(&self, row: usize) -> &[Pair] {
        let List { from, to, .. } = self.lists[row];
        &self.pairs[from..to]
    }

    /// No other pair of the row asks less; 0 where all are listed.
    #[inline(always)]
    pub(super) fn others(&self, row: usize) -> f64 {
        self.lists[row].others
    }

    /// A row more, with all its pairs, columns ascending.
    pub(super) fn add(&mut self, pairs: impl Iterator<Item = Pair>) {
        let from = self.pairs.len();
        self.pairs.extend(pairs.filter(|pair| pair.cost < 0.0));
        self.lists.push(List { from, to: self.pairs.len(), others: 0.0 });
    }

    wide! {
        /// The rows of a matrix, each with its cheapest pairs.
        pub(super) fn add_cheapest(&mut self, costs: &[f64], columns: usize) = add_wide or add_portable
    }

    #[inline(always)]
    fn add_portable(&mut self, costs: &[f64], columns: usize) {
        let mut others = 0.0;
        for row in costs.chunks_exact(columns.max(1)) {
            let from = self.pairs.len();
            // Rows are mostly alike, so what limits one row's list is tried with the next.
            self.add_below(row, others);
            let listed = self.pairs.len() - from;
            let is_short = listed < FIRST / 2 && others < 0.0;
            if is_short || listed > 2 * FIRST {
                self.pairs.truncate(from);
                others = about_first(row);
                self.add_below(row, others);
            }
            self.lists.push(List { from, to: self.pairs.len(), others });
        }
    }

    /// The pairs of a row that cost less than a limit.
    #[inline(always)]
    fn add_below(&mut self, row: &[f64], limit: f64) {
        let (blocks, rest) = row.as_chunks::<BLOCK>();
        for (b, block) in blocks.iter().enumerate() {
            let mut bits = below(block, limit);
            while bits != 0 {
                let k = bits.trailing_zeros() as usize;
                self.pairs.push(Pair { column: b * BLOCK + k, cost: block[k] });
                bits &= bits - 1;
            }
        }
        for (column, &cost) in (blocks.len() * BLOCK..).zip(rest) {
            if cost < limit {
                self.pairs.push(Pair { column, cost });
            }
        }
    }

    /// Lists more pairs of a row of the matrix, at the prices that columns have by now.
    #[cold]
    pub(super) fn extend(&mut self, row: usize, costs: &[f64], prices: &[f64]) {
        let costs = &costs[row * prices.len()..][..prices.len()];
        let List { from, to, others } = self.lists[row];
        self.asked.clear();
        self.asked.extend(costs.iter().zip(prices).map(|(cost, price)| cost - price));
        let enough = GROWTH * (to - from).max(FIRST);
        // All of them, also where so many ask the same that a longer list is none.
        let mut limit = 0.0;
        if enough < prices.len() {
            self.sorted.clone_from(&self.asked);
            let asked = *self.sorted.select_nth_unstable_by(enough, f64::total_cmp).1;
            if others < asked && asked < 0.0 {
                limit = asked;
            }
        }
        let from = self.pairs.len();
        for (column, (&cost, &asked)) in costs.iter().zip(&self.asked).enumerate() {
            if asked < limit {
                self.pairs.push(Pair { column, cost });
            }
        }
        self.lists[row] = List { from, to: self.pairs.len(), others: limit };
    }
}

/// A cost that about [`FIRST`] costs of a row are below; 0 where hardly more are below that. Each place of a block knows its least
/// cost, and one of these is it.
#[inline(always)]
fn about_first(row: &[f64]) -> f64 {
    let (blocks, rest) = row.as_chunks::<BLOCK>();
    let mut least = [0.0; BLOCK];
    for block in blocks {
        for k in 0..BLOCK {
            least[k] = smaller(block[k], least[k]);
        }
    }
    for (least, &cost) in least.iter_mut().zip(rest) {
        *least = smaller(cost, *least);
    }
    if below(&least, 0.0).count_ones() as usize <= FIRST {
        return 0.0;
    }
    *least.select_nth_unstable_by(FIRST, f64::total_cmp).1
}
