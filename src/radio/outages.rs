//! In which samples each link is out, and at which steps.

use super::reflection::Surface;
use crate::blockage::lanes::WORD;
use crate::blockage::trajectories::MOMENTS;

/// A bit for each sample of each way at each step; step 0 is now. Samples are joint: bit k of one way and of another belong to
/// the same future. A way below the number of access points is the straight one of that access point; its way by a reflection
/// is so many further on ([`Outages::reflected`]).
#[derive(Debug, Clone, Default)]
pub struct Outages {
    access_points: usize,
    people: usize,
    samples: usize,
    words: usize,
    bits: Vec<u32>,
    /// By way and person.
    beyond: Vec<u32>,
    /// By access point and person: what the beam of the way by a reflection is pointed at, and how many samples of that surface are
    /// out, over all steps. Empty where nothing reflects.
    surfaces: Vec<Option<(Surface, usize)>>,
}

impl Outages {
    /// So many samples of each straight way, none of them out.
    pub fn new(access_points: usize, people: usize, samples: usize) -> Self {
        let mut outages = Self::default();
        outages.begin(access_points, people, samples);
        outages
    }

    /// A way is out at a step of a sample.
    pub fn set(&mut self, way: usize, person: usize, step: usize, sample: usize) {
        let first = self.first(way, person, step);
        self.bits[first + sample / WORD] |= 1 << (sample % WORD);
    }

    /// Somebody cuts a way of a sample soon after the last step.
    pub fn set_beyond(&mut self, way: usize, person: usize, sample: usize) {
        self.beyond_mut(way, person)[sample / WORD] |= 1 << (sample % WORD);
    }

    /// A person's device can be reached over a reflection, which is not out.
    pub fn set_surface(&mut self, access_point: usize, person: usize, surface: Surface) {
        self.note_reflection(access_point, person, surface, std::iter::empty());
        self.and_beyond(self.access_points + access_point, person, &vec![0; self.words]);
    }

    /// No way is out.
    pub(super) fn begin(&mut self, access_points: usize, people: usize, samples: usize) {
        (self.access_points, self.people) = (access_points, people);
        (self.samples, self.words) = (samples, samples.div_ceil(WORD));
        self.bits.clear();
        self.bits.resize(access_points * people * MOMENTS * self.words, 0);
        self.beyond.clear();
        self.beyond.resize(access_points * people * self.words, 0);
        self.surfaces.clear();
    }

    /// Notes the samples of a way that lose the margin or more.
    pub(super) fn note(&mut self, way: usize, person: usize, step: usize, losses_db: &[f32], margin_db: f32) {
        let first = self.first(way, person, step);
        for (word, losses_db) in losses_db.chunks(WORD).enumerate() {
            let bits = losses_db.iter().enumerate();
            self.bits[first + word] = bits.fold(0, |all, (k, db)| all | u32::from(*db >= margin_db) << k);
        }
    }

    /// Notes another reflection of an access point for a person: by step, the losses of each sample and how much it can lose. The way
    /// is out where all of its reflections are; its surface is the one that is out in the fewest samples.
    pub(super) fn note_reflection<'a>(
        &mut self,
        access_point: usize,
        person: usize,
        surface: Surface,
        steps: impl Iterator<Item = (&'a [f32], f32)>,
    ) {
        if self.surfaces.is_empty() {
            let all = 2 * self.access_points * self.people * self.words;
            self.surfaces.resize(self.access_points * self.people, None);
            self.bits.resize(all * MOMENTS, 0);
            self.beyond.resize(all, 0);
        }
        let (link, way) = (access_point * self.people + person, self.access_points + access_point);
        let before = self.surfaces[link];
        if before.is_none() {
            self.beyond_mut(way, person).fill(!0);
        }
        let mut out = 0;
        for (step, (losses_db, left_db)) in steps.enumerate() {
            let first = self.first(way, person, step);
            for (word, losses_db) in losses_db.chunks(WORD).enumerate() {
                let bits = losses_db.iter().enumerate();
                let bits = bits.fold(0, |all, (k, db)| all | u32::from(*db >= left_db) << k);
                out += bits.count_ones() as usize;
                let word = &mut self.bits[first + word];
                *word = if before.is_some() { *word & bits } else { bits };
            }
        }
        if before.is_none_or(|(_, least)| out < least) {
            self.surfaces[link] = Some((surface, out));
        }
    }

    /// Somebody cuts a way soon in those samples alone in which its other reflections are cut, too.
    pub(super) fn and_beyond(&mut self, way: usize, person: usize, bits: &[u32]) {
        self.beyond_mut(way, person).iter_mut().zip(bits).for_each(|(all, bits)| *all &= bits);
    }

    /// To note the samples in which a way is cut soon after the last step.
    pub(super) fn beyond_mut(&mut self, way: usize, person: usize) -> &mut [u32] {
        let first = (way * self.people + person) * self.words;
        &mut self.beyond[first..first + self.words]
    }

    /// The samples in which somebody cuts a way within a second after the last step, if everybody walks straight on from there; in
    /// words of 32. None where the site does not say what changes cost, for nobody asks.
    pub fn beyond(&self, way: usize, person: usize) -> &[u32] {
        let first = (way * self.people + person) * self.words;
        &self.beyond[first..first + self.words]
    }

    /// How many people the ways end at, in order of confirmed tracks.
    pub fn people(&self) -> usize {
        self.people
    }

    /// How many samples count; bits beyond are 0.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// The way from an access point by a reflection, and what reflects; `None` where nothing does that is worth it.
    pub fn reflected(&self, access_point: usize, person: usize) -> Option<(usize, Surface)> {
        let (surface, _) = (*self.surfaces.get(access_point * self.people + person)?)?;
        Some((self.access_points + access_point, surface))
    }

    /// The samples in which a way is out at a step, in words of 32.
    pub fn of(&self, way: usize, person: usize, step: usize) -> &[u32] {
        let first = self.first(way, person, step);
        &self.bits[first..first + self.words]
    }

    fn first(&self, way: usize, person: usize, step: usize) -> usize {
        ((way * self.people + person) * MOMENTS + step) * self.words
    }
}
