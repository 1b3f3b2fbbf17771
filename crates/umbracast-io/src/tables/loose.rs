//! A table of another program: columns by name, in any order and with others between them, each of the kind that it was written
//! in. It becomes rows where a row type has columns of these names.

use std::fs::File;
use std::path::Path;

use umbracast::Error;
use umbracast::decide::Action;

use super::cells::{Cell, Row};
use super::parquet_file;
use super::values::Value;

/// Such a table in memory.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Loose {
    columns: Vec<(String, Vec<Value>)>,
    rows: usize,
    /// By row: its line in a file of text. Empty elsewhere.
    lines: Vec<u64>,
}

impl Loose {
    /// Columns from memory.
    ///
    /// # Errors
    /// Columns of different lengths.
    pub fn new(columns: Vec<(String, Vec<Value>)>) -> Result<Self, Error> {
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        if let Some((name, values)) = columns.iter().find(|(_, values)| values.len() != rows) {
            let (first, found) = (&columns[0].0, values.len());
            return Err(Error::new(format!(
                "column {name}: expected {rows} values as in column {first}, found {found}"
            )));
        }
        Ok(Self { columns, rows, lines: Vec::new() })
    }

    /// A file: CSV with a header, or Parquet.
    ///
    /// # Errors
    /// A file that is not there, of another kind, or damaged: with its name and the line.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let table = match path.extension().and_then(|e| e.to_str()) {
            Some("csv") => Self::read_csv(path),
            Some("parquet") => parquet_file::read_loose(path).and_then(Self::new),
            _ => Err(Error::new("expected a name that ends in .csv or .parquet")),
        };
        table.map_err(|e| e.within(path.display()))
    }

    /// How many rows.
    pub fn len(&self) -> usize {
        self.rows
    }

    /// True without a row.
    pub fn is_empty(&self) -> bool {
        self.rows == 0
    }

    /// The columns' names, in their order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|(name, _)| name.as_str())
    }

    /// The values of a column.
    pub fn column(&self, name: &str) -> Option<&[Value]> {
        self.columns.iter().find(|(known, _)| known == name).map(|(_, values)| &values[..])
    }

    /// Calls a column by another name, where it is there and nothing has the new name.
    pub fn rename(&mut self, from: &str, to: &str) {
        if self.column(to).is_none()
            && let Some((name, _)) = self.columns.iter_mut().find(|(name, _)| name == from)
        {
            to.clone_into(name);
        }
    }

    /// Adds a column, or puts it in the place of the one of this name; it has a value for each row.
    pub fn put(&mut self, name: &str, values: Vec<Value>) {
        match self.columns.iter_mut().find(|(known, _)| known == name) {
            Some((_, old)) => *old = values,
            None => self.columns.push((name.to_owned(), values)),
        }
    }

    /// Where a row stands, in words.
    pub fn place(&self, row: usize) -> String {
        self.lines.get(row).map_or_else(|| format!("row {row}"), |line| format!("line {line}"))
    }

    /// The rows. What has no column, or no value in a row, stays as `missing` has it, where `may_miss` allows it; otherwise it is
    /// asked for.
    ///
    /// # Errors
    /// A column that is not there, or a value of another kind: with column, row or line, expected and found.
    pub fn rows<R: Row>(
        &self,
        access_points: &[String],
        missing: R,
        may_miss: impl Fn(&str) -> bool,
    ) -> Result<Vec<R>, Error> {
        let (mut columns, mut lacking) = (Vec::new(), None);
        R::default().visit(&mut |name, cell| {
            let name = name.to_string();
            let values = self.column(&name);
            if values.is_none() && lacking.is_none() && !cell.may_be_null() && !may_miss(&name) {
                lacking = Some(format!(
                    "column {name}: expected {}, found no such column but {}",
                    kind(&cell),
                    self.columns.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
                ));
            }
            columns.push((name, values));
        });
        if let Some(story) = lacking {
            return Err(Error::new(story));
        }
        let (mut rows, mut wrong) = (vec![missing; self.rows], None);
        for (r, row) in rows.iter_mut().enumerate() {
            let mut column = columns.iter();
            row.visit(&mut |_, cell| {
                let Some((name, Some(values))) = column.next() else { return };
                let expected = kind(&cell);
                let may_stay = values[r] == Value::Null && !cell.may_be_null() && may_miss(name);
                if !may_stay && !set(cell, &values[r], access_points) && wrong.is_none() {
                    let place = self.place(r);
                    wrong = Some(format!("{place}, column {name}: expected {expected}, found {}", values[r]));
                }
            });
            if let Some(story) = wrong {
                return Err(Error::new(story));
            }
        }
        Ok(rows)
    }

    fn read_csv(path: &Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(|e| Error::new(format!("cannot be opened: {e}")))?;
        let mut reader = csv::Reader::from_reader(std::io::BufReader::new(file));
        let told = |e: csv::Error| Error::new(format!("expected CSV with a header, found: {e}"));
        let header = reader.headers().map_err(told)?.clone();
        let mut columns: Vec<(String, Vec<Value>)> =
            header.iter().map(|name| (name.trim().to_owned(), Vec::new())).collect();
        let mut lines = Vec::new();
        for record in reader.records() {
            let record = record.map_err(told)?;
            lines.push(record.position().map_or(0, csv::Position::line));
            for ((_, values), cell) in columns.iter_mut().zip(&record) {
                values.push(of_text(cell.trim()));
            }
        }
        let rows = lines.len();
        Ok(Self { columns, rows, lines })
    }
}

/// A cell of a text.
fn of_text(cell: &str) -> Value {
    match cell {
        "" => Value::Null,
        "true" | "True" => Value::Truth(true),
        "false" | "False" => Value::Truth(false),
        _ => match (cell.parse::<i64>(), cell.parse::<u64>(), cell.parse::<f64>()) {
            (Ok(whole), ..) => Value::Whole(whole),
            (_, Ok(whole), _) => Value::Whole(whole.cast_signed()),
            (_, _, Ok(real)) => Value::Real(real),
            _ => Value::Text(cell.to_owned()),
        },
    }
}

fn kind(cell: &Cell) -> &'static str {
    match cell {
        Cell::U32(_) => "a whole number from 0 to 4294967295",
        Cell::U64(_) | Cell::MaybeU64(_) | Cell::I64(_) => "a whole number",
        Cell::F64(_) | Cell::MaybeF64(_) => "a number",
        Cell::Bool(_) | Cell::MaybeBool(_) => "true or false",
        Cell::AccessPoint(_) | Cell::MaybeAccessPoint(_) => "the name of an access point of the site",
        Cell::Action(_) => "stay, wait, hand-over, prepare or beam",
        Cell::MaybeSurface(_) => "floor, ceiling or wall-0 and so on",
    }
}

/// False where the value is of another kind. What is not a number is nothing where there may be nothing.
fn set(cell: Cell, value: &Value, access_points: &[String]) -> bool {
    let whole = match *value {
        Value::Whole(v) => Some(v),
        Value::Real(v) if v.fract() == 0.0 && v.abs() < 9.0e15 => Some(v as i64),
        Value::Truth(v) => Some(v.into()),
        _ => None,
    };
    let real = match *value {
        Value::Real(v) => Some(v),
        Value::Whole(v) => Some(v as f64),
        _ => None,
    };
    let truth =
        whole.and_then(|v| [Some(false), Some(true)].get(usize::try_from(v).ok()?).copied().flatten());
    let nothing = *value == Value::Null || matches!(value, Value::Real(v) if v.is_nan());
    let access_point = match value {
        Value::Text(name) => access_points.iter().position(|known| known == name).map(|at| at as u32),
        _ => None,
    };
    match cell {
        Cell::U32(to) => put(to, whole.and_then(|v| u32::try_from(v).ok())),
        Cell::U64(to) => put(to, whole.map(i64::cast_unsigned)),
        Cell::MaybeU64(to) => {
            put(to, if nothing { Some(None) } else { whole.map(|v| Some(v.cast_unsigned())) })
        }
        Cell::I64(to) => put(to, whole),
        Cell::F64(to) => put(to, real),
        Cell::Bool(to) => put(to, truth),
        Cell::AccessPoint(to) => put(to, access_point),
        Cell::MaybeF64(to) => put(to, if nothing { Some(None) } else { real.map(Some) }),
        Cell::MaybeBool(to) => put(to, if nothing { Some(None) } else { truth.map(Some) }),
        Cell::MaybeAccessPoint(to) => put(to, if nothing { Some(None) } else { access_point.map(Some) }),
        Cell::Action(to) => match value {
            Value::Text(name) => put(to, Action::ALL.into_iter().find(|action| action.name() == name)),
            _ => false,
        },
        Cell::MaybeSurface(to) => match value {
            Value::Text(name) => put(to, name.parse().ok().map(Some)),
            _ => put(to, nothing.then_some(None)),
        },
    }
}

fn put<T>(to: &mut T, value: Option<T>) -> bool {
    value.map(|value| *to = value).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::{LinkRow, MatchRow, PeopleLinkRow};

    #[test]
    fn what_is_written_as_csv_or_parquet_is_read_as_the_same_rows() {
        let names = ["side".to_owned(), "centre".to_owned()];
        let row = LinkRow {
            frame: 4,
            access_point: 1,
            p_now: 0.1 + 0.2,
            onset_s: [Some(0.3), None, None],
            ..LinkRow::default()
        };
        let rows = [row, LinkRow { frame: 5, p_any: [Some(0.25); 10], ..row }];
        let directory = tempfile::tempdir().unwrap();
        super::super::write(directory.path(), &names, true, &rows).unwrap();
        for file in ["links.csv", "links.parquet"] {
            let table = Loose::read(&directory.path().join(file)).unwrap();
            assert_eq!(table.rows(&names, LinkRow::default(), |_| false).unwrap(), rows, "{file}");
        }
    }

    #[test]
    fn a_value_of_another_kind_is_told_with_line_and_column() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("matches.csv");
        let told = |text: &str| {
            std::fs::write(&path, text).unwrap();
            let table = Loose::read(&path)?;
            table.rows::<MatchRow>(&[], MatchRow::default(), |name| name == "scene")
        };
        let message = told("frame,time_ns,person,track\n1,5,0,0\n2,6,-1,0\n").unwrap_err().to_string();
        assert_eq!(message, "line 3, column person: expected a whole number from 0 to 4294967295, found -1");
        let message = told("frame,time_ns,person,track\n1,5,0,\n").unwrap_err().to_string();
        assert_eq!(message, "line 2, column track: expected a whole number, found null");
        let nothing_of_scene = told("scene,frame,time_ns,person,track\n,1,5,0,3\n").unwrap();
        assert_eq!((nothing_of_scene[0].scene, nothing_of_scene[0].track), (0, 3));
        let message = told("frame,time_ns,person\n1,5,0\n").unwrap_err().to_string();
        assert!(
            message.contains("column track: expected a whole number, found no such column but frame"),
            "{message}"
        );
        let message = told("frame,time_ns\n1,5,0\n").unwrap_err().to_string();
        assert!(message.contains("matches.csv: expected CSV with a header, found"), "{message}");
        assert!(Loose::read(Path::new("tracks.txt")).unwrap_err().to_string().contains(".csv or .parquet"));
    }

    #[test]
    fn columns_of_different_lengths_are_refused_and_what_is_not_a_number_is_nothing() {
        let uneven = vec![("a".to_owned(), vec![Value::Null]), ("b".to_owned(), Vec::new())];
        assert!(Loose::new(uneven).unwrap_err().to_string().contains("column b: expected 1 values"));
        let columns = ["scene", "frame", "time_ns", "person", "blocked", "static_blocked"];
        let mut columns: Vec<_> = columns.map(|name| (name.to_owned(), vec![Value::Real(1.0)])).into();
        columns.push(("access_point".to_owned(), vec![Value::Text("side".to_owned())]));
        columns.push(("self_blocked".to_owned(), vec![Value::Real(f64::NAN)]));
        let rows =
            Loose::new(columns).unwrap().rows(&["side".to_owned()], PeopleLinkRow::default(), |_| false);
        let rows = rows.unwrap();
        assert!(rows[0].blocked && rows[0].self_blocked.is_none() && rows[0].frame == 1);
    }
}
