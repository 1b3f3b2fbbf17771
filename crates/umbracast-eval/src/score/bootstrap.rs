//! Intervals by bootstrap over recordings: instances of one scene are correlated, and so are scenes in which the same
//! people walk the same trajectories with other bodies. Recordings are not. Each drawn crowd is a recording of its
//! own.

use rand::RngExt;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::score::counts::Counts;

/// Fewer recordings say nothing of how recordings differ: drawn anew they give their own scores back.
const RECORDINGS_MIN: usize = 5;
/// How often the recordings are drawn anew.
const RESAMPLES: usize = 1000;
/// Where the generator starts: the same scores give the same intervals.
const SEED: u64 = 0x756d_6272_6163_6173;

/// Sums of a scene that can be added, several times over, to those of others.
pub trait Pooled: Default {
    /// These sums with `times` those of `other`.
    #[must_use]
    fn plus(&self, other: &Self, times: u64) -> Self;
}

impl Pooled for Counts {
    fn plus(&self, other: &Self, times: u64) -> Self {
        Self {
            true_positive: self.true_positive + times * other.true_positive,
            false_positive: self.false_positive + times * other.false_positive,
            false_negative: self.false_negative + times * other.false_negative,
            true_negative: self.true_negative + times * other.true_negative,
        }
    }
}

/// The same draws of recordings for every score, so that scores of one table can be compared.
#[derive(Debug)]
pub struct Bootstrap {
    /// For each resample, how often each recording was drawn.
    draws: Vec<Vec<u32>>,
    /// Of which recording each scene is.
    recording_of: Vec<usize>,
    recordings: usize,
}

impl Bootstrap {
    /// For scenes of these recordings: `recordings[i]` tells scene i's from others. All scenes of a recording are drawn
    /// together.
    pub fn new(recordings: &[u64]) -> Self {
        let mut distinct: Vec<u64> = Vec::new();
        let place = |recording: &u64| {
            distinct.iter().position(|known| known == recording).unwrap_or_else(|| {
                distinct.push(*recording);
                distinct.len() - 1
            })
        };
        let recording_of = recordings.iter().map(place).collect();
        let recordings = distinct.len();
        let mut random = Pcg64Mcg::seed_from_u64(SEED);
        let mut draw = || {
            let mut times = vec![0; recordings];
            (0..recordings).for_each(|_| times[random.random_range(0..recordings as u64) as usize] += 1);
            times
        };
        Self { draws: (0..RESAMPLES).map(|_| draw()).collect(), recording_of, recordings }
    }

    /// How many recordings the scenes are of.
    pub fn recordings(&self) -> usize {
        self.recordings
    }

    /// The sums of each resample of the recordings; `sums[i]` is scene i's. Empty with fewer than five recordings.
    pub fn resampled<T: Pooled>(&self, sums: &[T]) -> Vec<T> {
        if self.recordings < RECORDINGS_MIN || sums.len() != self.recording_of.len() {
            return Vec::new();
        }
        let resample = |times: &Vec<u32>| {
            sums.iter().zip(&self.recording_of).fold(T::default(), |all, (sum, &recording)| {
                match times[recording] {
                    0 => all,
                    n => all.plus(sum, u64::from(n)),
                }
            })
        };
        self.draws.iter().map(resample).collect()
    }
}

/// The middle 95 % of `score` over resamples. `None` without any, or where the score is undefined in some.
pub fn interval<T>(resampled: &[T], score: impl Fn(&T) -> Option<f64>) -> Option<[f64; 2]> {
    let mut values = resampled.iter().map(score).collect::<Option<Vec<f64>>>()?;
    values.sort_unstable_by(f64::total_cmp);
    (!values.is_empty()).then(|| [quantile(&values, 0.025), quantile(&values, 0.975)])
}

/// Of sorted values, by linear interpolation between neighbours.
pub fn quantile(sorted: &[f64], q: f64) -> f64 {
    let at = q * (sorted.len() - 1) as f64;
    let low = at as usize;
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + (sorted[high] - sorted[low]) * (at - low as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(matched: u64, missed: u64) -> Counts {
        Counts { true_positive: matched, false_negative: missed, ..Counts::default() }
    }

    fn interval_of(scenes: &[Counts], score: fn(&Counts) -> Option<f64>) -> Option<[f64; 2]> {
        let recordings: Vec<u64> = (0..scenes.len() as u64).collect();
        interval(&Bootstrap::new(&recordings).resampled(scenes), score)
    }

    #[test]
    fn equal_scenes_leave_no_doubt() {
        assert_eq!(interval_of(&[scene(3, 1); 5], Counts::recall), Some([0.75, 0.75]));
    }

    #[test]
    fn the_interval_is_that_of_the_binomial_when_scenes_are_all_or_nothing() {
        // 50 scenes of one instance each, half of them matched: recall is a mean of 50 coin flips, sd 0.0707.
        let scenes: Vec<Counts> = (0..50).map(|i| scene(i % 2, 1 - i % 2)).collect();
        let [low, high] = interval_of(&scenes, Counts::recall).unwrap();
        assert!((low - 0.36).abs() < 0.03 && (high - 0.64).abs() < 0.03, "{low} {high}");
    }

    #[test]
    fn few_scenes_have_no_interval() {
        assert_eq!(interval_of(&[scene(3, 1)], Counts::recall), None);
        assert_eq!(interval_of(&[scene(3, 1); 4], Counts::recall), None);
    }

    #[test]
    fn draws_of_one_recording_are_no_recordings() {
        let scenes: Vec<Counts> = (0..10).map(|i| scene(i % 5, 4 - i % 5)).collect();
        let of =
            |recordings: &[u64]| interval(&Bootstrap::new(recordings).resampled(&scenes), Counts::recall);
        assert_eq!(of(&[7; 10]), None);
        assert_eq!(of(&[0, 0, 0, 1, 1, 1, 2, 2, 3, 3]), None, "ten scenes of four recordings");
        // Twice the same five scenes: as wide as five scenes once, not as narrow as ten.
        let five = interval_of(&scenes[..5], Counts::recall);
        assert_eq!(of(&[0, 1, 2, 3, 4, 0, 1, 2, 3, 4]), five);
        let [low, high] = five.unwrap();
        let [low_of_ten, high_of_ten] = interval_of(&scenes, Counts::recall).unwrap();
        assert!(low < low_of_ten && high_of_ten < high, "{five:?} {low_of_ten} {high_of_ten}");
    }

    #[test]
    fn the_same_scenes_give_the_same_interval() {
        let scenes: Vec<Counts> = (0..7).map(|i| scene(i, 7 - i)).collect();
        let twice = [0, 1].map(|_| interval_of(&scenes, Counts::f1));
        assert_eq!(twice[0], twice[1]);
    }
}
