//! Whose a return may be, of those who are expected.

use super::Prior;
use super::range_model::Near;
use crate::geometry::{DVec2, DVec3};

/// Nothing is learned within this distance of an expected person, and as much more as it is unsure where the person is,
/// at most as much again.
const FREEZE_M: f64 = 0.5;
/// What is new within this distance of furniture's middle is a part of it: half a large table.
const FURNITURE_M: f64 = 0.9;
/// Edge of the cells: a little more than twice the farthest reach, so that a return asks four of them.
const CELL_M: f64 = 4.1 * FREEZE_M;

/// Who is expected in a frame, by the place: a hall has many returns and many people, and a return is near a few.
#[derive(Debug, Clone, Default)]
pub(super) struct Presence {
    /// In order of their slots. Cells far apart may share one.
    expected: Vec<Expected>,
    /// Where each slot begins, and the last one ends.
    begins: Vec<u32>,
}

/// What is asked of a [`Prior`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Expected {
    slot: u32,
    is_furniture: bool,
    walked: bool,
    pub(super) position_m: DVec2,
    /// A return nearer than this may be theirs.
    pub(super) reach_m: f64,
}

impl Presence {
    /// Of another frame.
    pub(super) fn renew(&mut self, priors: &[Prior]) {
        let slots = priors.len().next_power_of_two();
        self.expected.clear();
        self.expected.extend(priors.iter().map(|prior| Expected {
            slot: slot_of(cell_of(prior.position_m), slots),
            is_furniture: prior.is_furniture,
            walked: prior.walked,
            position_m: prior.position_m,
            reach_m: if prior.is_furniture {
                FURNITURE_M
            } else {
                FREEZE_M + prior.position_sigma_m.min(FREEZE_M)
            },
        }));
        self.expected.sort_unstable_by_key(|expected| expected.slot);
        self.begins.clear();
        self.begins.resize(slots + 1, 0);
        for expected in &self.expected {
            self.begins[expected.slot as usize + 1] += 1;
        }
        for slot in 0..slots {
            self.begins[slot + 1] += self.begins[slot];
        }
    }

    /// Who is near a return that is not known to be furniture's.
    pub(super) fn near(&self, at_m: DVec3) -> Near {
        let mut near = Near::Nobody;
        for expected in self.around(at_m).filter(|expected| !expected.is_furniture) {
            near = match (near, expected.walked) {
                (Near::Nobody | Near::Unsure, false) => Near::Unsure,
                (Near::Nobody | Near::Walker, true) => Near::Walker,
                _ => return Near::Both,
            };
        }
        near
    }

    /// Somebody who stands still must not be learned.
    pub(super) fn is_somebodys(&self, at_m: DVec3) -> bool {
        self.around(at_m).any(|expected| !expected.is_furniture)
    }

    pub(super) fn is_furnitures(&self, at_m: DVec3) -> bool {
        self.around(at_m).any(|expected| expected.is_furniture)
    }

    /// Those who are no furniture.
    pub(super) fn people(&self) -> impl Iterator<Item = &Expected> {
        self.expected.iter().filter(|expected| !expected.is_furniture)
    }

    pub(super) fn has_furniture(&self) -> bool {
        self.expected.iter().any(|expected| expected.is_furniture)
    }

    /// All whose a return may be, in no order; somebody may come twice.
    fn around(&self, at_m: DVec3) -> impl Iterator<Item = &Expected> {
        let (at_m, slots) = (at_m.truncate(), self.begins.len().saturating_sub(1));
        let [x, y] = cell_of(at_m - DVec2::splat(0.5 * CELL_M));
        let cells = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]];
        let in_cell = move |cell| {
            let slot = slot_of(cell, slots.max(1)) as usize;
            // Nobody was ever expected before the first frame.
            self.begins
                .get(slot..slot + 2)
                .map_or(&[][..], |ends| &self.expected[ends[0] as usize..ends[1] as usize])
        };
        cells.into_iter().flat_map(in_cell).filter(move |expected| {
            expected.position_m.distance_squared(at_m) < expected.reach_m * expected.reach_m
        })
    }
}

fn cell_of(position_m: DVec2) -> [i64; 2] {
    (position_m / CELL_M).floor().to_array().map(|cell| cell as i64)
}

/// `slots` is a power of two.
fn slot_of([x, y]: [i64; 2], slots: usize) -> u32 {
    // Fibonacci hashing: neighbours lie apart.
    let mixed =
        (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
    (mixed >> 32) as u32 & (slots - 1) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prior(x: f64, y: f64, is_furniture: bool, walked: bool) -> Prior {
        Prior {
            position_m: DVec2::new(x, y),
            velocity_mps: DVec2::ZERO,
            position_sigma_m: 0.3 * (x + y).sin().abs(),
            height_m: 1.75,
            confirmed: true,
            walked,
            is_furniture,
            shape: None,
        }
    }

    #[test]
    fn a_return_is_whose_it_is_when_everybody_is_asked() {
        // About as crowded as a hall can be, and the returns among them and outside.
        let at = |k: u32, m: f64| f64::from(k.wrapping_mul(2_654_435_761) % 9973) / 9973.0 * m - 0.4 * m;
        for n in [0, 1, 2, 7, 60, 400] {
            let side_m = 2.0 + f64::from(n).sqrt();
            let priors: Vec<Prior> =
                (0..n).map(|k| prior(at(k, side_m), at(k + 5000, side_m), k % 5 == 0, k % 3 == 0)).collect();
            let mut presence = Presence::default();
            presence.renew(&priors);
            for k in 0..2000 {
                let at_m = DVec3::new(at(k + 77, side_m + 3.0), at(k + 9999, side_m + 3.0), 1.0);
                let within = |of: &&Prior, reach_m: f64| of.position_m.distance(at_m.truncate()) < reach_m;
                let reach_m = |of: &&Prior| FREEZE_M + of.position_sigma_m.min(FREEZE_M);
                let people: Vec<&Prior> =
                    priors.iter().filter(|of| !of.is_furniture && within(of, reach_m(of))).collect();
                let any = |walked: bool| people.iter().any(|of| of.walked == walked);
                let near = match (any(false), any(true)) {
                    (false, false) => Near::Nobody,
                    (true, false) => Near::Unsure,
                    (false, true) => Near::Walker,
                    (true, true) => Near::Both,
                };
                assert_eq!(presence.near(at_m), near, "{n} {at_m}");
                assert_eq!(presence.is_somebodys(at_m), !people.is_empty());
                let furniture = priors.iter().any(|of| of.is_furniture && within(&of, FURNITURE_M));
                assert_eq!(presence.is_furnitures(at_m), furniture, "{n} {at_m}");
            }
        }
    }

    #[test]
    fn nobody_is_near_before_the_first_frame() {
        assert_eq!(Presence::default().near(DVec3::ZERO), Near::Nobody);
    }
}
