//! The arguments of `export`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use umbracast::Mode;
use umbracast_io::geojson::Origin;

use super::{CaptureArgs, SiteArgs};

/// `--as`
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportForm {
    // Variants without a description keep the help to a line an option.
    Pcd,
    Ply,
    Las,
    Geojson,
}

/// `export`
#[derive(Debug, Args)]
pub struct Export {
    /// A recording, clouds or captures, in any form that `run` reads.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    #[command(flatten)]
    pub site: SiteArgs,
    #[command(flatten)]
    pub captures: CaptureArgs,
    /// Forms of the files. Separate several with commas. geojson holds the hall, ways and links; the others hold points.
    #[arg(long = "as", value_name = "FORM", value_delimiter = ',', default_value = "pcd")]
    pub forms: Vec<ExportForm>,
    /// Write the points that do not belong to the empty hall, in place of whole scans.
    #[arg(long)]
    pub foreground: bool,
    /// Write the ways of people, a file for each scene.
    #[arg(long)]
    pub tracks: bool,
    /// Write the links. As points: a file for each frame, with points along each link.
    #[arg(long)]
    pub links: bool,
    /// Write the frame of this number alone, as the tables and the page count frames.
    #[arg(long, value_name = "N")]
    pub frame: Option<u64>,
    /// Where the origin of the site's frame is on Earth, degrees of WGS 84, for geojson. TURN is the direction of the
    /// x axis, counter-clockwise from east. Without it coordinates are the site's metres.
    #[arg(long, value_name = "LAT,LON[,TURN]", allow_hyphen_values = true)]
    pub origin: Option<Origin>,
    /// The method: hdl, paper or default.
    #[arg(long, default_value = "default")]
    pub mode: Mode,
    /// The hall without people, in any form that INPUT may have. Default: what is named `empty` among the inputs, or
    /// empty.mcap beside the recordings; without it the background is learned while running.
    #[arg(long, value_name = "PATH")]
    pub empty: Option<PathBuf>,
    /// Folder for the files.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}
