//! Simulated scenes: what sensors saw, and the truth.

use std::sync::{Arc, Mutex};

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyList};
use umbracast::lidar::{Assembler, Packet};
use umbracast::{Error, Health, STEP_S};
use umbracast_eval::run::chain::{self, EMPTY_FRAMES, TEST_SEEDS};
use umbracast_eval::score::scene::{SceneTruth, note_truth};
use umbracast_sim::crowd::Preset;
use umbracast_sim::scene::Scene as Simulated;
use umbracast_sim::sensor::Sensors;

use crate::frame::Frame;
use crate::site::Site;
use crate::table::Table;
use crate::told::{refused, wrong};

/// A simulated scene.
#[pyclass(frozen, module = "umbracast")]
pub struct Scene {
    /// What was so.
    pub truth: SceneTruth,
    site: Site,
    seed: u64,
    number: u32,
    /// By frame and sensor; empty without sensors.
    packets: Vec<Vec<Vec<Packet>>>,
    people: PyOnceLock<Py<Table>>,
    links: PyOnceLock<Py<Table>>,
    frames: PyOnceLock<Py<PyList>>,
    empty: PyOnceLock<Py<PyList>>,
}

/// Simulates people who walk in a hall, and what its sensors see of them: the scene that the command `simulate` writes with the
/// same crowd and seed.
///
/// >>> import umbracast
/// >>> scene = umbracast.simulate(people=3, seconds=1, sensors=False)
/// >>> scene.people["x_m"].shape
/// (30,)
/// >>> bool(scene.people_links["blocked"].any())
/// False
#[pyfunction]
#[pyo3(signature = (site=None, *, preset="orca-03", people=10, seed=200000, scene=0, sensors=true, seconds=None))]
pub fn simulate(
    py: Python,
    site: Option<&Bound<PyAny>>,
    preset: &str,
    people: usize,
    seed: u64,
    scene: u32,
    sensors: bool,
    seconds: Option<f64>,
) -> PyResult<Scene> {
    let site = Site::given(site)?;
    let preset: Preset = preset.parse().map_err(|e| wrong(format!("preset: {e}")))?;
    if people == 0 {
        return Err(wrong("people: expected 1 or more, found 0"));
    }
    let frames = match seconds {
        None => u64::MAX,
        Some(seconds) if seconds > 0.0 => (seconds / STEP_S).ceil() as u64,
        Some(seconds) => return Err(wrong(format!("seconds: expected more than 0, found {seconds}"))),
    };
    let made = py.detach(|| -> Result<_, Error> {
        let spec = chain::scenes_in(site.site(), &[preset], 1, people, seed)?.remove(0);
        let mut simulated = match sensors {
            true => Simulated::in_hall(spec.crowd(), site.site(), &traced(site.site())?, seed),
            false => Simulated::truth_only(spec.crowd(), site.site(), seed),
        };
        let (mut truth, mut packets) = (SceneTruth::default(), Vec::new());
        while let Some(frame) = simulated.next_frame().filter(|frame| frame.index < frames) {
            note_truth(scene, &frame, &mut truth);
            packets.extend(sensors.then_some(frame.packets));
        }
        Ok((truth, packets))
    });
    let (truth, packets) = made.map_err(refused)?;
    Ok(Scene {
        truth,
        site,
        seed,
        number: scene,
        packets,
        people: PyOnceLock::new(),
        links: PyOnceLock::new(),
        frames: PyOnceLock::new(),
        empty: PyOnceLock::new(),
    })
}

impl Scene {
    /// The hall.
    pub fn hall(&self) -> &Site {
        &self.site
    }
}

#[pymethods]
impl Scene {
    /// Everybody in every frame: places, velocities, headings, heights.
    #[getter]
    fn people(&self, py: Python) -> PyResult<Py<Table>> {
        let make = || Py::new(py, Table::of_rows(&self.truth.people, &self.site.names())?);
        Ok(self.people.get_or_try_init(py, make)?.clone_ref(py))
    }

    /// Every link in every frame: blocked by others, by the hall, by the owner.
    #[getter]
    fn people_links(&self, py: Python) -> PyResult<Py<Table>> {
        let make = || Py::new(py, Table::of_rows(&self.truth.links, &self.site.names())?);
        Ok(self.links.get_or_try_init(py, make)?.clone_ref(py))
    }

    /// What the sensors saw, a list of frames; empty without sensors.
    #[getter]
    fn frames(&self, py: Python) -> PyResult<Py<PyList>> {
        let make = || listed(py, py.detach(|| assembled(self.site.site(), &self.packets)));
        Ok(self.frames.get_or_try_init(py, make)?.clone_ref(py))
    }

    /// What they see of the hall without people.
    #[getter]
    fn empty(&self, py: Python) -> PyResult<Py<PyList>> {
        let make = || {
            listed(
                py,
                py.detach(|| {
                    let packets = Simulated::empty(self.site.site(), TEST_SEEDS, EMPTY_FRAMES)?;
                    assembled(self.site.site(), &packets)
                }),
            )
        };
        Ok(self.empty.get_or_try_init(py, make)?.clone_ref(py))
    }

    /// What the sensors sent, in the order of arrival: (sensor, time received in nanoseconds, bytes).
    fn packets<'py>(&self, py: Python<'py>) -> Vec<(usize, i64, Bound<'py, PyBytes>)> {
        let mut all = Vec::new();
        for frame in &self.packets {
            let first = all.len();
            for (sensor, packets) in frame.iter().enumerate() {
                all.extend(packets.iter().map(|p| (sensor, p.time_ns, PyBytes::new(py, &p.payload))));
            }
            all[first..].sort_by_key(|(sensor, time_ns, _)| (*time_ns, *sensor));
        }
        all
    }

    /// The site.
    #[getter]
    fn site(&self) -> Site {
        self.site.clone()
    }

    /// The number that stands in every row.
    #[getter]
    fn scene(&self) -> u32 {
        self.number
    }

    /// Of the people's ways, bodies and the sensors' noise.
    #[getter]
    fn seed(&self) -> u64 {
        self.seed
    }

    fn __repr__(&self) -> String {
        let frames = self.truth.people.last().map_or(0, |row| row.frame + 1);
        format!("Scene {} of seed {} in {:?}: {frames} frames", self.number, self.seed, self.site.site().name)
    }
}

fn listed(py: Python, frames: Result<Vec<umbracast::Frame>, Error>) -> PyResult<Py<PyList>> {
    let frames = frames.map_err(refused)?.into_iter().map(|frame| Py::new(py, Frame(Arc::new(frame))));
    Ok(PyList::new(py, frames.collect::<PyResult<Vec<_>>>()?)?.unbind())
}

fn assembled(site: &umbracast::Site, packets: &[Vec<Vec<Packet>>]) -> Result<Vec<umbracast::Frame>, Error> {
    let (mut assembler, mut health) = (Assembler::new(site)?, Health::default());
    let mut frames = Vec::new();
    for frame in packets {
        chain::push(&mut assembler, frame, &mut health);
        frames.extend(std::iter::from_fn(|| assembler.pop()));
    }
    assembler.finish();
    frames.extend(std::iter::from_fn(|| assembler.pop()));
    Ok(frames)
}

/// The sensors in their hall. Tracing it takes longer than a frame, so the last one is kept for the next scene.
fn traced(site: &umbracast::Site) -> Result<Sensors, Error> {
    static LAST: Mutex<Option<(umbracast::Site, Sensors)>> = Mutex::new(None);
    let mut last = LAST.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some((_, sensors)) = last.as_ref().filter(|(known, _)| known == site) {
        return Ok(sensors.clone());
    }
    let sensors = Sensors::new(site, TEST_SEEDS)?;
    *last = Some((site.clone(), sensors.clone()));
    Ok(sensors)
}
