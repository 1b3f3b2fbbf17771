//! A table as CSV (RFC 4180): numbers as short as they read back exactly, null as nothing.

use std::fmt::Write as _;
use std::fs::File;
use std::path::{Path, PathBuf};

use csv::Writer;
use umbracast::Error;

use super::cells::{Cell, Row};
use super::values::Values;

/// An open CSV file.
#[derive(Debug)]
pub struct CsvFile {
    path: PathBuf,
    writer: Writer<File>,
    access_points: Vec<String>,
}

impl CsvFile {
    pub fn create<R: Row>(path: &Path, access_points: &[String]) -> Result<Self, Error> {
        let mut names = Vec::new();
        R::default().visit(&mut |name, _| names.push(name.to_string()));
        let writer = open(path, &names).map_err(|e| cannot_write(path, &e))?;
        Ok(Self { path: path.to_owned(), writer, access_points: access_points.to_vec() })
    }

    pub fn write<R: Row>(&mut self, rows: &mut [R]) -> Result<(), Error> {
        self.write_rows(rows).map_err(|e| cannot_write(&self.path, &e))
    }

    fn write_rows<R: Row>(&mut self, rows: &mut [R]) -> csv::Result<()> {
        let mut text = String::new();
        for row in rows {
            let mut written = Ok(());
            row.visit(&mut |_, cell| {
                text.clear();
                // Writing to a String cannot fail.
                let _ = match cell {
                    Cell::U32(v) => write!(text, "{v}"),
                    Cell::U64(v) | Cell::MaybeU64(Some(v)) => write!(text, "{v}"),
                    Cell::I64(v) => write!(text, "{v}"),
                    Cell::F64(v) | Cell::MaybeF64(Some(v)) => write!(text, "{v}"),
                    Cell::Bool(v) | Cell::MaybeBool(Some(v)) => write!(text, "{v}"),
                    Cell::MaybeU64(None)
                    | Cell::MaybeBool(None)
                    | Cell::MaybeF64(None)
                    | Cell::MaybeAccessPoint(None)
                    | Cell::MaybeSurface(None) => Ok(()),
                    Cell::AccessPoint(v) | Cell::MaybeAccessPoint(Some(v)) => {
                        write!(text, "{}", self.access_points[*v as usize])
                    }
                    Cell::Action(v) => write!(text, "{}", v.name()),
                    Cell::MaybeSurface(Some(v)) => write!(text, "{v}"),
                };
                if written.is_ok() {
                    written = self.writer.write_field(&text);
                }
            });
            written?;
            self.writer.write_record(None::<&[u8]>)?;
        }
        Ok(self.writer.flush()?)
    }
}

/// Writes a whole table whose columns are known at run time only.
pub fn write_columns(path: &Path, columns: &[(String, Values)]) -> Result<(), Error> {
    let cell = |values: &Values, row: usize| match values {
        Values::F64(v) => v[row].to_string(),
        Values::MaybeF64(v) => v[row].map_or(String::new(), |v| v.to_string()),
        Values::U32(v) => v[row].to_string(),
        Values::Bool(v) => v[row].to_string(),
    };
    let write_all = || -> csv::Result<()> {
        let mut writer = open(path, columns.iter().map(|(name, _)| name))?;
        for row in 0..columns.first().map_or(0, |(_, values)| values.len()) {
            writer.write_record(columns.iter().map(|(_, values)| cell(values, row)))?;
        }
        Ok(writer.flush()?)
    };
    write_all().map_err(|e| cannot_write(path, &e))
}

/// A new file that begins with these names.
fn open<T: AsRef<[u8]>>(path: &Path, names: impl IntoIterator<Item = T>) -> csv::Result<Writer<File>> {
    let mut writer = Writer::from_path(path)?;
    writer.write_record(names)?;
    writer.flush()?;
    Ok(writer)
}

fn cannot_write(path: &Path, error: &csv::Error) -> Error {
    Error::new(format!("{}: cannot be written: {error}", path.display()))
}
