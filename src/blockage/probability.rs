//! The probability that a link is blocked, now and within each window: all trajectories are sampled together from the
//! forecast's joint distribution, with body sizes, headings and the phase of the gait, and rays are cast in every
//! sample. The steps of a window, and links with a common blocker, are therefore correlated as in reality.

use std::collections::BTreeMap;
use std::ops::Range;

use super::Chance;
use super::causes::{Causes, Firsts, Kept, Known};
use super::counts::{Chances, Counts};
use super::crossing::Crossing;
use super::draws::{Draws, Quantiles};
use super::figure::Figure;
use super::lanes::WORD;
use super::numbers::Numbers;
#[doc(hidden)] // For the fit of the body.
pub use super::phases::Phases;
use super::rays::{Near, Rays};
use super::shadows::{Meeting, Shadows};
use super::things::Things;
use super::trajectories::{Disc, MOMENTS, Trajectories};
use crate::Site;
use crate::elementary::wide;
use crate::forecast::Forecast;
use crate::geometry::DVec3;
use crate::site::{Hall, Ue};
use crate::track::Track;

/// Most body-ray tests of a frame: everybody who may stand in the way of somebody at a step, a meeting, times samples. Ten people
/// with two access points have a thousand meetings at most, and all samples.
const TESTS_MAX: usize = 1 << 18;
/// What a person takes of that by being seen and followed, which lasts as long as so many tests: a crowd's frame is not to last
/// longer for it. Forty people are left the fewest samples, which moves their F1 and calibration by less than .002.
const TESTS_PER_PERSON: usize = 6000;
/// Room from the start for the meetings of one link at a step in a crowd, so that a step allocates nothing.
const MEETINGS: usize = 1 << 7;
/// Fewer samples are not taken: a probability of 0.5 is then 0.09 off (one sigma).
const SAMPLES_MIN: usize = WORD;

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
    /// How many samples each of them has.
    samples: usize,
    /// As they fall from the access point `seen_from`.
    shadows: Shadows,
    /// By number; `None` after a draw.
    seen_from: Option<usize>,
    /// Who may stand in the way of the link that was asked last, by step.
    meetings: [Vec<Meeting>; MOMENTS],
    /// Meetings of all links that were asked since the draw: the samples of the next frame depend on it.
    asked: usize,
    rays: Rays,
    crossing: Crossing,
    link: Link,
    hall: Hall,
    things: Things,
    causes: Causes,
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

/// From which access point to whose UE.
#[derive(Debug, Clone, Copy)]
struct Aim<'a> {
    ue: &'a Ue,
    ap_m: DVec3,
    person: usize,
}

/// A link's samples: a bit each, words of [`WORD`].
#[derive(Debug, Clone, Default)]
struct Link {
    /// Blocked at the step that is looked at.
    blocked: Vec<u32>,
    /// Blocked now.
    now: Vec<u32>,
    /// Blocked at a step after now.
    met: Vec<u32>,
    /// The time that `duration_s` tells has come.
    over: Vec<u32>,
    /// What is to be asked height by height of the body that is looked at.
    trunk: Vec<u32>,
    arms: Vec<u32>,
    /// Blocked for the first time.
    firsts: Firsts,
    /// The time that `duration_s` tells comes.
    overs: Firsts,
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
            shadows: Shadows::with_room(MEETINGS),
            seen_from: None,
            meetings: std::array::from_fn(|_| Vec::with_capacity(MEETINGS)),
            asked: 0,
            rays: Rays::default(),
            crossing: Crossing::default(),
            link: Link::default(),
            hall: site.hall.clone(),
            things: Things::new(site),
            causes: Causes::default(),
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
        self.samples = numbers.samples.min(affordable(self.present, self.asked));
        (self.present, self.asked, self.seen_from, self.kept_links) = (0, 0, None, 0);
        for (track, forecast) in people {
            if self.people.len() == self.present {
                self.people.push(Trajectories::default());
            }
            let draws = self
                .draws
                .entry(track.id)
                .or_insert_with(|| Draws::new(&self.quantiles, numbers.seed, track.id));
            self.people[self.present].fill(numbers, &self.figure, draws, self.samples, track, forecast);
            self.people[self.present].hold(ue, draws);
            self.people[self.present].stand_on(&self.hall);
            self.present += 1;
        }
    }

    /// The samples of the frame that was drawn.
    pub(crate) fn drawn(&self) -> Drawn<'_> {
        Drawn { bodies: &self.people[..self.present], people: self.links_of, samples: self.samples }
    }

    /// Whether the frame before had more meetings than could be asked with all samples.
    pub fn takes_fewer(&self, numbers: &Numbers) -> bool {
        self.samples < numbers.samples
    }

    wide! {
        /// What becomes of the link between access point `ap` and `person`. It counts as blocked now from `threshold` on. Each
        /// link is asked once a frame, those of an access point one after another.
        pub fn chances(
            &mut self, ue: &Ue, ap: usize, ap_m: DVec3, person: usize, threshold: f64,
        ) -> Chances = chances_avx2 or chances_portably
    }

    #[inline(always)]
    fn chances_portably(
        &mut self,
        ue: &Ue,
        ap: usize,
        ap_m: DVec3,
        person: usize,
        threshold: f64,
    ) -> Chances {
        let people = &self.people[..self.present];
        if self.seen_from != Some(ap) {
            self.shadows.fall(ap_m, ue, people);
            self.seen_from = Some(ap);
        }
        self.shadows.turn_to(people, person);
        self.meetings.iter_mut().for_each(Vec::clear);
        let samples = self.samples;
        let words = samples.div_ceil(WORD);
        self.link.begin(samples);
        let mut counts = Counts::default();
        let aim = Aim { ue, ap_m, person };
        self.take_step(aim, 0, 0..words, &mut counts);
        counts.blocked_now = counts.now / samples as f64 >= threshold;
        // Where nothing stands in the way of any sample now, nor of the first half of them later, that is taken for the rest
        // as well: some chance below a few per cent then counts as none.
        let half = words.div_ceil(2);
        for words in [0..half, half..words] {
            for step in 1..MOMENTS {
                self.take_step(aim, step, words.clone(), &mut counts);
            }
            if counts.now == 0.0 && counts.met == [0.0; MOMENTS] {
                break;
            }
        }
        self.count_unasked();
        let [own, hall, any] = self.ask_causes(ap, aim, words);
        let chances = Chances { own, hall, any, ..counts.chances(samples as f64) };
        if self.keeps {
            self.keep(&chances);
        }
        chances
    }

    /// Keeps what the samples of the link that was just asked said.
    fn keep(&mut self, chances: &Chances) {
        if self.kept.len() == self.kept_links {
            self.kept.push(Kept::default());
        }
        let Link { firsts, overs, .. } = &self.link;
        self.kept[self.kept_links].keep(
            firsts,
            overs,
            &self.causes,
            chances.own.is_some(),
            chances.blocked_now,
        );
        self.kept_links += 1;
    }

    /// In which samples any cause blocks a link of the last draw now, by its place among the links asked; in words. Nothing where
    /// nothing is kept.
    pub(super) fn blocked_now(&self, link: usize) -> impl Iterator<Item = u32> {
        self.kept[..self.kept_links].get(link).into_iter().flat_map(Kept::any_now)
    }

    /// What becomes of such a link if its samples weigh so much: as [`Self::chances`]. `None` where nothing is kept.
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

    /// The same by the owner's body, by the hall, and by any cause.
    #[inline(always)]
    fn ask_causes(&mut self, ap: usize, aim: Aim, words: usize) -> [Option<Chance>; 3] {
        let (asks_own, Aim { ue, ap_m, person: number }) = (!aim.ue.is_on_axis(), aim);
        if asks_own {
            self.people[number].walk(&self.figure, &self.draws);
        }
        let (person, [reach_m, rises_m]) = (&self.people[number], ue.reach_m());
        let disc = Disc { radius_m: person.second.radius_m + reach_m, ..person.second };
        let lowest_m = ue.height_share * person.heights_m[0] + person.floors_m[0] - rises_m;
        let in_way = self.things.look(ap, ap_m, disc, lowest_m);
        let things = in_way.then_some(&self.things);
        let known = Known { others: &self.link.firsts, samples: self.samples, person, number };
        let aim = |rays: &mut Rays, step: usize| rays.aim(ap_m, ue, person, step, 0..words);
        let (crossing, rays) = (&mut self.crossing, &mut self.rays);
        self.causes.of(&known, &self.figure, things, asks_own, crossing, rays, aim)
    }

    /// What these words of samples show of a link at a step.
    #[inline(always)]
    fn take_step(&mut self, aim: Aim, step: usize, words: Range<usize>, counts: &mut Counts) {
        self.link.blocked[words.clone()].fill(0);
        let blocked_now = counts.blocked_now;
        let mut met = 0;
        while self.link.is_open(words.clone(), step, blocked_now) && self.finds(met, step) {
            if met == 0 {
                if !aim.ue.is_on_axis() {
                    self.people[aim.person].walk(&self.figure, &self.draws);
                }
                self.rays.aim(aim.ap_m, aim.ue, &self.people[aim.person], step, words.clone());
            }
            self.mark(met, step, words.clone(), blocked_now);
            met += 1;
        }
        self.link.count(step, self.samples, words, counts);
    }

    /// Whether there is a meeting of that number at a step: those before are known, and it is looked for now if it is not.
    #[inline(always)]
    fn finds(&mut self, meeting: usize, step: usize) -> bool {
        if meeting < self.meetings[step].len() {
            return true;
        }
        if meeting == 0 {
            self.shadows.line_up(step);
        }
        let found = self.shadows.next(&self.figure, &self.people[..self.present], step);
        self.meetings[step].extend(found);
        self.asked += usize::from(found.is_some());
        found.is_some()
    }

    /// Counts the meetings of a link that nobody had to look for, where the samples of the next frame depend on it: where they are the
    /// fewest already, more meetings change nothing.
    #[inline(always)]
    fn count_unasked(&mut self) {
        let people = &self.people[..self.present];
        for step in 0..MOMENTS {
            while affordable(self.present, self.asked) > SAMPLES_MIN
                && self.shadows.next(&self.figure, people, step).is_some()
            {
                self.asked += 1;
            }
        }
    }

    /// Notes in which samples a meeting blocks the link, where that matters still.
    #[inline(always)]
    fn mark(&mut self, meeting: usize, step: usize, words: Range<usize>, blocked_now: bool) {
        let (meeting, link) = (&self.meetings[step][meeting], &mut self.link);
        let other = &mut self.people[meeting.other as usize];
        other.walk(&self.figure, &self.draws);
        let [mut trunk, mut arms] = [0; 2];
        for word in words.clone() {
            let open = link.open(word, step, blocked_now);
            let near = match open {
                0 => Near::default(),
                _ => self.rays.near(other.own_figure(&self.figure), meeting, other, word, open),
            };
            link.blocked[word] |= near.surely;
            (link.trunk[word], link.arms[word]) = (near.trunk, near.arms);
            trunk |= link.trunk[word];
            arms |= link.arms[word];
        }
        let Link { blocked, .. } = link;
        let (figure, rays, crossing) = (other.own_figure(&self.figure), &self.rays, &mut self.crossing);
        if trunk | arms != 0 {
            crossing.ask(figure, rays, meeting, other, words, [&link.trunk, &link.arms], blocked);
        }
    }
}

/// What samples say of a link of which is known when each is lost. `lost(step)` are its bits, in words; the link counts as lost
/// now from `threshold` on.
pub(crate) fn chances_of<'a>(lost: impl Fn(usize) -> &'a [u32], samples: usize, threshold: f64) -> Chances {
    let (mut link, mut counts, words) = (Link::default(), Counts::default(), 0..samples.div_ceil(WORD));
    link.begin(samples);
    for step in 0..MOMENTS {
        link.blocked.copy_from_slice(lost(step));
        link.count(step, samples, words.clone(), &mut counts);
        if step == 0 {
            counts.blocked_now = counts.now / samples as f64 >= threshold;
        }
    }
    counts.chances(samples as f64)
}

/// How many samples there is time for, in whole words: with so many people, and so many meetings of all their links.
fn affordable(people: usize, meetings: usize) -> usize {
    let tests = TESTS_MAX.saturating_sub(TESTS_PER_PERSON * people);
    (tests / meetings.max(1)).max(SAMPLES_MIN) / WORD * WORD
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

impl Link {
    fn begin(&mut self, samples: usize) {
        let Self { blocked, now, met, over, trunk, arms, firsts, overs } = self;
        firsts.begin(samples.div_ceil(WORD));
        overs.begin(samples.div_ceil(WORD));
        for words in [blocked, now, met, over, trunk, arms] {
            words.clear();
            words.resize(samples.div_ceil(WORD), 0);
        }
    }

    /// Samples of which it is not known yet whether they are blocked at this step, and of which that still matters: once
    /// a sample has been blocked, only the end of that counts, and only where it is told.
    fn open(&self, word: usize, step: usize, blocked_now: bool) -> u32 {
        let (now, met, over) = (self.now[word], self.met[word], self.over[word]);
        let matters = match (step, blocked_now) {
            (0, _) => !0,
            (_, true) => !met | (now & !over),
            (_, false) => !met | (!now & !over),
        };
        matters & !self.blocked[word]
    }

    #[inline(always)]
    fn is_open(&self, mut words: Range<usize>, step: usize, blocked_now: bool) -> bool {
        words.any(|word| self.open(word, step, blocked_now) != 0)
    }

    /// Takes what a step has shown.
    #[inline(always)]
    fn count(&mut self, step: usize, samples: usize, words: Range<usize>, counts: &mut Counts) {
        for word in words {
            let all = match samples - word * WORD {
                left if left < WORD => (1_u32 << left) - 1,
                _ => !0,
            };
            let blocked = self.blocked[word] & all;
            let ones = |bits: u32| f64::from(bits.count_ones());
            if step == 0 {
                self.now[word] = blocked;
                self.firsts.note(step, word, blocked);
                counts.now += ones(blocked);
                continue;
            }
            let (now, met) = (self.now[word], self.met[word]);
            let over = match counts.blocked_now {
                true => now & !self.over[word] & !blocked,
                false => met & !now & !self.over[word] & !blocked,
            };
            let new = blocked & !met;
            self.firsts.note(step, word, new);
            self.overs.note(step, word, over);
            self.over[word] |= over;
            self.met[word] |= new;
            counts.met[step] += ones(new);
            counts.onset[step] += ones(new & !now);
            counts.over[step] += ones(over);
        }
    }
}

#[cfg(test)]
#[path = "probability_tests.rs"]
mod tests;
