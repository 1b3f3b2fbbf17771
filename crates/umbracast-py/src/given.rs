//! Tables that Python gives: ours, a `dict` of arrays, or a data frame of pandas, polars or pyarrow.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use umbracast_io::tables::{Loose, Row, Value};

use crate::told::{refused, wrong};

/// The table's columns.
///
/// # Errors
/// Something that has no named columns, or a column of another kind than numbers, yes or no, or text.
pub fn loose(table: &Bound<PyAny>) -> PyResult<Loose> {
    let mut columns = Vec::new();
    for name in names(table)? {
        let column = table.get_item(&name)?;
        columns.push((name.clone(), values(&name, &column)?));
    }
    Loose::new(columns).map_err(refused)
}

/// The rows of a table that has all their columns but those that may be empty.
pub fn rows<R: Row>(table: &Bound<PyAny>, access_points: &[String]) -> PyResult<Vec<R>> {
    let named = |e: umbracast::Error| refused(e.within(format!("table {}", R::TABLE)));
    loose(table)?.rows(access_points, R::default(), |name| name == "scene").map_err(named)
}

fn names(table: &Bound<PyAny>) -> PyResult<Vec<String>> {
    for place in ["column_names", "columns"] {
        if let Some(names) = table.getattr_opt(place)?.filter(|names| !names.is_callable()) {
            // pyarrow has both, and its columns are values.
            if let Ok(names) =
                names.try_iter()?.map(|name| name?.extract()).collect::<PyResult<Vec<String>>>()
            {
                return Ok(names);
            }
        }
    }
    if let Some(keys) = table.getattr_opt("keys")? {
        return keys.call0()?.try_iter()?.map(|name| name?.extract()).collect();
    }
    let found = table.get_type().name()?;
    Err(wrong(format!(
        "expected a table with named columns (a dict of arrays, or a data frame), found {found}"
    )))
}

fn values(name: &str, column: &Bound<PyAny>) -> PyResult<Vec<Value>> {
    let numpy = column.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (column,))?;
    let (kind, dimensions): (String, usize) =
        (array.getattr("dtype")?.getattr("kind")?.extract()?, array.getattr("ndim")?.extract()?);
    if dimensions != 1 {
        return Err(wrong(format!("column {name}: expected one dimension, found {dimensions}")));
    }
    let cast = |kind: &str| numpy.call_method1("ascontiguousarray", (&array, kind));
    match kind.as_str() {
        "b" => Ok(mapped(&cast("bool")?, |v: bool| Value::Truth(v))?),
        "i" => Ok(mapped(&cast("int64")?, Value::Whole)?),
        "u" => Ok(mapped(&cast("uint64")?, |v: u64| Value::Whole(v.cast_signed()))?),
        "f" => Ok(mapped(&cast("float64")?, Value::Real)?),
        "M" | "m" => Ok(mapped(
            &numpy.call_method1(
                "ascontiguousarray",
                (
                    array.call_method1(
                        "astype",
                        (format!("{kind}8[ns]").replace("M8", "datetime64").replace("m8", "timedelta64"),),
                    )?,
                    "int64",
                ),
            )?,
            Value::Whole,
        )?),
        "U" | "O" | "S" | "T" => array.try_iter()?.map(|value| one(name, &value?)).collect(),
        found => Err(wrong(format!(
            "column {name}: expected numbers, yes or no, or text, found NumPy's kind {found:?}"
        ))),
    }
}

fn mapped<T: numpy::Element + Copy>(
    array: &Bound<PyAny>,
    value: impl Fn(T) -> Value,
) -> PyResult<Vec<Value>> {
    let array = array.cast::<PyArray1<T>>()?.readonly();
    Ok(array.as_slice()?.iter().map(|&v| value(v)).collect())
}

fn one(name: &str, value: &Bound<PyAny>) -> PyResult<Value> {
    if value.is_none() {
        return Ok(Value::Null);
    }
    if let Ok(truth) = value.extract::<bool>() {
        return Ok(Value::Truth(truth));
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(Value::Text(text));
    }
    if let Ok(whole) = value.extract::<i64>() {
        return Ok(Value::Whole(whole));
    }
    let real = value.extract::<f64>().map(Value::Real);
    real.map_err(|_| wrong(format!("column {name}: expected numbers, yes or no, or text, found {value}")))
}
