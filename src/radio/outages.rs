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
    /// By link.
    beyond: Vec<u32>,
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

    /// Somebody cuts a link of a sample soon after the last step.
    pub fn set_beyond(&mut self, access_point: usize, person: usize, sample: usize) {
        self.beyond_mut(access_point, person)[sample / WORD] |= 1 << (sample % WORD);
    }

    /// No link is out.
    pub(super) fn begin(&mut self, access_points: usize, people: usize, samples: usize) {
        (self.people, self.samples, self.words) = (people, samples, samples.div_ceil(WORD));
        self.bits.clear();
        self.bits.resize(access_points * people * MOMENTS * self.words, 0);
        self.beyond.clear();
        self.beyond.resize(access_points * people * self.words, 0);
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

    /// To note the samples in which a link is cut soon after the last step.
    pub(super) fn beyond_mut(&mut self, access_point: usize, person: usize) -> &mut [u32] {
        let first = (access_point * self.people + person) * self.words;
        &mut self.beyond[first..first + self.words]
    }

    /// The samples in which somebody cuts a link within a second after the last step, if everybody walks straight on from there; in
    /// words of 32. None where the site does not say what changes cost, for nobody asks.
    pub fn beyond(&self, access_point: usize, person: usize) -> &[u32] {
        let first = (access_point * self.people + person) * self.words;
        &self.beyond[first..first + self.words]
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
