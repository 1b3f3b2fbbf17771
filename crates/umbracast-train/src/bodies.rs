//! Whose bodies fits learn from: our own and the third-party family `a`. Family `b` is for tests alone (`tests/tidy.rs`).

use std::sync::Arc;

use umbracast::Error;
use umbracast_sim::body::Bodies;
use umbracast_sim::body::kind::Kind;
use umbracast_sim::body::meshes::Meshes;

/// What some of them carry, with shares; who is left over carries nothing.
const CARRIED: [(Kind, f64); 4] =
    [(Kind::Phone, 0.15), (Kind::Pockets, 0.15), (Kind::Bag, 0.15), (Kind::Rucksack, 0.15)];

/// What goes with others, or how they are and move. Nothing was fitted to bags in both hands, a child on the arm, a trolley and a
/// wheelchair that somebody pushes, and outlines alone to a telephone before the face.
const THINGS: [(Kind, f64); 6] = [
    (Kind::Child, 0.15),
    (Kind::Wheelchair, 0.15),
    (Kind::Pram, 0.15),
    (Kind::Frame, 0.15),
    (Kind::Umbrella, 0.15),
    (Kind::Gesturing, 0.15),
];

/// How many [`bodies`] there are.
pub(crate) const TURNS: u64 = 4;

/// In turn our own, family `a`, our own of whom some carry something, and the same of family `a`.
///
/// # Errors
/// None, as long as the family that ships can be read.
pub(crate) fn bodies(turn: u64) -> Result<Bodies, Error> {
    ours_or_family_a(turn, if turn % TURNS < 2 { vec![] } else { CARRIED.to_vec() })
}

/// The same, then our own with [`THINGS`] among them, and the same of family `a`.
///
/// # Errors
/// See [`bodies`].
pub(crate) fn with_things(turn: u64) -> Result<Bodies, Error> {
    match turn % (TURNS + 2) {
        turn if turn < TURNS => bodies(turn),
        turn => ours_or_family_a(turn, THINGS.to_vec()),
    }
}

fn ours_or_family_a(turn: u64, shares: Vec<(Kind, f64)>) -> Result<Bodies, Error> {
    let bodies = Bodies::new(shares, None)?;
    if turn.is_multiple_of(2) { Ok(bodies) } else { of_family_a(bodies) }
}

/// The same kinds, with the bodies of family `a`.
///
/// # Errors
/// See [`bodies`].
pub(crate) fn of_family_a(bodies: Bodies) -> Result<Bodies, Error> {
    Ok(bodies.of(Arc::new(Meshes::family("a")?)))
}
