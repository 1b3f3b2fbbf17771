//! Fits the model of `umbracast::detect::axis` on simulated returns.
//!
//! Training scenes have the seeds 50,000 and on, and the scenes for the errors on the card 130,000 and on. Four
//! layouts of two sensors; people on ORCA's ways, mixed crowds, pairs, and some of them speed-augmented.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use umbracast::config::Config;
use umbracast::detect::axis::{AxisModel, BODY_UNITS, OUTPUTS, POINT_UNITS};
use umbracast::detect::axis_view::{OF_BODY, OF_POINT, POINTS};
use umbracast::detect::{Background, Clusterer, Measurer, Prior, SHIFT_M};
use umbracast::geometry::DVec2;
use umbracast::lidar::{Assembler, Views};
use umbracast::track::Tracker;
use umbracast::{Error, Health};
use umbracast_eval::run::chain::{empty_frames, push};
use umbracast_sim::body::Bodies;
use umbracast_sim::crowd::{Crowd, Preset, circle_crossing, pairs, speed_augmented};
use umbracast_sim::scene::Scene;

use crate::axis_network::{EPOCHS, SEED, Sample, fit};
use crate::bodies::bodies;

/// Height of the sensors, their distance from the middle, the directions in which they stand from there, in degrees, and the
/// scenes' seeds.
type Layout = (f64, f64, &'static [f64], Range<u64>);
const OPPOSITE: &[f64] = &[0.0, 180.0];
const LAYOUTS: [Layout; 7] = [
    (9.0, 16.0, OPPOSITE, 50_000..50_036),
    (6.0, 12.5, OPPOSITE, 51_000..51_024),
    (4.0, 13.0, OPPOSITE, 52_000..52_012),
    (7.5, 14.0, OPPOSITE, 53_000..53_012),
    (5.0, 12.0, &[0.0, 90.0], 54_000..54_024),
    (3.0, 14.0, &[0.0, 120.0, 240.0], 55_000..55_024),
    (7.0, 13.0, &[0.0], 56_000..56_024),
];
/// Scenes that are not trained on.
const HELD_OUT: Layout = (9.0, 16.0, OPPOSITE, 130_000..130_006);
/// Sensors look this much below the middle of the hall, so that their beams cover both ends.
const BELOW_MIDDLE_DEG: f64 = 6.0;
/// A cluster found nearer than this to a person is that person.
const OWN_M: f64 = 0.3;
/// Every so many clusters are fitted as if nothing were known of the person.
const UNKNOWN_EVERY: usize = 6;
const PEOPLE: usize = 12;

/// Fits the model; returns the weights file and its card. `commit`, which state of the source this is, goes into the card.
/// `scene_done` is called with scenes done and scenes in all, from any thread.
///
/// # Errors
/// A layout that nothing can be simulated of.
pub fn train_axis(
    commit: &str,
    scene_done: impl Fn(usize, usize) + Sync,
) -> Result<(Vec<u8>, String), Error> {
    let scenes = |(_, _, _, seeds): &Layout| (seeds.end - seeds.start) as usize;
    let (done, all) = (AtomicUsize::new(0), LAYOUTS.iter().chain([&HELD_OUT]).map(scenes).sum());
    let told = || scene_done(done.fetch_add(1, Ordering::Relaxed) + 1, all);
    let of_layouts: Result<Vec<Vec<Sample>>, Error> =
        LAYOUTS.iter().map(|layout| samples(layout, told)).collect();
    let (training, held_out) = (of_layouts?.concat(), samples(&HELD_OUT, told)?);
    let weights = fit(&training)?;
    let model = AxisModel::from_safetensors(&weights)?;
    Ok((weights, card(&model, &training, &held_out, commit)))
}

fn card(model: &AxisModel, training: &[Sample], held_out: &[Sample], commit: &str) -> String {
    let error = |s: &Sample| model.locate(&s.view).0 - s.view.base_m - s.off_m;
    let rmse = |of: &dyn Fn(&Sample) -> DVec2, samples: &[Sample]| {
        (samples.iter().map(|s| of(s).length_squared()).sum::<f64>() / samples.len() as f64).sqrt()
    };
    let squared = |s: &Sample| {
        let ([[xx, xy], [_, yy]], e) = (model.locate(&s.view).1, error(s));
        (yy * e.x * e.x - 2.0 * xy * e.x * e.y + xx * e.y * e.y) / (xx * yy - xy * xy)
    };
    let consistency = held_out.iter().map(squared).sum::<f64>() / held_out.len() as f64;
    let layouts: String = LAYOUTS
        .iter()
        .map(|(height_m, away_m, directions_deg, seeds)| {
            format!(
                "- {} scenes from seed {}, HDL-32E {height_m} m high, {away_m} m from the middle, in the directions \
                 {directions_deg:?}\n",
                seeds.end - seeds.start,
                seeds.start
            )
        })
        .collect();
    format!(
        "# Model of the body axis\n\n\
         From what the sensors saw of one body in one frame to where its axis stands, with the error's covariance: \
         up to {POINTS} points of {OF_POINT} numbers, each through {POINT_UNITS:?} units, then with {OF_BODY} numbers of the whole body \
         through {BODY_UNITS:?} units, {OUTPUTS} outputs (`src/detect/axis.rs`).\n\n\
         Written by `umbracast train axis`, commit {commit}.\n\n\
         ## Data\n\nSimulated returns of {PEOPLE} people a scene, in turn: orca-03, mixed speed-augmented, orca-06, \
         pairs 0.6 m apart, mixed, orca-03 speed-augmented. Six scenes have bodies of our own, the next six those of the \
         third-party family `a`; then the same with telephones, bags, rucksacks and hands in pockets among them. No two \
         people walk alike.\n\n\
         {layouts}\n{} clusters; {EPOCHS} epochs, Adam, negative log-likelihood, seed {SEED}.\n\n\
         ## Error of one frame\n\n\
         | | training | {} scenes of their own from seed {} |\n|---|---|---|\n\
         | each point moved {} m away from its sensor, m | {:.4} | {:.4} |\n| this model, m | {:.4} | {:.4} |\n\
         | squared error over its variance (2 if honest) | | {consistency:.2} |\n",
        training.len(),
        HELD_OUT.3.end - HELD_OUT.3.start,
        HELD_OUT.3.start,
        SHIFT_M,
        rmse(&|s| s.off_m, training),
        rmse(&|s| s.off_m, held_out),
        rmse(&error, training),
        rmse(&error, held_out),
        commit = if commit.is_empty() { "unknown" } else { commit },
    )
}

/// Of every scene of a layout.
fn samples(layout: &Layout, scene_done: impl Fn() + Sync) -> Result<Vec<Sample>, Error> {
    let (height_m, away_m, directions_deg, seeds) = layout.clone();
    let mut config = Config::default();
    let one = config.site.sensors[0].clone();
    config.site.sensors = directions_deg
        .iter()
        .map(|direction_deg| {
            let mut sensor = one.clone();
            let [x_m, y_m] = (DVec2::from_angle(direction_deg.to_radians()) * away_m).to_array();
            sensor.name = format!("at-{direction_deg}");
            sensor.position_m = [x_m, y_m, height_m];
            sensor.rotation_deg.yaw = direction_deg - 180.0;
            sensor.rotation_deg.pitch = (height_m / away_m).atan().to_degrees() + BELOW_MIDDLE_DEG;
            sensor
        })
        .collect();
    let first = seeds.start;
    let of_scenes = seeds.into_par_iter().map(|seed| {
        let samples = watch(crowd_of(seed - first, seed), bodies((seed - first) / CROWDS)?, seed, &config);
        scene_done();
        samples
    });
    Ok(of_scenes.collect::<Result<Vec<Vec<Sample>>, Error>>()?.concat())
}

/// So many kinds of crowds.
const CROWDS: u64 = 6;

/// Who walks in the scene of that number.
fn crowd_of(scene: u64, seed: u64) -> Crowd {
    let drawn = |preset| circle_crossing(preset, PEOPLE, 12.5, seed);
    match scene % CROWDS {
        0 => drawn(Preset::Orca03),
        1 => speed_augmented(&drawn(Preset::Mixed), seed),
        2 => drawn(Preset::Orca06),
        3 => pairs(PEOPLE / 2, 0.6, 12.5, seed),
        4 => drawn(Preset::Mixed),
        _ => speed_augmented(&drawn(Preset::Orca03), seed),
    }
}

/// Every cluster of a scene that is a person's.
fn watch(crowd: Crowd, bodies: Bodies, seed: u64, config: &Config) -> Result<Vec<Sample>, Error> {
    let mut samples: Vec<Sample> = Vec::new();
    let mut health = Health::default();
    let mut background = Background::new(&config.detect, &config.site);
    let mut clusterer = Clusterer::new(&config.detect, &config.site);
    let mut measurer = Measurer::new(&config.detect, &config.site);
    let mut tracker = Tracker::new(&config.track, &config.site);
    empty_frames(&config.site, seed)?.iter().for_each(|frame| background.learn_empty(frame));
    let mut scene = Scene::new(crowd, &config.site, seed)?.with_bodies(&bodies);
    let walkers = scene.walkers().to_vec();
    let mut assembler = Assembler::new(&config.site)?;
    let (mut priors, mut points, mut clusters, mut detections, mut tracks) =
        (vec![], vec![], vec![], vec![], vec![]);
    while let Some(now) = scene.next_frame() {
        push(&mut assembler, &now.packets, &mut health);
        while let Some(frame) = assembler.pop() {
            tracker.priors(frame.time_ns, &mut priors);
            background.foreground(&frame, &priors, &mut health, &mut points);
            clusterer.clusters(&points, &priors, &mut clusters);
            measurer.detections(&points, &clusters, &priors, &mut detections);
            tracker.update(&Views::of(&frame), &detections, &mut tracks);
            for cluster in &clusters {
                let known = !samples.len().is_multiple_of(UNKNOWN_EVERY);
                let priors: &[Prior] = if known { &priors } else { &[] };
                let view = measurer.axis_view(&points, cluster, priors);
                let late: i64 = cluster.iter().map(|&i| points[i as usize].time_ns - frame.time_ns).sum();
                let time_ns = frame.time_ns + late / cluster.len() as i64;
                let off_m = walkers
                    .iter()
                    .filter_map(|walker| Some(walker.state_at(time_ns)?.position_m - view.base_m))
                    .min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
                    .filter(|off_m| off_m.length() < OWN_M);
                samples.extend(off_m.map(|off_m| Sample { view, off_m }));
            }
        }
    }
    Ok(samples)
}
