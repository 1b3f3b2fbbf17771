//! Neighbours of agents: a uniform grid, rebuilt every step.

use glam::Vec2;

use super::agent::Agent;

/// Agents in a cell, if they stood evenly.
const AGENTS_PER_CELL: f32 = 3.0;

/// Agents sorted by cell.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    origin_m: Vec2,
    cell_m: f32,
    columns: usize,
    rows: usize,
    /// First entry of each cell in `members`, and one more for the end.
    starts: Vec<usize>,
    members: Vec<usize>,
}

impl Grid {
    pub fn rebuild(&mut self, agents: &[Agent]) {
        let Some(first) = agents.first() else { return };
        let (low, high) = agents.iter().fold((first.position_m, first.position_m), |(l, h), a| {
            (l.min(a.position_m), h.max(a.position_m))
        });
        let extent = high - low;
        self.origin_m = low;
        // At least 0.1 m, also for agents in a row or in one place.
        self.cell_m = (extent.x * extent.y * AGENTS_PER_CELL / agents.len() as f32)
            .sqrt()
            .max(extent.max_element() / agents.len() as f32)
            .max(0.1);
        self.columns = (extent.x / self.cell_m) as usize + 1;
        self.rows = (extent.y / self.cell_m) as usize + 1;

        self.starts.clear();
        self.starts.resize(self.columns * self.rows + 1, 0);
        for agent in agents {
            let cell = self.cell_of(agent.position_m);
            self.starts[cell.1 * self.columns + cell.0 + 1] += 1;
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        self.members.resize(agents.len(), 0);
        // Filled from the back, so that `starts` ends up at each cell's first entry.
        for (i, agent) in agents.iter().enumerate().rev() {
            let (column, row) = self.cell_of(agent.position_m);
            let end = &mut self.starts[row * self.columns + column + 1];
            *end -= 1;
            self.members[*end] = i;
        }
        self.starts.remove(0);
        self.starts.push(agents.len());
    }

    /// The nearest agents that agent `i` sees, nearest first, as (squared distance, index). Equally near ones
    /// stand in the order of their index.
    pub fn nearest(&self, agents: &[Agent], i: usize, nearest: &mut Vec<(f32, usize)>) {
        nearest.clear();
        let agent = &agents[i];
        let most = agent.parameters.max_neighbors;
        let mut range_sq = agent.parameters.neighbor_distance_m * agent.parameters.neighbor_distance_m;
        if most == 0 {
            return;
        }
        let (column, row) = self.cell_of(agent.position_m);
        for ring in 0..self.columns.max(self.rows) {
            // Whoever is in this ring is farther than the cells of the rings within; a little less, for rounding.
            let clear = (ring as f32 - 1.0).max(0.0) * self.cell_m * 0.999;
            if clear * clear >= range_sq {
                break;
            }
            self.for_ring(column, row, ring, |other| {
                let distance_sq = (agent.position_m - agents[other].position_m).length_squared();
                if other == i || distance_sq > range_sq {
                    return;
                }
                let place = nearest.partition_point(|&entry| entry < (distance_sq, other));
                nearest.insert(place, (distance_sq, other));
                nearest.truncate(most);
                if nearest.len() == most {
                    range_sq = nearest[most - 1].0;
                }
            });
        }
        // RVO2 counts who is nearer than the neighbour distance, not who is exactly at it.
        let limit_sq = agent.parameters.neighbor_distance_m * agent.parameters.neighbor_distance_m;
        nearest.retain(|&(distance_sq, _)| distance_sq < limit_sq);
    }

    fn cell_of(&self, position_m: Vec2) -> (usize, usize) {
        let cell = (position_m - self.origin_m) / self.cell_m;
        ((cell.x as usize).min(self.columns - 1), (cell.y as usize).min(self.rows - 1))
    }

    /// Every agent in the cells at `ring` steps (rows or columns) from a cell.
    fn for_ring(&self, column: usize, row: usize, ring: usize, mut visit: impl FnMut(usize)) {
        let rows = row.saturating_sub(ring)..=(row + ring).min(self.rows - 1);
        for r in rows {
            let inner = r.abs_diff(row) < ring;
            let columns = column.saturating_sub(ring)..=(column + ring).min(self.columns - 1);
            for c in columns {
                if inner && c.abs_diff(column) < ring {
                    continue;
                }
                let cell = r * self.columns + c;
                self.members[self.starts[cell]..self.starts[cell + 1]].iter().for_each(|&i| visit(i));
            }
        }
    }
}
