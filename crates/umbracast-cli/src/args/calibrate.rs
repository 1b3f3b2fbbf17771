//! The arguments of `calibrate`.

use std::path::PathBuf;

use clap::Args;

use super::{CaptureArgs, SiteArgs};

/// `calibrate`
#[derive(Debug, Args)]
pub struct Calibrate {
    /// A scene of a minute or more in which people walk where the sensors share the floor, in any form that `run`
    /// reads.
    #[arg(required = true, value_name = "RECORDING")]
    pub recording: Vec<PathBuf>,
    #[command(flatten)]
    pub site: SiteArgs,
    #[command(flatten)]
    pub captures: CaptureArgs,
    /// The hall without people, in any form that RECORDING may have. Default: what is named `empty` among the
    /// recordings, or empty.mcap beside them; without it the background is learned while running.
    #[arg(long, value_name = "PATH")]
    pub empty: Option<PathBuf>,
    /// Learn the background while running, even if there is an empty recording.
    #[arg(long)]
    pub no_empty: bool,
    /// File to write: the given site file with the poses and clocks that were found.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// SVG floor plan of what the sensors saw, with the poses before and after. Default: beside --out.
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
}
