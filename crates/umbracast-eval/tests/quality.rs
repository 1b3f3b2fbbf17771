//! Lower bounds on what the default mode scores in a few short scenes, so that quality cannot fall unnoticed. The
//! bounds lie a little below what was measured when they were set; raise them when the scores rise. Tuning seeds.

use umbracast::{Config, Mode};
use umbracast_eval::run::chain::{People, SceneSpec, Spec, run};
use umbracast_eval::run::pooled::{Group, score};
use umbracast_eval::run::scene_score::Predictor;
use umbracast_sim::body::{Bodies, kind::Kind};
use umbracast_sim::crowd::{Preset, circle_crossing};

/// Within 300 ms, from the access point at the side.
const WINDOW: usize = 3;
const ACCESS_POINT: &str = "side";

/// Scenes of each crowd: with one, a loss of several hundredths would not show.
const SCENES: usize = 4;

/// What a crowd must reach.
struct Bounds {
    preset: Preset,
    site: &'static str,
    f1: f64,
    onset_f1: f64,
    mota: f64,
    /// Expected calibration error, mean of the windows: at most.
    ece: f64,
}

// Measured, on people of whom no two walk alike: F1 0.941, 0.942 and 0.841, onset F1 0.851, 0.883 and 0.654, MOTA 0.993, 0.993
// and 0.957, ECE 0.009, 0.013 and 0.035. The same program gives the same figures to the digit, so the room below them is for
// changes of late digits alone: a hundredth of F1, twice that of onsets, which are fewer.
const BOUNDS: [Bounds; 3] = [
    Bounds { preset: Preset::Orca03, site: "", f1: 0.931, onset_f1: 0.839, mota: 0.989, ece: 0.012 },
    Bounds { preset: Preset::Mixed, site: "", f1: 0.932, onset_f1: 0.863, mota: 0.989, ece: 0.016 },
    Bounds {
        preset: Preset::Pairs,
        site: include_str!("../../../config/sites/height-6.toml"),
        f1: 0.831,
        onset_f1: 0.634,
        mota: 0.953,
        ece: 0.036,
    },
];

#[test]
fn no_crowd_scores_below_its_bounds() {
    let mut fallen = Vec::new();
    for (seed, bounds) in (100_000..).step_by(SCENES).zip(&BOUNDS) {
        let group = scores(bounds.preset, bounds.site, Bodies::default(), seed);
        let links = group.link(Some(Mode::Default), Predictor::Run, ACCESS_POINT).unwrap();
        let window = &links.windows[WINDOW - 1];
        let ece = links.windows.iter().filter_map(|w| w.ece).sum::<f64>() / links.windows.len() as f64;
        let name = bounds.preset.name();
        for (figure, found, at_least) in [
            ("F1", window.f1.value.unwrap(), bounds.f1),
            ("onset F1", window.onset_f1.value.unwrap(), bounds.onset_f1),
            ("MOTA", group.modes[0].mota.value.unwrap(), bounds.mota),
            ("calibration, 1 - ECE", 1.0 - ece, 1.0 - bounds.ece),
        ] {
            println!("{name}: {figure} {found:.4}, at least {at_least:.4}");
            if found < at_least {
                fallen.push(format!("{name}: {figure}: expected {at_least:.4} at least, found {found:.4}"));
            }
        }
    }
    assert!(fallen.is_empty(), "{fallen:#?}");
}

#[test]
fn who_pushes_something_or_carries_it_over_the_head_is_followed_no_surer_than_right() {
    // Measured: 2.0 and 1.8; without a part of the spread of their own 4.1 and 2.4.
    for (kind, nees_max) in [(Kind::Frame, 2.2), (Kind::Umbrella, 2.0)] {
        let group = scores(Preset::Orca03, "", Bodies::new(vec![(kind, 1.0)], []).unwrap(), 100_100);
        let nees = group.modes[0].position_nees.value.unwrap();
        println!("{kind:?}: NEES {nees:.3}, at most {nees_max}");
        assert!(nees < nees_max, "{kind:?}: expected {nees_max} at most, found {nees}");
    }
}

/// Ten people cross a small circle, so that they meet after a few seconds; a scene ends when most have crossed.
fn scores(preset: Preset, site: &str, bodies: Bodies, first_seed: u64) -> Group {
    let scene = |seed: u64| {
        let mut crowd = circle_crossing(preset, 10, 7.0, seed);
        crowd.duration_ns = crowd.duration_ns.min(14_000_000_000);
        SceneSpec {
            group: preset.name().to_owned(),
            seed,
            people: People::Replayed(crowd),
            bodies: bodies.clone(),
        }
    };
    let spec = Spec {
        configs: vec![Config::with_overlay(Mode::Default, site, "site").unwrap()],
        weights: None,
        scenes: (first_seed..).take(SCENES).map(scene).collect(),
        keep: None,
        ladder: false,
    };
    let results = run(&spec, |_| {}).unwrap();
    score(&results, &spec.configs[0].site).groups.remove(0)
}
