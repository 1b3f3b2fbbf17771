//! `ablate`: what each mechanism of the default mode is worth.

use std::path::{Path, PathBuf};

use umbracast::config::Mechanism;
use umbracast::geometry::DVec2;
use umbracast::{Config, Error, Health, Mode};
use umbracast_eval::run::ablate::{self, DataSet, Source};
use umbracast_eval::run::chain::{SceneSpec, drawn_scenes};
use umbracast_eval::score::labels;
use umbracast_io::trajectories::Unit;
use umbracast_sim::body::kind::Kind;
use umbracast_sim::crowd::Preset;

use crate::args::{Ablate, BodyArgs, Common, Replay};
use crate::ending::Ending;
use crate::progress::bar;
use crate::run_json::Stopwatch;
use crate::{crowds, say, setup};
use umbracast_io::input::Input;

/// People of a drawn scene.
const PEOPLE: usize = 10;
/// The sensors of the paper's tilt at 6 m, where people are seen in part.
const HEIGHT_6: &str = include_str!("../../../../config/sites/height-6.toml");
/// One of two sensors falls silent half way.
const LOST_SENSOR: &str = include_str!("../../../../config/sites/lost-sensor.toml");
/// A VLP-16 whose clouds were labelled by hand.
const LOGICTRONIX: &str = include_str!("../../../../config/sites/logictronix.toml");

/// Runs every variant on every set of data there is.
pub fn run(args: &Ablate, common: &Common) -> Result<Ending, Error> {
    let mechanisms = chosen(&args.mechanisms)?;
    let mut sets = drawn(args)?;
    match &args.data {
        Some(folder) => sets.extend(recorded(args, folder)?),
        None => {
            say::line("left out for want of --data: real walkers, bottleneck, captured gait, LogicTronix")
        }
    }
    if !args.sets.is_empty() {
        if let Some(unknown) = args.sets.iter().find(|name| !sets.iter().any(|set| set.name == **name)) {
            let names: Vec<&str> = sets.iter().map(|set| set.name.as_str()).collect();
            return Err(Error::new(format!("--sets: expected {}, found {unknown}", names.join(", "))));
        }
        sets.retain(|set| args.sets.contains(&set.name));
    }
    let scenes = |set: &DataSet| match &set.source {
        Source::Scenes(scenes) => scenes.len() as u64,
        Source::Labelled { .. } => 0,
    };
    let progress = bar(sets.iter().map(scenes).sum(), "scenes", common.quiet);
    let watch = Stopwatch::start();
    let found = setup::with_threads(common.threads, || {
        let one = |set| ablate::ablate(set, &mechanisms, || watch.elapsed(), || progress.inc(1));
        sets.iter().map(one).collect::<Result<Vec<_>, Error>>()
    })??;
    progress.finish_and_clear();
    say::text(&ablate::to_text(&found));
    if let Some(folder) = &args.out {
        setup::make_dir(folder)?;
        setup::write(&folder.join("ablation.csv"), ablate::to_csv(&found))?;
        setup::write(&folder.join("ablation.svg"), ablate::figure(&found))?;
    }
    Ok(Ending::Done)
}

fn chosen(names: &[String]) -> Result<Vec<Mechanism>, Error> {
    if names.is_empty() {
        return Ok(Mechanism::ALL.to_vec());
    }
    let of = |name: &String| {
        Mechanism::ALL.into_iter().find(|mechanism| mechanism.name() == name).ok_or_else(|| {
            let known: Vec<&str> = Mechanism::ALL.iter().map(|mechanism| mechanism.name()).collect();
            Error::new(format!("--mechanisms: expected {}, found {name:?}", known.join(", ")))
        })
    };
    names.iter().map(of).collect()
}

fn set(name: &str, config: Config, scenes: Vec<SceneSpec>) -> DataSet {
    DataSet { name: name.to_owned(), config, source: Source::Scenes(scenes) }
}

/// Crowds on the default site, one of sensors that see less, and bodies of every kind.
fn drawn(args: &Ablate) -> Result<Vec<DataSet>, Error> {
    let (count, seed) = (args.scenes as usize, args.seed);
    let crowd = |preset| drawn_scenes(&[preset], count, PEOPLE, seed);
    let low = Config::with_overlay(Mode::Default, HEIGHT_6, "height-6.toml")?;
    let lost = Config::with_overlay(Mode::Default, LOST_SENSOR, "lost-sensor.toml")?;
    let mut sets = vec![
        set("orca-03", Config::default(), crowd(Preset::Orca03)),
        set("mixed", Config::default(), crowd(Preset::Mixed)),
        set("pairs", Config::default(), crowd(Preset::Pairs)),
        set("height-6", low, crowd(Preset::Orca03)),
        set("lost-sensor", lost, crowd(Preset::Orca03)),
    ];
    use Kind::{Bag, Child, Phone, Pockets, Pram, Umbrella, Wheelchair};
    for kind in [Bag, Phone, Pockets, Umbrella, Child, Wheelchair, Pram] {
        sets.push(set(kind.name(), Config::default(), dressed(crowd(Preset::Orca03), kind, None)?));
    }
    Ok(sets)
}

/// Real walkers, real sensors and a captured gait.
fn recorded(args: &Ablate, folder: &Path) -> Result<Vec<DataSet>, Error> {
    let crowd = drawn_scenes(&[Preset::Orca03], args.scenes as usize, PEOPLE, args.seed);
    let gait = folder.join("cmu_walk/scaled_131_01.bvh");
    let walkers = ["08-1x", "16-1", "32-1xx"];
    let walkers: Vec<PathBuf> =
        walkers.iter().map(|name| folder.join(format!("circle_antipode/circle-10m-{name}.txt"))).collect();
    let replay = |seconds, unit, fps| Replay { fps, unit, smooth: 0.12, seconds, centre: true };
    let in_cm = replay(None, Some(Unit::Centimetre), Some(25.0));
    let site = Config::default().site;
    let bottleneck = [folder.join("pedpy/040_c_56_h-.txt")];
    Ok(vec![
        set("cmu-walk", Config::default(), dressed(crowd, Kind::CmuWalk, Some(gait))?),
        set("walkers", Config::default(), crowds::recorded_scenes(&site, &walkers, &in_cm, args.seed)?.0),
        set(
            "bottleneck",
            Config::default(),
            crowds::recorded_scenes(&site, &bottleneck, &replay(Some(10.0), None, None), args.seed)?.0,
        ),
        labelled(&folder.join("logictronix_vlp16"))?,
    ])
}

fn dressed(scenes: Vec<SceneSpec>, kind: Kind, gait: Option<PathBuf>) -> Result<Vec<SceneSpec>, Error> {
    let gait = gait.into_iter().collect();
    let bodies = BodyArgs { bodies: vec![(kind, 1.0)], gait, meshes: "own".to_owned() };
    Ok(crowds::dressed((scenes, Vec::new()), &bodies)?.0)
}

/// The first labelled run.
fn labelled(folder: &Path) -> Result<DataSet, Error> {
    let config = Config::with_overlay(Mode::Default, LOGICTRONIX, "logictronix.toml")?;
    let clouds = setup::files_with_extension(&folder.join("pcd"), "pcd")?;
    let first_run = |path: &PathBuf| setup::number_of(path).is_some_and(|n| (70..=95).contains(&n));
    let input = Input::Clouds(clouds.into_iter().filter(first_run).collect());
    let mut frames = Vec::new();
    input.frames(&config.site, &mut Health::default(), |frame| {
        frames.push(frame.clone());
        Ok(())
    })?;
    let file = folder.join("labels.csv");
    let pose = config.site.sensors[0].site_from_sensor();
    let mut labels = labels::parse(&setup::read_text(&file)?, &pose, &file.display().to_string())?;
    let hall = &config.site.hall;
    let watched = |row: &umbracast_io::rows::PeopleRow| hall.contains(DVec2::new(row.x_m, row.y_m));
    labels.retain(|row| frames.iter().any(|frame| frame.index == row.frame) && watched(row));
    Ok(DataSet { name: "logictronix".to_owned(), config, source: Source::Labelled { frames, labels } })
}
