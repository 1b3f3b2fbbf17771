//! Euclidean clusters in plan view: exact, over the cells of a grid.
//!
//! Never in three dimensions: at 15 m the rings of a 32-beam sensor are 0.36 m apart, so a person would fall into
//! pieces. (hdl_people_tracking divides z by 100 for the same reason.)

use crate::geometry::DVec2;

/// Finds connected components; keeps its memory from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct PlanGrid {
    /// Cell and point, sorted.
    keys: Vec<(u64, u32)>,
    /// Place and radius of each point, in that order.
    discs: Vec<(DVec2, f64)>,
    /// Ascending, and one past the last.
    cells: Vec<Cell>,
    /// Union-find over the cells.
    parents: Vec<u32>,
    /// By rows above: where the neighbours of the last cell began.
    begins: Vec<u32>,
}

/// A cell that holds points.
#[derive(Debug, Clone, Copy)]
struct Cell {
    key: u64,
    /// Its first point, of all in the order of cells.
    start: u32,
}

/// In the order of rows, then of columns.
fn key_of(row: i32, column: i32) -> u64 {
    let unsigned = |number: i32| u64::from(number as u32 ^ 1 << 31);
    unsigned(row) << 32 | unsigned(column)
}

fn row_and_column(key: u64) -> (i32, i32) {
    let signed = |bits: u64| (bits as u32 ^ 1 << 31) as i32;
    (signed(key >> 32), signed(key))
}

impl PlanGrid {
    /// Gives each point the label of its component: points `i`, `j` are joined when they lie within the larger of
    /// `radius_m[i]` and `radius_m[j]`. No radius may be smaller than `radius_min_m`. Labels are 0, 1, ... in order
    /// of the components' first points; their number is returned.
    pub fn components(
        &mut self,
        points_m: &[DVec2],
        radius_m: &[f64],
        radius_min_m: f64,
        labels: &mut Vec<u32>,
    ) -> usize {
        // Two points of one cell are never farther apart than the smallest radius.
        let cell_m = radius_min_m * std::f64::consts::FRAC_1_SQRT_2;
        let radius_max_m = radius_m.iter().copied().fold(radius_min_m, f64::max);
        let reach = (radius_max_m / cell_m).ceil() as i32;
        let Self { keys, discs, cells, parents, begins } = self;
        keys.clear();
        keys.extend(points_m.iter().zip(0..).map(|(p, i)| {
            let cell = (*p / cell_m).floor();
            (key_of(cell.y as i32, cell.x as i32), i)
        }));
        keys.sort_unstable();
        discs.clear();
        discs.extend(keys.iter().map(|&(_, i)| (points_m[i as usize], radius_m[i as usize])));
        cells.clear();
        for (&(key, _), start) in keys.iter().zip(0..) {
            if cells.last().is_none_or(|last: &Cell| last.key != key) {
                cells.push(Cell { key, start });
            }
        }
        let count = cells.len();
        cells.push(Cell { key: u64::MAX, start: keys.len() as u32 });
        parents.clear();
        parents.extend(0..count as u32);
        begins.clear();
        begins.resize(reach as usize + 1, 0);
        for a in 0..count {
            self.join_neighbours(a, reach);
        }
        self.label(points_m.len(), labels)
    }

    /// Joins a cell with those after it in its own row and in the `reach` rows above.
    fn join_neighbours(&mut self, a: usize, reach: i32) {
        let Self { discs, cells, parents, begins, .. } = self;
        let (cells, last) = (&**cells, cells.len() - 1);
        let (row, column) = row_and_column(cells[a].key);
        for dy in 0..=reach {
            let row = row.saturating_add(dy);
            let first = key_of(row, if dy == 0 { column } else { column.saturating_sub(reach) });
            let end = key_of(row, column.saturating_add(reach));
            let mut b = if dy == 0 { a + 1 } else { begins[dy as usize] as usize };
            // Cells come in order, so their neighbours do, but where numbers of rows end.
            if dy > 0 && b > 0 && cells[b - 1].key >= first {
                b = 0;
            }
            while b < last && cells[b].key < first {
                b += 1;
            }
            begins[dy as usize] = b as u32;
            while b < last && cells[b].key <= end {
                let (root_a, root_b) = (find(parents, a as u32), find(parents, b as u32));
                let of = |cell: usize| &discs[cells[cell].start as usize..cells[cell + 1].start as usize];
                if root_a != root_b && touch(of(a), of(b)) {
                    // The smaller root stays, so the result does not depend on the order of joining.
                    parents[root_a.max(root_b) as usize] = root_a.min(root_b);
                }
                b += 1;
            }
        }
    }

    fn label(&mut self, points: usize, labels: &mut Vec<u32>) -> usize {
        const NONE: u32 = u32::MAX;
        labels.clear();
        labels.resize(points, NONE);
        for (of, cell) in self.cells.windows(2).zip(0..) {
            let root = find(&mut self.parents, cell);
            for &(_, i) in &self.keys[of[0].start as usize..of[1].start as usize] {
                labels[i as usize] = root;
            }
        }
        // Roots are renamed in order of appearance; `parents` has done its work and holds the new names.
        self.parents.fill(NONE);
        let mut next = 0;
        for label in labels.iter_mut() {
            let name = &mut self.parents[*label as usize];
            if *name == NONE {
                *name = next;
                next += 1;
            }
            *label = *name;
        }
        next as usize
    }
}

/// Whether any two points of two cells are joined.
fn touch(a: &[(DVec2, f64)], b: &[(DVec2, f64)]) -> bool {
    a.iter().any(|&(p, r)| {
        b.iter().any(|&(q, other_r)| {
            let r = r.max(other_r);
            p.distance_squared(q) <= r * r
        })
    })
}

fn find(parents: &mut [u32], mut cell: u32) -> u32 {
    while parents[cell as usize] != cell {
        parents[cell as usize] = parents[parents[cell as usize] as usize];
        cell = parents[cell as usize];
    }
    cell
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Every pair compared.
    fn brute_force(points_m: &[DVec2], radius_m: &[f64]) -> Vec<u32> {
        let mut labels: Vec<u32> = (0..points_m.len() as u32).collect();
        for _ in 0..points_m.len() {
            for i in 0..points_m.len() {
                for j in 0..points_m.len() {
                    if points_m[i].distance(points_m[j]) <= radius_m[i].max(radius_m[j]) {
                        labels[i] = labels[i].min(labels[j]);
                    }
                }
            }
        }
        let mut seen = Vec::new();
        for label in &mut labels {
            let name = seen.iter().position(|l| l == label).unwrap_or_else(|| {
                seen.push(*label);
                seen.len() - 1
            });
            *label = name as u32;
        }
        labels
    }

    #[test]
    fn components_equal_brute_force() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        for n in [0, 1, 2, 20, 150] {
            let mut coordinate = || rng.random_range(-1.5..1.5);
            let points_m: Vec<DVec2> = (0..n).map(|_| DVec2::new(coordinate(), coordinate())).collect();
            let radius_m: Vec<f64> = (0..n).map(|i| 0.1 + 0.001 * f64::from(i)).collect();
            let mut labels = Vec::new();
            let found = PlanGrid::default().components(&points_m, &radius_m, 0.1, &mut labels);
            assert_eq!(labels, brute_force(&points_m, &radius_m));
            assert_eq!(found, labels.iter().max().map_or(0, |&l| l as usize + 1));
        }
    }
}
