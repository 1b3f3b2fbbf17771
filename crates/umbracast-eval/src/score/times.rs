//! Stage 3: predicted times until a link is blocked and until it is clear again, compared with the truth.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use umbracast::{STEP_S, STEPS};
use umbracast_io::rows::LinkRow;

use crate::score::counts::ratio;
use crate::score::instances::Instance;
use crate::score::scene::{Matching, SceneRun, TruthIndex};

/// Quantiles that were reported of one kind of time at one access point.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TimeCounts {
    /// Links whose 10 % quantile was reported: a chance of one in ten that it happens within the steps.
    pub reported: u64,
    /// Those of them where it happened between the 10 and the 90 % quantile; one that was not reported is later than
    /// the last step, and so is what did not happen.
    pub covered: u64,
    /// Differences of the 50 % quantile and the truth, seconds, where it was reported and it happened within the steps.
    pub errors_s: Vec<f64>,
}

/// All kinds.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// From in sight to blocked.
    pub onset: TimeCounts,
    /// From blocked to in sight.
    pub duration: TimeCounts,
    /// From in sight, through the first blockage that comes, to in sight again; where one came.
    pub again: TimeCounts,
}

impl Times {
    /// One for each of `access_points`.
    pub fn each(
        truth: &TruthIndex,
        instances: &[Instance],
        run: &SceneRun,
        matching: &Matching,
        access_points: u32,
    ) -> Vec<Self> {
        let rows: BTreeMap<(u64, u32, u64), &LinkRow> =
            run.links.iter().map(|row| ((row.frame, row.access_point, row.track), row)).collect();
        let mut all = vec![Self::default(); access_points as usize];
        for i in instances {
            let track = matching.get(&(i.frame, i.person));
            let row = track.and_then(|track| rows.get(&(i.frame, i.access_point, *track)));
            let (Some(row), Some(times)) = (row, all.get_mut(i.access_point as usize)) else { continue };
            let clear = |step: &usize| {
                truth.link(i.frame + *step as u64, i.person, i.access_point).is_some_and(|link| !link.blocked)
            };
            if i.blocked_now {
                times.duration.add(&row.duration_s, (1..=STEPS).find(clear));
                continue;
            }
            times.onset.add(&row.onset_s, i.first_blocked);
            if let Some(first) = i.first_blocked {
                times.again.add(&row.duration_s, (first..=STEPS).find(clear));
            }
        }
        all
    }

    /// Those of all scenes together.
    pub fn pooled<'a>(scenes: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut pooled = Self::default();
        for scene in scenes {
            pooled.onset.append(&scene.onset);
            pooled.duration.append(&scene.duration);
            pooled.again.append(&scene.again);
        }
        pooled
    }
}

impl TimeCounts {
    fn add(&mut self, quantiles_s: &[Option<f64>; 3], happened: Option<usize>) {
        let [Some(low_s), median_s, high_s] = *quantiles_s else { return };
        // Times are whole steps; half a step of room for rounding.
        let happened_s = happened.map(|step| step as f64 * STEP_S);
        let after_low = happened_s.is_none_or(|s| s > low_s - 0.5 * STEP_S);
        let before_high = high_s.is_none_or(|high_s| happened_s.is_some_and(|s| s < high_s + 0.5 * STEP_S));
        self.reported += 1;
        self.covered += u64::from(after_low && before_high);
        self.errors_s.extend(median_s.zip(happened_s).map(|(median_s, s)| median_s - s));
    }

    fn append(&mut self, other: &Self) {
        self.reported += other.reported;
        self.covered += other.covered;
        self.errors_s.extend_from_slice(&other.errors_s);
    }

    /// Share between the 10 and the 90 % quantile: 0.8 of an honest predictor, more where steps are coarse.
    pub fn coverage(&self) -> Option<f64> {
        ratio(self.covered, self.reported)
    }

    /// Mean size of the error.
    pub fn mean_error_s(&self) -> Option<f64> {
        let n = self.errors_s.len();
        (n > 0).then(|| self.errors_s.iter().map(|e| e.abs()).sum::<f64>() / n as f64)
    }

    /// The middle one of the errors' sizes.
    pub fn median_error_s(&self) -> Option<f64> {
        let mut sorted: Vec<f64> = self.errors_s.iter().map(|e| e.abs()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::{link_row, truth_of};
    use crate::score::instances::instances;

    #[test]
    fn what_happens_later_than_the_last_step_is_later_than_any_quantile() {
        let mut counts = TimeCounts::default();
        counts.add(&[Some(0.2), Some(0.4), None], None);
        assert_eq!((counts.reported, counts.covered, counts.errors_s.len()), (1, 1, 0));
        counts.add(&[Some(0.2), Some(0.4), Some(0.6)], None);
        counts.add(&[Some(0.2), Some(0.4), None], Some(1));
        assert_eq!((counts.reported, counts.covered), (3, 1));
        counts.add(&[None; 3], Some(3));
        assert_eq!(counts.reported, 3, "nothing reported");
    }

    #[test]
    fn onset_and_duration_against_a_link_blocked_for_half_a_second() {
        // Blocked from frame 30 to 34; at each instant the quantiles are 0.2, 0.3 and 0.4 s of both.
        let truth = truth_of(1, 60, |_, frame| (30..35).contains(&frame));
        let index = TruthIndex::new(&truth);
        let instances = instances(&index);
        let reported = [Some(0.2), Some(0.3), Some(0.4)];
        let links = (0..60)
            .map(|frame| LinkRow { onset_s: reported, duration_s: reported, ..link_row(frame, 7, false) })
            .collect();
        let run = SceneRun { tracks: Vec::new(), links };
        let matching: Matching = (0..60).map(|frame| ((frame, 0), 7)).collect();
        let times = Times::each(&index, &instances, &run, &matching, 1);
        let [Times { onset, duration, again }] = &times[..] else { panic!("one access point") };
        // Frames 26, 27 and 28 come 0.2 to 0.4 s before it; 31, 32 and 33 before it is over.
        assert_eq!((onset.covered, duration.covered, duration.reported), (3, 3, 5));
        // Onsets at 0.1 to 0.9 s against 0.3 s.
        assert!((onset.mean_error_s().unwrap() - (0.2 + 0.1 + 2.1) / 9.0).abs() < 1e-9);
        assert!((duration.median_error_s().unwrap() - 0.1).abs() < 1e-9);
        // In sight at frame 21 to 29 before it; over within 0.9 s from frame 26 on, never as soon as 0.4 s.
        assert_eq!((again.reported, again.covered, again.errors_s.len()), (9, 0, 4));
    }
}
