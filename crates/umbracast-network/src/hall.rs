//! A hall with its sensors, in which people are seen and followed.

use umbracast::forecast::Weights;
use umbracast::lidar::Assembler;
use umbracast::{Config, Error, Health, Mode, Pipeline};
use umbracast_eval::run::chain::{CIRCLE_M, empty_frames, push};
use umbracast_sim::body::Walker;
use umbracast_sim::crowd::{Ground, Preset, Stroll};
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

use crate::foreseen::Followed;
use crate::truth::TICK_NS;

/// The seed of the empty hall's noise.
const EMPTY_SEED: u64 = 200_000;

/// Who walks.
#[derive(Debug, Clone, Copy)]
pub struct Crowd {
    /// How they walk.
    pub preset: Preset,
    /// How many they are.
    pub people: usize,
    /// How long, seconds.
    pub seconds: u64,
}

/// A hall with nobody in it, as it was learned.
#[derive(Debug)]
pub struct Hall {
    config: Config,
    ground: Ground,
    sensors: Sensors,
    ours: Pipeline,
    /// The paper's method with the network's weights, where it is asked for.
    paper: Option<(Config, Pipeline)>,
}

/// A scene as it was, and everybody whom the sensors saw in it.
#[derive(Debug)]
pub struct Seen {
    /// Everybody, in order of person.
    pub walkers: Vec<Walker>,
    /// Instants of the radio truth.
    pub ticks: usize,
    /// By frame, by our method.
    pub ours: Vec<Followed>,
    /// The same by the paper's; none where it is not asked for.
    pub paper: Vec<Followed>,
}

impl Hall {
    /// Learns the hall of a configuration. The paper's method is followed too where its weights are given.
    ///
    /// # Errors
    /// A sensor that cannot be simulated, a hall without room for a crowd.
    pub fn new(config: &Config, paper: Option<&Weights>) -> Result<Self, Error> {
        let empty = empty_frames(&config.site, EMPTY_SEED)?;
        let learned = |config: &Config, weights: Option<&Weights>| -> Result<Pipeline, Error> {
            // Links are worked out later, for each case: here nobody asks for them.
            let mut without_links = config.clone();
            without_links.site.access_points.clear();
            let mut pipeline = Pipeline::new(&without_links, weights)?;
            empty.iter().for_each(|frame| pipeline.learn_empty(frame));
            Ok(pipeline)
        };
        let papers = |weights: &Weights| -> Result<(Config, Pipeline), Error> {
            let config = Config { site: config.site.clone(), ..Config::for_mode(Mode::Paper) };
            let pipeline = learned(&config, Some(weights))?;
            Ok((config, pipeline))
        };
        Ok(Self {
            ground: Ground::of(&config.site, CIRCLE_M)?,
            sensors: Sensors::new(&config.site, EMPTY_SEED)?,
            ours: learned(config, None)?,
            paper: paper.map(papers).transpose()?,
            config: config.clone(),
        })
    }

    /// Of our method.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Of the paper's method, where it is asked for.
    pub fn paper(&self) -> Option<&Config> {
        self.paper.as_ref().map(|(config, _)| config)
    }

    /// Lets a crowd walk, and follows it.
    ///
    /// # Errors
    /// A hall without room for so many.
    pub fn see(&self, crowd: Crowd, seed: u64) -> Result<Seen, Error> {
        let site = &self.config.site;
        self.ground.hold(crowd.people)?;
        let walk = Stroll::new(crowd.preset, crowd.people, &self.ground, seed).leg(crowd.seconds);
        let ticks = (walk.duration_ns / TICK_NS) as usize;
        let mut scene = Scene::in_hall(walk, site, &self.sensors, seed);
        let (mut assembler, mut health) = (Assembler::new(site)?, Health::default());
        let mut ours = self.ours.clone();
        let mut papers = self.paper.as_ref().map(|(_, pipeline)| pipeline.clone());
        let mut seen = Seen { walkers: Vec::new(), ticks, ours: Vec::new(), paper: Vec::new() };
        while let Some(frame) = scene.next_frame() {
            push(&mut assembler, &frame.packets, &mut health);
            while let Some(frame) = assembler.pop() {
                let followed = |pipeline: &mut Pipeline| {
                    let outcome = pipeline.step(&frame);
                    Followed { time_ns: outcome.time_ns, tracks: outcome.tracks.clone() }
                };
                seen.ours.push(followed(&mut ours));
                seen.paper.extend(papers.as_mut().map(followed));
            }
        }
        seen.walkers = scene.walkers().to_vec();
        Ok(seen)
    }
}
