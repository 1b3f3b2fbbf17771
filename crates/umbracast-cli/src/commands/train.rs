//! `train`: fits what the program learns from data.

use indicatif::ProgressBar;
use umbracast::{Config, Error};
use umbracast_train::body::fit_body;
use umbracast_train::departures::{ResidualOptions, train_residual};
use umbracast_train::outline::fit_outline;
use umbracast_train::pose::train_pose;
use umbracast_train::residual::FitOptions;
use umbracast_train::thresholds::tune_thresholds;

use crate::args::{Common, Fitted, Train, TrainLstm, TrainPose, TrainResidual, TrainScenes};
use crate::ending::Ending;
use crate::progress::bar;
use crate::run_json::{RunJson, Stopwatch};
use crate::{crowds, say, setup};

/// Writes a fitted file and its card, or prints lines for the configuration.
pub fn run(args: &Train, common: &Common) -> Result<Ending, Error> {
    setup::with_threads(common.threads, || match args {
        Train::Pose(args) => with_card(&args.fitted, common, "pose", || pose(args, common)),
        Train::Residual(args) => with_card(&args.fitted, common, "residual", || residual(args, common)),
        Train::Body(args) => printed(args, "scenes seen", common, |scenes, done| fit_body(scenes, done)),
        Train::Outline(args) => {
            printed(args, "scenes seen", common, |scenes, done| fit_outline(scenes, done))
        }
        Train::Thresholds(args) => {
            printed(args, "scenes run", common, |scenes, done| tune_thresholds(scenes, done))
        }
        Train::Lstm(args) => Err(elsewhere(args)),
    })??;
    Ok(Ending::Done)
}

/// Makes the folder, fits, prints the card that the fit returns.
fn with_card(
    fitted: &Fitted,
    common: &Common,
    what: &str,
    fit: impl FnOnce() -> Result<String, Error>,
) -> Result<(), Error> {
    let watch = Stopwatch::start();
    setup::make_dir(&fitted.out)?;
    let card = fit()?;
    let summary = RunJson::new("train", &watch).with("what", what);
    summary.write(&fitted.out)?;
    summary.print(common, &card);
    Ok(())
}

fn pose(args: &TrainPose, common: &Common) -> Result<String, Error> {
    let progress = bar(0, "scenes seen", common.quiet);
    let (weights, card) = train_pose(args.fitted.commit.as_deref().unwrap_or_default(), &advance(&progress))?;
    progress.finish_and_clear();
    setup::write(&args.fitted.out.join("pose.safetensors"), weights)?;
    setup::write(&args.fitted.out.join("pose.md"), &card)?;
    Ok(card)
}

fn residual(args: &TrainResidual, common: &Common) -> Result<String, Error> {
    let end = args.first_scene.saturating_add(args.scenes);
    let site = Config::default().site;
    let (recorded, _) = crowds::recorded_scenes(&site, &args.trajectories, &args.replay, end)?;
    let options = ResidualOptions {
        scenes: args.first_scene..end,
        recorded: recorded.into_iter().map(|scene| (scene.group.clone(), scene.crowd())).collect(),
        fit: FitOptions { seed: args.seed, epochs: args.epochs },
        commit: args.fitted.commit.clone().unwrap_or_default(),
    };
    let progress = bar(0, "scenes seen", common.quiet);
    let epoch_done = |loss| progress.set_message(format!("loss {loss:.3}"));
    let (weights, card) = train_residual(&options, advance(&progress), epoch_done)?;
    progress.finish_and_clear();
    setup::write(&args.fitted.out.join("residual.safetensors"), weights)?;
    setup::write(&args.fitted.out.join("residual.md"), &card)?;
    Ok(card)
}

/// A fit on scenes whose result is printed, for the source or the configuration.
fn printed(
    args: &TrainScenes,
    what: &str,
    common: &Common,
    fit: impl FnOnce(usize, &(dyn Fn(usize, usize) + Sync)) -> Result<String, Error>,
) -> Result<(), Error> {
    let progress = bar(0, what, common.quiet);
    let text = fit(args.scenes as usize, &advance(&progress))?;
    progress.finish_and_clear();
    say::line(text);
    Ok(())
}

/// Scenes done, of all.
fn advance(progress: &ProgressBar) -> impl Fn(usize, usize) + Sync {
    |done, all| {
        progress.set_length(all as u64);
        progress.set_position(done as u64);
    }
}

/// The framework of the LSTM stays out of this program.
fn elsewhere(args: &TrainLstm) -> Error {
    let arguments =
        if args.arguments.is_empty() { "--out weights".to_owned() } else { args.arguments.join(" ") };
    Error::new(format!(
        "a program of its own fits the paper's LSTM, because its framework takes minutes to build; from the \
         sources run: cargo run --release --manifest-path train/Cargo.toml -- {arguments}"
    ))
}
