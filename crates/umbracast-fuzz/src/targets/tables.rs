//! Tables.

use std::fs;

use umbracast::decide::Action;
use umbracast::radio::Surface;
use umbracast_io::rows::{
    BindingRow, DecisionRow, DetectionRow, LinkRow, LossRow, MatchRow, PeopleLinkRow, PeopleRow, ReportRow,
    TrackRow,
};
use umbracast_io::tables::{self, Cell, Row, describe, path_in};

use super::Target;
use super::files::in_file;

/// A table gives rows that its bytes can hold, with access points that the site has, or an error. The first byte of the
/// input says which table it is.
pub const PARQUET: Target = Target { name: "parquet", corpus: written, check: table };

/// A row takes some bits at least, all columns together.
const ROWS_A_BYTE: usize = 8;

fn access_points() -> [String; 2] {
    ["side", "centre, north"].map(str::to_owned)
}

fn written() -> Vec<Vec<u8>> {
    vec![
        table_of::<PeopleRow>(0),
        table_of::<PeopleLinkRow>(1),
        table_of::<DetectionRow>(2),
        table_of::<MatchRow>(3),
        table_of::<TrackRow>(4),
        table_of::<LinkRow>(5),
        table_of::<LossRow>(6),
        table_of::<DecisionRow>(7),
        table_of::<BindingRow>(8),
        table_of::<ReportRow>(9),
    ]
}

/// Forty rows of which none is like the one before.
fn table_of<R: Row>(kind: u8) -> Vec<u8> {
    let mut counter = 0_u32;
    let mut rows = vec![R::default(); 40];
    for row in &mut rows {
        row.visit(&mut |_, cell| {
            counter += 1;
            match cell {
                Cell::U32(value) => *value = counter,
                Cell::U64(value) => *value = u64::from(counter),
                Cell::MaybeU64(value) => *value = (!counter.is_multiple_of(3)).then_some(counter.into()),
                Cell::I64(value) => *value = i64::from(counter),
                Cell::F64(value) => *value = f64::from(counter) / 3.0,
                Cell::Bool(value) => *value = counter.is_multiple_of(3),
                Cell::MaybeBool(value) => *value = [None, Some(false), Some(true)][counter as usize % 3],
                Cell::MaybeF64(value) => *value = (!counter.is_multiple_of(3)).then_some(0.5),
                Cell::AccessPoint(value) => *value = counter % 2,
                Cell::MaybeAccessPoint(value) => *value = (!counter.is_multiple_of(3)).then_some(counter % 2),
                Cell::Action(value) => *value = Action::ALL[counter as usize % Action::ALL.len()],
                Cell::MaybeSurface(value) => {
                    *value = (!counter.is_multiple_of(3)).then_some(Surface::Wall(counter % 5))
                }
            }
        });
    }
    let folder = tempfile::tempdir().expect("a folder");
    tables::write(folder.path(), &access_points(), false, &rows).expect("the folder can be written to");
    [vec![kind], fs::read(path_in::<R>(folder.path())).expect("it was written")].concat()
}

fn table(input: &[u8]) -> bool {
    let Some((kind, bytes)) = input.split_first() else { return false };
    match kind % 10 {
        0 => rows_of::<PeopleRow>(bytes),
        1 => rows_of::<PeopleLinkRow>(bytes),
        2 => rows_of::<DetectionRow>(bytes),
        3 => rows_of::<MatchRow>(bytes),
        4 => rows_of::<TrackRow>(bytes),
        5 => rows_of::<LinkRow>(bytes),
        6 => rows_of::<LossRow>(bytes),
        7 => rows_of::<DecisionRow>(bytes),
        8 => rows_of::<BindingRow>(bytes),
        _ => rows_of::<ReportRow>(bytes),
    }
}

fn rows_of<R: Row>(bytes: &[u8]) -> bool {
    in_file(&format!("{}.parquet", R::TABLE), bytes, |folder| {
        let known = access_points();
        let mut rows = 0;
        let read = tables::read_each(folder, &known, |group: &[R]| {
            rows += group.len();
            for mut row in group.iter().copied() {
                row.visit(&mut |_, cell| match cell {
                    Cell::AccessPoint(index) | Cell::MaybeAccessPoint(Some(index)) => {
                        assert!((*index as usize) < known.len());
                    }
                    _ => {}
                });
            }
        });
        assert!(rows <= ROWS_A_BYTE * bytes.len(), "{rows} rows out of {} bytes", bytes.len());
        let _ = describe(&path_in::<R>(folder));
        read.is_ok()
    })
}
