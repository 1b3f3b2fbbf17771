//! The residual network from options to weights and card: scenes, samples, fit, scores on scenes held out.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use umbracast::forecast::inputs::Seen;
use umbracast::forecast::{Gaussian2, Residual};
use umbracast::geometry::DVec2;
use umbracast::{Config, Error, Mode, STEPS};
use umbracast_sim::crowd::{Crowd, Preset};

use crate::SCENE_SEEDS;
use crate::residual::{FitOptions, fit};
use crate::samples::{Sample, SampleScene, collect, drawn_scenes, recorded_scene};

/// Taken in turn, as they are or speed-augmented.
const DRAWN: [(Preset, bool); 6] = [
    (Preset::Mixed, false),
    (Preset::Orca03, false),
    (Preset::Mixed, true),
    (Preset::Natural, false),
    (Preset::Orca06, false),
    (Preset::Natural, true),
];
/// Scenes the card scores on: seeds for tuning, which nothing is fitted on.
const HELD_OUT: [(Preset, Range<u64>); 2] =
    [(Preset::Orca03, 130_000..130_004), (Preset::Mixed, 130_004..130_008)];
const PEOPLE: usize = 10;

/// Everything the weights depend on, but for the pipeline before them.
#[derive(Debug, Clone)]
pub struct ResidualOptions {
    /// Seeds of the drawn scenes, within [`SCENE_SEEDS`].
    pub scenes: Range<u64>,
    /// Recorded people, each file by its name: walked as they did and once speed-augmented.
    pub recorded: Vec<(String, Crowd)>,
    /// How long the network is fitted.
    pub fit: FitOptions,
    /// Which state of the source this is, for the card.
    pub commit: String,
}

/// Fits the residual network on tracks of the default mode; returns the weights file and its card. `scene_done` is
/// called with scenes done and scenes in all, from any thread; `epoch_done` with an epoch's loss.
///
/// # Errors
/// Options that cannot work.
pub fn train_residual(
    options: &ResidualOptions,
    scene_done: impl Fn(usize, usize) + Sync,
    mut epoch_done: impl FnMut(f64),
) -> Result<(Vec<u8>, String), Error> {
    let (scenes, seeds) = (&options.scenes, SCENE_SEEDS);
    if scenes.is_empty() || scenes.start < seeds.start || scenes.end > seeds.end {
        return Err(Error::new(format!("training: expected scene seeds of 1 to 99,999, found {scenes:?}")));
    }
    let mut trained_on = drawn_scenes(&DRAWN, PEOPLE, scenes.clone());
    for (seed, (_, crowd)) in (scenes.end..).step_by(2).zip(&options.recorded) {
        trained_on.push(recorded_scene(crowd.clone(), seed, false));
        trained_on.push(recorded_scene(crowd.clone(), seed + 1, true));
    }
    let held_out: Vec<Vec<SampleScene>> =
        HELD_OUT.map(|(preset, seeds)| drawn_scenes(&[(preset, false)], PEOPLE, seeds)).into();
    let (done, all) = (AtomicUsize::new(0), trained_on.len() + held_out.iter().map(Vec::len).sum::<usize>());
    let config = Config::for_mode(Mode::Default);
    let samples_of = |scenes: &[SampleScene]| -> Result<Vec<Sample>, Error> {
        let told = || scene_done(done.fetch_add(1, Ordering::Relaxed) + 1, all);
        Ok(collect(scenes, &config, told)?.concat())
    };
    let samples = samples_of(&trained_on)?;
    let mut losses = Vec::new();
    let weights = fit(&samples, options.fit, |loss| {
        losses.push(loss);
        epoch_done(loss);
    })?;
    let network = Residual::from_safetensors(&weights)?;
    let mut scores = Vec::new();
    for ((preset, _), scenes) in HELD_OUT.iter().zip(&held_out) {
        scores.push((preset.name(), Score::of(&network, &samples_of(scenes)?)));
    }
    Ok((weights, card(options, samples.len(), &losses, &scores)))
}

/// Means over samples, by step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Score {
    /// Distance from the network's mean to where the person went, metres.
    pub displacement_m: [f64; STEPS],
    /// The same at constant velocity.
    pub carried_on_m: [f64; STEPS],
    /// Shares within the ellipses that should hold 50 and 90 %.
    pub within: [[f64; STEPS]; 2],
}

impl Score {
    /// As the runtime forecasts.
    pub fn of(network: &Residual, samples: &[Sample]) -> Self {
        let mut score = Self::default();
        let share = 1.0 / samples.len() as f64;
        for sample in samples {
            // In the track's own axes.
            let seen = Seen { ahead: DVec2::X, ..sample.seen.clone() };
            let (steps, _) = network.steps(&seen, DVec2::ZERO, DVec2::ZERO);
            for (i, step) in steps.iter().enumerate() {
                let went_m = DVec2::from_array(sample.departure_m[i + 1].map(f64::from));
                score.displacement_m[i] += went_m.distance(step.mean_m) * share;
                score.carried_on_m[i] += went_m.length() * share;
                // Chi-square with two degrees of freedom: 50 % lie below 1.386, 90 % below 4.605.
                let squared = squared_mahalanobis(step, went_m);
                score.within[0][i] += if squared < 1.386 { share } else { 0.0 };
                score.within[1][i] += if squared < 4.605 { share } else { 0.0 };
            }
        }
        score
    }
}

fn squared_mahalanobis(step: &Gaussian2, at_m: DVec2) -> f64 {
    let d = at_m - step.mean_m;
    let determinant = step.xx_m2 * step.yy_m2 - step.xy_m2 * step.xy_m2;
    (step.yy_m2 * d.x * d.x - 2.0 * step.xy_m2 * d.x * d.y + step.xx_m2 * d.y * d.y) / determinant
}

fn card(options: &ResidualOptions, samples: usize, losses: &[f64], scores: &[(&str, Score)]) -> String {
    let row = |name: &str, what: &str, values: [f64; STEPS], scale: f64, digits: usize| {
        let values: Vec<String> = values.iter().map(|v| format!("{:.digits$}", v * scale)).collect();
        format!("| {name}: {what} | {} |\n", values.join(" | "))
    };
    let tables: String = scores
        .iter()
        .map(|(name, score)| {
            row(name, "displacement, mm", score.displacement_m, 1000.0, 0)
                + &row(name, "constant velocity, mm", score.carried_on_m, 1000.0, 0)
                + &row(name, "within the 50 % ellipse", score.within[0], 1.0, 2)
                + &row(name, "within the 90 % ellipse", score.within[1], 1.0, 2)
        })
        .collect();
    let recorded: Vec<&str> = options.recorded.iter().map(|(name, _)| name.as_str()).collect();
    let losses: Vec<String> = losses.iter().map(|loss| format!("{loss:.3}")).collect();
    format!(
        "# Residual of the default forecast\n\n\
         What `src/forecast/residual.rs` adds to the filtered state carried on: two hidden layers of {units} units \
         that read a track's last second and its three most urgent neighbours (`src/forecast/inputs.rs`, {inputs} \
         numbers) and give the way's departure from a constant velocity and the spread of its errors.\n\n\
         - Tensors: `first`, `second`, `head`, PyTorch's layout, f32.\n\
         - Data: tracks that the default mode made of simulated returns, with the true ways of their people. Drawn \
         crowds of {people} people on the default circle, scene seeds {first} to {last}, in turn: {drawn}. Speed-augmented: the \
         same ways on a clock that stands, runs up to 1.9 times as fast and slows down, and they wander off their \
         line (`speed_augmentation.rs`). Every third scene has its sensors up to 3 m lower or 1 m higher. The crowds are this \
         project's own. Six scenes have bodies of our own, the next six those of the third-party family `a`; then the same with \
         telephones, bags, rucksacks and hands in pockets among them.\n\
         - Recorded people replayed with the same sensors, as they walked and speed-augmented: {recorded}. PedPy's \
         files (traj_UNI_CORR_500_01) and Madras' (Topview) are under the MIT licences of their repositories \
         (PedestrianDynamics/PedPy, PedestrianDynamics/madras-data-app). \
         The circle-antipode and LogicTronix people are never learned from.\n\
         - Training: {samples} samples, seed {seed}, {epochs} epochs, each sample mirrored or not, negative \
         log-likelihood of the steps 0 to 9 and a little of the mean distance, Adam; all in `residual.rs`.\n\
         - Commit: {commit}.\n\n\
         ## Scores on scenes held out (seeds {held_out:?})\n\n\
         | step | {steps} |\n|---|{rule}|\n{tables}\n\
         ## Loss by epoch\n\n{losses}\n",
        units = umbracast::forecast::residual::UNITS,
        inputs = umbracast::forecast::inputs::INPUTS,
        people = PEOPLE,
        first = options.scenes.start,
        last = options.scenes.end - 1,
        drawn = DRAWN
            .map(|(preset, augmented)| format!(
                "{}{}",
                preset.name(),
                if augmented { " speed-augmented" } else { "" }
            ))
            .join(", "),
        recorded = if recorded.is_empty() { "none".to_owned() } else { recorded.join(", ") },
        seed = options.fit.seed,
        epochs = options.fit.epochs,
        commit = if options.commit.is_empty() { "unknown" } else { &options.commit },
        held_out = HELD_OUT.map(|(_, seeds)| seeds),
        steps = (1..=STEPS).map(|i| i.to_string()).collect::<Vec<_>>().join(" | "),
        rule = ["---"; STEPS].join("|"),
        losses = losses.join(" "),
    )
}
