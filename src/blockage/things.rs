//! Blockage by the hall itself: walls, pillars and furniture between an access point and the samples of a UE. This is
//! plain geometry. Only the UE's position is uncertain, and the samples express it.

use super::lanes::{WORD, larger, smaller, word_of};
use super::rays::Rays;
use super::trajectories::Disc;
use crate::Site;
use crate::geometry::{DVec2, DVec3};
use crate::site::from_segment_m;

/// An access point hangs on whatever wall is as near.
const HUNG_M: f64 = 0.3;

/// Everything of a site that blocks.
#[derive(Debug, Clone, Default)]
pub(super) struct Things {
    /// None of a rectangle, whose walls stand between no two places of it.
    walls: Vec<[DVec2; 2]>,
    /// Axis and radius.
    pillars: Vec<(DVec2, f64)>,
    boxes: Vec<Cuboid>,
    /// By access point: whether it is within the walls. From outside one looks in through them.
    indoors: Vec<bool>,
    /// Those that may stand in the way of the link that is looked at.
    near_walls: Vec<[[f32; 2]; 2]>,
    near_pillars: Vec<([f32; 2], f32)>,
    near_boxes: Vec<usize>,
}

/// A piece of furniture.
#[derive(Debug, Clone, Copy)]
struct Cuboid {
    middle_m: DVec2,
    /// Cosine and sine of its turn.
    turn: DVec2,
    half_m: DVec2,
    floor_m: f64,
    top_m: f64,
}

impl Things {
    pub(super) fn new(site: &Site) -> Self {
        let hall = &site.hall;
        let boxes = site.furniture.iter().map(|piece| {
            let floor_m = hall.floor_m(DVec2::from_array(piece.position_m));
            Cuboid {
                middle_m: DVec2::from_array(piece.position_m),
                turn: DVec2::from_angle(piece.yaw_deg.to_radians()),
                half_m: 0.5 * DVec2::new(piece.size_m[0], piece.size_m[1]),
                floor_m,
                top_m: floor_m + piece.size_m[2],
            }
        });
        let indoors =
            site.access_points.iter().map(|ap| hall.clearance_m(ap.position().truncate()) > -HUNG_M);
        Self {
            walls: if hall.outline_m.is_empty() { Vec::new() } else { hall.walls().collect() },
            pillars: site.pillars.iter().map(|p| (DVec2::from_array(p.position_m), p.radius_m)).collect(),
            boxes: boxes.collect(),
            indoors: indoors.collect(),
            ..Self::default()
        }
    }

    /// Keeps those that a ray from access point `ap` to a UE within `disc` may meet; false where there are none. All rays
    /// pass within the disc's radius of the one to its middle. `lowest_m` is where the lowest of them ends.
    pub(super) fn look(&mut self, ap: usize, ap_m: DVec3, disc: Disc, lowest_m: f64) -> bool {
        let (start_m, end_m) = (ap_m.truncate(), disc.center_m);
        let local = |at: DVec2| (at - start_m).to_array().map(|m| m as f32);
        self.near_walls.clear();
        if self.indoors.get(ap).copied().unwrap_or_default() {
            let reaches = |wall: &&[DVec2; 2]| {
                let along = (wall[1] - wall[0]).normalize_or_zero();
                let [start, end] = [start_m, end_m].map(|at| along.perp_dot(at - wall[0]));
                let same_side =
                    (start > HUNG_M && end > disc.radius_m) || (start < -HUNG_M && end < -disc.radius_m);
                !same_side && meet(**wall, [start_m, end_m], disc.radius_m)
            };
            self.near_walls.extend(self.walls.iter().filter(reaches).map(|wall| wall.map(local)));
        }
        self.near_pillars.clear();
        let in_way = |(axis_m, radius_m): &&(DVec2, f64)| {
            from_segment_m(*axis_m, [start_m, end_m]) <= radius_m + disc.radius_m
        };
        let pillars = self.pillars.iter().filter(in_way);
        self.near_pillars.extend(pillars.map(|(axis_m, radius_m)| (local(*axis_m), *radius_m as f32)));
        self.near_boxes.clear();
        for (i, cuboid) in self.boxes.iter().enumerate() {
            let far_m = from_segment_m(cuboid.middle_m, [start_m, end_m]);
            if far_m <= cuboid.half_m.length() + disc.radius_m && lowest_m.min(ap_m.z) <= cuboid.top_m {
                self.near_boxes.push(i);
            }
        }
        self.near_walls.len() > 1 || !self.near_pillars.is_empty() || !self.near_boxes.is_empty()
    }

    /// The samples of a word of rays that are blocked, a bit each.
    #[inline(always)]
    pub(super) fn block(&self, rays: &Rays, word: usize) -> u32 {
        let [x, y, z] = [0, 1, 2].map(|i| word_of(&rays.end_m[i], word));
        let mut bits = self.walls_block(x, y);
        for &([axis_x, axis_y], radius) in &self.near_pillars {
            for k in 0..WORD {
                let squared = larger(x[k] * x[k] + y[k] * y[k], f32::MIN_POSITIVE);
                let share = smaller(larger((axis_x * x[k] + axis_y * y[k]) / squared, 0.0), 1.0);
                let (off_x, off_y) = (axis_x - share * x[k], axis_y - share * y[k]);
                bits |= u32::from(off_x * off_x + off_y * off_y <= radius * radius) << k;
            }
        }
        for &i in &self.near_boxes {
            for k in 0..WORD {
                let end_m = [x[k], y[k], z[k]].map(f64::from);
                bits |= u32::from(self.boxes[i].is_hit(rays.start_m, end_m)) << k;
            }
        }
        bits
    }

    /// A way between two places of the hall that leaves it comes back. A sample may lie behind a wall near which somebody
    /// walks: it leaves once, and nothing blocks it.
    #[inline(always)]
    fn walls_block(&self, x: &[f32; WORD], y: &[f32; WORD]) -> u32 {
        if self.near_walls.len() < 2 {
            return 0;
        }
        let mut crossed = [0_u32; WORD];
        for &[[ax, ay], [bx, by]] in &self.near_walls {
            let (dx, dy) = (bx - ax, by - ay);
            let start = dy * ax - dx * ay;
            for k in 0..WORD {
                let end = dx * (y[k] - ay) - dy * (x[k] - ax);
                let (a, b) = (x[k] * ay - y[k] * ax, x[k] * by - y[k] * bx);
                let share = start / (start - end);
                let far = share * share * (x[k] * x[k] + y[k] * y[k]);
                let is_crossed =
                    (start > 0.0) != (end > 0.0) && (a > 0.0) != (b > 0.0) && far > (HUNG_M * HUNG_M) as f32;
                crossed[k] += u32::from(is_crossed);
            }
        }
        crossed.iter().enumerate().fold(0, |bits, (k, &count)| bits | u32::from(count > 1) << k)
    }
}

impl Cuboid {
    /// Whether a ray from `start_m` to a place given from there in plan view, with its height, meets it.
    fn is_hit(&self, start_m: DVec3, [x, y, z]: [f64; 3]) -> bool {
        let own = |v: DVec2| DVec2::new(self.turn.dot(v), self.turn.perp_dot(v));
        let (from, along) = (own(start_m.truncate() - self.middle_m), own(DVec2::new(x, y)));
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        let mut cut = |from: f64, along: f64, least: f64, most: f64| {
            if along == 0.0 {
                return from >= least && from <= most;
            }
            let (a, b) = ((least - from) / along, (most - from) / along);
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
            enter <= leave
        };
        cut(from.x, along.x, -self.half_m.x, self.half_m.x)
            && cut(from.y, along.y, -self.half_m.y, self.half_m.y)
            && cut(start_m.z, z - start_m.z, self.floor_m, self.top_m)
    }
}

/// Whether two segments come as near as `room_m`.
fn meet(a: [DVec2; 2], b: [DVec2; 2], room_m: f64) -> bool {
    let side = |[from, to]: [DVec2; 2], p: DVec2| (to - from).perp_dot(p - from);
    let cross = side(a, b[0]) * side(a, b[1]) < 0.0 && side(b, a[0]) * side(b, a[1]) < 0.0;
    let near = |p: DVec2, of: [DVec2; 2]| from_segment_m(p, of) <= room_m;
    cross || a.into_iter().any(|p| near(p, b)) || b.into_iter().any(|p| near(p, a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    /// An L whose inner corner is at (4, 4), a pillar and a table of 0.8 m.
    fn things(ap_m: DVec3) -> Things {
        let mut site = Config::default().site;
        let l = [[0.0, 0.0], [12.0, 0.0], [12.0, 4.0], [4.0, 4.0], [4.0, 12.0], [0.0, 12.0]];
        site.hall.outline_m = l.to_vec();
        site.pillars.truncate(1);
        (site.pillars[0].position_m, site.pillars[0].radius_m) = ([8.0, 2.0], 0.3);
        site.furniture.truncate(1);
        (site.furniture[0].position_m, site.furniture[0].size_m) = ([2.0, 8.0], [2.0, 1.0, 0.8]);
        site.furniture[0].yaw_deg = 90.0;
        site.access_points.truncate(1);
        site.access_points[0].position_m = ap_m.to_array();
        Things::new(&site)
    }

    fn blocked(ap_m: DVec3, ends_m: &[DVec3]) -> Vec<bool> {
        let (mut things, mut rays) = (things(ap_m), Rays::default());
        rays.start_m = ap_m;
        for (i, of) in rays.end_m.iter_mut().enumerate() {
            *of = vec![0.0; WORD];
            for (value, end_m) in of.iter_mut().zip(ends_m) {
                *value = if i < 2 { end_m[i] - ap_m[i] } else { end_m[i] } as f32;
            }
        }
        let each = |(k, end_m): (usize, &DVec3)| {
            let disc = Disc { center_m: end_m.truncate(), radius_m: 0.5 };
            things.look(0, ap_m, disc, end_m.z) && things.block(&rays, 0) & (1 << k) != 0
        };
        ends_m.iter().enumerate().map(each).collect()
    }

    #[test]
    fn a_wall_a_pillar_and_a_table_hide_what_lies_behind_them() {
        // On the right wall, at 2 m.
        let ap_m = DVec3::new(12.0, 1.0, 2.0);
        let end = |x: f64, y: f64| DVec3::new(x, y, 1.0);
        let ends = [end(1.0, 1.0), end(1.0, 9.0), end(3.5, 0.4), end(4.0, 3.0), end(10.0, 4.2)];
        // Free, round the corner, free, behind the pillar, and a sample that lies in the wall.
        assert_eq!(blocked(ap_m, &ends), [false, true, false, true, false]);
        let above = DVec3::new(2.0, 11.0, 2.0);
        let ends = [DVec3::new(2.0, 6.0, 0.2), DVec3::new(2.0, 6.0, 1.4), DVec3::new(3.5, 6.0, 0.2)];
        assert_eq!(blocked(above, &ends), [true, false, false]);
    }

    #[test]
    fn from_outside_one_looks_in_through_the_outline() {
        assert_eq!(blocked(DVec3::new(14.0, 9.0, 2.0), &[DVec3::new(2.0, 10.0, 1.0)]), [false]);
    }
}
