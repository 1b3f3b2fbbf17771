//! Euclidean clusters in plan view: exact, over the cells of a grid.
//!
//! Never in three dimensions: at 15 m the rings of a 32-beam sensor are 0.36 m apart, so a person would fall into
//! pieces. (hdl_people_tracking divides z by 100 for the same reason.)

use crate::geometry::DVec2;

/// Finds connected components; keeps its memory from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct PlanGrid {
    /// Row, column and point, sorted.
    keys: Vec<(i32, i32, u32)>,
    /// First key of each cell, and one past the last.
    starts: Vec<u32>,
    /// Union-find over the cells.
    parents: Vec<u32>,
    /// By rows above: where the neighbours of the last cell began.
    begins: Vec<u32>,
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
        self.keys.clear();
        self.keys.extend(points_m.iter().zip(0..).map(|(p, i)| {
            let cell = (*p / cell_m).floor();
            (cell.y as i32, cell.x as i32, i)
        }));
        self.keys.sort_unstable();
        self.starts.clear();
        for (k, key) in self.keys.iter().enumerate() {
            if k == 0 || (key.0, key.1) != (self.keys[k - 1].0, self.keys[k - 1].1) {
                self.starts.push(k as u32);
            }
        }
        let cells = self.starts.len();
        self.starts.push(self.keys.len() as u32);
        self.parents.clear();
        self.parents.extend(0..cells as u32);
        self.begins.clear();
        self.begins.resize(reach as usize + 1, 0);
        for a in 0..cells {
            self.join_neighbours(a, reach, points_m, radius_m);
        }
        self.label(points_m.len(), labels)
    }

    /// Joins a cell with those after it in its own row and in the `reach` rows above.
    fn join_neighbours(&mut self, a: usize, reach: i32, points_m: &[DVec2], radius_m: &[f64]) {
        let cells = self.starts.len() - 1;
        let (row, column, _) = self.keys[self.starts[a] as usize];
        for dy in 0..=reach {
            let from = (row.saturating_add(dy), if dy == 0 { column } else { column.saturating_sub(reach) });
            let place = |b: usize| {
                let key = self.keys[self.starts[b] as usize];
                (key.0, key.1)
            };
            let mut b = if dy == 0 { a + 1 } else { self.begins[dy as usize] as usize };
            // Cells come in order, so their neighbours do, but where numbers of rows end.
            if dy > 0 && b > 0 && place(b - 1) >= from {
                b = 0;
            }
            while b < cells && place(b) < from {
                b += 1;
            }
            self.begins[dy as usize] = b as u32;
            while b < cells && place(b) <= (from.0, column.saturating_add(reach)) {
                let (root_a, root_b) = (find(&mut self.parents, a as u32), find(&mut self.parents, b as u32));
                if root_a != root_b && self.touch(a, b, points_m, radius_m) {
                    // The smaller root stays, so the result does not depend on the order of joining.
                    self.parents[root_a.max(root_b) as usize] = root_a.min(root_b);
                }
                b += 1;
            }
        }
    }

    fn touch(&self, a: usize, b: usize, points_m: &[DVec2], radius_m: &[f64]) -> bool {
        let of = |cell: usize| &self.keys[self.starts[cell] as usize..self.starts[cell + 1] as usize];
        of(a).iter().any(|&(_, _, i)| {
            let (p, r) = (points_m[i as usize], radius_m[i as usize]);
            of(b).iter().any(|&(_, _, j)| {
                let r = r.max(radius_m[j as usize]);
                p.distance_squared(points_m[j as usize]) <= r * r
            })
        })
    }

    fn label(&mut self, points: usize, labels: &mut Vec<u32>) -> usize {
        const NONE: u32 = u32::MAX;
        labels.clear();
        labels.resize(points, NONE);
        for cell in 0..self.starts.len() - 1 {
            let root = find(&mut self.parents, cell as u32);
            for &(_, _, i) in &self.keys[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
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
