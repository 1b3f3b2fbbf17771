//! `simulate`: scenes to recordings, with their truth in tables.

use std::fs;
use std::path::{Path, PathBuf};

use indicatif::ProgressBar;
use rayon::prelude::*;
use umbracast::lidar::Assembler;
use umbracast::{Config, Error, Health, Mode};
use umbracast_eval::run::chain::{self, EMPTY_FRAMES, SceneSpec};
use umbracast_eval::score::scene::SceneTruth;
use umbracast_io::recording::RecordingWriter;
use umbracast_io::rows::{PeopleLinkRow, PeopleRow};
use umbracast_io::tables::TableWriter;
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

use crate::args::{Common, Simulate};
use crate::ending::Ending;
use crate::progress::bar;
use crate::run_json::{RunJson, Stopwatch};
use crate::setup::{self, TEST_SEED};
use crate::{crowds, input, say};

/// Simulates every scene, several at a time; tables are written in the order of the scenes.
pub fn run(args: &Simulate, common: &Common) -> Result<Ending, Error> {
    let config = setup::config(Mode::Default, args.site.site.as_deref())?;
    let seed = args.crowd.seed.unwrap_or(TEST_SEED);
    let (preset, count) = (args.crowd.preset, args.scenes as usize);
    let drawn = match args.trajectories.is_empty() {
        true => (chain::drawn_scenes(&[preset], count, args.crowd.people, seed), Vec::new()),
        false => crowds::recorded_scenes(&args.trajectories, &args.replay, seed)?,
    };
    let (scenes, mut told) = crowds::dressed(drawn, &args.bodies)?;
    told.extend(crowds::through_walls(&scenes, &config.site));
    setup::make_dir(&args.out)?;
    refuse_other_scenes(&args.out, scenes.len())?;
    setup::write(&args.out.join("config.toml"), config.to_toml())?;
    let watch = Stopwatch::start();
    record_empty(&config, &args.out.join(input::EMPTY), args.clouds)?;
    let sensors = Sensors::new(&config.site, TEST_SEED)?;
    let names: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
    let mut people = TableWriter::<PeopleRow>::create(&args.out, &names, args.csv)?;
    let mut links = TableWriter::<PeopleLinkRow>::create(&args.out, &names, args.csv)?;
    let progress = bar(scenes.len() as u64, "scenes simulated", common.quiet);
    let frames = setup::with_threads(common.threads, || -> Result<u64, Error> {
        let mut frames = 0;
        let numbered: Vec<(usize, &SceneSpec)> = scenes.iter().enumerate().collect();
        for some in numbered.chunks(rayon::current_num_threads()) {
            let truths: Vec<SceneTruth> = some
                .par_iter()
                .map(|&(number, scene)| record_scene(&config, &sensors, args, number, scene, &progress))
                .collect::<Result<_, _>>()?;
            for truth in truths {
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
    let summary = RunJson::new("simulate", &watch)
        .with("arguments", std::env::args().skip(1).collect::<Vec<_>>())
        .with("first_seed", seed)
        .with("scenes", scenes.len())
        .with("frames", frames)
        .with("told", &told);
    summary.write(&args.out)?;
    let (count, folder, wall_s) = (scenes.len(), args.out.display(), watch.seconds());
    summary.print(common, &format!("{count} scenes, {frames} frames in {folder}: {wall_s:.1} s"));
    if !common.json {
        told.iter().for_each(say::line);
    }
    Ok(Ending::Done)
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
fn record_empty(config: &Config, path: &Path, clouds: bool) -> Result<(), Error> {
    let mut writer = Recorder::create(path, config, clouds)?;
    for (index, packets) in Scene::empty(&config.site, TEST_SEED, EMPTY_FRAMES)?.iter().enumerate() {
        writer.packets((index as i64 + 1) * umbracast::STEP_NS, packets)?;
    }
    writer.finish()
}

fn record_scene(
    config: &Config,
    sensors: &Sensors,
    args: &Simulate,
    number: usize,
    spec: &SceneSpec,
    progress: &ProgressBar,
) -> Result<SceneTruth, Error> {
    let path = input::scene_file(&args.out, number);
    let mut scene = Scene::in_hall(spec.crowd(), &config.site, sensors, spec.seed).with_bodies(&spec.bodies);
    let mut writer = Recorder::create(&path, config, args.clouds)?;
    let mut all = SceneTruth::default();
    while let Some(frame) = scene.next_frame() {
        let mut truth = SceneTruth::default();
        umbracast_eval::score::scene::note_truth(number as u32, &frame, &mut truth);
        writer.packets(frame.time_ns, &frame.packets)?;
        writer.recording.write_truth(frame.time_ns, frame.index, &truth.people, &truth.links)?;
        all.people.append(&mut truth.people);
        all.links.append(&mut truth.links);
    }
    writer.finish()?;
    progress.inc(1);
    Ok(all)
}

/// A recording that appears under its name only when it is whole, so a run that was stopped leaves none behind
/// that looks finished.
struct Recorder<'a> {
    recording: RecordingWriter,
    clouds: Option<Assembler>,
    path: &'a Path,
}

impl<'a> Recorder<'a> {
    fn create(path: &'a Path, config: &Config, clouds: bool) -> Result<Self, Error> {
        let recording =
            RecordingWriter::create(&path.with_extension("part"), &config.to_toml(), &config.site, clouds)?;
        let clouds = clouds.then(|| Assembler::new(&config.site)).transpose()?;
        Ok(Self { recording, clouds, path })
    }

    fn packets(&mut self, time_ns: i64, packets: &[Vec<umbracast::lidar::Packet>]) -> Result<(), Error> {
        self.recording.write_packets(time_ns, packets)?;
        if let Some(assembler) = &mut self.clouds {
            chain::push(assembler, packets, &mut Health::default());
            while let Some(frame) = assembler.pop() {
                self.recording.write_clouds(&frame)?;
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<(), Error> {
        if let Some(assembler) = &mut self.clouds {
            assembler.finish();
            while let Some(frame) = assembler.pop() {
                self.recording.write_clouds(&frame)?;
            }
        }
        self.recording.finish()?;
        fs::rename(self.path.with_extension("part"), self.path)
            .map_err(|e| Error::new(e.to_string()).within(self.path.display()))
    }
}
