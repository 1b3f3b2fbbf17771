//! From options to weights: epochs of windows drawn at random, Adam, a checkpoint after each epoch.

use std::f64::consts::PI;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use burn::tensor::Device;
use umbracast::Error;
use umbracast::STEPS;
use umbracast_sim::crowd::Preset;
use umbracast_train::SCENE_SEEDS;
use umbracast_train::score::{Scores, score};
use umbracast_train::weights::state;
use umbracast_train::windows::{Noise, Ways, Window};

use crate::adam::Moments;
use crate::card;
#[cfg(any(feature = "cuda", feature = "wgpu"))]
use crate::gradient::recorded;
use crate::gradient::{frames, written_out};
use crate::network::{Network, Size, loss};
use crate::weights::{from_safetensors, to_safetensors};

/// Share of the scenes that is trained on; the others are validated on (paper, section V-A).
const TRAINED_SHARE: f64 = 0.6;
/// Windows behind each validation loss.
const VALIDATED: usize = 2048;
/// Windows behind the card's scores.
const SCORED: usize = 8192;

/// Everything a training depends on: equal options give equal weights (on one kind of processor).
#[derive(Debug, Clone, PartialEq)]
pub struct TrainOptions {
    /// Of the first weights and of the windows drawn.
    pub seed: u64,
    /// Of the scenes, one each, within [`SCENE_SEEDS`]; the first 60 % are trained on.
    pub scenes: Range<u64>,
    /// Taken in turn.
    pub presets: Vec<Preset>,
    /// In each scene.
    pub people: usize,
    /// Of the circle they cross.
    pub radius_m: f64,
    /// What a tracker adds to the observed positions.
    pub noise: Noise,
    /// Widths of the network.
    pub size: Size,
    /// How often [`windows_per_epoch`](Self::windows_per_epoch) windows are drawn.
    pub epochs: usize,
    /// A multiple of [`batch`](Self::batch).
    pub windows_per_epoch: usize,
    /// Windows an update.
    pub batch: usize,
    /// Adam's step at the start; it falls to zero along half a cosine.
    pub learning_rate: f64,
    /// Longest gradient an update follows.
    pub clip: f64,
    /// Where the work runs.
    pub processor: Processor,
    /// Written after each epoch, and gone on from when it is there.
    pub checkpoint: Option<PathBuf>,
    /// Which state of the source this is, for the card.
    pub commit: String,
}

impl TrainOptions {
    /// The paper's network and epochs on the paper's scenes: exact positions, 60 to 40. The paper does not say
    /// which of the generator's two parameter sets it used: both, in turn. What it does not give (batch, rate,
    /// clipping) is ours.
    pub fn paper() -> Self {
        Self {
            seed: 1,
            scenes: 1..501,
            presets: vec![Preset::Orca03, Preset::Orca06],
            people: 10,
            radius_m: 12.5,
            noise: Noise { white_m: 0.0, lasting_m: 0.0 },
            size: Size { embedded: 64, units: 512 },
            epochs: 30,
            windows_per_epoch: 16_384,
            batch: 128,
            learning_rate: 1e-3,
            clip: 1.0,
            processor: Processor::Cpu,
            checkpoint: None,
            commit: String::new(),
        }
    }

    fn check(&self) -> Result<(), Error> {
        let wrong = |what: &str, found: &dyn std::fmt::Debug| {
            Err(Error::new(format!("training: expected {what}, found {found:?}")))
        };
        let (scenes, seeds) = (&self.scenes, SCENE_SEEDS);
        if scenes.start < seeds.start || scenes.end > seeds.end {
            return wrong("scene seeds of 1 to 99,999", scenes);
        }
        if self.presets.is_empty() || self.people == 0 {
            return wrong("a preset and people", &(&self.presets, self.people));
        }
        if self.batch == 0
            || self.windows_per_epoch == 0
            || !self.windows_per_epoch.is_multiple_of(self.batch)
        {
            return wrong("an epoch of whole batches", &(self.windows_per_epoch, self.batch));
        }
        if self.size.units == 0 || !self.size.units.is_multiple_of(16) || self.size.embedded == 0 {
            return wrong("an embedding, and hidden units in a multiple of 16", &self.size);
        }
        Ok(())
    }
}

/// Where the tensors live.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Processor {
    /// All threads of the pool that training is called from.
    Cpu,
    /// The first of NVIDIA's.
    #[cfg(feature = "cuda")]
    Cuda,
    /// Whichever graphics processor the system puts first.
    #[cfg(feature = "wgpu")]
    Wgpu,
}

impl Processor {
    fn device(self) -> Device {
        match self {
            Self::Cpu => Device::flex(),
            #[cfg(feature = "cuda")]
            Self::Cuda => Device::cuda(0),
            #[cfg(feature = "wgpu")]
            Self::Wgpu => Device::wgpu(Default::default()),
        }
    }

    fn gradient(self, network: &Network, batch: &[Window], device: &Device) -> (f64, Network) {
        match self {
            Self::Cpu => written_out(network, batch, device),
            #[cfg(any(feature = "cuda", feature = "wgpu"))]
            _ => recorded(network, batch, device),
        }
    }
}

/// How far a training is, after each update.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Epochs done before this one.
    pub epoch: usize,
    /// Of so many.
    pub epochs: usize,
    /// Updates done in this epoch.
    pub batch: usize,
    /// Of so many.
    pub batches: usize,
    /// Mean negative log-likelihood of the epoch's windows so far.
    pub training_loss: f64,
    /// The same of windows never trained on, when the epoch has ended.
    pub validation_loss: Option<f64>,
}

/// What a training gives.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainedModel {
    /// A safetensors file, as `umbracast::forecast::Weights` reads it.
    pub safetensors: Vec<u8>,
    /// What stands beside it, as Markdown: where it comes from and how good it is.
    pub card: String,
    /// On validation windows of each preset, positions exact.
    pub scores: Vec<(Preset, Scores)>,
}

/// Fits the paper's network.
///
/// # Errors
/// Options that cannot work, or a checkpoint that cannot be read, written, or belongs to other options.
pub fn train(options: &TrainOptions, progress: &mut dyn FnMut(&Progress)) -> Result<TrainedModel, Error> {
    options.check()?;
    let device = options.processor.device();
    let [trained_on, validated_on] = scenes(options);
    let trained = ways(&trained_on, options)?;
    let validation = ways(&validated_on, options)?.draw(VALIDATED, options.noise, options.seed);
    let mut run = resumed(options, &device)?;
    for epoch in run.losses.len()..options.epochs {
        // Windows depend on the epoch alone, so that a resumed training sees the same ones.
        let windows = trained.draw(options.windows_per_epoch, options.noise, options.seed + 1 + epoch as u64);
        let mut total = 0.0;
        let batches = options.windows_per_epoch / options.batch;
        let mut report = Progress {
            epoch,
            epochs: options.epochs,
            batch: 0,
            batches,
            training_loss: 0.0,
            validation_loss: None,
        };
        for batch in windows.chunks(options.batch) {
            let (loss, gradient) = options.processor.gradient(&run.network, batch, &device);
            total += loss;
            let done = run.moments.updates() as f64 / (options.epochs * batches) as f64;
            let rate = options.learning_rate * 0.5 * (1.0 + (PI * done).cos());
            run.network = run.moments.update(run.network, gradient, rate, options.clip);
            report.batch += 1;
            report.training_loss = total / report.batch as f64;
            if report.batch == batches {
                report.validation_loss = Some(mean_loss(&run.network, &validation, options.batch, &device));
                run.losses.push([report.training_loss, report.validation_loss.unwrap_or(f64::NAN)]);
            }
            progress(&report);
        }
        if let Some(path) = &options.checkpoint {
            keep(path, &run, options)?;
        }
    }
    let safetensors = to_safetensors(&[("", &run.network)], None)?;
    let weights = umbracast::forecast::Weights::from_safetensors(&safetensors)?;
    let exact = Noise { white_m: 0.0, lasting_m: 0.0 };
    let mut scores = Vec::new();
    for &preset in &options.presets {
        let scenes: Vec<_> = validated_on.iter().copied().filter(|scene| scene.1 == preset).collect();
        let windows = ways(&scenes, options)?.draw(SCORED, exact, options.seed);
        scores.push((preset, score(&weights, &windows)));
    }
    let card = card::write(options, &run.losses, &scores);
    Ok(TrainedModel { safetensors, card, scores })
}

/// The scenes trained on and those validated on, each with its preset.
fn scenes(options: &TrainOptions) -> [Vec<(u64, Preset)>; 2] {
    let scenes = &options.scenes;
    let split = scenes.start + ((scenes.end - scenes.start) as f64 * TRAINED_SHARE).round() as u64;
    let preset = |seed: u64| options.presets[seed as usize % options.presets.len()];
    [scenes.start..split, split..scenes.end].map(|seeds| seeds.map(|seed| (seed, preset(seed))).collect())
}

fn ways(scenes: &[(u64, Preset)], options: &TrainOptions) -> Result<Ways, Error> {
    let ways = Ways::simulate(scenes, options.people, options.radius_m);
    if ways.windows() == 0 {
        return Err(Error::new("training: expected somebody who walks for 19 frames, found nobody"));
    }
    Ok(ways)
}

fn mean_loss(network: &Network, windows: &[Window], batch: usize, device: &Device) -> f64 {
    let total: f64 = windows
        .chunks(batch)
        .map(|batch| {
            let (observed_m, coming_m) = frames(batch, device);
            let loss = loss(network.roll_out(&observed_m, STEPS), coming_m);
            f64::from(loss.into_scalar::<f32>()) * batch.len() as f64
        })
        .sum();
    total / windows.len() as f64
}

/// What a training carries from epoch to epoch.
struct Run {
    network: Network,
    moments: Moments,
    /// Training and validation loss of each epoch done.
    losses: Vec<[f64; 2]>,
}

fn resumed(options: &TrainOptions, device: &Device) -> Result<Run, Error> {
    let path = options.checkpoint.as_deref().filter(|path| path.exists());
    let Some(path) = path else {
        let network = Network::fresh(options.size, options.seed, device);
        return Ok(Run { network, moments: Moments::default(), losses: Vec::new() });
    };
    let bytes = fs::read(path).map_err(|e| at(path, &e))?;
    let text = state(&bytes).map_err(|e| e.within(path.display()))?.unwrap_or_default();
    let mut lines = text.lines();
    let (found, expected) = (lines.next().unwrap_or_default(), fingerprint(options));
    if found != expected {
        return Err(at(path, &format!("expected a checkpoint of {expected}, found {found}")));
    }
    let updates = lines.next().and_then(|line| line.parse().ok());
    let losses = lines.map(|line| {
        let (training, validation) = line.split_once(' ')?;
        Some([training.parse().ok()?, validation.parse().ok()?])
    });
    let (Some(updates), Some(losses)) = (updates, losses.collect()) else {
        return Err(at(path, &"expected the updates and losses so far, found something else"));
    };
    let read = |prefix| from_safetensors(&bytes, prefix, options.size, device);
    let moments = Moments::after(updates, read("first.")?, read("second.")?);
    Ok(Run { network: read("")?, moments, losses })
}

/// Writes beside the file first, so that a stop at any time leaves a whole one.
fn keep(path: &Path, run: &Run, options: &TrainOptions) -> Result<(), Error> {
    let mut text = format!("{}\n{}", fingerprint(options), run.moments.updates());
    for [training, validation] in &run.losses {
        text += &format!("\n{training} {validation}");
    }
    let [first, second] = run.moments.networks(&run.network);
    let networks = [("", &run.network), ("first.", &first), ("second.", &second)];
    let beside = path.with_extension("part");
    fs::write(&beside, to_safetensors(&networks, Some(text))?).map_err(|e| at(&beside, &e))?;
    fs::rename(&beside, path).map_err(|e| at(path, &e))
}

/// All options that change the weights, on one line.
fn fingerprint(options: &TrainOptions) -> String {
    let same = TrainOptions { checkpoint: None, commit: String::new(), ..options.clone() };
    format!("{same:?}")
}

fn at(path: &Path, what: &dyn std::fmt::Display) -> Error {
    Error::new(format!("{}: {what}", path.display()))
}
