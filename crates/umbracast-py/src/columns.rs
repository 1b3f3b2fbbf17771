//! Rows as Arrow columns, of the names and kinds that `Row::visit` gives them.

use std::sync::Arc;

use arrow_array::{
    ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray, UInt32Array, UInt64Array,
};
use arrow_buffer::NullBuffer;
use arrow_schema::{DataType, Field, Schema};
use pyo3::prelude::*;
use umbracast_io::tables::{Cell, Row, Values};

use crate::told::wrong;

/// A column while rows are read.
enum Column<'a> {
    U32(Vec<u32>),
    U64(Vec<u64>),
    MaybeU64(Vec<Option<u64>>),
    I64(Vec<i64>),
    F64(Vec<f64>),
    MaybeF64(Vec<f64>, Vec<bool>),
    Bool(Vec<Option<bool>>, bool),
    Text(Vec<Option<&'a str>>, bool),
    /// Names that no list holds; any may be null.
    Named(Vec<Option<String>>),
}

/// The columns of rows. `access_points` are the site's names, by index.
///
/// # Errors
/// An access point that the site has not.
pub fn of_rows<R: Row>(rows: &[R], access_points: &[String]) -> PyResult<RecordBatch> {
    let (mut names, mut columns) = (Vec::new(), Vec::new());
    R::default().visit(&mut |name, cell| {
        names.push(name.to_string());
        columns.push(match cell {
            Cell::U32(_) => Column::U32(Vec::with_capacity(rows.len())),
            Cell::U64(_) => Column::U64(Vec::with_capacity(rows.len())),
            Cell::MaybeU64(_) => Column::MaybeU64(Vec::with_capacity(rows.len())),
            Cell::I64(_) => Column::I64(Vec::with_capacity(rows.len())),
            Cell::F64(_) => Column::F64(Vec::with_capacity(rows.len())),
            Cell::MaybeF64(_) => Column::MaybeF64(Vec::with_capacity(rows.len()), Vec::new()),
            Cell::Bool(_) => Column::Bool(Vec::new(), false),
            Cell::MaybeBool(_) => Column::Bool(Vec::new(), true),
            Cell::AccessPoint(_) | Cell::Action(_) => Column::Text(Vec::new(), false),
            Cell::MaybeAccessPoint(_) => Column::Text(Vec::new(), true),
            Cell::MaybeSurface(_) => Column::Named(Vec::new()),
        });
    });
    let mut unknown = None;
    let mut name_of = |index: u32| {
        let name = access_points.get(index as usize).map(String::as_str);
        unknown = unknown.or(name.is_none().then_some(index));
        name
    };
    for &row in rows {
        let (mut row, mut column) = (row, columns.iter_mut());
        row.visit(&mut |_, cell| match (column.next(), cell) {
            (Some(Column::U32(values)), Cell::U32(v)) => values.push(*v),
            (Some(Column::U64(values)), Cell::U64(v)) => values.push(*v),
            (Some(Column::MaybeU64(values)), Cell::MaybeU64(v)) => values.push(*v),
            (Some(Column::I64(values)), Cell::I64(v)) => values.push(*v),
            (Some(Column::F64(values)), Cell::F64(v)) => values.push(*v),
            (Some(Column::MaybeF64(values, there)), Cell::MaybeF64(v)) => {
                // NumPy, which knows no null, reads the same values: not a number.
                values.push(v.unwrap_or(f64::NAN));
                there.push(v.is_some());
            }
            (Some(Column::Bool(values, _)), Cell::Bool(v)) => values.push(Some(*v)),
            (Some(Column::Bool(values, _)), Cell::MaybeBool(v)) => values.push(*v),
            (Some(Column::Text(values, _)), Cell::AccessPoint(v)) => values.push(name_of(*v)),
            (Some(Column::Text(values, _)), Cell::MaybeAccessPoint(v)) => {
                values.push(v.and_then(&mut name_of))
            }
            (Some(Column::Text(values, _)), Cell::Action(v)) => values.push(Some(v.name())),
            (Some(Column::Named(values)), Cell::MaybeSurface(v)) => values.push(v.map(|v| v.to_string())),
            _ => {}
        });
    }
    if let Some(index) = unknown {
        let most = access_points.len();
        return Err(wrong(format!("access_point: expected an index below {most}, found {index}")));
    }
    batch(names.into_iter().zip(columns.into_iter().map(made)))
}

/// Columns that are known at run time only.
///
/// # Errors
/// Columns of different lengths.
pub fn of_values(columns: Vec<(String, Values)>) -> PyResult<RecordBatch> {
    let made = |values: Values| match values {
        Values::F64(values) => made(Column::F64(values)),
        Values::MaybeF64(values) => {
            let there = values.iter().map(Option::is_some).collect();
            made(Column::MaybeF64(values.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect(), there))
        }
        Values::U32(values) => made(Column::U32(values)),
        Values::Bool(values) => made(Column::Bool(values.into_iter().map(Some).collect(), false)),
    };
    batch(columns.into_iter().map(|(name, values)| (name, made(values))))
}

fn made(column: Column) -> (ArrayRef, bool) {
    match column {
        Column::U32(values) => (Arc::new(UInt32Array::from(values)), false),
        Column::U64(values) => (Arc::new(UInt64Array::from(values)), false),
        Column::MaybeU64(values) => (Arc::new(UInt64Array::from(values)), true),
        Column::I64(values) => (Arc::new(Int64Array::from(values)), false),
        Column::F64(values) => (Arc::new(Float64Array::from(values)), false),
        Column::MaybeF64(values, there) => {
            (Arc::new(Float64Array::new(values.into(), Some(NullBuffer::from(there)))), true)
        }
        Column::Bool(values, maybe) => (Arc::new(BooleanArray::from(values)), maybe),
        Column::Text(values, maybe) => (Arc::new(StringArray::from(values)), maybe),
        Column::Named(values) => (Arc::new(StringArray::from(values)), true),
    }
}

fn batch(columns: impl Iterator<Item = (String, (ArrayRef, bool))>) -> PyResult<RecordBatch> {
    let (mut fields, mut arrays) = (Vec::new(), Vec::new());
    for (name, (array, maybe)) in columns {
        let kind: DataType = array.data_type().clone();
        fields.push(Field::new(name, kind, maybe));
        arrays.push(array);
    }
    RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays).map_err(|e| wrong(e.to_string()))
}
