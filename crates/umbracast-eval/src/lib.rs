//! Scores, error budget, tables, figures and the report.
//!
//! Every score is computed from the rows of the tables (`umbracast_io::rows`), so a run in memory and a run
//! read back from files give the same numbers. A scene is scored alone and leaves sums behind; the sums of many
//! scenes are pooled, and the spread between recordings gives the intervals.

pub mod score;
pub mod oracle;
pub mod run;
pub mod report;
pub mod coverage;
pub mod explain;
