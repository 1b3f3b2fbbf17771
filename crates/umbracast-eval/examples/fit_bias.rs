//! Fits the model of `umbracast::detect::axis` on simulated returns and writes it with its card.
//!
//! `cargo run --release -p umbracast-eval --example fit_bias -- [models/body_axis]`
//!
//! Training scenes have the seeds 50,000 and on, the scenes that the errors are printed for 130,000 and on. Four layouts
//! of two sensors; people on ORCA's ways, mixed crowds, pairs, some of them speed-augmented. Takes some minutes.

use std::path::Path;
use std::process::Command;

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use umbracast::config::Config;
use umbracast::detect::axis::{AxisModel, OUTPUTS, UNIT_M};
use umbracast::detect::bias::{EVEN, ODD, View};
use umbracast::detect::{Background, Clusterer, Measurer};
use umbracast::geometry::DVec2;
use umbracast::lidar::Assembler;
use umbracast::track::Tracker;
use umbracast::{Error, Health};
use umbracast_eval::chain::{empty_frames, push};
use umbracast_sim::crowd::{Crowd, Preset, circle_crossing, pairs, speed_augmented};
use umbracast_sim::scene::Scene;

/// Height of the sensors, their distance from the middle, how many scenes, the first seed.
const LAYOUTS: [(f64, f64, u64, u64); 4] =
    [(9.0, 16.0, 36, 50_000), (6.0, 12.5, 24, 51_000), (4.0, 13.0, 12, 52_000), (7.5, 14.0, 12, 53_000)];
/// Scenes that are not trained on.
const TEST: (f64, f64, u64, u64) = (9.0, 16.0, 6, 130_000);
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

fn main() -> Result<(), Error> {
    let path = std::env::args().nth(1).unwrap_or("models/body_axis".to_owned());
    let of_layouts: Result<Vec<Vec<Sample>>, Error> = LAYOUTS.into_iter().map(samples).collect();
    let (training, test) = (of_layouts?.concat(), samples(TEST)?);
    let model = fit(&training);
    let error = |s: &Sample| model.locate(&s.view).0 - s.view.base_m - s.off_m;
    let rmse = |of: &dyn Fn(&Sample) -> DVec2, samples: &[Sample]| {
        (samples.iter().map(|s| of(s).length_squared()).sum::<f64>() / samples.len() as f64).sqrt()
    };
    let squared = |s: &Sample| {
        let ([[xx, xy], [_, yy]], e) = (model.locate(&s.view).1, error(s));
        (yy * e.x * e.x - 2.0 * xy * e.x * e.y + xx * e.y * e.y) / (xx * yy - xy * xy)
    };
    let consistency = test.iter().map(squared).sum::<f64>() / test.len() as f64;
    let commit = Command::new("git").args(["describe", "--always", "--dirty"]).output();
    let commit = commit.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned()).unwrap_or_default();
    let layouts: String = LAYOUTS
        .iter()
        .map(|(height_m, away_m, scenes, seed)| {
            format!("- {scenes} scenes from seed {seed}, two HDL-32E {height_m} m high, {away_m} m from the middle\n")
        })
        .collect();
    let card = format!(
        "# Model of the body axis\n\n\
         From what the sensors saw of one body in one frame to where its axis stands, with the error's covariance: \
         {EVEN} + {ODD} inputs, {HIDDEN} hidden units, {OUTPUTS} outputs (`src/detect/axis.rs`).\n\n\
         Written by `cargo run --release -p umbracast-eval --example fit_bias`, commit {commit}.\n\n\
         ## Data\n\nSimulated returns of {PEOPLE} people a scene, in turn: orca-03, mixed speed-augmented, orca-06, pairs 0.6 m apart, \
         mixed, orca-03 speed-augmented.\n\n\
         {layouts}\n{} clusters; {EPOCHS} epochs, Adam, negative log-likelihood, mirrored at random, seed {SEED}.\n\n\
         ## Error of one frame\n\n\
         | | training | {} scenes of their own from seed {} |\n|---|---|---|\n\
         | each point moved {} m away from its sensor, m | {:.4} | {:.4} |\n| this model, m | {:.4} | {:.4} |\n\
         | squared error over its variance (2 if honest) | | {consistency:.2} |\n",
        training.len(),
        TEST.2,
        TEST.3,
        Config::default().detect.measure.shift_m,
        rmse(&|s| s.off_m, &training),
        rmse(&|s| s.off_m, &test),
        rmse(&error, &training),
        rmse(&error, &test),
    );
    print!("{card}");
    write(&Path::new(&path).with_extension("md"), &card)?;
    write(&Path::new(&path).with_extension("toml"), &toml(&model))
}

fn write(path: &Path, text: &str) -> Result<(), Error> {
    std::fs::write(path, text).map_err(|e| Error::new(e.to_string()).within(path.display()))
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
        "# The model of the body axis: see body_axis.md. Written by the example fit_bias.\n\
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

#[derive(Clone)]
struct Sample {
    view: View,
    /// From the base to the true axis.
    off_m: DVec2,
}

/// Of every scene of a layout.
fn samples((height_m, away_m, scenes, first_seed): (f64, f64, u64, u64)) -> Result<Vec<Sample>, Error> {
    let mut config = Config::default();
    for sensor in &mut config.site.sensors {
        sensor.position_m = [away_m * sensor.position_m[0].signum(), 0.0, height_m];
        sensor.rotation_deg.pitch = (height_m / away_m).atan().to_degrees() + BELOW_MIDDLE_DEG;
    }
    let of_scenes = (0..scenes).into_par_iter().map(|scene| {
        let seed = first_seed + scene;
        watch(crowd_of(scene, seed), seed, &config)
    });
    Ok(of_scenes.collect::<Result<Vec<Vec<Sample>>, Error>>()?.concat())
}

/// Who walks in the scene of that number.
fn crowd_of(scene: u64, seed: u64) -> Crowd {
    let drawn = |preset| circle_crossing(preset, PEOPLE, 12.5, seed);
    match scene % 6 {
        0 => drawn(Preset::Orca03),
        1 => speed_augmented(&drawn(Preset::Mixed), seed),
        2 => drawn(Preset::Orca06),
        3 => pairs(PEOPLE / 2, 0.6, 12.5, seed),
        4 => drawn(Preset::Mixed),
        _ => speed_augmented(&drawn(Preset::Orca03), seed),
    }
}

/// Every cluster of a scene that is a person's.
fn watch(crowd: Crowd, seed: u64, config: &Config) -> Result<Vec<Sample>, Error> {
    let mut samples: Vec<Sample> = Vec::new();
    let mut health = Health::default();
    let mut background = Background::new(&config.detect, &config.site)?;
    let mut clusterer = Clusterer::new(&config.detect, &config.site);
    let mut measurer = Measurer::new(&config.detect, &config.site);
    let mut tracker = Tracker::new(&config.track, &config.site);
    empty_frames(&config.site, seed)?.iter().for_each(|frame| background.learn_empty(frame));
    let mut scene = Scene::new(crowd, &config.site, seed)?;
    let walkers = scene.walkers().to_vec();
    let mut assembler = Assembler::new(&config.site)?;
    let (mut points, mut clusters, mut detections, mut tracks) = (vec![], vec![], vec![], vec![]);
    while let Some(now) = scene.next_frame() {
        push(&mut assembler, &now.packets, &mut health);
        while let Some(frame) = assembler.pop() {
            let priors = tracker.priors(frame.time_ns);
            background.foreground(&frame, &priors, &mut health, &mut points);
            clusterer.clusters(&points, &priors, &mut clusters);
            measurer.detections(&points, &clusters, &priors, &mut detections);
            tracker.update(&frame, &detections, &mut tracks);
            for cluster in &clusters {
                let known = !samples.len().is_multiple_of(UNKNOWN_EVERY);
                let view = measurer.view(&points, cluster, if known { &priors } else { &[] });
                let late: i64 = cluster.iter().map(|&i| points[i as usize].time_ns - frame.time_ns).sum();
                let time_ns = frame.time_ns + late / cluster.len() as i64;
                let off_m = walkers
                    .iter()
                    .filter_map(|walker| Some(walker.state_at(time_ns)?.position_m - view.base_m))
                    .min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
                    .filter(|off_m| off_m.length() < OWN_M);
                samples.extend(off_m.map(|off_m| Sample { view, off_m }));
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
        (0..EVEN).map(|i| samples.iter().map(|s| f(s.view.even[i], i)).sum::<f64>() / n).collect()
    };
    let even_mean = even(&|x, _| x);
    let even_scale = even(&|x, i| (x - even_mean[i]).powi(2)).iter().map(|v| v.sqrt() + 1e-6).collect();
    let odd_square = |i: usize| samples.iter().map(|s| s.view.odd[i].powi(2)).sum::<f64>() / n;
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
    let inputs: Vec<_> = samples.iter().map(|s| model.inputs(&s.view.even, &s.view.odd)).collect();
    let off = |s: &Sample| [s.off_m.dot(s.view.away) / UNIT_M, s.off_m.dot(s.view.away.perp()) / UNIT_M];
    let mut order: Vec<usize> = (0..samples.len()).collect();
    let mut adam = Adam::new(count(&mut model));
    for epoch in 0..EPOCHS {
        order.shuffle(&mut rng);
        let step = STEP * 0.5 * (1.0 + (std::f64::consts::PI * epoch as f64 / EPOCHS as f64).cos()) + 1e-5;
        for batch in order.chunks(BATCH) {
            let mut slope = model.clone();
            for_each(&mut slope, |w| *w = 0.0);
            for &i in batch {
                let (mut x, mut y) = (inputs[i], off(&samples[i]));
                if rng.random_bool(0.5) {
                    x[EVEN..].iter_mut().for_each(|x| *x = -*x);
                    y[1] = -y[1];
                }
                add_slope(&model, &x, y, 1.0 / batch.len() as f64, &mut slope);
            }
            adam.step(&mut model, &mut slope, step);
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
fn for_each(model: &mut AxisModel, mut f: impl FnMut(&mut f64)) {
    model.hidden.iter_mut().flatten().for_each(&mut f);
    model.hidden_bias.iter_mut().for_each(&mut f);
    model.output.iter_mut().flatten().for_each(&mut f);
    model.output_bias.iter_mut().for_each(&mut f);
}

fn count(model: &mut AxisModel) -> usize {
    let mut n = 0;
    for_each(model, |_| n += 1);
    n
}

/// Kingma and Ba 2015, with its usual decays.
struct Adam {
    mean: Vec<f64>,
    square: Vec<f64>,
    steps: i32,
}

impl Adam {
    fn new(n: usize) -> Self {
        Self { mean: vec![0.0; n], square: vec![0.0; n], steps: 0 }
    }

    fn step(&mut self, model: &mut AxisModel, slope: &mut AxisModel, step: f64) {
        self.steps += 1;
        let mut slopes = Vec::with_capacity(self.mean.len());
        for_each(slope, |s| slopes.push(*s));
        let (early, early_square) = (1.0 - 0.9_f64.powi(self.steps), 1.0 - 0.999_f64.powi(self.steps));
        let mut i = 0;
        for_each(model, |w| {
            let s = slopes[i] + SHRINK * *w;
            self.mean[i] += 0.1 * (s - self.mean[i]);
            self.square[i] += 0.001 * (s * s - self.square[i]);
            *w -= step * (self.mean[i] / early) / ((self.square[i] / early_square).sqrt() + 1e-8);
            i += 1;
        });
    }
}
