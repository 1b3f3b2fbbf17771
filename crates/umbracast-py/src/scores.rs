//! Scores of a run against the truth.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use umbracast::{Config, Error, Health};
use umbracast_eval::report;
use umbracast_eval::run::recorded::{by_scene, score_scenes};
use umbracast_eval::score::matches::of_scene;
use umbracast_eval::score::scene::{SceneRun, SceneTruth};
use umbracast_io::rows::{LinkRow, MatchRow, PeopleLinkRow, PeopleRow, TrackRow};
use umbracast_io::{setup, tables};

use crate::given;
use crate::outcome::Outcome;
use crate::scene::Scene;
use crate::site::{self, Site};
use crate::table::Table;
use crate::told::{from_json, refused, wrong};

/// Scores of all stages, as the command `evaluate` counts them.
#[pyclass(frozen, module = "umbracast")]
pub struct Scores {
    scores: umbracast_eval::run::pooled::Scores,
    site: umbracast::Site,
}

/// Scores a run against its truth. `run` is an `Outcome`, a `dict` of the tables `tracks` and `links`, a list of such, or the folder of
/// a run. `truth` is a `Scene`, a `dict` of the tables `people` and `people_links`, a list of such, or the folder of a simulation. The
/// site and the mode are those of the run; those of a folder stand in it.
///
/// >>> import umbracast
/// >>> scene = umbracast.simulate(people=3, seconds=4)
/// >>> pipeline = umbracast.Pipeline(scene.site)
/// >>> pipeline.learn(scene.empty)
/// >>> scores = umbracast.evaluate(pipeline.run(scene.frames), scene)
/// >>> scores.value("accuracy", access_point="side") > 0.9
/// True
#[pyfunction]
#[pyo3(signature = (run, truth, *, site=None, mode="default", weights=None))]
pub fn evaluate(
    py: Python,
    run: &Bound<PyAny>,
    truth: &Bound<PyAny>,
    site: Option<&Bound<PyAny>>,
    mode: &str,
    weights: Option<PathBuf>,
) -> PyResult<Scores> {
    let config = config_of(run, truth, site, mode)?;
    let (run, truth) = rows_of(run, truth, &config.site)?;
    let weights = setup::weights(weights.as_deref()).map_err(refused)?;
    let scored = py.detach(|| -> Result<_, Error> {
        score_scenes(&config, &by_scene(truth, run)?, Health::default(), &weights)
    });
    Ok(Scores { scores: scored.map_err(refused)?, site: config.site })
}

/// Whose track is whose, frame by frame: the table `matches`, by which truth and answer are joined. Takes what `evaluate` takes.
#[pyfunction]
#[pyo3(signature = (run, truth, *, site=None))]
pub fn matches(run: &Bound<PyAny>, truth: &Bound<PyAny>, site: Option<&Bound<PyAny>>) -> PyResult<Table> {
    let config = config_of(run, truth, site, "default")?;
    let (run, truth) = rows_of(run, truth, &config.site)?;
    let scenes = by_scene(truth, run).map_err(refused)?;
    let pairs: Vec<MatchRow> = scenes
        .iter()
        .flat_map(|(&number, (truth, run))| of_scene(number, &truth.people, &run.tracks))
        .collect();
    Table::of_rows(&pairs, &[])
}

#[pymethods]
impl Scores {
    /// Every score, as `scores.json` has them.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &report::to_json(&self.scores))
    }

    /// One score of stage 3: `f1`, `onset_f1`, `accuracy`, `precision`, `recall`, `base_rate`, `auprc`, `brier` or `ece` at an access
    /// point (the first where none is named), for links blocked within `window` steps. `predictor` is `run`, or one of the baselines
    /// beside it. `None` where the score is not defined.
    #[pyo3(signature = (score="f1", *, access_point=None, window=3, predictor="run"))]
    fn value(
        &self,
        score: &str,
        access_point: Option<&str>,
        window: usize,
        predictor: &str,
    ) -> PyResult<Option<f64>> {
        let Some(group) = self.scores.groups.last() else { return Ok(None) };
        let named = |name: &str| access_point.is_none_or(|asked| asked == name);
        let found = group.links.iter().find(|of| of.predictor == predictor && named(&of.access_point));
        let Some(found) = found else {
            let known: Vec<_> = group.links.iter().map(|of| (of.predictor, &of.access_point[..])).collect();
            return Err(wrong(format!(
                "expected a predictor and an access point of {known:?}, found {:?}",
                (predictor, access_point)
            )));
        };
        let steps = found.windows.len();
        let Some(window) = found.windows.iter().find(|of| of.w == window) else {
            return Err(wrong(format!("window: expected 1 to {steps} steps, found {window}")));
        };
        let all = serde_json::json!(window);
        match all.get(score) {
            Some(serde_json::Value::Object(estimate)) if estimate.contains_key("value") => {
                Ok(estimate["value"].as_f64())
            }
            Some(number @ (serde_json::Value::Number(_) | serde_json::Value::Null)) => Ok(number.as_f64()),
            _ => Err(wrong(format!(
                "score: expected f1, onset_f1, precision, recall or another, found {score:?}"
            ))),
        }
    }

    fn __str__(&self) -> String {
        report::to_text(&self.scores, &self.site)
    }

    fn __repr__(&self) -> String {
        let scenes = self.scores.groups.last().map_or(0, |group| group.scenes);
        format!("Scores of {scenes} scenes in {:?}", self.site.name)
    }
}

/// The run's configuration: that of its folder, else of the site given, else of the truth's site.
fn config_of(
    run: &Bound<PyAny>,
    truth: &Bound<PyAny>,
    site: Option<&Bound<PyAny>>,
    mode: &str,
) -> PyResult<Config> {
    let mode = site::mode(mode)?;
    if let Some(folder) = folder(run).filter(|folder| folder.join("config.toml").exists()) {
        return setup::config_of_run(&folder).map_err(refused);
    }
    if site.is_some() {
        return Site::given(site)?.config(mode);
    }
    match each(truth)?.first().map(|first| first.cast::<Scene>().is_ok()) {
        Some(true) => {
            let scene = each(truth)?.remove(0);
            scene.cast::<Scene>()?.get().hall().config(mode)
        }
        _ => Site::given(None)?.config(mode),
    }
}

fn rows_of(
    run: &Bound<PyAny>,
    truth: &Bound<PyAny>,
    site: &umbracast::Site,
) -> PyResult<(SceneRun, SceneTruth)> {
    let names: Vec<String> = site.access_points.iter().map(|ap| ap.name.clone()).collect();
    let (mut said, mut so) = (SceneRun::default(), SceneTruth::default());
    for run in each(run)? {
        if let Ok(outcome) = run.cast::<Outcome>() {
            said.tracks.extend(&outcome.get().rows.tracks);
            said.links.extend(&outcome.get().rows.links);
        } else if let Some(folder) = folder(&run) {
            said.tracks.extend(read::<TrackRow>(&folder, &names)?);
            said.links.extend(read::<LinkRow>(&folder, &names)?);
        } else {
            said.tracks.extend(given::rows::<TrackRow>(&run.get_item("tracks")?, &names)?);
            said.links.extend(given::rows::<LinkRow>(&run.get_item("links")?, &names)?);
        }
    }
    for truth in each(truth)? {
        if let Ok(scene) = truth.cast::<Scene>() {
            so.people.extend(&scene.get().truth.people);
            so.links.extend(&scene.get().truth.links);
        } else if let Some(folder) = folder(&truth) {
            so.people.extend(read::<PeopleRow>(&folder, &names)?);
            so.links.extend(read::<PeopleLinkRow>(&folder, &names)?);
        } else {
            so.people.extend(given::rows::<PeopleRow>(&truth.get_item("people")?, &names)?);
            so.links.extend(given::rows::<PeopleLinkRow>(&truth.get_item("people_links")?, &names)?);
        }
    }
    Ok((said, so))
}

fn read<R: tables::Row>(folder: &Path, names: &[String]) -> PyResult<Vec<R>> {
    tables::read(folder, names).map_err(refused)
}

fn folder(given: &Bound<PyAny>) -> Option<PathBuf> {
    given.extract().ok()
}

/// The members of a list, or the one thing given.
fn each<'py>(given: &Bound<'py, PyAny>) -> PyResult<Vec<Bound<'py, PyAny>>> {
    match given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>() {
        true => given.try_iter()?.collect(),
        false => Ok(vec![given.clone()]),
    }
}
