//! The empty scene as occupied voxels, and the voxel centroids that thin a cloud: both as hdl_people_tracking has
//! them, quirks included (facts and values: koide3/hdl_people_tracking at 2d12516).

use super::Point;
use crate::geometry::{Aabb, DVec2, DVec3};

/// More voxels than this are not kept; what lies beyond counts as new.
const VOXELS_MAX: usize = 1 << 28;

/// How many points of the map lie in each voxel of the map's box.
#[derive(Debug, Clone)]
pub struct VoxelMap {
    bounds: Aabb,
    edge_m: f64,
    size: [usize; 3],
    counts: Vec<u8>,
}

impl VoxelMap {
    /// The box of a first scan of the empty scene, with its points counted.
    pub fn new(edge_m: f64, points: &[Point]) -> Self {
        let bounds = Aabb::around(points.iter().map(|p| p.position_m));
        let cells = if points.is_empty() { DVec3::ZERO } else { (bounds.size_m() / edge_m).ceil() };
        let mut size = [cells.x as usize, cells.y as usize, cells.z as usize];
        let layer = size[0].saturating_mul(size[1]).max(1);
        size[2] = size[2].min(VOXELS_MAX / layer);
        let mut map = Self { bounds, edge_m, size, counts: vec![0; size[0] * size[1] * size[2]] };
        map.add(points);
        map
    }

    /// Counts the points of one more scan; what lies outside the first one's box is left out or falls
    /// into the row on its other side.
    pub fn add(&mut self, points: &[Point]) {
        for point in points {
            // A point on the far face falls into the next row, as in the original.
            let [x, y, z] = self.voxel(point.position_m);
            let flat = x + self.size[0] as i64 * (y + self.size[1] as i64 * z);
            if let Some(count) = usize::try_from(flat).ok().and_then(|flat| self.counts.get_mut(flat)) {
                *count = count.saturating_add(1);
            }
        }
    }

    /// True when fewer than `points_min` points of the map share the point's voxel, or it lies outside the map.
    pub fn is_new(&self, position_m: DVec3, points_min: u8) -> bool {
        let [x, y, z] = self.voxel(position_m);
        let inside = |i: i64, n: usize| i >= 0 && i < n as i64;
        if !(inside(x, self.size[0]) && inside(y, self.size[1]) && inside(z, self.size[2])) {
            return points_min > 0;
        }
        self.counts[x as usize + self.size[0] * (y as usize + self.size[1] * z as usize)] < points_min
    }

    fn voxel(&self, position_m: DVec3) -> [i64; 3] {
        // Truncated toward zero, so the first voxel below the box counts as inside, as in the original.
        let v = (position_m - self.bounds.min_m) / self.edge_m;
        [v.x as i64, v.y as i64, v.z as i64]
    }
}

/// Replaces the points of each voxel by their centroid, in order of z, y, x; `keys` and `thinned` are scratch. Voxels
/// count from `middle_m`, rounded to their edges.
pub fn thin(
    points: &mut Vec<Point>,
    edge_m: f64,
    middle_m: DVec2,
    keys: &mut Vec<u64>,
    thinned: &mut Vec<Point>,
) {
    // A key holds z, y and x of the voxel in 14 bits each (1.6 km at 0.1 m) and the point in the rest.
    const AXIS_BITS: u32 = 14;
    const INDEX_BITS: u32 = 64 - 3 * AXIS_BITS;
    const HALF_AXIS: i64 = 1 << (AXIS_BITS - 1);
    points.truncate(1 << INDEX_BITS);
    let [zero_x, zero_y] = (middle_m / edge_m).round().to_array();
    let part = |c: f64, zero: f64| {
        // Rounded down; `floor` is a call where it is no instruction.
        let cell = (c / edge_m - zero).clamp(-HALF_AXIS as f64, (HALF_AXIS - 1) as f64);
        let toward_zero = cell as i64;
        (toward_zero - i64::from(toward_zero as f64 > cell) + HALF_AXIS) as u64
    };
    keys.clear();
    keys.extend(points.iter().zip(0..).map(|(p, i): (_, u64)| {
        let DVec3 { x, y, z } = p.position_m;
        let (x, y, z) = (part(x, zero_x), part(y, zero_y), part(z, 0.0));
        ((z << AXIS_BITS | y) << AXIS_BITS | x) << INDEX_BITS | i
    }));
    keys.sort_unstable();
    thinned.clear();
    for voxel in keys.chunk_by(|a, b| a >> INDEX_BITS == b >> INDEX_BITS) {
        let mut of = voxel.iter().map(|key| &points[(key & ((1 << INDEX_BITS) - 1)) as usize]);
        let Some(&first) = of.next() else { continue };
        let (mut sum_m, mut late_ns) = (first.position_m, 0);
        for point in of {
            sum_m += point.position_m;
            late_ns += point.time_ns - first.time_ns;
        }
        thinned.push(Point {
            position_m: sum_m / voxel.len() as f64,
            time_ns: first.time_ns + late_ns / voxel.len() as i64,
            sensor: first.sensor,
        });
    }
    std::mem::swap(points, thinned);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64, z: f64) -> Point {
        Point { position_m: DVec3::new(x, y, z), time_ns: 0, sensor: 0 }
    }

    #[test]
    fn a_voxel_needs_two_points_to_hide_what_comes_later() {
        let corners = [point(0.0, 0.0, 0.0), point(1.05, 1.05, 1.05)];
        let twice = [point(0.5, 0.5, 0.5), point(0.51, 0.5, 0.5), point(0.9, 0.5, 0.5)];
        let map = VoxelMap::new(0.2, &[&corners[..], &twice[..]].concat());
        assert!(!map.is_new(DVec3::new(0.45, 0.45, 0.45), 2));
        assert!(map.is_new(DVec3::new(0.9, 0.5, 0.5), 2), "one point is not enough");
        assert!(map.is_new(DVec3::new(3.0, 0.5, 0.5), 2), "outside the map");
    }

    #[test]
    fn the_first_voxel_below_the_map_counts_as_inside() {
        let map = VoxelMap::new(0.2, &[point(0.0, 0.0, 0.0), point(0.01, 0.0, 0.0), point(1.0, 1.0, 1.0)]);
        assert!(!map.is_new(DVec3::new(-0.15, 0.0, 0.0), 2));
        assert!(map.is_new(DVec3::new(-0.25, 0.0, 0.0), 2));
    }

    #[test]
    fn thinning_keeps_one_centroid_a_voxel() {
        let mut points = vec![point(0.02, 0.05, 0.05), point(0.06, 0.05, 0.05), point(-0.02, 0.05, 0.05)];
        thin(&mut points, 0.1, DVec2::ZERO, &mut Vec::new(), &mut Vec::new());
        assert_eq!(points.len(), 2);
        assert_eq!(points[0].position_m.x, -0.02);
        assert!((points[1].position_m.x - 0.04).abs() < 1e-12);
    }

    #[test]
    fn thinning_keeps_voxels_apart_far_from_the_origin() {
        let far = |x: f64| point(500_000.0 + x, 5_400_000.05, 0.05);
        let mut points = vec![far(0.05), far(0.15), far(0.16)];
        thin(&mut points, 0.1, DVec2::new(500_000.0, 5_400_000.0), &mut Vec::new(), &mut Vec::new());
        assert_eq!(points.len(), 2);
    }
}
