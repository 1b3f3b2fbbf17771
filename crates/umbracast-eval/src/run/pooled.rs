//! The scores: sums of all scenes pooled, by preset and together, with intervals by bootstrap over recordings.

use serde::{Deserialize, Serialize};
use umbracast::{Health, Mode, STEPS, Site};

use crate::oracle::ladder::{self, LadderRow, SceneLadder};
use crate::run::chain::SceneResult;
use crate::run::scene_score::{Predictor, SceneScore};
use crate::score::bootstrap::{Bootstrap, Pooled, interval};
use crate::score::counts::Counts;
use crate::score::displacement::Displacement;
use crate::score::link_counts::{Bin, LinkCounts};
use crate::score::stage1::Stage1;
use crate::score::times::{TimeCounts, Times};

/// The group of all scenes, where there are several presets.
pub const ALL: &str = "all";

/// A score and where it lies in 95 % of resamples of the recordings. Null where it is not defined.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Of all scenes pooled.
    pub value: Option<f64>,
    /// Lower and upper end; null with fewer than five recordings.
    pub interval: Option<[f64; 2]>,
}

/// Everything that tables, figures and the report show.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Scores {
    /// One a preset, in the order of the scenes, then [`ALL`] where there are several.
    pub groups: Vec<Group>,
}

/// Scenes that are pooled.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// The preset, the file replayed, or [`ALL`].
    pub name: String,
    /// How many scenes.
    pub scenes: usize,
    /// How many recordings they replay: as many as scenes, unless one was replayed several times.
    pub recordings: usize,
    /// Frames of all of them.
    pub frames: u64,
    /// Stage 3: one a predictor and access point.
    pub links: Vec<LinkScores>,
    /// Stages 1 and 2: one a mode.
    pub modes: Vec<ModeScores>,
    /// Mean displacement of constant velocity from the true state, by step, metres.
    pub constant_velocity_m: Vec<Option<f64>>,
    /// What oracles reach; empty unless asked for.
    pub ladder: Vec<LadderRow>,
}

/// Stage 3 of one predictor at one access point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinkScores {
    /// Null for baselines that need no mode.
    pub mode: Option<Mode>,
    /// Who.
    pub predictor: &'static str,
    /// The access point's name.
    pub access_point: String,
    /// Windows 1..=9.
    pub windows: Vec<WindowScores>,
}

/// Stage 3 for one window.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WindowScores {
    /// How many steps.
    pub w: usize,
    /// True and false, positive and negative.
    pub counts: Counts,
    /// The same of the instances in sight at `t_e`.
    pub onset_counts: Counts,
    /// Share of instances blocked.
    pub base_rate: Estimate,
    /// Share said rightly.
    pub accuracy: Estimate,
    /// Of those said blocked, the share that was.
    pub precision: Estimate,
    /// Of those blocked, the share that was said.
    pub recall: Estimate,
    /// Harmonic mean of the two.
    pub f1: Estimate,
    /// The same over instances in sight at `t_e`.
    pub onset_f1: Estimate,
    /// Average precision.
    pub auprc: Option<f64>,
    /// Mean squared error of the probability.
    pub brier: Option<f64>,
    /// Expected calibration error, 15 bins.
    pub ece: Option<f64>,
    /// Of onsets warned of: median time from the start of the unbroken warning to the onset.
    pub lead_median_s: Option<f64>,
    /// Share of onsets warned of.
    pub lead_warned: Option<f64>,
    /// For the reliability diagram: of the modes themselves, empty for all others.
    pub bins: Vec<Bin>,
}

/// Stages 1 and 2 of one mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeScores {
    /// Whose.
    pub mode: Mode,
    /// Share of persons in frames with a confirmed track within the gate.
    pub recall: Estimate,
    /// Share of confirmed tracks in frames with a person.
    pub precision: Estimate,
    /// CLEAR.
    pub mota: Estimate,
    /// Identity.
    pub idf1: Estimate,
    /// Higher-order tracking accuracy, similarity 1 - d / 1 m.
    pub hota: Estimate,
    /// Persons whose track changed, a scene.
    pub switches_per_scene: Estimate,
    /// Of the 2-D position error of matches.
    pub position_rmse_m: Estimate,
    /// Of the 2-D velocity error of matches.
    pub velocity_rmse_mps: Estimate,
    /// [`Stage1::position_nees`].
    pub position_nees: Estimate,
    /// [`Stage1::velocity_nees`].
    pub velocity_nees: Estimate,
    /// Recall of persons with no, 1 to 5, 6 and more returns.
    pub recall_by_returns: [Option<f64>; 3],
    /// Share of stage-3 instances' persons with a confirmed track.
    pub tracked_share: Estimate,
    /// Share of them whose displacement is scored: tracked, and unarrived through the last step.
    pub scored_share: Option<f64>,
    /// Mean displacement by step, metres (Table I).
    pub displacement_m: Vec<Estimate>,
    /// Mean over the steps.
    pub displacement_mean_m: Estimate,
    /// Mean negative log-likelihood by step, nats.
    pub nll: Vec<Option<f64>>,
    /// Shares within the 50 and the 90 % region by step.
    pub coverage: Vec<Option<[f64; 2]>>,
    /// When links are blocked and clear again, one an access point, in the site's order.
    pub times: Vec<[TimeScores; 3]>,
    /// What was skipped, all scenes.
    pub health: Health,
}

/// Times reported by their quantiles: of the onset of a blockage, or of its end.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TimeScores {
    /// Links of which a time was reported.
    pub reported: u64,
    /// Share of them between the 10 and the 90 % quantile.
    pub coverage: Option<f64>,
    /// Mean size of the 50 % quantile's error, seconds.
    pub mean_error_s: Option<f64>,
    /// The middle one.
    pub median_error_s: Option<f64>,
}

impl TimeScores {
    fn of(counts: &TimeCounts) -> Self {
        Self {
            reported: counts.reported,
            coverage: counts.coverage(),
            mean_error_s: counts.mean_error_s(),
            median_error_s: counts.median_error_s(),
        }
    }
}

/// The scores of a run in memory, ladder and all.
pub fn score(results: &[SceneResult], site: &Site) -> Scores {
    let names: Vec<String> = site.access_points.iter().map(|ap| ap.name.clone()).collect();
    let scenes: Vec<&SceneScore> = results.iter().map(|result| &result.score).collect();
    let mut scores = pool(&scenes, &names);
    for group in &mut scores.groups {
        let members = results.iter().filter(|result| group.name == ALL || result.score.group == group.name);
        let ladders: Vec<&SceneLadder> = members.filter_map(|result| result.ladder.as_ref()).collect();
        if !ladders.is_empty() {
            group.ladder = ladder::rows(&ladders, site);
        }
    }
    scores
}

/// Pools scenes. `access_points` are the site's names.
pub fn pool(scenes: &[&SceneScore], access_points: &[String]) -> Scores {
    let mut names: Vec<&str> = Vec::new();
    for scene in scenes {
        if !names.contains(&scene.group.as_str()) {
            names.push(&scene.group);
        }
    }
    let of = |name: &&str| {
        let members: Vec<_> = scenes.iter().copied().filter(|scene| scene.group == **name).collect();
        group(name, &members, access_points)
    };
    let mut groups: Vec<Group> = names.iter().map(of).collect();
    if names.len() > 1 {
        groups.push(group(ALL, scenes, access_points));
    }
    Scores { groups }
}

impl Scores {
    /// The scenes that headline figures are of: all of them.
    pub fn headline(&self) -> Option<&Group> {
        self.groups.last()
    }
}

impl LinkScores {
    /// True when both said yes and no alike, as far as counts tell.
    pub fn same_counts(&self, other: &Self) -> bool {
        let counts = |scores: &WindowScores| (scores.counts, scores.onset_counts);
        self.windows.iter().map(counts).eq(other.windows.iter().map(counts))
    }
}

impl Group {
    /// The scores of a predictor at an access point.
    pub fn link(&self, mode: Option<Mode>, predictor: Predictor, access_point: &str) -> Option<&LinkScores> {
        self.links.iter().find(|links| {
            links.mode == mode && links.predictor == predictor.name() && links.access_point == access_point
        })
    }

    /// The names of the access points, in the site's order.
    pub fn access_points(&self) -> Vec<&str> {
        let mut names = Vec::new();
        for links in &self.links {
            if !names.contains(&links.access_point.as_str()) {
                names.push(&links.access_point);
            }
        }
        names
    }
}

fn group(name: &str, scenes: &[&SceneScore], access_points: &[String]) -> Group {
    let recordings: Vec<u64> = scenes.iter().map(|scene| scene.recording).collect();
    let bootstrap = Bootstrap::new(&recordings);
    let mut links = Vec::new();
    let mut modes = Vec::new();
    let mut constant_velocity_m = Vec::new();
    if let Some(first) = scenes.first() {
        for (i, said) in first.said.iter().enumerate() {
            for (a, access_point) in access_points.iter().enumerate() {
                let of_scenes: Vec<&LinkCounts> =
                    scenes.iter().filter_map(|scene| scene.said.get(i)?.access_points.get(a)).collect();
                let mut windows = windows(&bootstrap, &of_scenes);
                let is_cause = Predictor::CAUSES.iter().any(|(cause, _)| *cause == said.predictor);
                if said.predictor != Predictor::Run && !is_cause {
                    windows.iter_mut().for_each(|scores| scores.bins.clear());
                }
                let ever = windows.iter().any(|scores| scores.counts.recall().is_some());
                if is_cause && !ever {
                    continue;
                }
                links.push(LinkScores {
                    mode: said.mode,
                    predictor: said.predictor.name(),
                    access_point: access_point.clone(),
                    windows,
                });
            }
        }
        // Where nothing but others blocks, anything is no news.
        let [own, hall, any] = Predictor::CAUSES.map(|(cause, _)| cause.name());
        if !links.iter().any(|of: &LinkScores| of.predictor == own || of.predictor == hall) {
            links.retain(|of| of.predictor != any);
        }
        modes = (0..first.modes.len()).map(|m| mode_scores(&bootstrap, scenes, m)).collect();
        let pooled = sum(scenes.iter().map(|scene| &scene.constant_velocity));
        constant_velocity_m = (1..=STEPS).map(|h| pooled.mean_m(h)).collect();
    }
    let frames = scenes.iter().map(|scene| scene.frames).sum();
    Group {
        name: name.to_owned(),
        scenes: scenes.len(),
        recordings: bootstrap.recordings(),
        frames,
        links,
        modes,
        constant_velocity_m,
        ladder: Vec::new(),
    }
}

fn windows(bootstrap: &Bootstrap, scenes: &[&LinkCounts]) -> Vec<WindowScores> {
    let pooled = LinkCounts::pooled(scenes);
    let of = |i: usize| {
        let (counts, leads) = (&pooled.windows[i], &pooled.leads[i]);
        let all = Spread::of(bootstrap, scenes.iter().map(|scene| scene.windows[i].all));
        let onset = Spread::of(bootstrap, scenes.iter().map(|scene| scene.windows[i].onset));
        WindowScores {
            w: i + 1,
            counts: counts.all,
            onset_counts: counts.onset,
            base_rate: all.estimate(Counts::base_rate),
            accuracy: all.estimate(Counts::accuracy),
            precision: all.estimate(Counts::precision),
            recall: all.estimate(Counts::recall),
            f1: all.estimate(Counts::f1),
            onset_f1: onset.estimate(Counts::f1),
            auprc: counts.auprc(),
            brier: counts.brier(),
            ece: counts.ece(),
            lead_median_s: leads.median_s(),
            lead_warned: leads.warned_share(),
            bins: counts.bins.to_vec(),
        }
    };
    (0..STEPS).map(of).collect()
}

fn mode_scores(bootstrap: &Bootstrap, scenes: &[&SceneScore], m: usize) -> ModeScores {
    let stage1 = Spread::of(bootstrap, scenes.iter().map(|scene| scene.modes[m].stage1));
    let displacement = Spread::of(bootstrap, scenes.iter().map(|scene| scene.modes[m].displacement));
    let (tracks, forecasts) = (&stage1.pooled, &displacement.pooled);
    let of_tracks = |score: fn(&Stage1) -> Option<f64>| stage1.estimate(score);
    let mut health = Health::default();
    scenes.iter().for_each(|scene| health.add(&scene.modes[m].health));
    let times = |a: usize| {
        let pooled = Times::pooled(scenes.iter().filter_map(|scene| scene.modes[m].times.get(a)));
        [&pooled.onset, &pooled.duration, &pooled.again].map(TimeScores::of)
    };
    ModeScores {
        mode: scenes[0].modes[m].mode,
        times: (0..scenes[0].modes[m].times.len()).map(times).collect(),
        recall: of_tracks(Stage1::recall),
        precision: of_tracks(Stage1::precision),
        mota: of_tracks(Stage1::mota),
        idf1: of_tracks(Stage1::idf1),
        hota: of_tracks(Stage1::hota),
        switches_per_scene: of_tracks(Stage1::switches_per_scene),
        position_rmse_m: of_tracks(Stage1::position_rmse_m),
        velocity_rmse_mps: of_tracks(Stage1::velocity_rmse_mps),
        position_nees: of_tracks(Stage1::position_nees),
        velocity_nees: of_tracks(Stage1::velocity_nees),
        recall_by_returns: tracks.recall_by_returns(),
        tracked_share: displacement.estimate(Displacement::tracked_share),
        scored_share: forecasts.scored_share(),
        displacement_m: (1..=STEPS).map(|h| displacement.estimate(|d| d.mean_m(h))).collect(),
        displacement_mean_m: displacement.estimate(Displacement::average_m),
        nll: (1..=STEPS).map(|h| forecasts.nll(h)).collect(),
        coverage: (1..=STEPS).map(|h| forecasts.coverage(h)).collect(),
        health,
    }
}

/// Sums of all scenes, and of every resample of them.
struct Spread<T> {
    pooled: T,
    resampled: Vec<T>,
}

impl<T: Pooled> Spread<T> {
    fn of(bootstrap: &Bootstrap, scenes: impl Iterator<Item = T>) -> Self {
        let scenes: Vec<T> = scenes.collect();
        Self { pooled: sum(&scenes), resampled: bootstrap.resampled(&scenes) }
    }

    fn estimate(&self, score: impl Fn(&T) -> Option<f64>) -> Estimate {
        Estimate { value: score(&self.pooled), interval: interval(&self.resampled, score) }
    }
}

fn sum<'a, T: Pooled + 'a>(sums: impl IntoIterator<Item = &'a T>) -> T {
    sums.into_iter().fold(T::default(), |all, one| all.plus(one, 1))
}
