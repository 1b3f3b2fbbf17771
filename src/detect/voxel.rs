//! The empty scene as occupied voxels, and the voxel centroids that thin a cloud: both as hdl_people_tracking has
//! them, quirks included (facts and values: koide3/hdl_people_tracking at 2d12516).

use super::Point;
use crate::elementary::{index, whole};
use crate::geometry::{Aabb, DVec2, DVec3};
use crate::lidar::{ABREAST, Lanes};

/// More voxels than this are not kept; what lies beyond counts as new.
const VOXELS_MAX: usize = 1 << 28;
/// Voxels in a word of the map.
const BITS: usize = u64::BITS as usize;

/// Which voxels of the map's box hold points of the map, a bit each: few enough bytes to stay near the processor.
#[derive(Debug, Clone)]
pub struct VoxelMap {
    bounds: Aabb,
    edge_m: f64,
    /// Voxels along x, y and z; whole numbers, like all below.
    size: DVec3,
    /// From one voxel to the next along x, y and z.
    strides: DVec3,
    voxels: f64,
    /// One point at least.
    once: Vec<u64>,
    /// Two at least, which is hdl_people_tracking's threshold: there nothing is new. Has one voxel more, which stands for what is
    /// outside.
    twice: Vec<u64>,
}

impl VoxelMap {
    /// The box of a first scan of the empty scene, with its points counted.
    pub fn new(edge_m: f64, points: &[Point]) -> Self {
        let bounds = Aabb::around(points.iter().map(|p| p.position_m));
        let cells = if points.is_empty() { DVec3::ZERO } else { (bounds.size_m() / edge_m).ceil() };
        let mut size = [cells.x as usize, cells.y as usize, cells.z as usize];
        let layer = size[0].saturating_mul(size[1]).max(1);
        size[2] = size[2].min(VOXELS_MAX / layer);
        let voxels = if size[2] == 0 { 0 } else { size[0] * size[1] * size[2] };
        let bits = vec![0; voxels / BITS + 1];
        // Where one side is 0, nothing is inside the others.
        let [nx, ny, nz] = size.map(|cells| if voxels == 0 { -1.0 } else { cells as f64 });
        let mut map = Self {
            bounds,
            edge_m,
            size: DVec3::new(nx, ny, nz),
            strides: DVec3::new(1.0, nx, nx * ny),
            voxels: voxels as f64,
            once: bits.clone(),
            twice: bits,
        };
        map.add(points);
        map
    }

    /// Counts the points of one more scan; what lies outside the first one's box is left out or falls
    /// into the row on its other side.
    pub fn add(&mut self, points: &[Point]) {
        for point in points {
            // A point on the far face falls into the next row, as in the original.
            let flat = self.in_edges(point.position_m).trunc().dot(self.strides);
            if !(0.0..self.voxels).contains(&flat) {
                continue;
            }
            let flat = flat as usize;
            let (word, bit) = (flat / BITS, 1 << (flat % BITS));
            self.twice[word] |= self.once[word] & bit;
            self.once[word] |= bit;
        }
    }

    /// True when fewer than two points of the map share the point's voxel, or it lies outside the map.
    pub fn is_new(&self, position_m: DVec3) -> bool {
        self.is_free(self.flat(position_m))
    }

    /// The same of some points, given as their x, y and z: a bit each. All voxels are found before the first is looked up: the one
    /// is done in vector registers, and of the other many are under way at once.
    #[inline(always)]
    pub fn are_new(&self, [x, y, z]: &[Lanes; 3]) -> u32 {
        let mut flat = [0; ABREAST];
        for (i, flat) in flat.iter_mut().enumerate() {
            *flat = self.flat(DVec3::new(x[i], y[i], z[i]));
        }
        let mut bits = 0;
        for (i, &flat) in flat.iter().enumerate() {
            bits |= u32::from(self.is_free(flat)) << i;
        }
        bits
    }

    #[inline(always)]
    fn is_free(&self, flat: u64) -> bool {
        let flat = flat as usize;
        self.twice[flat / BITS] >> (flat % BITS) & 1 == 0
    }

    /// The place of a point's voxel among the bits.
    #[inline(always)]
    fn flat(&self, position_m: DVec3) -> u64 {
        let v = self.in_edges(position_m);
        // No short cut, which would be a branch.
        let within = |v: f64, n: f64| (v > -1.0) & (v < n);
        let inside = within(v.x, self.size.x) & within(v.y, self.size.y) & within(v.z, self.size.z);
        let whole = |v: f64| whole(if v > 0.0 { v } else { 0.0 });
        let flat = whole(v.x) * self.strides.x + whole(v.y) * self.strides.y + whole(v.z) * self.strides.z;
        index(if inside { flat } else { self.voxels })
    }

    /// Truncated toward zero, this is the voxel: the first one below the box counts as inside, as in the original.
    #[inline(always)]
    fn in_edges(&self, position_m: DVec3) -> DVec3 {
        (position_m - self.bounds.min_m) / self.edge_m
    }
}

/// A key holds z, y and x of a voxel in so many bits each (1.6 km at 0.1 m), and the number of a point in the rest.
const AXIS_BITS: u32 = 14;
const INDEX_BITS: u32 = 64 - 3 * AXIS_BITS;

/// Buffers of [`thin`].
#[derive(Debug, Clone, Default)]
pub struct Thinning {
    keys: Vec<u64>,
    sorted: Vec<u64>,
    starts: Vec<u32>,
    thinned: Vec<Point>,
}

/// Replaces the points of each voxel by their centroid, in order of z, y, x. Voxels count from `middle_m`, rounded to their edges.
pub fn thin(points: &mut Vec<Point>, edge_m: f64, middle_m: DVec2, memory: &mut Thinning) {
    const HALF_AXIS: i64 = 1 << (AXIS_BITS - 1);
    let Thinning { keys, sorted, starts, thinned } = memory;
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
    (0..3).for_each(|axis| sort_axis(keys, sorted, starts, axis));
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

/// Sorts keys by one axis of their voxels, counting from x, and leaves those of equal places in order.
fn sort_axis(keys: &mut Vec<u64>, sorted: &mut Vec<u64>, starts: &mut Vec<u32>, axis: u32) {
    const PLACES: usize = 1 << AXIS_BITS;
    let place = |key: u64| (key >> (INDEX_BITS + axis * AXIS_BITS)) as usize % PLACES;
    starts.clear();
    starts.resize(PLACES, 0);
    keys.iter().for_each(|&key| starts[place(key)] += 1);
    let mut sum = 0;
    for start in &mut *starts {
        sum += std::mem::replace(start, sum);
    }
    sorted.resize(keys.len(), 0);
    for &key in &*keys {
        let start = &mut starts[place(key)];
        sorted[*start as usize] = key;
        *start += 1;
    }
    std::mem::swap(keys, sorted);
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
        assert!(!map.is_new(DVec3::new(0.45, 0.45, 0.45)));
        assert!(map.is_new(DVec3::new(0.9, 0.5, 0.5)), "one point is not enough");
        assert!(map.is_new(DVec3::new(3.0, 0.5, 0.5)), "outside the map");
    }

    #[test]
    fn the_first_voxel_below_the_map_counts_as_inside() {
        let map = VoxelMap::new(0.2, &[point(0.0, 0.0, 0.0), point(0.01, 0.0, 0.0), point(1.0, 1.0, 1.0)]);
        assert!(!map.is_new(DVec3::new(-0.15, 0.0, 0.0)));
        assert!(map.is_new(DVec3::new(-0.25, 0.0, 0.0)));
    }

    #[test]
    fn everything_is_new_where_the_map_has_no_height() {
        let map = VoxelMap::new(0.2, &[point(0.0, 0.0, 0.0), point(0.0, 0.0, 0.0), point(1.0, 1.0, 0.0)]);
        assert!(map.is_new(DVec3::ZERO) && map.is_new(DVec3::new(0.5, 0.5, -0.1)));
        assert!(VoxelMap::new(0.2, &[]).is_new(DVec3::ZERO));
    }

    #[test]
    fn thinning_keeps_one_centroid_a_voxel() {
        let mut points = vec![point(0.02, 0.05, 0.05), point(0.06, 0.05, 0.05), point(-0.02, 0.05, 0.05)];
        thin(&mut points, 0.1, DVec2::ZERO, &mut Thinning::default());
        assert_eq!(points.len(), 2);
        assert_eq!(points[0].position_m.x, -0.02);
        assert!((points[1].position_m.x - 0.04).abs() < 1e-12);
    }

    #[test]
    fn thinning_keeps_voxels_apart_far_from_the_origin() {
        let far = |x: f64| point(500_000.0 + x, 5_400_000.05, 0.05);
        let mut points = vec![far(0.05), far(0.15), far(0.16)];
        thin(&mut points, 0.1, DVec2::new(500_000.0, 5_400_000.0), &mut Thinning::default());
        assert_eq!(points.len(), 2);
    }
}
