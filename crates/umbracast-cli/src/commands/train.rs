//! `train`: fits the paper's LSTM on generated trajectories.

use std::path::Path;

use umbracast::Error;
use umbracast_train::{Noise, TrainOptions, TrainedModel, train};

use crate::args::{Common, Train};
use crate::progress::bar;
use crate::run_json::{RunJson, Stopwatch};
use crate::{Ending, setup};

/// What a tracker adds to positions: up to so much that is new in each frame, and so much that lasts.
const TRACKER_NOISE: Noise = Noise { white_m: 0.12, lasting_m: 0.05 };

/// Goes on from the checkpoint where there is one, and writes weights and card.
pub fn run(args: &Train, common: &Common) -> Result<Ending, Error> {
    let watch = Stopwatch::start();
    let mut options = TrainOptions {
        seed: args.seed,
        scenes: args.first_scene..args.first_scene + args.scenes,
        presets: args.preset.clone(),
        epochs: args.epochs,
        windows_per_epoch: args.windows,
        batch: args.batch,
        commit: args.commit.clone().unwrap_or_default(),
        ..TrainOptions::paper()
    };
    if args.noise {
        options.noise = TRACKER_NOISE;
    }
    let model = fit(options, &args.out, common)?;
    let summary = RunJson::new("train", &watch).with("epochs", args.epochs);
    summary.write(&args.out)?;
    summary.print(common, &model.card);
    Ok(Ending::Done)
}

/// Trains, or goes on from the checkpoint in `folder`, and writes weights and card there.
pub fn fit(options: TrainOptions, folder: &Path, common: &Common) -> Result<TrainedModel, Error> {
    setup::make_dir(folder)?;
    let options = TrainOptions { checkpoint: Some(folder.join("paper_lstm.checkpoint")), ..options };
    let batches = options.epochs * (options.windows_per_epoch / options.batch.max(1));
    let progress = bar(batches as u64, "training", common.quiet);
    let model = train(&options, &mut |now| {
        progress.set_position((now.epoch * now.batches + now.batch) as u64);
        progress.set_message(format!("loss {:.3}", now.training_loss));
        if let Some(loss) = now.validation_loss {
            progress.println(format!("epoch {} of {}: validation {loss:.4}", now.epoch + 1, now.epochs));
        }
    })?;
    progress.finish_and_clear();
    setup::write(&folder.join("paper_lstm.safetensors"), &model.safetensors)?;
    setup::write(&folder.join("paper_lstm.md"), &model.card)?;
    Ok(model)
}
