//! The tracker of the paper's authors: a constant-velocity Kalman filter and the nearest neighbour, as
//! hdl_people_tracking ships it (facts and values: koide3/hdl_people_tracking at 2d12516) or as the paper says.
//!
//! x and v: position and velocity of an axis; P: their covariance, the same for every axis because the noise is; Q:
//! process noise (the base calls it R); R: measurement noise; S: variance of the innovation; K: gain.
#![allow(non_snake_case)]

use super::association::{FORBIDDEN, greedy, in_order, optimal};
use super::followed::{Observations, Track, WIDTH_SCALE_SIGMA, seconds};
use super::gaussian::State;
use super::heading::Heading;
use super::remembered::{PEOPLE_MAX, Remembered, Words};
use crate::detect::Detection;
use crate::gait::Gait;
use crate::geometry::{Aabb, DMat3, DVec2, DVec3, Obb};

/// Added to the variances of position and velocity in each step, however long.
const Q: [f64; 2] = [0.03, 0.01];
/// Variance of a detection, m^2.
const R: f64 = 0.2;
/// Of a new track: half the detection's, and as much of the velocity.
const BORN: f64 = 0.1;
/// Squared Mahalanobis distance and distance that a pair may have.
const GATE_CHI2: f64 = 9.0;
const GATE_M: f64 = 1.5;
/// Only a detection farther than this from every track starts one: over the floor, where the adapted code measures in
/// three dimensions and lets births go before deaths.
const BIRTH_RADIUS_M: f64 = 0.8;
/// A track dies, the only way there is, when the variances of its position add up to this.
const VARIANCE_MAX_M2: f64 = 1.0;
/// Chance to detect somebody, and strangers per frame and square metre: what an assignment that may leave a track
/// without a detection weighs against each other.
const DETECTION_PROBABILITY: f64 = 0.9;
const CLUTTER_PER_M2: f64 = 0.001;

/// Where the adapted code and the paper differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variant {
    /// Tracks x, y and z, gates on P, and gives the nearest pair first: the line for the optimal one is commented out.
    Hdl,
    /// Tracks x and y, gates on S = P + R, and takes the assignment of least cost.
    Paper,
}

/// Follows people as the paper does.
#[derive(Debug, Clone)]
pub struct PaperTracker {
    variant: Variant,
    /// In order of `id`.
    people: Vec<Person>,
    next_id: u64,
    time_ns: Option<i64>,
}

/// Somebody followed.
#[derive(Debug, Clone)]
struct Person {
    id: u64,
    x_m: DVec3,
    v_mps: DVec3,
    P: [[f64; 2]; 2],
    points: u32,
    heading: Heading,
    top_m: f64,
    /// The last detection's boxes, moved so that its position is at the origin.
    aabb: Aabb,
    obb: Obb,
    observed: Observations,
}

impl Remembered for PaperTracker {
    fn visit(&mut self, words: &mut impl Words) {
        words.word(&mut self.next_id);
        words.maybe_i64(&mut self.time_ns);
        words.list(&mut self.people, PEOPLE_MAX, || Person::new(0, DVec3::ZERO));
    }
}

impl Remembered for Person {
    fn visit(&mut self, words: &mut impl Words) {
        words.word(&mut self.id);
        words.vec3(&mut self.x_m);
        words.vec3(&mut self.v_mps);
        words.f64s(self.P.as_flattened_mut());
        words.u32(&mut self.points);
        self.heading.visit(words);
        words.f64(&mut self.top_m);
        for corner_m in [&mut self.aabb.min_m, &mut self.aabb.max_m] {
            words.vec3(corner_m);
        }
        words.vec3(&mut self.obb.center_m);
        words.vec3(&mut self.obb.half_m);
        let mut columns = self.obb.site_from_box.to_cols_array();
        words.f64s(&mut columns);
        self.obb.site_from_box = DMat3::from_cols_array(&columns);
        self.observed.visit(words);
    }
}

impl PaperTracker {
    /// Nobody is followed yet.
    pub fn new(variant: Variant) -> Self {
        Self { variant, people: Vec::new(), next_id: 0, time_ns: None }
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
        self.people.iter_mut().for_each(|person| person.id = id(person.id));
        self.next_id = next_id;
    }

    /// Takes a frame's detections, all taken to be of its end; `tracks` is every track alive then, in order of `id`.
    pub fn update(&mut self, time_ns: i64, detections: &[Detection], tracks: &mut Vec<Track>) {
        if self.time_ns.is_some_and(|last_ns| time_ns <= last_ns) {
            return;
        }
        let last_ns = self.time_ns.replace(time_ns).unwrap_or(time_ns);
        let step_s = seconds(last_ns, time_ns);
        let mut order = Vec::new();
        in_order(detections, &mut order);
        let detections: Vec<&Detection> = order.iter().map(|&d| &detections[d]).collect();
        self.people.iter_mut().for_each(|person| person.predict(step_s));
        let given = self.associate(&detections);
        for (person, given) in self.people.iter_mut().zip(&given) {
            match given {
                Some(d) => person.correct(detections[*d]),
                None => person.points = 0,
            }
        }
        let axes = if self.variant == Variant::Hdl { 3.0 } else { 2.0 };
        self.people.retain(|person| axes * person.P[0][0] < VARIANCE_MAX_M2);
        self.give_birth(&given, &detections);
        tracks.clear();
        tracks.extend(self.people.iter_mut().map(|person| person.track(time_ns, step_s)));
    }

    fn associate(&self, detections: &[&Detection]) -> Vec<Option<usize>> {
        let cost = |p: usize, d: usize| self.pair_cost(&self.people[p], detections[d]);
        match self.variant {
            Variant::Hdl => greedy(self.people.len(), detections.len(), cost),
            Variant::Paper => optimal(self.people.len(), detections.len(), cost),
        }
    }

    /// Twice the negative log-likelihood that a person gave a detection, less that it went unseen and the detection is
    /// somebody's who is new. [`FORBIDDEN`] outside the gate.
    fn pair_cost(&self, person: &Person, detection: &Detection) -> f64 {
        let mut apart = detection.position_m.extend(detection.z_m) - person.x_m;
        let (S, axes) = match self.variant {
            Variant::Hdl => (person.P[0][0], 3),
            Variant::Paper => (person.P[0][0] + R, 2),
        };
        if self.variant == Variant::Paper {
            apart.z = 0.0;
        }
        let squared_m2 = apart.length_squared();
        if squared_m2 / S > GATE_CHI2 || squared_m2 > GATE_M * GATE_M {
            return FORBIDDEN;
        }
        let unseen = (1.0 - DETECTION_PROBABILITY) * CLUTTER_PER_M2 * std::f64::consts::TAU;
        squared_m2 / S + S.powi(axes).ln() - 2.0 * (DETECTION_PROBABILITY / unseen).ln()
    }

    /// A track for each detection that is nobody's and far enough from everybody.
    fn give_birth(&mut self, given: &[Option<usize>], detections: &[&Detection]) {
        for (d, detection) in detections.iter().enumerate() {
            let near = |person: &Person| person.position_m().distance(detection.position_m) <= BIRTH_RADIUS_M;
            if given.contains(&Some(d)) || self.people.iter().any(near) {
                continue;
            }
            self.people.push(Person::born(self.next_id, detection));
            self.next_id += 1;
        }
    }
}

impl Person {
    fn born(id: u64, detection: &Detection) -> Self {
        let mut person = Self::new(id, detection.position_m.extend(detection.z_m));
        person.see(detection);
        person
    }

    fn new(id: u64, x_m: DVec3) -> Self {
        Self {
            id,
            x_m,
            v_mps: DVec3::ZERO,
            P: [[BORN, 0.0], [0.0, BORN]],
            points: 0,
            heading: Heading::ANY,
            top_m: 0.0,
            aabb: Aabb::EMPTY,
            obb: Obb::from_aabb(&Aabb::EMPTY),
            observed: Observations::default(),
        }
    }

    fn position_m(&self) -> DVec2 {
        self.x_m.truncate()
    }

    /// x = F x, P = F P F' + Q.
    fn predict(&mut self, dt_s: f64) {
        if dt_s <= 0.0 {
            return;
        }
        let [[p, c], [_, v]] = self.P;
        self.x_m += dt_s * self.v_mps;
        let c_next = c + dt_s * v;
        self.P = [[p + 2.0 * dt_s * c + dt_s * dt_s * v + Q[0], c_next], [c_next, v + Q[1]]];
    }

    fn correct(&mut self, detection: &Detection) {
        let [[p, c], [_, v]] = self.P;
        let S = p + R;
        let K = [p / S, c / S];
        let y = detection.position_m.extend(detection.z_m) - self.x_m;
        self.x_m += K[0] * y;
        self.v_mps += K[1] * y;
        let c_next = (1.0 - K[0]) * c;
        self.P = [[(1.0 - K[0]) * p, c_next], [c_next, v - K[1] * c]];
        self.see(detection);
    }

    fn see(&mut self, detection: &Detection) {
        self.points = detection.points;
        self.top_m = detection.top_m;
        self.aabb = detection.aabb.moved_by(-detection.position_m);
        self.obb = detection.obb.moved_by(-detection.position_m, 0.0);
    }

    fn state(&self) -> State {
        let [[p, c], [_, v]] = self.P;
        State {
            x: [self.x_m.x, self.x_m.y, self.v_mps.x, self.v_mps.y],
            P: [[p, 0.0, c, 0.0], [0.0, p, 0.0, c], [c, 0.0, v, 0.0], [0.0, c, 0.0, v]],
        }
    }

    fn track(&mut self, time_ns: i64, step_s: f64) -> Track {
        let state = self.state();
        let (position_m, velocity_mps) = (state.position_m(), state.velocity_mps());
        self.heading.follow(&state, step_s);
        self.observed.push(time_ns, position_m, velocity_mps);
        Track {
            id: self.id,
            position_m,
            velocity_mps,
            covariance: state.P,
            heading_rad: self.heading.mean_rad,
            heading_sigma_rad: self.heading.sigma_rad(),
            heading_behind: 0.0,
            height_m: self.top_m,
            height_sigma_m: 0.0,
            width_scale: 1.0,
            width_scale_sigma: WIDTH_SCALE_SIGMA,
            outline_m: Default::default(),
            canopy: None,
            gait: Gait::UNKNOWN,
            points: self.points,
            confirmed: true,
            part_of: None,
            aabb: self.aabb.moved_by(position_m),
            obb: self.obb.moved_by(position_m, 0.0),
            observed: self.observed.0.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steady_gains_are_those_measured_on_the_original() {
        let aabb = Aabb { min_m: DVec3::ZERO, max_m: DVec3::ONE };
        let detection = Detection {
            position_m: DVec2::ZERO,
            covariance_m2: None,
            z_m: 0.9,
            time_ns: 0,
            points: 30,
            gait: None,
            reaches: Vec::new(),
            bands: Default::default(),
            overhead: None,
            facing: None,
            full_body: true,
            top_m: 1.0,
            top_diagonal_m: 0.2,
            aabb,
            obb: Obb::from_aabb(&aabb),
        };
        let mut person = Person::born(0, &detection);
        for _ in 0..300 {
            person.predict(0.1);
            person.correct(&detection);
        }
        // K = P H' / R after the update: 0.355 for the position, 0.180 for the velocity.
        let P = person.P;
        assert!((P[0][0] / R - 0.355).abs() < 1e-3 && (P[0][1] / R - 0.180).abs() < 1e-3, "{P:?}");
    }
}
