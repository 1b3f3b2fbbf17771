//! In which samples each link is out, and at which steps.

use crate::blockage::lanes::WORD;
use crate::blockage::trajectories::MOMENTS;

/// A bit for each sample of each link at each step; step 0 is now. Samples are joint: bit k of one link and of another belong to
/// the same future.
#[derive(Debug, Clone, Default)]
pub struct Outages {
    people: usize,
    samples: usize,
    words: usize,
    bits: Vec<u32>,
}

impl Outages {
    /// So many samples of each link, none of them out.
    pub fn new(access_points: usize, people: usize, samples: usize) -> Self {
        let mut outages = Self::default();
        outages.begin(access_points, people, samples);
        outages
    }

    /// A link is out at a step of a sample.
    pub fn set(&mut self, access_point: usize, person: usize, step: usize, sample: usize) {
        let first = self.first(access_point, person, step);
        self.bits[first + sample / WORD] |= 1 << (sample % WORD);
    }

    /// No link is out.
    pub(super) fn begin(&mut self, access_points: usize, people: usize, samples: usize) {
        (self.people, self.samples, self.words) = (people, samples, samples.div_ceil(WORD));
        self.bits.clear();
        self.bits.resize(access_points * people * MOMENTS * self.words, 0);
    }

    /// Notes the samples of a link that lose the margin or more.
    pub(super) fn note(
        &mut self,
        access_point: usize,
        person: usize,
        step: usize,
        losses_db: &[f32],
        margin_db: f32,
    ) {
        let first = self.first(access_point, person, step);
        for (word, losses_db) in losses_db.chunks(WORD).enumerate() {
            let bits = losses_db.iter().enumerate();
            self.bits[first + word] = bits.fold(0, |all, (k, db)| all | u32::from(*db >= margin_db) << k);
        }
    }

    /// How many people the links end at, in order of confirmed tracks.
    pub fn people(&self) -> usize {
        self.people
    }

    /// How many samples count; bits beyond are 0.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// The samples in which a link is out at a step, in words of 32.
    pub fn of(&self, access_point: usize, person: usize, step: usize) -> &[u32] {
        let first = self.first(access_point, person, step);
        &self.bits[first..first + self.words]
    }

    fn first(&self, access_point: usize, person: usize, step: usize) -> usize {
        ((access_point * self.people + person) * MOMENTS + step) * self.words
    }
}
