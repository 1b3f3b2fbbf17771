//! What numbers from outside may be: places that the hall's sensors reach, and as many as the hall can give. Whoever may send can
//! send anything; a number that passes here costs no more than a full hall does.

use std::collections::BTreeMap;

use umbracast::Site;
use umbracast::geometry::{DVec2, DVec3, Pose};
use umbracast_io::nodes::{Followed, Foreground, Priors};
use umbracast_io::objects::ObjectList;

/// A sensor may hang so far from where the site file says: it is put right while the program runs.
const MOVED_M: f64 = 5.0;
/// Somebody may be seen so far outside of the hall's outline, through its doors.
const OUTSIDE_M: f64 = 10.0;
/// Most points of one sensor in one frame, as `umbracast::detect` keeps them.
const POINTS_MAX: usize = 40_000;
/// Beams of the largest sensor that is sold, twice.
const BEAMS_MAX: usize = 256;
/// People on a square metre in a crowd that can still walk (Fruin's level of service E), and
const PEOPLE_PER_M2: f64 = 2.0;
/// the most that a node follows in time; see `docs/SCALE.md`.
const PEOPLE_MAX: usize = 1000;
/// A point is measured within its frame, and the sensors' clocks may be this far apart.
const APART_NS: u64 = 1_000_000_000;
/// No stage works on a frame for so long.
const TOOK_MAX_NS: i64 = 60_000_000_000;
/// Terms have not so many bits. See [`crate::terms`].
const TERM_BITS: u32 = 44;
/// What was refused is told for so long.
const TOLD_NS: i64 = 10_000_000_000;
/// Senders that are told apart, and letters of a name that are told.
const SENDERS_MAX: usize = 32;
const NAME_MAX: usize = 64;

/// What of a message is out of bounds.
pub type Refusal = &'static str;

/// What a hall can be.
#[derive(Debug, Clone)]
pub struct Bounds {
    /// Where each sensor hangs, and how far from there its points may be, metres.
    sensors: Vec<(DVec3, f64)>,
    /// Corners of a box about the hall.
    hall_m: [DVec2; 2],
    people: usize,
}

impl Bounds {
    /// Of a site.
    pub fn new(site: &Site) -> Self {
        let reach = |sensor: &umbracast::site::Sensor| {
            (DVec3::from_array(sensor.position_m), sensor.range_max_m + MOVED_M)
        };
        let [least_m, most_m] = site.hall.bounds_m();
        let size_m = most_m - least_m;
        Self {
            sensors: site.sensors.iter().map(reach).collect(),
            hall_m: [least_m - OUTSIDE_M, most_m + OUTSIDE_M],
            people: ((size_m.x * size_m.y * PEOPLE_PER_M2) as usize).clamp(1, PEOPLE_MAX),
        }
    }

    /// Most people that the hall holds.
    pub fn people(&self) -> usize {
        self.people
    }

    /// What a front end says, whose places are of this site's sensors.
    ///
    /// # Errors
    /// What is out of bounds.
    pub fn foreground(&self, message: &Foreground) -> Result<(), Refusal> {
        let covers = |sensor: usize| message.covers.iter().any(|&s| s as usize == sensor);
        let sensors = self.sensors.len();
        if message.covers.is_empty() || message.covers.iter().any(|&s| s as usize >= sensors) {
            return Err("sensors that the site has not");
        }
        if message.covers.len() > sensors || message.views.len() > message.covers.len() {
            return Err("more sensors than there are");
        }
        if message.points.len() > POINTS_MAX * message.covers.len() {
            return Err("more points than a sensor gives");
        }
        for view in &message.views {
            let beams = view.fan.as_ref().map_or(&[][..], |fan| &fan.elevations_rad);
            if !covers(view.sensor) || beams.len() > BEAMS_MAX || !beams.iter().all(|beam| beam.is_finite()) {
                return Err("beams that no sensor has");
            }
            let (place_m, _) = self.sensors[view.sensor];
            if !is_turn(&view.site_from_sensor)
                || !is_within(view.site_from_sensor.translation_m.distance(place_m), MOVED_M)
            {
                return Err("a sensor elsewhere than the site says");
            }
        }
        for point in &message.points {
            let sensor = usize::from(point.sensor);
            if !covers(sensor) {
                return Err("points of another sensor");
            }
            let (place_m, reach_m) = self.sensors[sensor];
            // Not a number is no less than anything.
            if !is_within(point.position_m.distance(place_m), reach_m) {
                return Err("points out of the sensor's reach");
            }
            if point.time_ns.abs_diff(message.time_ns) > APART_NS {
                return Err("points of another time");
            }
        }
        is_span(message.took_ns)
    }

    /// Where people are expected.
    ///
    /// # Errors
    /// What is out of bounds.
    pub fn priors(&self, priors: &Priors) -> Result<(), Refusal> {
        let is_near = |prior: &umbracast::detect::Prior| {
            self.is_near(prior.position_m)
                && prior.velocity_mps.is_finite()
                && prior.position_sigma_m.is_finite()
                && prior.height_m.is_finite()
        };
        match () {
            () if priors.term >> TERM_BITS != 0 => Err("a term that nobody comes to"),
            () if priors.priors.len() > self.people => Err("more people than the hall holds"),
            () if !priors.priors.iter().all(is_near) => Err("people out of reach"),
            () => Ok(()),
        }
    }

    /// Everybody followed.
    ///
    /// # Errors
    /// What is out of bounds.
    pub fn followed(&self, followed: &Followed) -> Result<(), Refusal> {
        let is_near = |track: &umbracast::track::Track| {
            self.is_near(track.position_m) && track.velocity_mps.is_finite() && track.height_m.is_finite()
        };
        let sensors = self.sensors.len();
        match () {
            () if followed.term >> TERM_BITS != 0 => Err("a term that nobody comes to"),
            () if followed.tracks.len() > self.people => Err("more people than the hall holds"),
            () if !followed.tracks.iter().all(is_near) => Err("people out of reach"),
            () if followed.sensors.len() > sensors => Err("more sensors than there are"),
            () => is_span(followed.took_ns),
        }
    }

    /// Leaves out of a list what is out of reach, and who is more than the hall holds.
    ///
    /// # Errors
    /// What was left out.
    pub fn objects(&self, list: &mut ObjectList) -> Result<(), Refusal> {
        let all = list.objects.len();
        list.objects.retain(|object| match object.position_m[..] {
            [x_m, y_m, ..] => self.is_near(DVec2::new(x_m, y_m)),
            _ => false,
        });
        let near = list.objects.len();
        list.objects.truncate(self.people);
        match near {
            _ if near < all => Err("objects out of reach"),
            _ if list.objects.len() < near => Err("more people than the hall holds"),
            _ => Ok(()),
        }
    }

    /// Within the hall and some way about it, or within reach of a sensor.
    fn is_near(&self, place_m: DVec2) -> bool {
        let [least_m, most_m] = self.hall_m;
        place_m.cmpge(least_m).all() && place_m.cmple(most_m).all()
            || self
                .sensors
                .iter()
                .any(|(sensor_m, reach_m)| place_m.distance(sensor_m.truncate()) <= *reach_m)
    }
}

/// Whether a pose turns and does nothing else.
fn is_turn(pose: &Pose) -> bool {
    let turned = pose.rotation * pose.rotation.transpose();
    turned.abs_diff_eq(umbracast::geometry::DMat3::IDENTITY, 1e-6)
}

fn is_span(took_ns: i64) -> Result<(), Refusal> {
    if (0..=TOOK_MAX_NS).contains(&took_ns) { Ok(()) } else { Err("a time that no stage takes") }
}

/// What is no number is not within anything.
fn is_within(distance_m: f64, most_m: f64) -> bool {
    distance_m <= most_m
}

/// What was refused, by sender.
#[derive(Debug, Default)]
pub struct Refused {
    /// How many messages, and when the last of them came.
    of: BTreeMap<(String, String), (u64, i64)>,
    /// All.
    pub count: u64,
}

impl Refused {
    /// Counts a message.
    pub fn note(&mut self, sender: &str, why: &str, now_ns: i64) {
        self.count += 1;
        self.of.retain(|_, (_, last_ns)| now_ns - *last_ns < TOLD_NS);
        let key = (sender.chars().take(NAME_MAX).collect(), why.to_owned());
        if self.of.len() < SENDERS_MAX || self.of.contains_key(&key) {
            let (count, last_ns) = self.of.entry(key).or_default();
            (*count, *last_ns) = (*count + 1, now_ns);
        }
    }

    /// In words, what was refused of late.
    pub fn words(&self, now_ns: i64) -> Vec<String> {
        let late = self.of.iter().filter(|(_, (_, last_ns))| now_ns - last_ns < TOLD_NS);
        late.map(|((sender, why), (count, _))| format!("{sender}: {why} ({count} refused)")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;
    use umbracast::detect::Point;
    use umbracast::lidar::View;
    use umbracast_io::objects;

    fn foreground(points: &[DVec3]) -> Foreground {
        let site_from_sensor = Config::default().site.sensors[0].site_from_sensor();
        Foreground {
            time_ns: 5,
            covers: vec![0],
            views: vec![View { sensor: 0, site_from_sensor, fan: None }],
            points: points.iter().map(|&position_m| Point { position_m, time_ns: 0, sensor: 0 }).collect(),
            ..Foreground::default()
        }
    }

    #[test]
    fn two_points_at_a_trillion_metres_are_refused_and_those_of_a_hall_are_not() {
        let bounds = Bounds::new(&Config::default().site);
        assert_eq!(bounds.foreground(&foreground(&[DVec3::ZERO, DVec3::new(-17.0, 17.0, 2.0)])), Ok(()));
        for far_m in [1e12, -1e12, 1e9, 100.0, f64::NAN, f64::INFINITY] {
            let refused = bounds.foreground(&foreground(&[DVec3::ZERO, DVec3::X * far_m]));
            assert_eq!(refused, Err("points out of the sensor's reach"), "{far_m}");
        }
    }

    #[test]
    fn sensors_views_and_times_that_cannot_be_are_refused() {
        let bounds = Bounds::new(&Config::default().site);
        let good = foreground(&[DVec3::ZERO]);
        let changed = |change: &dyn Fn(&mut Foreground)| {
            let mut message = good.clone();
            change(&mut message);
            bounds.foreground(&message).unwrap_err()
        };
        assert_eq!(changed(&|m| m.covers = vec![7]), "sensors that the site has not");
        assert_eq!(changed(&|m| m.covers = vec![0; 3]), "more sensors than there are");
        assert_eq!(changed(&|m| m.points[0].sensor = 1), "points of another sensor");
        assert_eq!(changed(&|m| m.points[0].time_ns = i64::MIN), "points of another time");
        assert_eq!(changed(&|m| m.took_ns = i64::MAX), "a time that no stage takes");
        assert_eq!(
            changed(&|m| m.views[0].site_from_sensor.translation_m.x = 1e9),
            "a sensor elsewhere than the site says"
        );
        assert_eq!(
            changed(&|m| m.views[0].site_from_sensor.rotation *= 2.0),
            "a sensor elsewhere than the site says"
        );
    }

    #[test]
    fn a_list_keeps_whom_the_hall_holds() {
        let bounds = Bounds::new(&Config::default().site);
        let list = |places: &[f64]| {
            let of = |x: &f64| format!(r#"{{ "position_m": [{x}, 0.0], "size_m": [0.5, 0.5, 1.7] }}"#);
            let objects: Vec<String> = places.iter().map(of).collect();
            objects::read(format!(r#"{{ "time_ns": 0, "objects": [{}] }}"#, objects.join(",")).as_bytes())
                .unwrap()
        };
        let mut far = list(&[1.0, 5000.0, 2.0]);
        assert_eq!((bounds.objects(&mut far), far.objects.len()), (Err("objects out of reach"), 2));
        let mut many = list(&vec![1.0; 4096]);
        assert_eq!(bounds.objects(&mut many), Err("more people than the hall holds"));
        assert_eq!((many.objects.len(), bounds.people()), (PEOPLE_MAX, PEOPLE_MAX));
    }

    #[test]
    fn what_was_refused_is_told_with_its_sender_for_a_while() {
        let mut refused = Refused::default();
        (0..3).for_each(|k| refused.note("sensor/east", "points out of the sensor's reach", k));
        assert_eq!(refused.words(5), ["sensor/east: points out of the sensor's reach (3 refused)"]);
        (0..1000).for_each(|k| refused.note(&format!("{k}"), "more", 5));
        assert_eq!((refused.words(5).len(), refused.count), (SENDERS_MAX, 1003));
        assert!(refused.words(TOLD_NS + 5).is_empty());
    }
}
