//! `network`: what forecasts of blockage gain a network, in closed loop.

use std::path::Path;

use umbracast::forecast::Weights;
use umbracast::{Config, Error, Health, Mode, Pipeline};
use umbracast_io::input::{self, Inputs};
use umbracast_io::reports::Tabled;
use umbracast_network::case::{Sweep, with_radios};
use umbracast_network::dataset::DataSet;
use umbracast_network::experiment::{self, Spec};
use umbracast_network::hall::{Crowd, Hall};
use umbracast_network::measured::{Fit, Measured};
use umbracast_network::policy::Policy;
use umbracast_network::{fades, passages, report, trace};

use crate::args::{Common, Network};
use crate::ending::Ending;
use crate::inputs;
use crate::progress::bar;
use crate::{say, setup};

/// Plays every case of the sweep.
pub fn run(args: &Network, common: &Common) -> Result<Ending, Error> {
    if let Some(file) = &args.shape {
        let shapes = passages::compare(&setup::read_text(file)?, &file.display().to_string())?;
        say::text(&match common.json {
            true => format!("{}\n", passages::to_json(&shapes)),
            false => passages::to_text(&shapes),
        });
        return Ok(Ending::Done);
    }
    if !args.measured.is_empty() {
        return measured(args, common);
    }
    let site = setup::config(Mode::Default, args.site.site.as_deref())?;
    let is_given = site.site.has_radio();
    let policies = if args.policies.is_empty() { Policy::ALL.to_vec() } else { args.policies.clone() };
    let are_played = !args.losses && args.trace.is_none() && args.dataset.is_none();
    let beams = are_played && policies.iter().any(|policy| policy.has_beams());
    let config = with_radios(&site, args.own_body, beams);
    if let Some(folder) = &args.dataset {
        return dataset(args, common, &config, is_given, folder);
    }
    let weights = setup::weights(None)?;
    let paper: Option<&Weights> = (are_played && policies.contains(&Policy::Paper)).then_some(&weights);
    let hall = Hall::new(&config, paper)?;
    let specs = args.people.iter().map(|&people| {
        let first = args.seed.unwrap_or(setup::TEST_SEED);
        Spec {
            hall: &hall,
            crowd: Crowd { preset: args.preset, people, seconds: args.seconds.into() },
            seeds: (first..first + u64::from(args.scenes)).collect(),
            cases: sweep(args, people, &config, is_given).cases(),
            policies: policies.clone(),
            weights: Some(&weights),
        }
    });
    let specs: Vec<Spec> = specs.collect();
    for case in specs.iter().flat_map(|spec| &spec.cases) {
        // As if it stood in a file: what cannot be is named.
        Config::of_run(&case.config(&config)?.to_toml(), "network")?;
    }
    let progress = bar((specs.len() * args.scenes as usize) as u64, "scenes played", common.quiet);
    let (first, scenes, seconds) = (args.seed.unwrap_or(setup::TEST_SEED), args.scenes, args.seconds);
    let played = format!("{scenes} scenes of {seconds} s, {}, seeds from {first}\n\n", args.preset.name());
    if args.losses {
        let compared = setup::with_threads(common.threads, || {
            specs.iter().map(|spec| fades::compare(spec, || progress.inc(1))).collect::<Result<Vec<_>, _>>()
        })??
        .concat();
        progress.finish_and_clear();
        say::text(&match common.json {
            true => format!("{}\n", report::fades_to_json(&compared)),
            false => played + &report::fades_to_text(&compared),
        });
        return Ok(Ending::Done);
    }
    if let (Some(_), Some(folder), Some(spec)) = (&args.trace, &args.out, specs.first()) {
        setup::make_dir(folder)?;
        for &seed in &spec.seeds {
            let Some(case) = spec.cases.first() else { continue };
            let csv = setup::with_threads(common.threads, || trace::csv(spec, case, seed))??;
            setup::write(&folder.join(format!("trace-{seed}.csv")), csv)?;
            progress.inc(1);
        }
        progress.finish_and_clear();
        return Ok(Ending::Done);
    }
    let rows = setup::with_threads(common.threads, || {
        specs.iter().map(|spec| experiment::run(spec, || progress.inc(1))).collect::<Result<Vec<_>, _>>()
    })??
    .concat();
    progress.finish_and_clear();
    let json = format!("{}\n", report::to_json(&rows));
    if let Some(folder) = &args.out {
        setup::make_dir(folder)?;
        setup::write(&folder.join("network.csv"), report::to_csv(&rows))?;
        setup::write(&folder.join("network.json"), &json)?;
    }
    say::text(&if common.json { json } else { played + &report::to_text(&rows) });
    Ok(Ending::Done)
}

/// Compares what is told of recordings with the power that was heard in them.
fn measured(args: &Network, common: &Common) -> Result<Ending, Error> {
    let mut config = setup::config(Mode::Default, args.site.site.as_deref())?;
    let (captures, site_file) = (&args.captures, args.site.site.as_deref());
    let Inputs { scenes: inputs, empty } =
        inputs::read(&args.measured, captures, site_file, &mut config.site, common)?;
    if !config.site.has_radio() {
        return Err(Error::new("site.access_points: expected one with `radio`, found none"));
    }
    let (mut health, given) = (Health::default(), args.empty.as_deref());
    let (empty, told) = inputs::empty_frames(given, empty, captures, &config.site, &mut health, common)?;
    let table = args.reports.as_deref().map(|file| Tabled::read(file, &config.site)).transpose()?;
    let (mut measured, mut lost) = (Vec::new(), Vec::from_iter(told));
    for (place, input) in inputs.iter().enumerate() {
        let scene = input::scene_number(input).unwrap_or(place as u32);
        let mut reports = inputs::heard(scene, input, table.as_ref(), &config.site)?;
        let mut pipeline = Pipeline::new(&config, None)?;
        empty.iter().for_each(|frame| pipeline.learn_empty(frame));
        let mut of_scene = Measured::default();
        lost.extend(input.frames(&config.site, &mut health, |frame| {
            let heard = reports.before(frame.time_ns);
            pipeline.hear(&heard);
            of_scene.take(&config.site, &heard, pipeline.step(frame));
            Ok(())
        })?);
        measured.push(of_scene.fit(&config.site));
    }
    let fit = Fit::sum(&measured);
    if fit.links == 0 {
        return Err(Error::new(
            "expected devices that were bound to people and heard in sight for a second, found none: are there reports \
             (--reports), of these times, and people?",
        ));
    }
    say::text(&if common.json { format!("{}\n", fit.to_json()) } else { fit.to_text() });
    if lost.is_empty() { Ok(Ending::Done) } else { Ok(Ending::DataLost(lost.join("; "))) }
}

/// Writes the first case of the sweep as a data set.
fn dataset(
    args: &Network,
    common: &Common,
    config: &Config,
    is_given: bool,
    folder: &Path,
) -> Result<Ending, Error> {
    let people = args.people[0];
    let case = sweep(args, people, config, is_given).cases()[0];
    let config = Config::of_run(&case.config(config)?.to_toml(), "network")?;
    setup::make_dir(folder)?;
    setup::write(&folder.join("config.toml"), config.to_toml())?;
    let crowd = Crowd { preset: args.preset, people, seconds: args.seconds.into() };
    let first = args.seed.unwrap_or(setup::TEST_SEED);
    let progress = bar(args.scenes.into(), "scenes written", common.quiet);
    setup::with_threads(common.threads, || -> Result<(), Error> {
        let mut set = DataSet::create(folder, &config, args.csv)?;
        for scene in 0..args.scenes {
            set.add(scene, crowd, first + u64::from(scene), case.truth)?;
            progress.inc(1);
        }
        set.finish()
    })??;
    progress.finish_and_clear();
    Ok(Ending::Done)
}

/// What is not asked for is as a site with radios says, or else as usual.
fn sweep(args: &Network, people: usize, config: &Config, is_given: bool) -> Sweep {
    let or = |asked: &[f64], usual: &[f64]| match asked.is_empty() && !is_given {
        true => usual.to_vec(),
        false => asked.to_vec(),
    };
    let count = if is_given { config.site.access_points.len() } else { 4 };
    let access_points = if args.access_points.is_empty() { vec![count] } else { args.access_points.clone() };
    Sweep {
        people,
        access_points,
        carriers_ghz: or(&args.carrier, &[28.0, 60.0, 140.0]),
        margins_db: or(&args.margin, &[10.0]),
        interruptions_ms: or(&args.interruption, &[25.0]),
        predictors: match args.predictor.is_empty() && !is_given {
            true => vec![umbracast::site::LossModel::Kirchhoff],
            false => args.predictor.clone(),
        },
        truths: args.truth.clone(),
    }
}
