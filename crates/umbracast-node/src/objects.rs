//! Lists of another perception system as frames, in place of front ends. Pure: the caller gives the time of day.

use umbracast::lidar::{View, Views};
use umbracast::{Health, STEP_NS, Site, site};
use umbracast_io::objects::{self, ObjectList};

use crate::join::Joined;

/// When nothing that could be used has come for so long, another source and another time are taken as they come.
const SILENCE_NS: i64 = 1_000_000_000;

/// Takes the lists of one source and gives frames in order of time.
#[derive(Debug)]
pub struct Lists {
    hall: site::Hall,
    /// Where the sensors hang, whose beams nobody told.
    views: Vec<View>,
    source: String,
    last_ns: Option<i64>,
    /// When a list was used last.
    used_ns: i64,
    health: Health,
}

impl Lists {
    /// For a site.
    pub fn new(site: &Site) -> Self {
        let view = |(sensor, s): (usize, &umbracast::site::Sensor)| View {
            sensor,
            site_from_sensor: s.site_from_sensor(),
            fan: None,
        };
        Self {
            hall: site.hall.clone(),
            views: site.sensors.iter().enumerate().map(view).collect(),
            source: String::new(),
            last_ns: None,
            used_ns: i64::MIN,
            health: Health::default(),
        }
    }

    /// The next list is taken whatever its time and source.
    pub fn begin_anew(&mut self) {
        (self.last_ns, self.used_ns) = (None, i64::MIN);
    }

    /// The frame of a list: that of the nearest tenth of a second. None for a list of a frame that was given already, and
    /// for one of another source while the first one speaks.
    pub fn joined(&mut self, source: &str, list: &ObjectList, now_ns: i64) -> Option<Joined> {
        let silent = now_ns.saturating_sub(self.used_ns) > SILENCE_NS;
        let time_ns = list.time_ns.checked_add(STEP_NS / 2)?.div_euclid(STEP_NS).checked_mul(STEP_NS)?;
        if !silent && source != self.source {
            return None;
        }
        if !silent && self.last_ns.is_some_and(|last_ns| time_ns <= last_ns) {
            self.health.packets_late += 1;
            return None;
        }
        (self.last_ns, self.used_ns) = (Some(time_ns), now_ns);
        source.clone_into(&mut self.source);
        let (mut tracks, mut detections) = (None, None);
        let none = if list.tracked {
            let (found, none) = objects::tracks(list, time_ns, &self.hall);
            tracks = Some(found);
            none
        } else {
            let (found, none) = objects::detections(list, time_ns);
            detections = Some(found);
            none
        };
        self.health.points_invalid = self.health.points_invalid.saturating_add(none);
        Some(Joined {
            views: Views { time_ns, of_scans: self.views.clone() },
            health: self.health,
            closed_ns: now_ns,
            anew: silent,
            detections,
            tracks,
            ..Joined::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;
    use umbracast_io::objects::Object;

    const S: i64 = 1_000_000_000;

    fn list(time_ns: i64, x_m: f64) -> ObjectList {
        let object = Object {
            id: 7.into(),
            position_m: vec![x_m, 0.0],
            size_m: Some([0.4, 0.6, 1.7]),
            velocity_mps: vec![1.0, 0.0],
            heading_rad: None,
            sigma_m: None,
        };
        ObjectList { time_ns, tracked: false, objects: vec![object] }
    }

    #[test]
    fn lists_become_frames_of_tenths_of_a_second_each_once() {
        let mut lists = Lists::new(&Config::default().site);
        let first = lists.joined("east", &list(20 * S + 30_000_000, 1.0), 7).unwrap();
        assert_eq!((first.views.time_ns, first.closed_ns, first.anew), (20 * S, 7, true));
        assert!((first.detections.unwrap()[0].position_m.x - 0.97).abs() < 1e-9, "moved to the frame's end");
        assert_eq!(first.views.of_scans.len(), 2);
        assert!(lists.joined("east", &list(20 * S + 40_000_000, 1.0), 8).is_none(), "the same frame");
        assert!(lists.joined("west", &list(21 * S, 1.0), 9).is_none(), "another source");
        let next = lists.joined("east", &list(20 * S + 130_000_000, 1.1), 10).unwrap();
        assert_eq!(
            (next.views.time_ns - 20 * S, next.anew, next.health.packets_late),
            (100_000_000, false, 1)
        );
        let other = lists.joined("west", &list(5 * S, 1.0), 3 * S).unwrap();
        assert!(other.anew && other.views.time_ns == 5 * S, "once the first is silent");
        assert!(lists.joined("west", &list(i64::MAX, 1.0), 3 * S).is_none());
    }
}
