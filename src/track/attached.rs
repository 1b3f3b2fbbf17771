//! What goes with somebody's body and is too long and low to be one who walks: a wheelchair before its rider's trunk, a pram, a walking
//! frame. It is followed, for what is known to be there confuses nobody, and it is nobody.

use super::remembered::{Remembered, Words};
use crate::geometry::DVec2;

/// Its longest side in plan view is more than this share of its height: of people who walk, children among them, it is 0.35 to
/// 0.5, of prams and frames 0.6 and more. It is lower than this share of the body.
const LONG_SHARE: f64 = 0.55;
const HEIGHT_SHARE: f64 = 0.75;
/// It is no farther from the body's axis: arms, a handle, half a pram. And as fast.
const REACH_M: f64 = 1.35;
const APART_MPS: f64 = 0.6;
/// After so long beside a body it is taken for a thing, and no longer is once it was elsewhere as long as it was with one, this long
/// at most.
const THING_AFTER_S: f64 = 0.3;
const LASTS_S: f64 = 2.0;

/// What is asked of a track.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beside {
    pub(super) position_m: DVec2,
    pub(super) velocity_mps: DVec2,
    /// As its track knows it: what others leave to see of a body is lower.
    pub(super) height_m: f64,
    /// Of the box around it in plan view.
    pub(super) diagonal_m: f64,
}

impl Beside {
    /// Whether `thing` may be something that this body moves.
    fn may_move(&self, thing: &Self) -> bool {
        thing.height_m < HEIGHT_SHARE * self.height_m
            && thing.position_m.distance_squared(self.position_m) < REACH_M * REACH_M
            && thing.velocity_mps.distance_squared(self.velocity_mps) < APART_MPS * APART_MPS
    }
}

/// For how long a track has gone with a body.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Attached {
    lasted_s: f64,
    is_thing: bool,
}

impl Remembered for Attached {
    fn visit(&mut self, words: &mut impl Words) {
        words.f64(&mut self.lasted_s);
        words.bool(&mut self.is_thing);
    }
}

impl Attached {
    /// True of what has gone with somebody's body for long enough.
    pub(super) fn is_thing(&self) -> bool {
        self.is_thing
    }

    /// Looks at everybody, `step_s` later.
    pub(super) fn look(&mut self, thing: &Beside, all: &[Beside], step_s: f64) {
        let goes_with =
            thing.diagonal_m > LONG_SHARE * thing.height_m && all.iter().any(|body| body.may_move(thing));
        self.lasted_s =
            if goes_with { (self.lasted_s + step_s).min(LASTS_S) } else { (self.lasted_s - step_s).max(0.0) };
        self.is_thing = self.lasted_s > if self.is_thing { 0.0 } else { THING_AFTER_S };
    }
}
