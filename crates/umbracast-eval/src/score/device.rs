//! The track of a person's device if the two are bound once instead of matched anew in every frame.
//!
//! [`crate::score::matching`] uses the truth in each frame to match people and tracks. In operation this is
//! impossible: a device registers, its position selects a track, and from then on it gets that track's predictions.
//! An identity swap therefore costs warnings. Nothing shows it, and the device gets the warnings of the person whom
//! its track now follows. The death of a track does show, because its predictions end. The device then registers
//! anew: it is bound at its person's next match with a track that no other device has. Until then, and while its
//! track is not confirmed, it gets no warnings. A track is free again when the person it was bound for has left the
//! scene.

use std::collections::BTreeMap;

use crate::score::scene::{Matching, SceneRun, TruthIndex};

/// The track of each person's device in every frame that has one; `matching` is the truth's word on which track is
/// whose ([`crate::score::matching::match_scene`]), heard once a registration.
pub fn bound_once(truth: &TruthIndex, run: &SceneRun, matching: &Matching) -> Matching {
    let track_ends = last_frames(run.tracks.iter().map(|row| (row.track, row.frame)));
    let in_scene = |&(frame, person): &(u64, u32)| truth.person(frame, person).is_some();
    let everywhere = truth.frames.iter().flat_map(|&k| truth.persons.iter().map(move |&person| (k, person)));
    let person_ends = last_frames(everywhere.filter(in_scene).map(|(frame, person)| (person, frame)));
    let mut track_of: BTreeMap<u32, u64> = BTreeMap::new();
    let mut bound = Matching::new();
    for &frame in &truth.frames {
        track_of.retain(|person, track| person_ends[person] >= frame && track_ends[track] >= frame);
        for (&(_, person), &track) in matching.range((frame, 0)..=(frame, u32::MAX)) {
            if !track_of.contains_key(&person) && track_of.values().all(|&taken| taken != track) {
                track_of.insert(person, track);
            }
        }
        bound.extend(track_of.iter().map(|(&person, &track)| ((frame, person), track)));
    }
    bound
}

fn last_frames<T: Ord>(seen: impl Iterator<Item = (T, u64)>) -> BTreeMap<T, u64> {
    let mut last = BTreeMap::new();
    for (who, frame) in seen {
        let latest = last.entry(who).or_insert(frame);
        *latest = frame.max(*latest);
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::{track_row, truth_of};
    use crate::score::matching::match_scene;
    use crate::score::scene::SceneTruth;

    /// Two people 10 m apart; `track(person, frame)` is who follows a person, if anybody does.
    fn bound(truth: &SceneTruth, track: impl Fn(u32, u64) -> Option<u64>) -> Matching {
        let rows = truth.people.iter();
        let tracks =
            rows.filter_map(|r| Some(track_row(r.frame, track(r.person, r.frame)?, r.x_m, r.y_m))).collect();
        let run = SceneRun { tracks, links: Vec::new() };
        let matching = match_scene(&truth.people, &run.tracks);
        bound_once(&TruthIndex::new(truth), &run, &matching)
    }

    fn two_people() -> SceneTruth {
        truth_of(2, 30, |_, _| false)
    }

    #[test]
    fn devices_keep_their_tracks_through_a_swap() {
        let bound = bound(&two_people(), |person, frame| {
            Some(u64::from(if frame < 10 { person } else { 1 - person }))
        });
        for frame in [0, 9, 10, 29] {
            assert_eq!((bound[&(frame, 0)], bound[&(frame, 1)]), (0, 1), "frame {frame}");
        }
    }

    #[test]
    fn a_device_whose_track_has_died_is_bound_to_the_next_free_one() {
        // Person 0 is lost at frame 10, followed by person 1's own track from 15 on, and by a new one from 20 on.
        let bound = bound(&two_people(), |person, frame| match (person, frame) {
            (0, 0..10) => Some(7),
            (1, 0..15) | (0, 15..20) => Some(8),
            (0, 20..) => Some(9),
            (1, 20..) => Some(8),
            _ => None,
        });
        let of_0: Vec<Option<&u64>> = [9, 10, 15, 19, 20, 29].map(|k| bound.get(&(k, 0))).into();
        assert_eq!(of_0, [Some(&7), None, None, None, Some(&9), Some(&9)]);
        assert!((0..30).all(|frame| bound[&(frame, 1)] == 8), "person 1 keeps the track that came back");
    }

    #[test]
    fn a_track_that_is_lost_for_a_while_keeps_its_device() {
        let bound = bound(&two_people(), |person, frame| match (person, frame) {
            (0, 10..15) => None,
            (0, 15..20) => Some(9),
            _ => Some(u64::from(person)),
        });
        assert!((0..30).all(|frame| bound[&(frame, 0)] == 0), "{bound:?}");
    }

    #[test]
    fn the_track_of_a_person_who_has_left_is_free() {
        let mut truth = two_people();
        truth.people.retain(|row| if row.person == 0 { row.frame < 10 } else { row.frame >= 10 });
        let bound = bound(&truth, |_, _| Some(7));
        assert_eq!(bound.get(&(9, 0)), Some(&7));
        assert_eq!((bound.get(&(10, 0)), bound.get(&(10, 1))), (None, Some(&7)));
    }
}
