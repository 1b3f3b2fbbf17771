//! A hall: where sensors and access points are, from a file, a text or a recording.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyString;
use umbracast::{Config, Error, Mode};
use umbracast_io::setup;

use crate::told::{refused, wrong};

/// Where the site stands.
#[derive(Debug, Clone)]
enum Source {
    /// In the embedded defaults.
    Default,
    File(PathBuf),
    Text(String),
    Recorded(Box<umbracast::Site>),
}

/// A hall with sensors and access points, and any other setting that its file changes.
///
/// >>> import umbracast
/// >>> umbracast.Site().access_points
/// ['side', 'centre']
/// >>> umbracast.Site.from_toml("[sight]")
/// Traceback (most recent call last):
/// ValueError: site:1:2: unknown key `sight` in the file; expected one of: blockage, detect, forecast, mode, site, track
#[pyclass(frozen, module = "umbracast")]
#[derive(Debug, Clone)]
pub struct Site {
    source: Source,
    site: umbracast::Site,
}

impl Site {
    /// The hall that a recording was made in.
    pub fn recorded(site: umbracast::Site) -> Self {
        Self { source: Source::Recorded(Box::new(site.clone())), site }
    }

    /// What Python says of a site: nothing for the embedded one, a path, or a `Site`.
    pub fn given(site: Option<&Bound<PyAny>>) -> PyResult<Self> {
        let Some(site) = site else { return Self::of(Source::Default).map_err(refused) };
        if let Ok(site) = site.cast::<Self>() {
            return Ok(site.get().clone());
        }
        match site.extract::<PathBuf>() {
            Ok(path) => Self::of(Source::File(path)).map_err(refused),
            Err(_) => {
                let found = site.get_type().name()?;
                Err(wrong(format!("site: expected a path or a Site, found {found}")))
            }
        }
    }

    fn of(source: Source) -> Result<Self, Error> {
        let site = configured(&source, Mode::Default)?.site;
        Ok(Self { source, site })
    }

    /// The configuration of a mode on this site.
    pub fn config(&self, mode: Mode) -> PyResult<Config> {
        configured(&self.source, mode).map_err(refused)
    }

    /// The site.
    pub fn site(&self) -> &umbracast::Site {
        &self.site
    }

    /// The names of its access points, by index.
    pub fn names(&self) -> Vec<String> {
        self.site.access_points.iter().map(|ap| ap.name.clone()).collect()
    }

    /// The text of its file, where it has one.
    pub fn text(&self) -> PyResult<String> {
        match &self.source {
            Source::Default | Source::Recorded(_) => Ok(String::new()),
            Source::File(path) => setup::read_text(path).map_err(refused),
            Source::Text(text) => Ok(text.clone()),
        }
    }
}

#[pymethods]
impl Site {
    /// The hall of a TOML file; without one the embedded hall of the paper's experiment.
    #[new]
    #[pyo3(signature = (path=None))]
    fn new(path: Option<PathBuf>) -> PyResult<Self> {
        Self::of(path.map_or(Source::Default, Source::File)).map_err(refused)
    }

    /// The hall of a TOML text.
    #[staticmethod]
    fn from_toml(text: String) -> PyResult<Self> {
        Self::of(Source::Text(text)).map_err(refused)
    }

    /// The site's name.
    #[getter]
    fn name(&self) -> &str {
        &self.site.name
    }

    /// The names of the access points, in their order.
    #[getter]
    fn access_points(&self) -> Vec<String> {
        self.names()
    }

    /// The names of the sensors, in their order.
    #[getter]
    fn sensors(&self) -> Vec<String> {
        self.site.sensors.iter().map(|sensor| sensor.name.clone()).collect()
    }

    /// Every setting of a mode on this site, as TOML.
    #[pyo3(signature = (mode="default"))]
    fn to_toml(&self, mode: &str) -> PyResult<String> {
        Ok(self.config(self::mode(mode)?)?.to_toml())
    }

    fn __repr__<'py>(&self, py: Python<'py>) -> Bound<'py, PyString> {
        let (name, site) = (&self.site.name, &self.site);
        let told = format!(
            "Site {name:?}: {} sensors, {} access points",
            site.sensors.len(),
            site.access_points.len()
        );
        PyString::new(py, &told)
    }
}

/// A mode by its name.
pub fn mode(name: &str) -> PyResult<Mode> {
    name.parse().map_err(refused)
}

fn configured(source: &Source, mode: Mode) -> Result<Config, Error> {
    match source {
        Source::Default => Ok(Config::for_mode(mode)),
        Source::File(path) => setup::config(mode, Some(path)),
        Source::Text(text) => {
            let config = Config::with_overlay(mode, text, "site")?;
            config.with_calibrations(|file| {
                Err(Error::new(format!("expected a site of a file, for {file:?} is to be read beside it")))
            })
        }
        Source::Recorded(site) => Ok(Config { site: (**site).clone(), ..Config::for_mode(mode) }),
    }
}
