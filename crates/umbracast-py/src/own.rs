//! Tracks of another program through stages 2 and 3.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use umbracast::{Config, Error, Health};
use umbracast_io::outcome_tables::OutcomeRows;
use umbracast_io::own_tracks::OwnTracks;
use umbracast_io::setup;

use crate::given;
use crate::outcome::Outcome;
use crate::site::{self, Site};
use crate::table::Table;
use crate::told::{refused, wrong};

/// Turns tracks into links: which link a body will block, with what probability and when. `tracks` is a table, or the path of one:
/// `id`, `time_s` (or `time_ns`), `x_m`, `y_m`, `vx_mps`, `vy_mps`. Other columns of the table `tracks` are used where they are
/// there; with forecasts among them (`x_s1_m` to `y_s9_m`) these are cast.
///
/// >>> import umbracast
/// >>> tracks = {"id": [7, 8], "time_s": [0.1, 0.1], "x_m": [4.0, 6.0], "y_m": [0.0, -0.8],
/// ...           "vx_mps": [0.0, 0.0], "vy_mps": [0.0, 1.3]}
/// >>> links = umbracast.cast(tracks).links
/// >>> [(str(ap), int(track)) for ap, track in zip(links["access_point"], links["track"])]
/// [('side', 7), ('side', 8), ('centre', 7), ('centre', 8)]
/// >>> bool(links["p_w9"][0] > 0.5 > links["p_now"][0])
/// True
#[pyfunction]
#[pyo3(signature = (tracks, site=None, *, mode="default", weights=None))]
pub fn cast(
    py: Python,
    tracks: &Bound<PyAny>,
    site: Option<&Bound<PyAny>>,
    mode: &str,
    weights: Option<PathBuf>,
) -> PyResult<Outcome> {
    let site = Site::given(site)?;
    through(py, tracks, &site, site.config(site::mode(mode)?)?, weights)
}

/// Where everybody will be at the next nine steps of 100 ms: the table `tracks`. Takes what `cast` takes.
///
/// >>> import umbracast
/// >>> ahead = umbracast.forecast({"id": [1], "time_s": [0.1], "x_m": [0.0], "y_m": [0.0], "vx_mps": [1.2], "vy_mps": [0.0]})
/// >>> bool(0.8 < ahead["x_s9_m"][0] < 1.3)
/// True
#[pyfunction]
#[pyo3(signature = (tracks, site=None, *, mode="default", weights=None))]
pub fn forecast(
    py: Python,
    tracks: &Bound<PyAny>,
    site: Option<&Bound<PyAny>>,
    mode: &str,
    weights: Option<PathBuf>,
) -> PyResult<Table> {
    let site = Site::given(site)?;
    let mut config = site.config(site::mode(mode)?)?;
    // Without an access point there is no link to cast.
    config.site.access_points.clear();
    let outcome = through(py, tracks, &site, config, weights)?;
    Table::of_rows(&outcome.rows.tracks, &[])
}

/// What to do about each device: stay, wait, change, and until when: the table `decisions`. Takes what `cast` takes; the site needs
/// radios and `[site.handover]`.
#[pyfunction]
#[pyo3(signature = (tracks, site=None, *, mode="default", weights=None))]
pub fn decide(
    py: Python,
    tracks: &Bound<PyAny>,
    site: Option<&Bound<PyAny>>,
    mode: &str,
    weights: Option<PathBuf>,
) -> PyResult<Table> {
    let site = Site::given(site)?;
    if !site.site().has_decisions() {
        let name = &site.site().name;
        return Err(wrong(format!(
            "site {name:?}: site.handover: expected what a change of access point costs, and radios at access points, found none"
        )));
    }
    let outcome = through(py, tracks, &site, site.config(site::mode(mode)?)?, weights)?;
    Table::of_rows(&outcome.rows.decisions, &site.names())
}

fn through(
    py: Python,
    tracks: &Bound<PyAny>,
    site: &Site,
    config: Config,
    weights: Option<PathBuf>,
) -> PyResult<Outcome> {
    let weights = setup::weights(weights.as_deref()).map_err(refused)?;
    let own = own_tracks(tracks)?;
    let cast = py.detach(|| -> Result<_, Error> {
        let (mut rows, mut last) = (OutcomeRows::default(), (0, 0, Health::default()));
        last.2 = own.cast(&config, &weights, |scene, outcome| {
            rows.add(scene, outcome);
            (last.0, last.1) = (outcome.frame, outcome.time_ns);
            Ok(())
        })?;
        Ok((rows, last))
    });
    let (rows, last) = cast.map_err(refused)?;
    Ok(Outcome::new(rows, last, Vec::new(), Arc::new(site.names())))
}

/// A path, an outcome with tracks, or a table.
fn own_tracks(tracks: &Bound<PyAny>) -> PyResult<OwnTracks> {
    if let Ok(path) = tracks.extract::<PathBuf>() {
        return OwnTracks::read(&path).map_err(refused);
    }
    let table = match tracks.cast::<Outcome>() {
        Ok(outcome) => outcome.getattr("tracks")?,
        Err(_) => tracks.clone(),
    };
    OwnTracks::new(given::loose(&table)?).map_err(|e| refused(e.within("tracks")))
}
