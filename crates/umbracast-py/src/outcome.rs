//! What the stages made of a frame, or of several.

use std::sync::Arc;

use numpy::PyArray2;
use numpy::ndarray::Array2;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use umbracast::Health;
use umbracast_io::outcome_tables::OutcomeRows;
use umbracast_io::tables::Row;

use crate::table::Table;
use crate::told::{of_health, wrong};

/// The tables of a frame, or of all frames of a run. They are made when they are asked for.
#[pyclass(frozen, module = "umbracast")]
pub struct Outcome {
    /// The rows of all tables.
    pub rows: OutcomeRows,
    frame: u64,
    time_ns: i64,
    foreground: Vec<[f64; 3]>,
    health: Health,
    names: Arc<Vec<String>>,
    detections: PyOnceLock<Py<Table>>,
    tracks: PyOnceLock<Py<Table>>,
    links: PyOnceLock<Py<Table>>,
    links_db: PyOnceLock<Py<Table>>,
    bindings: PyOnceLock<Py<Table>>,
    decisions: PyOnceLock<Py<Table>>,
}

impl Outcome {
    /// `rows` end with the frame that `last` tells of: number, time and what was skipped until then. `names` are those of the
    /// site's access points.
    pub fn new(
        rows: OutcomeRows,
        last: (u64, i64, Health),
        foreground: Vec<[f64; 3]>,
        names: Arc<Vec<String>>,
    ) -> Self {
        let (frame, time_ns, health) = last;
        Self {
            rows,
            frame,
            time_ns,
            foreground,
            health,
            names,
            detections: PyOnceLock::new(),
            tracks: PyOnceLock::new(),
            links: PyOnceLock::new(),
            links_db: PyOnceLock::new(),
            bindings: PyOnceLock::new(),
            decisions: PyOnceLock::new(),
        }
    }

    fn table<R: Row>(&self, py: Python, made: &PyOnceLock<Py<Table>>, rows: &[R]) -> PyResult<Py<Table>> {
        let make = || Py::new(py, Table::of_rows(rows, &self.names)?);
        Ok(made.get_or_try_init(py, make)?.clone_ref(py))
    }
}

#[pymethods]
impl Outcome {
    /// The number of the frame; of the last one where there are several.
    #[getter]
    fn frame(&self) -> u64 {
        self.frame
    }

    /// The frame's time, nanoseconds.
    #[getter]
    fn time_ns(&self) -> i64 {
        self.time_ns
    }

    /// Everybody seen, before tracks.
    #[getter]
    fn detections(&self, py: Python) -> PyResult<Py<Table>> {
        self.table(py, &self.detections, &self.rows.detections)
    }

    /// Everybody followed, with where they will be.
    #[getter]
    fn tracks(&self, py: Python) -> PyResult<Py<Table>> {
        self.table(py, &self.tracks, &self.rows.tracks)
    }

    /// Every link of a confirmed track, with its probabilities.
    #[getter]
    fn links(&self, py: Python) -> PyResult<Py<Table>> {
        self.table(py, &self.links, &self.rows.links)
    }

    /// What bodies cost each link, dB; empty where no access point has a radio.
    #[getter]
    fn links_db(&self, py: Python) -> PyResult<Py<Table>> {
        self.table(py, &self.links_db, &self.rows.losses)
    }

    /// Who may carry which device that was heard (`Pipeline.hear`), likeliest first.
    #[getter]
    fn bindings(&self, py: Python) -> PyResult<Py<Table>> {
        self.table(py, &self.bindings, &self.rows.bindings)
    }

    /// What to do about each device; empty where the site does not say what changes cost.
    #[getter]
    fn decisions(&self, py: Python) -> PyResult<Py<Table>> {
        self.table(py, &self.decisions, &self.rows.decisions)
    }

    /// Points that do not belong to the empty hall, metres: shape (points, 3). Empty where there are several frames.
    #[getter]
    fn foreground<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let flat: Vec<f64> = self.foreground.iter().flatten().copied().collect();
        let array = Array2::from_shape_vec((self.foreground.len(), 3), flat);
        Ok(PyArray2::from_owned_array(py, array.map_err(|e| wrong(e.to_string()))?))
    }

    /// What was skipped since the start, by name.
    #[getter]
    fn health<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        of_health(py, &self.health)
    }

    fn __repr__(&self) -> String {
        let rows = &self.rows;
        format!(
            "Outcome up to frame {}: {} detections, {} tracks, {} links",
            self.frame,
            rows.detections.len(),
            rows.tracks.len(),
            rows.links.len()
        )
    }
}
