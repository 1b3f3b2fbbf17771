//! Bodies as sensors see them in one frame, with their true poses: what the network that looks at one body is fitted on.
//!
//! Training scenes have the seeds 50,000 and on, and the scenes for the errors on the cards 130,000 and on. Layouts of one, two
//! and three sensors; people on ORCA's ways, mixed crowds, pairs, and some of them speed-augmented.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use umbracast::config::Config;
use umbracast::detect::pose_view::PoseView;
use umbracast::detect::{Background, Clusterer, Measurer, Prior};
use umbracast::gait::WALKS_FROM_MPS;
use umbracast::geometry::DVec2;
use umbracast::lidar::{Assembler, Views};
use umbracast::track::Tracker;
use umbracast::{Error, Health};
use umbracast_eval::run::chain::{CIRCLE_M, empty_frames, push};
use umbracast_sim::body::{Bodies, PersonState, Walker};
use umbracast_sim::crowd::{Crowd, Preset, circle_crossing, pairs, speed_augmented};
use umbracast_sim::scene::Scene;

use crate::bodies::with_things;

/// Where sensors hang, and the scenes that they see.
struct Layout {
    height_m: f64,
    /// From the middle.
    away_m: f64,
    /// In which directions from there they hang.
    directions_deg: &'static [f64],
    seeds: Range<u64>,
}

const fn layout(height_m: f64, away_m: f64, directions_deg: &'static [f64], seeds: Range<u64>) -> Layout {
    Layout { height_m, away_m, directions_deg, seeds }
}

const OPPOSITE: &[f64] = &[0.0, 180.0];
const LAYOUTS: [Layout; 7] = [
    layout(9.0, 16.0, OPPOSITE, 50_000..50_036),
    layout(6.0, 12.5, OPPOSITE, 51_000..51_024),
    layout(4.0, 13.0, OPPOSITE, 52_000..52_012),
    layout(7.5, 14.0, OPPOSITE, 53_000..53_012),
    layout(5.0, 12.0, &[0.0, 90.0], 54_000..54_024),
    layout(3.0, 14.0, &[0.0, 120.0, 240.0], 55_000..55_024),
    layout(7.0, 13.0, &[0.0], 56_000..56_024),
];
/// Scenes that are not trained on.
const HELD_OUT: Layout = layout(9.0, 16.0, OPPOSITE, 130_000..130_036);
/// Sensors look this much below the middle of the hall, so that their beams cover both ends.
const BELOW_MIDDLE_DEG: f64 = 6.0;
/// A cluster found nearer than this to a person is that person.
const OWN_M: f64 = 0.5;
/// Every so many clusters are fitted as if nothing were known of the person.
const UNKNOWN_EVERY: usize = 6;
/// Frames between are much alike.
const EVERY: usize = 2;
/// People in a scene. Of many, others hide parts.
const FEW: usize = 12;
const MANY: usize = 24;

/// A body in one frame.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    pub(crate) view: PoseView,
    /// From the view's base to the true axis.
    pub(crate) off_m: DVec2,
    /// Of who is known to stand.
    pub(crate) heading_rad: Option<f64>,
    /// Of the stride of who is known to walk.
    pub(crate) phase_rad: Option<f64>,
    /// How far the left and the right hand of who is known to walk swing, as `Walker::hand_swing_at` says.
    pub(crate) hand_swing: Option<[f64; 2]>,
}

/// Bodies to learn from, and others of scenes of their own. `scene_done` is called with scenes done and scenes in all, from any
/// thread.
///
/// # Errors
/// A layout that nothing can be simulated of.
pub(crate) fn watch_all(scene_done: impl Fn(usize, usize) + Sync) -> Result<[Vec<Seen>; 2], Error> {
    let scenes = |layout: &Layout| (layout.seeds.end - layout.seeds.start) as usize;
    let (done, all) = (AtomicUsize::new(0), LAYOUTS.iter().chain([&HELD_OUT]).map(scenes).sum());
    let told = || scene_done(done.fetch_add(1, Ordering::Relaxed) + 1, all);
    let mut training = Vec::new();
    let mut before = 0;
    for layout in &LAYOUTS {
        training.extend(seen_in(layout, before, told)?);
        before += scenes(layout) as u64;
    }
    Ok([training, seen_in(&HELD_OUT, 0, told)?])
}

/// For a card: which scenes the bodies are of.
pub(crate) fn scenes_listed() -> String {
    let layouts: String = LAYOUTS
        .iter()
        .map(|Layout { height_m, away_m, directions_deg, seeds }| {
            format!(
                "- {} scenes from seed {}, HDL-32E {height_m} m high, {away_m} m from the middle, in the directions \
                 {directions_deg:?}\n",
                seeds.end - seeds.start,
                seeds.start
            )
        })
        .collect();
    format!(
        "Simulated returns of every other frame of scenes, in turn {FEW} people of orca-03, mixed speed-augmented and orca-06, {MANY} \
         in pairs 0.6 m apart, of mixed, of orca-03 speed-augmented. Six scenes have bodies of our own, the next six those of the third-party family \
         `a`; then the same with telephones, bags, rucksacks and hands in pockets among them; then with children, \
         wheelchairs, prams, walking frames, umbrellas and people who gesture. No two people walk alike.\n\n{layouts}"
    )
}

/// What the errors on a card are of.
pub(crate) fn held_out_name() -> String {
    format!(
        "{} scenes of their own from seed {}",
        HELD_OUT.seeds.end - HELD_OUT.seeds.start,
        HELD_OUT.seeds.start
    )
}

/// Of every scene of a layout, of which so many come before.
fn seen_in(layout: &Layout, before: u64, scene_done: impl Fn() + Sync) -> Result<Vec<Seen>, Error> {
    let &Layout { height_m, away_m, directions_deg, ref seeds } = layout;
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
    let of_scenes = seeds.clone().into_par_iter().map(|seed| {
        let scene = before + seed - first;
        let samples = watch(crowd_of(scene, seed), with_things(scene / CROWDS)?, seed, &config);
        scene_done();
        samples
    });
    Ok(of_scenes.collect::<Result<Vec<Vec<Seen>>, Error>>()?.concat())
}

/// So many kinds of crowds.
const CROWDS: u64 = 6;

/// Who walks in the scene of that number.
fn crowd_of(scene: u64, seed: u64) -> Crowd {
    let drawn = |preset, people| circle_crossing(preset, people, CIRCLE_M, seed);
    match scene % CROWDS {
        0 => drawn(Preset::Orca03, FEW),
        1 => speed_augmented(&drawn(Preset::Mixed, FEW), seed),
        2 => drawn(Preset::Orca06, FEW),
        3 => pairs(MANY / 2, 0.6, CIRCLE_M, seed),
        4 => drawn(Preset::Mixed, MANY),
        _ => speed_augmented(&drawn(Preset::Orca03, MANY), seed),
    }
}

/// Every cluster that is a person's, in every other frame of a scene.
fn watch(crowd: Crowd, bodies: Bodies, seed: u64, config: &Config) -> Result<Vec<Seen>, Error> {
    let mut samples: Vec<Seen> = Vec::new();
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
    let mut frames = 0_usize;
    while let Some(now) = scene.next_frame() {
        push(&mut assembler, &now.packets, &mut health);
        while let Some(frame) = assembler.pop() {
            tracker.priors(frame.time_ns, &mut priors);
            background.foreground(&frame, &priors, &mut health, &mut points);
            clusterer.clusters(&points, &priors, &mut clusters);
            measurer.detections(&points, &clusters, &priors, &mut detections);
            tracker.update(&Views::of(&frame), &detections, &mut tracks);
            frames += 1;
            for cluster in clusters.iter().filter(|_| frames.is_multiple_of(EVERY)) {
                let known = !samples.len().is_multiple_of(UNKNOWN_EVERY);
                let priors: &[Prior] = if known { &priors } else { &[] };
                let view = measurer.pose_view(&points, cluster, priors);
                let late: i64 = cluster.iter().map(|&i| points[i as usize].time_ns - frame.time_ns).sum();
                let time_ns = frame.time_ns + late / cluster.len() as i64;
                samples.extend(seen_of(&walkers, time_ns, view, known));
            }
        }
    }
    Ok(samples)
}

/// The view with the pose of whom it is of at that time, where it is anybody's; `known` where his track was.
fn seen_of(walkers: &[Walker], time_ns: i64, view: PoseView, known: bool) -> Option<Seen> {
    let off_m = |state: &PersonState| state.position_m - view.base_m;
    let (walker, own) = walkers
        .iter()
        .filter_map(|walker| Some((walker, walker.state_at(time_ns)?)))
        .min_by(|(_, a), (_, b)| off_m(a).length_squared().total_cmp(&off_m(b).length_squared()))
        .filter(|(_, state)| off_m(state).length() < OWN_M)?;
    let walks = own.velocity_mps.length() > WALKS_FROM_MPS;
    Some(Seen {
        view,
        off_m: off_m(&own),
        heading_rad: (known && view.stands() && !walks).then_some(own.heading_rad),
        phase_rad: (!view.stands() && walks).then_some(own.phase_rad),
        hand_swing: (!view.stands()).then(|| walker.hand_swing_at(time_ns)).flatten(),
    })
}
