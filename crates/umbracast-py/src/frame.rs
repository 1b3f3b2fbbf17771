//! What all sensors saw in one period.

use std::sync::Arc;

use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use umbracast::geometry::{DVec3, Pose};
use umbracast::lidar::{Cloud, Scan, SensorPoint};
use umbracast_io::clouds::azimuths;

use crate::told::wrong;

/// A frame: the points of all sensors in 100 ms.
#[pyclass(frozen, module = "umbracast")]
#[derive(Debug, Clone)]
pub struct Frame(pub Arc<umbracast::Frame>);

#[pymethods]
impl Frame {
    /// Counts from 0 in each scene.
    #[getter]
    fn index(&self) -> u64 {
        self.0.index
    }

    /// The instant the frame closes, nanoseconds.
    #[getter]
    fn time_ns(&self) -> i64 {
        self.0.time_ns
    }

    /// Every point in the site's frame, metres: an array of shape (points, 3).
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut places = Vec::new();
        self.each(|_, place_m, _| places.extend(place_m.to_array()));
        let array = Array2::from_shape_vec((places.len() / 3, 3), places);
        Ok(PyArray2::from_owned_array(py, array.map_err(|e| wrong(e.to_string()))?))
    }

    /// Which sensor of the site each point is of, by index: an array of shape (points,).
    #[getter]
    fn sensors<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        let mut sensors = Vec::new();
        self.each(|sensor, _, _| sensors.push(sensor as u32));
        PyArray1::from_vec(py, sensors)
    }

    /// When each point was measured, nanoseconds: an array of shape (points,).
    #[getter]
    fn times_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let mut times = Vec::new();
        self.each(|_, _, time_ns| times.push(time_ns));
        PyArray1::from_vec(py, times)
    }

    fn __repr__(&self) -> String {
        let mut points = 0;
        self.each(|_, _, _| points += 1);
        format!(
            "Frame {} at {} ns: {points} points of {} sensors",
            self.0.index,
            self.0.time_ns,
            self.0.scans.len()
        )
    }
}

impl Frame {
    /// A frame of points in the sensors' frames: an array for each sensor, of shape (points, 3).
    pub fn of_points(
        arrays: &[Bound<PyAny>],
        site: &umbracast::Site,
        index: u64,
        time_ns: i64,
    ) -> PyResult<umbracast::Frame> {
        if arrays.len() > site.sensors.len() {
            let (expected, found) = (site.sensors.len(), arrays.len());
            return Err(wrong(format!(
                "points: expected an array for each of {expected} sensors, found {found}"
            )));
        }
        let mut scans = Vec::new();
        for (sensor, array) in arrays.iter().enumerate() {
            let site_from_sensor = site.sensors[sensor].site_from_sensor();
            let cloud = Cloud::Unorganised(points_of(array, time_ns)?);
            scans.push(Scan { sensor, site_from_sensor, cloud });
        }
        Ok(umbracast::Frame { index, time_ns, scans })
    }

    fn each(&self, mut see: impl FnMut(usize, DVec3, i64)) {
        for scan in &self.0.scans {
            let pose: &Pose = &scan.site_from_sensor;
            match &scan.cloud {
                Cloud::Organised(image) => {
                    let beams = image.beams.len();
                    for (at, &range_m) in
                        image.range_m.iter().enumerate().filter(|(_, range_m)| **range_m > 0.0)
                    {
                        let (c, b) = (at / beams, at % beams);
                        let place_m = pose.point(image.tabled_point_m(azimuths(), c, b, range_m.into()));
                        see(scan.sensor, place_m, image.time_ns(c, b));
                    }
                }
                Cloud::Unorganised(points) => {
                    for point in points {
                        let place_m = DVec3::from_array(point.position_m.map(f64::from));
                        see(scan.sensor, pose.point(place_m), point.time_ns);
                    }
                }
            }
        }
    }
}

fn points_of(array: &Bound<PyAny>, time_ns: i64) -> PyResult<Vec<SensorPoint>> {
    let numpy = array.py().import("numpy")?;
    let array = numpy.call_method1("ascontiguousarray", (array, "float32"))?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if shape.len() != 2 || shape[1] != 3 {
        return Err(wrong(format!("points: expected an array of shape (points, 3), found {shape:?}")));
    }
    let array = array.cast::<PyArray2<f32>>()?.readonly();
    let point = |at: &[f32]| SensorPoint { position_m: [at[0], at[1], at[2]], time_ns, reflectivity: 0.0 };
    Ok(array.as_slice()?.chunks_exact(3).map(point).collect())
}
