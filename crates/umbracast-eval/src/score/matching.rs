//! Matches tracks and people, frame by frame (CLEAR: Bernardin and Stiefelhagen 2008).

use std::collections::BTreeMap;

use umbracast::geometry::DVec2;
use umbracast::track::association::{FORBIDDEN, optimal};
use umbracast_io::rows::{PeopleRow, TrackRow};

use crate::score::scene::Matching;

/// A track farther than this from a person is not that person's, metres.
pub const GATE_M: f64 = 0.5;

/// What a scene holds in one frame: people by `person`, confirmed tracks by `track`.
#[derive(Debug, Clone, Default)]
pub struct SceneFrame<'a> {
    /// Everybody in the scene.
    pub people: Vec<&'a PeopleRow>,
    /// Confirmed tracks.
    pub tracks: Vec<&'a TrackRow>,
}

/// The rows of one scene by frame. Tracks that are not confirmed are left out.
pub fn by_frame<'a>(people: &'a [PeopleRow], tracks: &'a [TrackRow]) -> BTreeMap<u64, SceneFrame<'a>> {
    let mut frames: BTreeMap<u64, SceneFrame<'a>> = BTreeMap::new();
    for row in people {
        frames.entry(row.frame).or_default().people.push(row);
    }
    for row in tracks.iter().filter(|row| row.confirmed) {
        frames.entry(row.frame).or_default().tracks.push(row);
    }
    for frame in frames.values_mut() {
        frame.people.sort_by_key(|row| row.person);
        frame.tracks.sort_by_key(|row| row.track);
    }
    frames
}

/// The pairs of one frame as indices (of `people`, of `tracks`), by person. As many of yesterday's pairs as can be
/// are kept (`yesterday` gives a person's track of the frame before), then as many people as can be get a track,
/// then the distances are the least. No pair is farther apart than [`GATE_M`].
pub fn match_frame(
    people: &[&PeopleRow],
    tracks: &[&TrackRow],
    yesterday: impl Fn(u32) -> Option<u64>,
) -> Vec<(usize, usize)> {
    // Worth more than all distances of a frame together, and than all pairs of a frame.
    const PAIR: f64 = 1e3;
    const KEPT: f64 = 1e6;
    let cost = |p: usize, t: usize| {
        let apart_m = apart_m(people[p], tracks[t]);
        let kept = if yesterday(people[p].person) == Some(tracks[t].track) { KEPT } else { 0.0 };
        if apart_m <= GATE_M { apart_m - PAIR - kept } else { FORBIDDEN }
    };
    let given = optimal(people.len(), tracks.len(), cost);
    given.into_iter().enumerate().filter_map(|(p, t)| t.map(|t| (p, t))).collect()
}

/// [`match_frame`] for every frame of a scene.
pub fn match_scene(people: &[PeopleRow], tracks: &[TrackRow]) -> Matching {
    let mut matching = Matching::new();
    let mut yesterday = BTreeMap::new();
    for (frame, rows) in by_frame(people, tracks) {
        let pairs = match_frame(&rows.people, &rows.tracks, |person| yesterday.get(&person).copied());
        yesterday = pairs.iter().map(|&(p, t)| (rows.people[p].person, rows.tracks[t].track)).collect();
        matching.extend(yesterday.iter().map(|(&person, &track)| ((frame, person), track)));
    }
    matching
}

/// Distance over the floor, metres.
pub fn apart_m(person: &PeopleRow, track: &TrackRow) -> f64 {
    DVec2::new(person.x_m - track.x_m, person.y_m - track.y_m).length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::{track_row, truth_of};

    #[test]
    fn yesterdays_pair_is_kept_though_another_track_is_nearer() {
        let truth = truth_of(1, 2, |_, _| false);
        let mut tracks =
            vec![track_row(0, 7, 0.1, 0.0), track_row(1, 7, 0.4, 0.0), track_row(1, 8, 0.0, 0.0)];
        let matching = match_scene(&truth.people, &tracks);
        assert_eq!(matching.into_iter().collect::<Vec<_>>(), [((0, 0), 7), ((1, 0), 7)]);
        tracks[1].x_m = 0.6;
        let matching = match_scene(&truth.people, &tracks);
        assert_eq!(matching.into_iter().collect::<Vec<_>>(), [((0, 0), 7), ((1, 0), 8)]);
    }

    #[test]
    fn a_track_that_is_not_confirmed_is_nobodys() {
        let truth = truth_of(1, 1, |_, _| false);
        let mut track = track_row(0, 7, 0.0, 0.0);
        track.confirmed = false;
        assert!(match_scene(&truth.people, &[track]).is_empty());
    }
}
