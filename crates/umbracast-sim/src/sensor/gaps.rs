//! Most triangles of a body lie between two beams. Which ones may not is told from their corners alone, each of which knows
//! the gap between beams that it lies in, without a branch.

use glam::Vec4;

/// Triangles are seldom longer; those that are always may meet a beam.
const SIDE_M: f64 = 0.25;
/// Of a step, for rounding.
const MARGIN: f64 = 1e-3;

/// Where a vertex or a triangle is during a pass: least and greatest values.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// Distance along the middle azimuth.
    pub ahead_m: (f64, f64),
    /// Tangent of the azimuth from the middle; holds where all of `ahead_m` is positive.
    pub tangent: (f64, f64),
    /// Rise over horizontal distance, from where any beam passes the axis.
    pub slope: (f64, f64),
}

impl Bounds {
    /// What bounds both.
    pub fn around(self, other: Self) -> Self {
        let both = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
        Self {
            ahead_m: both(self.ahead_m, other.ahead_m),
            tangent: both(self.tangent, other.tangent),
            slope: both(self.slope, other.slope),
        }
    }
}

/// Finds the triangles that may meet a beam. Keeps its buffer.
#[derive(Debug, Clone)]
pub struct Gaps {
    lowest: f64,
    steps_per_slope: f64,
    /// In even steps of slope, with two steps below the lowest beam and two above the highest: how many beams are lower for
    /// certain, and how many may not be higher, negative.
    beams: Vec<[f32; 2]>,
    /// Of each vertex: how many beams are lower, how many are not higher (negative), tangents of its least azimuth and of its
    /// greatest (negative). So the least of each number bounds a triangle.
    corners: Vec<Vec4>,
    /// A triangle with a greater difference of tangents may meet a beam anyway.
    width: f32,
}

impl Gaps {
    const STEPS_PER_BEAM: usize = 32;

    /// For beams of these slopes, from the lowest to the highest.
    pub fn new(slopes: impl ExactSizeIterator<Item = f64>) -> Self {
        let slopes: Vec<f64> = slopes.collect();
        let lowest = slopes.first().copied().unwrap_or(0.0);
        let highest = slopes.last().copied().unwrap_or(0.0);
        let steps = Self::STEPS_PER_BEAM * slopes.len().max(1);
        let steps_per_slope = steps as f64 / (highest - lowest).max(1e-6);
        let slope_at = |step: f64| lowest + step / steps_per_slope;
        let last = steps + 3;
        let of_step = |k: usize| {
            let from = slope_at(k as f64 - 2.0 - MARGIN);
            let to = slope_at(k as f64 - 1.0 + MARGIN);
            let lower = if k == 0 { 0 } else { slopes.partition_point(|&slope| slope < from) };
            let not_higher =
                if k == last { slopes.len() } else { slopes.partition_point(|&slope| slope <= to) };
            [lower as f32, -(not_higher as f32)]
        };
        let beams = (0..=last).map(of_step).collect();
        Self { lowest, steps_per_slope, beams, corners: Vec::new(), width: 0.0 }
    }

    /// Takes vertices, all of which are before the sensor, none nearer than `nearest_m` along the middle azimuth; beams pass
    /// the axis at `aside` times that distance at most.
    pub fn place(&mut self, bounds: &[Bounds], nearest_m: f64, aside: f64) {
        let width = (SIDE_M / nearest_m).min(0.5);
        self.width = width as f32;
        // A little more for what tangents lose as `f32`.
        let square = 1.01 * width * width + 4.0 * aside * aside;
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        corners.extend(bounds.iter().map(|bounds| {
            let (low, high) = stretched(bounds.slope, square);
            let (from, to) = bounds.tangent;
            Vec4::new(self.at(low)[0], self.at(high)[1], from as f32, -to as f32)
        }));
        self.corners = corners;
    }

    /// So many beams at least have a lower slope, none for what is not a number; all but a beam or so.
    pub fn lower_beams(&self, slope: f64) -> usize {
        self.at(slope)[0] as usize
    }

    #[inline]
    fn at(&self, slope: f64) -> [f32; 2] {
        let step = (slope - self.lowest) * self.steps_per_slope + 2.0;
        // The cast takes what is not a number to 0.
        self.beams[step.clamp(0.0, (self.beams.len() - 1) as f64) as i32 as usize]
    }

    /// The triangles that may meet a beam, by number.
    pub fn crossing(&self, triangles: &[[u32; 3]], crossing: &mut Vec<u32>) {
        crossing.resize(triangles.len(), 0);
        let mut count = 0;
        for (number, triangle) in triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|corner| self.corners[corner as usize]);
            let least = a.min(b).min(c);
            crossing[count] = number as u32;
            count += usize::from((least.x + least.y < 0.0) | (least.z + least.w < -self.width));
        }
        crossing.truncate(count);
    }
}

/// Slopes between corners are steeper than at them: a chord is nearer to the axis than its ends, by up to the
/// cosine of half the angle between them. 1 / cos(w / 2) < 1 + w2 / 4 for w < 2, and w < the tangents' difference, whose
/// square is given.
pub fn stretched((low, high): (f64, f64), width_squared: f64) -> (f64, f64) {
    let stretch = 1.0 + width_squared * 0.25;
    (low.min(low * stretch), high.max(high * stretch))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_beam_is_taken_for_lower_or_higher_than_it_is() {
        let slopes = [-0.6, -0.25, -0.24, 0.0, 0.0, 0.19];
        let gaps = Gaps::new(slopes.into_iter());
        let even = (-1_000..1_000).map(|k| f64::from(k) * 1e-3);
        let at_beams = slopes.iter().flat_map(|slope| [slope.next_down(), *slope, slope.next_up()]);
        for slope in even.chain(at_beams).chain([f64::NEG_INFINITY, f64::INFINITY]) {
            let [lower, not_higher] = gaps.at(slope);
            let beams = |is: &dyn Fn(f64) -> bool| slopes.iter().filter(|&&beam| is(beam)).count() as f32;
            // Two steps of the table.
            let near = 2.0 * 0.79 / 192.0;
            assert!(lower <= beams(&|beam| beam < slope), "{slope}");
            assert!(lower >= beams(&|beam| beam < slope - near), "{slope}");
            assert!(-not_higher >= beams(&|beam| beam <= slope), "{slope}");
            assert!(-not_higher <= beams(&|beam| beam <= slope + near), "{slope}");
        }
        assert_eq!(gaps.lower_beams(f64::NAN), 0);
    }
}
