//! Asks one link after the other: who may stand in its way, in which samples somebody does, and what becomes of it. Links do not
//! depend on each other, so several askers may share those of a frame.

use std::ops::Range;

use super::Chance;
use super::causes::{Causes, Firsts, Kept, Known};
use super::counts::{Chances, Counts};
use super::crossing::Crossing;
use super::figure::Figure;
use super::lanes::WORD;
use super::rays::{Near, Rays};
use super::shadows::{Meeting, Shadows};
use super::things::Things;
use super::trajectories::{Disc, MOMENTS, Trajectories};
use crate::Site;
use crate::elementary::wide;
use crate::geometry::DVec3;
use crate::site::Ue;

/// Most body-ray tests of a frame: everybody who may stand in the way of somebody at a step, a meeting, times samples. Ten people
/// with two access points have a thousand meetings at most, and all samples.
const TESTS_MAX: usize = 1 << 18;
/// What a person takes of that by being seen and followed, which lasts as long as so many tests: a crowd's frame is not to last
/// longer for it. Forty people are left the fewest samples.
const TESTS_PER_PERSON: usize = 6000;
/// Room from the start for the meetings of one link at a step in a crowd, so that a step allocates nothing.
const MEETINGS: usize = 1 << 7;

/// What an asker remembers from link to link, and its buffers.
#[derive(Debug, Clone)]
pub(super) struct Asker {
    /// As bodies' shadows fall from the access point `seen_from`.
    shadows: Shadows,
    /// By number; `None` in a new frame.
    seen_from: Option<usize>,
    /// Who may stand in the way of the link that was asked last, by step.
    meetings: [Vec<Meeting>; MOMENTS],
    /// Meetings of all links that were asked in this frame: the samples of the next one depend on it.
    pub(super) asked: usize,
    rays: Rays,
    crossing: Crossing,
    link: Link,
    things: Things,
    causes: Causes,
}

/// The bodies of a frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Everybody<'a> {
    /// What nobody's own outline changes.
    pub(super) figure: &'a Figure,
    pub(super) bodies: &'a [Trajectories],
    /// How many samples of each count.
    pub(super) samples: usize,
    /// And the fewest that may.
    pub(super) samples_min: usize,
}

/// A link: from which access point to whose UE.
#[derive(Debug, Clone, Copy)]
pub(super) struct Aim<'a> {
    pub(super) ue: &'a Ue,
    /// By number, and where it is.
    pub(super) ap: usize,
    pub(super) ap_m: DVec3,
    pub(super) person: usize,
    /// It counts as blocked now from that probability on.
    pub(super) threshold: f64,
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

impl Asker {
    /// Nothing was asked yet.
    pub(super) fn new(site: &Site) -> Self {
        Self {
            shadows: Shadows::with_room(MEETINGS),
            seen_from: None,
            meetings: std::array::from_fn(|_| Vec::with_capacity(MEETINGS)),
            asked: 0,
            rays: Rays::default(),
            crossing: Crossing::default(),
            link: Link::default(),
            things: Things::new(site),
            causes: Causes::default(),
        }
    }

    /// A new frame.
    pub(super) fn begin(&mut self) {
        (self.asked, self.seen_from) = (0, None);
    }

    wide! {
        /// What becomes of a link. Each is asked once a frame, best those of an access point one after another.
        pub(super) fn ask(&mut self, among: Everybody<'_>, aim: Aim<'_>) -> Chances = ask_avx2 or ask_portably
    }

    #[inline(always)]
    pub(super) fn ask_portably(&mut self, among: Everybody, aim: Aim) -> Chances {
        if self.seen_from != Some(aim.ap) {
            self.shadows.fall(aim.ap_m, aim.ue, among.bodies);
            self.seen_from = Some(aim.ap);
        }
        self.shadows.turn_to(among.bodies, aim.person);
        self.meetings.iter_mut().for_each(Vec::clear);
        let samples = among.samples;
        let words = samples.div_ceil(WORD);
        self.link.begin(samples);
        let mut counts = Counts::default();
        self.take_step(among, aim, 0, 0..words, &mut counts);
        counts.blocked_now = counts.now / samples as f64 >= aim.threshold;
        // Where nothing stands in the way of any sample now, nor of the first half of them later, that is taken for the rest
        // as well: some chance below a few per cent then counts as none.
        let half = words.div_ceil(2);
        for words in [0..half, half..words] {
            for step in 1..MOMENTS {
                self.take_step(among, aim, step, words.clone(), &mut counts);
            }
            if counts.now == 0.0 && counts.met == [0.0; MOMENTS] {
                break;
            }
        }
        self.count_unasked(among);
        let [own, hall, any] = self.ask_causes(among, aim, words);
        Chances { own, hall, any, ..counts.chances(samples as f64) }
    }

    /// Keeps what the samples of the link that was just asked said.
    pub(super) fn keep(&self, chances: &Chances, kept: &mut Kept) {
        let Link { firsts, overs, .. } = &self.link;
        kept.keep(firsts, overs, &self.causes, chances.own.is_some(), chances.blocked_now);
    }

    /// The same by the owner's body, by the hall, and by any cause.
    #[inline(always)]
    fn ask_causes(&mut self, among: Everybody, aim: Aim, words: usize) -> [Option<Chance>; 3] {
        let Aim { ue, ap, ap_m, person: number, .. } = aim;
        let (asks_own, person, [reach_m, rises_m]) = (!ue.is_on_axis(), &among.bodies[number], ue.reach_m());
        let disc = Disc { radius_m: person.second.radius_m + reach_m, ..person.second };
        let lowest_m = ue.height_share * person.heights_m[0] + person.floors_m[0] - rises_m;
        let in_way = self.things.look(ap, ap_m, disc, lowest_m);
        let things = in_way.then_some(&self.things);
        let known = Known { others: &self.link.firsts, samples: among.samples, person, number };
        let aim = |rays: &mut Rays, step: usize| rays.aim(ap_m, ue, person, step, 0..words);
        let (crossing, rays) = (&mut self.crossing, &mut self.rays);
        self.causes.of(&known, among.figure, things, asks_own, crossing, rays, aim)
    }

    /// What these words of samples show of a link at a step.
    #[inline(always)]
    fn take_step(
        &mut self,
        among: Everybody,
        aim: Aim,
        step: usize,
        words: Range<usize>,
        counts: &mut Counts,
    ) {
        self.link.blocked[words.clone()].fill(0);
        let blocked_now = counts.blocked_now;
        let mut met = 0;
        while self.link.is_open(words.clone(), step, blocked_now) && self.finds(among, met, step) {
            if met == 0 {
                self.rays.aim(aim.ap_m, aim.ue, &among.bodies[aim.person], step, words.clone());
            }
            self.mark(among, met, step, words.clone(), blocked_now);
            met += 1;
        }
        self.link.count(step, among.samples, words, counts);
    }

    /// Whether there is a meeting of that number at a step: those before are known, and it is looked for now if it is not.
    #[inline(always)]
    fn finds(&mut self, among: Everybody, meeting: usize, step: usize) -> bool {
        if meeting < self.meetings[step].len() {
            return true;
        }
        if meeting == 0 {
            self.shadows.line_up(step);
        }
        let found = self.shadows.next(among.figure, among.bodies, step);
        self.meetings[step].extend(found);
        self.asked += usize::from(found.is_some());
        found.is_some()
    }

    /// Counts the meetings of a link that nobody had to look for, where the samples of the next frame depend on it: where they are the
    /// fewest already, more meetings change nothing.
    #[inline(always)]
    fn count_unasked(&mut self, among: Everybody) {
        for step in 0..MOMENTS {
            while affordable(among.bodies.len(), self.asked, among.samples_min) > among.samples_min
                && self.shadows.next(among.figure, among.bodies, step).is_some()
            {
                self.asked += 1;
            }
        }
    }

    /// Notes in which samples a meeting blocks the link, where that matters still.
    #[inline(always)]
    fn mark(
        &mut self,
        among: Everybody,
        meeting: usize,
        step: usize,
        words: Range<usize>,
        blocked_now: bool,
    ) {
        let (meeting, link) = (&self.meetings[step][meeting], &mut self.link);
        let other = &among.bodies[meeting.other as usize];
        let figure = other.own_figure(among.figure);
        let [mut trunk, mut arms] = [0; 2];
        for word in words.clone() {
            let open = link.open(word, step, blocked_now);
            let near = match open {
                0 => Near::default(),
                _ => self.rays.near(figure, meeting, other, word, open),
            };
            link.blocked[word] |= near.surely;
            (link.trunk[word], link.arms[word]) = (near.trunk, near.arms);
            trunk |= link.trunk[word];
            arms |= link.arms[word];
        }
        let Link { blocked, .. } = link;
        let (rays, crossing) = (&self.rays, &mut self.crossing);
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

/// How many samples there is time for, with so many people, and so many meetings of all their links: whole words, or `least`.
pub(super) fn affordable(people: usize, meetings: usize, least: usize) -> usize {
    let tests = TESTS_MAX.saturating_sub(TESTS_PER_PERSON * people);
    (tests / meetings.max(1) / WORD * WORD).max(least)
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
