//! Arguments of `fleet`.

use clap::Args;

use super::SiteArgs;
use super::live::positive;

/// `fleet`
#[derive(Debug, Args)]
pub struct Fleet {
    /// Site file whose table [network] says how to connect. Default: the loopback network of this host.
    #[command(flatten)]
    pub site: SiteArgs,
    /// Endpoints to connect to, in place of the site file's.
    #[arg(long, value_name = "ENDPOINT", value_delimiter = ',')]
    pub connect: Vec<String>,
    /// Show this hall only.
    #[arg(long, value_name = "NAME")]
    pub hall: Option<String>,
    /// Listen for this many seconds; every node reports once a second.
    #[arg(long, default_value_t = 2.5, value_name = "S", value_parser = positive)]
    pub seconds: f64,
}
