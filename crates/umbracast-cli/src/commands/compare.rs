//! `compare`: the main figures of several reports in one table.

use umbracast::Error;
use umbracast_eval::report::compare;

use crate::args::{Common, Compare};
use crate::ending::Ending;
use crate::{say, setup};

/// Reads `scores.json` of every report.
pub fn run(args: &Compare, common: &Common) -> Result<Ending, Error> {
    let mut rows = Vec::new();
    for folder in &args.reports {
        let path = folder.join("scores.json");
        let name = folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy();
        rows.extend(compare::rows(&name, &setup::read(&path)?).map_err(|e| e.within(path.display()))?);
    }
    match common.json {
        true => say::line(format_args!("{:#}", serde_json::json!(rows))),
        false => say::text(&compare::to_text(&rows)),
    }
    Ok(Ending::Done)
}
