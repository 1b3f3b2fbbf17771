//! The matches of people and tracks as a table; every score uses this join of truth and tracks.

use std::collections::BTreeMap;

use umbracast_io::rows::{MatchRow, PeopleRow, TrackRow};

use crate::score::matching::match_scene;

/// The pairs of a scene, by frame and person.
pub fn of_scene(scene: u32, people: &[PeopleRow], tracks: &[TrackRow]) -> Vec<MatchRow> {
    let times_ns: BTreeMap<u64, i64> = people.iter().map(|row| (row.frame, row.time_ns)).collect();
    let pairs = match_scene(people, tracks).into_iter();
    pairs
        .map(|((frame, person), track)| MatchRow { scene, frame, time_ns: times_ns[&frame], person, track })
        .collect()
}
