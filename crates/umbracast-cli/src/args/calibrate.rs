//! The arguments of `calibrate`.

use std::path::PathBuf;

use clap::Args;

use super::SiteArgs;

/// `calibrate`
#[derive(Debug, Args)]
pub struct Calibrate {
    /// One scene of a minute or more in which people walk where the sensors share the floor, in any form that `run` reads.
    #[arg(required = true, value_name = "RECORDING")]
    pub recording: Vec<PathBuf>,
    #[command(flatten)]
    pub site: SiteArgs,
    /// The hall without people, in any form that RECORDING may have; default: empty.mcap beside the recording, else
    /// learned on the way.
    #[arg(long, value_name = "PATH")]
    pub empty: Option<PathBuf>,
    /// Learn the background on the way even where there is an empty recording.
    #[arg(long)]
    pub no_empty: bool,
    /// The site file as it was given, with the poses and clocks found.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Floor plan of what the sensors saw, by the poses before and after (SVG); default: beside --out.
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
}
