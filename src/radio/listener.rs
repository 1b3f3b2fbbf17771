//! Links told anew with what was heard of them. A LiDAR sees neither a hand nor the telephone in it; an access point hears when the
//! link to it is cut.
//!
//! Where it is known whose a device is, its reports say whether the link was in sight a moment ago: at the edge of a straight screen
//! a wave loses 6 dB, whatever its length. That is compared with what the link's samples said of the same instant. Samples that
//! were right gain weight. Where none is, the samples miss something: a hand at the ear, an arm, a bag. Then the link is taken to
//! stay as it is heard for a while. A hidden Markov model of three states weighs both: the samples are right, the link is blocked
//! though they say otherwise, or it is in sight though they say otherwise.

use std::collections::BTreeMap;

use super::bindings::{Binder, Heard, LATE_NS};
use crate::blockage::lanes::WORD;
use crate::blockage::{Blockage, Caster, Chance};
use crate::track::Track;
use crate::{STEP_S, STEPS, Site};

/// What a wave loses at the edge of a straight screen, dB.
const EDGE_DB: f64 = 6.0;
/// How far from there a link is in sight, or is not, with odds of e: noise, fringes, and edges that are not straight, dB.
const SOFT_DB: f64 = 1.0;
/// A link that is heard to be in sight is blocked all the same with this chance, and the other way round.
const AMISS: f64 = 0.01;
/// What the samples miss lasts so long, seconds. This and what follows was chosen on the scenes of seeds 132900 to 132903, whose
/// devices are in hands that move, at 28 GHz.
const LASTS_S: f64 = 0.35;
/// How much of the time samples miss something, at most. A device whose place differs by so many metres from one hand to another
/// (`spread_m`) is elsewhere for as large a share of the time; where its place is known, nothing is told anew, for LiDARs see better
/// what is in sight than 6 dB do.
const MISSES_MAX: f64 = 0.2;
/// Who is blocked where samples say otherwise comes in sight, and the other way round, so often a second.
const TURNS_HZ: f64 = 0.3;
/// A sample that was right a moment ago need not be so at the next step: what was heard weighs it by this power of its likelihood, for
/// each share of the time that samples miss something: where LiDARs see all that matters, there is nothing to learn.
const FITS: f64 = 2.0;
/// What was heard a frame before counts for this share of that, and what was earlier by less; within so long, seconds, errors change.
const BEFORE: f64 = 0.3;
const ALIKE_S: f64 = 0.5;

/// Weighs what is foreseen by what is heard.
#[derive(Debug, Clone)]
pub struct Listener {
    misses: f64,
    /// The last frames, oldest first.
    frames: Vec<Seen>,
    /// By access point and track.
    links: BTreeMap<(usize, u64), Link>,
    weights: Vec<f32>,
}

/// In which samples of a frame each link was blocked, in words.
#[derive(Debug, Clone, Default)]
struct Seen {
    time_ns: i64,
    tracks: Vec<u64>,
    words: usize,
    blocked: Vec<u32>,
}

/// What was heard of a link.
#[derive(Debug, Clone)]
struct Link {
    /// When last.
    heard_ns: i64,
    states: States,
    /// Of each sample, the logarithm of how well it fits what was heard.
    fits: Vec<f32>,
}

/// How likely the samples are right, the link is blocked against them, and it is in sight against them.
type States = [f64; 3];

impl Listener {
    /// Needs how well it is known where devices are.
    pub fn new(site: &Site) -> Self {
        let misses = site.ue.spread_m.min(MISSES_MAX);
        Self { misses, frames: Vec::new(), links: BTreeMap::new(), weights: Vec::new() }
    }

    /// Tells those links anew of whose devices something was heard. `blockages` are those of the last cast, and `binder` has compared
    /// the same frame.
    pub fn sharpen(
        &mut self,
        time_ns: i64,
        tracks: &[Track],
        caster: &Caster,
        binder: &Binder,
        blockages: &mut [Blockage],
    ) {
        if self.misses == 0.0 || binder.is_idle() {
            self.frames.clear();
            self.links.clear();
            return;
        }
        self.see(time_ns, tracks, caster, blockages.len());
        for heard in binder.heard().chunk_by(Heard::is_of_same_link) {
            self.listen(heard, caster.samples_asked());
        }
        self.links.retain(|_, link| time_ns - link.heard_ns < LATE_NS);
        for (place, blockage) in blockages.iter_mut().enumerate() {
            let Some(link) = self.links.get(&(blockage.access_point, blockage.track)) else { continue };
            self.weights.clear();
            self.weights.extend(link.fits.iter().map(|fit| fit.exp()));
            self.weights.resize(link.fits.len().next_multiple_of(WORD), 0.0);
            caster.weigh(place, &self.weights, blockage);
            let states = moved(link.states, self.misses, (time_ns - link.heard_ns) as f64 * 1e-9);
            tell(blockage, states, caster.threshold());
        }
    }

    /// Everybody has another number from now on.
    ///
    /// ```
    /// umbracast::radio::Listener::new(&umbracast::Config::default().site).renumber(|track| track + 1000);
    /// ```
    pub fn renumber(&mut self, number: impl Fn(u64) -> u64) {
        self.frames.iter_mut().flat_map(|frame| &mut frame.tracks).for_each(|track| *track = number(*track));
        let links = std::mem::take(&mut self.links).into_iter();
        self.links =
            links.map(|((access_point, track), link)| ((access_point, number(track)), link)).collect();
    }

    /// Keeps what a frame's samples say, and of the frames before as many as late reports may ask for.
    fn see(&mut self, time_ns: i64, tracks: &[Track], caster: &Caster, links: usize) {
        let mut seen = Seen::default();
        while self.frames.first().is_some_and(|frame| frame.time_ns < time_ns - LATE_NS) {
            seen = self.frames.remove(0);
        }
        seen.time_ns = time_ns;
        seen.tracks.clear();
        seen.tracks.extend(tracks.iter().filter(|track| track.confirmed).map(|track| track.id));
        seen.blocked.clear();
        (0..links).for_each(|link| seen.blocked.extend(caster.blocked_now(link)));
        seen.words = seen.blocked.len() / links.max(1);
        self.frames.push(seen);
    }

    /// Takes what was heard of one link since the last frame: the newest report, for older ones tell of where it was cut before.
    fn listen(&mut self, heard: &[Heard], asked: usize) {
        let later = |a: &&Heard, b: &&Heard| a.time_ns.cmp(&b.time_ns).then(a.p.total_cmp(&b.p));
        let Some(newest) = heard.iter().max_by(later) else { return };
        let heard_ns = newest.time_ns;
        let apart_ns = |seen: &&Seen| (seen.time_ns - heard_ns).abs();
        let Some(seen) = self.frames.iter().min_by_key(apart_ns) else { return };
        // A method without samples is the authors': nothing is told beside it.
        let blocked = seen.of(newest.access_point, newest.track).filter(|words| !words.is_empty());
        let Some(blocked) = blocked else { return };
        let misses = self.misses;
        let unheard =
            || Link { heard_ns, states: [1.0 - misses, 0.5 * misses, 0.5 * misses], fits: vec![0.0; asked] };
        let link = self.links.entry((newest.access_point, newest.track)).or_insert_with(unheard);
        let seconds = (heard_ns - link.heard_ns).max(0) as f64 * 1e-9;
        let soft_db = (SOFT_DB * SOFT_DB + newest.variance).sqrt();
        let is_blocked = 1.0 / (1.0 + (-(newest.lost_db - EDGE_DB) / soft_db).exp());
        let is_blocked = AMISS + (1.0 - 2.0 * AMISS) * is_blocked;
        // Where the device is another's, what was heard says nothing of this link.
        let fits = |blocked: bool| {
            let fits = if blocked { is_blocked } else { 1.0 - is_blocked };
            newest.p * fits + (1.0 - newest.p) * 0.5
        };
        link.states = moved(link.states, misses, seconds);
        link.heard_ns = link.heard_ns.max(heard_ns);
        let alike = (BEFORE * (-seconds / ALIKE_S).exp()) as f32;
        let (mut right, mut all) = (0.0, 0.0);
        let logs = [false, true].map(|blocked| (FITS * misses * fits(blocked).ln()) as f32);
        for (k, fit) in link.fits.iter_mut().enumerate() {
            let Some(word) = blocked.get(k / WORD) else { break };
            let is_blocked = word >> (k % WORD) & 1 == 1;
            let before = f64::from((alike * *fit).exp());
            (right, all) = (right + before * fits(is_blocked), all + before);
            *fit = alike * *fit + logs[usize::from(is_blocked)];
        }
        let likely = [if all > 0.0 { right / all } else { 1.0 }, fits(true), fits(false)];
        link.states.iter_mut().zip(likely).for_each(|(p, likely)| *p *= likely);
        let sum: f64 = link.states.iter().sum();
        link.states.iter_mut().for_each(|p| *p /= sum);
    }
}

/// What becomes of the states in a while.
fn moved([right, blocked, clear]: States, misses: f64, seconds: f64) -> States {
    let (over, turned) = (1.0 - (-seconds / LASTS_S).exp(), 0.5 - 0.5 * (-2.0 * TURNS_HZ * seconds).exp());
    let (stays, misses) = (1.0 - over, 0.5 * misses * over * right);
    [
        right - 2.0 * misses + over * (blocked + clear),
        misses + stays * (blocked * (1.0 - turned) + clear * turned),
        misses + stays * (clear * (1.0 - turned) + blocked * turned),
    ]
}

/// Tells a link as the states have it: what samples miss is over at each step with the same chance.
fn tell(blockage: &mut Blockage, [_, blocked, clear]: States, threshold: f64) {
    let lasts: [f64; STEPS + 1] = std::array::from_fn(|step| (-(step as f64) * STEP_S / LASTS_S).exp());
    let in_sight = |steps: usize| 1.0 - clear * lasts[steps];
    let known = |chance: &mut Chance| {
        chance.p_now *= in_sight(0);
        chance.p.iter_mut().enumerate().for_each(|(w, p)| *p *= in_sight(w + 1));
    };
    let mut others = Chance { p_now: blockage.p_now, p: blockage.p };
    [Some(&mut others), blockage.own.as_mut(), blockage.hall.as_mut()].into_iter().flatten().for_each(known);
    (blockage.p_now, blockage.p) = (others.p_now, others.p);
    blockage.blocked = others.p.map(|p| p >= threshold);
    if blockage.blocked_now && others.p_now < threshold {
        (blockage.blocked_now, blockage.duration_s) = (false, [None; 3]);
    }
    if let Some(any) = &mut blockage.any {
        any.p_now = any.p_now * (in_sight(0) - blocked) + blocked;
        for (w, p) in any.p.iter_mut().enumerate() {
            let stays_blocked = blocked * lasts[1];
            *p = *p * (in_sight(w + 1) - stays_blocked) + stays_blocked;
        }
    }
}

impl Seen {
    /// `None` where the track was not there.
    fn of(&self, access_point: usize, track: u64) -> Option<&[u32]> {
        let person = self.tracks.iter().position(|id| *id == track)?;
        let first = (access_point * self.tracks.len() + person) * self.words;
        self.blocked.get(first..first + self.words)
    }
}

#[cfg(test)]
#[path = "listener_tests.rs"]
mod tests;
