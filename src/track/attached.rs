//! What goes with somebody's body and is too long and low to be one who walks: a wheelchair before its rider's trunk, a pram, a walking
//! frame. It is followed, for what is known to be there confuses nobody, and it is nobody.

use super::height::HEIGHT_MEAN_M;
use super::remembered::{Remembered, Words};
use crate::geometry::DVec2;

/// Its longest side in plan view is more than this share of its height: of people who walk, children among them, it is 0.35 to
/// 0.5, of prams and frames that are seen whole 0.6 and more. It is lower than this share of the body.
const LONG_SHARE: f64 = 0.55;
const HEIGHT_SHARE: f64 = 0.68;
/// Of a thing right before somebody who walks less need be seen, and of one so near that nobody could walk there nothing at all.
const LONG_SHARE_AHEAD: f64 = 0.5;
const NOBODY_AHEAD_M: f64 = 0.45;
/// What is so far to the side at most, and more ahead than aside, is right before somebody who walks at least so fast.
const ASIDE_M: f64 = 0.4;
const WALKS_MPS: f64 = 0.4;
/// It is no farther from the body's axis: arms, a handle, half a pram. And as fast.
pub(super) const REACH_M: f64 = 1.35;
const APART_MPS: f64 = 0.6;
/// After so long beside a body it is taken for a thing, and no longer is once it looked otherwise as long as it was with one, this
/// long at most.
const THING_AFTER_S: f64 = 0.3;
const LASTS_S: f64 = 2.0;
/// What is new and as low beside somebody is nobody until it has been watched for so long.
const DECIDED_AFTER_S: f64 = 0.8;

/// What is asked of a track.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beside {
    pub(super) id: u64,
    pub(super) position_m: DVec2,
    pub(super) velocity_mps: DVec2,
    /// As its track knows it: what others leave to see of a body is lower.
    pub(super) height_m: f64,
    /// The highest that it showed lately where a head would have been seen.
    pub(super) shown_top_m: f64,
    /// Of the box around it in plan view.
    pub(super) diagonal_m: f64,
}

impl Beside {
    /// How long a thing must be for its height to be one that this body pushes or pulls.
    fn long_share(&self, thing: &Self) -> f64 {
        let (off_m, speed_mps) = (thing.position_m - self.position_m, self.velocity_mps.length());
        let [ahead_m, aside_m] =
            [off_m.dot(self.velocity_mps) / speed_mps, off_m.perp_dot(self.velocity_mps) / speed_mps];
        let is_before = speed_mps > WALKS_MPS && aside_m.abs() < ahead_m.min(ASIDE_M);
        match is_before {
            true if ahead_m < NOBODY_AHEAD_M => 0.0,
            true => LONG_SHARE_AHEAD,
            false => LONG_SHARE,
        }
    }

    /// Whether it is what no adult looks like, whoever is near.
    fn is_long_and_low(&self) -> bool {
        self.shown_top_m < HEIGHT_SHARE * HEIGHT_MEAN_M && self.diagonal_m > LONG_SHARE * self.shown_top_m
    }

    /// Whether it is within reach of this body, and too low to be another like it.
    fn is_over(&self, thing: &Self) -> bool {
        self.position_m != thing.position_m // Nobody pushes himself.
            && thing.shown_top_m < HEIGHT_SHARE * self.height_m
            && thing.position_m.distance_squared(self.position_m) < REACH_M * REACH_M
    }

    /// Whether `thing` may be something that this body moves.
    fn may_move(&self, thing: &Self) -> bool {
        self.is_over(thing) && thing.velocity_mps.distance_squared(self.velocity_mps) < APART_MPS * APART_MPS
    }
}

/// For how long a track has gone with a body.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Attached {
    lasted_s: f64,
    is_thing: bool,
    /// The body that it was with last, where it was ever with one.
    owner: Option<u64>,
    watched_s: f64,
    /// New and low beside somebody: a thing or a child.
    is_undecided: bool,
}

impl Remembered for Attached {
    fn visit(&mut self, words: &mut impl Words) {
        words.f64(&mut self.lasted_s);
        words.bool(&mut self.is_thing);
        words.maybe_word(&mut self.owner);
        words.f64(&mut self.watched_s);
        words.bool(&mut self.is_undecided);
    }
}

impl Attached {
    /// True of what has gone with somebody's body for long enough.
    pub(super) fn is_thing(&self) -> bool {
        self.is_thing
    }

    /// Its owner has another number now.
    pub(super) fn renumber(&mut self, id: impl Fn(u64) -> u64) {
        self.owner = self.owner.map(id);
    }

    /// True while it is too new to be told from something that somebody moves.
    pub(super) fn is_undecided(&self) -> bool {
        self.is_undecided
    }

    /// Whose it is, if it is a thing.
    pub(super) fn part_of(&self) -> Option<u64> {
        self.owner.filter(|_| self.is_thing)
    }

    /// Looks at all within [`REACH_M`], `step_s` later; others may be among them, in any order.
    pub(super) fn look<'a>(
        &mut self,
        thing: &Beside,
        mut near: impl Iterator<Item = &'a Beside> + Clone,
        step_s: f64,
    ) {
        let is_long = |body: &Beside| thing.diagonal_m > body.long_share(thing) * thing.shown_top_m;
        let off_m2 = |body: &&Beside| body.position_m.distance_squared(thing.position_m);
        let bodies = near.clone().filter(|body| body.may_move(thing) && is_long(body));
        let nearest = bodies.min_by(|a, b| off_m2(a).total_cmp(&off_m2(b)).then(a.id.cmp(&b.id)));
        self.owner = nearest.map(|body| body.id).or(self.owner);
        if nearest.is_some() {
            self.lasted_s = (self.lasted_s + step_s).min(LASTS_S);
        } else if self.lasted_s < LASTS_S || !thing.is_long_and_low() {
            self.lasted_s = (self.lasted_s - step_s).max(0.0);
        }
        self.watched_s += step_s;
        // Of a body as new nothing but a prior tells the height; what it shows does.
        let is_low_beside =
            |body: &Beside| body.is_over(thing) && thing.shown_top_m < HEIGHT_SHARE * body.shown_top_m;
        self.is_undecided = self.watched_s < DECIDED_AFTER_S && near.any(is_low_beside);
        self.is_thing = self.lasted_s > if self.is_thing { 0.0 } else { THING_AFTER_S };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beside(x: f64, y: f64, shown_top_m: f64, diagonal_m: f64) -> Beside {
        let (position_m, velocity_mps) = (DVec2::new(x, y), DVec2::X);
        Beside { id: 0, position_m, velocity_mps, height_m: 1.75, shown_top_m, diagonal_m }
    }

    /// Whether it is a thing after a second beside somebody at the origin who walks along x.
    fn is_thing(thing: Beside) -> bool {
        let mut attached = Attached::default();
        (0..10).for_each(|_| attached.look(&thing, [thing, beside(0.0, 0.0, 1.75, 0.6)].iter(), 0.1));
        attached.is_thing()
    }

    #[test]
    fn what_is_pushed_is_a_thing_and_who_walks_along_is_none() {
        assert!(is_thing(beside(1.0, 0.0, 1.0, 0.7)), "a pram");
        assert!(is_thing(beside(1.0, 0.1, 1.1, 0.57)), "a pram of which others hide a part");
        assert!(is_thing(beside(0.42, 0.2, 0.95, 0.35)), "a leg of a walking frame");
        assert!(is_thing(beside(0.1, -0.6, 0.9, 0.8)), "a trolley at the side");
        assert!(!is_thing(beside(0.1, 0.45, 1.1, 0.5)), "a child at the hand");
        assert!(!is_thing(beside(0.7, 0.0, 1.1, 0.45)), "a child before its parents");
        assert!(!is_thing(beside(0.7, 0.0, 1.6, 0.9)), "an adult with a bag");
        assert!(!is_thing(beside(2.0, 0.0, 1.0, 0.7)), "too far away");
    }

    #[test]
    fn a_thing_has_the_nearest_owner_and_stays_one_when_a_crowd_hides_him() {
        let (pram, owner) = (beside(1.0, 0.0, 1.0, 0.7), Beside { id: 7, ..beside(0.0, 0.0, 1.75, 0.6) });
        let farther = Beside { id: 8, ..beside(-0.2, 0.1, 1.75, 0.6) };
        let mut attached = Attached::default();
        (0..30).for_each(|_| attached.look(&pram, [pram, farther, owner].iter(), 0.1));
        assert_eq!(attached.part_of(), Some(7));
        (0..100).for_each(|_| attached.look(&pram, [pram].iter(), 0.1));
        assert_eq!(attached.part_of(), Some(7), "nobody is as long and low");
        let stands_up = Beside { shown_top_m: 1.6, diagonal_m: 0.5, ..pram };
        (0..30).for_each(|_| attached.look(&stands_up, [stands_up].iter(), 0.1));
        assert_eq!(attached.part_of(), None, "it was somebody");
    }

    #[test]
    fn what_is_new_and_low_beside_somebody_is_nobody_yet() {
        let (child, parent) = (beside(0.1, 0.5, 1.1, 0.4), beside(0.0, 0.0, 1.75, 0.6));
        let mut attached = Attached::default();
        let after = |frames: u32, attached: &mut Attached| {
            (0..frames).for_each(|_| attached.look(&child, [child, parent].iter(), 0.1));
            attached.is_undecided()
        };
        assert_eq!([after(3, &mut attached), after(10, &mut attached)], [true, false]);
        let (mut among_children, other) = (Attached::default(), beside(0.5, 0.4, 1.2, 0.4));
        among_children.look(&child, [child, other].iter(), 0.1);
        assert!(!among_children.is_undecided());
    }
}
