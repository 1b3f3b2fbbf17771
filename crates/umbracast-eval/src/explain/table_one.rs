//! Searches for the error of the tracks with which the paper's LSTM has the errors of Table I.

use rayon::prelude::*;
use umbracast::config::Rollout;
use umbracast::forecast::Weights;
use umbracast::{Error, STEPS};

use super::replay::{Noise, Replay};
use crate::report::published::DISPLACEMENT_M;
use crate::score::bootstrap::Pooled;
use crate::score::displacement::Displacement;

/// How often the bracket is narrowed: to a fiftieth.
const STEPS_OF_SEARCH: u32 = 8;

/// Mean displacement at each step if stage 2 is fed with such tracks, metres.
///
/// # Errors
/// As [`Replay::foresee`].
pub fn displacement_m(
    replays: &[Replay],
    noise: &Noise,
    rollout: Rollout,
    weights: &Weights,
) -> Result<[f64; STEPS], Error> {
    let of = |replay: &Replay| Ok(replay.displacement(&replay.foresee(noise, rollout, weights)?));
    let scenes: Vec<Displacement> = replays.par_iter().map(of).collect::<Result<_, Error>>()?;
    Ok(means_m(&scenes))
}

/// The same of a forecast that people stand where they are.
pub fn standing_still_m(replays: &[Replay]) -> [f64; STEPS] {
    means_m(&replays.iter().map(Replay::standing_still).collect::<Vec<_>>())
}

/// Mean displacement at each step over all scenes, metres.
pub fn means_m(scenes: &[Displacement]) -> [f64; STEPS] {
    let sums = scenes.iter().fold(Displacement::default(), |sums, scene| sums.plus(scene, 1));
    std::array::from_fn(|i| sums.mean_m(i + 1).unwrap_or(f64::NAN))
}

/// Root of the mean squared difference from Table I, metres.
pub fn off_table_one_m(displacement_m: &[f64; STEPS]) -> f64 {
    let squares =
        displacement_m.iter().zip(DISPLACEMENT_M).map(|(found, published)| (found - published).powi(2));
    (squares.sum::<f64>() / STEPS as f64).sqrt()
}

/// How large a noise of this kind must be to come nearest to Table I, between 0 and `largest` times the given one.
///
/// # Errors
/// As [`Replay::foresee`].
pub fn fitted(
    replays: &[Replay],
    kind: &Noise,
    largest: f64,
    rollout: Rollout,
    weights: &Weights,
) -> Result<Noise, Error> {
    let off = |size: f64| {
        Ok::<_, Error>(off_table_one_m(&displacement_m(replays, &kind.times(size), rollout, weights)?))
    };
    // Golden section: one new value a step.
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut low, mut high) = (0.0, largest);
    let inner = |low: f64, high: f64| (high - golden * (high - low), low + golden * (high - low));
    let (a, b) = inner(low, high);
    let (mut off_a, mut off_b) = (off(a)?, off(b)?);
    for _ in 0..STEPS_OF_SEARCH {
        let (a, b) = inner(low, high);
        if off_a < off_b {
            (high, off_b) = (b, off_a);
            off_a = off(inner(low, high).0)?;
        } else {
            (low, off_a) = (a, off_b);
            off_b = off(inner(low, high).1)?;
        }
    }
    Ok(kind.times((low + high) / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_table_is_no_way_off_itself_and_3_cm_everywhere_are_3_cm() {
        assert_eq!(off_table_one_m(&DISPLACEMENT_M), 0.0);
        assert!((off_table_one_m(&DISPLACEMENT_M.map(|d| d - 0.03)) - 0.03).abs() < 1e-12);
    }
}
