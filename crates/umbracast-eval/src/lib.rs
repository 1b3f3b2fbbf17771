//! Scores, error budget, tables, figures and the report.
//!
//! Every score is computed from the rows of the tables (`umbracast_io::rows`), so a run in memory and a run
//! read back from files give the same numbers. A scene is scored alone and leaves sums behind; the sums of many
//! scenes are pooled, and the spread between recordings gives the intervals.

pub mod fingerprint;
pub mod scene;
#[cfg(test)]
mod hand_made;
pub mod counts;
pub mod bootstrap;
pub mod instances;
pub mod link_counts;
pub mod matching;
pub mod device;
pub mod identity;
pub mod stage1;
pub mod displacement;
pub mod links;
pub mod times;
pub mod true_forecasts;
pub mod oracles;
pub mod true_bodies;
pub mod score;
pub mod ladder;
pub mod labels;
pub mod chain;
pub mod scene_file;
pub mod experiment;
pub mod pooled;
pub mod report;
pub mod coverage;
pub mod explain;
pub mod ablate;
