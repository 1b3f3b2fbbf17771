//! What a body costs a link, by the models of the field.

use numpy::PyArray1;
use pyo3::prelude::*;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::radio::models::{self, Stand, Sum, ThreeEdges};
use umbracast::radio::{Passage, Rectangle};
use umbracast::site::Radio;

use crate::told::wrong;

/// Kirchhoff's fringes are averaged over places of the body within so many metres to either side, as in the runtime.
const WITHIN_M: f64 = 0.04;

/// The loss in dB of the path from `access_point` (x, y, z) to `device` (x, y, z) past each of `bodies` (x, y), one at a time:
/// screens `width_m` wide that stand on the floor, `height_m` high. `model` is `kirchhoff`, `model-b`, `knife-edges` or
/// `three-edges`. Below 0 where the body focuses the wave.
///
/// >>> import umbracast
/// >>> loss = umbracast.loss_db((10, 0, 3), (0, 0, 1.2), [(1.0, 0.0), (1.0, 3.0)])
/// >>> bool(loss[0] > 10), bool(abs(loss[1]) < 1)
/// (True, True)
#[pyfunction]
#[pyo3(signature = (access_point, device, bodies, *, height_m=1.72, width_m=0.56, carrier_ghz=28.0, model="kirchhoff"))]
pub fn loss_db<'py>(
    py: Python<'py>,
    access_point: [f64; 3],
    device: [f64; 3],
    bodies: Vec<[f64; 2]>,
    height_m: f64,
    width_m: f64,
    carrier_ghz: f64,
    model: &str,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    for (name, value) in [("height_m", height_m), ("width_m", width_m), ("carrier_ghz", carrier_ghz)] {
        if value.is_nan() || value <= 0.0 {
            return Err(wrong(format!("{name}: expected more than 0, found {value}")));
        }
    }
    let wavelength_m = Radio { carrier_ghz, ..Radio::default() }.wavelength_m();
    let of = move |passage: &Passage| -> Option<f64> {
        let screen: [Rectangle; 1] = [passage.rectangle(0.5 * width_m, 0.0, height_m)];
        Some(match model {
            "kirchhoff" => models::kirchhoff_mean(wavelength_m, passage, &screen, WITHIN_M),
            "model-b" => models::model_b(wavelength_m, passage, width_m, height_m, Stand::Upright),
            "knife-edges" => models::double_knife_edge(wavelength_m, passage, width_m, Sum::Power),
            "three-edges" => {
                models::three_edges(wavelength_m, passage, width_m, height_m, ThreeEdges::Average)
            }
            _ => return None,
        })
    };
    let (tx_m, rx_m) = (DVec3::from_array(access_point), DVec3::from_array(device));
    let loss = |foot_m: [f64; 2]| match Passage::new(tx_m, rx_m, DVec2::from_array(foot_m), 0.0) {
        None => Some(0.0),
        Some(passage) => of(&passage),
    };
    let losses: Option<Vec<f64>> = bodies.into_iter().map(loss).collect();
    let known = ["kirchhoff", "model-b", "knife-edges", "three-edges"];
    match losses.filter(|_| known.contains(&model)) {
        Some(losses) => Ok(PyArray1::from_vec(py, losses)),
        None => Err(wrong(format!("model: expected {}, found {model:?}", known.join(", ")))),
    }
}
