//! The arguments of `cast`.

use std::path::PathBuf;

use clap::Args;
use umbracast::Mode;

use super::SiteArgs;

/// `cast`
#[derive(Debug, Args)]
pub struct Cast {
    /// Table of tracks, CSV with a header or Parquet. A row is a person at a time: `id`, `time_s` (or `time_ns`), `x_m`, `y_m`,
    /// `vx_mps` and `vy_mps` in the site's frame. Any other column of the table `tracks` is used where it is there.
    #[arg(value_name = "TRACKS")]
    pub tracks: PathBuf,
    #[command(flatten)]
    pub site: SiteArgs,
    /// The method of stages 2 and 3: hdl, paper or default.
    #[arg(long, default_value = "default")]
    pub mode: Mode,
    /// Weights of the LSTM in place of the embedded ones.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    /// Also write every table as CSV.
    #[arg(long)]
    pub csv: bool,
    /// Folder for tracks with their forecasts, and for links.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}
