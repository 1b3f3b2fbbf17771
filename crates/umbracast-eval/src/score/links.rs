//! Stage 3: each predictor's answer for every instance. A predictor is the run itself, one of the baselines of every
//! table, or a cast with one stage replaced by the truth.

use std::collections::BTreeMap;

use umbracast::STEPS;
use umbracast::blockage::Blockage;

use crate::score::instances::{Cause, Instance};
use crate::score::link_counts::Prediction;
use crate::score::scene::{Matching, SceneRun};

/// What was said of links, by (frame, access point, track or person).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Said {
    by_link: BTreeMap<(u64, u32, u64), (Prediction, Prediction)>,
}

impl Said {
    /// By a run, of its tracks.
    pub fn by_run(run: &SceneRun) -> Self {
        let mut said = Self::default();
        for row in &run.links {
            let window = Prediction { blocked: row.blocked, p: row.p };
            let now = Prediction { blocked: [row.blocked_now; STEPS], p: [row.p_now; STEPS] };
            said.by_link.insert((row.frame, row.access_point, row.track), (window, now));
        }
        said
    }

    /// By a run, of its tracks, of one cause; from `threshold` on a link counts as blocked.
    pub fn by_cause(run: &SceneRun, cause: Cause, threshold: f64) -> Self {
        let mut said = Self::default();
        for row in &run.links {
            let p = match cause {
                Cause::Others => return Self::by_run(run),
                Cause::Owner => row.p_own,
                Cause::Hall => row.p_hall,
                Cause::Any => row.p_any,
            };
            let p = p.map(Option::unwrap_or_default);
            let of = |p: [f64; STEPS]| Prediction { blocked: p.map(|p| p >= threshold), p };
            let window = of(std::array::from_fn(|w| p[w + 1]));
            said.by_link.insert((row.frame, row.access_point, row.track), (window, of([p[0]; STEPS])));
        }
        said
    }

    /// Adds one frame's cast.
    pub fn add(&mut self, frame: u64, blockages: &[Blockage]) {
        for b in blockages {
            let window = Prediction { blocked: b.blocked, p: b.p };
            let now = Prediction { blocked: [b.blocked_now; STEPS], p: [b.p_now; STEPS] };
            self.by_link.insert((frame, b.access_point as u32, b.track), (window, now));
        }
    }

    /// Adds one link's answer.
    pub fn add_link(&mut self, frame: u64, access_point: u32, who: u64, prediction: Prediction) {
        self.by_link.insert((frame, access_point, who), (prediction, prediction));
    }

    /// For each instance what was said of the person's track; who has none counts as predicted "not blocked".
    pub fn of_tracks(&self, instances: &[Instance], matching: &Matching) -> Vec<Prediction> {
        let of =
            |i: &Instance| self.link_of_track(i, matching).map_or(Prediction::CLEAR, |(window, _)| *window);
        instances.iter().map(of).collect()
    }

    /// "As now", the present as the run sees it.
    pub fn persistence(&self, instances: &[Instance], matching: &Matching) -> Vec<Prediction> {
        let of = |i: &Instance| self.link_of_track(i, matching).map_or(Prediction::CLEAR, |(_, now)| *now);
        instances.iter().map(of).collect()
    }

    /// For each instance what was said of the person: for casts from the truth, which need no matching.
    pub fn of_persons(&self, instances: &[Instance]) -> Vec<Prediction> {
        let link = |i: &Instance| self.by_link.get(&(i.frame, i.access_point, u64::from(i.person)));
        instances.iter().map(|i| link(i).map_or(Prediction::CLEAR, |(window, _)| *window)).collect()
    }

    fn link_of_track(&self, i: &Instance, matching: &Matching) -> Option<&(Prediction, Prediction)> {
        let track = matching.get(&(i.frame, i.person))?;
        self.by_link.get(&(i.frame, i.access_point, *track))
    }
}

/// Nobody is ever blocked.
pub fn never(instances: &[Instance]) -> Vec<Prediction> {
    vec![Prediction::CLEAR; instances.len()]
}

/// "As now", the present being the truth's.
pub fn persistence_of_truth(instances: &[Instance]) -> Vec<Prediction> {
    instances.iter().map(|i| Prediction::constant(i.blocked_now)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::{link_row, truth_of};
    use crate::score::instances::instances;
    use crate::score::link_counts::WindowCounts;
    use crate::score::scene::TruthIndex;

    #[test]
    fn who_has_no_track_counts_as_predicted_not_blocked() {
        // Both are blocked in the window; only person 0 has a track, and it is warned of.
        let truth = truth_of(2, 19, |_, frame| frame >= 12);
        let instances = instances(&TruthIndex::new(&truth));
        let run = SceneRun { tracks: Vec::new(), links: vec![link_row(9, 77, true)] };
        let matching = Matching::from([((9, 0), 77)]);
        let counts =
            WindowCounts::of(&instances, &Said::by_run(&run).of_tracks(&instances, &matching), 3).all;
        assert_eq!((counts.true_positive, counts.false_negative, counts.total()), (1, 1, 2));
    }

    #[test]
    fn a_matched_track_without_a_link_row_counts_as_not_blocked() {
        let truth = truth_of(1, 19, |_, _| true);
        let instances = instances(&TruthIndex::new(&truth));
        let said = Said::by_run(&SceneRun::default());
        let matching = Matching::from([((9, 0), 77)]);
        assert_eq!(said.of_tracks(&instances, &matching), [Prediction::CLEAR]);
    }

    #[test]
    fn persistence_of_the_truth_is_right_until_something_changes() {
        let truth = truth_of(1, 60, |_, frame| (30..40).contains(&frame));
        let instances = instances(&TruthIndex::new(&truth));
        let counts = WindowCounts::of(&instances, &persistence_of_truth(&instances), 1).all;
        // Wrong once as it begins and once as it ends.
        assert_eq!((counts.false_negative, counts.false_positive, counts.true_positive), (1, 1, 9));
        assert_eq!(WindowCounts::of(&instances, &persistence_of_truth(&instances), 1).onset.f1(), Some(0.0));
    }

    #[test]
    fn never_has_the_accuracy_of_what_is_in_sight() {
        let truth = truth_of(1, 60, |_, frame| (30..40).contains(&frame));
        let instances = instances(&TruthIndex::new(&truth));
        let counts = WindowCounts::of(&instances, &never(&instances), 1);
        assert_eq!((counts.all.f1(), counts.all.accuracy()), (Some(0.0), Some(32.0 / 42.0)));
    }
}
