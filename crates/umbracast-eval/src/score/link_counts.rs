//! Sums from which every score of stage 3 is computed, over instances and then over scenes.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use umbracast::{STEP_NS, STEPS};

use crate::score::bootstrap::Pooled;
use crate::score::counts::{Counts, ratio};
use crate::score::instances::Instance;

/// Bins of the calibration error, equally wide from 0 to 1.
pub const ECE_BINS: usize = 15;

/// What a predictor says of one link at `t_e`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Index w - 1: blocked within steps 1..=w.
    pub blocked: [bool; STEPS],
    /// The same as a probability.
    pub p: [f64; STEPS],
}

impl Prediction {
    /// "Not blocked", for sure: what is said of a person whom nobody follows.
    pub const CLEAR: Self = Self { blocked: [false; STEPS], p: [0.0; STEPS] };

    /// The same answer for every window, for sure.
    pub fn constant(blocked: bool) -> Self {
        Self::certain([blocked; STEPS])
    }

    /// A binary answer: its probability is 0 or 1.
    pub fn certain(blocked: [bool; STEPS]) -> Self {
        Self { blocked, p: blocked.map(|b| if b { 1.0 } else { 0.0 }) }
    }

    /// A binary answer known by step: blocked within w when blocked at any of steps 1..=w.
    pub fn from_steps(blocked_at: [bool; STEPS]) -> Self {
        let mut blocked = blocked_at;
        for step in 1..STEPS {
            blocked[step] |= blocked[step - 1];
        }
        Self::certain(blocked)
    }
}

/// One bin of the reliability diagram.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Bin {
    /// Instances whose probability falls in here.
    pub count: u64,
    /// Their probabilities, added.
    pub p_sum: f64,
    /// How many of them were blocked.
    pub blocked: u64,
}

impl Pooled for Bin {
    fn plus(&self, other: &Self, times: u64) -> Self {
        Self {
            count: self.count + times * other.count,
            p_sum: self.p_sum + times as f64 * other.p_sum,
            blocked: self.blocked + times * other.blocked,
        }
    }
}

/// Everything that was said for one window of one access point.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct WindowCounts {
    /// All instances.
    pub all: Counts,
    /// Those in sight at `t_e`: who says "as now" scores nothing here.
    pub onset: Counts,
    /// Squared differences of probability and truth, added.
    pub brier_sum: f64,
    /// For calibration.
    #[serde(serialize_with = "write_filled", deserialize_with = "read_filled")]
    pub bins: [Bin; ECE_BINS],
    /// Probabilities, falling, each with how many instances were in sight and how many blocked.
    ranking: Vec<(f32, u32, u32)>,
}

impl WindowCounts {
    /// What was said for window `w` of these instances; `predictions[i]` belongs to `instances[i]`.
    pub fn of(instances: &[Instance], predictions: &[Prediction], w: usize) -> Self {
        let mut counts = Self::default();
        for (instance, prediction) in instances.iter().zip(predictions) {
            let (truth, said) = (instance.blocked_within(w), prediction.blocked[w - 1]);
            counts.all.count(truth, said);
            if !instance.blocked_now {
                counts.onset.count(truth, said);
            }
            let p = prediction.p[w - 1];
            counts.brier_sum += (p - f64::from(u8::from(truth))).powi(2);
            let bin = &mut counts.bins[((p * ECE_BINS as f64) as usize).min(ECE_BINS - 1)];
            bin.count += 1;
            bin.p_sum += p;
            bin.blocked += u64::from(truth);
            counts.ranking.push((p as f32, u32::from(!truth), u32::from(truth)));
        }
        counts.ranking = ranked(counts.ranking);
        counts
    }

    /// Those of all scenes together.
    pub fn pooled<'a>(scenes: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut pooled = Self::default();
        for scene in scenes {
            pooled.all = pooled.all.plus(&scene.all, 1);
            pooled.onset = pooled.onset.plus(&scene.onset, 1);
            pooled.brier_sum += scene.brier_sum;
            for (bin, more) in pooled.bins.iter_mut().zip(&scene.bins) {
                *bin = bin.plus(more, 1);
            }
            pooled.ranking.extend_from_slice(&scene.ranking);
        }
        pooled.ranking = ranked(pooled.ranking);
        pooled
    }

    /// Mean squared difference of probability and truth.
    pub fn brier(&self) -> Option<f64> {
        (self.all.total() > 0).then(|| self.brier_sum / self.all.total() as f64)
    }

    /// Expected calibration error: over the bins, |mean probability - share blocked| weighted by count.
    pub fn ece(&self) -> Option<f64> {
        calibration_error(&self.bins, self.all.total())
    }

    /// Area under the precision-recall curve as average precision: the sum over falling thresholds of precision
    /// times the gain in recall. `None` when nothing was blocked.
    pub fn auprc(&self) -> Option<f64> {
        let positives: u64 = self.ranking.iter().map(|r| u64::from(r.2)).sum();
        let (mut matched, mut said, mut area) = (0_u64, 0_u64, 0.0);
        for &(_, clear, blocked) in &self.ranking {
            matched += u64::from(blocked);
            said += u64::from(blocked) + u64::from(clear);
            area += f64::from(blocked) * matched as f64 / said as f64;
        }
        (positives > 0).then(|| area / positives as f64)
    }
}

/// [`WindowCounts::ece`] of so many instances in these bins; `None` over nothing.
pub fn calibration_error(bins: &[Bin], instances: u64) -> Option<f64> {
    let gap = |bin: &Bin| (bin.p_sum - bin.blocked as f64).abs();
    (instances > 0).then(|| bins.iter().map(gap).sum::<f64>() / instances as f64)
}

/// Only the bins that hold something, with their places: a yes-or-no answer fills two of the fifteen.
fn write_filled<S: Serializer>(bins: &[Bin; ECE_BINS], serializer: S) -> Result<S::Ok, S::Error> {
    let filled = bins.iter().enumerate().filter(|(_, bin)| bin.count > 0);
    let filled: Vec<_> = filled.map(|(place, bin)| (place, bin.count, bin.p_sum, bin.blocked)).collect();
    filled.serialize(serializer)
}

fn read_filled<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[Bin; ECE_BINS], D::Error> {
    let mut bins = [Bin::default(); ECE_BINS];
    for (place, count, p_sum, blocked) in Vec::<(usize, u64, f64, u64)>::deserialize(deserializer)? {
        let bin = bins.get_mut(place).ok_or_else(|| serde::de::Error::custom("a bin that does not exist"))?;
        *bin = Bin { count, p_sum, blocked };
    }
    Ok(bins)
}

/// Falling by probability, equal ones joined.
fn ranked(mut entries: Vec<(f32, u32, u32)>) -> Vec<(f32, u32, u32)> {
    entries.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    entries.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
            kept.2 += next.2;
        }
        same
    });
    entries
}

/// How long before each onset the warning began.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LeadTimes {
    /// Links that went from in sight to blocked.
    pub onsets: u64,
    /// For each of them that was warned of: the onset's time minus the start of the unbroken warning before it.
    pub lead_s: Vec<f64>,
}

impl LeadTimes {
    /// Of window `w`. The instances are those of one scene in their order; a warning counts from where the link
    /// last came into sight.
    pub fn of(instances: &[Instance], predictions: &[Prediction], w: usize) -> Self {
        let mut leads = Self::default();
        for last in 0..instances.len() {
            let before = &instances[last];
            if before.blocked_now || before.first_blocked != Some(1) {
                continue;
            }
            leads.onsets += 1;
            let mut warned_since = None;
            for i in (0..=last).rev() {
                let same_link = (instances[i].access_point, instances[i].person)
                    == (before.access_point, before.person)
                    && before.frame - instances[i].frame == (last - i) as u64;
                if !same_link || instances[i].blocked_now || !predictions[i].blocked[w - 1] {
                    break;
                }
                warned_since = Some(instances[i].time_ns);
            }
            let onset_ns = before.time_ns + STEP_NS;
            leads.lead_s.extend(warned_since.map(|since_ns| (onset_ns - since_ns) as f64 / 1e9));
        }
        leads
    }

    /// Those of all scenes together.
    pub fn pooled<'a>(scenes: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut pooled = Self::default();
        for scene in scenes {
            pooled.onsets += scene.onsets;
            pooled.lead_s.extend_from_slice(&scene.lead_s);
        }
        pooled
    }

    /// Share of onsets warned of.
    pub fn warned_share(&self) -> Option<f64> {
        ratio(self.lead_s.len() as u64, self.onsets)
    }

    /// The middle one of the lead times of the warned onsets, seconds.
    pub fn median_s(&self) -> Option<f64> {
        let mut sorted = self.lead_s.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let n = sorted.len();
        // Times are whole steps and their halves: no more digits than that are printed.
        let rounded = |seconds: f64| (seconds * 1e9).round() / 1e9;
        (n > 0).then(|| rounded((sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0))
    }
}

/// Everything a predictor said of the links of one access point.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkCounts {
    /// Index w - 1.
    pub windows: [WindowCounts; STEPS],
    /// Index w - 1.
    pub leads: [LeadTimes; STEPS],
}

impl LinkCounts {
    /// Of the instances of one access point.
    pub fn of(instances: &[Instance], predictions: &[Prediction]) -> Self {
        Self {
            windows: std::array::from_fn(|i| WindowCounts::of(instances, predictions, i + 1)),
            leads: std::array::from_fn(|i| LeadTimes::of(instances, predictions, i + 1)),
        }
    }

    /// One for each of `access_points`, from the instances of all of them.
    pub fn each(instances: &[Instance], predictions: &[Prediction], access_points: u32) -> Vec<Self> {
        let of = |ap| {
            let start = instances.partition_point(|i| i.access_point < ap);
            let end = instances.partition_point(|i| i.access_point <= ap);
            Self::of(&instances[start..end], &predictions[start..end])
        };
        (0..access_points).map(of).collect()
    }

    /// Those of all scenes together.
    pub fn pooled(scenes: &[&Self]) -> Self {
        Self {
            windows: std::array::from_fn(|i| {
                WindowCounts::pooled(scenes.iter().map(|scene| &scene.windows[i]))
            }),
            leads: std::array::from_fn(|i| LeadTimes::pooled(scenes.iter().map(|scene| &scene.leads[i]))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::truth_of;
    use crate::score::instances::instances;
    use crate::score::scene::TruthIndex;

    fn instance(frame: u64, blocked_now: bool, first_blocked: Option<usize>) -> Instance {
        let time_ns = (frame as i64 + 1) * STEP_NS;
        Instance { access_point: 0, person: 0, frame, time_ns, blocked_now, first_blocked }
    }

    fn says(p: f64) -> Prediction {
        Prediction { blocked: [p >= 0.5; STEPS], p: [p; STEPS] }
    }

    /// Truth of window 1 and what was said, by hand.
    fn counts(cases: &[(bool, bool, f64)]) -> WindowCounts {
        let instances: Vec<_> = cases
            .iter()
            .enumerate()
            .map(|(i, &(now, truth, _))| instance(i as u64, now, truth.then_some(1)))
            .collect();
        let predictions: Vec<_> = cases.iter().map(|&(_, _, p)| says(p)).collect();
        WindowCounts::of(&instances, &predictions, 1)
    }

    fn close(found: Option<f64>, expected: f64) -> bool {
        found.is_some_and(|found| (found - expected).abs() < 1e-9)
    }

    #[test]
    fn who_never_warns_has_an_f1_of_0_and_no_precision() {
        let counts = counts(&[(false, true, 0.0), (false, false, 0.0)]);
        assert_eq!((counts.all.f1(), counts.all.precision()), (Some(0.0), None));
        assert!(close(counts.all.accuracy(), 0.5));
    }

    #[test]
    fn scores_over_nothing_are_none() {
        let empty = WindowCounts::default();
        assert_eq!((empty.all.f1(), empty.brier(), empty.ece(), empty.auprc()), (None, None, None, None));
    }

    #[test]
    fn onset_counts_only_links_in_sight_now() {
        let counts = counts(&[(true, true, 0.9), (true, false, 0.9), (false, true, 0.9), (false, true, 0.1)]);
        assert_eq!(counts.all.total(), 4);
        assert_eq!(
            (counts.onset.true_positive, counts.onset.false_negative, counts.onset.total()),
            (1, 1, 2)
        );
        assert!(close(counts.onset.f1(), 2.0 / 3.0));
    }

    #[test]
    fn average_precision_is_that_of_scikit_learns_example() {
        // sklearn.metrics.average_precision_score([0, 0, 1, 1], [0.1, 0.4, 0.35, 0.8]) == 0.8333...
        let counts =
            counts(&[(false, false, 0.1), (false, false, 0.4), (false, true, 0.35), (false, true, 0.8)]);
        assert!(close(counts.auprc(), 5.0 / 6.0));
    }

    #[test]
    fn equal_probabilities_are_one_threshold() {
        // One threshold for all: precision 1/4 at recall 1, whatever the order.
        let counts =
            counts(&[(false, true, 0.3), (false, false, 0.3), (false, false, 0.3), (false, false, 0.3)]);
        assert!(close(counts.auprc(), 0.25));
    }

    #[test]
    fn brier_and_calibration_by_hand() {
        let counts =
            counts(&[(false, true, 0.8), (false, false, 0.8), (false, false, 0.1), (false, true, 1.0)]);
        assert!(close(counts.brier(), (0.04 + 0.64 + 0.01 + 0.0) / 4.0));
        // Bins: two at 0.8, half of them blocked; one at 0.1, none; one at 1.0, blocked.
        assert!(close(counts.ece(), (2.0 * 0.3 + 0.1 + 0.0) / 4.0));
    }

    #[test]
    fn a_calibrated_predictor_has_no_calibration_error() {
        let cases: Vec<_> = (0..4).map(|i| (false, i == 0, 0.25)).collect();
        assert!(close(counts(&cases).ece(), 0.0));
    }

    #[test]
    fn pooled_scenes_equal_one_scene_of_all() {
        let (a, b) = ([(false, true, 0.7), (true, false, 0.2)], [(false, false, 0.7), (false, true, 0.4)]);
        let pooled = WindowCounts::pooled([&counts(&a), &counts(&b)]);
        let whole = counts(&[a, b].concat());
        assert_eq!(pooled.all, whole.all);
        assert_eq!((pooled.auprc(), pooled.ece()), (whole.auprc(), whole.ece()));
    }

    #[test]
    fn lead_time_is_onset_minus_start_of_the_unbroken_warning() {
        // Blocked at frame 30 and after; warned at 22, then without a break from 25 on.
        let truth = truth_of(1, 60, |_, frame| frame >= 30);
        let instances = instances(&TruthIndex::new(&truth));
        let warned = |frame: u64| frame == 22 || frame >= 25;
        let predictions: Vec<_> = instances.iter().map(|i| Prediction::constant(warned(i.frame))).collect();
        let leads = LeadTimes::of(&instances, &predictions, 3);
        assert_eq!((leads.onsets, leads.warned_share()), (1, Some(1.0)));
        assert!(close(leads.median_s(), 0.5));
    }

    #[test]
    fn an_onset_without_a_warning_in_the_frame_before_is_not_warned_of() {
        let truth = truth_of(1, 60, |_, frame| frame >= 30);
        let instances = instances(&TruthIndex::new(&truth));
        let predictions: Vec<_> = instances.iter().map(|i| Prediction::constant(i.frame < 29)).collect();
        let leads = LeadTimes::of(&instances, &predictions, 3);
        assert_eq!((leads.onsets, leads.warned_share(), leads.median_s()), (1, Some(0.0), None));
    }

    #[test]
    fn a_warning_that_goes_on_through_a_blockage_starts_anew_when_the_link_is_in_sight() {
        let truth = truth_of(1, 60, |_, frame| frame == 25 || frame == 30);
        let instances = instances(&TruthIndex::new(&truth));
        let predictions: Vec<_> = instances.iter().map(|_| Prediction::constant(true)).collect();
        let leads = LeadTimes::of(&instances, &predictions, 1);
        // Instants from frame 9 on: 1.6 s before frame 25; frames 26 to 29 before frame 30.
        assert_eq!(leads.lead_s.iter().map(|s| (s * 10.0).round()).collect::<Vec<_>>(), [16.0, 4.0]);
    }

    #[test]
    fn the_worlds_of_two_people_do_not_mix_in_lead_times() {
        let truth = truth_of(2, 40, |person, frame| person == 1 && frame == 10);
        let instances = instances(&TruthIndex::new(&truth));
        let predictions: Vec<_> = instances.iter().map(|_| Prediction::constant(true)).collect();
        let leads = LeadTimes::of(&instances, &predictions, 9);
        assert_eq!(leads.lead_s, [0.1]);
    }
}
