//! A table as CSV (RFC 4180): numbers as short as they read back exactly, null as nothing.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use umbracast::Error;

use super::{Cell, Row, Values};

/// An open CSV file.
#[derive(Debug)]
pub struct CsvFile {
    path: PathBuf,
    file: File,
    access_points: Vec<String>,
}

impl CsvFile {
    pub fn create<R: Row>(path: &Path, access_points: &[String]) -> Result<Self, Error> {
        let failed = |e| Error::new(format!("{}: cannot be written: {e}", path.display()));
        let mut file = File::create(path).map_err(failed)?;
        let mut names = Vec::new();
        R::default().visit(&mut |name, _| names.push(name.to_string()));
        writeln!(file, "{}", names.join(",")).map_err(failed)?;
        let access_points = access_points.iter().map(|name| quoted(name)).collect();
        Ok(Self { path: path.to_owned(), file, access_points })
    }

    pub fn write<R: Row>(&mut self, rows: &mut [R]) -> Result<(), Error> {
        let mut text = String::new();
        for row in rows {
            row.visit(&mut |_, cell| {
                // Writing to a String cannot fail.
                let _ = match cell {
                    Cell::U32(v) => write!(text, "{v},"),
                    Cell::U64(v) => write!(text, "{v},"),
                    Cell::I64(v) => write!(text, "{v},"),
                    Cell::F64(v) => write!(text, "{v},"),
                    Cell::Bool(v) | Cell::MaybeBool(Some(v)) => write!(text, "{v},"),
                    Cell::MaybeF64(Some(v)) => write!(text, "{v},"),
                    Cell::MaybeBool(None) | Cell::MaybeF64(None) => write!(text, ","),
                    Cell::AccessPoint(v) => write!(text, "{},", self.access_points[*v as usize]),
                };
            });
            text.pop();
            text.push('\n');
        }
        let failed = |e| Error::new(format!("{}: cannot be written: {e}", self.path.display()));
        self.file.write_all(text.as_bytes()).map_err(failed)
    }
}

/// Writes a whole table whose columns are known at run time only.
pub fn write_columns(path: &Path, columns: &[(String, Values)]) -> Result<(), Error> {
    let names: Vec<String> = columns.iter().map(|(name, _)| quoted(name)).collect();
    let mut text = names.join(",") + "\n";
    let cell = |values: &Values, row: usize| match values {
        Values::F64(v) => v[row].to_string(),
        Values::MaybeF64(v) => v[row].map_or(String::new(), |v| v.to_string()),
        Values::U32(v) => v[row].to_string(),
        Values::Bool(v) => v[row].to_string(),
    };
    for row in 0..columns.first().map_or(0, |(_, values)| values.len()) {
        let cells: Vec<String> = columns.iter().map(|(_, values)| cell(values, row)).collect();
        text += &(cells.join(",") + "\n");
    }
    let failed = |e| Error::new(format!("{}: cannot be written: {e}", path.display()));
    std::fs::write(path, text).map_err(failed)
}

fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
