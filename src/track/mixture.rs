//! Our tracker: predict, associate, correct, birth, death, with a mixture of motion models for each person and what
//! sensors can see of everybody.

use super::association::{FORBIDDEN, in_order, optimal};
use super::followed::{Track, seconds};
use super::gaussian::{State, inverted, plus, quadratic, round};
use super::numbers::Numbers;
use super::person::{Person, noise, sway};
use super::visibility::{Body, BodyView, Visibility, detection_probability};
use crate::config::TrackConfig;
use crate::detect::{Detection, Prior};
use crate::geometry::DVec2;
use crate::{Frame, Site};

/// Chance to detect a person where nothing is known of what sensors see.
const DETECTION_PROBABILITY: f64 = 0.9;
/// How much farther than foreseen a detection may lie where it is given to a track, one sigma of an axis: who stops at
/// once is 0.13 m from where a filter that is sure of itself expects one.
const GATE_SLACK_M: f64 = 0.06;
/// Squared Mahalanobis distance a pair may have, wide: a cluster that loses half its points jumps farther than its noise
/// says. And no farther than [`GATE_M`].
const GATE_CHI2: f64 = 20.0;
const GATE_M: f64 = 0.8;
/// Only a detection farther than this from every track starts one: two people side by side are 0.5 m apart, a split
/// person's halves 0.4 m at most.
const BIRTH_RADIUS_M: f64 = 0.45;
/// Two tracks nearer than this are one body whose halves two tracks share: no two trunks fit into it.
const DUPLICATE_M: f64 = 0.3;
/// Nobody walks faster: spares most pairs the rest.
const FASTEST_MPS: f64 = 10.0;

/// Follows people.
#[derive(Debug, Clone)]
pub struct MixtureTracker {
    numbers: Numbers,
    visibility: Visibility,
    /// In order of `id`.
    people: Vec<Person>,
    next_id: u64,
    time_ns: Option<i64>,
}

/// What is known of a person before the frame's detections are looked at.
struct Expected {
    view: BodyView,
    /// Chance of a detection of one's own, given that somebody is there.
    detection_probability: f64,
}

impl MixtureTracker {
    /// Needs the site to know what each sensor can see.
    pub fn new(config: &TrackConfig, site: &Site) -> Self {
        Self::with_numbers(Numbers::new(config), site)
    }

    /// The same with numbers of one's own.
    pub fn with_numbers(numbers: Numbers, site: &Site) -> Self {
        Self { numbers, visibility: Visibility::new(site), people: Vec::new(), next_id: 0, time_ns: None }
    }

    /// Last step's tracks predicted to `time_ns`.
    pub fn priors(&self, time_ns: i64) -> Vec<Prior> {
        let after_s = self.time_ns.map_or(0.0, |last_ns| seconds(last_ns, time_ns));
        self.people.iter().map(|person| person.prior(&self.numbers, after_s)).collect()
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
        self.people.retain(|person| !person.is_dead(&self.numbers, frame.time_ns));
        self.give_birth(frame.time_ns, &given, &detections);
        tracks.clear();
        tracks.extend(self.people.iter_mut().map(|person| person.track(frame.time_ns, step_s)));
    }

    /// Who can be seen, how well, and with what chance of a detection of one's own.
    fn expect(&self, frame: &Frame, step_s: f64) -> Vec<Expected> {
        let numbers = &self.numbers;
        let eyes = self.visibility.eyes(frame);
        let bodies: Vec<Body> = self
            .people
            .iter()
            .map(|person| person.body(person.filter.state_after(numbers, step_s).position_m()))
            .collect();
        bodies
            .iter()
            .map(|body| {
                let view = self.visibility.view(&eyes, body, &bodies);
                let detection_probability = match numbers.visibility {
                    true => detection_probability(DETECTION_PROBABILITY, &view),
                    false => DETECTION_PROBABILITY,
                };
                Expected { view, detection_probability }
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
            if !detection.full_body && !person.confirmed {
                return FORBIDDEN;
            }
            let reach_m = GATE_M + FASTEST_MPS * seconds(last_ns, time_ns);
            if now[p].position_m().distance(detection.position_m) > reach_m {
                return FORBIDDEN;
            }
            let after_s = seconds(last_ns, measured_ns(detection, last_ns, time_ns));
            pair_cost(&self.numbers, person, &expected[p], after_s, detection)
        };
        optimal(self.people.len(), detections.len(), cost)
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
            let at_ns = given.map_or(time_ns, |d| measured_ns(detections[d], last_ns, time_ns));
            let (numbers, person) = (&self.numbers, &mut self.people[p]);
            person.predict(numbers, seconds(last_ns, at_ns));
            match given {
                Some(d) => person.matched(numbers, detections[*d], &expected.view, time_ns, step_s),
                None => person.missed(expected.detection_probability, step_s),
            }
            person.predict(numbers, seconds(at_ns, time_ns));
        }
    }

    /// Counts how long each track has stood where a track of more matches stands. All are judged on the same places,
    /// so the order does not matter.
    fn mark_duplicates(&mut self, step_s: f64) {
        let rank = |p: &Person| (std::cmp::Reverse(p.confirmed), std::cmp::Reverse(p.matches), p.id);
        let at: Vec<_> = self.people.iter().map(|p| (rank(p), p.filter.state().position_m())).collect();
        for (i, person) in self.people.iter_mut().enumerate() {
            let doubled = at.iter().any(|other| other.0 < at[i].0 && other.1.distance(at[i].1) < DUPLICATE_M);
            person.doubled_s = if doubled { person.doubled_s + step_s } else { 0.0 };
        }
    }

    /// A track for each detection that is nobody's and far enough from everybody.
    fn give_birth(&mut self, time_ns: i64, given: &[Option<usize>], detections: &[&Detection]) {
        let mut places: Vec<DVec2> = self.people.iter().map(|p| p.filter.state().position_m()).collect();
        for (d, detection) in detections.iter().enumerate() {
            let taken = given.contains(&Some(d));
            let near = |place: &DVec2| place.distance(detection.position_m) <= BIRTH_RADIUS_M;
            if taken || !detection.full_body || places.iter().any(near) {
                continue;
            }
            let mut person = Person::born(&self.numbers, self.next_id, detection, time_ns);
            let measured_ns = measured_ns(detection, i64::MIN, time_ns);
            person.predict(&self.numbers, seconds(measured_ns, time_ns));
            places.push(detection.position_m);
            self.people.push(person);
            self.next_id += 1;
        }
    }
}

/// When a detection counts as measured, the mean time of its points: never before the last frame, where the filters
/// stand.
fn measured_ns(detection: &Detection, last_ns: i64, time_ns: i64) -> i64 {
    detection.time_ns.max(last_ns).min(time_ns)
}

/// Twice the negative log-likelihood that a person gave a detection, less that it went unseen and the detection is
/// somebody's who is new. [`FORBIDDEN`] outside the gate.
fn pair_cost(
    numbers: &Numbers,
    person: &Person,
    expected: &Expected,
    after_s: f64,
    detection: &Detection,
) -> f64 {
    let state = person.filter.state_after(numbers, after_s);
    let apart = detection.position_m - state.position_m();
    let noise = plus(noise(numbers, detection, &expected.view), sway(numbers));
    let spread = plus(state.position_covariance(), plus(noise, round(GATE_SLACK_M.powi(2))));
    let (inverse, det) = inverted(spread);
    let mahalanobis = quadratic(inverse, apart);
    if mahalanobis > GATE_CHI2 || apart.length_squared() > GATE_M * GATE_M {
        return FORBIDDEN;
    }
    // That the person is there and seen.
    let existence = if numbers.visibility { person.existence } else { 1.0 };
    let seen = existence * expected.detection_probability;
    let unseen = (1.0 - seen).max(1e-3);
    let ratio = seen.max(1e-3) / (unseen * numbers.clutter_per_m2 * std::f64::consts::TAU);
    mahalanobis + det.ln() - 2.0 * ratio.ln()
}
