//! Fits the model of `umbracast::detect::axis` on simulated returns.
//!
//! Training scenes have the seeds 50,000 and on, and the scenes for the errors on the card 130,000 and on. Four
//! layouts of two sensors; people on ORCA's ways, mixed crowds, pairs, and some of them speed-augmented.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use umbracast::config::Config;
use umbracast::detect::axis::{AxisModel, OUTPUTS, UNIT_M};
use umbracast::detect::features::{AxisFeatures, EVEN, ODD};
use umbracast::detect::{Background, Clusterer, Measurer, Prior, SHIFT_M};
use umbracast::geometry::DVec2;
use umbracast::lidar::{Assembler, Views};
use umbracast::track::Tracker;
use umbracast::{Error, Health};
use umbracast_eval::run::chain::{empty_frames, push};
use umbracast_sim::body::Bodies;
use umbracast_sim::crowd::{Crowd, Preset, circle_crossing, pairs, speed_augmented};
use umbracast_sim::scene::Scene;

use crate::adam::Adam;
use crate::bodies::bodies;

/// Height of the sensors, their distance from the middle, the scenes' seeds.
type Layout = (f64, f64, Range<u64>);
const LAYOUTS: [Layout; 4] = [
    (9.0, 16.0, 50_000..50_036),
    (6.0, 12.5, 51_000..51_024),
    (4.0, 13.0, 52_000..52_012),
    (7.5, 14.0, 53_000..53_012),
];
/// Scenes that are not trained on.
const HELD_OUT: Layout = (9.0, 16.0, 130_000..130_006);
/// Sensors look this much below the middle of the hall, so that their beams cover both ends.
const BELOW_MIDDLE_DEG: f64 = 6.0;
/// A cluster found nearer than this to a person is that person.
const OWN_M: f64 = 0.3;
/// Every so many clusters are fitted as if nothing were known of the person.
const UNKNOWN_EVERY: usize = 6;
const PEOPLE: usize = 12;
const HIDDEN: usize = 64;
const EPOCHS: usize = 40;
const BATCH: usize = 256;
const STEP: f64 = 3e-3;
const SHRINK: f64 = 1e-5;
/// Errors beyond so many standard deviations pull no harder: some clusters are of two people.
const PULL_LIMIT: f64 = 4.0;
const SEED: u64 = 1;

/// Fits the model; returns it as TOML, and its card. `commit`, which state of the source this is, goes into the card.
/// `scene_done` is called with scenes done and scenes in all, from any thread.
///
/// # Errors
/// A layout that nothing can be simulated of.
pub fn train_axis(commit: &str, scene_done: impl Fn(usize, usize) + Sync) -> Result<(String, String), Error> {
    let scenes = |(_, _, seeds): &Layout| (seeds.end - seeds.start) as usize;
    let (done, all) = (AtomicUsize::new(0), LAYOUTS.iter().chain([&HELD_OUT]).map(scenes).sum());
    let told = || scene_done(done.fetch_add(1, Ordering::Relaxed) + 1, all);
    let of_layouts: Result<Vec<Vec<Sample>>, Error> =
        LAYOUTS.iter().map(|layout| samples(layout, told)).collect();
    let (training, held_out) = (of_layouts?.concat(), samples(&HELD_OUT, told)?);
    let model = fit(&training);
    Ok((toml(&model), card(&model, &training, &held_out, commit)))
}

fn card(model: &AxisModel, training: &[Sample], held_out: &[Sample], commit: &str) -> String {
    let error = |s: &Sample| model.locate(&s.features).0 - s.features.base_m - s.off_m;
    let rmse = |of: &dyn Fn(&Sample) -> DVec2, samples: &[Sample]| {
        (samples.iter().map(|s| of(s).length_squared()).sum::<f64>() / samples.len() as f64).sqrt()
    };
    let squared = |s: &Sample| {
        let ([[xx, xy], [_, yy]], e) = (model.locate(&s.features).1, error(s));
        (yy * e.x * e.x - 2.0 * xy * e.x * e.y + xx * e.y * e.y) / (xx * yy - xy * xy)
    };
    let consistency = held_out.iter().map(squared).sum::<f64>() / held_out.len() as f64;
    let layouts: String = LAYOUTS
        .iter()
        .map(|(height_m, away_m, seeds)| {
            format!(
                "- {} scenes from seed {}, two HDL-32E {height_m} m high, {away_m} m from the middle\n",
                seeds.end - seeds.start,
                seeds.start
            )
        })
        .collect();
    format!(
        "# Model of the body axis\n\n\
         From what the sensors saw of one body in one frame to where its axis stands, with the error's covariance: \
         {EVEN} + {ODD} inputs, {HIDDEN} hidden units, {OUTPUTS} outputs (`src/detect/axis.rs`).\n\n\
         Written by `umbracast train axis`, commit {commit}.\n\n\
         ## Data\n\nSimulated returns of {PEOPLE} people a scene, in turn: orca-03, mixed speed-augmented, orca-06, \
         pairs 0.6 m apart, mixed, orca-03 speed-augmented. Six scenes have bodies of our own, the next six those of the \
         third-party family `a`; then the same with telephones, bags, rucksacks and hands in pockets among them. No two \
         people walk alike.\n\n\
         {layouts}\n{} clusters; {EPOCHS} epochs, Adam, negative log-likelihood, mirrored at random, seed {SEED}.\n\n\
         ## Error of one frame\n\n\
         | | training | {} scenes of their own from seed {} |\n|---|---|---|\n\
         | each point moved {} m away from its sensor, m | {:.4} | {:.4} |\n| this model, m | {:.4} | {:.4} |\n\
         | squared error over its variance (2 if honest) | | {consistency:.2} |\n",
        training.len(),
        HELD_OUT.2.end - HELD_OUT.2.start,
        HELD_OUT.2.start,
        SHIFT_M,
        rmse(&|s| s.off_m, training),
        rmse(&|s| s.off_m, held_out),
        rmse(&error, training),
        rmse(&error, held_out),
        commit = if commit.is_empty() { "unknown" } else { commit },
    )
}

fn toml(model: &AxisModel) -> String {
    let row = |numbers: &[f64]| {
        let numbers: Vec<String> = numbers.iter().map(|x| format!("{x:.6}")).collect();
        format!("[{}]", numbers.join(", "))
    };
    let rows = |rows: &[Vec<f64>]| {
        let rows: String = rows.iter().map(|r| format!("    {},\n", row(r))).collect();
        format!("[\n{rows}]")
    };
    format!(
        "# The model of the body axis: see body_axis.md. Written by `umbracast train axis`.\n\
         even_mean = {}\neven_scale = {}\nodd_scale = {}\nhidden = {}\nhidden_bias = {}\noutput = {}\n\
         output_bias = {}\n",
        row(&model.even_mean),
        row(&model.even_scale),
        row(&model.odd_scale),
        rows(&model.hidden),
        row(&model.hidden_bias),
        rows(&model.output),
        row(&model.output_bias),
    )
}

#[derive(Debug, Clone)]
struct Sample {
    features: AxisFeatures,
    /// From the base to the true axis.
    off_m: DVec2,
}

/// Of every scene of a layout.
fn samples(layout: &Layout, scene_done: impl Fn() + Sync) -> Result<Vec<Sample>, Error> {
    let (height_m, away_m, seeds) = layout.clone();
    let mut config = Config::default();
    for sensor in &mut config.site.sensors {
        sensor.position_m = [away_m * sensor.position_m[0].signum(), 0.0, height_m];
        sensor.rotation_deg.pitch = (height_m / away_m).atan().to_degrees() + BELOW_MIDDLE_DEG;
    }
    let first = seeds.start;
    let of_scenes = seeds.into_par_iter().map(|seed| {
        let samples = watch(crowd_of(seed - first, seed), bodies((seed - first) / CROWDS)?, seed, &config);
        scene_done();
        samples
    });
    Ok(of_scenes.collect::<Result<Vec<Vec<Sample>>, Error>>()?.concat())
}

/// So many kinds of crowds.
const CROWDS: u64 = 6;

/// Who walks in the scene of that number.
fn crowd_of(scene: u64, seed: u64) -> Crowd {
    let drawn = |preset| circle_crossing(preset, PEOPLE, 12.5, seed);
    match scene % CROWDS {
        0 => drawn(Preset::Orca03),
        1 => speed_augmented(&drawn(Preset::Mixed), seed),
        2 => drawn(Preset::Orca06),
        3 => pairs(PEOPLE / 2, 0.6, 12.5, seed),
        4 => drawn(Preset::Mixed),
        _ => speed_augmented(&drawn(Preset::Orca03), seed),
    }
}

/// Every cluster of a scene that is a person's.
fn watch(crowd: Crowd, bodies: Bodies, seed: u64, config: &Config) -> Result<Vec<Sample>, Error> {
    let mut samples: Vec<Sample> = Vec::new();
    let mut health = Health::default();
    let mut background = Background::new(&config.detect, &config.site);
    let mut clusterer = Clusterer::new(&config.detect, &config.site);
    let mut measurer = Measurer::new(&config.detect, &config.site);
    let mut tracker = Tracker::new(&config.track, &config.site);
    empty_frames(&config.site, seed)?.iter().for_each(|frame| background.learn_empty(frame));
    let mut scene = Scene::new(crowd, &config.site, seed)?.with_bodies(&bodies);
    let walkers = scene.walkers().to_vec();
    let mut assembler = Assembler::new(&config.site)?;
    let (mut priors, mut points, mut clusters, mut detections, mut tracks) =
        (vec![], vec![], vec![], vec![], vec![]);
    while let Some(now) = scene.next_frame() {
        push(&mut assembler, &now.packets, &mut health);
        while let Some(frame) = assembler.pop() {
            tracker.priors(frame.time_ns, &mut priors);
            background.foreground(&frame, &priors, &mut health, &mut points);
            clusterer.clusters(&points, &priors, &mut clusters);
            measurer.detections(&points, &clusters, &priors, &mut detections);
            tracker.update(&Views::of(&frame), &detections, &mut tracks);
            for cluster in &clusters {
                let known = !samples.len().is_multiple_of(UNKNOWN_EVERY);
                let priors: &[Prior] = if known { &priors } else { &[] };
                let features = measurer.features(&points, cluster, priors);
                let late: i64 = cluster.iter().map(|&i| points[i as usize].time_ns - frame.time_ns).sum();
                let time_ns = frame.time_ns + late / cluster.len() as i64;
                let off_m = walkers
                    .iter()
                    .filter_map(|walker| Some(walker.state_at(time_ns)?.position_m - features.base_m))
                    .min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
                    .filter(|off_m| off_m.length() < OWN_M);
                samples.extend(off_m.map(|off_m| Sample { features, off_m }));
            }
        }
    }
    Ok(samples)
}

/// Adam on the negative log-likelihood of the true offsets.
fn fit(samples: &[Sample]) -> AxisModel {
    let mut rng = Pcg64::seed_from_u64(SEED);
    let n = samples.len() as f64;
    let even = |f: &dyn Fn(f64, usize) -> f64| -> Vec<f64> {
        (0..EVEN).map(|i| samples.iter().map(|s| f(s.features.even[i], i)).sum::<f64>() / n).collect()
    };
    let even_mean = even(&|x, _| x);
    let even_scale = even(&|x, i| (x - even_mean[i]).powi(2)).iter().map(|v| v.sqrt() + 1e-6).collect();
    let odd_square = |i: usize| samples.iter().map(|s| s.features.odd[i].powi(2)).sum::<f64>() / n;
    let odd_scale = (0..ODD).map(|i| odd_square(i).sqrt() + 1e-6).collect();
    let mut normal = |size: f64, n: usize| -> Vec<f64> {
        (0..n).map(|_| -> f64 { StandardNormal.sample(&mut rng) }).map(|x| size * x).collect()
    };
    let fan = |n: usize| (n as f64).powf(-0.5);
    let mut model = AxisModel {
        even_mean,
        even_scale,
        odd_scale,
        hidden: (0..HIDDEN).map(|_| normal(fan(EVEN + ODD), EVEN + ODD)).collect(),
        hidden_bias: vec![0.0; HIDDEN],
        output: (0..OUTPUTS).map(|_| normal(0.1 * fan(HIDDEN), HIDDEN)).collect(),
        output_bias: vec![0.0, 0.0, -1.0, -1.0],
    };
    let inputs: Vec<_> = samples.iter().map(|s| model.inputs(&s.features.even, &s.features.odd)).collect();
    let off =
        |s: &Sample| [s.off_m.dot(s.features.away) / UNIT_M, s.off_m.dot(s.features.away.perp()) / UNIT_M];
    let mut order: Vec<usize> = (0..samples.len()).collect();
    let mut adam = Adam::new(numbers(&model).count());
    for epoch in 0..EPOCHS {
        order.shuffle(&mut rng);
        let step = STEP * 0.5 * (1.0 + (std::f64::consts::PI * epoch as f64 / EPOCHS as f64).cos()) + 1e-5;
        for batch in order.chunks(BATCH) {
            let mut slope = model.clone();
            numbers_mut(&mut slope).for_each(|weight| *weight = 0.0);
            for &i in batch {
                let (mut x, mut y) = (inputs[i], off(&samples[i]));
                if rng.random_bool(0.5) {
                    x[EVEN..].iter_mut().for_each(|x| *x = -*x);
                    y[1] = -y[1];
                }
                add_slope(&model, &x, y, 1.0 / batch.len() as f64, &mut slope);
            }
            numbers_mut(&mut slope)
                .zip(numbers(&model))
                .for_each(|(slope, weight)| *slope += SHRINK * weight);
            adam.update(numbers_mut(&mut model), numbers(&slope), step);
        }
    }
    model
}

/// Adds the slope of one sample's negative log-likelihood.
fn add_slope(model: &AxisModel, x: &[f64], y: [f64; 2], share: f64, slope: &mut AxisModel) {
    let unit = |(w, b): (&Vec<f64>, &f64)| (w.iter().zip(x).map(|(w, x)| w * x).sum::<f64>() + b).tanh();
    let units: Vec<f64> = model.hidden.iter().zip(&model.hidden_bias).map(unit).collect();
    let out: [f64; OUTPUTS] = std::array::from_fn(|o| {
        model.output[o].iter().zip(&units).map(|(w, u)| w * u).sum::<f64>() + model.output_bias[o]
    });
    let mut pull = [0.0; OUTPUTS];
    for k in 0..2 {
        let weight = (-out[k + 2].clamp(-6.0, 4.0)).exp();
        let error = (out[k] - y[k]).clamp(-PULL_LIMIT, PULL_LIMIT);
        (pull[k], pull[k + 2]) = (share * error * weight, share * 0.5 * (1.0 - error * error * weight));
    }
    for (u, &unit) in units.iter().enumerate() {
        let back: f64 = (0..OUTPUTS).map(|o| pull[o] * model.output[o][u]).sum::<f64>() * (1.0 - unit * unit);
        slope.hidden_bias[u] += back;
        slope.hidden[u].iter_mut().zip(x).for_each(|(s, x)| *s += back * x);
        (0..OUTPUTS).for_each(|o| slope.output[o][u] += pull[o] * unit);
    }
    (0..OUTPUTS).for_each(|o| slope.output_bias[o] += pull[o]);
}

/// Every weight of a model in a fixed order.
fn numbers(model: &AxisModel) -> impl Iterator<Item = f64> {
    let hidden = model.hidden.iter().flatten().chain(&model.hidden_bias);
    hidden.chain(model.output.iter().flatten()).chain(&model.output_bias).copied()
}

/// The same, to be changed.
fn numbers_mut(model: &mut AxisModel) -> impl Iterator<Item = &mut f64> {
    let hidden = model.hidden.iter_mut().flatten().chain(&mut model.hidden_bias);
    hidden.chain(model.output.iter_mut().flatten()).chain(&mut model.output_bias)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Somebody whose axis lies off the base by what the first odd input says, to the left.
    fn sample(rng: &mut Pcg64) -> Sample {
        let away = DVec2::from_angle(rng.random_range(-3.0..3.0));
        let mut draw = || rng.random_range(-1.0..1.0);
        let (even, odd) = (std::array::from_fn(|_| draw()), std::array::from_fn(|_| draw()));
        let off_m = away.perp() * (0.04 * odd[0] + 0.005 * draw()) + away * 0.005 * draw();
        Sample { features: AxisFeatures { base_m: DVec2::new(1.0, 2.0), away, even, odd }, off_m }
    }

    fn samples() -> Vec<Sample> {
        let mut rng = Pcg64::seed_from_u64(2);
        (0..1500).map(|_| sample(&mut rng)).collect()
    }

    #[test]
    fn a_law_is_learned_and_the_file_says_what_the_model_says() {
        let (training, held_out) = (samples(), &samples()[..100]);
        let model = fit(&training);
        let read = AxisModel::parse(&toml(&model)).unwrap();
        for s in held_out {
            let (found_m, covariance_m2) = model.locate(&s.features);
            assert!(found_m.distance(s.features.base_m + s.off_m) < 0.02, "{found_m} for {s:?}");
            assert!(covariance_m2[0][0] < 0.02_f64.powi(2), "{covariance_m2:?}");
            assert!(read.locate(&s.features).0.abs_diff_eq(found_m, 1e-5));
        }
    }

    #[test]
    fn the_slope_is_that_of_finite_differences() {
        const MOVED: f64 = 1e-6;
        let (model, samples) = (fit(&samples()[..300]), samples());
        let x = model.inputs(&samples[0].features.even, &samples[0].features.odd);
        // Away from where an error pulls no harder.
        let y = [0.3, -0.2];
        let loss = |model: &AxisModel| -> f64 {
            let units: Vec<f64> = model
                .hidden
                .iter()
                .zip(&model.hidden_bias)
                .map(|(row, bias)| (row.iter().zip(&x).map(|(w, x)| w * x).sum::<f64>() + bias).tanh())
                .collect();
            let out = |o: usize| -> f64 {
                model.output[o].iter().zip(&units).map(|(w, u)| w * u).sum::<f64>() + model.output_bias[o]
            };
            (0..2).map(|k| 0.5 * ((out(k) - y[k]).powi(2) * (-out(k + 2)).exp() + out(k + 2))).sum()
        };
        let mut slope = model.clone();
        numbers_mut(&mut slope).for_each(|weight| *weight = 0.0);
        add_slope(&model, &x, y, 1.0, &mut slope);
        let largest = numbers(&slope).fold(0.0_f64, |largest, slope| largest.max(slope.abs()));
        assert!(largest > 0.1, "a slope that tells something");
        for (i, found) in numbers(&slope).enumerate() {
            let moved = |by: f64| {
                let mut model = model.clone();
                *numbers_mut(&mut model).nth(i).unwrap() += by;
                loss(&model)
            };
            let expected = (moved(MOVED) - moved(-MOVED)) / (2.0 * MOVED);
            assert!((found - expected).abs() < 1e-6 * largest, "weight {i}: {found}, expected {expected}");
        }
    }
}
