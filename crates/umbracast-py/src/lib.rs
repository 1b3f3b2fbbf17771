//! Umbracast as a Python package: scenes, recordings, the pipeline frame by frame, and own tracks into links.
//!
//! What stands here hands on: files are read, rows are made and scores are counted by the crates that the command calls. Rows become
//! columns by [`umbracast_io::tables::Row::visit`], as in every table. `python/umbracast` holds the names and their stubs.

mod told;
mod columns;
mod table;
mod given;
mod site;
mod frame;
mod outcome;
mod pipeline;
mod scene;
mod recording;
mod own;
mod radio;
mod scores;
mod halls;

use pyo3::prelude::*;

#[pymodule]
mod _umbracast {
    #[pymodule_export]
    use super::frame::Frame;
    #[pymodule_export]
    use super::halls::{calibrate, coverage};
    #[pymodule_export]
    use super::outcome::Outcome;
    #[pymodule_export]
    use super::own::{cast, decide, forecast};
    #[pymodule_export]
    use super::pipeline::Pipeline;
    #[pymodule_export]
    use super::radio::loss_db;
    #[pymodule_export]
    use super::recording::{Frames, Recording, read};
    #[pymodule_export]
    use super::scene::{Scene, simulate};
    #[pymodule_export]
    use super::scores::{Scores, evaluate, matches};
    #[pymodule_export]
    use super::site::Site;
    #[pymodule_export]
    use super::table::Table;

    /// The version of the workspace.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
