//! Samples to learn from: scenes are simulated and run through stage 1, and each matched track gives a sample at each
//! frame.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use umbracast::forecast::inputs::{Seen, see};
use umbracast::geometry::DVec2;
use umbracast::lidar::{Assembler, Frame};
use umbracast::track::Track;
use umbracast::{Config, Error, Health, Pipeline, STEP_S, STEPS};
use umbracast_eval::run::chain::{CIRCLE_M, empty_frames, push};
use umbracast_eval::score::matching::match_scene;
use umbracast_eval::score::scene::{SceneTruth, TruthIndex, note_truth};
use umbracast_io::rows;
use umbracast_sim::crowd::{Crowd, Preset, circle_crossing, mixed, speed_augmented};
use umbracast_sim::scene::Scene;

use crate::bodies::bodies;

/// So many scenes in a row have the same bodies.
const SCENES_ALIKE: u64 = 6;

/// A track at a frame, and its person's way from there.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// What the network reads.
    pub seen: Seen,
    /// Along and across, how far the person is from the track carried on at constant velocity, now and at each
    /// step, metres.
    pub departure_m: [[f32; 2]; STEPS + 1],
}

/// A scene to learn from.
#[derive(Debug, Clone)]
pub struct SampleScene {
    /// Who walks.
    pub crowd: Crowd,
    /// Of bodies and sensors.
    pub seed: u64,
    /// Both sensors are moved up or down by this, metres.
    pub raised_m: f64,
}

/// Scenes of a crowd: presets as they are, and some of them speed-augmented. Seed i of `seeds` is scene i.
pub fn drawn_scenes(
    presets: &[(Preset, bool)],
    people: usize,
    seeds: std::ops::Range<u64>,
) -> Vec<SampleScene> {
    let scene = |seed: u64| {
        let (preset, augmented) = presets[seed as usize % presets.len()];
        let crowd = match preset {
            Preset::Mixed => mixed::crowd(people, CIRCLE_M, seed),
            _ => circle_crossing(preset, people, CIRCLE_M, seed),
        };
        recorded_scene(crowd, seed, augmented)
    };
    seeds.map(scene).collect()
}

/// A scene of given ways, as they are or speed-augmented. Every third scene has its sensors lower or higher.
pub fn recorded_scene(crowd: Crowd, seed: u64, augmented: bool) -> SampleScene {
    let crowd = if augmented { speed_augmented(&crowd, seed) } else { crowd };
    let mut rng = Pcg64::seed_from_u64(seed);
    let raised_m = if rng.random::<f64>() < 1.0 / 3.0 { rng.random_range(-3.0..1.0) } else { 0.0 };
    SampleScene { crowd, seed, raised_m }
}

/// The samples of many scenes, in their order. `done` is called after each scene, from any thread.
///
/// # Errors
/// A setting that cannot work.
pub fn collect(
    scenes: &[SampleScene],
    config: &Config,
    done: impl Fn() + Sync,
) -> Result<Vec<Vec<Sample>>, Error> {
    let of_scene = |scene: &SampleScene| {
        let samples = of_scene(scene, config)?;
        done();
        Ok(samples)
    };
    scenes.par_iter().map(of_scene).collect()
}

fn of_scene(scene: &SampleScene, config: &Config) -> Result<Vec<Sample>, Error> {
    let mut config = config.clone();
    // Links are not looked at; without access points they cost nothing.
    config.site.access_points.clear();
    config.site.sensors.iter_mut().for_each(|sensor| sensor.position_m[2] += scene.raised_m);
    let mut pipeline = Pipeline::new(&config, None)?;
    empty_frames(&config.site, scene.seed)?.iter().for_each(|frame| pipeline.learn_empty(frame));
    let (mut assembler, mut health) = (Assembler::new(&config.site)?, Health::default());
    let mut simulated = Scene::new(scene.crowd.clone(), &config.site, scene.seed)?
        .with_bodies(&bodies(scene.seed / SCENES_ALIKE)?);
    let (mut truth, mut tracks) = (SceneTruth::default(), Vec::new());
    let mut seen: BTreeMap<(u64, u64), (Seen, [DVec2; 2])> = BTreeMap::new();
    let mut step = |frame: &Frame, tracks: &mut Vec<_>| {
        let outcome = pipeline.step(frame);
        rows::of_outcome(0, outcome, tracks, &mut Vec::new());
        for (i, Track { id, position_m, velocity_mps, .. }) in outcome.tracks.iter().enumerate() {
            let state = [*position_m, *velocity_mps];
            seen.insert((outcome.frame, *id), (see(&outcome.tracks, i), state));
        }
    };
    while let Some(frame) = simulated.next_frame() {
        note_truth(0, &frame, &mut truth);
        push(&mut assembler, &frame.packets, &mut health);
        while let Some(frame) = assembler.pop() {
            step(&frame, &mut tracks);
        }
    }
    assembler.finish();
    while let Some(frame) = assembler.pop() {
        step(&frame, &mut tracks);
    }
    let index = TruthIndex::new(&truth);
    let mut samples = Vec::new();
    for ((frame, person), track) in match_scene(&truth.people, &tracks) {
        let Some((seen, state)) = seen.get(&(frame, track)) else { continue };
        let here = |step: usize| {
            let row = index.person(frame + step as u64, person).filter(|row| !row.arrived)?;
            Some(departure_m(seen.ahead, *state, step, DVec2::new(row.x_m, row.y_m)))
        };
        let Some(departures) = (0..=STEPS).map(here).collect::<Option<Vec<_>>>() else { continue };
        samples
            .push(Sample { seen: seen.clone(), departure_m: std::array::from_fn(|step| departures[step]) });
    }
    Ok(samples)
}

fn departure_m(
    ahead: DVec2,
    [position_m, velocity_mps]: [DVec2; 2],
    step: usize,
    there_m: DVec2,
) -> [f32; 2] {
    let left_m = there_m - (position_m + velocity_mps * (step as f64 * STEP_S));
    [ahead.dot(left_m) as f32, ahead.perp_dot(left_m) as f32]
}
