//! The whole scan for somebody who checks a mounting: kept only while somebody asks, and encoded by whoever asks.
//!
//! The pipeline's thread reads one number. While that number says that nobody asks, it does nothing else; otherwise it
//! leaves the frame here, which it would have thrown away.

use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use umbracast::geometry::DVec3;
use umbracast::lidar::{Cloud, Scan};
use umbracast::{Frame, Site};

/// So many points of a frame are sent: every n-th is kept.
pub const POINTS_SENT: usize = 30_000;
/// Bytes before the first point: frame, then where the points count from (x, y, z in metres).
pub const HEAD_BYTES: usize = 32;
/// Of a point: x, y, z in centimetres, sensor, reflectivity.
pub const POINT_BYTES: usize = 8;
/// Nobody has asked for so long: nobody looks.
const LOOKS_NS: i64 = 2_000_000_000;

/// Where the newest frame is left while somebody asks for it.
#[derive(Debug, Default)]
pub struct Whole {
    /// Until when frames are wanted, host time.
    until_ns: AtomicI64,
    newest: Mutex<Option<Arc<Frame>>>,
}

impl Whole {
    /// Leaves a frame, if somebody asks for it. Called on the pipeline's thread.
    pub fn give(&self, frame: Frame, now_ns: i64) {
        if now_ns < self.until_ns.load(Ordering::Relaxed) {
            let before = self.newest.lock().unwrap_or_else(PoisonError::into_inner).replace(Arc::new(frame));
            drop(before); // Not while the lock is held.
        }
    }

    /// The newest frame, and the next ones for two seconds; `None` where none has come since somebody began to ask.
    pub fn ask(&self, now_ns: i64) -> Option<Arc<Frame>> {
        let before_ns = self.until_ns.swap(now_ns + LOOKS_NS, Ordering::Relaxed);
        let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        if before_ns < now_ns {
            *newest = None; // Of somebody who looked long ago.
        }
        newest.clone()
    }
}

/// A frame as bytes, little-endian, thinned to [`POINTS_SENT`]: its number (u64), where its points count from (three f64,
/// metres), then for each point x, y, z (i16, centimetres), sensor (u8) and reflectivity (u8). Points beyond 327 m from
/// there are left out.
pub fn encoded(frame: &Frame, from_m: DVec3) -> Vec<u8> {
    let all: usize = frame.scans.iter().map(returns).sum();
    let every = all.div_ceil(POINTS_SENT).max(1);
    let mut bytes = Vec::with_capacity(HEAD_BYTES + POINT_BYTES * (all / every + 1));
    bytes.extend(frame.index.to_le_bytes());
    from_m.to_array().iter().for_each(|m| bytes.extend(m.to_le_bytes()));
    let mut number = 0;
    for scan in &frame.scans {
        let sensor = scan.sensor.min(usize::from(u8::MAX)) as u8;
        let mut put = |in_sensor_m: DVec3, reflectivity: u8| {
            let cm = ((scan.site_from_sensor.point(in_sensor_m) - from_m) * 100.0).round();
            if cm.abs().max_element() <= f64::from(i16::MAX) {
                cm.to_array().iter().for_each(|&cm| bytes.extend((cm as i16).to_le_bytes()));
                bytes.extend([sensor, reflectivity]);
            }
        };
        match &scan.cloud {
            Cloud::Organised(image) => {
                for (i, &range_m) in image.range_m.iter().enumerate().filter(|(_, range_m)| **range_m > 0.0) {
                    number += 1;
                    if number % every == 0 {
                        let (c, b) = (i / image.beams.len(), i % image.beams.len());
                        put(image.point_m(c, b, f64::from(range_m)), image.reflectivity[i]);
                    }
                }
            }
            Cloud::Unorganised(points) => {
                for point in points {
                    number += 1;
                    if number % every == 0 {
                        let reflectivity = point.reflectivity.clamp(0.0, 255.0) as u8;
                        put(DVec3::from_array(point.position_m.map(f64::from)), reflectivity);
                    }
                }
            }
        }
    }
    bytes
}

/// Where the points of a site's scans count from: whole metres at the middle of the hall.
pub fn middle_m(site: &Site) -> DVec3 {
    site.hall.middle_m().round().extend(0.0)
}

fn returns(scan: &Scan) -> usize {
    match &scan.cloud {
        Cloud::Organised(image) => image.range_m.iter().filter(|range_m| **range_m > 0.0).count(),
        Cloud::Unorganised(points) => points.len(),
    }
}

#[cfg(test)]
mod tests {
    use umbracast::geometry::Pose;
    use umbracast::lidar::SensorPoint;

    use super::*;

    fn frame(points: usize) -> Frame {
        let point =
            |i| SensorPoint { position_m: [i as f32 * 0.001, -2.5, 1.0], time_ns: 0, reflectivity: 300.0 };
        let cloud = Cloud::Unorganised((0..points).map(point).collect());
        let scans = vec![Scan { sensor: 1, site_from_sensor: Pose::IDENTITY, cloud }];
        Frame { index: 7, time_ns: 800_000_000, scans }
    }

    #[test]
    fn a_frame_is_kept_only_while_somebody_asks() {
        let whole = Whole::default();
        whole.give(frame(1), 1);
        assert!(whole.ask(10).is_none(), "nobody had asked");
        whole.give(frame(1), 20);
        assert_eq!(whole.ask(30).unwrap().index, 7);
        whole.give(frame(1), 30 + LOOKS_NS);
        assert!(whole.ask(40 + LOOKS_NS).is_none(), "what was left for somebody long ago is not shown");
    }

    #[test]
    fn a_scan_is_thinned_bounded_and_in_centimetres() {
        let bytes = encoded(&frame(100_000), DVec3::new(1.0, 0.0, 0.0));
        let points = (bytes.len() - HEAD_BYTES) / POINT_BYTES;
        assert!((POINTS_SENT * 3 / 4..=POINTS_SENT).contains(&points), "{points}");
        assert_eq!(bytes[..8], 7_u64.to_le_bytes());
        // The fourth point is the first that is kept.
        let first = &bytes[HEAD_BYTES..HEAD_BYTES + POINT_BYTES];
        let cm: Vec<i16> = first[..6].chunks(2).map(|two| i16::from_le_bytes([two[0], two[1]])).collect();
        assert_eq!((cm, first[6], first[7]), (vec![-100, -250, 100], 1, 255));
        let far = encoded(&frame(10), DVec3::new(1000.0, 0.0, 0.0));
        assert_eq!(far.len(), HEAD_BYTES, "beyond 16 bits");
    }
}
