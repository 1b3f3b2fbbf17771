//! The whole chain in memory: a simulated scene's packets through the pipelines of one or several modes, scored
//! and forgotten. Scenes run side by side; results stand in scene order and do not depend on the threads.

use rayon::prelude::*;
use umbracast::forecast::Weights;
use umbracast::lidar::{Assembler, Packet};
use umbracast::{Config, Error, Frame, Health, Pipeline, Site};
use umbracast_io::rows::{self, PeopleLinkRow, PeopleRow};
use umbracast_sim::crowd::{self, Crowd, Preset};
use umbracast_sim::scene::{Scene, SceneFrame};

use crate::scene::{SceneRun, SceneTruth};
use crate::score::{ModeRun, SceneScore, score_scene};

/// Revolutions without people from which the background is learned.
pub const EMPTY_FRAMES: u64 = 20;
/// Radius of the circle on which people start (paper, section V-A).
pub const CIRCLE_M: f64 = 12.5;
/// Seeds of test scenes start here (CONVENTIONS, "Who counts").
pub const TEST_SEEDS: u64 = 200_000;

/// What is to be run.
#[derive(Debug, Clone)]
pub struct Spec {
    /// One a mode; all with the same site.
    pub configs: Vec<Config>,
    /// The network's, for modes that forecast with it.
    pub weights: Option<Weights>,
    /// The scenes.
    pub scenes: Vec<SceneSpec>,
    /// The index of the scene whose rows are kept, for the figures that show one scene.
    pub keep: Option<usize>,
}

/// One scene.
#[derive(Debug, Clone)]
pub struct SceneSpec {
    /// What it is pooled with in the tables.
    pub group: String,
    /// Of the people's ways, bodies and sensors.
    pub seed: u64,
    /// Who walks.
    pub people: People,
}

/// Who walks.
#[derive(Debug, Clone)]
pub enum People {
    /// A crowd drawn from the scene's seed.
    Drawn {
        /// How they walk.
        preset: Preset,
        /// How many they are.
        people: usize,
    },
    /// Trajectories from elsewhere.
    Replayed(Crowd),
}

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Index of the scene.
    pub scene: usize,
    /// Frames of it that are done.
    pub frames_done: u64,
    /// Frames it has.
    pub frames: u64,
}

/// A scene's scores, and its rows where they were to be kept.
#[derive(Debug, Clone)]
pub struct SceneResult {
    /// The sums.
    pub score: SceneScore,
    /// Truth and one run a mode.
    pub kept: Option<(SceneTruth, Vec<SceneRun>)>,
}

/// `scenes` test scenes of each preset; scene i of a preset has the seed `first_seed` + i.
pub fn drawn_scenes(presets: &[Preset], scenes: usize, people: usize, first_seed: u64) -> Vec<SceneSpec> {
    let of = |preset: Preset| {
        (0..scenes as u64).map(move |i| SceneSpec {
            group: preset.name().to_owned(),
            seed: first_seed + i,
            people: People::Drawn { preset, people },
        })
    };
    presets.iter().flat_map(|&preset| of(preset)).collect()
}

/// Runs and scores every scene. `progress` is called after each frame, from any thread.
///
/// # Errors
/// A setting that cannot work.
pub fn run(spec: &Spec, progress: impl Fn(Progress) + Sync) -> Result<Vec<SceneResult>, Error> {
    let Some(first) = spec.configs.first() else {
        return Err(Error::new("modes: expected one at least, found none"));
    };
    if let Some(other) = spec.configs.iter().find(|config| config.site != first.site) {
        let (mode, site) = (other.mode.name(), &other.site.name);
        return Err(Error::new(format!("site: expected the same for every mode, found {site} for {mode}")));
    }
    let empty = empty_frames(&first.site)?;
    let scene = |(index, scene_spec): (usize, &SceneSpec)| {
        let told = |frames_done, frames| progress(Progress { scene: index, frames_done, frames });
        run_scene(spec, index, scene_spec, &empty, &told)
    };
    spec.scenes.par_iter().enumerate().map(scene).collect()
}

/// The frames of the hall without people.
///
/// # Errors
/// A sensor that cannot be simulated.
pub fn empty_frames(site: &Site) -> Result<Vec<Frame>, Error> {
    let mut assembler = Assembler::new(site)?;
    let mut health = Health::default();
    for packets in Scene::empty(site, TEST_SEEDS, EMPTY_FRAMES)? {
        push(&mut assembler, &packets, &mut health);
    }
    assembler.finish();
    Ok(std::iter::from_fn(|| assembler.pop()).collect())
}

fn run_scene(
    spec: &Spec,
    index: usize,
    scene_spec: &SceneSpec,
    empty: &[Frame],
    progress: &impl Fn(u64, u64),
) -> Result<SceneResult, Error> {
    let site = &spec.configs[0].site;
    let mut scene = Scene::new(crowd_of(scene_spec), site, scene_spec.seed)?;
    let mut assembler = Assembler::new(site)?;
    let mut health = Health::default();
    let mut lanes = Vec::new();
    for config in &spec.configs {
        let mut pipeline = Pipeline::new(config, spec.weights.as_ref())?;
        empty.iter().for_each(|frame| pipeline.learn_empty(frame));
        lanes.push(Lane { pipeline, rows: SceneRun::default(), health: Health::default() });
    }
    let number = index as u32;
    let mut truth = SceneTruth::default();
    while let Some(frame) = scene.next_frame() {
        note_truth(number, &frame, &mut truth);
        push(&mut assembler, &frame.packets, &mut health);
        let closed: Vec<Frame> = std::iter::from_fn(|| assembler.pop()).collect();
        lanes.iter_mut().for_each(|lane| lane.step(number, &closed));
        progress(frame.index + 1, scene.frames());
    }
    assembler.finish();
    let closed: Vec<Frame> = std::iter::from_fn(|| assembler.pop()).collect();
    lanes.iter_mut().for_each(|lane| lane.step(number, &closed));
    let mode_run = |(lane, config)| lane_run(lane, config, &health);
    let runs: Vec<ModeRun> = lanes.iter().zip(&spec.configs).map(mode_run).collect();
    let score =
        score_scene(number, &scene_spec.group, &truth, &runs, spec.weights.as_ref(), Some(scene.walkers()))?;
    let kept = (spec.keep == Some(index)).then(|| (truth, lanes.into_iter().map(|lane| lane.rows).collect()));
    Ok(SceneResult { score, kept })
}

/// One mode's pipeline and what it has said.
struct Lane {
    pipeline: Pipeline,
    rows: SceneRun,
    health: Health,
}

impl Lane {
    fn step(&mut self, scene: u32, frames: &[Frame]) {
        for frame in frames {
            let outcome = self.pipeline.step(frame);
            rows::of_outcome(scene, outcome, &mut self.rows.tracks, &mut self.rows.links);
            self.health = outcome.health;
        }
    }
}

fn lane_run<'a>(lane: &'a Lane, config: &'a Config, assembled: &Health) -> ModeRun<'a> {
    let mut health = lane.health;
    health.add(assembled);
    ModeRun { config, rows: &lane.rows, health }
}

fn crowd_of(spec: &SceneSpec) -> Crowd {
    match &spec.people {
        People::Replayed(crowd) => crowd.clone(),
        People::Drawn { preset: Preset::Mixed, people } => crowd::mixed::crowd(*people, CIRCLE_M, spec.seed),
        People::Drawn { preset, people } => crowd::circle_crossing(*preset, *people, CIRCLE_M, spec.seed),
    }
}

/// As they would arrive: by time, sensors mixed.
fn push(assembler: &mut Assembler, packets: &[Vec<Packet>], health: &mut Health) {
    let of_sensor = |sensor: usize| (0..packets[sensor].len()).map(move |i| (packets[sensor][i].time_ns, sensor, i));
    let mut order: Vec<(i64, usize, usize)> = (0..packets.len()).flat_map(of_sensor).collect();
    order.sort_unstable();
    for (_, sensor, i) in order {
        assembler.push(sensor, &packets[sensor][i], health);
    }
}

/// The rows of a frame's truth.
pub fn note_truth(scene: u32, frame: &SceneFrame, truth: &mut SceneTruth) {
    let (number, time_ns) = (frame.index, frame.time_ns);
    truth.people.extend(frame.people.iter().map(|p| PeopleRow {
        scene,
        frame: number,
        time_ns,
        person: p.person,
        x_m: p.state.position_m.x,
        y_m: p.state.position_m.y,
        vx_mps: p.state.velocity_mps.x,
        vy_mps: p.state.velocity_mps.y,
        heading_rad: p.state.heading_rad,
        height_m: p.state.height_m,
        arrived: p.arrived,
        returns: p.returns,
    }));
    truth.links.extend(frame.links.iter().map(|link| PeopleLinkRow {
        scene,
        frame: number,
        time_ns,
        access_point: link.access_point as u32,
        person: link.person,
        blocked: link.blocked,
        static_blocked: link.static_blocked,
        self_blocked: link.self_blocked,
    }));
}
