//! The probability that a link is blocked, now and within each window: all trajectories are sampled together from the
//! forecast's joint distribution, with body sizes, headings and the phase of the gait, and rays are cast in every
//! sample. The steps of a window, and links with a common blocker, are therefore correlated as in reality.

use std::collections::BTreeMap;

use super::asker::{Aim, Asker, Everybody, affordable};
use super::causes::Kept;
use super::counts::{Chances, Counts};
use super::draws::{Draws, Quantiles};
use super::figure::Figure;
use super::lanes::WORD;
use super::numbers::Numbers;
use super::trajectories::{MOMENTS, Trajectories};
use crate::Site;
use crate::elementary::wide;
use crate::forecast::Forecast;
use crate::geometry::DVec3;
use crate::shared::share;
use crate::site::{Hall, Ue};
use crate::track::Track;

/// Links that are asked in a row by whoever is free.
const RUN: usize = 64;
/// Threads share the links of a frame where the one before had so many body-ray tests: below, to begin a thread takes longer than
/// it saves.
const SHARED_FROM: usize = 1 << 17;

/// Samples of all people in one frame.
#[derive(Debug, Clone)]
pub struct Sampler {
    figure: Figure,
    /// By track: what a person's samples are made of, drawn once.
    draws: BTreeMap<u64, Draws>,
    quantiles: Quantiles,
    people: Vec<Trajectories>,
    /// How many of `people` are in the frame, the things of some of them behind all who have links.
    present: usize,
    /// How many of them have links.
    links_of: usize,
    /// How many samples each of them has, and the fewest that a frame may have.
    samples: usize,
    samples_min: usize,
    hall: Hall,
    /// As many as threads may ask.
    askers: Vec<Asker>,
    /// Meetings of all links of the last frame: the samples of the next one depend on it.
    asked: usize,
    chances: Vec<Chances>,
    /// What the samples of every link said since the draw; of no link where nobody weighs them anew.
    kept: Vec<Kept>,
    keeps: bool,
    /// How many of `kept` are of this draw.
    kept_links: usize,
}

/// Everybody's samples of one frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Drawn<'a> {
    /// People in order of confirmed tracks, then things of some of them, which have no links.
    pub(crate) bodies: &'a [Trajectories],
    /// How many are people.
    pub(crate) people: usize,
    /// How many samples of each count.
    pub(crate) samples: usize,
}

impl Sampler {
    /// Nobody is there yet.
    pub fn new(numbers: &Numbers, site: &Site) -> Self {
        Self {
            figure: Figure::new(&numbers.body),
            draws: BTreeMap::new(),
            quantiles: Quantiles::new(numbers.samples),
            people: Vec::new(),
            present: 0,
            links_of: 0,
            samples: numbers.samples,
            samples_min: numbers.samples_min,
            hall: site.hall.clone(),
            askers: vec![Asker::new(site)],
            asked: 0,
            chances: Vec::new(),
            kept: Vec::new(),
            // Nobody weighs the samples of devices whose place is known (`radio::Listener`).
            keeps: site.has_radio() && site.ue.spread_m > 0.0,
            kept_links: 0,
        }
    }

    wide! {
        /// Draws the trajectories of everybody who has links, and then of the things of some of them. A person's draws depend on the
        /// seed, the track and nothing else, so the samples of one frame and the next differ only by what the tracks learned.
        pub fn draw<'a>(
            &mut self,
            numbers: &Numbers,
            ue: &Ue,
            people: impl Iterator<Item = (&'a Track, &'a Forecast)> + Clone,
        ) = draw_avx2 or draw_portably
    }

    #[inline(always)]
    fn draw_portably<'a>(
        &mut self,
        numbers: &Numbers,
        ue: &Ue,
        people: impl Iterator<Item = (&'a Track, &'a Forecast)> + Clone,
    ) {
        self.links_of = people.clone().take_while(|(track, _)| track.confirmed).count();
        self.draws.retain(|&id, _| people.clone().any(|(track, _)| track.id == id));
        // Where there is more to ask than time allows, samples are left out, for all links alike; what is left is a sample of
        // the same distribution, for draws are in no order. A frame has about as much to ask as the one before.
        self.samples = numbers.samples.min(affordable(self.present, self.asked, numbers.samples_min));
        self.samples_min = numbers.samples_min;
        self.askers.iter_mut().for_each(Asker::begin);
        self.present = 0;
        for (track, forecast) in people {
            if self.people.len() == self.present {
                self.people.push(Trajectories::default());
            }
            let draws = self
                .draws
                .entry(track.id)
                .or_insert_with(|| Draws::new(&self.quantiles, numbers.seed, track.id));
            let person = &mut self.people[self.present];
            person.fill(numbers, &self.figure, draws, self.samples, track, forecast);
            person.hold(ue, draws);
            person.stand_on(&self.hall);
            person.walk(&self.figure, draws);
            self.present += 1;
        }
    }

    /// The samples of the frame that was drawn.
    pub(crate) fn drawn(&self) -> Drawn<'_> {
        Drawn { bodies: &self.people[..self.present], people: self.links_of, samples: self.samples }
    }

    /// Lets so many threads share the links of a frame. What is told of links does not depend on it.
    pub fn use_threads(&mut self, threads: usize) {
        let more = self.askers[0].clone();
        self.askers.resize(threads.max(1), more);
    }

    /// How many may share a frame.
    pub fn threads(&self) -> usize {
        self.askers.len()
    }

    /// Whether the frame before had more meetings than could be asked with all samples.
    pub fn takes_fewer(&self, numbers: &Numbers) -> bool {
        self.samples < numbers.samples
    }

    /// What becomes of the link between each access point and each person who has links, access points first. A link counts as
    /// blocked now from `threshold` on.
    pub fn ask(&mut self, ue: &Ue, aps_m: &[DVec3], threshold: f64) -> &[Chances] {
        let (samples, links) = (self.samples, aps_m.len() * self.links_of);
        self.chances.clear();
        self.chances.resize(links, Chances::default());
        self.kept_links = if self.keeps { links } else { 0 };
        self.kept.resize_with(self.kept.len().max(self.kept_links), Kept::default);
        let among = Everybody {
            figure: &self.figure,
            bodies: &self.people[..self.present],
            samples,
            samples_min: self.samples_min,
        };
        let mut kept = self.kept[..self.kept_links].chunks_mut(RUN);
        let runs = self.chances.chunks_mut(RUN).map(|chances| (chances, kept.next().unwrap_or_default()));
        let askers =
            if self.asked * samples < SHARED_FROM { &mut self.askers[..1] } else { &mut self.askers[..] };
        share(askers, runs.enumerate(), |asker, (run, (chances, kept))| {
            for (i, chances) in chances.iter_mut().enumerate() {
                let (ap, person) = ((run * RUN + i) / self.links_of, (run * RUN + i) % self.links_of);
                *chances = asker.ask(among, Aim { ue, ap, ap_m: aps_m[ap], person, threshold });
                if let Some(kept) = kept.get_mut(i) {
                    asker.keep(chances, kept);
                }
            }
        });
        self.asked = self.askers.iter().map(|asker| asker.asked).sum();
        &self.chances
    }

    /// In which samples any cause blocks a link of the last draw now, by its place among the links asked; in words. Nothing where
    /// nothing is kept.
    pub(super) fn blocked_now(&self, link: usize) -> impl Iterator<Item = u32> {
        self.kept[..self.kept_links].get(link).into_iter().flat_map(Kept::any_now)
    }

    /// What becomes of such a link if its samples weigh so much: as [`Self::ask`] tells it. `None` where nothing is kept.
    pub(super) fn weighed(&self, link: usize, weights: &[f32], threshold: f64) -> Option<Chances> {
        let kept = self.kept[..self.kept_links].get(link)?;
        let weigh = |word: usize, bits: u32| weight_of(&weights[word * WORD..], bits);
        let mut counts = Counts::default();
        for word in 0..self.samples.div_ceil(WORD) {
            let now = kept.others.first_at(0, word);
            counts.now += weigh(word, now);
            for step in 1..MOMENTS {
                let new = kept.others.first_at(step, word);
                counts.met[step] += weigh(word, new);
                counts.onset[step] += weigh(word, new & !now);
                counts.over[step] += weigh(word, kept.overs.first_at(step, word));
            }
        }
        let total = f64::from(weights[..self.samples].iter().sum::<f32>());
        counts.blocked_now = counts.now / total >= threshold;
        let [own, hall, any] = kept.causes(weigh, total);
        let mut chances = Chances { own, hall, any, ..counts.chances(total) };
        if counts.blocked_now != kept.blocked_now {
            // When a sample is in sight again was asked of the other kind of samples.
            chances.duration_s = [None; 3];
        }
        Some(chances)
    }
}

/// What the samples weigh whose bits are set.
fn weight_of(weights: &[f32], mut bits: u32) -> f64 {
    let mut sum = 0.0;
    while bits != 0 {
        sum += f64::from(weights[bits.trailing_zeros() as usize]);
        bits &= bits - 1;
    }
    sum
}

#[cfg(test)]
#[path = "probability_tests.rs"]
mod tests;
