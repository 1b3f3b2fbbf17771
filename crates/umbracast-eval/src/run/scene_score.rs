//! One scene scored: all predictors over the same instances, and the sums of stages 1 and 2.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use umbracast::config::BoxKind;
use umbracast::forecast::Weights;
use umbracast::{Config, Error, Health, Mode};
use umbracast_io::rows::TrackRow;
use umbracast_sim::body::Walker;

use crate::oracle::replaced;
use crate::oracle::true_bodies::true_bodies;
use crate::oracle::true_forecasts::TrueForecasts;
use crate::score::device::bound_once;
use crate::score::displacement::Displacement;
use crate::score::instances::{Cause, instances, instances_of};
use crate::score::link_counts::{LinkCounts, Prediction};
use crate::score::links::{Said, never, persistence_of_truth};
use crate::score::matching::match_scene;
use crate::score::scene::{Matching, SceneRun, SceneTruth, TruthIndex};
use crate::score::stage1::Stage1;
use crate::score::times::Times;

/// Who predicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Predictor {
    /// The mode itself.
    Run,
    /// The mode's chance of being blocked by the owner's own body; scored against that.
    ByOwner,
    /// The same by the hall.
    ByHall,
    /// The same by others, the owner or the hall.
    ByAny,
    /// The mode itself, heard through devices that are bound to a track once ([`crate::score::device`]).
    BoundOnce,
    /// The mode with Algorithm 1 on axis-aligned boxes for its stage 3.
    Aabb,
    /// The mode with Algorithm 1 on boxes along people's own axes for its stage 3.
    Obb,
    /// Baseline: nobody is ever blocked.
    Never,
    /// Baseline: as now, the present being the truth's.
    PersistenceOfTruth,
    /// Baseline: as now, as the mode's own tracks see it.
    PersistenceOfTracks,
    /// Baseline: true positions carried on, cast by the mode's stage 3.
    ConstantVelocityOfTruth,
    /// Error budget: true positions and velocities into the mode's forecast and cast.
    TrueState,
    /// Error budget: the true future into the mode's cast.
    TrueFuture,
    /// Error budget: the true walking mesh at the mode's forecast.
    TrueBody,
}

impl Predictor {
    /// Those that are scored against another truth than all others, with what that is.
    pub const CAUSES: [(Self, Cause); 3] =
        [(Self::ByOwner, Cause::Owner), (Self::ByHall, Cause::Hall), (Self::ByAny, Cause::Any)];

    /// As tables and files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::ByOwner => "blocked by the owner",
            Self::ByHall => "blocked by the hall",
            Self::ByAny => "blocked by anything",
            Self::BoundOnce => "run with devices bound once",
            Self::Aabb => "AABB",
            Self::Obb => "OBB",
            Self::Never => "never",
            Self::PersistenceOfTruth => "persistence of truth",
            Self::PersistenceOfTracks => "persistence of tracks",
            Self::ConstantVelocityOfTruth => "constant velocity of truth",
            Self::TrueState => "true positions and velocities",
            Self::TrueFuture => "true future",
            Self::TrueBody => "true body",
        }
    }
}

/// What a predictor said in one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PredictorCounts {
    /// `None` for baselines that need no mode.
    pub mode: Option<Mode>,
    /// Who.
    pub predictor: Predictor,
    /// One an access point of the site.
    pub access_points: Vec<LinkCounts>,
}

/// Stages 1 and 2 of a mode in one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModeSums {
    /// Whose.
    pub mode: Mode,
    /// Detection and tracking.
    pub stage1: Stage1,
    /// Forecasts.
    pub displacement: Displacement,
    /// When links are blocked and clear again, one an access point.
    pub times: Vec<Times>,
    /// What was skipped.
    pub health: Health,
}

/// Everything that is kept of a scene for the scores of all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneScore {
    /// Which of the scenes.
    pub scene: u32,
    /// What it is pooled with: the preset, or the file it was replayed from.
    pub group: String,
    /// What it replays ([`TruthIndex::recording`]): scenes of one recording say the same thing several times.
    pub recording: u64,
    /// How many frames it has.
    pub frames: u64,
    /// Constant velocity from the true state, for comparison with stage 2.
    pub constant_velocity: Displacement,
    /// In the order of the tables.
    pub said: Vec<PredictorCounts>,
    /// In the order of the modes.
    pub modes: Vec<ModeSums>,
}

/// What a mode made of a scene.
#[derive(Debug)]
pub struct ModeRun<'a> {
    /// How it was set.
    pub config: &'a Config,
    /// Its tables.
    pub rows: &'a SceneRun,
    /// What it skipped.
    pub health: Health,
}

/// Scores the runs of one or several modes on one scene. `walkers` are the scene's bodies where it was simulated
/// here; without them the true body is left out.
///
/// # Errors
/// A mode whose forecast needs weights when there are none.
pub fn score_scene(
    scene: u32,
    group: &str,
    truth: &SceneTruth,
    runs: &[ModeRun],
    weights: Option<&Weights>,
    walkers: Option<&[Walker]>,
) -> Result<SceneScore, Error> {
    let index = TruthIndex::new(truth);
    let instances = instances(&index);
    let site_access_points = runs.first().map_or(0, |run| run.config.site.access_points.len()) as u32;
    let mut said = Vec::new();
    let of_others = |mode: Option<Mode>, predictor: Predictor, predictions: Vec<Prediction>| {
        let access_points = LinkCounts::each(&instances, &predictions, site_access_points);
        PredictorCounts { mode, predictor, access_points }
    };
    said.push(of_others(None, Predictor::Never, never(&instances)));
    said.push(of_others(None, Predictor::PersistenceOfTruth, persistence_of_truth(&instances)));
    let by_cause = Predictor::CAUSES.map(|(_, cause)| instances_of(&index, cause));
    let (mut modes, mut true_forecasts) = (Vec::new(), TrueForecasts::default());
    for ModeRun { config, rows, health } in runs {
        let mode = Some(config.mode);
        let mut add = |mode, predictor, predictions| said.push(of_others(mode, predictor, predictions));
        let matching = match_scene(&truth.people, &rows.tracks);
        let own = Said::by_run(rows);
        let of_tracks = |said: Said| said.of_tracks(&instances, &matching);
        let of_persons = |said: Said| said.of_persons(&instances);
        add(mode, Predictor::PersistenceOfTracks, own.persistence(&instances, &matching));
        let bound = bound_once(&index, rows, &matching);
        add(mode, Predictor::Run, own.of_tracks(&instances, &matching));
        add(mode, Predictor::BoundOnce, own.of_tracks(&instances, &bound));
        add(mode, Predictor::Aabb, of_tracks(replaced::algorithm_1(rows, config, BoxKind::Aabb)));
        add(mode, Predictor::Obb, of_tracks(replaced::algorithm_1(rows, config, BoxKind::Obb)));
        add(
            mode,
            Predictor::ConstantVelocityOfTruth,
            of_persons(replaced::constant_velocity_of_truth(&index, config)),
        );
        let true_state = replaced::true_state(&index, rows, &matching, config, weights, &mut true_forecasts)?;
        add(mode, Predictor::TrueState, of_persons(true_state));
        add(mode, Predictor::TrueFuture, of_tracks(replaced::true_future(&index, rows, &matching, config)));
        if let Some(walkers) = walkers {
            add(mode, Predictor::TrueBody, of_tracks(true_bodies(rows, &matching, walkers, &config.site)));
        }
        for ((predictor, cause), of_cause) in Predictor::CAUSES.into_iter().zip(&by_cause) {
            let threshold = config.blockage.threshold;
            let predictions = Said::by_cause(rows, cause, threshold).of_tracks(of_cause, &matching);
            let access_points = LinkCounts::each(of_cause, &predictions, site_access_points);
            said.push(PredictorCounts { mode, predictor, access_points });
        }
        modes.push(ModeSums {
            mode: config.mode,
            stage1: Stage1::of(&truth.people, &rows.tracks),
            displacement: displacement(&index, rows, &matching),
            times: Times::each(&index, &instances, rows, &matching, site_access_points),
            health: *health,
        });
    }
    let carried_on = |frame, person| index.person(frame, person).map(replaced::constant_velocity_steps);
    Ok(SceneScore {
        scene,
        group: group.to_owned(),
        recording: index.recording(),
        frames: index.frames.len() as u64,
        constant_velocity: Displacement::of(&index, carried_on),
        said,
        modes,
    })
}

/// Of the forecasts that a run made of each person's track.
pub(crate) fn displacement(index: &TruthIndex, run: &SceneRun, matching: &Matching) -> Displacement {
    let rows: BTreeMap<(u64, u64), &TrackRow> =
        run.tracks.iter().map(|row| ((row.frame, row.track), row)).collect();
    Displacement::of(index, |frame, person| {
        let track = matching.get(&(frame, person))?;
        rows.get(&(frame, *track)).map(|row| replaced::forecast_of(row))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::{link_row, track_row, truth_of};
    use umbracast_io::rows::{LinkRow, PeopleLinkRow, PeopleRow};
    use umbracast_io::tables::{read, write};

    fn score(truth: &SceneTruth, rows: &SceneRun) -> SceneScore {
        let config = Config::for_mode(Mode::Default);
        let run = ModeRun { config: &config, rows, health: Health::default() };
        score_scene(0, "hand made", truth, &[run], None, None).unwrap()
    }

    #[test]
    fn tables_read_back_from_files_score_as_the_rows_in_memory() {
        let truth = truth_of(2, 40, |person, frame| person == 1 && frame % 7 == 0);
        let run = SceneRun {
            tracks: (0..40).map(|frame| track_row(frame, 5, 9.9, 0.1)).collect(),
            links: (0..40).map(|frame| link_row(frame, 5, frame % 5 == 0)).collect(),
        };
        let (folder, names) = (tempfile::tempdir().unwrap(), ["side".to_owned(), "centre".to_owned()]);
        let path = folder.path();
        write(path, &names, false, &truth.people).unwrap();
        write(path, &names, false, &truth.links).unwrap();
        write(path, &names, false, &run.tracks).unwrap();
        write(path, &names, false, &run.links).unwrap();
        let truth_read = SceneTruth {
            people: read::<PeopleRow>(path, &names).unwrap(),
            links: read::<PeopleLinkRow>(path, &names).unwrap(),
        };
        let run_read = SceneRun {
            tracks: read::<TrackRow>(path, &names).unwrap(),
            links: read::<LinkRow>(path, &names).unwrap(),
        };
        let in_memory = score(&truth, &run);
        assert_eq!(score(&truth_read, &run_read), in_memory);
        assert_eq!(in_memory.modes[0].displacement.tracked_share(), Some(0.5));
    }
}
