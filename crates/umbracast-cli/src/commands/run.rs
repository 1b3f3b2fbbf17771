//! `run`: runs recorded input through the pipeline and writes detections, tracks and links to tables, and on request
//! to recordings.

use std::collections::BTreeMap;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, SyncSender};
use std::time::Duration;

use umbracast::detect::doubled;
use umbracast::forecast::Weights;
use umbracast::lidar::{Cloud, Scan};
use umbracast::radio::Report;
use umbracast::site::Sensor;
use umbracast::{Config, Error, Frame, Health, Outcome, Pipeline};
use umbracast_io::input::{self, Input, Inputs};
use umbracast_io::outcome_tables::{OutcomeRows, OutcomeTables};
use umbracast_io::recording::{RecordingWriter, Results};
use umbracast_io::reports::{self, Tabled};
use umbracast_live::latency::Latencies;

use crate::args::{Common, Run};
use crate::ending::Ending;
use crate::inputs;
use crate::progress::bar;
use crate::run_json::{Ranges, RunJson, Stopwatch};
use crate::{say, setup};

/// Rows of scenes that run ahead of an earlier one wait for the tables, at most so many bytes of all scenes together.
const AHEAD_BYTES: usize = 1 << 30;
/// A scene hands so many over at once.
const PIECE_BYTES: usize = 1 << 20;
/// So large a share of doubled detections tells that a sensor hangs elsewhere: next to none are where both hang right, a sixth
/// and more where one is off by 2 degrees and 10 cm.
const DOUBLED_SHARE_MAX: f64 = 0.02;
/// Of so large a share of the returns it is told that they do not fit the sensor's ranges: a few walls behind glass are no more.
const OUT_OF_RANGE_SHARE_MAX: f64 = 0.3;

/// What came out of one frame.
struct Step {
    frame: u64,
    took: Duration,
    rows: OutcomeRows,
    heard: Vec<Report>,
    doubled: usize,
}

impl Step {
    /// Of memory.
    fn bytes(&self) -> usize {
        size_of::<Self>() + self.rows.bytes() + size_of_val(&*self.heard)
    }
}

/// What every scene is run with.
struct Method<'a> {
    config: &'a Config,
    weights: &'a Weights,
    empty: &'a [Frame],
    /// What a scene may have where fewer scenes run than threads may.
    threads: usize,
    /// What access points heard, where it is not in the recordings.
    reports: Option<&'a Tabled>,
    /// Where recordings of the results go, and whether with points.
    recordings: Option<(&'a Path, bool)>,
}

/// Every input is a scene with a pipeline of its own. Rows are written as they come, in the order of the scenes: nothing
/// grows with a recording, which may go on for ever.
pub fn run(args: &Run, common: &Common) -> Result<Ending, Error> {
    let mut config = setup::config(args.mode, args.site.site.as_deref())?;
    let site_file = args.site.site.as_deref();
    let Inputs { scenes: inputs, empty } =
        inputs::read(&args.inputs, &args.captures, site_file, &mut config.site, common)?;
    let numbered: Vec<(u32, &Input)> = inputs.iter().enumerate().map(number_of).collect();
    if args.mcap {
        refuse_twice(&numbered)?;
    }
    let weights = setup::weights(args.weights.as_deref())?;
    let (mut health, mut lost) = (Health::default(), Vec::new());
    let empty = if args.no_empty {
        Vec::new()
    } else {
        let (given, captures) = (args.empty.as_deref(), &args.captures);
        let (frames, told) = inputs::empty_frames(given, empty, captures, &config.site, &mut health, common)?;
        lost.extend(told);
        frames
    };
    setup::make_dir(&args.out)?;
    setup::write(&args.out.join("config.toml"), config.to_toml())?;
    let recordings = args.mcap.then_some((args.out.as_path(), args.points));
    let reports = args.reports.as_deref().map(|file| Tabled::read(file, &config.site)).transpose()?;
    let at_once = setup::threads(common.threads);
    let threads = (at_once / inputs.len().max(1)).max(1);
    let reports = reports.as_ref();
    let method = Method { config: &config, weights: &weights, empty: &empty, threads, reports, recordings };
    let watch = Stopwatch::start();
    let mut tables = OutcomeTables::create(&args.out, &config.site, args.csv, true)?;
    let progress = bar(inputs.len() as u64, "scenes run", common.quiet);
    let (mut steps, mut frames) = (Latencies::default(), Vec::new());
    let (mut detected, mut doubled, mut returns) = (0, 0, 0);
    let mut run_some = |some: &[(u32, &Input)]| {
        std::thread::scope(|scope| -> Result<(), Error> {
            let mut running = Vec::new();
            for &(number, input) in some {
                let (results, coming) = mpsc::sync_channel((AHEAD_BYTES / PIECE_BYTES / at_once).max(1));
                let method = &method;
                running.push((scope.spawn(move || run_scene(number, input, method, &results)), coming));
            }
            for (scene, coming) in running {
                let mut numbers = Ranges::default();
                for step in coming.into_iter().flatten() {
                    steps.add(step.took);
                    numbers.push(step.frame);
                    detected += step.rows.detections.len();
                    doubled += step.doubled;
                    tables.write(&step.rows)?;
                }
                frames.push(numbers);
                let (scene_health, of_scene, told) =
                    scene.join().unwrap_or_else(|panic| resume_unwind(panic))?;
                health.add(&scene_health);
                returns += of_scene;
                lost.extend(told);
                progress.inc(1);
            }
            Ok(())
        })
    };
    let result = numbered.chunks(at_once).try_for_each(&mut run_some);
    // What is done stays, also when a later input fails.
    tables.finish()?;
    result?;
    progress.finish_and_clear();
    let empty_handed = inputs.iter().zip(&frames).filter(|(_, frames)| frames.is_empty());
    lost.extend(empty_handed.map(|(input, _)| {
        format!("{input}: expected frames of the site's sensors, found none; `umbracast inspect` says what it holds")
    }));
    let shortest = frames.iter().map(Ranges::len).min().unwrap_or(0);
    let mut cautions = Vec::new();
    if empty.is_empty() && !args.no_empty {
        cautions.push(inputs::no_empty_hall(shortest));
    }
    cautions.extend(out_of_range(&health, returns, &config));
    let summary = RunJson::new("run", &watch)
        .with("mode", args.mode)
        .with("scenes", inputs.len())
        .with("frames", steps.count())
        .with("frame_numbers", frames.iter().map(Ranges::to_string).collect::<Vec<_>>())
        .with("step_ms_median", steps.quantile_ms(0.5))
        .with("step_ms_p99", steps.quantile_ms(0.99))
        .with("detections", detected)
        .with("detections_doubled", doubled)
        .with("health", health)
        .with("cautions", &cautions)
        .with("lost", &lost);
    summary.write(&args.out)?;
    let text = format!(
        "{} frames of {} scenes in {}: {:.2} ms a frame (median), {:.2} ms (99 %)",
        steps.count(),
        inputs.len(),
        args.out.display(),
        steps.quantile_ms(0.5),
        steps.quantile_ms(0.99)
    );
    summary.print(common, &text);
    cautions.iter().for_each(|caution| say::caution(caution));
    if doubled as f64 > DOUBLED_SHARE_MAX * detected as f64 {
        lost.push(format!(
            "the sensors disagree: {doubled} of {detected} detections are of one sensor alone, beside one of another; \
             expected `position_m` and `rotation_deg` of each sensor as it hangs"
        ));
    }
    if health.sensors_moved > 0 {
        lost.push(format!(
            "sensors_moved: {}: sensors hang elsewhere than the site file says, by the floor and the walls they see; their poses \
             were put right, `umbracast calibrate` does so for good",
            health.sensors_moved
        ));
    }
    if !lost.is_empty() {
        return Ok(Ending::DataLost(lost.join("; ")));
    }
    // Points outside the range that the site gives its sensor are the site's choice, not a loss; nor are coarser chances.
    if !(Health { points_invalid: 0, frames_with_fewer_samples: 0, ..health }).is_clean() {
        return Ok(Ending::DataLost(counts(&health)));
    }
    Ok(Ending::Done)
}

/// Ranges that do not fit the site file, where they are more than some.
fn out_of_range(health: &Health, returns: u64, config: &Config) -> Option<String> {
    let share = health.points_invalid as f64 / returns.max(1) as f64;
    (share > OUT_OF_RANGE_SHARE_MAX).then(|| {
        let ranges = |sensor: &Sensor| {
            let Sensor { name, range_min_m, range_max_m, .. } = sensor;
            format!("{name}: {range_min_m} to {range_max_m} m")
        };
        let of_sensors: Vec<String> = config.site.sensors.iter().map(ranges).collect();
        format!(
            "{:.0} % of {returns} returns were left out (points_invalid), as they lie nearer or farther than the site file says \
             that sensors measure ({}); correct `range_min_m` and `range_max_m`, or the unit of the clouds, which is metres",
            100.0 * share,
            of_sensors.join(", ")
        )
    })
}

/// How many returns a frame has.
fn returns_of(frame: &Frame) -> u64 {
    let returns = |scan: &Scan| match &scan.cloud {
        Cloud::Organised(image) => image.range_m.iter().filter(|range_m| **range_m > 0.0).count(),
        Cloud::Unorganised(points) => points.len(),
    };
    frame.scans.iter().map(returns).sum::<usize>() as u64
}

/// What is not zero of a health account.
fn counts(health: &Health) -> String {
    let all = serde_json::json!(health);
    let counts = all.as_object().into_iter().flatten().filter(|(_, count)| count.as_u64() != Some(0));
    counts.map(|(name, count)| format!("{name}: {count}")).collect::<Vec<_>>().join(", ")
}

/// A recording's own number, so that its rows meet its truth; else its place among the inputs.
fn number_of((place, input): (usize, &Input)) -> (u32, &Input) {
    (input::scene_number(input).unwrap_or(place as u32), input)
}

/// Two scenes of one number would be recorded into one file.
fn refuse_twice(numbered: &[(u32, &Input)]) -> Result<(), Error> {
    let mut seen = BTreeMap::new();
    for &(number, input) in numbered {
        if let Some(first) = seen.insert(number, input) {
            let story = format!("--mcap: expected one scene {number}, found another, {first}");
            return Err(Error::new(story).within(input));
        }
    }
    Ok(())
}

/// Gives what was skipped, how many returns there were, and what was lost.
fn run_scene(
    scene: u32,
    input: &Input,
    method: &Method,
    results: &SyncSender<Vec<Step>>,
) -> Result<(Health, u64, Vec<String>), Error> {
    let Method { config, weights, empty, threads, reports, recordings } = method;
    let mut reports = inputs::heard(scene, input, *reports, &config.site)?;
    let mut pipeline = Pipeline::new(config, Some(weights))?;
    pipeline.use_threads(*threads);
    empty.iter().for_each(|frame| pipeline.learn_empty(frame));
    let mut recording = recordings.map(|(folder, points)| Recording::new(folder, scene, config, points));
    let (mut health, mut stage_health, mut returns) = (Health::default(), Health::default(), 0);
    let (mut piece, mut bytes) = (Vec::new(), 0);
    let hand_over = |piece: &mut Vec<Step>| {
        results.send(std::mem::take(piece)).map_err(|_| Error::new("the tables ended before their rows"))
    };
    let lost = input.frames(&config.site, &mut health, |frame| {
        returns += returns_of(frame);
        let watch = Stopwatch::start();
        let heard = reports.before(frame.time_ns);
        pipeline.hear(&heard);
        let outcome = pipeline.step(frame);
        let took = watch.elapsed();
        let rows = OutcomeRows::of(scene, outcome);
        let doubled = doubled(&outcome.foreground, &outcome.clusters);
        let step = Step { frame: frame.index, took, rows, heard, doubled };
        stage_health = outcome.health;
        if let Some(recording) = &mut recording {
            recording.write(&step, outcome)?;
        }
        bytes += step.bytes();
        piece.push(step);
        if bytes < PIECE_BYTES {
            return Ok(());
        }
        bytes = 0;
        hand_over(&mut piece)
    });
    // What came before an input's error stays.
    hand_over(&mut piece)?;
    let lost = lost?;
    recording.map_or(Ok(()), Recording::finish)?;
    // Returns that packets hold out of range are in no frame.
    returns += health.points_invalid;
    health.add(&stage_health);
    Ok((health, returns, lost.into_iter().chain(clocks_apart(input, config, &pipeline)).collect()))
}

/// How far sensors' clocks were found apart, where they were.
fn clocks_apart(input: &Input, config: &Config, pipeline: &Pipeline) -> Option<String> {
    let clocks = pipeline.clocks();
    if clocks.corrected() == 0 {
        return None;
    }
    let ahead = |(s, sensor): (usize, &Sensor)| format!("{} {:+.1} ms", sensor.name, 1e3 * clocks.ahead_s(s));
    let ahead: Vec<String> = config.site.sensors.iter().enumerate().map(ahead).collect();
    Some(format!(
        "{input}: clocks_corrected: by who walks before several sensors these clocks are ahead of their mean: {}; times were \
         put right, `clock_offset_ms` of a sensor or `umbracast calibrate` does so for good",
        ahead.join(", ")
    ))
}

/// One scene's results as a recording, begun with the first frame.
struct Recording<'a> {
    path: PathBuf,
    config: &'a Config,
    points: bool,
    open: Option<RecordingWriter>,
}

impl<'a> Recording<'a> {
    fn new(folder: &Path, scene: u32, config: &'a Config, points: bool) -> Self {
        Self { path: folder.join(format!("results-{scene:04}.mcap")), config, points, open: None }
    }

    fn write(&mut self, step: &Step, outcome: &Outcome) -> Result<(), Error> {
        let time_ns = outcome.time_ns;
        let writer = match &mut self.open {
            Some(writer) => writer,
            closed => {
                let (toml, site) = (self.config.to_toml(), &self.config.site);
                closed.insert(RecordingWriter::create_live(&self.path, &toml, site, time_ns)?)
            }
        };
        writer.write_results(&Results {
            frame: step.frame,
            time_ns,
            logged_ns: time_ns,
            detections: &step.rows.detections,
            tracks: &step.rows.tracks,
            links: &step.rows.links,
            losses: &step.rows.losses,
            bindings: &step.rows.bindings,
            reports: &reports::rows(step.frame, time_ns, &step.heard),
            decisions: &step.rows.decisions,
            foreground: self.points.then_some(&outcome.foreground),
        })
    }

    fn finish(self) -> Result<(), Error> {
        self.open.map_or(Ok(()), RecordingWriter::finish)
    }
}
