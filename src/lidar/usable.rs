//! What of a frame can be used: numbers that cannot be are left out before the first stage, so that no stage has to ask.

use std::borrow::Cow;

use super::model::TIME_LIMIT_NS;
use super::{Cloud, Frame, RangeImage, Scan};
use crate::Health;
use crate::geometry::{DMat3, DVec3, Pose};

/// No sensor hangs farther from the site's origin: that of the far end of a map in UTM.
const FAR_M: f64 = 1e7;
/// No beam starts farther from the middle of its sensor.
const BEAM_M: f64 = 100.0;
/// An entry of a rotation and of a direction is 1 at most, but for rounding.
const ONE: f64 = 1.001;

impl Frame {
    /// The frame as it is, or without the scans and points that cannot be used: of an organised scan one that has not a range and a
    /// reflectivity for every column and beam, or a pose, beam or column that is not finite or lies beyond any hall and time; of
    /// another scan the points whose numbers are so. Their returns are counted as `points_invalid`.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let mut frame = ray(0, 8.0);
    /// use umbracast::{Health, geometry::DVec3};
    ///
    /// let mut health = Health::default();
    /// assert_eq!(*frame.usable(&mut health), frame);
    /// frame.scans[0].site_from_sensor.translation_m = DVec3::NAN;
    /// assert!(frame.usable(&mut health).scans.is_empty() && health.points_invalid == 1);
    /// ```
    pub fn usable(&self, health: &mut Health) -> Cow<'_, Self> {
        if self.scans.iter().all(|scan| is_usable(scan) && all_points_are(scan)) {
            return Cow::Borrowed(self);
        }
        let mut scans = Vec::new();
        for scan in &self.scans {
            let mut kept = scan.clone();
            let before = returns(&kept.cloud);
            if let Cloud::Unorganised(points) = &mut kept.cloud {
                points
                    .retain(|point| is_time(point.time_ns) && point.position_m.iter().all(|m| m.is_finite()));
            }
            let usable = is_usable(scan);
            let left = if usable { returns(&kept.cloud) } else { 0 };
            health.points_invalid += (before - left) as u64;
            scans.extend(usable.then_some(kept));
        }
        Cow::Owned(Self { scans, ..*self })
    }
}

/// Whether a time is one: below it sums of times cannot overflow.
pub fn is_time(time_ns: i64) -> bool {
    time_ns.unsigned_abs() < TIME_LIMIT_NS
}

fn returns(cloud: &Cloud) -> usize {
    match cloud {
        Cloud::Organised(image) => image.range_m.len(),
        Cloud::Unorganised(points) => points.len(),
    }
}

fn all_points_are(scan: &Scan) -> bool {
    match &scan.cloud {
        Cloud::Organised(_) => true,
        Cloud::Unorganised(points) => points
            .iter()
            .all(|point| is_time(point.time_ns) && point.position_m.iter().all(|m| m.is_finite())),
    }
}

fn is_usable(scan: &Scan) -> bool {
    let Pose { rotation, translation_m } = &scan.site_from_sensor;
    let posed = is_turn(rotation) && is_within(*translation_m, FAR_M);
    posed && !matches!(&scan.cloud, Cloud::Organised(image) if !hangs_together(image))
}

fn hangs_together(image: &RangeImage) -> bool {
    let RangeImage { beams, columns, range_m, reflectivity } = image;
    let rays = beams.len() * columns.len();
    let beams_are = beams.iter().all(|beam| {
        beam.elevation_rad.is_finite()
            && beam.azimuth_offset_cdeg.is_finite()
            && is_within(beam.origin_m, BEAM_M)
            && is_within(beam.direction, ONE)
    });
    let columns_are = || {
        columns.iter().all(|column| {
            is_time(column.time_ns)
                && column.azimuth_cdeg.is_finite()
                && column.azimuth_rate_cdeg_per_ns.is_finite()
        })
    };
    !beams.is_empty() && range_m.len() == rays && reflectivity.len() == rays && beams_are && columns_are()
}

fn is_turn(rotation: &DMat3) -> bool {
    rotation.to_cols_array().iter().all(|entry| entry.abs() <= ONE)
}

/// False for what is not a number, too.
fn is_within(v: DVec3, most: f64) -> bool {
    v.abs().cmple(DVec3::splat(most)).all()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::lidar::{Column, Model, SensorPoint};

    fn frame(cloud: Cloud) -> Frame {
        Frame {
            index: 0,
            time_ns: 100,
            scans: vec![Scan { sensor: 0, site_from_sensor: Pose::IDENTITY, cloud }],
        }
    }

    /// What a scan of two columns of a VLP-16 with this change loses.
    fn lost(change: impl Fn(&mut RangeImage)) -> u64 {
        let column = Column { time_ns: 5, azimuth_cdeg: 90.0, azimuth_rate_cdeg_per_ns: 3.6e-4 };
        let beams = Model::vlp_16().beams;
        let mut image =
            RangeImage { beams, columns: vec![column; 2], range_m: vec![8.0; 32], reflectivity: vec![9; 32] };
        change(&mut image);
        let mut health = Health::default();
        let frame = frame(Cloud::Organised(image));
        let left = frame.usable(&mut health);
        assert_eq!(left.scans.is_empty(), health.points_invalid > 0);
        health.points_invalid
    }

    /// A scan without beams once divided by zero, one with fewer columns than ranges left the list of columns.
    #[test]
    fn a_scan_whose_numbers_do_not_hang_together_is_left_out_and_counted() {
        assert_eq!(lost(|_| {}), 0);
        assert_eq!(
            lost(|image| image.range_m[3] = f32::NAN),
            0,
            "a range alone is the background's to leave out"
        );
        assert_eq!(lost(|image| image.beams = Arc::from([])), 32);
        assert_eq!(lost(|image| image.columns.truncate(1)), 32);
        assert_eq!(lost(|image| image.range_m.truncate(20)), 20);
        assert_eq!(lost(|image| image.reflectivity.truncate(20)), 32);
        assert_eq!(lost(|image| image.columns[1].time_ns = i64::MIN), 32);
        assert_eq!(lost(|image| image.columns[1].azimuth_cdeg = f32::INFINITY), 32);
        let beam = |change: fn(&mut crate::lidar::Beam)| {
            lost(|image| {
                let mut beams = image.beams.to_vec();
                change(&mut beams[4]);
                image.beams = beams.into();
            })
        };
        assert_eq!(beam(|beam| beam.direction.x = 1e300), 32);
        assert_eq!(beam(|beam| beam.origin_m.z = f64::NAN), 32);
    }

    #[test]
    fn a_point_that_is_none_is_left_out_and_counted() {
        let point =
            |x_m: f32, time_ns: i64| SensorPoint { position_m: [x_m, 0.0, 0.0], time_ns, reflectivity: 0.0 };
        let points = [point(1.0, 7), point(f32::NAN, 7), point(1.0, i64::MAX)];
        let (mut health, frame) = (Health::default(), frame(Cloud::Unorganised(points.to_vec())));
        let left = frame.usable(&mut health);
        let Cloud::Unorganised(left) = &left.scans[0].cloud else { panic!() };
        assert_eq!((left.as_slice(), health.points_invalid), (&points[..1], 2));
    }
}
