//! `evaluate`: a run against its truth, against labels, or scenes simulated and run in memory.

use std::collections::BTreeSet;
use std::path::Path;

use umbracast::forecast::Weights;
use umbracast::geometry::DVec2;
use umbracast::site::AccessPoint;
use umbracast::{Config, Error, Health, Mode};
use umbracast_eval::report::{self, Context, Kept};
use umbracast_eval::run::chain::{self, Spec};
use umbracast_eval::run::pooled::{self, Scores};
use umbracast_eval::run::recorded::{by_scene, score_scenes};
use umbracast_eval::score::matching::match_scene;
use umbracast_eval::score::scene::{SceneRun, SceneTruth};
use umbracast_eval::score::{labels, matches};
use umbracast_io::rows::{MatchRow, PeopleRow, TrackRow};
use umbracast_io::tables;

use crate::args::{Common, Evaluate};
use crate::ending::Ending;
use crate::progress::bar;
use crate::run_json::Frames;
use crate::setup::{self, TEST_SEED};
use crate::{crowds, say};

/// Scores what the arguments name.
pub fn run(args: &Evaluate, common: &Common) -> Result<Ending, Error> {
    match (&args.dir, &args.truth, &args.labels) {
        (Some(dir), Some(truth), _) => from_tables(dir, truth, args, common),
        (Some(dir), None, Some(file)) => against_labels(dir, file, args, common),
        (Some(dir), None, None) => {
            Err(Error::new("expected --truth or --labels beside the run, found neither")
                .within(dir.display()))
        }
        (None, ..) => {
            let seed = args.seed.unwrap_or(TEST_SEED);
            let scenes = args.scenes.unwrap_or(1) as usize;
            let configs = args
                .mode
                .iter()
                .map(|&mode| setup::config(mode, args.site.site.as_deref()))
                .collect::<Result<Vec<Config>, _>>()?;
            let site = &configs[0].site;
            let drawn = match args.trajectories.is_empty() {
                true => crowds::drawn_scenes(site, &args.preset, scenes, args.people, seed)?,
                false => crowds::recorded_scenes(site, &args.trajectories, &args.replay, seed)?,
            };
            let weights = setup::weights(args.weights.as_deref())?;
            let (scenes, mut told) = crowds::dressed(drawn, &args.bodies)?;
            told.extend(crowds::through_walls(&scenes, &configs[0].site));
            in_memory(configs, weights, (scenes, told), args.out.as_deref(), common)?;
            Ok(Ending::Done)
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
) -> Result<Scores, Error> {
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
    show(&scores, &spec.configs, kept, &told, out, common)?;
    if let (Some(folder), Some((truth, runs))) = (out, &results[0].kept) {
        write_scene(folder, &spec.configs[best], truth, &runs[best])?;
    }
    Ok(scores)
}

/// The scene that the report shows, as tables: its truth, what the last mode said, and whose track is whose.
fn write_scene(folder: &Path, config: &Config, truth: &SceneTruth, run: &SceneRun) -> Result<(), Error> {
    let names: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
    tables::write(folder, &names, false, &truth.people)?;
    tables::write(folder, &names, false, &truth.links)?;
    tables::write(folder, &names, false, &run.tracks)?;
    tables::write(folder, &names, false, &run.links)?;
    tables::write(folder, &names, false, &matches::of_scene(0, &truth.people, &run.tracks))
}

/// Scores the tables of a run against those of its truth, scene by scene.
fn from_tables(dir: &Path, truth: &Path, args: &Evaluate, common: &Common) -> Result<Ending, Error> {
    let config = config_of(dir, args)?;
    same_access_points(&config, truth)?;
    let names: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
    let all = SceneTruth { people: tables::read(truth, &names)?, links: tables::read(truth, &names)? };
    let scenes =
        by_scene(all, SceneRun { tracks: tables::read(dir, &names)?, links: tables::read(dir, &names)? })
            .map_err(|e| e.within(dir.display()).within(truth.display()))?;
    let weights = setup::weights(args.weights.as_deref())?;
    let scores = score_scenes(&config, &scenes, about_run(dir)?.health, &weights)?;
    let kept = scenes.first_key_value().map(|(number, (truth, run))| (format!("scene {number}"), truth, run));
    let kept = kept.as_ref().map(|(label, truth, run)| Kept {
        label,
        mode: config.mode,
        site: &config.site,
        truth,
        run,
    });
    let ending = show(&scores, std::slice::from_ref(&config), kept, &[], args.out.as_deref(), common)?;
    if let Some(folder) = &args.out {
        let of_scene = |(&number, (truth, run)): (&u32, &(SceneTruth, SceneRun))| {
            matches::of_scene(number, &truth.people, &run.tracks)
        };
        let pairs: Vec<MatchRow> = scenes.iter().flat_map(of_scene).collect();
        tables::write(folder, &names, false, &pairs)?;
    }
    Ok(ending)
}

/// What the run was of: as it wrote beside its tables, else the site given or the default one.
fn config_of(dir: &Path, args: &Evaluate) -> Result<Config, Error> {
    if dir.join("config.toml").exists() {
        return setup::config_of_run(dir);
    }
    let mode = match args.mode[..] {
        [mode] => mode,
        _ => Mode::Default,
    };
    let config = setup::config(mode, args.site.site.as_deref())?;
    say::note(&format!(
        "{}: without config.toml the tables are taken for mode {} on site {}",
        dir.display(),
        mode.name(),
        config.site.name
    ));
    Ok(config)
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
            "expected the truth of the run's access points {}, found those of {}",
            named(expected),
            named(&found)
        ))
        .within(truth.display())),
    }
}

/// `side (14, 0, 2) m, centre (0, 0, 3) m`
fn named(access_points: &[AccessPoint]) -> String {
    let name = |ap: &AccessPoint| {
        let [x_m, y_m, z_m] = ap.position_m;
        format!("{} ({x_m}, {y_m}, {z_m}) m", ap.name)
    };
    access_points.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// Stage 1 against people labelled by hand.
fn against_labels(dir: &Path, file: &Path, args: &Evaluate, common: &Common) -> Result<Ending, Error> {
    let config = config_of(dir, args)?;
    let names: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
    let pose = config.site.sensors[0].site_from_sensor();
    let labels = labels::parse(&setup::read_text(file)?, &pose, &file.display().to_string())?;
    let tracks: Vec<TrackRow> = tables::read(dir, &names)?;
    let run_frames: BTreeSet<u64> = match about_run(dir)?.frame_numbers {
        Some(scenes) => {
            let numbers = scenes.iter().map(Frames::numbers).collect::<Result<Vec<_>, _>>();
            numbers.map_err(|e| e.within(dir.join("run.json").display()))?.into_iter().flatten().collect()
        }
        None => tracks.iter().map(|row| row.frame).collect(),
    };
    // The hall is what is watched; not every mode cuts what lies outside.
    let watched = |x_m: f64, y_m: f64| config.site.hall.contains(DVec2::new(x_m, y_m));
    let tracks: Vec<TrackRow> = tracks.into_iter().filter(|row| watched(row.x_m, row.y_m)).collect();
    let labels: Vec<PeopleRow> = labels
        .into_iter()
        .filter(|row| run_frames.contains(&row.frame) && watched(row.x_m, row.y_m))
        .collect();
    let score = labels::score(&labels, &tracks);
    let percent = |share: Option<f64>| share.map_or("-".to_owned(), |s| format!("{s:.3}"));
    if common.json {
        let matched: BTreeSet<(u64, u32)> = match_scene(&labels, &tracks).into_keys().collect();
        let missed = labels.iter().filter(|row| !matched.contains(&(row.frame, row.person)));
        let missed: Vec<_> = missed.map(|row| [row.frame, u64::from(row.person)]).collect();
        let value = serde_json::json!({
            "labels": labels.len(), "recall": score.recall(), "precision": score.precision(),
            "position_rmse_m": score.position_rmse_m(), "mode": config.mode,
            "mota": score.mota(), "tracks": score.tracks, "matches": score.matches, "switches": score.switches,
            "missed": missed,
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
#[derive(Default, serde::Deserialize)]
struct AboutRun {
    /// By scene: every frame, also those without a track.
    frame_numbers: Option<Vec<Frames>>,
    health: Health,
}

fn about_run(dir: &Path) -> Result<AboutRun, Error> {
    let path = dir.join("run.json");
    if !path.exists() {
        return Ok(AboutRun::default());
    }
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
