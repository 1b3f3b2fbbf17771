//! Arguments of `fleet`.

use clap::Args;

use super::SiteArgs;
use super::live::positive;

/// `fleet`
#[derive(Debug, Args)]
pub struct Fleet {
    /// Site file whose table [network] says how to get in. Default: where nodes of this host meet.
    #[command(flatten)]
    pub site: SiteArgs,
    /// Endpoints of others, in place of the site file's.
    #[arg(long, value_name = "ENDPOINT", value_delimiter = ',')]
    pub connect: Vec<String>,
    /// This hall alone.
    #[arg(long, value_name = "NAME")]
    pub hall: Option<String>,
    /// Listen for so many seconds: every node speaks once a second.
    #[arg(long, default_value_t = 2.5, value_name = "S", value_parser = positive)]
    pub seconds: f64,
}
