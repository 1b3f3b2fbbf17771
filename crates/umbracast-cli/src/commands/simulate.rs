//! `simulate`: writes scenes as recordings with their truth in tables, or sends them as packets.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use umbracast::{Config, Error, Mode};
use umbracast_eval::run::chain::{CIRCLE_M, EMPTY_FRAMES, People, SceneSpec};
use umbracast_eval::score::scene::SceneTruth;
use umbracast_io::input;
use umbracast_io::rows::{PeopleLinkRow, PeopleRow};
use umbracast_io::tables::TableWriter;
use umbracast_sim::crowd::{Ground, Stroll};
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

use crate::args::{Common, Packets, Simulate};
use crate::ending::Ending;
use crate::progress::bar;
use crate::run_json::{RunJson, Stopwatch};
use crate::setup::{self, TEST_SEED};
use crate::{crowds, say};

mod recorder;
mod send;

use recorder::Recorder;

/// Simulates every scene into files, over UDP, or both.
pub fn run(args: &Simulate, common: &Common) -> Result<Ending, Error> {
    let config = setup::config(Mode::Default, args.site.site.as_deref())?;
    let seed = args.crowd.seed.unwrap_or(TEST_SEED);
    let (preset, count) = (args.crowd.preset, args.scenes as usize);
    let mut drawn = match args.trajectories.is_empty() {
        true => crowds::drawn_scenes(&config.site, &[preset], count, args.crowd.people, seed)?,
        false => crowds::recorded_scenes(&config.site, &args.trajectories, &args.replay, seed)?,
    };
    if let Some(seconds) = args.stroll {
        let ground = Ground::of(&config.site, CIRCLE_M)?;
        for scene in &mut drawn.0 {
            let mut stroll = Stroll::new(preset, args.crowd.people, &ground, scene.seed);
            scene.people = People::Replayed(stroll.leg(seconds.into()));
        }
    }
    let (scenes, mut told) = crowds::dressed(drawn, &args.bodies)?;
    told.extend(crowds::through_walls(&scenes, &config.site));
    let watch = Stopwatch::start();
    let mut summary = RunJson::new("simulate", &watch)
        .with("arguments", std::env::args().skip(1).collect::<Vec<_>>())
        .with("first_seed", seed)
        .with("scenes", scenes.len())
        .with("told", &told);
    let mut text = Vec::new();
    if let Some(out) = &args.out {
        let frames = record(args, out, &config, &scenes, common)?;
        let (count, wall_s) = (scenes.len(), watch.seconds());
        summary = summary.with("wall_s", wall_s).with("frames", frames);
        summary.write(out)?;
        text.push(format!("{count} scenes, {frames} frames in {}: {wall_s:.1} s", out.display()));
    }
    match (&args.packets, &args.out) {
        (Some(Packets::Udp(to)), _) => {
            let sent = send::scenes(&scenes, &config, to)?;
            summary = summary
                .with("packets_sent", sent.packets)
                .with("packets_failed", sent.failed)
                .with("sent_late_ms_max", sent.latest_ns as f64 * 1e-6);
            text.push(format!("{} packets sent in {:.1} s", sent.packets, watch.seconds()));
        }
        (Some(Packets::Pcap), None) => return Err(Error::new("--packets pcap: expected --out, found none")),
        _ => {}
    }
    summary.print(common, &text.join("\n"));
    if !common.json {
        told.iter().for_each(say::line);
    }
    Ok(Ending::Done)
}

/// Several scenes at a time; tables are written in the order of the scenes. Gives how many frames there are.
fn record(
    args: &Simulate,
    out: &Path,
    config: &Config,
    scenes: &[SceneSpec],
    common: &Common,
) -> Result<u64, Error> {
    setup::make_dir(out)?;
    refuse_other_scenes(out, scenes.len())?;
    setup::write(&out.join("config.toml"), config.to_toml())?;
    record_empty(config, &out.join(input::EMPTY), args)?;
    let sensors = Sensors::new(&config.site, TEST_SEED)?;
    let names: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
    let mut people = TableWriter::<PeopleRow>::create(out, &names, args.csv)?;
    let mut links = TableWriter::<PeopleLinkRow>::create(out, &names, args.csv)?;
    let progress = bar(scenes.len() as u64, "scenes simulated", common.quiet);
    let frames = setup::with_threads(common.threads, || -> Result<u64, Error> {
        let mut frames = 0;
        let numbered: Vec<(usize, &SceneSpec)> = scenes.iter().enumerate().collect();
        for some in numbered.chunks(rayon::current_num_threads()) {
            let record = |&(number, scene): &(usize, &SceneSpec)| {
                let truth =
                    record_scene(config, &sensors, args, &input::scene_file(out, number), number, scene);
                progress.inc(1);
                truth
            };
            for truth in some.par_iter().map(record).collect::<Result<Vec<SceneTruth>, _>>()? {
                frames += truth.people.last().map_or(0, |row| row.frame + 1);
                people.write(&truth.people)?;
                links.write(&truth.links)?;
            }
        }
        Ok(frames)
    })??;
    people.finish()?;
    links.finish()?;
    progress.finish_and_clear();
    Ok(frames)
}

/// Recordings of an earlier simulation would be run and scored among the new ones, without truth.
fn refuse_other_scenes(folder: &Path, scenes: usize) -> Result<(), Error> {
    let ours: Vec<PathBuf> = (0..scenes).map(|number| input::scene_file(folder, number)).collect();
    let found = input::recordings(folder)?;
    let other = found.iter().find(|file| !ours.contains(file));
    other.map_or(Ok(()), |file| {
        let told = format!("expected no recordings but scene-0000 to {:04}, found another", scenes - 1);
        Err(Error::new(told).within(file.display()))
    })
}

/// The hall without people.
fn record_empty(config: &Config, path: &Path, args: &Simulate) -> Result<(), Error> {
    let mut writer = Recorder::create(path, config, args)?;
    for (index, packets) in Scene::empty(&config.site, TEST_SEED, EMPTY_FRAMES)?.iter().enumerate() {
        writer.packets((index as i64 + 1) * umbracast::STEP_NS, packets)?;
    }
    writer.finish()
}

fn record_scene(
    config: &Config,
    sensors: &Sensors,
    args: &Simulate,
    path: &Path,
    number: usize,
    spec: &SceneSpec,
) -> Result<SceneTruth, Error> {
    let mut scene = Scene::in_hall(spec.crowd(), &config.site, sensors, spec.seed).with_bodies(&spec.bodies);
    let mut writer = Recorder::create(path, config, args)?;
    let mut all = SceneTruth::default();
    while let Some(frame) = scene.next_frame() {
        let mut truth = SceneTruth::default();
        umbracast_eval::score::scene::note_truth(number as u32, &frame, &mut truth);
        writer.packets(frame.time_ns, &frame.packets)?;
        writer.truth(frame.time_ns, frame.index, &truth)?;
        all.people.append(&mut truth.people);
        all.links.append(&mut truth.links);
    }
    writer.finish()?;
    Ok(all)
}
