//! Blockage of links by others, by the owner's own body, by the hall, and by any of them. All causes use the same
//! samples, because they depend on one another. The blockage by others is already known for each sample; this module
//! adds the owner and the hall.

use super::Chance;
use super::crossing::Crossing;
use super::figure::Figure;
use super::lanes::WORD;
use super::rays::Rays;
use super::shadows::Meeting;
use super::things::Things;
use super::trajectories::{MOMENTS, Trajectories};
use crate::STEPS;

/// When each sample of a link is first blocked: a bit by step and word; step 0 is now, and apart from what comes later.
#[derive(Debug, Clone, Default)]
pub(super) struct Firsts {
    words: usize,
    new: Vec<u32>,
}

impl Firsts {
    #[inline(always)]
    pub(super) fn begin(&mut self, words: usize) {
        self.words = words;
        self.new.clear();
        self.new.resize(MOMENTS * words, 0);
    }

    /// What of a word is blocked at a step for the first time.
    #[inline(always)]
    pub(super) fn note(&mut self, step: usize, word: usize, bits: u32) {
        self.new[step * self.words + word] = bits;
    }

    /// The same of bits that may have been blocked before.
    #[inline(always)]
    fn note_new(&mut self, step: usize, word: usize, bits: u32) {
        let new = if step == 0 { bits } else { bits & !self.met(step, word) };
        self.note(step, word, new);
    }

    /// Blocked at a step after now and before this one.
    #[inline(always)]
    fn met(&self, step: usize, word: usize) -> u32 {
        (1..step).fold(0, |met, step| met | self.first_at(step, word))
    }

    /// What of a word is blocked at a step for the first time.
    #[inline(always)]
    pub(super) fn first_at(&self, step: usize, word: usize) -> u32 {
        self.new[step * self.words + word]
    }

    fn chance(&self, samples: usize) -> Chance {
        self.chance_with(&[], samples)
    }

    /// Of a sample that is blocked in this or in one of the others.
    fn chance_with(&self, others: &[&Self], samples: usize) -> Chance {
        let count = |word: usize, bits: u32| {
            let all = match samples - word * WORD {
                left if left < WORD => (1_u32 << left) - 1,
                _ => !0,
            };
            f64::from((bits & all).count_ones())
        };
        self.weighed_with(others, count, samples as f64)
    }

    /// The same of samples that do not weigh alike: `weigh` says what those of a word weigh whose bits are set, and `total` what all
    /// do.
    fn weighed_with(&self, others: &[&Self], weigh: impl Fn(usize, u32) -> f64, total: f64) -> Chance {
        let mut weights = [0.0; MOMENTS];
        for word in 0..self.words {
            let mut met = 0;
            for (step, weight) in weights.iter_mut().enumerate() {
                let new = others
                    .iter()
                    .fold(self.first_at(step, word), |bits, other| bits | other.first_at(step, word));
                *weight += weigh(word, new & !met);
                met = if step == 0 { 0 } else { met | new };
            }
        }
        let mut sum = 0.0;
        let p: [f64; STEPS] = std::array::from_fn(|w| {
            sum += weights[w + 1];
            sum / total
        });
        Chance { p_now: weights[0] / total, p }
    }
}

/// What the samples of one link said, for who weighs them by what else is known.
#[derive(Debug, Clone, Default)]
pub(super) struct Kept {
    /// When others block it first.
    pub(super) others: Firsts,
    /// When the time comes that `duration_s` tells.
    pub(super) overs: Firsts,
    own: Firsts,
    hall: Firsts,
    asks_own: bool,
    /// It counted as blocked now.
    pub(super) blocked_now: bool,
}

impl Kept {
    /// Takes what was asked last.
    pub(super) fn keep(
        &mut self,
        others: &Firsts,
        overs: &Firsts,
        causes: &Causes,
        asks_own: bool,
        blocked_now: bool,
    ) {
        self.others.clone_from(others);
        self.overs.clone_from(overs);
        self.own.clone_from(&causes.own);
        self.hall.clone_from(&causes.hall);
        (self.asks_own, self.blocked_now) = (asks_own, blocked_now);
    }

    /// In which samples any cause blocks it now, in words.
    pub(super) fn any_now(&self) -> impl Iterator<Item = u32> {
        let causes = [&self.others, &self.own, &self.hall];
        (0..self.others.words).map(move |word| causes.iter().fold(0, |bits, of| bits | of.first_at(0, word)))
    }

    /// The chances of the owner's body, of the hall and of any cause.
    pub(super) fn causes(&self, weigh: impl Fn(usize, u32) -> f64, total: f64) -> [Option<Chance>; 3] {
        let own = self.asks_own.then(|| self.own.weighed_with(&[], &weigh, total));
        let hall = self.hall.weighed_with(&[], &weigh, total);
        let any = self.others.weighed_with(&[&self.own, &self.hall], &weigh, total);
        [own, Some(hall), Some(any)]
    }
}

/// Asks the owner's body and the hall.
#[derive(Debug, Clone, Default)]
pub(super) struct Causes {
    own: Firsts,
    hall: Firsts,
    blocked: Vec<u32>,
    asked: Vec<u32>,
}

/// What is known of a link when its causes are asked.
pub(super) struct Known<'a> {
    /// By others, of this many samples.
    pub(super) others: &'a Firsts,
    pub(super) samples: usize,
    /// Whose link. Where the UE is off the axis, the gait is known.
    pub(super) person: &'a Trajectories,
    pub(super) number: usize,
}

impl Causes {
    /// The chances of `own` and `hall`, each where it is to be asked, and of any cause. `aim` lets the rays of a step be
    /// known.
    #[inline(always)]
    pub(super) fn of(
        &mut self,
        known: &Known,
        figure: &Figure,
        things: Option<&Things>,
        asks_own: bool,
        crossing: &mut Crossing,
        rays: &mut Rays,
        aim: impl Fn(&mut Rays, usize),
    ) -> [Option<Chance>; 3] {
        let Known { others, samples, person, number } = *known;
        let words = others.words;
        self.own.begin(words);
        self.hall.begin(words);
        if things.is_none() && !asks_own {
            return [None, Some(Chance::NONE), Some(others.chance(samples))];
        }
        for step in 0..MOMENTS {
            aim(rays, step);
            if let Some(things) = things {
                for word in 0..words {
                    self.hall.note_new(step, word, things.block(rays, word));
                }
            }
            if asks_own {
                self.ask_own(&Meeting::own(number, step), figure, crossing, rays, person);
            }
        }
        let own = asks_own.then(|| self.own.chance(samples));
        let hall = self.hall.chance(samples);
        [own, Some(hall), Some(others.chance_with(&[&self.own, &self.hall], samples))]
    }

    /// In which samples the owner's trunk or arms stand before the UE at a step; what was blocked before is not asked.
    #[inline(always)]
    fn ask_own(
        &mut self,
        own: &Meeting,
        figure: &Figure,
        crossing: &mut Crossing,
        rays: &Rays,
        person: &Trajectories,
    ) {
        let (words, step) = (self.own.words, own.step as usize);
        self.blocked.clear();
        self.blocked.resize(words, 0);
        self.asked.clear();
        self.asked.extend((0..words).map(|word| !self.own.met(step, word)));
        crossing.ask(figure, rays, own, person, 0..words, [&self.asked; 2], &mut self.blocked);
        for word in 0..words {
            self.own.note_new(step, word, self.blocked[word]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_cause_counts_a_sample_once_and_from_its_first_step_on() {
        let (mut others, mut hall) = (Firsts::default(), Firsts::default());
        others.begin(1);
        hall.begin(1);
        others.note(0, 0, 0b0001);
        others.note(3, 0, 0b0110);
        hall.note_new(2, 0, 0b0010);
        hall.note_new(3, 0, 0b1010);
        // What lies beyond the last sample does not count.
        hall.note_new(4, 0, 0b10000);
        let any = others.chance_with(&[&hall], 4);
        assert_eq!((any.p_now, any.p[0], any.p[1], any.p[2], any.p[8]), (0.25, 0.0, 0.25, 0.75, 0.75));
        assert_eq!(hall.chance(4).p[2], 0.5);
    }
}
