//! Steers along a path around things: towards its farthest visible point.

use glam::Vec2;

use super::floor::Floor;

/// Steps of 10 ms from one look ahead to the next.
const LOOK_EVERY: usize = 20;
/// Who is as near to a point of the way goes on to the next.
const PASSED_M: f32 = 0.3;
/// Somebody pushed aside sees along things with less room than the way was made with.
const LESS: f32 = 0.75;
/// The last metres to a place to stand are walked slower: in so long at least.
const SLOW_S: f32 = 0.5;

/// Where somebody walks to, and how.
#[derive(Debug, Clone, Default)]
pub(super) struct Steering {
    goal: Vec2,
    way: Vec<Vec2>,
    at: usize,
}

impl Steering {
    /// From here to `goal` with room for a body; straight on where no way leads there.
    pub(super) fn new(floor: &Floor, from: Vec2, goal: Vec2, radius_m: f32) -> Self {
        let way = floor.way(from, goal, radius_m).unwrap_or_else(|| vec![goal]);
        Self { goal, way, at: 0 }
    }

    /// The velocity that leads on; slower where the goal is as near as `slow` says.
    pub(super) fn preferred_mps(
        &mut self,
        floor: &Floor,
        position_m: Vec2,
        radius_m: f32,
        speed_mps: f32,
        steps: usize,
    ) -> Vec2 {
        let Some(&next) = self.way.get(self.at) else { return Vec2::ZERO };
        if steps.is_multiple_of(LOOK_EVERY) {
            let in_sight = (self.at..self.way.len()).rev();
            let in_sight = in_sight.map(|k| (k, self.way[k]));
            match in_sight.into_iter().find(|(_, to)| floor.sees(position_m, *to, radius_m * LESS)) {
                Some((k, _)) => self.at = k,
                None => *self = Self::new(floor, position_m, self.goal, radius_m),
            }
        } else if next.distance(position_m) < PASSED_M && self.at + 1 < self.way.len() {
            self.at += 1;
        }
        let to_next = self.way[self.at] - position_m;
        let is_last = self.at + 1 == self.way.len();
        let speed_mps = if is_last { speed_mps.min(to_next.length() / SLOW_S) } else { speed_mps };
        to_next.normalize_or_zero() * speed_mps
    }

    /// Where the way first leads.
    pub(super) fn first(&self) -> Vec2 {
        self.way.first().copied().unwrap_or(self.goal)
    }

    /// So far along the way from `from`, as a share of it.
    pub(super) fn part_way(&self, from: Vec2, share: f32) -> Vec2 {
        let mut all = vec![from];
        all.extend(&self.way);
        let length_m: f32 = all.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        let mut left_m = share * length_m;
        for pair in all.windows(2) {
            let piece_m = pair[0].distance(pair[1]);
            if left_m <= piece_m {
                return pair[0].lerp(pair[1], left_m / piece_m.max(f32::MIN_POSITIVE));
            }
            left_m -= piece_m;
        }
        self.goal
    }
}
