//! The floor of a hall that people can walk on, and paths around the things on it.
//!
//! Each cell of a grid has the distance to the nearest wall, pillar or piece of furniture. Paths are the shortest
//! over the cells with room for a body, pulled straight. Coordinates are relative to the hall's middle, so single
//! precision suffices wherever the hall lies.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{IVec2, Vec2};
use umbracast::geometry::DVec2;
use umbracast::site::{Furniture, Pillar};
use umbracast::{Error, Site};

/// Edge of a cell, unless there were more than so many.
const CELL_M: f64 = 0.2;
const MOST_CELLS: f64 = 400_000.0;
/// From one test of a straight way to the next.
const LOOK_M: f32 = 0.1;
/// Sides of a pillar among the edges that agents avoid.
const PILLAR_SIDES: usize = 12;

/// Free floor and what stands on it.
#[derive(Debug, Clone)]
pub struct Floor {
    /// The hall's middle in the site: where coordinates begin.
    pub(super) zero_m: DVec2,
    cell_m: f32,
    least_m: Vec2,
    size: IVec2,
    /// Of each cell's middle from the nearest thing, metres; negative where no floor is.
    clear_m: Vec<f32>,
    /// What agents avoid: things counter-clockwise, walls clockwise.
    pub(super) polygons: Vec<Vec<Vec2>>,
    /// Where people come in and leave, and where they stop, as the site says.
    pub(super) entrances_m: Vec<Vec2>,
    pub(super) places_m: Vec<Vec2>,
}

impl Floor {
    /// Of a site.
    ///
    /// # Errors
    /// An entrance or a place to stop that leaves no room for a body of `radius_m`, or to which no way leads.
    pub fn of(site: &Site, radius_m: f32) -> Result<Self, Error> {
        let [least_m, most_m] = site.hall.bounds_m();
        let (zero_m, size_m) = (site.hall.middle_m(), most_m - least_m);
        let cell_m = CELL_M.max((size_m.x * size_m.y / MOST_CELLS).sqrt());
        let size = (size_m / cell_m).ceil().as_ivec2().max(IVec2::ONE);
        let middle_m =
            |column: i32, row: i32| least_m + (DVec2::new(f64::from(column), f64::from(row)) + 0.5) * cell_m;
        let cells = (0..size.y).flat_map(|row| (0..size.x).map(move |column| (column, row)));
        let clear_m = cells.map(|(column, row)| clearance_m(site, middle_m(column, row)) as f32).collect();
        let local = |at: &[f64; 2]| (DVec2::from_array(*at) - zero_m).as_vec2();
        let mut walls: Vec<Vec2> = site.hall.corners().iter().map(|at| (*at - zero_m).as_vec2()).collect();
        walls.reverse();
        let things = site.pillars.iter().map(|pillar| sides_of_pillar(pillar, zero_m));
        let things = things.chain(site.furniture.iter().map(|piece| sides_of_piece(piece, zero_m)));
        let floor = Self {
            zero_m,
            cell_m: cell_m as f32,
            least_m: (least_m - zero_m).as_vec2(),
            size,
            clear_m,
            polygons: std::iter::once(walls).chain(things).collect(),
            entrances_m: site.simulation.entrances_m.iter().map(local).collect(),
            places_m: site.simulation.places_m.iter().map(local).collect(),
        };
        floor.check(radius_m, site)?;
        Ok(floor)
    }

    fn check(&self, radius_m: f32, site: &Site) -> Result<(), Error> {
        let refuse = |key: &str, told: String| Err(Error::new(told).within(format!("site.simulation.{key}")));
        let Some(first) = self.somewhere(radius_m) else {
            let story = format!("expected free floor for a body of {radius_m} m radius, found none");
            return Err(Error::new(story).within("site.hall"));
        };
        let lists = [
            ("entrances_m", &self.entrances_m, &site.simulation.entrances_m),
            ("places_m", &self.places_m, &site.simulation.places_m),
        ];
        for (key, local_m, site_m) in lists {
            for (at, found) in local_m.iter().zip(site_m) {
                if self.clear_at(*at) < radius_m {
                    let told =
                        format!("expected {radius_m} m of free floor round each, found less at {found:?}");
                    return refuse(key, told);
                }
                if self.way(first, *at, radius_m).is_none() {
                    return refuse(key, format!("expected one floor, found no way to {found:?}"));
                }
            }
        }
        Ok(())
    }

    /// A place of the largest part of the floor that has room for a body; its cells first to last decide.
    fn somewhere(&self, radius_m: f32) -> Option<Vec2> {
        let parts = self.parts(radius_m);
        let mut sizes = vec![0_usize; parts.iter().flatten().max().map_or(0, |last| last + 1)];
        parts.iter().flatten().for_each(|&part| sizes[part] += 1);
        let largest = (0..sizes.len()).max_by_key(|&part| (sizes[part], Reverse(part)))?;
        let cell = parts.iter().position(|part| *part == Some(largest))?;
        Some(self.middle_of(cell))
    }

    /// Middles of the cells of the largest part of the floor with room for a body.
    pub(super) fn places(&self, radius_m: f32) -> Vec<Vec2> {
        let Some(start) = self.somewhere(radius_m) else { return Vec::new() };
        let parts = self.parts(radius_m);
        let own = parts[self.cell_of(start).unwrap_or_default()];
        (0..parts.len()).filter(|&cell| parts[cell] == own).map(|cell| self.middle_of(cell)).collect()
    }

    /// Square metres with room for a body.
    pub(super) fn free_m2(&self, radius_m: f32) -> f32 {
        self.clear_m.iter().filter(|clear_m| **clear_m >= radius_m).count() as f32 * self.cell_m * self.cell_m
    }

    /// By cell with room for a body: which part of the floor it belongs to.
    fn parts(&self, radius_m: f32) -> Vec<Option<usize>> {
        let mut parts = vec![None; self.clear_m.len()];
        let (mut count, mut open) = (0, Vec::new());
        for start in 0..parts.len() {
            if parts[start].is_some() || self.clear_m[start] < radius_m {
                continue;
            }
            parts[start] = Some(count);
            open.push(start);
            while let Some(cell) = open.pop() {
                for (next, _) in self.neighbours(cell) {
                    if parts[next].is_none() && self.clear_m[next] >= radius_m {
                        parts[next] = Some(count);
                        open.push(next);
                    }
                }
            }
            count += 1;
        }
        parts
    }

    /// From place to place in straight pieces, without the first and with the last; `None` where none leads there.
    pub(super) fn way(&self, from: Vec2, to: Vec2, radius_m: f32) -> Option<Vec<Vec2>> {
        if self.sees(from, to, radius_m) {
            return Some(vec![to]);
        }
        let (start, end) = (self.nearest_free(from, radius_m)?, self.nearest_free(to, radius_m)?);
        let mut best = vec![f32::INFINITY; self.clear_m.len()];
        let mut before = vec![usize::MAX; self.clear_m.len()];
        best[end] = 0.0;
        // Distances in micrometres: whole numbers have an order. From the end, so that following leads there.
        let mut open = BinaryHeap::from([(Reverse(0_u64), end)]);
        while let Some((_, cell)) = open.pop() {
            if cell == start {
                break;
            }
            for (next, cells) in self.neighbours(cell) {
                let far_m = best[cell] + cells * self.cell_m;
                if self.clear_m[next] >= radius_m && far_m < best[next] {
                    (best[next], before[next]) = (far_m, cell);
                    let guess_m = far_m + self.middle_of(next).distance(from);
                    open.push((Reverse((f64::from(guess_m) * 1e6) as u64), next));
                }
            }
        }
        if best[start].is_infinite() {
            return None;
        }
        let mut places = vec![from];
        let mut cell = start;
        while cell != end {
            places.push(self.middle_of(cell));
            cell = before[cell];
        }
        places.push(to);
        // Pulled straight: each piece goes as far as can be seen.
        let (mut way, mut at) = (Vec::new(), 0);
        while at + 1 < places.len() {
            let seen = (at + 2..places.len()).take_while(|&k| self.sees(places[at], places[k], radius_m));
            at = seen.last().unwrap_or(at + 1);
            way.push(places[at]);
        }
        Some(way)
    }

    /// Whether a body can go straight from place to place.
    pub(super) fn sees(&self, from: Vec2, to: Vec2, radius_m: f32) -> bool {
        let looks = (from.distance(to) / LOOK_M).ceil().max(1.0);
        (1..=looks as u32).all(|k| self.clear_at(from.lerp(to, k as f32 / looks)) >= radius_m)
    }

    /// How far the nearest thing is; negative where no floor is.
    pub(super) fn clear_at(&self, at: Vec2) -> f32 {
        self.cell_of(at).map_or(-1.0, |cell| self.clear_m[cell])
    }

    fn nearest_free(&self, at: Vec2, radius_m: f32) -> Option<usize> {
        let free = (0..self.clear_m.len()).filter(|&cell| self.clear_m[cell] >= radius_m);
        let far = |cell: usize| self.middle_of(cell).distance_squared(at);
        match self.cell_of(at).filter(|&cell| self.clear_m[cell] >= radius_m) {
            Some(cell) => Some(cell),
            None => free.min_by(|a, b| far(*a).total_cmp(&far(*b))),
        }
    }

    fn cell_of(&self, at: Vec2) -> Option<usize> {
        let cell = ((at - self.least_m) / self.cell_m).floor().as_ivec2();
        let within = cell.cmpge(IVec2::ZERO).all() && cell.cmplt(self.size).all();
        within.then(|| (cell.y * self.size.x + cell.x) as usize)
    }

    fn middle_of(&self, cell: usize) -> Vec2 {
        let (row, column) = (cell as i32 / self.size.x, cell as i32 % self.size.x);
        self.least_m + (IVec2::new(column, row).as_vec2() + 0.5) * self.cell_m
    }

    /// The cells around, with how many cells far they are.
    fn neighbours(&self, cell: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
        const AROUND: [(i32, i32); 8] =
            [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
        let at = IVec2::new(cell as i32 % self.size.x, cell as i32 / self.size.x);
        AROUND.into_iter().filter_map(move |(x, y)| {
            let next = at + IVec2::new(x, y);
            let within = next.cmpge(IVec2::ZERO).all() && next.cmplt(self.size).all();
            let far = if x != 0 && y != 0 { std::f32::consts::SQRT_2 } else { 1.0 };
            within.then(|| ((next.y * self.size.x + next.x) as usize, far))
        })
    }
}

/// How far the nearest wall, pillar or piece of furniture is from a place; negative within one and outside the hall.
pub fn clearance_m(site: &Site, at_m: DVec2) -> f64 {
    let pillar = |p: &Pillar| at_m.distance(DVec2::from_array(p.position_m)) - p.radius_m;
    let pillars = site.pillars.iter().map(pillar);
    let pieces = site.furniture.iter().map(|piece| from_piece_m(piece, at_m));
    pillars.chain(pieces).fold(site.hall.clearance_m(at_m), f64::min)
}

/// Negative within.
pub fn from_piece_m(piece: &Furniture, at_m: DVec2) -> f64 {
    let turned = DVec2::from_angle(-piece.yaw_deg.to_radians());
    let from_middle = turned.rotate(at_m - DVec2::from_array(piece.position_m));
    let beyond = from_middle.abs() - 0.5 * DVec2::new(piece.size_m[0], piece.size_m[1]);
    beyond.max(DVec2::ZERO).length() + beyond.max_element().min(0.0)
}

fn sides_of_pillar(pillar: &Pillar, zero_m: DVec2) -> Vec<Vec2> {
    let corner = |i: usize| {
        let turned = DVec2::from_angle(i as f64 / PILLAR_SIDES as f64 * std::f64::consts::TAU);
        (DVec2::from_array(pillar.position_m) - zero_m + turned * pillar.radius_m).as_vec2()
    };
    (0..PILLAR_SIDES).map(corner).collect()
}

fn sides_of_piece(piece: &Furniture, zero_m: DVec2) -> Vec<Vec2> {
    piece.corners().map(|corner| (corner - zero_m).as_vec2()).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;

    /// An L 10 m long and wide whose arms are 3 m wide, far from the origin.
    fn site() -> Site {
        let mut site = Config::default().site;
        (site.pillars, site.furniture) = (Vec::new(), Vec::new());
        let l = [[0.0, 0.0], [10.0, 0.0], [10.0, 3.0], [3.0, 3.0], [3.0, 10.0], [0.0, 10.0]];
        site.hall.outline_m = l.map(|[x, y]| [x + 500_000.0, y + 5_400_000.0]).to_vec();
        site
    }

    #[test]
    fn a_way_leads_round_the_corner_and_is_little_longer_than_it_must() {
        let floor = Floor::of(&site(), 0.3).unwrap();
        let (from, to) = (Vec2::new(4.0, -3.5), Vec2::new(-3.5, 4.0));
        let way = floor.way(from, to, 0.3).unwrap();
        assert!((2..=4).contains(&way.len()), "{way:?}");
        let all: Vec<Vec2> = std::iter::once(from).chain(way).collect();
        let length_m: f32 = all.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        let corner = Vec2::new(-2.0, -2.0) - Vec2::splat(0.3 * std::f32::consts::FRAC_1_SQRT_2);
        let least_m = from.distance(corner) + corner.distance(to);
        assert!(length_m > least_m - 0.1 && length_m < least_m + 0.4, "{length_m} m for {least_m} m");
        assert!(all.windows(2).all(|pair| floor.sees(pair[0], pair[1], 0.29)));
    }

    #[test]
    fn what_stands_in_the_way_is_walked_round_and_a_closed_floor_has_no_way() {
        let mut site = site();
        let table = |width_m: f64| Furniture {
            position_m: [500_006.0, 5_400_001.5],
            size_m: [1.0, width_m, 0.8],
            yaw_deg: 0.0,
        };
        let (from, to) = (Vec2::new(4.0, -3.5), Vec2::new(-3.5, -3.5));
        site.furniture = vec![table(1.4)];
        let way = Floor::of(&site, 0.3).unwrap().way(from, to, 0.3).unwrap();
        assert!(way.len() > 1);
        site.furniture = vec![table(2.8)];
        assert_eq!(Floor::of(&site, 0.3).unwrap().way(from, to, 0.3), None);
        site.simulation.entrances_m = vec![[500_009.0, 5_400_001.5]];
        let told = Floor::of(&site, 0.3).unwrap_err().to_string();
        assert!(told.contains("entrances_m: expected one floor, found no way to [500009.0"), "{told}");
        site.simulation.entrances_m = vec![[500_006.0, 5_400_001.5]];
        let told = Floor::of(&site, 0.3).unwrap_err().to_string();
        assert!(told.contains("expected 0.3 m of free floor round each"), "{told}");
    }
}
