//! The arguments of `plan`.

use std::path::PathBuf;

use clap::Args;

use super::{PageArgs, SiteArgs};

/// `plan`
#[derive(Debug, Args)]
pub struct Plan {
    #[command(flatten)]
    pub site: SiteArgs,
    /// File to save to from the page. Default: the file of --site; without either the page shows the text of the file.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Print the best places of this many sensors, each like the site's first one, in place of the page.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=8))]
    pub sensors: u8,
    /// Print the best places of this many access points, each like the site's first one, in place of the page.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=8))]
    pub access_points: u8,
    /// Place them beside those of the site, not in their place.
    #[arg(long)]
    pub beside: bool,
    /// Compare the best places with this many random ones.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub against: u32,
    /// People on the floor, who stand between sensors, access points and others.
    #[arg(long, default_value_t = 20.0, value_name = "N")]
    pub people: f64,
    /// Their standing height, metres.
    #[arg(long, default_value_t = 1.75, value_name = "M")]
    pub height: f64,
    #[command(flatten)]
    pub page: PageArgs,
}
