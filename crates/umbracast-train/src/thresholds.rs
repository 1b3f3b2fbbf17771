//! Finds the probability at which a link is called blocked: the one with the best F1 over all windows and access
//! points on tuning scenes. It also gives that of each window alone.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use umbracast::{Config, Error, STEPS};
use umbracast_eval::run::chain::{self, SceneSpec, Spec};
use umbracast_eval::score::instances::instances;
use umbracast_eval::score::links::Said;
use umbracast_eval::score::matching::match_scene;
use umbracast_eval::score::scene::TruthIndex;
use umbracast_sim::crowd::Preset;

/// Tuning seeds only (docs/CONVENTIONS.md).
const FIRST_SEED: u64 = 100_000;
const PRESETS: [Preset; 3] = [Preset::Orca03, Preset::Orca06, Preset::Mixed];
const PEOPLE: usize = 10;

/// By window: probability, blocked in truth.
type Cases = [Vec<(f64, bool)>; STEPS];

/// Runs so many scenes (of three crowds in turn, rounded up) and returns, by window, what is best and its F1, and the
/// line for `config/default.toml`. `scene_done` is called after each scene, from any thread.
///
/// # Errors
/// A setting that cannot work.
pub fn tune_thresholds(scenes: usize, scene_done: impl Fn(usize, usize) + Sync) -> Result<String, Error> {
    let specs = chain::drawn_scenes(&PRESETS, scenes.div_ceil(PRESETS.len()), PEOPLE, FIRST_SEED);
    let done = AtomicUsize::new(0);
    let counted = |scene| {
        let cases = of_scene(scene);
        scene_done(done.fetch_add(1, Ordering::Relaxed) + 1, specs.len());
        cases
    };
    let all: Vec<Cases> = specs.par_iter().map(counted).collect::<Result<_, _>>()?;
    let (mut text, mut everything) = (String::new(), Vec::new());
    for w in 0..STEPS {
        let cases: Vec<(f64, bool)> = all.iter().flat_map(|scene| scene[w].iter().copied()).collect();
        let (threshold, f1_there) = best(&cases);
        writeln!(text, "w = {}: F1 {f1_there:.4} at {threshold:.2}, {:.4} at 0.50", w + 1, f1(&cases, 0.5))
            .expect("a string takes every line");
        everything.extend(cases);
    }
    Ok(format!("{text}threshold = {:.2}", best(&everything).0))
}

fn of_scene(scene: &SceneSpec) -> Result<Cases, Error> {
    let configs = vec![Config::default()];
    let spec = Spec { configs, weights: None, scenes: vec![scene.clone()], keep: Some(0), ladder: false };
    let results = chain::run(&spec, |_| {})?;
    let (truth, runs) = results[0].kept.as_ref().expect("the only scene is kept");
    let instances = instances(&TruthIndex::new(truth));
    let matching = match_scene(&truth.people, &runs[0].tracks);
    let predictions = Said::by_run(&runs[0]).of_tracks(&instances, &matching);
    let of_window =
        |w: usize| instances.iter().zip(&predictions).map(move |(i, p)| (p.p[w], i.blocked_within(w + 1)));
    Ok(std::array::from_fn(|w| of_window(w).collect()))
}

/// The best threshold and its F1; of equals the highest.
fn best(cases: &[(f64, bool)]) -> (f64, f64) {
    let candidates = (10..=80).map(|percent| f64::from(percent) * 0.01);
    let scored = candidates.map(|threshold| (threshold, f1(cases, threshold)));
    scored.max_by(|a, b| a.1.total_cmp(&b.1)).expect("there are candidates")
}

/// Of calling blocked what is at least as probable as `threshold`; 0 where nothing is blocked.
fn f1(cases: &[(f64, bool)], threshold: f64) -> f64 {
    let count = |said: bool, truth: bool| {
        cases.iter().filter(|&&(p, blocked)| (p >= threshold) == said && blocked == truth).count() as f64
    };
    let matched = count(true, true);
    2.0 * matched / (2.0 * matched + count(true, false) + count(false, true)).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_threshold_lies_between_what_is_and_what_is_not() {
        let cases = [(0.05, false), (0.2, false), (0.29, false), (0.305, true), (0.9, true)];
        assert_eq!(best(&cases), (0.3, 1.0));
        assert_eq!(f1(&cases, 0.5), 2.0 / 3.0);
        assert_eq!(f1(&[(0.2, false)], 0.5), 0.0);
    }
}
