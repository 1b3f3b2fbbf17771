//! `train`: fits the paper's LSTM on generated trajectories.

use umbracast::Error;
use umbracast_train::{Noise, TrainOptions, train};

use crate::args::{Common, Train};
use crate::progress::bar;
use crate::run_json::{RunJson, Stopwatch};
use crate::{Ending, setup};

/// What a tracker adds to positions: up to so much that is new in each frame, and so much that lasts.
const TRACKER_NOISE: Noise = Noise { white_m: 0.12, lasting_m: 0.05 };

/// Goes on from the checkpoint where there is one, and writes weights and card.
pub fn run(args: &Train, common: &Common) -> Result<Ending, Error> {
    setup::make_dir(&args.out)?;
    let watch = Stopwatch::start();
    let mut options = TrainOptions {
        seed: args.seed,
        scenes: args.first_scene..args.first_scene + args.scenes,
        presets: args.preset.clone(),
        epochs: args.epochs,
        windows_per_epoch: args.windows,
        batch: args.batch,
        checkpoint: Some(args.out.join("paper_lstm.checkpoint")),
        commit: args.commit.clone().unwrap_or_default(),
        ..TrainOptions::paper()
    };
    if args.noise {
        options.noise = TRACKER_NOISE;
    }
    let progress = bar((args.epochs * (args.windows / args.batch.max(1))) as u64, "training", common.quiet);
    let model = train(&options, &mut |now| {
        progress.set_position((now.epoch * now.batches + now.batch) as u64);
        progress.set_message(format!("loss {:.3}", now.training_loss));
        if let Some(loss) = now.validation_loss {
            progress.println(format!("epoch {} of {}: validation {loss:.4}", now.epoch + 1, now.epochs));
        }
    })?;
    progress.finish_and_clear();
    setup::write(&args.out.join("paper_lstm.safetensors"), &model.safetensors)?;
    setup::write(&args.out.join("paper_lstm.md"), &model.card)?;
    let summary = RunJson::new("train", &watch).with("epochs", args.epochs);
    summary.write(&args.out)?;
    summary.print(common, &model.card);
    Ok(Ending::Done)
}
