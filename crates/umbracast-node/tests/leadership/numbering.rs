//! What stands for a tracker: it numbers bodies by birth.

use std::collections::{BTreeMap, BTreeSet};

use umbracast::geometry::DVec2;
use umbracast_node::lead::{Frame, Said};
use umbracast_node::seat::Work;

use super::FRAME_NS;

/// What front ends saw at an instant.
#[derive(Clone)]
pub struct Seen {
    pub time_ns: i64,
    pub closed_ns: i64,
    pub bodies: BTreeSet<u64>,
}

/// Numbers bodies as a tracker numbers people: by birth.
#[derive(Clone, Default)]
pub struct Numbering {
    pub last_ns: i64,
    pub next: u64,
    /// The number of each body, and how many frames it has not been seen.
    pub people: BTreeMap<u64, (u64, u32)>,
}

#[derive(Clone)]
pub struct Results {
    pub time_ns: i64,
    pub said: Said,
    /// Everybody's, ascending, and whose it is.
    pub numbers: Vec<u64>,
    pub bodies: Vec<u64>,
}

impl Results {
    pub fn of(time_ns: i64, mut people: Vec<(u64, u64)>) -> Self {
        people.sort_unstable();
        let (numbers, bodies): (Vec<u64>, Vec<u64>) = people.into_iter().unzip();
        let digest = numbers.iter().fold(0, |digest: u64, number| {
            digest.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(number + 1)
        });
        let places_m = bodies.iter().map(|body| DVec2::new(*body as f64, 0.0)).collect();
        let said = Said { priors_ns: time_ns + FRAME_NS, numbers: digest, places_m };
        Self { time_ns, said, numbers, bodies }
    }
}

impl Work for Numbering {
    type Input = Seen;
    type Results = Results;
    type State = Self;

    fn step(&mut self, seen: Seen) -> Option<Frame<Results>> {
        if seen.time_ns <= self.last_ns {
            return None;
        }
        self.last_ns = seen.time_ns;
        self.people.retain(|body, (_, unseen)| {
            *unseen = if seen.bodies.contains(body) { 0 } else { *unseen + 1 };
            *unseen < 3
        });
        for &body in &seen.bodies {
            self.people.entry(body).or_insert_with(|| {
                self.next += 1;
                (self.next - 1, 0)
            });
        }
        let people = self.people.iter().map(|(&body, &(number, _))| (number, body)).collect();
        let results = Results::of(seen.time_ns, people);
        Some(Frame { said: results.said.clone(), next_number: self.next, closed_ns: seen.closed_ns, results })
    }

    fn next_number(&self) -> u64 {
        self.next
    }

    fn take_up(&mut self, state: &Self) -> bool {
        *self = state.clone();
        true
    }

    fn numbers(&self) -> Vec<u64> {
        self.people.values().map(|(number, _)| *number).collect()
    }

    fn renumber(&mut self, number: impl Fn(u64) -> u64, next: u64) {
        self.people.values_mut().for_each(|(old, _)| *old = number(*old));
        self.next = next;
    }

    fn numbers_of(results: &Results) -> &[u64] {
        &results.numbers
    }

    fn renumber_results(results: &mut Results, number: impl Fn(u64) -> u64) {
        let people = results.numbers.iter().zip(&results.bodies).map(|(&old, &body)| (number(old), body));
        *results = Results::of(results.time_ns, people.collect());
    }
}
