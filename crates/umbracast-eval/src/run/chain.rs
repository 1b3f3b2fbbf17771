//! The whole chain in memory: runs a simulated scene's packets through the pipelines of one or several modes, scores
//! the results and drops them. Scenes run in parallel. Results are in scene order and do not depend on the threads.

use std::time::Duration;

use rayon::prelude::*;
use umbracast::forecast::Weights;
use umbracast::lidar::{Assembler, Packet};
use umbracast::{Config, Error, Frame, Health, Pipeline, Site};
use umbracast_io::rows;
use umbracast_sim::body::Bodies;
use umbracast_sim::crowd::{self, Crowd, Ground, Preset};
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

use crate::oracle::ladder::{self, SceneLadder};
use crate::run::scene_score::{ModeRun, SceneScore, score_scene};
use crate::score::scene::{SceneRun, SceneTruth, note_truth};

/// Revolutions without people from which the background is learned.
pub const EMPTY_FRAMES: u64 = 20;
/// Radius of the circle on which people start (paper, section V-A).
pub const CIRCLE_M: f64 = 12.5;
/// Seeds of test scenes start here (docs/CONVENTIONS.md).
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
    /// The ladder of oracles as well: about as long as a mode.
    pub ladder: bool,
}

/// One scene.
#[derive(Debug, Clone)]
pub struct SceneSpec {
    /// What it is pooled with in the tables.
    pub group: String,
    /// Of the people's trajectories, bodies and sensors.
    pub seed: u64,
    /// Who walks.
    pub people: People,
    /// In what bodies.
    pub bodies: Bodies,
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
        /// Where.
        ground: Ground,
    },
    /// Trajectories from elsewhere.
    Replayed(Crowd),
}

impl SceneSpec {
    /// Everybody's trajectory.
    pub fn crowd(&self) -> Crowd {
        match &self.people {
            People::Replayed(crowd) => crowd.clone(),
            People::Drawn { preset, people, ground } => crowd::drawn(*preset, *people, ground, self.seed),
        }
    }
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
    /// The oracles' sums, where asked for.
    pub ladder: Option<SceneLadder>,
    /// Truth and one run a mode.
    pub kept: Option<(SceneTruth, Vec<SceneRun>)>,
}

/// `scenes` scenes of each preset, on the paper's circle. Seeds count on from preset to preset, so that no two scenes share bodies and
/// noise: scene i of preset k has the seed `first_seed` + k * `scenes` + i.
pub fn drawn_scenes(presets: &[Preset], scenes: usize, people: usize, first_seed: u64) -> Vec<SceneSpec> {
    scenes_on(&Ground::circle(CIRCLE_M), presets, scenes, people, first_seed)
}

/// The same in the hall of a site: across the circle where it fits, else over the floor.
///
/// # Errors
/// A hall that has no room for so many.
pub fn scenes_in(
    site: &Site,
    presets: &[Preset],
    scenes: usize,
    people: usize,
    first_seed: u64,
) -> Result<Vec<SceneSpec>, Error> {
    let in_site = |error: Error| error.within(format!("site {:?}", site.name));
    let ground = Ground::of(site, CIRCLE_M).map_err(in_site)?;
    ground.hold(people).map_err(in_site)?;
    Ok(scenes_on(&ground, presets, scenes, people, first_seed))
}

fn scenes_on(
    ground: &Ground,
    presets: &[Preset],
    scenes: usize,
    people: usize,
    first_seed: u64,
) -> Vec<SceneSpec> {
    let of_presets = presets.iter().flat_map(|&preset| std::iter::repeat_n(preset, scenes));
    let scene = |(seed, preset): (u64, Preset)| SceneSpec {
        group: preset.name().to_owned(),
        seed,
        people: People::Drawn { preset, people, ground: ground.clone() },
        bodies: Bodies::default(),
    };
    (first_seed..).zip(of_presets).map(scene).collect()
}

/// Runs and scores every scene. `progress` is called after each frame, from any thread.
///
/// # Errors
/// A setting that cannot work.
pub fn run(spec: &Spec, progress: impl Fn(Progress) + Sync) -> Result<Vec<SceneResult>, Error> {
    let chain = Chain::new(spec)?;
    let scenes = (0..spec.scenes.len()).into_par_iter();
    // One by one, so that no thread idles while another has a heap of scenes left.
    scenes.with_max_len(1).map(|index| chain.scene(index, &progress)).collect()
}

/// The frames of the hall without people; `seed` is that of the sensors' noise.
///
/// # Errors
/// A sensor that cannot be simulated.
pub fn empty_frames(site: &Site, seed: u64) -> Result<Vec<Frame>, Error> {
    let mut assembler = Assembler::new(site)?;
    let mut health = Health::default();
    for packets in Scene::empty(site, seed, EMPTY_FRAMES)? {
        push(&mut assembler, &packets, &mut health);
    }
    assembler.finish();
    Ok(std::iter::from_fn(|| assembler.pop()).collect())
}

/// What all scenes share: the hall as the sensors see it, and as every mode has learned it, with nobody in it.
#[derive(Debug)]
pub struct Chain<'a> {
    spec: &'a Spec,
    sensors: Sensors,
    /// One a mode, before its first frame.
    pipelines: Vec<Pipeline>,
}

impl<'a> Chain<'a> {
    /// Traces the hall.
    ///
    /// # Errors
    /// No mode, modes with different sites, a sensor that cannot be simulated, a setting that cannot work.
    pub fn new(spec: &'a Spec) -> Result<Self, Error> {
        let Some(first) = spec.configs.first() else {
            return Err(Error::new("modes: expected one at least, found none"));
        };
        if let Some(other) = spec.configs.iter().find(|config| config.site != first.site) {
            let (mode, site) = (other.mode.name(), &other.site.name);
            return Err(Error::new(format!(
                "site: expected the same for every mode, found {site} for {mode}"
            )));
        }
        let empty = empty_frames(&first.site, TEST_SEEDS)?;
        let learned = |config| {
            let mut pipeline = Pipeline::new(config, spec.weights.as_ref())?;
            empty.iter().for_each(|frame| pipeline.learn_empty(frame));
            Ok(pipeline)
        };
        let pipelines = spec.configs.iter().map(learned).collect::<Result<_, Error>>()?;
        Ok(Self { spec, sensors: Sensors::new(&first.site, TEST_SEEDS)?, pipelines })
    }

    /// Runs and scores one scene of the specification; `progress` is called after each frame.
    ///
    /// # Errors
    /// A setting that cannot work.
    pub fn scene(&self, index: usize, progress: &impl Fn(Progress)) -> Result<SceneResult, Error> {
        let (spec, scene_spec, site) = (self.spec, &self.spec.scenes[index], &self.spec.configs[0].site);
        let Played { scene, truth, lanes, assembled } = self.play(index, progress, &|| Duration::ZERO)?;
        let mode_run = |(lane, config)| lane_run(lane, config, &assembled);
        let runs: Vec<ModeRun> = lanes.iter().zip(&spec.configs).map(mode_run).collect();
        let (weights, walkers) = (spec.weights.as_ref(), Some(scene.walkers()));
        let number = index as u32;
        let score = score_scene(number, &scene_spec.group, &truth, &runs, weights, walkers)?;
        let ladder = spec.ladder.then(|| ladder::climb(&scene, &truth, site, scene_spec.seed));
        let kept =
            (spec.keep == Some(index)).then(|| (truth, lanes.into_iter().map(|lane| lane.rows).collect()));
        Ok(SceneResult { score, ladder, kept })
    }

    /// Runs one scene without scoring it. `clock` tells how long each step of a pipeline took.
    ///
    /// # Errors
    /// A sensor that cannot be simulated.
    pub(crate) fn play(
        &self,
        index: usize,
        progress: &impl Fn(Progress),
        clock: &impl Fn() -> Duration,
    ) -> Result<Played, Error> {
        let (scene_spec, site) = (&self.spec.scenes[index], &self.spec.configs[0].site);
        let scene = Scene::in_hall(scene_spec.crowd(), site, &self.sensors, scene_spec.seed);
        let mut scene = scene.with_bodies(&scene_spec.bodies);
        let mut assembler = Assembler::new(site)?;
        let mut assembled = Health::default();
        let mut lanes: Vec<Lane> = self.pipelines.iter().map(Lane::new).collect();
        let number = index as u32;
        let mut truth = SceneTruth::default();
        while let Some(frame) = scene.next_frame() {
            note_truth(number, &frame, &mut truth);
            push(&mut assembler, &frame.packets, &mut assembled);
            let closed: Vec<Frame> = std::iter::from_fn(|| assembler.pop()).collect();
            lanes.iter_mut().for_each(|lane| lane.step(number, &closed, clock));
            progress(Progress { scene: index, frames_done: frame.index + 1, frames: scene.frames() });
        }
        assembler.finish();
        let closed: Vec<Frame> = std::iter::from_fn(|| assembler.pop()).collect();
        lanes.iter_mut().for_each(|lane| lane.step(number, &closed, clock));
        Ok(Played { scene, truth, lanes, assembled })
    }
}

/// A scene that was run, and what every mode said of it.
pub(crate) struct Played {
    scene: Scene,
    pub(crate) truth: SceneTruth,
    /// One a mode.
    pub(crate) lanes: Vec<Lane>,
    /// What was skipped before the pipelines.
    assembled: Health,
}

/// One mode's pipeline and what it has said.
pub(crate) struct Lane {
    pipeline: Pipeline,
    pub(crate) rows: SceneRun,
    health: Health,
    /// How long each frame took.
    pub(crate) times: Vec<Duration>,
}

impl Lane {
    /// Of a pipeline before its first frame.
    pub(crate) fn new(pipeline: &Pipeline) -> Self {
        Self {
            pipeline: pipeline.clone(),
            rows: SceneRun::default(),
            health: Health::default(),
            times: Vec::new(),
        }
    }

    pub(crate) fn step(&mut self, scene: u32, frames: &[Frame], clock: &impl Fn() -> Duration) {
        for frame in frames {
            let before = clock();
            let outcome = self.pipeline.step(frame);
            self.times.push(clock().saturating_sub(before));
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

/// Gives packets (one list a sensor) to an assembler as they would arrive: by time, sensors mixed.
pub fn push(assembler: &mut Assembler, packets: &[Vec<Packet>], health: &mut Health) {
    let of_sensor =
        |sensor: usize| (0..packets[sensor].len()).map(move |i| (packets[sensor][i].time_ns, sensor, i));
    let mut order: Vec<(i64, usize, usize)> = (0..packets.len()).flat_map(of_sensor).collect();
    order.sort_unstable();
    for (_, sensor, i) in order {
        assembler.push(sensor, &packets[sensor][i], health);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::run::scene_score::Predictor;
    use std::sync::atomic::{AtomicU64, Ordering};
    use umbracast::config::{BlockageMethod, BoxKind};
    use umbracast::geometry::DVec2;
    use umbracast::{Mode, STEP_NS};
    use umbracast_sim::body::kind::Kind;
    use umbracast_sim::crowd::Trajectory;

    /// `scenes` scenes of people who walk for so many frames; `at_m` gives the place of a person after so many steps of
    /// 10 ms.
    pub(crate) fn walk(scenes: u64, people: u32, frames: i32, at_m: impl Fn(f64, f64) -> DVec2) -> Spec {
        let trajectory = |person: u32| Trajectory {
            person,
            start_ns: 0,
            step_ns: 10_000_000,
            positions_m: (0..=10 * frames).map(|i| at_m(f64::from(person), f64::from(i))).collect(),
            arrived_ns: None,
            height_m: None,
        };
        let duration_ns = i64::from(frames) * STEP_NS;
        let crowd = Crowd { trajectories: (0..people).map(trajectory).collect(), duration_ns };
        let scene = |seed| SceneSpec {
            group: "walk".to_owned(),
            seed,
            people: People::Replayed(crowd.clone()),
            bodies: Bodies::default(),
        };
        Spec {
            configs: vec![Config::for_mode(Mode::Default)],
            weights: None,
            scenes: (0..scenes).map(scene).collect(),
            keep: None,
            ladder: false,
        }
    }

    /// Three people who walk side by side for 2.5 s.
    fn spec(scenes: u64) -> Spec {
        Spec { keep: Some(0), ..walk(scenes, 3, 25, |person, i| DVec2::new(0.01 * i, 1.5 * person)) }
    }

    fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
    }

    #[test]
    fn scores_do_not_depend_on_the_threads() {
        let spec = spec(2);
        let scores = [1, 2].map(|threads| with_threads(threads, || run(&spec, |_| {}).unwrap()));
        assert_eq!(scores[0].len(), 2);
        for (one, two) in scores[0].iter().zip(&scores[1]) {
            assert_eq!(one.score, two.score);
            assert_eq!(one.kept, two.kept);
        }
        assert_ne!(scores[0][0].score.modes, scores[0][1].score.modes, "seeds differ");
    }

    #[test]
    fn three_people_in_the_open_are_followed_and_their_truth_is_kept() {
        let reported = AtomicU64::new(0);
        let results = run(&spec(1), |_| {
            reported.fetch_add(1, Ordering::Relaxed);
        })
        .unwrap();
        assert_eq!(reported.into_inner(), 25);
        let (truth, runs) = results[0].kept.as_ref().unwrap();
        assert_eq!(truth.people.len(), 3 * 25);
        assert_eq!(runs.len(), 1);
        let mode = &results[0].score.modes[0];
        assert_eq!(mode.displacement.instances, 3 * 7, "instants 9 to 15");
        assert!(mode.displacement.tracked_share().unwrap() > 0.99);
        assert!(mode.displacement.mean_m(1).unwrap() < 0.2, "{:?}", mode.displacement.mean_m(1));
        assert!(mode.health.is_clean(), "{:?}", mode.health);
    }

    #[test]
    fn the_bodies_asked_for_walk() {
        let mut spec = spec(1);
        spec.scenes[0].bodies = Bodies::new(vec![(Kind::Wheelchair, 1.0)], None).unwrap();
        let results = run(&spec, |_| {}).unwrap();
        let (truth, _) = results[0].kept.as_ref().unwrap();
        assert!(truth.people.iter().all(|row| row.height_m < 1.5), "who sits is lower");
    }

    #[test]
    fn algorithm_1_cast_from_the_rows_is_what_the_run_cast() {
        for (person_box, predictor) in [(BoxKind::Aabb, Predictor::Aabb), (BoxKind::Obb, Predictor::Obb)] {
            let mut spec = spec(1);
            spec.configs[0].blockage.method = BlockageMethod::Algorithm1;
            spec.configs[0].blockage.person_box = person_box;
            // One behind the other, in line with the access point `side`.
            let People::Replayed(crowd) = &mut spec.scenes[0].people else { unreachable!() };
            let positions_m = crowd.trajectories.iter_mut().flat_map(|walk| &mut walk.positions_m);
            positions_m.for_each(|at| *at = DVec2::new(at.x - at.y, 0.0));
            let said = run(&spec, |_| {}).unwrap().remove(0).score.said;
            let of = |who| &said.iter().find(|said| said.predictor == who).unwrap().access_points;
            assert_eq!(of(predictor), of(Predictor::Run));
            assert!(of(predictor)[0].windows[8].all.true_positive > 0, "nobody is ever in the way");
        }
    }

    #[test]
    fn modes_with_different_sites_are_refused() {
        let mut spec = spec(1);
        let mut other = spec.configs[0].clone();
        other.site.name = "elsewhere".to_owned();
        spec.configs.push(other);
        let message = run(&spec, |_| {}).unwrap_err().to_string();
        assert!(message.contains("elsewhere"), "{message}");
    }

    #[test]
    fn seeds_count_on_from_preset_to_preset() {
        let scenes = drawn_scenes(&[Preset::Orca03, Preset::Orca06], 2, 10, TEST_SEEDS);
        let named: Vec<_> = scenes.iter().map(|s| (s.group.as_str(), s.seed)).collect();
        assert_eq!(
            named,
            [("orca-03", 200_000), ("orca-03", 200_001), ("orca-06", 200_002), ("orca-06", 200_003)]
        );
    }
}
