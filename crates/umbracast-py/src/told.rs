//! Errors and remarks in Python's words.

use std::ffi::CString;

use pyo3::exceptions::{PyUserWarning, PyValueError};
use pyo3::prelude::*;
use umbracast::{Error, Health};

/// A `ValueError` with the library's own text: file, place, expected and found.
pub fn refused(error: Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The same of a text.
pub fn wrong(story: impl Into<String>) -> PyErr {
    refused(Error::new(story))
}

/// A `UserWarning`: done, but look at this.
pub fn warn(py: Python, told: &str) -> PyResult<()> {
    let text = CString::new(told.replace('\0', " ")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
}

/// An account of what was skipped, as a `dict`.
pub fn of_health<'py>(py: Python<'py>, health: &Health) -> PyResult<Bound<'py, PyAny>> {
    from_json(py, &serde_json::json!(health).to_string())
}

/// What a JSON text says, in Python's types.
pub fn from_json<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (text,))
}
