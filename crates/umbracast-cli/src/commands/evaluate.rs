//! `evaluate`: a run against its truth, against labels, or scenes simulated and run in memory.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use umbracast::forecast::Weights;
use umbracast::{Config, Error, Health};
use umbracast_eval::chain::{self, Spec};
use umbracast_eval::labels;
use umbracast_eval::pooled::{self, Scores, pool};
use umbracast_eval::report::{self, Context, Kept};
use umbracast_eval::scene::{SceneRun, SceneTruth};
use umbracast_eval::score::{ModeRun, SceneScore, score_scene};
use umbracast_io::rows::{LinkRow, PeopleLinkRow, PeopleRow, TrackRow};
use umbracast_io::tables;

use crate::args::{Common, Evaluate};
use crate::progress::bar;
use crate::setup::{self, TEST_SEED};
use crate::{Ending, crowds, say};

/// Scores what the arguments name.
pub fn run(args: &Evaluate, common: &Common) -> Result<Ending, Error> {
    match (&args.dir, &args.truth, &args.labels) {
        (Some(dir), Some(truth), _) => from_tables(dir, truth, args, common),
        (Some(dir), None, Some(file)) => against_labels(dir, file, common),
        (Some(dir), None, None) => {
            Err(Error::new("expected --truth or --labels beside the run, found neither")
                .within(dir.display()))
        }
        (None, ..) => {
            let seed = args.seed.unwrap_or(TEST_SEED);
            let scenes = args.scenes.unwrap_or(1) as usize;
            let drawn = match args.trajectories.is_empty() {
                true => (chain::drawn_scenes(&args.preset, scenes, args.people, seed), Vec::new()),
                false => crowds::recorded_scenes(&args.trajectories, &args.replay, seed)?,
            };
            let configs = args
                .mode
                .iter()
                .map(|&mode| setup::config(mode, args.site.site.as_deref()))
                .collect::<Result<Vec<Config>, _>>()?;
            let weights = setup::weights(args.weights.as_deref())?;
            in_memory(configs, weights, crowds::dressed(drawn, &args.bodies)?, args.out.as_deref(), common)
        }
    }
}

/// Simulates, runs and scores without files. The ladder is climbed where there is a report to draw it in.
pub fn in_memory(
    configs: Vec<Config>,
    weights: Weights,
    (scenes, told): crowds::Told,
    out: Option<&Path>,
    common: &Common,
) -> Result<Ending, Error> {
    let spec = Spec { configs, weights: Some(weights), scenes, keep: Some(0), ladder: out.is_some() };
    let progress = bar(0, "frames", common.quiet);
    let results = setup::with_threads(common.threads, || {
        chain::run(&spec, |done| {
            if done.frames_done == 1 {
                progress.inc_length(done.frames);
            }
            progress.inc(1);
        })
    })??;
    progress.finish_and_clear();
    let scores = pooled::score(&results, &spec.configs[0].site);
    let best = spec.configs.len() - 1;
    let label = format!("{}, seed {}", spec.scenes[0].group, spec.scenes[0].seed);
    let kept = results[0].kept.as_ref().map(|(truth, runs)| Kept {
        label: &label,
        mode: spec.configs[best].mode,
        site: &spec.configs[best].site,
        truth,
        run: &runs[best],
    });
    show(&scores, &spec.configs, kept, &told, out, common)
}

/// Scores the tables of a run against those of its truth, scene by scene.
fn from_tables(dir: &Path, truth: &Path, args: &Evaluate, common: &Common) -> Result<Ending, Error> {
    let config = setup::config_of_run(dir)?;
    same_access_points(&config, truth)?;
    let names: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
    let mut scenes: BTreeMap<u32, (SceneTruth, SceneRun)> = BTreeMap::new();
    for row in tables::read::<PeopleRow>(truth, &names)? {
        scenes.entry(row.scene).or_default().0.people.push(row);
    }
    for row in tables::read::<PeopleLinkRow>(truth, &names)? {
        scenes.entry(row.scene).or_default().0.links.push(row);
    }
    for row in tables::read::<TrackRow>(dir, &names)? {
        scenes.entry(row.scene).or_default().1.tracks.push(row);
    }
    for row in tables::read::<LinkRow>(dir, &names)? {
        scenes.entry(row.scene).or_default().1.links.push(row);
    }
    if let Some((number, _)) = scenes.iter().find(|(_, (truth, _))| truth.people.is_empty()) {
        return Err(Error::new(format!(
            "expected the truth of every scene of {}, found none of scene {number}",
            dir.display()
        ))
        .within(truth.display()));
    }
    let weights = setup::weights(args.weights.as_deref())?;
    // What the whole run skipped is told with its first scene.
    let mut told = about_run(dir)?.health;
    let scores = scenes
        .iter()
        .map(|(&number, (truth, run))| {
            let health = std::mem::take(&mut told);
            let run = ModeRun { config: &config, rows: run, health };
            score_scene(number, "recorded", truth, &[run], Some(&weights), None)
        })
        .collect::<Result<Vec<SceneScore>, _>>()?;
    let scores = pool(&scores.iter().collect::<Vec<_>>(), &names);
    let kept = scenes.first_key_value().map(|(number, (truth, run))| (format!("scene {number}"), truth, run));
    let kept = kept.as_ref().map(|(label, truth, run)| Kept {
        label,
        mode: config.mode,
        site: &config.site,
        truth,
        run,
    });
    show(&scores, std::slice::from_ref(&config), kept, &[], args.out.as_deref(), common)
}

/// Refuses the truth of other links, where its folder says of which.
fn same_access_points(run: &Config, truth: &Path) -> Result<(), Error> {
    let file = truth.join("config.toml");
    if !file.exists() {
        return Ok(());
    }
    let site = Config::site_of_run(&setup::read_text(&file)?, &file.display().to_string())?;
    let (expected, found) = (&run.site.access_points, site.access_points);
    match found == *expected {
        true => Ok(()),
        false => Err(Error::new(format!(
            "expected the truth of the run's access points {expected:?}, found {found:?}"
        ))
        .within(truth.display())),
    }
}

/// Stage 1 against people labelled by hand.
fn against_labels(dir: &Path, file: &Path, common: &Common) -> Result<Ending, Error> {
    let config = setup::config_of_run(dir)?;
    let names: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
    let pose = config.site.sensors[0].site_from_sensor();
    let labels = labels::parse(&setup::read_text(file)?, &pose, &file.display().to_string())?;
    let tracks: Vec<TrackRow> = tables::read(dir, &names)?;
    let run_frames: BTreeSet<u64> = about_run(dir)?.frame_numbers.into_iter().flatten().collect();
    // The hall is what is watched; not every mode cuts what lies outside.
    let hall = config.site.hall;
    let watched = |x_m: f64, y_m: f64| 2.0 * x_m.abs() <= hall.length_m && 2.0 * y_m.abs() <= hall.width_m;
    let tracks: Vec<TrackRow> = tracks.into_iter().filter(|row| watched(row.x_m, row.y_m)).collect();
    let labels: Vec<PeopleRow> = labels
        .into_iter()
        .filter(|row| run_frames.contains(&row.frame) && watched(row.x_m, row.y_m))
        .collect();
    let score = labels::score(&labels, &tracks);
    let percent = |share: Option<f64>| share.map_or("-".to_owned(), |s| format!("{s:.3}"));
    if common.json {
        let value = serde_json::json!({
            "labels": labels.len(), "recall": score.recall(), "precision": score.precision(),
            "position_rmse_m": score.position_rmse_m(), "mode": config.mode,
        });
        say::line(format_args!("{value:#}"));
    } else {
        say::line(format_args!(
            "{}: {} labels, gate 0.5 m: recall {}, precision {}, distance {} m (RMS, to the middle of the box)",
            config.mode.name(),
            labels.len(),
            percent(score.recall()),
            percent(score.precision()),
            percent(score.position_rmse_m()),
        ));
    }
    Ok(Ending::Done)
}

/// What a run says of itself in `run.json`.
#[derive(serde::Deserialize)]
struct AboutRun {
    /// By scene: every frame, also those without a track.
    frame_numbers: Vec<Vec<u64>>,
    health: Health,
}

fn about_run(dir: &Path) -> Result<AboutRun, Error> {
    let path = dir.join("run.json");
    serde_json::from_slice(&setup::read(&path)?)
        .map_err(|e| Error::new(format!("expected what `run` writes, found: {e}")).within(path.display()))
}

/// Scores to stdout, below them what was `told` of the scenes; the report into a folder where one is given.
fn show(
    scores: &Scores,
    configs: &[Config],
    kept: Option<Kept>,
    told: &[String],
    out: Option<&Path>,
    common: &Common,
) -> Result<Ending, Error> {
    match common.json {
        true => say::text(&report::to_json(scores)),
        false => {
            say::text(&report::to_text(scores, &configs[0].site));
            told.iter().for_each(say::line);
        }
    }
    if let Some(folder) = out {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let command = format!("umbracast {}", arguments.join(" "));
        let context = Context { configs, command: command.trim_end(), kept, notes: told };
        report::write(folder, scores, &context)?;
        if !common.json {
            say::line(format_args!("\nreport: {}", folder.join("report.html").display()));
        }
    }
    Ok(Ending::Done)
}
