//! Finds, for every window, the probability from which on a link is called blocked: the one with the best F1
//! over both access points on tuning scenes. Prints the lines for `config/default.toml` and the F1 they give.
//!
//! `cargo run --release -p umbracast-eval --example tune_thresholds -- 12`

use rayon::prelude::*;
use umbracast::{Config, Error, STEPS};
use umbracast_eval::chain::{self, Spec};
use umbracast_eval::instances::instances;
use umbracast_eval::links::Said;
use umbracast_eval::matching::match_scene;
use umbracast_eval::scene::TruthIndex;
use umbracast_sim::crowd::Preset;

/// Tuning seeds only (docs/CONVENTIONS.md).
const FIRST_SEED: u64 = 100_000;

/// By window: probability, blocked in truth.
type Cases = [Vec<(f64, bool)>; STEPS];

fn main() -> Result<(), Error> {
    let scenes: usize = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(12);
    let presets = [Preset::Orca03, Preset::Orca06, Preset::Mixed];
    let specs = chain::drawn_scenes(&presets, scenes.div_ceil(presets.len()), 10, FIRST_SEED);
    let of_scene = |scene: &chain::SceneSpec| -> Result<Cases, Error> {
        let configs = vec![Config::default()];
        let scenes = vec![scene.clone()];
        let spec = Spec { configs, weights: None, scenes, keep: Some(0), ladder: false };
        let results = chain::run(&spec, |_| {})?;
        let (truth, runs) = results[0].kept.as_ref().expect("the only scene is kept");
        let index = TruthIndex::new(truth);
        let instances = instances(&index);
        let matching = match_scene(&truth.people, &runs[0].tracks);
        let predictions = Said::by_run(&runs[0]).of_tracks(&instances, &matching);
        let of_window = |w: usize| {
            instances.iter().zip(&predictions).map(move |(i, p)| (p.p[w], i.blocked_within(w + 1)))
        };
        Ok(std::array::from_fn(|w| of_window(w).collect()))
    };
    let all: Vec<Cases> = specs.par_iter().map(of_scene).collect::<Result<_, _>>()?;
    let mut thresholds = Vec::new();
    for w in 0..STEPS {
        let cases: Vec<(f64, bool)> = all.iter().flat_map(|scene| scene[w].iter().copied()).collect();
        let f1 = |threshold: f64| {
            let count = |p: bool, t: bool| {
                cases.iter().filter(|&&(q, blocked)| (q >= threshold) == p && blocked == t).count() as f64
            };
            let hits = count(true, true);
            2.0 * hits / (2.0 * hits + count(true, false) + count(false, true))
        };
        let candidates = (10..=80).map(|percent| f64::from(percent) * 0.01);
        let best = candidates.max_by(|a, b| f1(*a).total_cmp(&f1(*b))).expect("there are candidates");
        println!("w = {}: F1 {:.4} at {best:.2}, {:.4} at 0.50", w + 1, f1(best), f1(0.5));
        thresholds.push(format!("{best:.2}"));
    }
    println!("threshold = [{}]", thresholds.join(", "));
    Ok(())
}
