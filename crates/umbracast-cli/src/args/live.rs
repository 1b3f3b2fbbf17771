//! Arguments of what runs live.

use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use umbracast::{Error, Mode};

use super::{CaptureArgs, CrowdArgs, SiteArgs};

/// `--log`
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LogForm {
    // Variants without a description keep the help to a line an option.
    Text,
    Json,
}

/// `live`
#[derive(Debug, Args)]
pub struct Live {
    #[command(flatten)]
    pub site: SiteArgs,
    /// Simulate walking people and the site's sensors, which send packets over loopback.
    #[arg(long)]
    pub demo: bool,
    #[command(flatten)]
    pub crowd: CrowdArgs,
    /// The method: hdl, paper or default.
    #[arg(long, default_value = "default")]
    pub mode: Mode,
    /// The hall without people: a recording, clouds or captures. Default: the background is learned while running.
    #[arg(long, value_name = "PATH")]
    pub empty: Option<PathBuf>,
    #[command(flatten)]
    pub captures: CaptureArgs,
    /// Weights of the LSTM in place of the embedded ones.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    #[command(flatten)]
    pub page: PageArgs,
    #[command(flatten)]
    pub record: RecordArgs,
    /// UDP port of the site's first sensor; the others use the ports after it. 0 takes free ports. Default: the site
    /// file's ports, else those of the models.
    #[arg(long, value_name = "PORT")]
    pub port: Option<u16>,
    /// Form of the log on stderr (a sensor gone, frames skipped, a disk that fails): text for people, or one JSON
    /// object in each line.
    #[arg(long, default_value = "text", env = "UMBRACAST_LOG", value_name = "FORM")]
    pub log: LogForm,
    /// End after this many seconds. Default: run until a signal comes.
    #[arg(long, value_name = "S", value_parser = positive)]
    pub seconds: Option<f64>,
}

/// `check`
#[derive(Debug, Args)]
pub struct Check {
    #[command(flatten)]
    pub site: SiteArgs,
    /// Listen for this many seconds.
    #[arg(long, default_value_t = 3.0, value_name = "S", value_parser = positive)]
    pub seconds: f64,
    /// UDP port of the site's first sensor; the others use the ports after it. Default: the site file's ports, else
    /// those of the models.
    #[arg(long, value_name = "PORT", value_parser = clap::value_parser!(u16).range(1..))]
    pub port: Option<u16>,
}

/// `view`
#[derive(Debug, Args)]
pub struct View {
    /// A recording, clouds or captures, in any form that `run` reads.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    #[command(flatten)]
    pub site: SiteArgs,
    #[command(flatten)]
    pub captures: CaptureArgs,
    /// The method: hdl, paper or default.
    #[arg(long, default_value = "default")]
    pub mode: Mode,
    /// Show what this method says beside it: hdl, paper or default.
    #[arg(long, value_name = "MODE")]
    pub beside: Option<Mode>,
    /// Folder with the truth of the recordings, as `simulate` writes it. Default: the recordings' own folder, where it
    /// holds one.
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
    /// The page begins to play this many times faster than recorded.
    #[arg(long, default_value_t = 1.0, value_name = "X", value_parser = positive)]
    pub rate: f64,
    /// The page begins again at the end.
    #[arg(long)]
    pub again: bool,
    #[command(flatten)]
    pub page: PageArgs,
}

/// `replay`
#[derive(Debug, Args)]
pub struct ReplayPackets {
    /// Recordings or captures, one after the other.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    #[command(flatten)]
    pub site: SiteArgs,
    #[command(flatten)]
    pub captures: CaptureArgs,
    /// Addresses for the sensors' packets, in the site's order. Further sensors use the last address with the ports
    /// after it.
    #[arg(long, default_value = "127.0.0.1:2368", value_name = "HOST:PORT", value_delimiter = ',')]
    pub to: Vec<SocketAddr>,
    /// Play this many times faster than recorded.
    #[arg(long, default_value_t = 1.0, value_name = "X", value_parser = positive)]
    pub rate: f64,
}

/// `simulate --packets`
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Packets {
    /// Over UDP to these addresses: see [`umbracast_live::send::addresses`].
    Udp(Vec<SocketAddr>),
    /// Into captures.
    Pcap,
}

impl FromStr for Packets {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = |found: &str| Error::new(format!("expected pcap or udp:HOST:PORT, found {found}"));
        let address = |text: &str| {
            let mut found = text.to_socket_addrs().map_err(|e| wrong(&format!("{text:?} ({e})")))?;
            found.next().ok_or_else(|| wrong(text))
        };
        match text.strip_prefix("udp:") {
            Some(addresses) => addresses.split(',').map(address).collect::<Result<_, _>>().map(Self::Udp),
            None if text == "pcap" => Ok(Self::Pcap),
            None => Err(wrong(text)),
        }
    }
}

/// The page.
#[derive(Debug, Clone, Args)]
pub struct PageArgs {
    /// Address of the page and its interface. An address that other hosts can reach needs a token in the environment
    /// variable UMBRACAST_TOKEN.
    #[arg(long, default_value = "127.0.0.1:8600", value_name = "HOST:PORT")]
    pub serve: SocketAddr,
    /// Names by which browsers may ask for the page, beside localhost and the address of --serve: that of this host, or
    /// of a proxy before it. Separate several with commas. Requests under other names are refused.
    #[arg(long = "host", value_name = "NAME", value_delimiter = ',')]
    pub hosts: Vec<String>,
    /// Serve the page over TLS with this certificate (PEM, followed by its issuers). Needs a build with the feature
    /// `tls`.
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    pub tls_cert: Option<PathBuf>,
    /// The certificate's key (PEM).
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    pub tls_key: Option<PathBuf>,
    /// Serve no page.
    #[arg(long, conflicts_with = "serve")]
    pub no_serve: bool,
}

/// The recorder.
#[derive(Debug, Clone, Args)]
pub struct RecordArgs {
    /// Record packets and results into this folder.
    #[arg(long, value_name = "DIR")]
    pub record: Option<PathBuf>,
    /// Begin a new file after this many megabytes.
    #[arg(long, default_value_t = 4096, value_name = "MB", requires = "record", value_parser = clap::value_parser!(u64).range(1..1 << 40))]
    pub record_mb: u64,
    /// Begin a new file after this many minutes.
    #[arg(long, default_value_t = 60, value_name = "MIN", requires = "record", value_parser = clap::value_parser!(u64).range(1..1 << 30))]
    pub record_minutes: u64,
    /// Keep this many of the newest files and delete older ones. Default: delete none.
    #[arg(long, value_name = "N", requires = "record")]
    pub record_keep: Option<usize>,
    /// Also record the foreground points, as PointCloud2.
    #[arg(long, requires = "record")]
    pub record_points: bool,
}

pub(super) fn positive(text: &str) -> Result<f64, Error> {
    let number: Option<f64> = text.parse().ok().filter(|number: &f64| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| Error::new(format!("expected a number above 0, found {text}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_go_to_captures_or_to_addresses() {
        let at = |text: &str| text.parse::<SocketAddr>().unwrap();
        assert_eq!("pcap".parse::<Packets>().unwrap(), Packets::Pcap);
        let two = Packets::Udp(vec![at("127.0.0.1:2368"), at("10.0.0.2:7502")]);
        assert_eq!("udp:127.0.0.1:2368,10.0.0.2:7502".parse::<Packets>().unwrap(), two);
        for wrong in ["udp:2368", "tcp:127.0.0.1:2368", "udp:", ""] {
            let told = wrong.parse::<Packets>().unwrap_err().to_string();
            assert!(told.contains("expected pcap or udp:HOST:PORT"), "{told}");
        }
    }
}
