//! One scene under every policy, and what they come to.

use umbracast::decide::Decider;
use umbracast::{Config, Error, Pipeline};
use umbracast_eval::run::chain::{empty_frames, push};
use umbracast_sim::crowd::Crowd;
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

use crate::device::{Network, Tally, drive};
use crate::foreseen::Foreseen;
use crate::oracle::{best_of_all, oracle};
use crate::policy::{Advised, Policy, Reactive};
use crate::truth::{TICK_NS, Traces, TruthModel};

/// Policies begin when everybody has been followed for so long.
const BEGIN_TICKS: usize = 150;

/// A scene that was seen: its radio truth, and what each frame says of it.
#[derive(Debug)]
pub struct Played {
    /// Of every link, by truth model.
    pub traces: Vec<(TruthModel, Traces)>,
    /// Every frame.
    pub frames: Vec<Foreseen>,
}

/// Halls with nobody in them, learned once.
#[derive(Debug)]
pub struct Stage {
    sensors: Sensors,
    pipeline: Pipeline,
    config: Config,
}

/// The seed of the empty hall's noise.
const EMPTY_SEED: u64 = 200_000;

impl Stage {
    /// Of a configuration whose access points have radios.
    ///
    /// # Errors
    /// A sensor that cannot be simulated.
    pub fn new(config: &Config) -> Result<Self, Error> {
        let mut pipeline = Pipeline::new(config, None)?;
        empty_frames(&config.site, EMPTY_SEED)?.iter().for_each(|frame| pipeline.learn_empty(frame));
        Ok(Self { sensors: Sensors::new(&config.site, EMPTY_SEED)?, pipeline, config: config.clone() })
    }

    /// Plays a crowd.
    ///
    /// # Errors
    /// A sensor that cannot be simulated.
    pub fn play(&self, crowd: Crowd, seed: u64, models: &[TruthModel]) -> Result<Played, Error> {
        let site = &self.config.site;
        let ticks = (crowd.duration_ns / TICK_NS) as usize;
        let mut scene = Scene::in_hall(crowd, site, &self.sensors, seed);
        let own = site.ue.forward_m != 0.0 || site.ue.left_m != 0.0;
        let traces: Vec<_> = models
            .iter()
            .map(|&model| (model, Traces::of_scene(site, scene.walkers(), ticks, model, own)))
            .collect();
        let mut assembler = umbracast::lidar::Assembler::new(site)?;
        let (mut health, mut pipeline) = (umbracast::Health::default(), self.pipeline.clone());
        let mut frames = Vec::new();
        while let Some(frame) = scene.next_frame() {
            push(&mut assembler, &frame.packets, &mut health);
            while let Some(frame) = assembler.pop() {
                let outcome = pipeline.step(&frame).clone();
                frames.push(Foreseen::new(&outcome, &pipeline, &traces[0].1));
            }
        }
        Ok(Played { traces, frames })
    }
}

/// What all devices of a scene come to under a policy.
pub fn judge(
    network: &Network,
    config: &Config,
    traces: &Traces,
    frames: &[Foreseen],
    policy: Policy,
) -> Tally {
    let decider = Decider::new(&config.site);
    let mut sum = Tally::default();
    for person in 0..traces.people {
        let one = match policy {
            Policy::Stay => drive(network, traces, person, BEGIN_TICKS, |_| None),
            Policy::A3 { filter_s, trigger_s } | Policy::Conditional { filter_s, trigger_s } => {
                let conditional = matches!(policy, Policy::Conditional { .. });
                let mut reactive = Reactive::new(filter_s, trigger_s, conditional, network.radios.len());
                drive(network, traces, person, BEGIN_TICKS, |view| reactive.order(view))
            }
            _ => {
                let mut advised = Advised::new(frames, policy, decider.clone(), network, traces);
                drive(network, traces, person, BEGIN_TICKS, |view| advised.order(view))
            }
        };
        sum.add(&one);
    }
    sum
}

/// The bounds: the oracle, and all access points at once.
pub fn bounds(network: &Network, traces: &Traces) -> [Tally; 2] {
    let mut sums = [Tally::default(), Tally::default()];
    for person in 0..traces.people {
        sums[0].add(&oracle(network, traces, person, BEGIN_TICKS));
        sums[1].add(&best_of_all(network, traces, person, BEGIN_TICKS));
    }
    sums
}
