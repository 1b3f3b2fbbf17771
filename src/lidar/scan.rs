//! One revolution of one sensor, and one frame of all.

use std::sync::Arc;

use super::Beam;
use crate::geometry::{DVec3, Pose};

/// Hundredths of a degree.
const TURN_CDEG: i64 = 36_000;

/// All scans of one period. Frame k covers k/10 s to (k+1)/10 s and closes at its end.
///
/// ```
/// use umbracast::lidar::Frame;
///
/// // Frame 3 covers the time from 0.3 to 0.4 s and is given at its end.
/// let frame = Frame { index: 3, time_ns: 400_000_000, scans: Vec::new() };
/// assert_eq!(frame.time_ns, (frame.index as i64 + 1) * umbracast::STEP_NS);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Counts from 0 in each scene.
    pub index: u64,
    /// The instant the frame closes; truth and tracks are given at it.
    pub time_ns: i64,
    /// At most one scan a sensor, in the site's order of sensors.
    pub scans: Vec<Scan>,
}

/// What one sensor saw in one period.
///
/// ```
/// use umbracast::{Config, lidar::{Cloud, Scan, SensorPoint}};
///
/// let site_from_sensor = Config::default().site.sensors[0].site_from_sensor();
/// let ahead = SensorPoint { position_m: [14.0, 0.0, 0.0], time_ns: 0, reflectivity: 10.0 };
/// let scan = Scan { sensor: 0, site_from_sensor, cloud: Cloud::Unorganised(vec![ahead]) };
/// assert!(scan.site_from_sensor.point(umbracast::geometry::DVec3::new(14.0, 0.0, 0.0)).z < 1.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Which sensor of the site.
    pub sensor: usize,
    /// Where the sensor hangs.
    pub site_from_sensor: Pose,
    /// What it saw.
    pub cloud: Cloud,
}

/// The two kinds of clouds.
///
/// ```
/// use umbracast::lidar::{Cloud, SensorPoint};
///
/// let ahead = SensorPoint { position_m: [14.0, 0.0, 0.0], time_ns: 0, reflectivity: 10.0 };
/// let Cloud::Unorganised(points) = Cloud::Unorganised(vec![ahead]) else { unreachable!() };
/// assert_eq!(points.len(), 1);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Cloud {
    /// Beams by columns, as a spinning sensor fires them.
    Organised(RangeImage),
    /// Points in any order.
    Unorganised(Vec<SensorPoint>),
}

/// A revolution as a grid: columns in firing order, each with one range a beam.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let image = image();
/// // One column of an HDL-32E, every return 8 m away.
/// let (c, b) = (0, 31);
/// assert_eq!(image.range_m[c * image.beams.len() + b], 8.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RangeImage {
    /// The beams of a column, in firing order.
    pub beams: Arc<[Beam]>,
    /// The columns, in time order.
    pub columns: Vec<Column>,
    /// Range of `columns[c]`, `beams[b]` at `c * beams.len() + b`, metres; 0 where nothing came back.
    pub range_m: Vec<f32>,
    /// Reflectivity, in the same order.
    pub reflectivity: Vec<u8>,
}

/// One firing of all beams.
///
/// ```
/// use umbracast::lidar::Column;
///
/// // A head that turns ten times a second, to the right of straight ahead.
/// let column = Column { time_ns: 0, azimuth_cdeg: 9_000.0, azimuth_rate_cdeg_per_ns: 3.6e-4 };
/// assert!((column.azimuth_rate_cdeg_per_ns * 1e8 - 36_000.0).abs() < 0.1);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// When the first beam fired.
    pub time_ns: i64,
    /// Azimuth of the head, hundredths of a degree, clockwise from above.
    pub azimuth_cdeg: f32,
    /// How fast the head turns, hundredths of a degree a nanosecond.
    pub azimuth_rate_cdeg_per_ns: f32,
}

/// A point of an unorganised cloud.
///
/// ```
/// use umbracast::lidar::SensorPoint;
///
/// let point = SensorPoint { position_m: [3.0, 4.0, 0.0], time_ns: 0, reflectivity: 10.0 };
/// assert_eq!(point.position_m[0].hypot(point.position_m[1]), 5.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorPoint {
    /// In the sensor's frame, metres.
    pub position_m: [f32; 3],
    /// When it was measured; the frame's time where the file does not say.
    pub time_ns: i64,
    /// As the sensor gives it.
    pub reflectivity: f32,
}

/// Sine and cosine of every azimuth that a range image tells apart.
#[derive(Debug, Clone)]
pub struct Azimuths {
    /// By hundredths of a degree.
    sin_cos: Vec<(f64, f64)>,
}

impl Azimuths {
    /// All of a turn.
    pub fn of_a_turn() -> Self {
        Self { sin_cos: (0..TURN_CDEG as u32).map(azimuth_sin_cos).collect() }
    }

    /// None of an azimuth that is not within the turn.
    #[inline(always)]
    pub(super) fn get(&self, azimuth_cdeg: u64) -> Option<(f64, f64)> {
        self.sin_cos.get(azimuth_cdeg as usize).copied()
    }
}

fn azimuth_sin_cos(azimuth_cdeg: u32) -> (f64, f64) {
    (f64::from(azimuth_cdeg) * 0.01).to_radians().sin_cos()
}

impl RangeImage {
    /// Azimuth of the head when beam `b` of column `c` fires, hundredths of a degree in [0, 36000), rounded to a whole
    /// one; [`Beam`] says what the beam adds to it.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let image = image();
    /// // The last of 32 beams fires 35.7 us after the first: 0.13 degrees later.
    /// assert_eq!((image.azimuth_cdeg(0, 0), image.azimuth_cdeg(0, 31)), (9000, 9013));
    /// ```
    #[inline]
    pub fn azimuth_cdeg(&self, c: usize, b: usize) -> u32 {
        let column = &self.columns[c];
        let azimuth = column.azimuth_cdeg + column.azimuth_rate_cdeg_per_ns * self.beams[b].turned_ns as f32;
        // Rounds half away from zero as `round` does, which is a call where it is no instruction.
        let azimuth = f64::from(azimuth);
        let whole = (azimuth + 0.5_f64.copysign(azimuth)) as i64;
        // Nearly all are within the turn already.
        (if (0..TURN_CDEG).contains(&whole) { whole } else { whole.rem_euclid(TURN_CDEG) }) as u32
    }

    /// The point of beam `b` in column `c` at `range_m`, in the sensor's frame: where the manufacturer's decoder puts
    /// it, which rounds azimuths or does not.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let image = image();
    /// // Azimuth 90 degrees is to the right: y points to the left.
    /// assert!((image.point_m(0, 15, 8.0).y + 8.0).abs() < 0.01);
    /// ```
    #[inline]
    pub fn point_m(&self, c: usize, b: usize, range_m: f64) -> DVec3 {
        let beam = &self.beams[b];
        let head_sin_cos = match beam.whole_cdeg {
            true => azimuth_sin_cos(self.azimuth_cdeg(c, b)),
            false => self.exact_sin_cos(c, b),
        };
        beam.point_m(head_sin_cos, range_m)
    }

    /// The same point, to the last bit, where there are many.
    #[doc(hidden)] // See `Azimuths`.
    #[inline]
    pub fn tabled_point_m(&self, azimuths: &Azimuths, c: usize, b: usize, range_m: f64) -> DVec3 {
        self.beams[b].point_m(self.head_sin_cos(azimuths, c, b), range_m)
    }

    /// Of the head's azimuth when beam `b` of column `c` fires, rounded or not.
    #[inline]
    pub(super) fn head_sin_cos(&self, azimuths: &Azimuths, c: usize, b: usize) -> (f64, f64) {
        match self.beams[b].whole_cdeg {
            true => azimuths.sin_cos[self.azimuth_cdeg(c, b) as usize],
            false => self.exact_sin_cos(c, b),
        }
    }

    /// Of the head's azimuth without rounding.
    fn exact_sin_cos(&self, c: usize, b: usize) -> (f64, f64) {
        let column = &self.columns[c];
        let turned_cdeg = f64::from(column.azimuth_rate_cdeg_per_ns) * f64::from(self.beams[b].turned_ns);
        ((f64::from(column.azimuth_cdeg) + turned_cdeg) * 0.01).to_radians().sin_cos()
    }

    /// When beam `b` of column `c` fired.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let image = image();
    /// assert_eq!(image.time_ns(0, 31), 5 + 31 * 1152);
    /// ```
    #[inline]
    pub fn time_ns(&self, c: usize, b: usize) -> i64 {
        self.columns[c].time_ns + i64::from(self.beams[b].fire_offset_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::Model;

    #[test]
    fn tabled_points_are_the_computed_ones_to_the_last_bit() {
        let column =
            |i| Column { time_ns: 0, azimuth_cdeg: i as f32 * 7.3, azimuth_rate_cdeg_per_ns: 3.6e-4 };
        let columns: Vec<Column> = (0..5000).map(column).collect();
        let azimuths = Azimuths::of_a_turn();
        for model in ["hdl-32e", "os0-32", "xt32"] {
            let beams = Model::by_name(model).unwrap().beams;
            let rays = columns.len() * beams.len();
            let (range_m, reflectivity) = (vec![0.0; rays], vec![0; rays]);
            let image = RangeImage { beams, columns: columns.clone(), range_m, reflectivity };
            for (c, b) in (0..image.columns.len()).map(|c| (c, c % image.beams.len())) {
                assert_eq!(image.tabled_point_m(&azimuths, c, b, 12.34), image.point_m(c, b, 12.34));
            }
        }
    }

    #[test]
    fn halves_of_an_azimuth_are_rounded_away_from_zero_and_a_turn_is_none() {
        let azimuth_cdeg = |azimuth_cdeg| {
            let columns = vec![Column { time_ns: 0, azimuth_cdeg, azimuth_rate_cdeg_per_ns: 0.0 }];
            let beams = Model::vlp_16().beams;
            RangeImage { beams, columns, range_m: vec![], reflectivity: vec![] }.azimuth_cdeg(0, 0)
        };
        let found = [0.499_999_97, 0.5, 2.5, -0.5, 35_999.5, 36_001.0].map(azimuth_cdeg);
        assert_eq!(found, [0, 1, 3, 35_999, 0, 1]);
    }
}
