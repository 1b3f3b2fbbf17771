//! Neighbours of agents: a uniform grid, rebuilt every step.
//!
//! Who was nearest a step ago is still about as near. The circle in which an agent finds its neighbours is therefore known
//! before the first look, and hardly anybody else is looked at.

use glam::Vec2;

use super::agent::Agent;

/// Agents in a cell, if they stood evenly.
const AGENTS_PER_CELL: f32 = 3.0;
/// Agents that are looked at together.
const LANES: usize = 8;
/// A circle is made wider by as much as rounding could matter.
const WIDER: f32 = 1.001;

/// Agents sorted by cell.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    origin_m: Vec2,
    cell_m: f32,
    columns: usize,
    rows: usize,
    /// First entry of each cell in `members`, and one more for the end.
    starts: Vec<usize>,
    /// Indices of agents, cell after cell and row after row, and where they are. The last few are nobody's, to fill lanes.
    members: Vec<u32>,
    x_m: Vec<f32>,
    y_m: Vec<f32>,
    /// Where each agent was at the last step, and what it saw.
    last_m: Vec<Vec2>,
    seen: Vec<Seen>,
    /// The longest way of anybody since then.
    moved_m: f32,
    found: Vec<u64>,
}

/// How many neighbours an agent had, and how far the farthest of them was.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    neighbors: usize,
    reach_m: f32,
}

impl Grid {
    pub fn rebuild(&mut self, agents: &[Agent]) {
        self.follow(agents);
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
        self.members.resize(agents.len() + LANES, 0);
        self.x_m.resize(agents.len() + LANES, 0.0);
        self.y_m.resize(agents.len() + LANES, 0.0);
        // Filled from the back, so that `starts` ends up at each cell's first entry.
        for (i, agent) in agents.iter().enumerate().rev() {
            let (column, row) = self.cell_of(agent.position_m);
            let end = &mut self.starts[row * self.columns + column + 1];
            *end -= 1;
            self.members[*end] = i as u32;
            (self.x_m[*end], self.y_m[*end]) = (agent.position_m.x, agent.position_m.y);
        }
        self.starts.remove(0);
        self.starts.push(agents.len());
    }

    /// Notes how far people have moved. What each has seen still bounds how far its neighbours are, as long as there is somebody
    /// at every index: where another agent took it over, the way to that one's place counts as moved.
    fn follow(&mut self, agents: &[Agent]) {
        if agents.len() < self.last_m.len() {
            self.seen.clear();
        }
        self.seen.resize(agents.len(), Seen::default());
        let moved_sq = |(agent, last_m): (&Agent, &Vec2)| agent.position_m.distance_squared(*last_m);
        self.moved_m = agents.iter().zip(&self.last_m).map(moved_sq).fold(0.0, f32::max).sqrt();
        self.last_m.clear();
        self.last_m.extend(agents.iter().map(|agent| agent.position_m));
    }

    /// The nearest agents that agent `i` sees, nearest first. Equally near ones stand in the order of their index. Everybody asks
    /// once after each [`rebuild`](Self::rebuild).
    pub fn nearest(&mut self, agents: &[Agent], i: usize, nearest: &mut Vec<usize>) {
        nearest.clear();
        let agent = &agents[i];
        let most = agent.parameters.max_neighbors;
        if most == 0 {
            return;
        }
        // Each neighbour of the last step is as far as it was, and the ways of both more at most: this circle holds enough.
        let sight_m = agent.parameters.neighbor_distance_m;
        let Seen { neighbors, reach_m } = self.seen[i];
        let known_m = (reach_m + 2.0 * self.moved_m) * WIDER;
        let radius_m = if neighbors >= most && known_m < sight_m { known_m } else { sight_m };
        self.find_within(agent.position_m, radius_m);
        self.found.sort_unstable();

        // RVO2 counts who is nearer than the neighbour distance, not who is exactly at it.
        let found =
            self.found.iter().map(|&found| (f32::from_bits((found >> 32) as u32), found as u32 as usize));
        let found = found.filter(|&(distance_sq, other)| other != i && distance_sq < sight_m * sight_m);
        let mut farthest_sq = 0.0;
        for (distance_sq, other) in found.take(most) {
            nearest.push(other);
            farthest_sq = distance_sq;
        }
        self.seen[i] = Seen { neighbors: nearest.len(), reach_m: farthest_sq.sqrt() };
    }

    /// Everybody in a circle: the bits of the squared distance, which are in its order, and then the index.
    fn find_within(&mut self, middle_m: Vec2, radius_m: f32) {
        self.found.clear();
        let within_sq = radius_m * radius_m;
        let (first, last) = (middle_m - radius_m * WIDER, middle_m + radius_m * WIDER);
        let ((first_column, first_row), (last_column, last_row)) = (self.cell_of(first), self.cell_of(last));
        for row in first_row..=last_row {
            let cells = row * self.columns;
            let (from, to) = (self.starts[cells + first_column], self.starts[cells + last_column + 1]);
            for at in (from..to).step_by(LANES) {
                let (x_m, y_m) = (&self.x_m[at..at + LANES], &self.y_m[at..at + LANES]);
                let mut distance_sq = [0.0; LANES];
                let mut near = [0; LANES];
                for k in 0..LANES {
                    let (x, y) = (middle_m.x - x_m[k], middle_m.y - y_m[k]);
                    distance_sq[k] = x * x + y * y;
                    near[k] = if distance_sq[k] <= within_sq { 1_u32 << k } else { 0 };
                }
                let mut near = near.iter().fold(0, |all, bit| all | bit);
                if to - at < LANES {
                    near &= (1 << (to - at)) - 1;
                }
                while near != 0 {
                    let k = near.trailing_zeros() as usize;
                    self.found
                        .push(u64::from(distance_sq[k].to_bits()) << 32 | u64::from(self.members[at + k]));
                    near &= near - 1;
                }
            }
        }
    }

    fn cell_of(&self, position_m: Vec2) -> (usize, usize) {
        let cell = (position_m - self.origin_m) / self.cell_m;
        ((cell.x as usize).min(self.columns - 1), (cell.y as usize).min(self.rows - 1))
    }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::super::agent::Parameters;
    use super::*;
    use crate::random::stream;

    /// The same by a look at everybody.
    fn by_all(agents: &[Agent], i: usize) -> Vec<usize> {
        let Parameters { neighbor_distance_m, max_neighbors, .. } = agents[i].parameters;
        let distance_sq = |other: usize| (agents[i].position_m - agents[other].position_m).length_squared();
        let mut others: Vec<(f32, usize)> =
            (0..agents.len()).filter(|&other| other != i).map(|other| (distance_sq(other), other)).collect();
        others.retain(|&(distance_sq, _)| distance_sq < neighbor_distance_m * neighbor_distance_m);
        others.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        others.iter().take(max_neighbors).map(|&(_, other)| other).collect()
    }

    #[test]
    fn the_nearest_are_found_whoever_has_moved_come_gone_or_sees_more() {
        let mut rng = stream(1, "grid", 0);
        let parameters = Parameters {
            neighbor_distance_m: 6.0,
            max_neighbors: 5,
            horizon_s: 5.0,
            obstacle_horizon_s: 5.0,
            radius_m: 0.3,
            max_speed_mps: 1.0,
            max_acceleration_mps2: f32::INFINITY,
        };
        // Whole steps of a quarter: many are equally near, some exactly as far as one sees, some in one place.
        let mut place = || 0.25 * Vec2::new(rng.random_range(0..80) as f32, rng.random_range(0..40) as f32);
        let mut agents: Vec<Agent> = (0..150).map(|_| Agent::new(parameters, place())).collect();
        let (mut grid, mut nearest) = (Grid::default(), Vec::new());
        for step in 0..60 {
            match step % 12 {
                1..6 => agents.iter_mut().for_each(|agent| agent.position_m.x += 0.25),
                6 => agents[step].position_m = place(),
                7 => drop(agents.drain(20..23)),
                8 => agents.extend((0..4).map(|_| Agent::new(parameters, place()))),
                9 => {
                    (agents[3].position_m, agents[4].position_m) =
                        (agents[4].position_m, agents[3].position_m)
                }
                10 => agents[step].parameters.max_neighbors = step % 40,
                11 => agents[step].parameters.neighbor_distance_m = 0.25 * step as f32,
                _ => agents.truncate(160 - step),
            }
            grid.rebuild(&agents);
            for i in 0..agents.len() {
                grid.nearest(&agents, i, &mut nearest);
                assert_eq!(nearest, by_all(&agents, i), "agent {i} at step {step}");
            }
        }
    }
}
