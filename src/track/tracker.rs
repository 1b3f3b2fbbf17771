//! Predict, associate, correct, birth, death.

use super::Track;
use super::association::{FORBIDDEN, greedy, optimal};
use super::kalman::{State, inverted, plus, quadratic};
use super::person::{Person, noise, sway};
use super::visibility::{Body, View, Visibility, detection_probability};
use crate::config::{Assignment, GateOn, MeasuredAt, TrackConfig};
use crate::detect::{Detection, Prior};
use crate::geometry::DVec2;
use crate::{Frame, Site};

/// Follows people.
#[derive(Debug, Clone)]
pub struct Tracker {
    config: TrackConfig,
    visibility: Visibility,
    /// In order of `id`.
    people: Vec<Person>,
    next_id: u64,
    time_ns: Option<i64>,
}

/// What is known of a person before the frame's detections are looked at.
struct Expected {
    view: View,
    /// Chance of a detection of one's own, given that somebody is there.
    detection_probability: f64,
}

impl Tracker {
    /// Needs the site to know what each sensor can see.
    pub fn new(config: &TrackConfig, site: &Site) -> Self {
        Self {
            config: config.clone(),
            visibility: Visibility::new(site),
            people: Vec::new(),
            next_id: 0,
            time_ns: None,
        }
    }

    /// Last step's tracks predicted to `time_ns`.
    pub fn priors(&self, time_ns: i64) -> Vec<Prior> {
        let after_s = self.time_ns.map_or(0.0, |last_ns| seconds(last_ns, time_ns));
        self.people.iter().map(|person| person.prior(&self.config, after_s)).collect()
    }

    /// Takes a frame's detections; `tracks` is every track alive at the frame's time, in order of `id`. A frame
    /// that is not later than the last one changes nothing.
    pub fn update(&mut self, frame: &Frame, detections: &[Detection], tracks: &mut Vec<Track>) {
        if self.time_ns.is_some_and(|last_ns| frame.time_ns <= last_ns) {
            return;
        }
        let last_ns = self.time_ns.replace(frame.time_ns).unwrap_or(frame.time_ns);
        let step_s = seconds(last_ns, frame.time_ns);
        let detections = in_order(detections);
        let expected = self.expect(frame, step_s);
        let given = self.associate(frame.time_ns, last_ns, &expected, &detections);
        self.correct(frame.time_ns, last_ns, &expected, &given, &detections);
        self.mark_duplicates(step_s);
        self.people.retain(|person| !person.is_dead(&self.config, frame.time_ns));
        self.give_birth(frame.time_ns, &given, &detections);
        tracks.clear();
        tracks.extend(self.people.iter_mut().map(|person| person.track(&self.config, frame.time_ns)));
    }

    /// Who can be seen, how well, and with what chance of a detection of one's own.
    fn expect(&self, frame: &Frame, step_s: f64) -> Vec<Expected> {
        let config = &self.config;
        let eyes = self.visibility.eyes(frame);
        let bodies: Vec<Body> = self
            .people
            .iter()
            .map(|person| person.body(person.filter.state_after(config, step_s).position_m()))
            .collect();
        let chance = |body: &Body, view: &View| {
            let seen = if config.visibility {
                detection_probability(config, view)
            } else {
                config.detection_probability
            };
            // Two people who stand close often give one detection: then a miss says little.
            let neighbour_m = bodies
                .iter()
                .filter(|other| *other != body)
                .map(|other| other.position_m.distance(body.position_m))
                .fold(f64::INFINITY, f64::min);
            seen * resolved(neighbour_m, config.resolution_m)
        };
        bodies
            .iter()
            .map(|body| {
                let view = self.visibility.view(&eyes, body, &bodies);
                Expected { view, detection_probability: chance(body, &view) }
            })
            .collect()
    }

    /// Each person's detection.
    fn associate(
        &self,
        time_ns: i64,
        last_ns: i64,
        expected: &[Expected],
        detections: &[&Detection],
    ) -> Vec<Option<usize>> {
        let now: Vec<State> = self.people.iter().map(|p| p.filter.state()).collect();
        let cost = |p: usize, d: usize| {
            let (person, detection) = (&self.people[p], detections[d]);
            if !detection.whole && !person.confirmed {
                return FORBIDDEN;
            }
            // Nobody walks at 10 m/s: spares most pairs the rest.
            let reach_m = self.config.gate_m + 10.0 * seconds(last_ns, time_ns);
            if now[p].position_m().distance(detection.position_m) > reach_m {
                return FORBIDDEN;
            }
            let after_s = seconds(last_ns, self.measured_ns(detection, last_ns, time_ns));
            pair_cost(&self.config, person, &expected[p], after_s, detection)
        };
        match self.config.assignment {
            Assignment::Greedy => greedy(self.people.len(), detections.len(), cost),
            Assignment::Optimal => optimal(self.people.len(), detections.len(), cost),
        }
    }

    fn correct(
        &mut self,
        time_ns: i64,
        last_ns: i64,
        expected: &[Expected],
        given: &[Option<usize>],
        detections: &[&Detection],
    ) {
        let step_s = seconds(last_ns, time_ns);
        for (p, (given, expected)) in given.iter().zip(expected).enumerate() {
            let at_ns = given.map_or(time_ns, |d| self.measured_ns(detections[d], last_ns, time_ns));
            let (config, person) = (&self.config, &mut self.people[p]);
            person.predict(config, seconds(last_ns, at_ns));
            match given {
                Some(d) => person.hit(config, detections[*d], &expected.view, time_ns, step_s),
                None => person.missed(expected.detection_probability, step_s),
            }
            person.predict(config, seconds(at_ns, time_ns));
        }
    }

    /// Counts how long each track has stood where a track of more hits stands. All are judged on the same places,
    /// so the order does not matter.
    fn mark_duplicates(&mut self, step_s: f64) {
        let rank = |p: &Person| (std::cmp::Reverse(p.confirmed), std::cmp::Reverse(p.hits), p.id);
        let at: Vec<_> = self.people.iter().map(|p| (rank(p), p.filter.state().position_m())).collect();
        for (i, person) in self.people.iter_mut().enumerate() {
            let doubled = at
                .iter()
                .any(|other| other.0 < at[i].0 && other.1.distance(at[i].1) < self.config.duplicate_m);
            person.doubled_s = if doubled { person.doubled_s + step_s } else { 0.0 };
        }
    }

    /// A track for each detection that is nobody's and far enough from everybody.
    fn give_birth(&mut self, time_ns: i64, given: &[Option<usize>], detections: &[&Detection]) {
        let mut places: Vec<DVec2> = self.people.iter().map(|p| p.filter.state().position_m()).collect();
        for (d, detection) in detections.iter().enumerate() {
            let taken = given.contains(&Some(d));
            let near = |place: &DVec2| place.distance(detection.position_m) <= self.config.birth_radius_m;
            if taken || !detection.whole || places.iter().any(near) {
                continue;
            }
            let mut person = Person::born(&self.config, self.next_id, detection, time_ns);
            let measured_ns = self.measured_ns(detection, i64::MIN, time_ns);
            person.predict(&self.config, seconds(measured_ns, time_ns));
            places.push(detection.position_m);
            self.people.push(person);
            self.next_id += 1;
        }
    }

    /// When a detection counts as measured: never before the last frame, where the filters stand.
    fn measured_ns(&self, detection: &Detection, last_ns: i64, time_ns: i64) -> i64 {
        match self.config.measured_at {
            MeasuredAt::Points => detection.time_ns.max(last_ns).min(time_ns),
            MeasuredAt::Frame => time_ns,
        }
    }
}

/// Twice the negative log-likelihood that a person gave a detection, less that it went unseen and the detection is
/// somebody's who is new. [`FORBIDDEN`] outside the gate.
fn pair_cost(
    config: &TrackConfig,
    person: &Person,
    expected: &Expected,
    after_s: f64,
    detection: &Detection,
) -> f64 {
    let state = person.filter.state_after(config, after_s);
    let apart = detection.position_m - state.position_m();
    let mut spread = state.position_covariance();
    let mut spread_z = person.filter.vertical.map(|z| z.P[0][0]);
    if config.gate_on == GateOn::Innovation {
        let slack = config.gate_slack_m.powi(2);
        let noise =
            plus(plus(noise(config, detection, &expected.view), sway(config)), [[slack, 0.0], [0.0, slack]]);
        spread = plus(spread, noise);
        spread_z = spread_z.map(|z| z + noise[0][0]);
    }
    let (inverse, mut det) = inverted(spread);
    let (mut mahalanobis, mut apart_squared) = (quadratic(inverse, apart), apart.length_squared());
    if let (Some(vertical), Some(spread_z)) = (person.filter.vertical, spread_z) {
        let apart_z = detection.z_m - vertical.x[0] - after_s * vertical.x[1];
        mahalanobis += apart_z * apart_z / spread_z;
        apart_squared += apart_z * apart_z;
        det *= spread_z;
    }
    if mahalanobis > config.gate_chi2 || apart_squared > config.gate_m * config.gate_m {
        return FORBIDDEN;
    }
    // That the person is there and seen.
    let existence = if config.visibility { person.existence } else { 1.0 };
    let seen = existence * expected.detection_probability;
    let unseen = (1.0 - seen).max(1e-3);
    let ratio = seen.max(1e-3) / (unseen * config.new_per_m2 * std::f64::consts::TAU);
    mahalanobis + det.ln() - 2.0 * ratio.ln()
}

/// Chance that two people so far apart give two detections (the resolution model of Koch and van Keuk 1997).
fn resolved(apart_m: f64, resolution_m: f64) -> f64 {
    if resolution_m > 0.0 { 1.0 - (-0.5 * (apart_m / resolution_m).powi(2)).exp() } else { 1.0 }
}

/// The detections that are numbers, in an order that does not depend on the one they came in.
fn in_order(detections: &[Detection]) -> Vec<&Detection> {
    let mut sorted: Vec<&Detection> = detections.iter().filter(|d| d.position_m.is_finite()).collect();
    sorted.sort_by(|a, b| {
        let (p, q) = (a.position_m, b.position_m);
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(a.time_ns.cmp(&b.time_ns))
    });
    sorted
}

fn seconds(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}
