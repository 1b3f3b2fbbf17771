//! Assigns detections to tracks.
//!
//! The assignment is written by hand. Its algorithm allows rows without a partner and forbidden pairs, and looks at no others than
//! those that are allowed; crates for square matrices have none of this.

use crate::detect::Detection;

/// A pair that is not allowed.
pub const FORBIDDEN: f64 = f64::INFINITY;

/// Gives rows to columns so that the sum of the costs is the least; `cost(r, c)` may be [`FORBIDDEN`], and a row
/// that stays alone costs nothing, so only pairs below zero are made. Returns each row's column.
///
/// Row reduction, then shortest augmenting paths with potentials (Jonker and Volgenant 1987; Crouse 2016) over the pairs below zero. Which of equal
/// sums is taken depends on the order of rows and columns alone.
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
    /// Pairs below zero, row after row, and where each row's begin.
    pairs: Vec<Pair>,
    starts: Vec<usize>,
    row_price: Vec<f64>,
    column_price: Vec<f64>,
    /// Of the path that is looked for: from its row to every column, over which row, and whether that is settled.
    distance: Vec<f64>,
    came_from: Vec<usize>,
    done: Vec<bool>,
    /// Columns that are not infinitely far; those that are settled come first.
    reached: Vec<usize>,
}

/// A column that a row may have.
#[derive(Debug, Clone, Copy)]
struct Pair {
    column: usize,
    cost: f64,
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
        self.pairs.clear();
        self.starts.clear();
        for r in 0..rows {
            self.starts.push(self.pairs.len());
            let pairs = (0..columns).map(|column| Pair { column, cost: cost(r, column) });
            self.pairs.extend(pairs.filter(|pair| pair.cost < 0.0));
        }
        self.starts.push(self.pairs.len());
        refill(&mut self.column_of, rows, None);
        refill(&mut self.row_of, columns, None);
        refill(&mut self.row_price, rows, 0.0);
        refill(&mut self.column_price, columns, 0.0);
        refill(&mut self.distance, columns, f64::INFINITY);
        refill(&mut self.came_from, columns, 0);
        refill(&mut self.done, columns, false);
        self.outbid(rows);
        for r in 0..rows {
            if self.column_of[r].is_none() && self.starts[r] < self.starts[r + 1] {
                self.augment(r);
            }
        }
    }

    /// Augmenting row reduction: every row takes the column that it wants most, whose price falls until the row's second choice is as
    /// good. A row that had the column then looks for another. That settles most conflicts without a path.
    fn outbid(&mut self, rows: usize) {
        let Self { column_of, row_of, pairs, starts, row_price, column_price, .. } = self;
        // Prices may fall by ever less. What is left then is left to paths.
        let mut more = 4 * rows;
        for first in 0..rows {
            let mut row = first;
            loop {
                // To stay alone costs nothing and is free to all.
                let (mut best, mut second, mut wanted) = (0.0, 0.0, None);
                for &Pair { column, cost } in &pairs[starts[row]..starts[row + 1]] {
                    let asked = cost - column_price[column];
                    if asked < best {
                        (second, best, wanted) = (best, asked, Some(column));
                    } else if asked < second {
                        second = asked;
                    }
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
    fn augment(&mut self, start: usize) {
        let (end, length) = self.shortest(start);
        self.row_price[start] += length;
        for &c in self.reached.iter().take_while(|&&c| self.done[c]) {
            if let Some(owner) = self.row_of[c] {
                self.row_price[owner] += length - self.distance[c];
                self.column_price[c] -= length - self.distance[c];
            }
        }
        let mut column = match end {
            End::Free(column) => Some(column),
            End::Alone(row) => self.column_of[row].take(),
        };
        while let Some(c) = column {
            let row = self.came_from[c];
            self.row_of[c] = Some(row);
            column = self.column_of[row].replace(c);
        }
        for c in self.reached.drain(..) {
            (self.distance[c], self.done[c]) = (f64::INFINITY, false);
        }
    }

    /// Dijkstra from a row over reduced costs to the nearest column that is free, or row that may as well stay alone.
    fn shortest(&mut self, start: usize) -> (End, f64) {
        let Self {
            row_of, pairs, starts, row_price, column_price, distance, came_from, done, reached, ..
        } = self;
        let (mut row, mut so_far, mut settled) = (start, 0.0, 0);
        let (mut alone, mut alone_row) = (f64::INFINITY, start);
        loop {
            if so_far - row_price[row] < alone {
                (alone, alone_row) = (so_far - row_price[row], row);
            }
            let off = so_far - row_price[row];
            for &Pair { column, cost } in &pairs[starts[row]..starts[row + 1]] {
                let through = off + cost - column_price[column];
                if through < distance[column] && !done[column] {
                    if distance[column] == f64::INFINITY {
                        reached.push(column);
                    }
                    (distance[column], came_from[column]) = (through, row);
                }
            }
            let nearer = |a: usize, b: usize| {
                let (a, b) = ((distance[reached[a]], reached[a]), (distance[reached[b]], reached[b]));
                a.0 < b.0 || (a.0 == b.0 && a.1 < b.1)
            };
            let nearest = (settled..reached.len()).reduce(|a, b| if nearer(b, a) { b } else { a });
            let Some(nearest) = nearest.filter(|&nearest| distance[reached[nearest]] <= alone) else {
                return (End::Alone(alone_row), alone);
            };
            reached.swap(settled, nearest);
            let column = reached[settled];
            so_far = distance[column];
            match row_of[column] {
                Some(owner) => row = owner,
                None => return (End::Free(column), so_far),
            }
            done[column] = true;
            settled += 1;
        }
    }
}

fn refill<T: Clone>(memory: &mut Vec<T>, n: usize, value: T) {
    memory.clear();
    memory.resize(n, value);
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

    #[test]
    fn greedy_takes_the_best_pair_and_pays_for_it_later() {
        let cost = [[-5.0, -4.0], [-4.0, FORBIDDEN]];
        assert_eq!(greedy(2, 2, |r, c| cost[r][c]), [Some(0), None]);
        assert_eq!(optimal(2, 2, |r, c| cost[r][c]), [Some(1), Some(0)]);
    }
}
