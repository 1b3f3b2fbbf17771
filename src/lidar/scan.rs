//! One revolution of one sensor, and one frame of all.

use std::sync::Arc;

use super::Beam;
use crate::geometry::{DVec3, Pose};

/// All scans of one period. Frame k covers k/10 s to (k+1)/10 s and closes at its end.
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
#[derive(Debug, Clone, PartialEq)]
pub enum Cloud {
    /// Beams by columns, as a spinning sensor fires them.
    Organised(RangeImage),
    /// Points in any order.
    Unorganised(Vec<SensorPoint>),
}

/// A revolution as a grid: columns in firing order, each with one range a beam.
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// When the first beam fired.
    pub time_ns: i64,
    /// Azimuth of the first beam, hundredths of a degree, clockwise from above.
    pub azimuth_cdeg: f32,
    /// How fast the head turns, hundredths of a degree a nanosecond.
    pub azimuth_rate_cdeg_per_ns: f32,
}

/// A point of an unorganised cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorPoint {
    /// In the sensor's frame, metres.
    pub position_m: [f32; 3],
    /// When it was measured; the frame's time where the file does not say.
    pub time_ns: i64,
    /// As the sensor gives it.
    pub reflectivity: f32,
}

impl RangeImage {
    /// Azimuth of beam `b` in column `c`, hundredths of a degree in [0, 36000), rounded to a whole one as the
    /// manufacturer's decoder does.
    pub fn azimuth_cdeg(&self, c: usize, b: usize) -> u32 {
        let column = &self.columns[c];
        let azimuth =
            column.azimuth_cdeg + column.azimuth_rate_cdeg_per_ns * self.beams[b].fire_offset_ns as f32;
        (azimuth.round() as i64).rem_euclid(36_000) as u32
    }

    /// The point of beam `b` in column `c` at `range_m`, in the sensor's frame.
    pub fn point_m(&self, c: usize, b: usize, range_m: f64) -> DVec3 {
        let azimuth_rad = (f64::from(self.azimuth_cdeg(c, b)) * 0.01).to_radians();
        self.beams[b].point_m(azimuth_rad, range_m)
    }

    /// When beam `b` of column `c` fired.
    pub fn time_ns(&self, c: usize, b: usize) -> i64 {
        self.columns[c].time_ns + i64::from(self.beams[b].fire_offset_ns)
    }
}
