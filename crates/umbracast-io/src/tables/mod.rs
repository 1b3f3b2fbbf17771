//! The tables of a run as files: Parquet, and CSV beside it where asked for. Each row type is a table, and each field
//! is a column with its unit in the name. Files are written in pieces of bounded size, so a run may last for ever.
//!
//! Columns are found by name, so a table that another program wrote, with columns in another order or with more
//! of them, reads as well. Same rows, same bytes.

mod cells;
mod values;
mod pages;
mod parquet_file;
mod csv_file;
mod loose;

use std::path::{Path, PathBuf};

use umbracast::Error;

pub use cells::{Cell, Name, Row};
use csv_file::CsvFile;
pub use loose::Loose;
use parquet_file::ParquetFile;
pub use parquet_file::TableSummary;
pub use values::{Value, Values};

/// Rows held back until they are written together.
const ROW_GROUP: usize = 65_536;

/// Writes one table.
#[derive(Debug)]
pub struct TableWriter<R: Row> {
    parquet: ParquetFile,
    csv: Option<CsvFile>,
    waiting: Vec<R>,
}

/// The path of a table in a run's directory.
pub fn path_in<R: Row>(directory: &Path) -> PathBuf {
    directory.join(R::TABLE).with_extension("parquet")
}

impl<R: Row> TableWriter<R> {
    /// Starts `directory/TABLE.parquet`, and `directory/TABLE.csv` where asked for, over whatever is there.
    /// `access_points` are the site's names, by index.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(directory: &Path, access_points: &[String], csv: bool) -> Result<Self, Error> {
        let path = path_in::<R>(directory);
        let csv =
            csv.then(|| CsvFile::create::<R>(&path.with_extension("csv"), access_points)).transpose()?;
        Ok(Self { parquet: ParquetFile::create::<R>(&path, access_points)?, csv, waiting: Vec::new() })
    }

    /// Adds rows in their order.
    ///
    /// # Errors
    /// A disk that is full or gone, or an access point that the site does not have.
    pub fn write(&mut self, rows: &[R]) -> Result<(), Error> {
        for &row in rows {
            self.waiting.push(row);
            if self.waiting.len() == ROW_GROUP {
                self.flush()?;
            }
        }
        Ok(())
    }

    /// Writes what waits and the end of the file; without it the file cannot be read.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn finish(mut self) -> Result<(), Error> {
        self.flush()?;
        self.parquet.finish()
    }

    fn flush(&mut self) -> Result<(), Error> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        self.parquet.write(&mut self.waiting)?;
        if let Some(csv) = &mut self.csv {
            csv.write(&mut self.waiting)?;
        }
        self.waiting.clear();
        Ok(())
    }
}

/// Writes a whole table at once.
///
/// # Errors
/// As [`TableWriter`].
pub fn write<R: Row>(directory: &Path, access_points: &[String], csv: bool, rows: &[R]) -> Result<(), Error> {
    let mut writer = TableWriter::create(directory, access_points, csv)?;
    writer.write(rows)?;
    writer.finish()
}

/// Writes `directory/TABLE.parquet` and `directory/TABLE.csv` with columns that are known at run time only.
///
/// # Errors
/// Columns of different lengths, or a file that cannot be written.
pub fn write_columns(directory: &Path, table: &str, columns: &[(String, Values)]) -> Result<(), Error> {
    let rows = columns.first().map_or(0, |(_, values)| values.len());
    if let Some((name, values)) = columns.iter().find(|(_, values)| values.len() != rows) {
        let found = values.len();
        return Err(Error::new(format!("table {table}: column {name}: expected {rows} rows, found {found}")));
    }
    let path = directory.join(table);
    parquet_file::write_columns(&path.with_extension("parquet"), table, columns)?;
    csv_file::write_columns(&path.with_extension("csv"), columns)
}

/// Reads `directory/TABLE.parquet`.
///
/// # Errors
/// A file that is not there, is cut off, lacks a column, has one of another kind, or names an access point that
/// the site does not have: with file, column, expected and found.
pub fn read<R: Row>(directory: &Path, access_points: &[String]) -> Result<Vec<R>, Error> {
    let mut all = Vec::new();
    read_each(directory, access_points, |rows| all.extend_from_slice(rows))?;
    Ok(all)
}

/// Reads the same in pieces, for tables larger than memory: `sink` gets the rows in their order.
///
/// # Errors
/// As [`read`].
pub fn read_each<R: Row>(
    directory: &Path,
    access_points: &[String],
    sink: impl FnMut(&[R]),
) -> Result<(), Error> {
    let path = path_in::<R>(directory);
    parquet_file::read(&path, access_points, sink).map_err(|error| error.within(path.display()))
}

/// Rows and columns of any Parquet file, from its end alone.
///
/// # Errors
/// A file that is not there, is cut off, or is something else.
pub fn describe(path: &Path) -> Result<TableSummary, Error> {
    parquet_file::describe(path).map_err(|error| error.within(path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::{
        DecisionRow, DetectionRow, LinkRow, LossRow, MatchRow, PeopleLinkRow, PeopleRow, TrackRow,
    };
    use umbracast::STEPS;
    use umbracast::decide::Action;
    use umbracast::radio::Surface;

    fn access_points() -> Vec<String> {
        vec!["side".into(), "centre, north".into()]
    }

    #[test]
    fn columns_known_at_run_time_are_written_with_their_nulls() {
        let directory = tempfile::tempdir().unwrap();
        let columns = [
            ("x_m".to_owned(), Values::F64(vec![0.5, -1.0])),
            ("returns_a, b".to_owned(), Values::MaybeF64(vec![None, Some(2.25)])),
            ("seeing".to_owned(), Values::U32(vec![1, u32::MAX])),
            ("blocked".to_owned(), Values::Bool(vec![true, false])),
        ];
        write_columns(directory.path(), "coverage", &columns).unwrap();
        let csv = std::fs::read_to_string(directory.path().join("coverage.csv")).unwrap();
        let expected = "x_m,\"returns_a, b\",seeing,blocked\n0.5,,1,true\n-1,2.25,4294967295,false\n";
        assert_eq!(csv, expected);
        let described = describe(&directory.path().join("coverage.parquet")).unwrap();
        assert_eq!(described.rows, 2);
        assert!(described.columns.contains(&("returns_a, b".to_owned(), "DOUBLE".to_owned())));
        let uneven = [columns[0].clone(), ("y_m".to_owned(), Values::F64(vec![1.0]))];
        let message = write_columns(directory.path(), "uneven", &uneven).unwrap_err().to_string();
        assert!(message.contains("y_m: expected 2 rows, found 1"), "{message}");
    }

    /// One damaged Parquet table in 170 once ended the program, by a panic inside the reader's crate.
    #[test]
    fn a_damaged_parquet_table_is_an_error_or_a_table() {
        let directory = tempfile::tempdir().unwrap();
        let rows: Vec<MatchRow> = (0..200).map(|k| MatchRow { frame: k, ..MatchRow::default() }).collect();
        write(directory.path(), &access_points(), false, &rows).unwrap();
        let path = path_in::<MatchRow>(directory.path());
        let whole = std::fs::read(&path).unwrap();
        let mut random = 0x9E37_79B9_7F4A_7C15_u64;
        let mut below = |most: usize| {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            (random >> 16) as usize % most
        };
        let mut refused = 0;
        for _ in 0..4000 {
            let mut bytes = whole.clone();
            // The last bytes are the file's own description, where lengths and types stand.
            let at = bytes.len() - 1 - below(bytes.len().min(600));
            bytes[at] = below(256) as u8;
            std::fs::write(&path, &bytes).unwrap();
            refused += usize::from(read::<MatchRow>(directory.path(), &access_points()).is_err());
            let _ = describe(&path);
        }
        assert!(refused > 1000, "{refused}: nothing was damaged");
    }

    fn columns<R: Row>() -> Vec<String> {
        let mut names = Vec::new();
        R::default().visit(&mut |name, _| names.push(name.to_string()));
        names
    }

    /// Rows in which every cell differs from its neighbours.
    fn rows<R: Row>(count: usize) -> Vec<R> {
        let mut counter = 0_u32;
        let mut fill = |_: Name, cell: Cell| {
            counter += 1;
            match cell {
                Cell::U32(v) => *v = u32::MAX - counter,
                Cell::U64(v) => *v = u64::MAX - u64::from(counter),
                Cell::MaybeU64(v) => *v = (!counter.is_multiple_of(3)).then(|| u64::MAX - u64::from(counter)),
                Cell::I64(v) => *v = -i64::from(counter),
                Cell::F64(v) => *v = f64::from(counter) / 3.0,
                Cell::Bool(v) => *v = counter.is_multiple_of(3),
                Cell::MaybeBool(v) => *v = [None, Some(false), Some(true)][counter as usize % 3],
                Cell::MaybeF64(v) => *v = (!counter.is_multiple_of(3)).then(|| f64::from(counter) / 3.0),
                Cell::AccessPoint(v) => *v = counter % 2,
                Cell::MaybeAccessPoint(v) => *v = [None, Some(0), Some(1)][counter as usize % 3],
                Cell::Action(v) => *v = Action::ALL[counter as usize % 5],
                Cell::MaybeSurface(v) => {
                    *v = [None, Some(Surface::Floor), Some(Surface::Wall(counter))][counter as usize % 3]
                }
            }
        };
        let mut rows = vec![R::default(); count];
        rows.iter_mut().for_each(|row| row.visit(&mut fill));
        rows
    }

    fn survives<R: Row + PartialEq + std::fmt::Debug>(count: usize) {
        let directory = tempfile::tempdir().unwrap();
        let written = rows::<R>(count);
        write(directory.path(), &access_points(), false, &written).unwrap();
        assert_eq!(read::<R>(directory.path(), &access_points()).unwrap(), written);
    }

    #[test]
    fn every_table_survives_a_round_trip() {
        survives::<PeopleRow>(50);
        survives::<PeopleLinkRow>(50);
        survives::<TrackRow>(50);
        survives::<LinkRow>(50);
        survives::<DetectionRow>(50);
        survives::<MatchRow>(50);
        survives::<LossRow>(50);
        survives::<DecisionRow>(50);
    }

    #[test]
    fn a_table_of_several_row_groups_and_an_empty_one_survive() {
        survives::<PeopleLinkRow>(ROW_GROUP + 7);
        survives::<PeopleRow>(0);
    }

    #[test]
    fn columns_are_those_of_the_conventions() {
        let keys = ["scene", "frame", "time_ns"];
        for names in [columns::<PeopleRow>(), columns::<PeopleLinkRow>(), columns::<TrackRow>()] {
            assert_eq!(names[..3], keys);
        }
        let links = columns::<LinkRow>();
        assert_eq!(links.len(), 3 + 2 + 2 * (1 + STEPS) + 2 * 3 + 3 * (1 + STEPS));
        assert!(
            ["blocked_now", "blocked_w1", "blocked_w9", "p_now", "p_w9", "onset_p10_s", "duration_p90_s"]
                .iter()
                .all(|c| links.contains(&(*c).into()))
        );
        let losses = columns::<LossRow>();
        assert_eq!(losses.len(), 3 + 2 + (3 + 1) * (1 + STEPS) + 2 * 3);
        assert!(
            ["loss_now_p10_db", "loss_s9_p90_db", "p_out_now", "p_out_w9", "out_onset_p50_s"]
                .iter()
                .all(|c| losses.contains(&(*c).into()))
        );
        let tracks = columns::<TrackRow>();
        assert!(
            ["x_s1_m", "cov_xx_s1_m2", "y_s9_m", "cov_yy_s9_m2"]
                .iter()
                .all(|c| tracks.contains(&(*c).into()))
        );
    }

    #[test]
    fn same_rows_give_the_same_bytes() {
        let bytes = [0, 1].map(|_| {
            let directory = tempfile::tempdir().unwrap();
            write(directory.path(), &access_points(), true, &rows::<TrackRow>(300)).unwrap();
            ["tracks.parquet", "tracks.csv"].map(|name| std::fs::read(directory.path().join(name)).unwrap())
        });
        assert_eq!(bytes[0], bytes[1]);
    }

    #[test]
    fn numbers_in_csv_are_as_short_as_they_read_back() {
        let directory = tempfile::tempdir().unwrap();
        let row = DetectionRow {
            frame: u64::MAX,
            time_ns: -1,
            x_m: -1.0,
            y_m: 0.1 + 0.2,
            covariance_m2: [Some(1e-7), None, Some(f64::MIN_POSITIVE)],
            top_m: f64::NAN,
            ..Default::default()
        };
        write(directory.path(), &[], true, &[row]).unwrap();
        let text = std::fs::read_to_string(directory.path().join("detections.csv")).unwrap();
        let line = text.lines().nth(1).unwrap();
        assert!(
            line.starts_with("0,18446744073709551615,-1,-1,0.30000000000000004,0.0000001,,0.0"),
            "{line}"
        );
        let tiny: f64 = line.split(',').nth(7).unwrap().parse().unwrap();
        assert_eq!(tiny, f64::MIN_POSITIVE);
        assert!(line.contains(",0,NaN,0,0"), "{line}");
    }

    #[test]
    fn csv_has_a_header_null_as_nothing_and_names_with_commas_in_quotes() {
        let directory = tempfile::tempdir().unwrap();
        let row =
            PeopleLinkRow { frame: 4, time_ns: 500, access_point: 1, blocked: true, ..Default::default() };
        write(directory.path(), &access_points(), true, &[row]).unwrap();
        let text = std::fs::read_to_string(directory.path().join("people_links.csv")).unwrap();
        let expected = "scene,frame,time_ns,access_point,person,blocked,static_blocked,self_blocked\n\
                        0,4,500,\"centre, north\",0,true,false,\n";
        assert_eq!(text, expected);
    }

    /// Tables of runs before these columns were there are read as well.
    #[test]
    fn a_column_that_may_be_empty_may_be_missing() {
        #[derive(Clone, Copy, Default)]
        struct Older(LinkRow);
        impl Row for Older {
            const TABLE: &'static str = LinkRow::TABLE;
            fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
                self.0.visit(&mut |name, cell| {
                    if !cell.may_be_null() {
                        see(name, cell);
                    }
                });
            }
        }
        let directory = tempfile::tempdir().unwrap();
        let row = LinkRow { frame: 7, p_now: 0.25, ..LinkRow::default() };
        write(directory.path(), &access_points(), false, &[Older(row)]).unwrap();
        assert_eq!(read::<LinkRow>(directory.path(), &access_points()).unwrap(), [row]);
    }

    fn error_of<R: Row + std::fmt::Debug>(directory: &Path, access_points: &[String]) -> String {
        read::<R>(directory, access_points).unwrap_err().to_string()
    }

    #[test]
    fn an_unknown_access_point_is_named_with_those_expected() {
        let directory = tempfile::tempdir().unwrap();
        write(directory.path(), &access_points(), false, &rows::<LinkRow>(3)).unwrap();
        let message = error_of::<LinkRow>(directory.path(), &["side".into()]);
        assert!(message.contains("links.parquet: column access_point: expected one of side"), "{message}");
        assert!(message.contains("found \"centre, north\""), "{message}");
    }

    #[test]
    fn a_missing_file_and_a_cut_one_are_named() {
        let directory = tempfile::tempdir().unwrap();
        let message = error_of::<LinkRow>(directory.path(), &access_points());
        assert!(message.contains("links.parquet: cannot be opened"), "{message}");
        write(directory.path(), &access_points(), false, &rows::<LinkRow>(30)).unwrap();
        let path = path_in::<LinkRow>(directory.path());
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        let message = error_of::<LinkRow>(directory.path(), &access_points());
        assert!(message.contains("links.parquet: expected a whole Parquet file"), "{message}");
    }

    #[test]
    fn a_missing_column_is_named_with_what_it_should_hold() {
        let directory = tempfile::tempdir().unwrap();
        write(directory.path(), &access_points(), false, &rows::<PeopleRow>(3)).unwrap();
        std::fs::rename(path_in::<PeopleRow>(directory.path()), path_in::<LinkRow>(directory.path()))
            .unwrap();
        let message = error_of::<LinkRow>(directory.path(), &access_points());
        assert!(
            message.contains("column access_point: expected names of access points, found no such"),
            "{message}"
        );
    }
}
