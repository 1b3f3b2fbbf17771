//! Our tracker: predict, associate, correct, birth, death, with a mixture of motion models for each person and what
//! sensors can see of everybody.

use std::cmp::Reverse;

use super::association::{Assignment, FORBIDDEN, in_order};
use super::attached::{Beside, REACH_M};
use super::followed::{Track, seconds};
use super::gaussian::{inverted, plus, quadratic, round};
use super::neighbours::Neighbours;
use super::noise::{noise, sway};
use super::numbers::Numbers;
use super::origin::BESIDE_M;
use super::person::Person;
use super::remembered::{FURNITURE_MAX, PEOPLE_MAX, Remembered, Words};
use super::visibility::{Body, BodyView, Visibility, detection_probability};
use crate::Site;
use crate::config::TrackConfig;
use crate::detect::{Detection, PRESSED_APART_M, PRESSED_M, Prior, press};
use crate::geometry::DVec2;
use crate::lidar::Views;

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
/// The same in a crowd, of tracks that have a detection of their own: bodies allow no less. So many tracks so near are a
/// crowd, whose clusters are shared out among those who are known, so that nobody is found in halves.
const BIRTH_BESIDE_SEEN_M: f64 = 0.30;
const CROWD_PEOPLE: usize = 3;
/// What is found so near to a person may be his arm, or held by him: half the span of a tall one's arms.
const ARM_REACH_M: f64 = 0.95;
/// Two tracks nearer than this are one body whose halves two tracks share: no two trunks fit into it. Where people press, who is
/// found so near is more often somebody whose place is known badly.
const DUPLICATE_M: f64 = 0.3;
const DUPLICATE_PRESSED_M: f64 = 0.2;
/// How much higher than his head, and lower than his highest slice that beams meet, detections of somebody end; from twice as much
/// on they are taken for somebody else's, or say nothing: one in twenty does.
const ABOVE_M: f64 = 0.12;
const BELOW_M: f64 = 0.3;
const UNLIKE_HEIGHT_COST: f64 = 6.0;
/// What a cluster shows is one body alone where nobody else is followed as near.
const ALONE_M: f64 = 1.2;
/// Nobody walks faster: spares most pairs the rest.
const FASTEST_MPS: f64 = 10.0;

/// Follows people.
#[derive(Debug, Clone)]
pub struct MixtureTracker {
    numbers: Numbers,
    visibility: Visibility,
    /// In order of `id`.
    people: Vec<Person>,
    /// Where tracks were taken for furniture that the background now knows, the latest last.
    furniture_m: Vec<DVec2>,
    next_id: u64,
    time_ns: Option<i64>,
    memory: Memory,
}

/// Kept from frame to frame, so that nothing is allocated once it is large enough.
#[derive(Debug, Clone, Default)]
struct Memory {
    /// The frame's detections in the order that everything goes by.
    order: Vec<usize>,
    bodies: Vec<Body>,
    expected: Vec<Expected>,
    /// Of people, then also of who is born.
    places_m: Vec<DVec2>,
    /// Of detections, then of people.
    neighbours: Neighbours,
    /// Which of them have a detection in this frame.
    seen: Vec<bool>,
    assignment: Assignment,
    taken: Vec<bool>,
    ranks: Vec<Rank>,
    beside: Vec<Beside>,
}

/// Fewest first: the confirmed, those of more matches, the older.
type Rank = (Reverse<bool>, Reverse<u32>, u64);

/// What is known of a person before the frame's detections are looked at.
#[derive(Debug, Clone)]
struct Expected {
    view: BodyView,
    /// Chance of a detection of one's own, given that somebody is there.
    detection_probability: f64,
}

impl Remembered for MixtureTracker {
    fn visit(&mut self, words: &mut impl Words) {
        words.word(&mut self.next_id);
        words.maybe_i64(&mut self.time_ns);
        let numbers = &self.numbers;
        words.list(&mut self.people, PEOPLE_MAX, || Person::blank(numbers));
        words.list(&mut self.furniture_m, FURNITURE_MAX, || DVec2::ZERO);
    }
}

impl MixtureTracker {
    /// Needs the site to know what each sensor can see.
    pub fn new(config: &TrackConfig, site: &Site) -> Self {
        Self::with_numbers(Numbers::new(config), site)
    }

    /// The same with numbers of one's own.
    pub fn with_numbers(numbers: Numbers, site: &Site) -> Self {
        let visibility = Visibility::new(site);
        Self {
            numbers,
            visibility,
            people: Vec::new(),
            furniture_m: Vec::new(),
            next_id: 0,
            time_ns: None,
            memory: Memory::default(),
        }
    }

    /// The `id` of who is born next.
    pub fn next_id(&self) -> u64 {
        self.next_id
    }

    /// The `id` of everybody followed, ascending.
    pub fn ids(&self) -> impl Iterator<Item = u64> {
        self.people.iter().map(|person| person.id)
    }

    /// Gives everybody another `id`, in the same order, and who is born next `next_id`.
    pub fn renumber(&mut self, id: impl Fn(u64) -> u64, next_id: u64) {
        for person in &mut self.people {
            person.id = id(person.id);
            person.attached.renumber(&id);
        }
        self.next_id = next_id;
    }

    /// Last step's tracks predicted to `time_ns`.
    pub fn priors(&self, time_ns: i64, priors: &mut Vec<Prior>) {
        let last_ns = self.time_ns.unwrap_or(time_ns);
        let after_s = seconds(last_ns, time_ns);
        priors.clear();
        priors.extend(self.people.iter().map(|person| person.prior(&self.numbers, last_ns, after_s)));
    }

    /// Takes a frame's detections; `tracks` is every track alive at the frame's time, in order of `id`. A frame
    /// that is not later than the last one changes nothing.
    pub fn update(&mut self, views: &Views, detections: &[Detection], tracks: &mut Vec<Track>) {
        let time_ns = views.time_ns;
        if self.time_ns.is_some_and(|last_ns| time_ns <= last_ns) {
            return;
        }
        let last_ns = self.time_ns.replace(time_ns).unwrap_or(time_ns);
        let step_s = seconds(last_ns, time_ns);
        in_order(detections, &mut self.memory.order);
        self.expect(views, !detections.is_empty(), step_s);
        self.associate(time_ns, last_ns, detections);
        self.correct(time_ns, last_ns, detections);
        self.mark_duplicates(step_s);
        self.mark_attached(step_s);
        self.bury(time_ns);
        self.give_birth(time_ns, detections);
        self.tell(time_ns, step_s, tracks);
    }

    /// Who can be seen, how well, and with what chance of a detection of one's own. Where somebody was `found` without a scan, by
    /// somebody else's detector, nothing is known of what it sees.
    fn expect(&mut self, views: &Views, found: bool, step_s: f64) {
        let Self { numbers, visibility, people, memory, .. } = self;
        let Memory { bodies, expected, .. } = memory;
        let sight_known = numbers.visibility && !(found && views.of_scans.is_empty());
        bodies.clear();
        let body = |p: &Person| p.body(p.filter.position_after(step_s), &visibility.hall);
        bodies.extend(people.iter().map(body));
        visibility.look(views, bodies);
        expected.clear();
        expected.extend(bodies.iter().map(|body| {
            let view = visibility.view(body);
            let detection_probability = match sight_known {
                true => detection_probability(DETECTION_PROBABILITY, &view),
                false => DETECTION_PROBABILITY,
            };
            Expected { view, detection_probability }
        }));
    }

    /// Each person's detection.
    fn associate(&mut self, time_ns: i64, last_ns: i64, detections: &[Detection]) {
        let Self { numbers, people, memory, .. } = self;
        let Memory { order, expected, places_m, neighbours, assignment, .. } = memory;
        places_m.clear();
        places_m.extend(people.iter().map(|p| p.filter.position_m()));
        neighbours.renew(order.iter().map(|&d| detections[d].position_m));
        let reach_m = GATE_M + FASTEST_MPS * seconds(last_ns, time_ns);
        let about = |p: usize, found: &mut Vec<usize>| found.extend(neighbours.about(places_m[p], reach_m));
        let cost = |p: usize, d: usize| {
            let (person, detection) = (&people[p], &detections[order[d]]);
            if !detection.full_body && !person.confirmed {
                return FORBIDDEN;
            }
            if places_m[p].distance(detection.position_m) > reach_m {
                return FORBIDDEN;
            }
            let after_s = seconds(last_ns, measured_ns(detection, last_ns, time_ns));
            pair_cost(numbers, person, &expected[p], after_s, detection)
        };
        assignment.optimal_among(people.len(), order.len(), about, cost);
    }

    fn correct(&mut self, time_ns: i64, last_ns: i64, detections: &[Detection]) {
        let Self { numbers, people, memory, visibility, .. } = self;
        let Memory { order, expected, assignment, places_m, neighbours, .. } = memory;
        neighbours.renew(places_m.iter().copied());
        let step_s = seconds(last_ns, time_ns);
        for ((person, given), expected) in people.iter_mut().zip(&assignment.column_of).zip(expected) {
            let detection = given.map(|d| &detections[order[d]]);
            let at_ns = detection.map_or(time_ns, |detection| measured_ns(detection, last_ns, time_ns));
            person.predict(numbers, seconds(last_ns, at_ns));
            match detection {
                Some(detection) => {
                    person.matched(numbers, detection, &expected.view, visibility, time_ns, step_s);
                    let at_m = person.filter.position_m();
                    let near = |k: &usize| places_m[*k].distance_squared(at_m) < ALONE_M * ALONE_M;
                    // The person is one of them.
                    if numbers.shape && neighbours.about(at_m, ALONE_M).filter(near).nth(1).is_none() {
                        person.see_alone(detection, &expected.view);
                    }
                }
                None => person.missed(expected.detection_probability, step_s),
            }
            person.predict(numbers, seconds(at_ns, time_ns));
        }
    }

    /// Counts how long each track has stood where a track of more matches stands. All are judged on the same places,
    /// so the order does not matter.
    fn mark_duplicates(&mut self, step_s: f64) {
        let Memory { ranks, places_m, neighbours, .. } = &mut self.memory;
        ranks.clear();
        ranks.extend(self.people.iter().map(|p| (Reverse(p.confirmed), Reverse(p.matches), p.id)));
        places_m.clear();
        places_m.extend(self.people.iter().map(|p| p.filter.position_m()));
        neighbours.renew(places_m.iter().copied());
        let (places_m, neighbours) = (&*places_m, &*neighbours);
        for i in 0..self.people.len() {
            let place_m = places_m[i];
            let within =
                |m: f64| neighbours.about(place_m, m).filter(move |k| places_m[*k].distance(place_m) < m);
            let is_doubled = |m: f64| within(m).any(|k| ranks[k] < ranks[i]);
            let heights_m = within(PRESSED_M).map(|k| self.people[k].height_m().0);
            let doubled = is_doubled(DUPLICATE_M) && (is_doubled(DUPLICATE_PRESSED_M) || !press(heights_m));
            let person = &mut self.people[i];
            person.doubled_s = if doubled { person.doubled_s + step_s } else { 0.0 };
        }
    }

    /// Finds who moves with somebody, of those who were just found to be near each other.
    fn mark_attached(&mut self, step_s: f64) {
        if !self.numbers.things {
            return;
        }
        let Memory { beside, neighbours, .. } = &mut self.memory;
        beside.clear();
        beside.extend(self.people.iter().map(Person::beside));
        for (person, thing) in self.people.iter_mut().zip(&*beside) {
            let near = neighbours.about(thing.position_m, REACH_M).map(|k| &beside[k]);
            person.attached.look(thing, near, step_s);
        }
    }

    /// Forgets the dead, but not where furniture was.
    fn bury(&mut self, time_ns: i64) {
        let Self { numbers, people, furniture_m, .. } = self;
        people.retain(|person| {
            let dead = person.is_dead(numbers, time_ns);
            furniture_m.extend(person.furniture_m(time_ns).filter(|_| dead));
            !dead
        });
        furniture_m.drain(..furniture_m.len().saturating_sub(FURNITURE_MAX));
    }

    /// A track for each detection that is nobody's and far enough from everybody.
    fn give_birth(&mut self, time_ns: i64, detections: &[Detection]) {
        let Self { numbers, people, furniture_m: known_m, next_id, memory, .. } = self;
        let Memory { order, assignment, places_m, seen, taken, .. } = memory;
        seen.clear();
        seen.extend(people.iter().map(|person| person.is_seen()));
        taken.clear();
        taken.resize(order.len(), false);
        assignment.column_of.iter().flatten().for_each(|&d| taken[d] = true);
        places_m.clear();
        places_m.extend(people.iter().map(|p| p.filter.position_m()));
        for (&d, _) in order.iter().zip(taken).filter(|(_, taken)| !**taken) {
            let detection = &detections[d];
            let near = |(_, place): &(usize, &DVec2)| place.distance(detection.position_m) < PRESSED_M;
            let around = places_m.iter().enumerate().filter(near);
            let beside_seen_m = match around.clone().count() >= CROWD_PEOPLE {
                true if press(around.map(|(k, _)| people[k].height_m().0)) => PRESSED_APART_M,
                true => BIRTH_BESIDE_SEEN_M,
                false => BIRTH_RADIUS_M,
            };
            let near = |(place_m, seen): (&DVec2, &bool)| {
                let least_m = if *seen { beside_seen_m } else { BIRTH_RADIUS_M };
                place_m.distance(detection.position_m) <= least_m
            };
            if !detection.full_body || places_m.iter().zip(&*seen).any(near) {
                continue;
            }
            let furniture_m = people.iter().filter_map(|person| person.furniture_m(time_ns));
            let beside = known_m
                .iter()
                .copied()
                .chain(furniture_m)
                .any(|place| place.distance(detection.position_m) < BESIDE_M);
            let on_trial = people.iter().zip(&*places_m).any(|(person, place)| {
                person.confirmed && place.distance(detection.position_m) < ARM_REACH_M
            });
            let mut person = Person::born(numbers, *next_id, detection, time_ns, beside, on_trial);
            let measured_ns = measured_ns(detection, i64::MIN, time_ns);
            person.predict(numbers, seconds(measured_ns, time_ns));
            places_m.push(detection.position_m);
            seen.push(true);
            people.push(person);
            *next_id += 1;
        }
    }

    /// Everybody's track, in the memory of the last frame's.
    fn tell(&mut self, time_ns: i64, step_s: f64, tracks: &mut Vec<Track>) {
        tracks.truncate(self.people.len());
        for (i, person) in self.people.iter_mut().enumerate() {
            let observed = tracks.get_mut(i).map(|old| std::mem::take(&mut old.observed)).unwrap_or_default();
            let track = person.track(&self.numbers, time_ns, step_s, &self.visibility.hall, observed);
            match tracks.get_mut(i) {
                Some(old) => *old = track,
                None => tracks.push(track),
            }
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
    mahalanobis + det.ln() - 2.0 * ratio.ln() + unlike_height(person, &expected.view, detection)
}

/// What it costs to take a detection for somebody whom it does not fit in height: twice the negative logarithm of how often a
/// highest point says nothing, where it lies so far above the head, or below where it would be seen, that it is not of a head.
fn unlike_height(person: &Person, view: &BodyView, detection: &Detection) -> f64 {
    let (mean_m, sigma_m) = person.height_m();
    let above_m = detection.top_m - (mean_m + 2.0 * sigma_m);
    // The highest beam on a head lies up to a gap between beams below its top.
    let shown_m = view.top_m.min(mean_m - 1.0 / view.beams_per_m_at_top);
    let below_m = if view.beams_known { shown_m - 2.0 * sigma_m - detection.top_m } else { 0.0 };
    let share = ((above_m - ABOVE_M) / ABOVE_M).max((below_m - BELOW_M) / BELOW_M);
    UNLIKE_HEIGHT_COST * share.clamp(0.0, 1.0)
}
