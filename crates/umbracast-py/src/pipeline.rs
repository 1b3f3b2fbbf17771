//! The three stages, frame by frame.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use umbracast::lidar::{Assembler, Packet};
use umbracast::{Health, STEP_NS};
use umbracast_io::outcome_tables::OutcomeRows;
use umbracast_io::{reports, setup};

use crate::frame::Frame;
use crate::outcome::Outcome;
use crate::site::{self, Site};
use crate::told::{refused, wrong};

/// Packets from Python: which sensor, when it was received, and the payload.
type Received = (usize, i64, Vec<u8>);

/// What an access point heard: when, its name, the device's number, dBm; and whether it serves the device.
#[derive(FromPyObject)]
enum Heard {
    Serving(i64, String, u64, f64, bool),
    Power(i64, String, u64, f64),
}

/// The three stages with what each remembers. Python's other threads run while a frame is worked on.
///
/// >>> import numpy, umbracast
/// >>> pipeline = umbracast.Pipeline(mode="default")
/// >>> outcome = pipeline.step([numpy.zeros((0, 3)), numpy.array([[14.0, 0.0, 0.0]])])
/// >>> outcome.frame, outcome.time_ns, len(outcome.tracks)
/// (0, 100000000, 0)
#[pyclass(module = "umbracast")]
pub struct Pipeline {
    pipeline: umbracast::Pipeline,
    assembler: Assembler,
    assembled: Health,
    site: Site,
    names: Arc<Vec<String>>,
    scene: u32,
    /// Number and time of the next frame of points that have none.
    next: (u64, i64),
}

#[pymethods]
impl Pipeline {
    /// Sets up every stage for a site. `scene` is written into every row. So many threads may share the links of a frame that has
    /// many; results do not depend on it.
    #[new]
    #[pyo3(signature = (site=None, *, mode="default", weights=None, scene=0, threads=1))]
    fn new(
        site: Option<&Bound<PyAny>>,
        mode: &str,
        weights: Option<PathBuf>,
        scene: u32,
        threads: usize,
    ) -> PyResult<Self> {
        let site = Site::given(site)?;
        let config = site.config(site::mode(mode)?)?;
        let weights = setup::weights(weights.as_deref()).map_err(refused)?;
        let mut pipeline = umbracast::Pipeline::new(&config, Some(&weights)).map_err(refused)?;
        pipeline.use_threads(threads);
        Ok(Self {
            pipeline,
            assembler: Assembler::new(&config.site).map_err(refused)?,
            assembled: Health::default(),
            names: Arc::new(site.names()),
            site,
            scene,
            next: (0, STEP_NS),
        })
    }

    /// Learns the hall from frames without people. Without any, it is learned on the way.
    fn learn(&mut self, py: Python, frames: &Bound<PyAny>) -> PyResult<()> {
        for frame in frames.try_iter()? {
            let frame = self.frame_of(&frame?, None)?;
            py.detach(|| self.pipeline.learn_empty(&frame));
        }
        Ok(())
    }

    /// Takes what access points heard of devices since the last frame: (time in nanoseconds, access point's name, device's number,
    /// dBm), and as a fifth whether the access point serves the device. The next frames' `bindings` say who carries which device.
    fn hear(&mut self, reports: Vec<Heard>) -> PyResult<()> {
        let report = |(place, heard): (usize, Heard)| {
            let (time_ns, name, device, power_dbm, serves) = match heard {
                Heard::Power(time_ns, name, device, power_dbm) => (time_ns, name, device, power_dbm, false),
                Heard::Serving(time_ns, name, device, power_dbm, serves) => {
                    (time_ns, name, device, power_dbm, serves)
                }
            };
            reports::named(time_ns, &name, device, power_dbm, serves, self.site.site())
                .map_err(|e| refused(e.within(format!("report {place}"))))
        };
        let reports: Vec<_> = reports.into_iter().enumerate().map(report).collect::<PyResult<_>>()?;
        self.pipeline.hear(&reports);
        Ok(())
    }

    /// One frame through all stages: a `Frame`, or points in the sensor's frame as an array of shape (points, 3), or a list of
    /// such arrays, one for each sensor. Points without `time_ns` are a tenth of a second after the last frame.
    #[pyo3(signature = (points, *, time_ns=None))]
    fn step(&mut self, py: Python, points: &Bound<PyAny>, time_ns: Option<i64>) -> PyResult<Outcome> {
        let frame = self.frame_of(points, time_ns)?;
        Ok(py.detach(|| self.outcome_of(&frame)))
    }

    /// Takes packets as they came: (sensor, time received in nanoseconds, bytes). Gives an outcome for every frame that they
    /// closed.
    fn feed(&mut self, py: Python, packets: Vec<Received>) -> PyResult<Vec<Outcome>> {
        let sensors = self.site.site().sensors.len();
        if let Some((sensor, ..)) = packets.iter().find(|(sensor, ..)| *sensor >= sensors) {
            return Err(wrong(format!("packets: expected a sensor below {sensors}, found {sensor}")));
        }
        Ok(py.detach(|| {
            let mut outcomes = Vec::new();
            for (sensor, time_ns, payload) in packets {
                self.assembler.push(sensor, &Packet { time_ns, payload }, &mut self.assembled);
                self.drain(&mut outcomes);
            }
            outcomes
        }))
    }

    /// Closes the frames that wait for more packets.
    fn finish(&mut self, py: Python) -> Vec<Outcome> {
        py.detach(|| {
            let mut outcomes = Vec::new();
            self.assembler.finish();
            self.drain(&mut outcomes);
            outcomes
        })
    }

    /// Every frame through all stages; the rows of all of them in one outcome. Frames may be a list or a recording.
    fn run(&mut self, py: Python, frames: &Bound<PyAny>) -> PyResult<Outcome> {
        let (mut rows, mut last) = (OutcomeRows::default(), (0, 0, Health::default()));
        for frame in frames.try_iter()? {
            let frame = self.frame_of(&frame?, None)?;
            py.detach(|| {
                let outcome = self.pipeline.step(&frame);
                rows.add(self.scene, outcome);
                last = (outcome.frame, outcome.time_ns, outcome.health);
            });
        }
        last.2.add(&self.assembled);
        Ok(Outcome::new(rows, last, Vec::new(), self.names.clone()))
    }

    /// The site.
    #[getter]
    fn site(&self) -> Site {
        self.site.clone()
    }

    fn __repr__(&self) -> String {
        format!("Pipeline for {:?}, scene {}", self.site.site().name, self.scene)
    }
}

impl Pipeline {
    fn frame_of(&mut self, given: &Bound<PyAny>, time_ns: Option<i64>) -> PyResult<Arc<umbracast::Frame>> {
        let frame = match given.cast::<Frame>() {
            Ok(frame) => frame.get().0.clone(),
            Err(_) => {
                let arrays = match given.hasattr("shape")? {
                    true => vec![given.clone()],
                    false => given.try_iter()?.collect::<PyResult<_>>()?,
                };
                let (index, next_ns) = self.next;
                let time_ns = time_ns.unwrap_or(next_ns);
                Arc::new(Frame::of_points(&arrays, self.site.site(), index, time_ns)?)
            }
        };
        self.next = (frame.index + 1, frame.time_ns.saturating_add(STEP_NS));
        Ok(frame)
    }

    fn drain(&mut self, outcomes: &mut Vec<Outcome>) {
        while let Some(frame) = self.assembler.pop() {
            outcomes.push(self.outcome_of(&frame));
        }
    }

    fn outcome_of(&mut self, frame: &umbracast::Frame) -> Outcome {
        let outcome = self.pipeline.step(frame);
        let rows = OutcomeRows::of(self.scene, outcome);
        let foreground = outcome.foreground.iter().map(|point| point.position_m.to_array()).collect();
        let mut health = outcome.health;
        health.add(&self.assembled);
        Outcome::new(rows, (outcome.frame, outcome.time_ns, health), foreground, self.names.clone())
    }
}
