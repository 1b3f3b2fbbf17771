//! A table as Parquet, through the low-level writer and reader (no arrow crates). Doubles are split into byte
//! streams before compression, which makes them a third smaller; pyarrow, polars and DuckDB read them.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::ParquetError;
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, Length, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type, TypePtr};
use umbracast::Error;
use umbracast::decide::Action;
use umbracast::radio::Surface;

use super::cells::{Cell, Row};
use super::pages::{column_reader, refuse_codec};
use super::values::{Value, Values};
use crate::seam::guarded;

/// An open Parquet file.
pub struct ParquetFile {
    path: PathBuf,
    writer: SerializedFileWriter<File>,
    access_points: Vec<String>,
}

impl std::fmt::Debug for ParquetFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ParquetFile").field("path", &self.path).finish_non_exhaustive()
    }
}

impl ParquetFile {
    pub fn create<R: Row>(path: &Path, access_points: &[String]) -> Result<Self, Error> {
        Self::open(path, access_points, R::TABLE, fields_of::<R>())
    }

    fn open(path: &Path, access_points: &[String], table: &str, fields: Vec<Field>) -> Result<Self, Error> {
        let failed = |e: &dyn std::fmt::Display| cannot_write(path, e);
        let file = File::create(path).map_err(|e| failed(&e))?;
        let (schema, properties) = layout(table, fields).map_err(|e| failed(&e))?;
        let writer = SerializedFileWriter::new(file, schema, Arc::new(properties)).map_err(|e| failed(&e))?;
        Ok(Self { path: path.to_owned(), writer, access_points: access_points.to_vec() })
    }

    /// One row group.
    pub fn write<R: Row>(&mut self, rows: &mut [R]) -> Result<(), Error> {
        let columns = gathered(rows, &self.access_points).map_err(|e| e.within(self.path.display()))?;
        self.write_columns(&columns).map_err(|e| cannot_write(&self.path, &e))
    }

    pub fn finish(self) -> Result<(), Error> {
        self.writer.close().map(drop).map_err(|e| cannot_write(&self.path, &e))
    }

    fn write_columns(&mut self, columns: &[Column]) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for column in columns {
            let Some(mut open) = group.next_column()? else { break };
            match (open.untyped(), column) {
                (ColumnWriter::Int32ColumnWriter(w), Column::Int32(v)) => w.write_batch(v, None, None)?,
                (ColumnWriter::Int64ColumnWriter(w), Column::Int64(v)) => w.write_batch(v, None, None)?,
                (ColumnWriter::Int64ColumnWriter(w), Column::MaybeInt64(v, there)) => {
                    w.write_batch(v, Some(there), None)?
                }
                (ColumnWriter::DoubleColumnWriter(w), Column::Double(v)) => w.write_batch(v, None, None)?,
                (ColumnWriter::ByteArrayColumnWriter(w), Column::Text(v)) => w.write_batch(v, None, None)?,
                (ColumnWriter::ByteArrayColumnWriter(w), Column::MaybeText(v, there)) => {
                    w.write_batch(v, Some(there), None)?
                }
                (ColumnWriter::BoolColumnWriter(w), Column::Bool(v)) => w.write_batch(v, None, None)?,
                (ColumnWriter::BoolColumnWriter(w), Column::MaybeBool(v, there)) => {
                    w.write_batch(v, Some(there), None)?
                }
                (ColumnWriter::DoubleColumnWriter(w), Column::MaybeDouble(v, there)) => {
                    w.write_batch(v, Some(there), None)?
                }
                _ => return Err(ParquetError::General("schema and columns disagree".into())),
            };
            open.close()?;
        }
        group.close().map(drop)
    }
}

/// A row group that says it has more rows is not believed: ours have a scene's, about 10^5.
const ROWS_MAX: u64 = 1 << 24;
/// Nor is one believed that says it has more than so many a byte of the file: a row takes a bit at least, all columns together.
const ROWS_A_BYTE: u64 = 8;

/// What a Parquet file holds, whoever wrote it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableSummary {
    /// How many rows.
    pub rows: u64,
    /// Name and physical type of each column, in their order.
    pub columns: Vec<(String, String)>,
}

/// Reads the end of the file only.
pub fn describe(path: &Path) -> Result<TableSummary, Error> {
    let file = File::open(path).map_err(|e| Error::new(e.to_string()))?;
    let not_parquet =
        |found: &dyn std::fmt::Display| Error::new(format!("expected a Parquet table, found {found}"));
    let reader = guarded(|| SerializedFileReader::new(file)).map_err(|e| not_parquet(&e))?;
    let reader = reader.map_err(|e| not_parquet(&e))?;
    let meta = reader.metadata().file_metadata();
    let columns = meta.schema_descr().columns();
    Ok(TableSummary {
        rows: meta.num_rows().max(0) as u64,
        columns: columns.iter().map(|c| (c.name().to_owned(), c.physical_type().to_string())).collect(),
    })
}

fn cannot_write(path: &Path, error: &dyn std::fmt::Display) -> Error {
    Error::new(format!("{}: cannot be written: {error}", path.display()))
}

/// The values of one column in one row group, as Parquet stores them.
enum Column {
    Int32(Vec<i32>),
    Int64(Vec<i64>),
    Double(Vec<f64>),
    Text(Vec<ByteArray>),
    Bool(Vec<bool>),
    /// The values that are there, and for each row 1 where one is.
    MaybeBool(Vec<bool>, Vec<i16>),
    /// The same.
    MaybeInt64(Vec<i64>, Vec<i16>),
    /// The same.
    MaybeDouble(Vec<f64>, Vec<i16>),
    /// The same.
    MaybeText(Vec<ByteArray>, Vec<i16>),
}

/// Writes a whole table whose columns are known at run time only.
pub fn write_columns(path: &Path, table: &str, columns: &[(String, Values)]) -> Result<(), Error> {
    let field = |(name, values): &(String, Values)| {
        let (physical, logical, needed) = match values {
            Values::F64(_) => (Physical::DOUBLE, None, Repetition::REQUIRED),
            Values::MaybeF64(_) => (Physical::DOUBLE, None, Repetition::OPTIONAL),
            Values::U32(_) => (Physical::INT32, unsigned(32), Repetition::REQUIRED),
            Values::Bool(_) => (Physical::BOOLEAN, None, Repetition::REQUIRED),
        };
        (name.clone(), physical, logical, needed)
    };
    let mut file = ParquetFile::open(path, &[], table, columns.iter().map(field).collect())?;
    let stored = |(_, values): &(String, Values)| match values {
        Values::F64(v) => Column::Double(v.clone()),
        Values::U32(v) => Column::Int32(v.iter().map(|v| v.cast_signed()).collect()),
        Values::Bool(v) => Column::Bool(v.clone()),
        Values::MaybeF64(v) => Column::MaybeDouble(
            v.iter().flatten().copied().collect(),
            v.iter().map(|v| i16::from(v.is_some())).collect(),
        ),
    };
    let stored: Vec<Column> = columns.iter().map(stored).collect();
    file.write_columns(&stored).map_err(|e| cannot_write(path, &e))?;
    file.finish()
}

/// Name, stored as, means, may be null.
type Field = (String, Physical, Option<LogicalType>, Repetition);

fn unsigned(bits: i8) -> Option<LogicalType> {
    Some(LogicalType::integer(bits, false))
}

fn fields_of<R: Row>() -> Vec<Field> {
    let mut fields = Vec::new();
    R::default().visit(&mut |name, cell| {
        let (physical, logical) = match cell {
            Cell::U32(_) => (Physical::INT32, unsigned(32)),
            Cell::U64(_) | Cell::MaybeU64(_) => (Physical::INT64, unsigned(64)),
            Cell::I64(_) => (Physical::INT64, None),
            Cell::F64(_) | Cell::MaybeF64(_) => (Physical::DOUBLE, None),
            Cell::Bool(_) | Cell::MaybeBool(_) => (Physical::BOOLEAN, None),
            Cell::AccessPoint(_) | Cell::MaybeAccessPoint(_) | Cell::Action(_) | Cell::MaybeSurface(_) => {
                (Physical::BYTE_ARRAY, Some(LogicalType::String))
            }
        };
        let needed = if cell.may_be_null() { Repetition::OPTIONAL } else { Repetition::REQUIRED };
        fields.push((name.to_string(), physical, logical, needed));
    });
    fields
}

fn layout(table: &str, fields: Vec<Field>) -> Result<(TypePtr, WriterProperties), ParquetError> {
    let mut properties = WriterProperties::builder().set_compression(Compression::SNAPPY);
    for (name, physical, ..) in &fields {
        if *physical == Physical::DOUBLE {
            let column = ColumnPath::from(name.as_str());
            properties = std::mem::take(&mut properties)
                .set_column_dictionary_enabled(column.clone(), false)
                .set_column_encoding(column, Encoding::BYTE_STREAM_SPLIT);
        }
    }
    let typed = |(name, physical, logical, needed): Field| {
        Type::primitive_type_builder(&name, physical)
            .with_logical_type(logical)
            .with_repetition(needed)
            .build()
            .map(Arc::new)
    };
    let fields = fields.into_iter().map(typed).collect::<Result<Vec<_>, _>>()?;
    let schema = Type::group_type_builder(table).with_fields(fields).build()?;
    Ok((Arc::new(schema), properties.build()))
}

fn gathered<R: Row>(rows: &mut [R], access_points: &[String]) -> Result<Vec<Column>, Error> {
    let mut columns = Vec::new();
    R::default().visit(&mut |_, cell| {
        columns.push(match cell {
            Cell::U32(_) => Column::Int32(Vec::new()),
            Cell::U64(_) | Cell::I64(_) => Column::Int64(Vec::new()),
            Cell::MaybeU64(_) => Column::MaybeInt64(Vec::new(), Vec::new()),
            Cell::F64(_) => Column::Double(Vec::new()),
            Cell::Bool(_) => Column::Bool(Vec::new()),
            Cell::MaybeBool(_) => Column::MaybeBool(Vec::new(), Vec::new()),
            Cell::MaybeF64(_) => Column::MaybeDouble(Vec::new(), Vec::new()),
            Cell::AccessPoint(_) | Cell::Action(_) => Column::Text(Vec::new()),
            Cell::MaybeAccessPoint(_) | Cell::MaybeSurface(_) => Column::MaybeText(Vec::new(), Vec::new()),
        });
    });
    let names: Vec<ByteArray> = access_points.iter().map(|name| name.as_str().into()).collect();
    let mut unknown = None;
    for row in rows {
        let mut column = columns.iter_mut();
        row.visit(&mut |column_name, cell| match (column.next(), cell) {
            (Some(Column::Int32(values)), Cell::U32(v)) => values.push(v.cast_signed()),
            (Some(Column::Int64(values)), Cell::U64(v)) => values.push(v.cast_signed()),
            (Some(Column::Int64(values)), Cell::I64(v)) => values.push(*v),
            (Some(Column::MaybeInt64(values, there)), Cell::MaybeU64(v)) => {
                push(values, there, v.map(u64::cast_signed))
            }
            (Some(Column::Double(values)), Cell::F64(v)) => values.push(*v),
            (Some(Column::Bool(values)), Cell::Bool(v)) => values.push(*v),
            (Some(Column::MaybeBool(values, there)), Cell::MaybeBool(v)) => push(values, there, *v),
            (Some(Column::MaybeDouble(values, there)), Cell::MaybeF64(v)) => push(values, there, *v),
            (Some(Column::Text(values)), Cell::AccessPoint(v)) => match names.get(*v as usize) {
                Some(name) => values.push(name.clone()),
                None => unknown = Some((column_name, *v)),
            },
            (Some(Column::MaybeText(values, there)), Cell::MaybeAccessPoint(v)) => {
                there.push(i16::from(v.is_some()));
                match v.map(|v| (v, names.get(v as usize))) {
                    Some((_, Some(name))) => values.push(name.clone()),
                    Some((v, None)) => unknown = Some((column_name, v)),
                    None => {}
                }
            }
            (Some(Column::Text(values)), Cell::Action(v)) => values.push(v.name().into()),
            (Some(Column::MaybeText(values, there)), Cell::MaybeSurface(v)) => {
                push(values, there, v.map(|v| ByteArray::from(v.to_string().as_str())))
            }
            _ => {}
        });
    }
    match unknown {
        None => Ok(columns),
        Some((column, index)) => Err(Error::new(format!(
            "column {column}: expected an index below {}, found {index}",
            access_points.len()
        ))),
    }
}

fn push<T>(values: &mut Vec<T>, there: &mut Vec<i16>, value: Option<T>) {
    there.push(i16::from(value.is_some()));
    values.extend(value);
}

/// Reads the table row group by row group.
pub fn read<R: Row>(path: &Path, access_points: &[String], mut sink: impl FnMut(&[R])) -> Result<(), Error> {
    let open = || File::open(path).map_err(|e| Error::new(format!("cannot be opened: {e}")));
    let (file, pages) = (open()?, Arc::new(open()?));
    let reader = guarded(|| SerializedFileReader::new(file)).map_err(not_parquet)?.map_err(not_parquet)?;
    let mut rows = Vec::new();
    for i in 0..reader.num_row_groups() {
        let group = reader.metadata().row_group(i);
        guarded(|| read_group(group, &pages, access_points, &mut rows)).map_err(not_parquet)??;
        sink(&rows);
    }
    Ok(())
}

fn not_parquet(found: impl std::fmt::Display) -> Error {
    Error::new(format!("expected a whole Parquet file, found: {found}"))
}

/// How many rows a group has.
fn believed(group: &RowGroupMetaData, file: &Arc<File>) -> Result<usize, Error> {
    let told = group.num_rows();
    let most = file.len().saturating_mul(ROWS_A_BYTE).min(ROWS_MAX);
    let count = u64::try_from(told).ok().filter(|count| *count <= most);
    Ok(count.ok_or_else(|| not_parquet(format!("{told} rows in a group")))? as usize)
}

/// One row group in place of `rows`.
fn read_group<R: Row>(
    group: &RowGroupMetaData,
    file: &Arc<File>,
    access_points: &[String],
    rows: &mut Vec<R>,
) -> Result<(), Error> {
    let count = believed(group, file)?;
    let mut columns = Vec::new();
    let mut failed = None;
    R::default().visit(&mut |name, cell| {
        if failed.is_some() {
            return;
        }
        match read_column(group, file, &name.to_string(), count, &cell, access_points) {
            Ok(column) => columns.push(column.into_iter()),
            Err(error) => failed = Some(error.within(format!("column {name}"))),
        }
    });
    if let Some(error) = failed {
        return Err(error);
    }
    rows.clear();
    rows.resize(count, R::default());
    for row in rows {
        let mut column = columns.iter_mut();
        row.visit(&mut |_, cell| {
            if let Some(value) = column.next().and_then(Iterator::next) {
                value.put(cell);
            }
        });
    }
    Ok(())
}

fn read_column(
    group: &RowGroupMetaData,
    file: &Arc<File>,
    name: &str,
    count: usize,
    cell: &Cell,
    access_points: &[String],
) -> Result<Vec<Value>, Error> {
    let columns = group.columns();
    let at = columns.iter().position(|c| c.column_path().string() == name);
    // Tables of older versions lack columns that came later: those may be empty.
    if at.is_none() && cell.may_be_null() {
        return Ok(vec![Value::Null; count]);
    }
    let expected = match cell {
        Cell::U32(_) | Cell::U64(_) | Cell::MaybeU64(_) | Cell::I64(_) => "whole numbers",
        Cell::F64(_) | Cell::MaybeF64(_) => "real numbers",
        Cell::Bool(_) | Cell::MaybeBool(_) => "true or false",
        Cell::AccessPoint(_) | Cell::MaybeAccessPoint(_) => "names of access points",
        Cell::Action(_) => "names of actions",
        Cell::MaybeSurface(_) => "names of surfaces",
    };
    let at = at.ok_or_else(|| Error::new(format!("expected {expected}, found no such column")))?;
    refuse_codec(columns[at].compression())?;
    let broken = |e: ParquetError| Error::new(format!("expected {expected}, found: {e}"));
    let whole = |v: i64| Value::Whole(v);
    let values = match (column_reader(file, &columns[at], count).map_err(broken)?, cell) {
        (ColumnReader::Int32ColumnReader(r), Cell::U32(_)) => {
            values(r, count, |&v: &i32| whole(i64::from(v.cast_unsigned())))
        }
        (ColumnReader::Int32ColumnReader(r), Cell::U64(_) | Cell::MaybeU64(_) | Cell::I64(_)) => {
            values(r, count, |&v: &i32| whole(i64::from(v)))
        }
        (
            ColumnReader::Int64ColumnReader(r),
            Cell::U32(_) | Cell::U64(_) | Cell::MaybeU64(_) | Cell::I64(_),
        ) => values(r, count, |&v: &i64| whole(v)),
        (ColumnReader::DoubleColumnReader(r), Cell::F64(_) | Cell::MaybeF64(_)) => {
            values(r, count, |&v: &f64| Value::Real(v))
        }
        (ColumnReader::FloatColumnReader(r), Cell::F64(_) | Cell::MaybeF64(_)) => {
            values(r, count, |&v: &f32| Value::Real(f64::from(v)))
        }
        (ColumnReader::BoolColumnReader(r), Cell::Bool(_) | Cell::MaybeBool(_)) => {
            values(r, count, |&v: &bool| Value::Truth(v))
        }
        (
            ColumnReader::ByteArrayColumnReader(r),
            Cell::AccessPoint(_) | Cell::MaybeAccessPoint(_) | Cell::Action(_) | Cell::MaybeSurface(_),
        ) => {
            let known: Vec<&str> = match cell {
                Cell::Action(_) => Action::ALL.iter().map(|action| action.name()).collect(),
                Cell::MaybeSurface(_) => vec!["floor", "ceiling", "wall-0 and so on"],
                _ => access_points.iter().map(String::as_str).collect(),
            };
            let read = |name: &str| match cell {
                Cell::MaybeSurface(_) => name.parse::<Surface>().ok().map(|_| Value::Text(name.to_owned())),
                _ => known.iter().position(|known| *known == name).map(|index| whole(index as i64)),
            };
            let mut unknown = None;
            let found = values(r, count, |name: &ByteArray| {
                let name = String::from_utf8_lossy(name.data());
                read(&name).unwrap_or_else(|| {
                    unknown = Some(name.into_owned());
                    whole(0)
                })
            });
            if let Some(name) = unknown {
                let known = known.join(", ");
                return Err(Error::new(format!("expected one of {known}, found {name:?}")));
            }
            found
        }
        _ => {
            let found = columns[at].column_type();
            return Err(Error::new(format!("expected {expected}, found {found}")));
        }
    }
    .map_err(broken)?;
    let fits = |value: &Value| !matches!((cell, value), (Cell::U32(_), Value::Whole(v)) if u32::try_from(*v).is_err());
    if let Some(row) = values.iter().position(|value| !fits(value)) {
        return Err(Error::new(format!("row {row}: expected 0 to {}, found {}", u32::MAX, values[row])));
    }
    if let (Some(row), false) = (values.iter().position(|v| matches!(v, Value::Null)), cell.may_be_null()) {
        return Err(Error::new(format!("row {row}: expected {expected}, found null")));
    }
    if values.len() != count {
        return Err(Error::new(format!("expected {count} values, found {}", values.len())));
    }
    Ok(values)
}

/// Every column that holds numbers, yes or no, or text: name and values, all row groups. Others are left out.
pub fn read_loose(path: &Path) -> Result<Vec<(String, Vec<Value>)>, Error> {
    let open = || File::open(path).map_err(|e| Error::new(format!("cannot be opened: {e}")));
    let (file, pages) = (open()?, Arc::new(open()?));
    let reader = guarded(|| SerializedFileReader::new(file)).map_err(not_parquet)?.map_err(not_parquet)?;
    let mut table: Vec<(String, Vec<Value>)> = Vec::new();
    for i in 0..reader.num_row_groups() {
        let group = reader.metadata().row_group(i);
        let count = believed(group, &pages)?;
        for column in group.columns() {
            let name = column.column_path().string();
            refuse_codec(column.compression()).map_err(|e| e.within(format!("column {name}")))?;
            let found = guarded(|| loose_values(column_reader(&pages, column, count)?, count));
            let found = found.map_err(not_parquet)?.map_err(not_parquet)?;
            let Some(mut found) = found else { continue };
            match table.iter_mut().find(|(known, _)| *known == name) {
                Some((_, values)) => values.append(&mut found),
                None => table.push((name, found)),
            }
        }
    }
    Ok(table)
}

fn loose_values(reader: ColumnReader, count: usize) -> Result<Option<Vec<Value>>, ParquetError> {
    let text = |v: &ByteArray| Value::Text(String::from_utf8_lossy(v.data()).into_owned());
    Ok(Some(match reader {
        ColumnReader::Int32ColumnReader(r) => values(r, count, |&v: &i32| Value::Whole(v.into()))?,
        ColumnReader::Int64ColumnReader(r) => values(r, count, |&v: &i64| Value::Whole(v))?,
        ColumnReader::FloatColumnReader(r) => values(r, count, |&v: &f32| Value::Real(v.into()))?,
        ColumnReader::DoubleColumnReader(r) => values(r, count, |&v: &f64| Value::Real(v))?,
        ColumnReader::BoolColumnReader(r) => values(r, count, |&v: &bool| Value::Truth(v))?,
        ColumnReader::ByteArrayColumnReader(r) => values(r, count, text)?,
        _ => return Ok(None),
    }))
}

/// All values of a flat column, `Null` where there is none.
fn values<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    count: usize,
    mut convert: impl FnMut(&T::T) -> Value,
) -> Result<Vec<Value>, ParquetError> {
    let (mut stored, mut there, mut repeats) = (Vec::new(), Vec::new(), Vec::new());
    while there.len().max(stored.len()) < count {
        let (records, ..) = reader.read_records(count, Some(&mut there), Some(&mut repeats), &mut stored)?;
        if records == 0 {
            break;
        }
    }
    let mut stored = stored.iter().map(&mut convert);
    if there.is_empty() {
        return Ok(stored.collect());
    }
    Ok(there
        .iter()
        .map(|&level| if level > 0 { stored.next().unwrap_or(Value::Null) } else { Value::Null })
        .collect())
}
