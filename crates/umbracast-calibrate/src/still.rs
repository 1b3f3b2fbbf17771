//! What lies still before a sensor: the usual range of each direction.

use umbracast::geometry::DVec3;
use umbracast::lidar::{Azimuths, Cloud, Scan};

/// Width of a direction, degrees: a little more than one column, about the distance of two beams.
const BIN_DEG: f64 = 0.2;
/// So many revolutions are enough, and bound the memory.
const REVOLUTIONS_MAX: usize = 40;

/// The returns of some revolutions of one sensor.
#[derive(Debug, Default)]
pub struct Still {
    /// Direction, range, and the point in the sensor's frame.
    returns: Vec<(u32, f32, [f32; 3])>,
    revolutions: usize,
    azimuths: Option<Azimuths>,
}

impl Still {
    /// True when more revolutions tell nothing more.
    pub fn is_enough(&self) -> bool {
        self.revolutions >= REVOLUTIONS_MAX
    }

    /// Adds a revolution.
    pub fn take(&mut self, scan: &Scan) {
        if self.is_enough() {
            return;
        }
        self.revolutions += 1;
        let returns = &mut self.returns;
        let mut add = |point_m: DVec3, range_m: f32| {
            let azimuth_deg = point_m.y.atan2(point_m.x).to_degrees() + 180.0;
            let elevation_deg = (point_m.z / f64::from(range_m)).clamp(-1.0, 1.0).asin().to_degrees() + 90.0;
            let bin = |deg: f64| (deg / BIN_DEG) as u32;
            returns.push((
                bin(elevation_deg) << 16 | bin(azimuth_deg),
                range_m,
                point_m.as_vec3().to_array(),
            ));
        };
        match &scan.cloud {
            Cloud::Organised(image) => {
                let azimuths = self.azimuths.get_or_insert_with(Azimuths::of_a_turn);
                let beams = image.beams.len().max(1);
                for (i, &range_m) in image.range_m.iter().enumerate().filter(|(_, range_m)| **range_m > 0.0) {
                    let point_m = image.tabled_point_m(azimuths, i / beams, i % beams, f64::from(range_m));
                    add(point_m, point_m.length() as f32);
                }
            }
            Cloud::Unorganised(points) => {
                for point in points {
                    let point_m = DVec3::from(point.position_m.map(f64::from));
                    add(point_m, point_m.length() as f32);
                }
            }
        }
    }

    /// One point a direction, in the sensor's frame: that of the middle range, so that who passes by is none. Of two in the
    /// middle every other direction takes the nearer: the farther of both would lay the floor too low.
    pub fn points_m(mut self) -> Vec<DVec3> {
        self.returns.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let same = self.returns.chunk_by(|a, b| a.0 == b.0);
        let middle = |one: &[(u32, f32, [f32; 3])]| (one.len() - (one[0].0 & 1) as usize) / 2;
        same.map(|one| DVec3::from(one[middle(one)].2.map(f64::from))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::geometry::Pose;
    use umbracast::lidar::SensorPoint;

    /// Two revolutions, one range a centimetre above and one below: the mean over directions is the range.
    #[test]
    fn the_middle_of_an_even_count_is_not_the_farther() {
        let mut still = Still::default();
        for range_m in [7.99_f64, 8.01] {
            let at = |k: i32| SensorPoint {
                position_m: [
                    range_m * (0.0035 * f64::from(k)).cos(),
                    range_m * (0.0035 * f64::from(k)).sin(),
                    0.01,
                ]
                .map(|m| m as f32),
                time_ns: 0,
                reflectivity: 1.0,
            };
            let cloud = Cloud::Unorganised((0..400).map(at).collect());
            still.take(&Scan { sensor: 0, site_from_sensor: Pose::IDENTITY, cloud });
        }
        let points = still.points_m();
        let mean_m = points.iter().map(|point| point.length()).sum::<f64>() / points.len() as f64;
        assert!((mean_m - 8.0).abs() < 0.002, "{mean_m}");
    }

    #[test]
    fn who_passes_by_does_not_lie_still() {
        let mut still = Still::default();
        for k in 0..10 {
            let range_m = if k % 4 == 0 { 3.0 } else { 8.0 };
            let point = SensorPoint { position_m: [range_m, 0.01, 0.01], time_ns: 0, reflectivity: 1.0 };
            let cloud = Cloud::Unorganised(vec![point]);
            still.take(&Scan { sensor: 0, site_from_sensor: Pose::IDENTITY, cloud });
        }
        let points = still.points_m();
        assert!(points.len() == 1 && (points[0].x - 8.0).abs() < 1e-6, "{points:?}");
    }
}
