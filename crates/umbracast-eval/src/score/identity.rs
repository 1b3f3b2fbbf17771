//! Scores of identity over a whole scene: IDF1 (Ristani et al. 2016) and HOTA (Luiten et al. 2021), with the
//! similarity 1 - d / 1 m.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use umbracast::track::association::{FORBIDDEN, optimal};

use crate::score::matching::{GATE_M, SceneFrame, apart_m};

/// Thresholds of the similarity that HOTA averages over: 0.05, 0.10 .. 0.95.
pub const ALPHAS: usize = 19;

/// What HOTA adds up at one threshold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct HotaSums {
    /// Pairs at least as similar as the threshold.
    pub pairs: u64,
    /// Over those pairs, the share of both lives that the two are paired.
    pub association: f64,
}

/// Counts by person and track, as dense tables.
struct Lives {
    persons: BTreeMap<u32, usize>,
    tracks: BTreeMap<u64, usize>,
    person_frames: Vec<u64>,
    track_frames: Vec<u64>,
}

impl Lives {
    fn of<'a>(frames: impl Iterator<Item = &'a SceneFrame<'a>> + Clone) -> Self {
        let mut persons: BTreeMap<u32, usize> =
            frames.clone().flat_map(|f| f.people.iter().map(|row| (row.person, 0))).collect();
        persons.values_mut().enumerate().for_each(|(i, place)| *place = i);
        let mut tracks: BTreeMap<u64, usize> =
            frames.clone().flat_map(|f| f.tracks.iter().map(|row| (row.track, 0))).collect();
        tracks.values_mut().enumerate().for_each(|(i, place)| *place = i);
        let mut person_frames = vec![0; persons.len()];
        let mut track_frames = vec![0; tracks.len()];
        for frame in frames {
            frame.people.iter().for_each(|row| person_frames[persons[&row.person]] += 1);
            frame.tracks.iter().for_each(|row| track_frames[tracks[&row.track]] += 1);
        }
        Self { persons, tracks, person_frames, track_frames }
    }
}

/// Person-frames that the best one-to-one choice of a track for each person covers (IDTP).
pub fn identity_true_positives<'a>(frames: impl Iterator<Item = &'a SceneFrame<'a>> + Clone) -> u64 {
    let lives = Lives::of(frames.clone());
    let mut together = vec![vec![0_u64; lives.tracks.len()]; lives.persons.len()];
    for frame in frames {
        for person in &frame.people {
            for track in frame.tracks.iter().filter(|track| apart_m(person, track) <= GATE_M) {
                together[lives.persons[&person.person]][lives.tracks[&track.track]] += 1;
            }
        }
    }
    // Errors are lives less what is covered, so the fewest errors cover the most.
    let given = optimal(lives.persons.len(), lives.tracks.len(), |p, t| -(together[p][t] as f64));
    given.into_iter().enumerate().filter_map(|(p, t)| t.map(|t| together[p][t])).sum()
}

/// HOTA's sums at each threshold.
pub fn hota_sums<'a>(frames: impl Iterator<Item = &'a SceneFrame<'a>> + Clone) -> [HotaSums; ALPHAS] {
    let lives = Lives::of(frames.clone());
    let (persons, tracks) = (lives.persons.len(), lives.tracks.len());
    let places = |frame: &SceneFrame| {
        let people: Vec<usize> = frame.people.iter().map(|row| lives.persons[&row.person]).collect();
        let tracks: Vec<usize> = frame.tracks.iter().map(|row| lives.tracks[&row.track]).collect();
        (people, tracks)
    };
    // How alike each person's and each track's lives are, before anybody is paired.
    let mut alike = vec![vec![0.0; tracks]; persons];
    for frame in frames.clone() {
        let (people_at, tracks_at) = places(frame);
        let s = similarities(frame);
        for (p, row) in s.iter().enumerate() {
            for (t, &own) in row.iter().enumerate() {
                let all = row.iter().sum::<f64>() + s.iter().map(|row| row[t]).sum::<f64>() - own;
                if all > f64::EPSILON {
                    alike[people_at[p]][tracks_at[t]] += own / all;
                }
            }
        }
    }
    for (p, row) in alike.iter_mut().enumerate() {
        for (t, value) in row.iter_mut().enumerate() {
            *value /= (lives.person_frames[p] + lives.track_frames[t]) as f64 - *value;
        }
    }
    let mut together = vec![vec![vec![0_u64; tracks]; persons]; ALPHAS];
    for frame in frames {
        let (people_at, tracks_at) = places(frame);
        let s = similarities(frame);
        let cost = |p: usize, t: usize| {
            let worth = alike[people_at[p]][tracks_at[t]] * s[p][t];
            if worth > 0.0 { -worth } else { FORBIDDEN }
        };
        for (p, t) in optimal(s.len(), tracks_at.len(), cost).into_iter().enumerate() {
            let Some(t) = t else { continue };
            for (alpha, together) in together.iter_mut().enumerate() {
                if s[p][t] >= 0.05 * (alpha + 1) as f64 - f64::EPSILON {
                    together[people_at[p]][tracks_at[t]] += 1;
                }
            }
        }
    }
    std::array::from_fn(|alpha| {
        let mut sums = HotaSums::default();
        for (p, row) in together[alpha].iter().enumerate() {
            for (t, &n) in row.iter().enumerate() {
                sums.pairs += n;
                let either = lives.person_frames[p] + lives.track_frames[t] - n;
                sums.association += n as f64 * n as f64 / either.max(1) as f64;
            }
        }
        sums
    })
}

/// Similarity of each person (rows) and each track of a frame.
fn similarities(frame: &SceneFrame) -> Vec<Vec<f64>> {
    let row = |person| frame.tracks.iter().map(|track| (1.0 - apart_m(person, track)).max(0.0)).collect();
    frame.people.iter().map(|person| row(person)).collect()
}
