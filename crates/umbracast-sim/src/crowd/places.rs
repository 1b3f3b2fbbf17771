//! Where people begin, go to and queue on a floor.

use glam::Vec2;
use rand::RngExt;

use super::floor::Floor;

/// Nobody's axis comes nearer to a wall or a thing.
pub(super) const ELBOW_M: f32 = 0.2;
/// From body to body in a queue.
const QUEUE_GAP_M: f32 = 0.8;

/// One of `places` that is so far from `others`; nearer where there is no room.
pub(super) fn drawn_apart(
    places: &[Vec2],
    others: &[Vec2],
    apart_m: f32,
    wanted: impl Fn(Vec2) -> bool,
    rng: &mut impl rand::Rng,
) -> Vec2 {
    let (mut shrink, mut refused) = (1.0, 0);
    while !places.is_empty() {
        let at = places[rng.random_range(0..places.len())];
        if wanted(at) && others.iter().all(|other| other.distance(at) >= shrink * apart_m) {
            return at;
        }
        refused += 1;
        if refused % 1000 == 0 {
            shrink *= 0.9;
        }
    }
    Vec2::ZERO
}

/// Where the one with so many before him stands: in the direction that has room for most.
pub(super) fn in_queue(floor: &Floor, place: Vec2, before: usize) -> Vec2 {
    let along = |turn: usize, k: usize| {
        place + Vec2::from_angle(turn as f32 * std::f32::consts::FRAC_PI_4) * (QUEUE_GAP_M * k as f32)
    };
    let room = |turn: usize| (1..10).take_while(|&k| floor.clear_at(along(turn, k)) > 2.0 * ELBOW_M).count();
    let turn = (0..8).max_by_key(|&turn| (room(turn), std::cmp::Reverse(turn))).unwrap_or_default();
    along(turn, before.min(room(turn)))
}
