//! `run`: recorded input through the pipeline; detections, tracks and links to tables.

use std::path::Path;

use rayon::prelude::*;
use umbracast::forecast::Weights;
use umbracast::{Config, Error, Frame, Health, Pipeline};
use umbracast_eval::score::scene::SceneRun;
use umbracast_io::rows::{self, DetectionRow, LinkRow, TrackRow};
use umbracast_io::tables::TableWriter;

use crate::args::{Common, Run};
use crate::ending::Ending;
use crate::input::{self, Input};
use crate::progress::bar;
use crate::run_json::{RunJson, Stopwatch, ranges};
use crate::setup;

/// What came out of one scene.
#[derive(Debug, Default)]
struct Done {
    health: Health,
    lost: Option<String>,
    /// Of each frame's `step`, seconds.
    step_s: Vec<f64>,
    /// Number of every frame, with tracks or without.
    frames: Vec<u64>,
}

/// The rows of some frames.
#[derive(Debug, Default)]
struct Rows {
    detections: Vec<DetectionRow>,
    said: SceneRun,
}

/// The tables of a run.
struct Tables {
    detections: TableWriter<DetectionRow>,
    tracks: TableWriter<TrackRow>,
    links: TableWriter<LinkRow>,
}

impl Tables {
    fn create(folder: &Path, access_points: &[String], csv: bool) -> Result<Self, Error> {
        Ok(Self {
            detections: TableWriter::create(folder, access_points, csv)?,
            tracks: TableWriter::create(folder, access_points, csv)?,
            links: TableWriter::create(folder, access_points, csv)?,
        })
    }

    fn write(&mut self, rows: &Rows) -> Result<(), Error> {
        self.detections.write(&rows.detections)?;
        self.tracks.write(&rows.said.tracks)?;
        self.links.write(&rows.said.links)
    }

    fn finish(self) -> Result<(), Error> {
        self.detections.finish()?;
        self.tracks.finish()?;
        self.links.finish()
    }
}

/// Every input is a scene with a pipeline of its own; tables are written in the order of the scenes.
pub fn run(args: &Run, common: &Common) -> Result<Ending, Error> {
    let inputs = input::scenes(&args.inputs)?;
    let mut config = setup::config(args.mode, args.site.site.as_deref())?;
    // A recording brings its site with it; a file given goes before it.
    if args.site.site.is_none() {
        config.site = input::recorded_site(&inputs)?.unwrap_or(config.site);
    }
    let weights = setup::weights(args.weights.as_deref())?;
    let (mut health, mut lost) = (Health::default(), Vec::new());
    let empty = empty_frames(args, &inputs[0], &config, &mut health, &mut lost)?;
    setup::make_dir(&args.out)?;
    setup::write(&args.out.join("config.toml"), config.to_toml())?;
    let watch = Stopwatch::start();
    let names: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
    let mut tables = Tables::create(&args.out, &names, args.csv)?;
    let progress = bar(inputs.len() as u64, "scenes run", common.quiet);
    let (mut step_s, mut frames) = (Vec::new(), Vec::new());
    let run_all = || -> Result<(), Error> {
        let mut take = |mut done: Done| {
            health.add(&done.health);
            lost.extend(done.lost.take());
            step_s.append(&mut done.step_s);
            frames.push(done.frames);
            progress.inc(1);
        };
        if let [input] = &inputs[..] {
            // A single input may go on for ever: its rows are written as they come.
            take(run_scene(number_of(0, input), input, &config, &weights, &empty, |rows| {
                tables.write(rows)?;
                rows.detections.clear();
                rows.said.tracks.clear();
                rows.said.links.clear();
                Ok(())
            })?);
            return Ok(());
        }
        let numbered: Vec<(usize, &Input)> = inputs.iter().enumerate().collect();
        for some in numbered.chunks(rayon::current_num_threads()) {
            let scene = |&(number, input): &(usize, &Input)| {
                let mut all = Rows::default();
                let done = run_scene(number_of(number, input), input, &config, &weights, &empty, |rows| {
                    all.detections.append(&mut rows.detections);
                    all.said.tracks.append(&mut rows.said.tracks);
                    all.said.links.append(&mut rows.said.links);
                    Ok(())
                });
                done.map(|done| (done, all))
            };
            for result in some.par_iter().map(scene).collect::<Vec<Result<(Done, Rows), Error>>>() {
                let (done, rows) = result?;
                tables.write(&rows)?;
                take(done);
            }
        }
        Ok(())
    };
    let result = setup::with_threads(common.threads, run_all)?;
    // What is done stays, also when a later input fails.
    tables.finish()?;
    result?;
    progress.finish_and_clear();
    let empty_handed = inputs.iter().zip(&frames).filter(|(_, frames)| frames.is_empty());
    lost.extend(empty_handed.map(|(input, _)| {
        format!("{input}: expected frames of the site's sensors, found none; `umbracast inspect` says what it holds")
    }));
    step_s.sort_by(f64::total_cmp);
    let at = |share: f64| step_s.get(((step_s.len() as f64 * share) as usize).min(step_s.len().max(1) - 1));
    let ms = |share: f64| at(share).map_or(0.0, |s| s * 1e3);
    let summary = RunJson::new("run", &watch)
        .with("mode", args.mode)
        .with("scenes", inputs.len())
        .with("frames", step_s.len())
        .with("frame_numbers", frames.iter().map(|frames| ranges(frames)).collect::<Vec<_>>())
        .with("step_ms_median", ms(0.5))
        .with("step_ms_p99", ms(0.99))
        .with("health", health)
        .with("lost", &lost);
    summary.write(&args.out)?;
    let text = format!(
        "{} frames of {} scenes in {}: {:.2} ms a frame (median), {:.2} ms (99 %)",
        step_s.len(),
        inputs.len(),
        args.out.display(),
        ms(0.5),
        ms(0.99)
    );
    summary.print(common, &text);
    if !lost.is_empty() {
        return Ok(Ending::DataLost(lost.join("; ")));
    }
    // Points outside the range that the site gives its sensor are the site's choice, not a loss; nor are coarser chances.
    if !(Health { points_invalid: 0, frames_with_fewer_samples: 0, ..health }).is_clean() {
        return Ok(Ending::DataLost(counts(&health)));
    }
    Ok(Ending::Done)
}

/// What is not zero of a health account.
fn counts(health: &Health) -> String {
    let all = serde_json::json!(health);
    let counts = all.as_object().into_iter().flatten().filter(|(_, count)| count.as_u64() != Some(0));
    counts.map(|(name, count)| format!("{name}: {count}")).collect::<Vec<_>>().join(", ")
}

/// A recording's own number, so that its rows meet its truth; else its place among the inputs.
fn number_of(place: usize, input: &Input) -> u32 {
    input::scene_number(input).unwrap_or(place as u32)
}

fn run_scene(
    scene: u32,
    input: &Input,
    config: &Config,
    weights: &Weights,
    empty: &[Frame],
    mut sink: impl FnMut(&mut Rows) -> Result<(), Error>,
) -> Result<Done, Error> {
    let mut rows = Rows::default();
    let mut pipeline = Pipeline::new(config, Some(weights))?;
    empty.iter().for_each(|frame| pipeline.learn_empty(frame));
    let mut done = Done::default();
    let (mut input_health, mut stage_health) = (Health::default(), Health::default());
    let lost = input.frames(&config.site, &mut input_health, |frame| {
        let watch = Stopwatch::start();
        let outcome = pipeline.step(frame);
        done.step_s.push(watch.seconds());
        done.frames.push(frame.index);
        rows.detections.extend(rows::detections(scene, outcome));
        rows::of_outcome(scene, outcome, &mut rows.said.tracks, &mut rows.said.links);
        stage_health = outcome.health;
        sink(&mut rows)
    })?;
    done.health = input_health;
    done.health.add(&stage_health);
    done.lost = lost;
    Ok(done)
}

/// The scene without people: as given, in any form that `run` reads, else `empty.mcap` beside the first recording.
fn empty_frames(
    args: &Run,
    first: &Input,
    config: &Config,
    health: &mut Health,
    lost: &mut Vec<String>,
) -> Result<Vec<Frame>, Error> {
    let given = args.empty.clone().or_else(|| input::empty_beside(first));
    let Some(path) = given.filter(|_| !args.no_empty) else { return Ok(Vec::new()) };
    let (frames, told) = input::empty_frames(&path, config, health)?;
    lost.extend(told);
    Ok(frames)
}
