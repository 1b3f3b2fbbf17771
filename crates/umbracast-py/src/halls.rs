//! What sensors see of a hall, and where they hang.

use pyo3::prelude::*;
use umbracast::Health;
use umbracast_calibrate::{of_recording, write_into};
use umbracast_eval::coverage::{self as survey, Options};

use crate::recording::Recording;
use crate::site::Site;
use crate::table::Table;
use crate::told::{from_json, refused, warn};

/// What a site's sensors see of a standing person, place by place: the table `coverage`.
///
/// >>> import umbracast
/// >>> seen = umbracast.coverage(step_m=4.0, headings=1)
/// >>> bool((seen["sensors_seeing"] <= 2).all())
/// True
#[pyfunction]
#[pyo3(signature = (site=None, *, step_m=0.5, height_m=1.72, headings=6))]
pub fn coverage(
    py: Python,
    site: Option<&Bound<PyAny>>,
    step_m: f64,
    height_m: f64,
    headings: usize,
) -> PyResult<Table> {
    let site = Site::given(site)?;
    let options = Options { step_m, height_m, headings };
    let surveyed = py.detach(|| survey::survey(site.site(), options)).map_err(refused)?;
    Table::of_values(survey::columns(site.site(), &surveyed))
}

/// Where the sensors hang, from a recording of a minute or more in which people walk: a `dict` of what was found, with `toml`, the site
/// file with the poses and clocks put right. The hall without people is `empty.mcap` beside the recording, where it is there.
#[pyfunction]
#[pyo3(signature = (recording, site=None))]
pub fn calibrate<'py>(
    py: Python<'py>,
    recording: &Bound<'py, Recording>,
    site: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let recording = recording.get();
    let site = match site {
        Some(site) => Site::given(Some(site))?,
        None => recording.hall().clone(),
    };
    let mut lost = None;
    let found = py.detach(|| {
        let (empty, of_empty) = recording.empty_beside()?;
        lost = of_empty;
        of_recording(site.site(), &empty, |take| {
            let of_recording = recording.each(&mut Health::default(), take)?;
            lost = lost.take().or(of_recording);
            Ok(())
        })
    });
    let found = found.map_err(refused)?;
    let toml = write_into(&site.text()?, site.site(), &found).map_err(refused)?;
    let told = found.doubts.iter().chain(&lost).cloned().collect::<Vec<_>>().join("; ");
    if !told.is_empty() {
        warn(py, &format!("look at this before you use the result: {told}"))?;
    }
    let mut all = serde_json::json!({ "toml": toml });
    if let (Some(all), serde_json::Value::Object(of)) = (all.as_object_mut(), serde_json::json!(&found)) {
        all.extend(of);
    }
    from_json(py, &all.to_string())
}
