//! `reproduce`: the paper's whole experiment, scene by scene. It can be stopped and resumed, and spread over
//! machines: each finished scene is a file.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use umbracast::forecast::Weights;
use umbracast::{Config, Error, Mode, Site};
use umbracast_eval::report::{self, Context};
use umbracast_eval::run::chain::Spec;
use umbracast_eval::run::experiment::{Experiment, Shard};
use umbracast_eval::run::pooled;

use crate::args::{Common, Replay, Reproduce};
use crate::ending::Ending;
use crate::progress::SceneClock;
use crate::run_json::{RunJson, Stopwatch};
use crate::setup::{self, TEST_SEED};
use crate::{crowds, say};

/// Scenes of `--quick`.
const QUICK_SCENES: u32 = 40;
/// Where the scenes lie in the folder of a run.
const SCENES: &str = "scenes";

/// Runs what is missing, and reports unless this is a shard.
pub fn run(args: &Reproduce, common: &Common) -> Result<Ending, Error> {
    let watch = Stopwatch::start();
    let network = network(args)?;
    let configs = Mode::ALL
        .into_iter()
        .map(|mode| setup::config(mode, args.site.site.as_deref()))
        .collect::<Result<Vec<Config>, _>>()?;
    let weights = Weights::from_safetensors(&network.weights)?;
    let (scenes, told) = scenes(args, &configs[0].site)?;
    let spec = Spec { configs, weights: Some(weights), scenes, keep: None, ladder: true };
    let folder = args.out.join(SCENES);
    let experiment = Experiment::new(&spec, &folder, &program()?, &network.weights)?;
    let mut ran = 0;
    if args.merge.is_empty() {
        ran = run_missing(&experiment, args.shard.unwrap_or(Shard::WHOLE), common)?;
    } else {
        let folders: Vec<PathBuf> = args.merge.iter().map(|dir| dir.join(SCENES)).collect();
        experiment.gather(&folders)?;
    }
    let summary = RunJson::new("reproduce", &watch).with("scenes", spec.scenes.len()).with("scenes_run", ran);
    if let Some(Shard { index, of }) = args.shard {
        let wall_s = watch.seconds();
        let text = format!("shard {index}/{of}: {ran} scenes run into {}: {wall_s:.0} s", folder.display());
        summary.print(common, &text);
        return Ok(Ending::Done);
    }
    let scores = pooled::score(&experiment.results()?, &spec.configs[0].site);
    let notes = [notes(&spec, &network), told].concat();
    let command = command(args, spec.scenes.len());
    let context = Context { configs: &spec.configs, command: &command, kept: None, notes: &notes };
    report::write(&args.out, &scores, &context)?;
    summary.write(&args.out)?;
    if common.json {
        say::text(&report::to_json(&scores));
    } else {
        let site = &spec.configs[0].site;
        let text = [report::to_text(&scores, site), report::boxes_to_text(&scores, site)].join("\n");
        say::text(&format!("{}\n\n{text}", notes.join("\n")));
        say::line(format_args!("\nreport: {}", args.out.join("report.html").display()));
    }
    Ok(Ending::Done)
}

/// Runs the scenes of a shard that have no file yet; says how many.
fn run_missing(experiment: &Experiment, shard: Shard, common: &Common) -> Result<usize, Error> {
    let (missing, damaged) = experiment.missing(shard)?;
    for story in &damaged {
        eprintln!("umbracast: {story}: run again");
    }
    let clock = SceneClock::start(missing.len(), common.quiet);
    setup::with_threads(common.threads, || {
        experiment.run(&missing, |done| {
            if done.frames_done == done.frames {
                clock.one_done();
            }
        })
    })??;
    clock.finish();
    Ok(missing.len())
}

fn scenes(args: &Reproduce, site: &Site) -> Result<crowds::Told, Error> {
    let seed = args.crowd.seed.unwrap_or(TEST_SEED);
    if !args.trajectories.is_empty() {
        return crowds::recorded_scenes(site, &args.trajectories, &args.replay, seed);
    }
    let count = if args.quick { QUICK_SCENES } else { args.scenes };
    crowds::drawn_scenes(site, &[args.crowd.preset], count as usize, args.crowd.people, seed)
}

/// The program's own bytes: scenes of another build are not mixed with this one's.
fn program() -> Result<Vec<u8>, Error> {
    let path = std::env::current_exe().map_err(|e| Error::new(format!("the program itself: {e}")))?;
    setup::read(&path)
}

/// The LSTM of the modes that forecast with it.
struct Network {
    weights: Cow<'static, [u8]>,
    /// What its card says, where it has one.
    card: Option<String>,
}

fn network(args: &Reproduce) -> Result<Network, Error> {
    let card = match &args.weights {
        None => Some(setup::PAPER_LSTM_CARD.to_owned()),
        Some(file) => setup::read_text(&file.with_extension("md")).ok(),
    };
    Ok(Network { weights: setup::weights_file(args.weights.as_deref())?, card })
}

/// What a reader must know beside the figures.
fn notes(spec: &Spec, network: &Network) -> Vec<String> {
    let epochs = match network.card.as_deref().map(epochs) {
        Some(Some(epochs)) => format!("{epochs} epochs by its card"),
        Some(None) => "epochs that its card does not tell".to_owned(),
        None => "epochs unknown: the weights have no card beside them".to_owned(),
    };
    let (first, last) = (&spec.scenes[0], &spec.scenes[spec.scenes.len() - 1]);
    vec![
        format!(
            "The paper's experiment: {} scene(s) ({}, seeds {} to {}), every mode with Algorithm 1 on AABB and on OBB \
             and with its own stage 3. Error budget and ladder are of all scenes too.",
            spec.scenes.len(),
            first.group,
            first.seed,
            last.seed
        ),
        format!("The LSTM of hdl and paper was trained for {epochs}; the paper trains for 30."),
    ]
}

/// The number before " epochs of" in a card.
fn epochs(card: &str) -> Option<u64> {
    card.split(" epochs of").next()?.rsplit(' ').next()?.parse().ok()
}

/// The command line of the whole experiment, the same for one run, one that was stopped, and merged shards.
fn command(args: &Reproduce, scenes: usize) -> String {
    let seed = args.crowd.seed.unwrap_or(TEST_SEED);
    let named = |flag: &str, file: &Path| format!(" {flag} {}", file.display());
    let mut command = "umbracast reproduce".to_owned();
    if args.trajectories.is_empty() {
        let (preset, people) = (args.crowd.preset.name(), args.crowd.people);
        command += &format!(" --scenes {scenes} --preset {preset} --people {people}");
    } else {
        command += " --trajectories";
        args.trajectories.iter().for_each(|file| command += &format!(" {}", file.display()));
        let Replay { fps, unit, smooth, seconds, centre } = &args.replay;
        fps.iter().for_each(|hz| command += &format!(" --fps {hz}"));
        unit.iter().for_each(|unit| command += &format!(" --unit {}", unit.name()));
        command += &format!(" --smooth {smooth}");
        seconds.iter().for_each(|seconds| command += &format!(" --seconds {seconds}"));
        command += if *centre { " --centre" } else { "" };
    }
    command += &format!(" --seed {seed}");
    args.site.site.iter().for_each(|file| command += &named("--site", file));
    args.weights.iter().for_each(|file| command += &named("--weights", file));
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_card_tells_its_epochs() {
        assert!(epochs(setup::PAPER_LSTM_CARD).is_some_and(|epochs| epochs > 0));
        assert_eq!(epochs("- Training: seed 1, 30 epochs of 16384 windows drawn"), Some(30));
        assert_eq!(epochs("Weights of mine"), None);
    }
}
