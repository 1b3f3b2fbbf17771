//! A tracker's place among those of its hall: what it computes, and what of it is published. Pure: the caller gives messages and
//! the time of day, and sends what comes out.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::lead::{Frame, Lead, Said};

/// Frames that one that stands by may compute again, from a state of the leader: states come twice a second.
const RECENT: usize = 16;

/// What a tracker does with frames.
pub trait Work {
    /// A frame's input.
    type Input: Clone;
    /// What it makes of a frame.
    type Results;
    /// What another one needs to go on.
    type State;

    /// Computes a frame. Nothing comes of one that is not later than the last.
    fn step(&mut self, input: Self::Input) -> Option<Frame<Self::Results>>;

    /// The number of who is born next.
    fn next_number(&self) -> u64;

    /// Goes on where another one stood; false, and nothing is changed, where that cannot be.
    fn take_up(&mut self, state: &Self::State) -> bool;

    /// Everybody's number.
    fn numbers(&self) -> Vec<u64>;

    /// Everybody has another number, in the same order, and who is born next has `next`.
    fn renumber(&mut self, number: impl Fn(u64) -> u64, next: u64);

    /// Everybody's number in results.
    fn numbers_of(results: &Self::Results) -> &[u64];

    /// Everybody has another number in results.
    fn renumber_results(results: &mut Self::Results, number: impl Fn(u64) -> u64);
}

/// A tracker with its place.
#[derive(Debug)]
pub struct Seat<W: Work> {
    /// What it does.
    pub work: W,
    /// Where it stands beside the others.
    pub lead: Lead<W::Results>,
    recent: VecDeque<W::Input>,
}

impl<W: Work> Seat<W> {
    /// Stands by.
    pub fn new(work: W, lead: Lead<W::Results>) -> Self {
        Self { work, lead, recent: VecDeque::new() }
    }

    /// A frame; what is to be published now.
    pub fn frame(&mut self, input: W::Input, now_ns: impl Fn() -> i64) -> Option<W::Results> {
        self.recent.push_back(input.clone());
        if self.recent.len() > RECENT || self.lead.term().is_some() {
            self.recent.pop_front();
        }
        let frame = self.work.step(input)?;
        self.lead.done(frame, now_ns())
    }

    /// Another tracker's word. True where those who heard it have to be told again what holds.
    pub fn hear(&mut self, tracker: &str, term: u64, said: Said) -> bool {
        self.lead.hear(tracker, term, said)
    }

    /// The state of a leader. Taken up by one that does not know the leader's people: what was seen since is computed again.
    pub fn hear_state(&mut self, term: u64, state: &W::State, now_ns: i64) {
        if !self.lead.is_out_of_step() || self.lead.newest() != Some(term) || !self.work.take_up(state) {
            return;
        }
        self.lead.take_up(term, self.work.next_number());
        for input in self.recent.clone() {
            if let Some(frame) = self.work.step(input) {
                // It stands by: what comes of the frame is kept there.
                let _ = self.lead.done(frame, now_ns);
            }
        }
    }

    /// Takes over where that is due; what is to be published now.
    pub fn go_on(&mut self, now_ns: i64) -> Vec<W::Results> {
        self.lead.wake(now_ns);
        match self.lead.due_ns() {
            Some(due_ns) if due_ns <= now_ns => self.take_over(now_ns),
            _ => Vec::new(),
        }
    }

    /// Leads from now on; what is to be published now.
    pub fn take_over(&mut self, now_ns: i64) -> Vec<W::Results> {
        let mut taken = self.lead.take_over(now_ns);
        if let Some((from, to)) = taken.renumbered {
            let kept = taken.kept.iter().flat_map(|results| W::numbers_of(results).iter().copied());
            let all: BTreeSet<u64> =
                kept.chain(self.work.numbers()).filter(|number| *number >= from).collect();
            let new: BTreeMap<u64, u64> = all.into_iter().zip(to..).collect();
            let number = |old: u64| new.get(&old).copied().unwrap_or(old);
            self.work.renumber(number, to + new.len() as u64);
            taken.kept.iter_mut().for_each(|results| W::renumber_results(results, number));
        }
        self.recent.clear();
        taken.kept
    }
}
