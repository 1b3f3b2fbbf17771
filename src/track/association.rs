//! Assigns detections to tracks.
//!
//! The assignment is written by hand. Its algorithm allows rows without a partner and forbidden pairs; crates for
//! square matrices of integers have neither.

use crate::detect::Detection;

/// A pair that is not allowed.
pub const FORBIDDEN: f64 = f64::INFINITY;

/// Gives rows to columns so that the sum of the costs is the least; `cost(r, c)` may be [`FORBIDDEN`], and a row
/// that stays alone costs nothing, so only pairs below zero are made. Returns each row's column.
///
/// Shortest augmenting paths with potentials (Jonker and Volgenant 1987; Crouse 2016), one column of cost zero
/// for each row beside the real ones. Of equal sums the one with the earlier rows and columns is taken.
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
    costs: Vec<f64>,
    row_price: Vec<f64>,
    column_price: Vec<f64>,
    distance: Vec<f64>,
    came_from: Vec<usize>,
    done: Vec<bool>,
}

impl Assignment {
    /// [`optimal`], into `column_of`. Every cost is asked once.
    pub fn optimal(&mut self, rows: usize, columns: usize, cost: impl Fn(usize, usize) -> f64) {
        let width = columns + rows;
        let Self { column_of, row_of, costs, row_price, column_price, distance, came_from, done } = self;
        refill(costs, rows * columns, 0.0);
        for (r, costs) in costs.chunks_exact_mut(columns.max(1)).enumerate() {
            costs.iter_mut().enumerate().for_each(|(c, place)| *place = cost(r, c));
        }
        refill(row_price, rows, 0.0);
        refill(column_price, width, 0.0);
        refill(row_of, width, None);
        refill(column_of, rows, None);
        for start in 0..rows {
            // Dijkstra from `start` over reduced costs to the nearest free column.
            refill(distance, width, f64::INFINITY);
            refill(came_from, width, start);
            refill(done, width, false);
            let (mut row, mut so_far) = (start, 0.0);
            let free = loop {
                let mut nearest = None;
                let costs = &costs[row * columns..(row + 1) * columns];
                for c in (0..width).filter(|&c| !done[c]) {
                    let cost = costs.get(c).copied().unwrap_or(0.0);
                    let through = so_far + cost - row_price[row] - column_price[c];
                    if through < distance[c] {
                        (distance[c], came_from[c]) = (through, row);
                    }
                    if nearest.is_none_or(|n: usize| distance[c] < distance[n]) {
                        nearest = Some(c);
                    }
                }
                // A column of cost zero is always free for every row.
                let Some(column) = nearest else { return };
                (done[column], so_far) = (true, distance[column]);
                match row_of[column] {
                    Some(owner) => row = owner,
                    None => break column,
                }
            };
            row_price[start] += so_far;
            for c in (0..width).filter(|&c| done[c] && c != free) {
                if let Some(owner) = row_of[c] {
                    row_price[owner] += so_far - distance[c];
                    column_price[c] -= so_far - distance[c];
                }
            }
            let mut column = free;
            loop {
                let row = came_from[column];
                row_of[column] = Some(row);
                let before = column_of[row].replace(column);
                match before {
                    Some(before) => column = before,
                    None => break,
                }
            }
        }
        column_of.iter_mut().for_each(|column| *column = column.filter(|&c| c < columns));
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
