//! `train`: fits the paper's LSTM on generated trajectories, or the residual network on the pipeline's tracks.

use std::path::Path;

use umbracast::Error;
use umbracast_train::departures::{ResidualOptions, train_residual};
use umbracast_train::residual::FitOptions;
use umbracast_train::{Noise, Progress, TrainOptions, TrainedModel, train};

use crate::args::{Common, Train, What};
use crate::progress::bar;
use crate::run_json::{RunJson, Stopwatch};
use crate::{Ending, crowds, setup};

/// What a tracker adds to positions: up to so much that is new in each frame, and so much that lasts.
const TRACKER_NOISE: Noise = Noise { white_m: 0.12, lasting_m: 0.05 };

/// Writes weights and card.
pub fn run(args: &Train, common: &Common) -> Result<Ending, Error> {
    let watch = Stopwatch::start();
    let card = match args.what {
        What::Lstm => lstm(args, common)?,
        What::Residual => setup::with_threads(common.threads, || residual(args, common))??,
    };
    let summary = RunJson::new("train", &watch).with("what", format!("{:?}", args.what));
    summary.write(&args.out)?;
    summary.print(common, &card);
    Ok(Ending::Done)
}

fn lstm(args: &Train, common: &Common) -> Result<String, Error> {
    let mut options = TrainOptions {
        seed: args.seed,
        scenes: args.first_scene..args.first_scene + args.scenes.unwrap_or(500),
        presets: args.preset.clone(),
        epochs: args.epochs.unwrap_or(30),
        windows_per_epoch: args.windows,
        batch: args.batch,
        commit: args.commit.clone().unwrap_or_default(),
        ..TrainOptions::paper()
    };
    if args.noise {
        options.noise = TRACKER_NOISE;
    }
    Ok(fit(options, &args.out, common)?.card)
}

fn residual(args: &Train, common: &Common) -> Result<String, Error> {
    setup::make_dir(&args.out)?;
    let end = args.first_scene + args.scenes.unwrap_or(36);
    let (recorded, _) = crowds::recorded_scenes(&args.trajectories, &args.replay, end)?;
    let options = ResidualOptions {
        scenes: args.first_scene..end,
        recorded: recorded.into_iter().map(|scene| (scene.group.clone(), scene.crowd())).collect(),
        fit: FitOptions { seed: args.seed, epochs: args.epochs.unwrap_or(15) },
        commit: args.commit.clone().unwrap_or_default(),
    };
    let progress = bar(0, "scenes seen", common.quiet);
    let scene_done = |done: usize, all: usize| {
        progress.set_length(all as u64);
        progress.set_position(done as u64);
    };
    let epoch_done = |loss| progress.set_message(format!("loss {loss:.3}"));
    let (weights, card) = train_residual(&options, scene_done, epoch_done)?;
    progress.finish_and_clear();
    setup::write(&args.out.join("residual.safetensors"), weights)?;
    setup::write(&args.out.join("residual.md"), &card)?;
    Ok(card)
}

/// Trains, or goes on from the checkpoint in `folder`, and writes weights and card there.
pub fn fit(options: TrainOptions, folder: &Path, common: &Common) -> Result<TrainedModel, Error> {
    setup::make_dir(folder)?;
    let options = TrainOptions { checkpoint: Some(folder.join("paper_lstm.checkpoint")), ..options };
    let batches = options.epochs * (options.windows_per_epoch / options.batch.max(1));
    let progress = bar(batches as u64, "training", common.quiet);
    let mut told = |now: &Progress| {
        progress.set_position((now.epoch * now.batches + now.batch) as u64);
        progress.set_message(format!("loss {:.3}", now.training_loss));
        if let Some(loss) = now.validation_loss {
            progress.println(format!("epoch {} of {}: validation {loss:.4}", now.epoch + 1, now.epochs));
        }
    };
    let model = setup::with_threads(common.threads, || train(&options, &mut told))??;
    progress.finish_and_clear();
    setup::write(&folder.join("paper_lstm.safetensors"), &model.safetensors)?;
    setup::write(&folder.join("paper_lstm.md"), &model.card)?;
    Ok(model)
}
