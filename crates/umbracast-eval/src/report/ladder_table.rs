//! The ladder of oracles: scores with the known future, first with ever better bodies, then with ever larger errors.

use super::tables::{Table, number, scenes, window};
use crate::run::pooled::{Group, Scores};

/// Windows that are shown.
const WINDOWS: [usize; 3] = [1, 3, 9];

/// The ladder of all scenes; `None` where none was climbed.
pub fn ladder(scores: &Scores) -> Option<Table> {
    let table = of(scores.headline()?);
    (!table.rows.is_empty()).then_some(table)
}

fn of(group: &Group) -> Table {
    let header = ["what is known", "access point", "window", "base rate", "F1", "onset F1"];
    let mut table = Table::new(format!("Ladder of oracles: {}", scenes(group)), 3, &header);
    for row in group.ladder.iter().filter(|row| WINDOWS.contains(&row.window)) {
        table.rows.push(vec![
            row.oracle.to_owned(),
            row.access_point.clone(),
            window(row.window),
            number(row.base_rate, 3),
            number(row.f1, 3),
            number(row.onset_f1, 3),
        ]);
    }
    table
}
