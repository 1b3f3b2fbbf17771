//! What each mechanism of the default mode is worth: the same scenes with all of them and with each left out alone.
//!
//! Both scores are of the same scenes, so the intervals are of their difference, by bootstrap over recordings.

use std::time::Duration;

use rayon::prelude::*;
use umbracast::config::Mechanism;
use umbracast::{Config, Error, Frame, Pipeline};
use umbracast_io::rows::PeopleRow;

use crate::run::chain::{Chain, Lane, SceneSpec, Spec};
use crate::run::scene_score::displacement;
use crate::score::bootstrap::{Bootstrap, Pooled, interval, quantile};
use crate::score::counts::Counts;
use crate::score::displacement::Displacement;
use crate::score::instances::instances;
use crate::score::labels;
use crate::score::link_counts::{Bin, ECE_BINS, WindowCounts, calibration_error};
use crate::score::links::Said;
use crate::score::matching::match_scene;
use crate::score::scene::{SceneRun, SceneTruth, TruthIndex};
use crate::score::stage1::Stage1;

mod table;

pub use table::{figure, to_csv, to_text};

/// The window whose scores are shown: 300 ms, as the paper's figure.
const WINDOW: usize = 3;

/// What the variants are tried on.
#[derive(Debug)]
pub struct DataSet {
    /// As the table calls it.
    pub name: String,
    /// The default mode on the site of the data.
    pub config: Config,
    /// The data.
    pub source: Source,
}

/// Where frames and truth come from.
#[derive(Debug)]
pub enum Source {
    /// Simulated sensors.
    Scenes(Vec<SceneSpec>),
    /// A real sensor, and people labelled in its clouds.
    Labelled {
        /// In the order of their times.
        frames: Vec<Frame>,
        /// Rows of frames that were labelled.
        labels: Vec<PeopleRow>,
    },
}

/// A figure that is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Figure {
    /// F1 within 300 ms at the first access point.
    F1,
    /// The same over links in sight now.
    OnsetF1,
    /// Expected calibration error of the same.
    Ece,
    /// Tracking accuracy.
    Mota,
    /// Identity F1.
    Idf1,
    /// Root mean square of the position error, metres.
    PositionM,
    /// Mean displacement at 900 ms, metres.
    DisplacementM,
}

impl Figure {
    /// All, in the order of the columns.
    pub const ALL: [Self; 7] =
        [Self::F1, Self::OnsetF1, Self::Ece, Self::Mota, Self::Idf1, Self::PositionM, Self::DisplacementM];

    /// As tables call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::F1 => "F1",
            Self::OnsetF1 => "onset F1",
            Self::Ece => "ECE",
            Self::Mota => "MOTA",
            Self::Idf1 => "IDF1",
            Self::PositionM => "position RMSE, m",
            Self::DisplacementM => "displacement at 900 ms, m",
        }
    }

    /// Whether more of it is better.
    pub fn more_is_better(self) -> bool {
        matches!(self, Self::F1 | Self::OnsetF1 | Self::Mota | Self::Idf1)
    }

    fn of(self, sums: &Sums) -> Option<f64> {
        match self {
            Self::F1 => sums.all.f1(),
            Self::OnsetF1 => sums.onset.f1(),
            Self::Ece => calibration_error(&sums.bins, sums.all.total()),
            Self::Mota => sums.stage1.mota(),
            Self::Idf1 => sums.stage1.idf1(),
            Self::PositionM => sums.stage1.position_rmse_m(),
            Self::DisplacementM => sums.displacement.mean_m(umbracast::STEPS),
        }
    }
}

/// One figure of one variant on one set of data.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Compared {
    /// Its value; `None` where it is not defined.
    pub value: Option<f64>,
    /// How much more it is than with everything.
    pub more: Option<f64>,
    /// 95 % interval of that; `None` with fewer than five recordings.
    pub interval: Option<[f64; 2]>,
}

/// One variant on one set of data.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What was left out; `None` for everything in.
    pub without: Option<Mechanism>,
    /// Index: that of [`Figure::ALL`].
    pub figures: [Compared; Figure::ALL.len()],
    /// Median time of a frame.
    pub frame: Duration,
}

/// All variants on one set of data.
#[derive(Debug, Clone, PartialEq)]
pub struct Ablated {
    /// The data's name.
    pub name: String,
    /// Scenes of it.
    pub scenes: usize,
    /// Everything in first, then one a mechanism.
    pub rows: Vec<Row>,
}

/// Sums of one variant over one scene.
#[derive(Debug, Clone, Default)]
struct Sums {
    recording: u64,
    all: Counts,
    onset: Counts,
    bins: [Bin; ECE_BINS],
    stage1: Stage1,
    displacement: Displacement,
}

impl Sums {
    fn of(truth: &SceneTruth, run: &SceneRun) -> Self {
        let index = TruthIndex::new(truth);
        let instances = instances(&index);
        let matching = match_scene(&truth.people, &run.tracks);
        let predictions = Said::by_run(run).of_tracks(&instances, &matching);
        // Instances stand in the order of the access points.
        let first = instances.partition_point(|instance| instance.access_point == 0);
        let WindowCounts { all, onset, bins, .. } =
            WindowCounts::of(&instances[..first], &predictions[..first], WINDOW);
        Self {
            recording: index.recording(),
            all,
            onset,
            bins,
            stage1: Stage1::of(&truth.people, &run.tracks),
            displacement: displacement(&index, run, &matching),
        }
    }
}

impl Pooled for Sums {
    fn plus(&self, other: &Self, times: u64) -> Self {
        Self {
            recording: other.recording,
            all: self.all.plus(&other.all, times),
            onset: self.onset.plus(&other.onset, times),
            bins: std::array::from_fn(|i| self.bins[i].plus(&other.bins[i], times)),
            stage1: self.stage1.plus(&other.stage1, times),
            displacement: self.displacement.plus(&other.displacement, times),
        }
    }
}

/// Two variants on the same scenes.
#[derive(Debug, Clone, Default)]
struct Pair {
    whole: Sums,
    without: Sums,
}

impl Pooled for Pair {
    fn plus(&self, other: &Self, times: u64) -> Self {
        Self {
            whole: self.whole.plus(&other.whole, times),
            without: self.without.plus(&other.without, times),
        }
    }
}

/// Everything in, and each of `mechanisms` left out alone, on one set of data. `clock` is any clock that does not
/// run back; `progress` is called after each scene.
///
/// # Errors
/// A setting that cannot work.
pub fn ablate(
    data: &DataSet,
    mechanisms: &[Mechanism],
    clock: impl Fn() -> Duration + Sync,
    progress: impl Fn() + Sync,
) -> Result<Ablated, Error> {
    let mut configs = vec![data.config.clone()];
    configs.extend(mechanisms.iter().map(|&mechanism| data.config.without(mechanism)));
    let (sums, times) = match &data.source {
        Source::Scenes(scenes) => simulated(configs, scenes, &clock, &progress)?,
        Source::Labelled { frames, labels } => labelled(&configs, frames, labels, &clock)?,
    };
    let recordings: Vec<u64> = sums.iter().map(|scene| scene[0].recording).collect();
    let bootstrap = Bootstrap::new(&recordings);
    let row = |variant: usize| {
        let pairs: Vec<Pair> = sums
            .iter()
            .map(|scene| Pair { whole: scene[0].clone(), without: scene[variant].clone() })
            .collect();
        let pooled = pairs.iter().fold(Pair::default(), |all, pair| all.plus(pair, 1));
        let resampled = bootstrap.resampled(&pairs);
        Row {
            without: variant.checked_sub(1).map(|m| mechanisms[m]),
            figures: Figure::ALL.map(|figure| {
                let more = |pair: &Pair| Some(figure.of(&pair.without)? - figure.of(&pair.whole)?);
                Compared {
                    value: figure.of(&pooled.without),
                    more: more(&pooled),
                    interval: interval(&resampled, more),
                }
            }),
            frame: median(&times[variant]),
        }
    };
    Ok(Ablated {
        name: data.name.clone(),
        scenes: sums.len(),
        rows: (0..=mechanisms.len()).map(row).collect(),
    })
}

/// By scene and variant: sums. By variant: times of frames.
type Tried = (Vec<Vec<Sums>>, Vec<Vec<f64>>);

fn simulated(
    configs: Vec<Config>,
    scenes: &[SceneSpec],
    clock: &(impl Fn() -> Duration + Sync),
    progress: &(impl Fn() + Sync),
) -> Result<Tried, Error> {
    let variants = configs.len();
    let spec = Spec { configs, weights: None, scenes: scenes.to_vec(), keep: None, ladder: false };
    let chain = Chain::new(&spec)?;
    let scene = |index: usize| -> Result<_, Error> {
        let played = chain.play(index, &|_| {}, clock)?;
        let of_lane = |lane: &Lane| (Sums::of(&played.truth, &lane.rows), seconds(&lane.times));
        let tried: (Vec<Sums>, Vec<Vec<f64>>) = played.lanes.iter().map(of_lane).unzip();
        progress();
        Ok(tried)
    };
    let played: Vec<_> =
        (0..scenes.len()).into_par_iter().with_max_len(1).map(scene).collect::<Result<_, Error>>()?;
    let mut times = vec![Vec::new(); variants];
    let mut sums = Vec::new();
    for (of_scene, times_of_scene) in played {
        sums.push(of_scene);
        times.iter_mut().zip(times_of_scene).for_each(|(all, more)| all.extend(more));
    }
    Ok((sums, times))
}

fn labelled(
    configs: &[Config],
    frames: &[Frame],
    labels: &[PeopleRow],
    clock: &(impl Fn() -> Duration + Sync),
) -> Result<Tried, Error> {
    let mut sums = Vec::new();
    let mut times = Vec::new();
    for config in configs {
        let mut lane = Lane::new(&Pipeline::new(config, None)?);
        lane.step(0, frames, clock);
        let stage1 = labels::score(labels, &lane.rows.tracks);
        sums.push(Sums { stage1, ..Sums::default() });
        times.push(seconds(&lane.times));
    }
    Ok((vec![sums], times))
}

fn seconds(times: &[Duration]) -> Vec<f64> {
    times.iter().map(Duration::as_secs_f64).collect()
}

fn median(seconds: &[f64]) -> Duration {
    let mut sorted = seconds.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    if sorted.is_empty() { Duration::ZERO } else { Duration::from_secs_f64(quantile(&sorted, 0.5)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::chain::tests::walk;
    use umbracast::geometry::DVec2;

    #[test]
    fn what_is_left_out_is_set_beside_the_whole_on_the_same_scenes() {
        // One behind the other, in line with the access point `side`.
        let spec = walk(3, 4, 25, |person, i| DVec2::new(0.01 * i - 1.5 * person, 0.0));
        let data = DataSet {
            name: "queue".to_owned(),
            config: Config::default(),
            source: Source::Scenes(spec.scenes),
        };
        let found = ablate(&data, &[Mechanism::Pose], || Duration::ZERO, || {}).unwrap();
        assert_eq!((found.scenes, found.rows.len()), (3, 2));
        let position = Figure::ALL.iter().position(|f| *f == Figure::PositionM).unwrap();
        let [whole, without] = [0, 1].map(|row: usize| found.rows[row].figures[position]);
        assert_eq!(whole.more, Some(0.0));
        assert!(without.more.unwrap() > 0.001, "{without:?} beside {whole:?}");
        assert!(found.rows[0].figures[0].value.unwrap() > 0.5, "links are blocked and foreseen");
    }
}
