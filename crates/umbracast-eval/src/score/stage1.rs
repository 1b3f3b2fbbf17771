//! Stage 1: whether people are detected, where, and with one identity. Counts of one scene, added up over scenes.
//!
//! Everybody in the scene counts from frame 0, and confirmed tracks only (docs/CONVENTIONS.md).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use umbracast::geometry::DVec2;
use umbracast_io::rows::{PeopleRow, TrackRow};

use crate::score::bootstrap::Pooled;
use crate::score::counts::{ratio, squared_mahalanobis};
use crate::score::identity::{ALPHAS, HotaSums, hota_sums, identity_true_positives};
use crate::score::matching::{apart_m, by_frame, match_frame};

/// How many classes of people by returns there are: none, 1 to 5, 6 and more.
pub const RETURN_CLASSES: usize = 3;

/// Everything that scores of stage 1 are computed from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Stage1 {
    /// Scenes added up.
    pub scenes: u64,
    /// Persons in frames.
    pub people: u64,
    /// Confirmed tracks in frames.
    pub tracks: u64,
    /// Persons in frames with a track within the gate.
    pub matches: u64,
    /// Persons whose track is another than the last they had.
    pub switches: u64,
    /// Distances of matches, metres.
    pub distance_m: f64,
    /// Their squares.
    pub distance_m2: f64,
    /// Squared differences of the velocities of matches.
    pub velocity_m2ps2: f64,
    /// Squared errors of position and of velocity over the covariances that the tracks claim.
    pub nees: [f64; 2],
    /// Matches whose tracks claim both.
    pub claimed: u64,
    /// Matches of the best one-to-one choice of tracks over the scene, within the gate.
    pub identity_matches: u64,
    /// At each threshold of the similarity.
    pub hota: [HotaSums; ALPHAS],
    /// Persons in frames by returns: none, 1 to 5, 6 and more.
    pub people_by_returns: [u64; RETURN_CLASSES],
    /// Of those, with a track.
    pub matches_by_returns: [u64; RETURN_CLASSES],
}

impl Stage1 {
    /// Of the rows of one scene, in any order.
    pub fn of(people: &[PeopleRow], tracks: &[TrackRow]) -> Self {
        let frames = by_frame(people, tracks);
        let mut sums = Self {
            scenes: 1,
            identity_matches: identity_true_positives(frames.values()),
            hota: hota_sums(frames.values()),
            ..Self::default()
        };
        let mut yesterday: BTreeMap<u32, u64> = BTreeMap::new();
        let mut last: BTreeMap<u32, u64> = BTreeMap::new();
        for frame in frames.values() {
            sums.tracks += frame.tracks.len() as u64;
            for person in &frame.people {
                sums.people += 1;
                sums.people_by_returns[class(person)] += 1;
            }
            let pairs = match_frame(&frame.people, &frame.tracks, |person| yesterday.get(&person).copied());
            yesterday.clear();
            for (p, t) in pairs {
                let (person, track) = (frame.people[p], frame.tracks[t]);
                let apart_m = apart_m(person, track);
                sums.matches += 1;
                sums.matches_by_returns[class(person)] += 1;
                sums.distance_m += apart_m;
                sums.distance_m2 += apart_m * apart_m;
                sums.velocity_m2ps2 +=
                    (person.vx_mps - track.vx_mps).powi(2) + (person.vy_mps - track.vy_mps).powi(2);
                if let Some(errors) = normalised_errors(person, track) {
                    sums.nees.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error);
                    sums.claimed += 1;
                }
                yesterday.insert(person.person, track.track);
                let before = last.insert(person.person, track.track);
                sums.switches += u64::from(before.is_some_and(|before| before != track.track));
            }
        }
        sums
    }

    /// Share of persons in frames with a track.
    pub fn recall(&self) -> Option<f64> {
        ratio(self.matches, self.people)
    }

    /// Share of tracks in frames with a person.
    pub fn precision(&self) -> Option<f64> {
        ratio(self.matches, self.tracks)
    }

    /// [`Stage1::recall`] of people with no, 1 to 5, 6 and more returns.
    pub fn recall_by_returns(&self) -> [Option<f64>; RETURN_CLASSES] {
        std::array::from_fn(|class| ratio(self.matches_by_returns[class], self.people_by_returns[class]))
    }

    /// 1 - (missed + false + switches) / persons: below zero where there are more errors than persons.
    pub fn mota(&self) -> Option<f64> {
        let (misses, false_tracks) = (self.people - self.matches, self.tracks - self.matches);
        ratio(misses + false_tracks + self.switches, self.people).map(|errors| 1.0 - errors)
    }

    /// Mean distance of matches, metres.
    pub fn motp_m(&self) -> Option<f64> {
        (self.matches > 0).then(|| self.distance_m / self.matches as f64)
    }

    /// F1 of identity.
    pub fn idf1(&self) -> Option<f64> {
        ratio(2 * self.identity_matches, self.people + self.tracks)
    }

    /// Mean over the thresholds of sqrt(detection * association).
    pub fn hota(&self) -> Option<f64> {
        self.over_alphas(|sums, detection| (detection * sums.association / sums.pairs.max(1) as f64).sqrt())
    }

    /// HOTA's detection: pairs / (persons + tracks - pairs).
    pub fn detection_accuracy(&self) -> Option<f64> {
        self.over_alphas(|_, detection| detection)
    }

    /// HOTA's association.
    pub fn association_accuracy(&self) -> Option<f64> {
        self.over_alphas(|sums, _| sums.association / sums.pairs.max(1) as f64)
    }

    /// Root mean square of the 2-D position error of matches, metres.
    pub fn position_rmse_m(&self) -> Option<f64> {
        (self.matches > 0).then(|| (self.distance_m2 / self.matches as f64).sqrt())
    }

    /// Root mean square of the 2-D velocity error of matches.
    pub fn velocity_rmse_mps(&self) -> Option<f64> {
        (self.matches > 0).then(|| (self.velocity_m2ps2 / self.matches as f64).sqrt())
    }

    /// Mean squared position error over the covariance that the track claims for it: 2 if the tracker is honest,
    /// more if it is too sure (Bar-Shalom's normalised estimation error squared). Of matches, so no error counts beyond
    /// the gate: with covariances nearly as wide as that, honest is less.
    pub fn position_nees(&self) -> Option<f64> {
        (self.claimed > 0).then(|| self.nees[0] / self.claimed as f64)
    }

    /// The same of velocities.
    pub fn velocity_nees(&self) -> Option<f64> {
        (self.claimed > 0).then(|| self.nees[1] / self.claimed as f64)
    }

    /// Switches a scene.
    pub fn switches_per_scene(&self) -> Option<f64> {
        ratio(self.switches, self.scenes)
    }

    fn over_alphas(&self, value: impl Fn(&HotaSums, f64) -> f64) -> Option<f64> {
        let all = self.people + self.tracks;
        (all > 0).then(|| {
            let at = |sums: &HotaSums| value(sums, sums.pairs as f64 / (all - sums.pairs) as f64);
            self.hota.iter().map(at).sum::<f64>() / ALPHAS as f64
        })
    }
}

/// Squared Mahalanobis distances of position and velocity; nothing where a covariance is not positive definite.
fn normalised_errors(person: &PeopleRow, track: &TrackRow) -> Option<[f64; 2]> {
    let c = track.covariance;
    let position = DVec2::new(track.x_m - person.x_m, track.y_m - person.y_m);
    let velocity = DVec2::new(track.vx_mps - person.vx_mps, track.vy_mps - person.vy_mps);
    let (position, _) = squared_mahalanobis([c[0], c[1], c[4]], position)?;
    let (velocity, _) = squared_mahalanobis([c[7], c[8], c[9]], velocity)?;
    Some([position, velocity])
}

fn class(person: &PeopleRow) -> usize {
    match person.returns {
        0 => 0,
        1..=5 => 1,
        _ => 2,
    }
}

impl Pooled for Stage1 {
    fn plus(&self, other: &Self, times: u64) -> Self {
        let count = |a: u64, b: u64| a + times * b;
        let sum = |a: f64, b: f64| a + times as f64 * b;
        Self {
            scenes: count(self.scenes, other.scenes),
            people: count(self.people, other.people),
            tracks: count(self.tracks, other.tracks),
            matches: count(self.matches, other.matches),
            switches: count(self.switches, other.switches),
            distance_m: sum(self.distance_m, other.distance_m),
            distance_m2: sum(self.distance_m2, other.distance_m2),
            velocity_m2ps2: sum(self.velocity_m2ps2, other.velocity_m2ps2),
            nees: std::array::from_fn(|i| sum(self.nees[i], other.nees[i])),
            claimed: count(self.claimed, other.claimed),
            identity_matches: count(self.identity_matches, other.identity_matches),
            hota: std::array::from_fn(|a| HotaSums {
                pairs: count(self.hota[a].pairs, other.hota[a].pairs),
                association: sum(self.hota[a].association, other.hota[a].association),
            }),
            people_by_returns: std::array::from_fn(|c| {
                count(self.people_by_returns[c], other.people_by_returns[c])
            }),
            matches_by_returns: std::array::from_fn(|c| {
                count(self.matches_by_returns[c], other.matches_by_returns[c])
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::{track_row, truth_of};

    /// Six people abreast, tracks with errors, gaps, two swaps, a new identity and false tracks.
    fn tangled() -> (Vec<PeopleRow>, Vec<TrackRow>) {
        let mut people = truth_of(6, 60, |_, _| false).people;
        people.retain(|row| !(row.person == 5 && row.frame < 12));
        let mut tracks = Vec::new();
        for row in &mut people {
            (row.x_m, row.y_m) = (0.1 * row.frame as f64, 0.7 * f64::from(row.person));
            let (k, p) = (row.frame, u64::from(row.person));
            if (7 * k + 3 * p) % 11 == 0 {
                continue;
            }
            let id = match (p, k) {
                (1, 20..) => 2,
                (2, 20..) => 1,
                (3, 30..45) => 4,
                (4, 30..45) => 3,
                (0, 40..) => 10,
                _ => p,
            };
            let phase = k as f64 + 2.0 * p as f64;
            let error = (0.4 * (0.7 * phase).sin(), 0.3 * (1.3 * phase).cos());
            tracks.push(track_row(k, id, row.x_m + error.0, row.y_m + error.1));
        }
        for k in (0..60).step_by(5) {
            tracks.push(track_row(k, 20 + k / 15, 0.1 * k as f64 + 0.35, 1.05));
        }
        (people, tracks)
    }

    /// TrackEval 1.0.0 (CLEAR, Identity, HOTA) on the same rows; similarity 1 - d / 1 m, threshold 0.5.
    #[test]
    fn scores_are_those_of_trackeval() {
        let (people, tracks) = tangled();
        let sums = Stage1::of(&people, &tracks);
        let near = |found: Option<f64>, expected: f64| {
            assert!((found.unwrap() - expected).abs() < 1e-9, "{found:?} for {expected}");
        };
        assert_eq!((sums.people, sums.tracks, sums.matches, sums.switches), (348, 328, 318, 10));
        assert_eq!(sums.identity_matches, 238);
        near(sums.mota(), 0.856_321_839_080_459_8);
        near(sums.motp_m(), 1.0 - 0.663_525_806_703_840_2);
        near(sums.idf1(), 0.704_142_011_834_319_6);
        near(sums.hota(), 0.436_959_816_472_978_93);
        near(sums.detection_accuracy(), 0.552_964_367_409_036_8);
        near(sums.association_accuracy(), 0.345_449_061_545_234_8);
    }

    #[test]
    fn perfect_tracks_score_one_and_no_tracks_score_nothing() {
        let people = truth_of(2, 10, |_, _| false).people;
        let tracks: Vec<TrackRow> =
            people.iter().map(|r| track_row(r.frame, r.person.into(), r.x_m, r.y_m)).collect();
        let perfect = Stage1::of(&people, &tracks);
        for score in [perfect.mota(), perfect.idf1(), perfect.hota(), perfect.recall(), perfect.precision()] {
            assert_eq!(score, Some(1.0));
        }
        assert_eq!((perfect.position_rmse_m(), perfect.velocity_rmse_mps()), (Some(0.0), Some(0.0)));
        let nothing = Stage1::of(&people, &[]);
        assert_eq!((nothing.mota(), nothing.idf1(), nothing.motp_m()), (Some(0.0), Some(0.0), None));
        assert_eq!((nothing.hota(), nothing.precision()), (Some(0.0), None));
    }

    #[test]
    fn errors_of_one_standard_deviation_along_each_axis_are_honest() {
        let people = truth_of(1, 10, |_, _| false).people;
        let honest = |row: &PeopleRow, covariance| {
            let track = track_row(row.frame, 0, row.x_m + 0.3, row.y_m - 0.2);
            let (vx_mps, vy_mps) = (row.vx_mps + 0.1, row.vy_mps + 0.4);
            TrackRow { vx_mps, vy_mps, covariance, ..track }
        };
        // Upper triangle of (x, y, vx, vy).
        let claims = [0.09, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.01, 0.0, 0.16];
        let tracks: Vec<TrackRow> = people.iter().map(|row| honest(row, claims)).collect();
        let sums = Stage1::of(&people, &tracks);
        for nees in [sums.position_nees(), sums.velocity_nees()] {
            assert!((nees.unwrap() - 2.0).abs() < 1e-9, "{nees:?}");
        }
        let claims_nothing: Vec<TrackRow> = people.iter().map(|row| honest(row, [0.0; 10])).collect();
        assert_eq!(Stage1::of(&people, &claims_nothing).position_nees(), None);
    }

    #[test]
    fn a_scene_counted_twice_scores_as_once() {
        let (people, tracks) = tangled();
        let once = Stage1::of(&people, &tracks);
        let twice = Stage1::default().plus(&once, 2);
        assert_eq!((once.mota(), once.idf1(), once.hota()), (twice.mota(), twice.idf1(), twice.hota()));
        assert_eq!((twice.scenes, twice.switches_per_scene()), (2, Some(once.switches as f64)));
    }
}
