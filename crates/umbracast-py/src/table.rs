//! A table of results: columns that NumPy, polars, pandas and pyarrow read where they lie.

use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::{Float64Type, Int64Type, UInt32Type, UInt64Type};
use arrow_array::{Array, ArrowPrimitiveType, PrimitiveArray, RecordBatch, RecordBatchIterator};
use arrow_schema::{DataType, ffi::FFI_ArrowSchema};
use numpy::ndarray::ArrayView1;
use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyList};
use umbracast_io::tables::Row;

use crate::columns;
use crate::told::wrong;

/// Columns of equal length, each with its name. Nothing changes a table once it is made.
#[pyclass(frozen, module = "umbracast")]
pub struct Table {
    batch: RecordBatch,
}

impl Table {
    /// The table of rows. `access_points` are the site's names, by index.
    pub fn of_rows<R: Row>(rows: &[R], access_points: &[String]) -> PyResult<Self> {
        Ok(Self { batch: columns::of_rows(rows, access_points)? })
    }

    /// The table of columns that are known at run time only.
    pub fn of_values(values: Vec<(String, umbracast_io::tables::Values)>) -> PyResult<Self> {
        Ok(Self { batch: columns::of_values(values)? })
    }
}

#[pymethods]
impl Table {
    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    fn __repr__(&self) -> String {
        let names = self.keys();
        let first = names[..names.len().min(8)].join(", ");
        let more = names.len().saturating_sub(8);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("Table of {} rows: {first}{more}", self.batch.num_rows())
    }

    fn __contains__(&self, name: &str) -> bool {
        self.batch.schema_ref().column_with_name(name).is_some()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyList::new(py, self.keys())?.try_iter()?.into_any())
    }

    /// The names of the columns, in their order.
    fn keys(&self) -> Vec<String> {
        self.batch.schema_ref().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// A column as a NumPy array: numbers where they lie, read only; null is NaN, and `None` among names.
    fn __getitem__<'py>(this: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let (py, table) = (this.py(), this.get());
        let Some(column) = table.batch.column_by_name(name) else {
            let known = table.keys().join(", ");
            return Err(PyKeyError::new_err(format!("expected one of {known}, found {name:?}")));
        };
        match column.data_type() {
            DataType::Float64 => lent(this, column.as_primitive::<Float64Type>()),
            DataType::UInt32 => lent(this, column.as_primitive::<UInt32Type>()),
            DataType::UInt64 if column.null_count() == 0 => lent(this, column.as_primitive::<UInt64Type>()),
            DataType::UInt64 => {
                let value = |v: Option<u64>| v.map_or(f64::NAN, |v| v as f64);
                let values = column.as_primitive::<UInt64Type>().iter().map(value).collect();
                Ok(PyArray1::from_vec(py, values).into_any())
            }
            DataType::Int64 => lent(this, column.as_primitive::<Int64Type>()),
            DataType::Boolean if column.null_count() == 0 => {
                let values: Vec<bool> = column.as_boolean().iter().flatten().collect();
                Ok(PyArray1::from_vec(py, values).into_any())
            }
            DataType::Boolean => {
                let value = |v: Option<bool>| v.map_or(f64::NAN, |v| f64::from(u8::from(v)));
                Ok(PyArray1::from_vec(py, column.as_boolean().iter().map(value).collect()).into_any())
            }
            DataType::Utf8 => {
                let values = PyList::new(py, column.as_string::<i32>().iter())?;
                let numpy = py.import("numpy")?;
                match column.null_count() {
                    0 => numpy.call_method1("array", (values, "str")),
                    _ => numpy.call_method1("array", (values, "object")),
                }
            }
            other => {
                Err(wrong(format!("column {name}: expected numbers, yes or no, or names, found {other}")))
            }
        }
    }

    /// The table by Arrow's C stream interface, which polars, pandas and pyarrow read without a copy. A schema that is asked for is
    /// not followed: the columns have their own kinds.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let batches = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        let stream = FFI_ArrowArrayStream::new(Box::new(batches));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }

    /// The kinds of the columns by Arrow's C interface.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.batch.schema_ref().as_ref());
        PyCapsule::new_with_value(py, schema.map_err(|e| wrong(e.to_string()))?, c"arrow_schema")
    }
}

/// The values of a column as an array that keeps the table alive.
fn lent<'py, T>(this: &Bound<'py, Table>, column: &PrimitiveArray<T>) -> PyResult<Bound<'py, PyAny>>
where
    T: ArrowPrimitiveType,
    T::Native: Element,
{
    let values = ArrayView1::from(&column.values()[..]);
    // SAFETY: the values lie in a buffer of the table's batch. The table is frozen and `batch` is never replaced, so the buffer
    // is neither moved nor freed while the table lives; the array holds the table as its base object. Nobody writes to it: Arrow's
    // buffers are shared and immutable, and the array is made read only before anybody else sees it.
    let array = unsafe { PyArray1::borrow_from_array(&values, this.clone().into_any()) };
    Ok(array.try_readwrite()?.make_nonwriteable().as_any().clone())
}
