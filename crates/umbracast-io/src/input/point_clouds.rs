//! Recordings of `sensor_msgs/PointCloud2`, for a site with one sensor of model `points`: each cloud is a frame.

use umbracast::lidar::{Cloud, Frame, Scan, sensor_model};
use umbracast::{Error, Health, STEP_NS, Site};

use super::sink::Sink;
use crate::point_cloud::{self, PointCloud};
use crate::recording::{Entry, RecordingReader, topic_of};

/// Whether a site's input is the clouds of one sensor.
pub fn are_all_of(site: &Site) -> bool {
    matches!(&site.sensors[..], [sensor] if sensor_model(&sensor.model) == Some("points"))
}

/// Gives a frame for each cloud of the sensor's topic: `/NAME/points` or `/NAME` of a sensor NAME.
pub fn recording(
    reader: &mut RecordingReader,
    site: &Site,
    health: &mut Health,
    sink: Sink,
) -> Result<(), Error> {
    let sensor = &site.sensors[0];
    let (mut frames, own) = (Numbers::default(), topic_of(site, 0));
    while let Some(entry) = reader.next_entry()? {
        let Entry::Cloud(topic, message) = entry else { continue };
        let name = topic.trim_start_matches('/');
        let name = name.strip_suffix("/points").unwrap_or(name);
        if ![&sensor.name, &own].iter().any(|own| own.trim_start_matches('/') == name) {
            continue;
        }
        let Some(cloud) = point_cloud::read(&message) else {
            health.packets_not_understood += 1;
            continue;
        };
        health.points_invalid += cloud.dropped;
        let Some((index, time_ns)) = frames.next(&cloud) else {
            health.packets_late += 1;
            continue;
        };
        let cloud = Cloud::Unorganised(cloud.points);
        let scan = Scan { sensor: 0, site_from_sensor: sensor.site_from_sensor(), cloud };
        sink(&Frame { index, time_ns, scans: vec![scan] })?;
    }
    Ok(())
}

/// Numbers of frames, from the times of clouds that come about every 100 ms.
#[derive(Debug, Default)]
struct Numbers {
    /// When the first cloud was over.
    first_ns: Option<i64>,
    last: Option<i64>,
}

impl Numbers {
    /// Number and time of a cloud's frame, which closes with its last point; none for a cloud of a frame that was
    /// given already, and for a time that is out of this world.
    fn next(&mut self, cloud: &PointCloud) -> Option<(u64, i64)> {
        let over_ns = cloud.points.iter().map(|point| point.time_ns).max().unwrap_or(cloud.stamp_ns);
        let first_ns = self.first_ns.unwrap_or(over_ns);
        let after_ns = over_ns.checked_sub(first_ns)?.checked_add(STEP_NS / 2)?;
        let number = after_ns.div_euclid(STEP_NS);
        if number < 0 || self.last.is_some_and(|last| number <= last) {
            return None;
        }
        let time_ns = first_ns.checked_add(number * STEP_NS)?;
        (self.first_ns, self.last) = (Some(first_ns), Some(number));
        Some((number as u64, time_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clouds_are_numbered_by_their_times_and_what_comes_twice_is_left_out() {
        let start_ns = 1_700_000_000_123_456_789;
        let mut numbers = Numbers::default();
        let mut number = |after_ms: i64| {
            let stamp_ns = start_ns + after_ms * 1_000_000;
            let cloud = PointCloud { stamp_ns, frame_id: String::new(), points: Vec::new(), dropped: 0 };
            numbers.next(&cloud).map(|(number, time_ns)| (number, (time_ns - start_ns) / 1_000_000))
        };
        // Jitter, a cloud twice, one from the past, one that is missing, a clock that leaps beyond all.
        let found = [0, 97, 204, 204, 100, 401, i64::MAX / 1_000_000 - 1_700_000_000_200].map(&mut number);
        assert_eq!(found[..6], [Some((0, 0)), Some((1, 100)), Some((2, 200)), None, None, Some((4, 400))]);
        assert!(found[6].is_none_or(|(number, _)| number > 4));
    }
}
