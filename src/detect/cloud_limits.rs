//! The quick look at an unorganised cloud. Once the empty scene is known and nothing was put there since, a return changes
//! nothing but whether it is new itself. Then one comparison a point answers, and only the new ones are put in order.
//!
//! Directions are worked out by short series first, in loops that run in vector registers. Where a direction lies so near
//! the edge of a bin that their error could matter, the functions decide by which the scene was learned: the answers are
//! those of the whole look, to the last bit.

use std::f32::consts::{FRAC_PI_2, PI};

use super::range_model::RangeModel;
use crate::elementary::wide;
use crate::lidar::SensorPoint;

/// Points that are worked out together.
const LANES: usize = 32;
/// So near to the edge of a bin, in bins, the series are not believed: more than ten times what they err by.
const EDGE: f32 = 2e-3;
/// Straight above and below, the arc sine of the exact way rounds more than that.
const STEEP: f32 = 0.99;

/// Bins of elevation of a cloud whose beams are not known. They are centred on their multiples, where beams use to be; the
/// first and the last stay empty, for neighbours.
#[derive(Debug, Clone, Copy)]
pub(super) struct Elevations {
    pub(super) per_rad: f64,
    pub(super) bins: usize,
}

impl Elevations {
    pub(super) fn of_deg(bin_deg: f64) -> Self {
        Self { per_rad: 1.0_f64.to_degrees() / bin_deg, bins: (180.0 / bin_deg) as usize + 3 }
    }

    /// The bin of a return by its height over the sensor and its range.
    pub(super) fn bin(self, z_m: f32, range_m: f32) -> usize {
        let elevation_rad = f64::from(z_m / range_m).clamp(-1.0, 1.0).asin();
        let above_nadir_rad = elevation_rad + std::f64::consts::FRAC_PI_2;
        ((above_nadir_rad * self.per_rad).round() as usize + 1).min(self.bins - 2)
    }
}

/// Where a return was measured, hundredths of a degree, clockwise from above.
pub(super) fn azimuth_of_cdeg([x_m, y_m, _]: [f32; 3]) -> f32 {
    (-y_m).atan2(x_m).to_degrees() * 100.0
}

/// How far away a return was measured.
#[inline(always)]
pub(super) fn range_of_m([x_m, y_m, z_m]: [f32; 3]) -> f32 {
    (x_m * x_m + y_m * y_m + z_m * z_m).sqrt()
}

/// For every direction, the range from which on a return belongs to the known hall.
#[derive(Debug, Clone)]
pub(super) struct CloudLimits {
    /// Bin of azimuth after bin, in each by elevation; NaN where nothing ever came back from.
    limits_m: Vec<f32>,
    azimuths: usize,
    elevations: Elevations,
}

impl CloudLimits {
    /// Those of a scene that is known. Beams sit between two bins of elevation, so both neighbours count as well.
    pub(super) fn new(ranges: &RangeModel, rows: &[Option<u16>], elevations: Elevations) -> Self {
        let limit_m = |azimuth: usize, elevation: usize| {
            let limit_m = |row: &u16| ranges.limit_m(azimuth * ranges.rows() + usize::from(*row));
            let around = rows[elevation - 1..=elevation + 1].iter().flatten();
            rows[elevation].map_or(f32::NAN, |_| around.map(limit_m).fold(f32::INFINITY, f32::min))
        };
        let mut limits_m = vec![f32::NAN; ranges.bins() * elevations.bins];
        for (azimuth, limits_m) in limits_m.chunks_exact_mut(elevations.bins).enumerate() {
            for elevation in 1..elevations.bins - 1 {
                limits_m[elevation] = limit_m(azimuth, elevation);
            }
        }
        Self { limits_m, azimuths: ranges.bins(), elevations }
    }

    wide! {
        /// Puts the numbers of the points that are new into `new`, and counts those that are out of range. `None`: one
        /// came from an elevation of which nothing is known yet.
        pub(super) fn new_of(
            &self, cloud: &[SensorPoint], ranges: &RangeModel, limits_m: [f32; 2], new: &mut Vec<u32>,
        ) -> Option<u64> = new_of_avx2 or new_of_portably
    }

    #[inline(always)]
    fn new_of_portably(
        &self,
        cloud: &[SensorPoint],
        ranges: &RangeModel,
        [least_m, most_m]: [f32; 2],
        new: &mut Vec<u32>,
    ) -> Option<u64> {
        new.clear();
        let mut out_of_range = 0;
        for (chunk, points) in cloud.chunks(LANES).enumerate() {
            let seen = Seen::of(points, self.azimuths as f32, self.elevations.per_rad as f32);
            let mut left = self.not_of_hall(&seen, [least_m, most_m]);
            if points.len() < LANES {
                left &= (1 << points.len()) - 1;
            }
            while left != 0 {
                let k = left.trailing_zeros() as usize;
                left &= left - 1;
                let (point, range_m) = (&points[k], seen.range_m[k]);
                // Written so that NaN is out of range.
                if !(range_m >= least_m && range_m <= most_m) {
                    out_of_range += 1;
                    continue;
                }
                let azimuth = inside(seen.azimuth[k])
                    .unwrap_or_else(|| ranges.bin(azimuth_of_cdeg(point.position_m)) as usize);
                let elevation = inside(seen.elevation[k])
                    .filter(|_| !is_steep(point.position_m[2], range_m))
                    .unwrap_or_else(|| self.elevations.bin(point.position_m[2], range_m));
                let limit_m = self.limits_m[azimuth * self.elevations.bins + elevation];
                if limit_m.is_nan() {
                    return None;
                }
                if range_m < limit_m {
                    new.push((chunk * LANES + k) as u32);
                }
            }
        }
        Some(out_of_range)
    }

    /// A bit for each point that is not seen at once to belong to the hall: it is out of range, near the edge of a bin, steep, from
    /// where nothing came back before, or new.
    #[inline(always)]
    fn not_of_hall(&self, seen: &Seen, [least_m, most_m]: [f32; 2]) -> u32 {
        let mut places = [0_u32; LANES];
        for k in 0..LANES {
            let (azimuth_bin, azimuth_past) = whole_and_past(seen.azimuth[k]);
            let (elevation_bin, elevation_past) = whole_and_past(seen.elevation[k]);
            let is_inside = |past: f32| (past > EDGE) & (past < 1.0 - EDGE);
            let range_m = seen.range_m[k];
            let is_sure = is_inside(azimuth_past)
                & is_inside(elevation_past)
                & !is_steep(seen.z_m[k], range_m)
                & (range_m >= least_m)
                & (range_m <= most_m);
            let place = azimuth_bin.wrapping_mul(self.elevations.bins as u32).wrapping_add(elevation_bin);
            places[k] = if is_sure { place } else { u32::MAX };
        }
        // Looked up one by one; where a place is not sure there is none.
        let mut limits_m = [0.0; LANES];
        for k in 0..LANES {
            limits_m[k] = self.limits_m.get(places[k] as usize).copied().unwrap_or(f32::NAN);
        }
        // Written so that NaN is no limit to be beyond.
        let mut left = [0; LANES];
        for k in 0..LANES {
            left[k] = if seen.range_m[k] >= limits_m[k] { 0 } else { 1_u32 << k };
        }
        left.iter().fold(0, |all, bit| all | bit)
    }
}

/// The whole part of a number from 0 on, and what is past it. Near the next whole number the part may be one off; what is past it
/// is then near 0 or 1 all the same, or beyond.
#[inline(always)]
fn whole_and_past(number: f32) -> (u32, f32) {
    /// Adding it to a number below it rounds to a whole one, which then stands in the low bits.
    const WHOLE: f32 = 8_388_608.0;
    let shifted = number - 0.5 + WHOLE;
    (shifted.to_bits().wrapping_sub(WHOLE.to_bits()), number - (shifted - WHOLE))
}

#[inline(always)]
fn is_steep(z_m: f32, range_m: f32) -> bool {
    z_m.abs() > STEEP * range_m
}

/// The bin that a number of bins lies in; `None` near an edge.
#[inline(always)]
fn inside(bins: f32) -> Option<usize> {
    let whole = bins as usize;
    let past = bins - whole as f32;
    (past > EDGE && past < 1.0 - EDGE).then_some(whole)
}

/// How points look from the sensor: in bins, from the edge of the first.
struct Seen {
    range_m: [f32; LANES],
    z_m: [f32; LANES],
    azimuth: [f32; LANES],
    elevation: [f32; LANES],
}

impl Seen {
    #[inline(always)]
    fn of(points: &[SensorPoint], azimuths: f32, per_rad: f32) -> Self {
        let [mut x, mut y, mut z] = [[0.0; LANES]; 3];
        for (k, point) in points.iter().enumerate() {
            [x[k], y[k], z[k]] = point.position_m;
        }
        let [mut range_m, mut azimuth, mut elevation] = [[0.0; LANES]; 3];
        for k in 0..LANES {
            range_m[k] = range_of_m([x[k], y[k], z[k]]);
            let turned = angle_rad(-y[k], x[k]) * (azimuths / (2.0 * PI));
            azimuth[k] = turned + if turned < 0.0 { azimuths } else { 0.0 };
            let flat_m = (x[k] * x[k] + y[k] * y[k]).sqrt();
            // Half a bin, for bins are centred on their multiples, and the first that stays empty.
            elevation[k] = (angle_rad(z[k], flat_m) + FRAC_PI_2) * per_rad + 1.5;
        }
        Self { range_m, z_m: z, azimuth, elevation }
    }
}

/// The angle from x to y in (-pi, pi], to 1e-6: the series of the arc tangent by Abramowitz and Stegun, 4.4.49.
#[inline(always)]
fn angle_rad(y: f32, x: f32) -> f32 {
    const SERIES: [f32; 8] = [
        0.002_866_225_7,
        -0.016_165_737,
        0.042_909_614,
        -0.075_289_64,
        0.106_562_64,
        -0.142_089,
        0.199_935_51,
        -0.333_331_45,
    ];
    let (along, across) = (x.abs(), y.abs());
    let steep = across > along;
    let (small, large) = if steep { (along, across) } else { (across, along) };
    let share = small / if large > f32::MIN_POSITIVE { large } else { f32::MIN_POSITIVE };
    let squared = share * share;
    let mut sum = 0.0;
    for term in SERIES {
        sum = (sum + term) * squared;
    }
    let flat = share + share * sum;
    let first = if steep { FRAC_PI_2 - flat } else { flat };
    let upper = if x < 0.0 { PI - first } else { first };
    if y < 0.0 { -upper } else { upper }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points all round, at every elevation, many of them at edges of bins.
    fn directions() -> impl Iterator<Item = [f32; 3]> {
        (0..=720).flat_map(|e| {
            (0..=720).map(move |a| {
                let elevation_rad = (0.25 * f64::from(e) - 90.0).to_radians();
                let (sin, cos) = (0.5 * f64::from(a) - 180.0).to_radians().sin_cos();
                let flat_m = 9.0 * elevation_rad.cos();
                [flat_m * cos, flat_m * sin, 9.0 * elevation_rad.sin()].map(|m| m as f32)
            })
        })
    }

    #[test]
    fn the_series_find_the_bins_of_the_exact_way_or_none() {
        let (ranges, elevations) = (RangeModel::new(1.0), Elevations::of_deg(0.5));
        let points: Vec<SensorPoint> = directions()
            .map(|position_m| SensorPoint { position_m, time_ns: 0, reflectivity: 0.0 })
            .collect();
        let mut told = 0;
        for points in points.chunks(LANES) {
            let seen = Seen::of(points, 360.0, elevations.per_rad as f32);
            for (k, point) in points.iter().enumerate() {
                let [.., z_m] = point.position_m;
                let range_m = range_of_m(point.position_m);
                if let Some(azimuth) = inside(seen.azimuth[k]) {
                    assert_eq!(azimuth, ranges.bin(azimuth_of_cdeg(point.position_m)) as usize, "{point:?}");
                    told += 1;
                }
                if let Some(elevation) = inside(seen.elevation[k]).filter(|_| z_m.abs() <= STEEP * range_m) {
                    assert_eq!(elevation, elevations.bin(z_m, range_m), "{point:?}");
                    told += 1;
                }
            }
        }
        assert!(told > points.len() / 2, "{told}");
    }

    #[test]
    fn a_point_is_of_the_hall_at_once_only_where_its_exact_bin_says_so() {
        let (ranges, elevations) = (RangeModel::new(1.0), Elevations::of_deg(0.5));
        // Every other bin is unknown, as on a chessboard: a neighbour always answers otherwise.
        let is_known = |azimuth: usize, elevation: usize| (azimuth + elevation).is_multiple_of(2);
        let places = (0..ranges.bins()).flat_map(|a| (0..elevations.bins).map(move |e| (a, e)));
        let limits_m = places.map(|(a, e)| if is_known(a, e) { 1.0 } else { f32::NAN }).collect();
        let limits = CloudLimits { limits_m, azimuths: ranges.bins(), elevations };
        // Between the middle of a bin and its edge.
        let points: Vec<SensorPoint> = directions()
            .map(|[x, y, z]| [x + 0.02 * y, y - 0.02 * x, z + 0.01])
            .map(|position_m| SensorPoint { position_m, time_ns: 0, reflectivity: 0.0 })
            .collect();
        let mut settled = 0;
        for points in points.chunks_exact(LANES) {
            let seen = Seen::of(points, ranges.bins() as f32, elevations.per_rad as f32);
            let left = limits.not_of_hall(&seen, [0.5, 100.0]);
            for (k, point) in points.iter().enumerate().filter(|(k, _)| left >> k & 1 == 0) {
                let azimuth = ranges.bin(azimuth_of_cdeg(point.position_m)) as usize;
                let elevation = elevations.bin(point.position_m[2], seen.range_m[k]);
                assert!(is_known(azimuth, elevation), "{point:?}");
                settled += 1;
            }
        }
        assert!(settled > points.len() / 3, "{settled}");
    }

    #[test]
    fn what_is_no_number_or_out_of_range_is_counted_and_an_unknown_elevation_is_told() {
        let (mut ranges, elevations) = (RangeModel::new(1.0), Elevations::of_deg(0.5));
        let mut rows = vec![None; elevations.bins];
        let level = elevations.bin(0.0, 8.0);
        rows[level] = Some(0);
        ranges.grow(1);
        ranges.observe(ranges.pixel(0, 0.0), 8.0);
        ranges.close_revolution(true);
        let limits = CloudLimits::new(&ranges, &rows, elevations);
        let at = |x: f32, z: f32| SensorPoint { position_m: [x, 0.0, z], time_ns: 0, reflectivity: 0.0 };
        let mut new = Vec::new();
        let cloud = [at(8.0, 0.0), at(5.0, 0.0), at(f32::NAN, 0.0), at(0.1, 0.0), at(300.0, 0.0)];
        assert_eq!(limits.new_of(&cloud, &ranges, [0.5, 100.0], &mut new), Some(3));
        assert_eq!(new, [1]);
        assert_eq!(limits.new_of(&[at(5.0, 3.0)], &ranges, [0.5, 100.0], &mut new), None);
    }
}
