//! A table as CSV (RFC 4180): numbers as short as they read back exactly, null as nothing.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use umbracast::Error;

use super::{Cell, Row};

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
                    Cell::MaybeBool(None) => write!(text, ","),
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

fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
