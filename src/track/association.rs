//! Assigns detections to tracks.
//!
//! The assignment is written by hand. Its algorithm allows rows without a partner and forbidden pairs, and looks at no others than
//! those that are allowed; crates for square matrices have none of this.

use super::frontier::{Frontier, refill, smaller};
use super::shortlist::{Lists, Pair};
use crate::detect::Detection;
use crate::elementary::wide;

/// A pair that is not allowed.
pub const FORBIDDEN: f64 = f64::INFINITY;

/// Columns are taken from a row so many times for each row, before what is left is left to paths: prices may fall by ever less.
/// A bid is cheap, and the last paths lead over half of a matrix.
const BIDS: usize = 32;

/// Gives rows to columns so that the sum of the costs is the least; `cost(r, c)` may be [`FORBIDDEN`], and a row
/// that stays alone costs nothing, so only pairs below zero are made. Returns each row's column.
///
/// Row reduction, then shortest augmenting paths with potentials (Jonker and Volgenant 1987; Crouse 2016) over the pairs below
/// zero. Which of equal sums is taken depends on the order of rows and columns alone.
pub fn optimal(rows: usize, columns: usize, cost: impl Fn(usize, usize) -> f64) -> Vec<Option<usize>> {
    let mut assignment = Assignment::default();
    assignment.optimal(rows, columns, cost);
    assignment.column_of
}

/// The memory of [`optimal`], for who asks again and again.
#[derive(Debug, Clone, Default)]
pub struct Assignment {
    /// Each row's column.
    pub column_of: Vec<Option<usize>>,
    row_of: Vec<Option<usize>>,
    lists: Lists,
    /// Columns that may be those of the row that is added.
    among: Vec<usize>,
    row_price: Vec<f64>,
    /// From 0 down.
    column_price: Vec<f64>,
    /// Of the path that is looked for: the columns within reach, the row that each is reached from, and those that are settled with
    /// their distances.
    frontier: Frontier,
    came_from: Vec<usize>,
    settled: Vec<(usize, f64)>,
}

/// Where a path ends.
enum End {
    /// At a column that nobody has.
    Free(usize),
    /// At a row that stays alone from now on.
    Alone(usize),
}

impl Assignment {
    /// [`optimal`], into `column_of`. Every cost is asked once.
    pub fn optimal(&mut self, rows: usize, columns: usize, cost: impl Fn(usize, usize) -> f64) {
        self.optimal_among(rows, columns, |_, all| all.extend(0..columns), cost);
    }

    /// The same where few columns may be a row's: `among` lists those, in any order, and all others are [`FORBIDDEN`].
    pub fn optimal_among(
        &mut self,
        rows: usize,
        columns: usize,
        among: impl Fn(usize, &mut Vec<usize>),
        cost: impl Fn(usize, usize) -> f64,
    ) {
        self.lists.clear();
        for r in 0..rows {
            self.among.clear();
            among(r, &mut self.among);
            self.among.sort_unstable();
            self.lists.add(self.among.iter().map(|&column| Pair { column, cost: cost(r, column) }));
        }
        self.solve(&[], columns);
    }

    /// [`optimal`] of a matrix that has so many columns, row after row. Of a long row only the cheapest pairs are looked at, and
    /// more of them as soon as one of the others could be made (after LAPMOD: Volgenant 1996). The sum is the least all the same.
    pub fn of_matrix(&mut self, costs: &[f64], columns: usize) {
        self.lists.clear();
        self.lists.add_cheapest(costs, columns);
        self.solve(costs, columns);
    }

    wide! {
        /// Gives rows to columns. `costs` is the matrix that the lists are of; nothing is asked of it where they are complete.
        fn solve(&mut self, costs: &[f64], columns: usize) = solve_wide or solve_portable
    }

    #[inline(always)]
    fn solve_portable(&mut self, costs: &[f64], columns: usize) {
        let rows = self.lists.len();
        refill(&mut self.column_of, rows, None);
        refill(&mut self.row_price, rows, 0.0);
        refill(&mut self.column_price, columns, 0.0);
        refill(&mut self.row_of, columns, None);
        refill(&mut self.came_from, columns, 0);
        self.outbid(costs);
        for r in 0..rows {
            if self.column_of[r].is_none() && !self.lists.pairs(r).is_empty() {
                self.augment(r, costs);
            }
        }
    }

    /// Augmenting row reduction: every row takes the column that it wants most, whose price falls until the row's second choice
    /// is as good. A row that had the column then looks for another. That settles most conflicts without a path.
    #[inline(always)]
    fn outbid(&mut self, costs: &[f64]) {
        let Self { column_of, row_of, row_price, column_price, lists, .. } = self;
        let rows = column_of.len();
        let mut more = BIDS * rows;
        for first in 0..rows {
            let mut row = first;
            loop {
                // To stay alone costs nothing and is free to all.
                let (mut best, mut second, mut wanted) = (0.0, 0.0, None);
                for &Pair { column, cost } in lists.pairs(row) {
                    let asked = cost - column_price[column];
                    second = smaller(if asked < best { best } else { asked }, second);
                    wanted = if asked < best { Some(column) } else { wanted };
                    best = smaller(asked, best);
                }
                if second > lists.others(row) {
                    lists.extend(row, costs, column_price);
                    continue;
                }
                row_price[row] = second;
                let Some(column) = wanted else { break };
                column_price[column] -= second - best;
                column_of[row] = Some(column);
                let Some(owner) = row_of[column].replace(row) else { break };
                column_of[owner] = None;
                if more == 0 {
                    break;
                }
                more -= 1;
                row = owner;
            }
        }
    }

    /// Gives a row a column, or leaves one alone, whichever costs least together.
    #[inline(always)]
    fn augment(&mut self, start: usize, costs: &[f64]) {
        let (end, length) = self.shortest(start, costs);
        let Self { column_of, row_of, row_price, column_price, came_from, settled, .. } = self;
        row_price[start] += length;
        for (c, distance) in settled.drain(..) {
            if let Some(owner) = row_of[c] {
                row_price[owner] += length - distance;
                column_price[c] -= length - distance;
            }
        }
        let mut column = match end {
            End::Free(column) => Some(column),
            End::Alone(row) => column_of[row].take(),
        };
        while let Some(c) = column {
            let row = came_from[c];
            row_of[c] = Some(row);
            column = column_of[row].replace(c);
        }
    }

    /// Dijkstra from a row over reduced costs to the nearest column that is free, or row that may as well stay alone.
    #[inline(always)]
    fn shortest(&mut self, start: usize, costs: &[f64]) -> (End, f64) {
        self.frontier.begin(self.column_price.len());
        let (mut row, mut so_far) = (start, 0.0);
        let (mut alone, mut alone_row) = (f64::INFINITY, start);
        // How near the nearest end is that is known, and how near pairs may lead that are not listed.
        let (mut end, mut others) = (f64::INFINITY, f64::INFINITY);
        loop {
            let off = so_far - self.row_price[row];
            if off < alone {
                (alone, alone_row) = (off, row);
                end = smaller(end, alone);
            }
            self.look(row, off, &mut end);
            others = smaller(others, off + self.lists.others(row));
            let mut nearest = self.frontier.nearest();
            while others < nearest.map_or(alone, |(distance, _)| smaller(distance, alone)) {
                others = self.look_again(start, others, costs, &mut end);
                nearest = self.frontier.nearest();
            }
            let Some((distance, column)) = nearest.filter(|&(distance, _)| distance <= alone) else {
                return (End::Alone(alone_row), alone);
            };
            so_far = distance;
            let Some(owner) = self.row_of[column] else { return (End::Free(column), so_far) };
            row = owner;
            self.frontier.settle(column);
            self.settled.push((column, so_far));
        }
    }

    /// Shortens paths by going on over a row. No path is kept that is longer than to the nearest end.
    #[inline(always)]
    fn look(&mut self, row: usize, off: f64, end: &mut f64) {
        let Self { row_of, column_price, lists, frontier, came_from, .. } = self;
        for &Pair { column, cost } in lists.pairs(row) {
            let through = off + cost - column_price[column];
            if through <= *end && frontier.shorten(column, through) {
                came_from[column] = row;
                if row_of[column].is_none() {
                    *end = through;
                }
            }
        }
    }

    /// Lists more pairs of the rows whose others may lead as near as `least`. Returns how near others may lead then.
    #[cold]
    fn look_again(&mut self, start: usize, least: f64, costs: &[f64], end: &mut f64) -> f64 {
        let mut others = f64::INFINITY;
        for i in 0..=self.settled.len() {
            let from = i.checked_sub(1).map(|last| self.settled[last]);
            let (row, so_far) =
                from.map_or((start, 0.0), |(c, so_far)| (self.row_of[c].unwrap_or(start), so_far));
            let off = so_far - self.row_price[row];
            if off + self.lists.others(row) <= least {
                self.lists.extend(row, costs, &self.column_price);
                self.look(row, off, end);
            }
            others = smaller(others, off + self.lists.others(row));
        }
        others
    }
}

/// Indices of the detections that are numbers, in an order that does not depend on the one they came in.
pub(super) fn in_order(detections: &[Detection], order: &mut Vec<usize>) {
    order.clear();
    order.extend((0..detections.len()).filter(|&d| detections[d].position_m.is_finite()));
    order.sort_unstable_by(|&a, &b| {
        let (p, q) = (&detections[a], &detections[b]);
        let by_place =
            p.position_m.x.total_cmp(&q.position_m.x).then(p.position_m.y.total_cmp(&q.position_m.y));
        by_place.then(p.time_ns.cmp(&q.time_ns)).then(a.cmp(&b))
    });
}

/// The cheapest allowed pair first, then the cheapest of what is left. Returns each row's column.
pub fn greedy(rows: usize, columns: usize, cost: impl Fn(usize, usize) -> f64) -> Vec<Option<usize>> {
    let mut pairs: Vec<(f64, usize, usize)> = (0..rows)
        .flat_map(|r| (0..columns).map(move |c| (r, c)))
        .map(|(r, c)| (cost(r, c), r, c))
        .filter(|pair| pair.0 < FORBIDDEN)
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut column_of = vec![None; rows];
    let mut taken = vec![false; columns];
    for (_, r, c) in pairs {
        if column_of[r].is_none() && !taken[c] {
            (column_of[r], taken[c]) = (Some(c), true);
        }
    }
    column_of
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Tries every way.
    fn brute_force(cost: &[Vec<f64>], row: usize, taken: &mut Vec<bool>) -> f64 {
        if row == cost.len() {
            return 0.0;
        }
        let mut best = brute_force(cost, row + 1, taken);
        for c in 0..taken.len() {
            if !taken[c] && cost[row][c] < FORBIDDEN {
                taken[c] = true;
                best = best.min(cost[row][c] + brute_force(cost, row + 1, taken));
                taken[c] = false;
            }
        }
        best
    }

    #[test]
    fn optimal_is_as_good_as_trying_every_way() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        for _ in 0..2000 {
            let (rows, columns) = (rng.random_range(0..6), rng.random_range(0..6));
            let cost: Vec<Vec<f64>> = (0..rows)
                .map(|_| {
                    (0..columns)
                        .map(|_| if rng.random_bool(0.3) { FORBIDDEN } else { rng.random_range(-10.0..3.0) })
                        .collect()
                })
                .collect();
            let found = optimal(rows, columns, |r, c| cost[r][c]);
            let mut taken = vec![false; columns];
            let mut sum = 0.0;
            for (r, c) in found.iter().enumerate().filter_map(|(r, c)| c.map(|c| (r, c))) {
                assert!(!taken[c], "column {c} given twice");
                taken[c] = true;
                sum += cost[r][c];
            }
            let best = brute_force(&cost, 0, &mut vec![false; columns]);
            assert!((sum - best).abs() < 1e-9, "{sum} against {best} for {cost:?}");
        }
    }

    /// What an assignment costs, if it gives no column twice.
    fn sum(costs: &[f64], columns: usize, column_of: &[Option<usize>]) -> f64 {
        let mut taken = vec![false; columns];
        let pairs = column_of.iter().enumerate().filter_map(|(r, c)| c.map(|c| (r, c)));
        pairs
            .map(|(r, c)| {
                assert!(!std::mem::replace(&mut taken[c], true), "column {c} given twice");
                costs[r * columns + c]
            })
            .sum()
    }

    #[test]
    fn a_matrix_costs_the_same_whether_all_pairs_are_looked_at_or_the_cheapest() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(2);
        let mut short = Assignment::default();
        let kinds: [fn(f64, f64, f64) -> f64; 6] = [
            |noise, _, _| noise - 1.0,
            // All want the same, and lists of the cheapest are too short.
            |noise, r, c| -r * c + 1e-3 * noise,
            |noise, _, c| c - 40.0 + 0.1 * noise,
            // Many equal ones.
            |noise, _, _| (5.0 * noise).floor() - 4.0,
            |_, _, _| -1.0,
            |noise, r, c| if noise < 0.2 { FORBIDDEN } else { (r - c).abs() - 20.0 + noise },
        ];
        let sides = [(0, 5), (5, 0), (3, 200), (200, 3), (40, 97), (97, 40), (120, 120)];
        let all = sides.iter().flat_map(|side| kinds.map(|kind| (*side, kind)));
        for ((rows, columns), kind) in all.cycle().take(10 * sides.len() * kinds.len()) {
            let cost = |i: usize, noise: f64| kind(noise, (i / columns) as f64, (i % columns) as f64);
            let costs: Vec<f64> = (0..rows * columns).map(|i| cost(i, rng.random_range(0.0..1.0))).collect();
            short.of_matrix(&costs, columns);
            let all = optimal(rows, columns, |r, c| costs[r * columns + c]);
            let (found, least) = (sum(&costs, columns, &short.column_of), sum(&costs, columns, &all));
            assert!((found - least).abs() < 1e-9 * (1.0 + least.abs()), "{found}, not {least}");
        }
    }

    #[test]
    fn greedy_takes_the_best_pair_and_pays_for_it_later() {
        let cost = [[-5.0, -4.0], [-4.0, FORBIDDEN]];
        assert_eq!(greedy(2, 2, |r, c| cost[r][c]), [Some(0), None]);
        assert_eq!(optimal(2, 2, |r, c| cost[r][c]), [Some(1), Some(0)]);
    }
}
