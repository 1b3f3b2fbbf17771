//! `umbracast-train-lstm`: fits the paper's LSTM on generated trajectories; writes weights, card and checkpoints.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use umbracast::Error;
use umbracast_sim::crowd::Preset;
use umbracast_train::Noise;
use umbracast_train_lstm::{Processor, Progress, TrainOptions, train};

/// What a tracker adds to positions: up to so much that is new in each frame, and so much that lasts.
const TRACKER_NOISE: Noise = Noise { white_m: 0.12, lasting_m: 0.05 };

/// Fits the paper's LSTM on generated trajectories. The defaults are the paper's experiment.
#[derive(Debug, Parser)]
#[command(name = "umbracast-train-lstm", version)]
struct Args {
    /// Passes over the data.
    #[arg(long, default_value_t = 30, value_name = "N")]
    epochs: usize,
    /// Windows drawn in an epoch.
    #[arg(long, default_value_t = 16_384, value_name = "N")]
    windows: usize,
    /// Windows in a batch; a whole number of batches makes an epoch.
    #[arg(long, default_value_t = 128, value_name = "N")]
    batch: usize,
    /// Scenes to train and validate on.
    #[arg(long, default_value_t = 500, value_name = "N")]
    scenes: u64,
    /// Seed of the first scene; 1 to 99999.
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    first_scene: u64,
    /// The crowds, taken in turn: orca-03, orca-06, mixed, pairs.
    #[arg(long, value_delimiter = ',', default_value = "orca-03,orca-06")]
    preset: Vec<Preset>,
    /// Seed of the first weights and of the windows.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The source's commit, for the card.
    #[arg(long)]
    commit: Option<String>,
    /// Noise as a tracker makes it, in place of clean positions.
    #[arg(long)]
    noise: bool,
    /// Threads to use; 0 means one a core. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N")]
    threads: usize,
    /// Show no progress.
    #[arg(long)]
    quiet: bool,
    /// Where weights, card and checkpoints go; a checkpoint found there is continued.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(card) => {
            println!("{card}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("umbracast-train-lstm: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Writes weights and card; returns the card.
fn run(args: &Args) -> Result<String, Error> {
    let mut options = TrainOptions {
        seed: args.seed,
        scenes: args.first_scene..args.first_scene.saturating_add(args.scenes),
        presets: args.preset.clone(),
        epochs: args.epochs,
        windows_per_epoch: args.windows,
        batch: args.batch,
        processor: processor(),
        checkpoint: Some(args.out.join("paper_lstm.checkpoint")),
        commit: args.commit.clone().unwrap_or_default(),
        ..TrainOptions::paper()
    };
    if args.noise {
        options.noise = TRACKER_NOISE;
    }
    fs::create_dir_all(&args.out).map_err(|e| Error::new(e.to_string()).within(args.out.display()))?;
    let bar = bar(args);
    let mut advance = |now: &Progress| {
        bar.set_position((now.epoch * now.batches + now.batch) as u64);
        bar.set_message(format!("loss {:.3}", now.training_loss));
        if let Some(loss) = now.validation_loss {
            bar.println(format!("epoch {} of {}: validation {loss:.4}", now.epoch + 1, now.epochs));
        }
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads)
        .build()
        .map_err(|e| Error::new(format!("--threads {}: {e}", args.threads)))?;
    let model = pool.install(|| train(&options, &mut advance))?;
    bar.finish_and_clear();
    write(&args.out.join("paper_lstm.safetensors"), &model.safetensors)?;
    write(&args.out.join("paper_lstm.md"), model.card.as_bytes())?;
    Ok(model.card)
}

/// The one that the features say.
fn processor() -> Processor {
    #[cfg(feature = "cuda")]
    return Processor::Cuda;
    #[cfg(all(feature = "wgpu", not(feature = "cuda")))]
    return Processor::Wgpu;
    #[cfg(not(any(feature = "cuda", feature = "wgpu")))]
    Processor::Cpu
}

fn bar(args: &Args) -> ProgressBar {
    if args.quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg:24} [{bar:32}] {pos}/{len} {elapsed_precise} left {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let updates = args.epochs * (args.windows / args.batch.max(1));
    ProgressBar::new(updates as u64).with_style(style)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    fs::write(path, bytes).map_err(|e| Error::new(e.to_string()).within(path.display()))
}
