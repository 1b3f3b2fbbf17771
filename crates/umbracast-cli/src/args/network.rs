//! The arguments of `network`.

use std::path::PathBuf;

use clap::Args;
use umbracast::Error;
use umbracast::site::LossModel;
use umbracast_network::case::PREDICTORS;
use umbracast_network::policy::Policy;
use umbracast_network::truth::TruthModel;
use umbracast_sim::crowd::Preset;

use super::{CaptureArgs, SiteArgs};

/// `network`
#[derive(Debug, Args)]
pub struct Network {
    #[command(flatten)]
    pub site: SiteArgs,
    /// The crowd: orca-03, orca-06, mixed, natural or pairs. Everybody walks to and fro, and nobody arrives.
    #[arg(long, default_value = "orca-03")]
    pub preset: Preset,
    /// Number of scenes. Fewer than five give no intervals.
    #[arg(long, default_value_t = 4, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: u32,
    /// Seconds of a scene; the first 1.5 are not scored.
    #[arg(long, default_value_t = 40, value_name = "S", value_parser = clap::value_parser!(u32).range(20..=3600))]
    pub seconds: u32,
    /// Seed of the first scene; each next scene has the next number. Test seeds begin at 200000.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// People in each scene, each with a device. Here and below, several values with commas are a sweep: every
    /// combination is played.
    #[arg(long, default_value = "20", value_name = "N", value_delimiter = ',', value_parser = super::one_or_more)]
    pub people: Vec<usize>,
    /// How many access points, the site's first. Default: 4, or all of a site with radios.
    #[arg(long, value_name = "N", value_delimiter = ',', value_parser = super::one_or_more)]
    pub access_points: Vec<usize>,
    /// Carriers in GHz. Default: 28, 60 and 140, or the site's.
    #[arg(long, value_name = "GHZ", value_delimiter = ',')]
    pub carrier: Vec<f64>,
    /// How many dB a link can lose before it is out. Default: 10, or the site's.
    #[arg(long, value_name = "DB", value_delimiter = ',')]
    pub margin: Vec<f64>,
    /// How long nothing is sent while a device changes, in ms. Default: 25, or the site's.
    #[arg(long, value_name = "MS", value_delimiter = ',')]
    pub interruption: Vec<f64>,
    /// Models of a body's loss in the forecast: kirchhoff, model-b, model-b-adult, model-b-body, knife-edges,
    /// three-edges. Default: kirchhoff, or the site's.
    #[arg(long, value_name = "MODEL", value_delimiter = ',', value_parser = predictor)]
    pub predictor: Vec<LossModel>,
    /// Models of the truth, by other code than the forecast's: model-b, kirchhoff, edges.
    #[arg(long, default_value = "model-b,edges", value_name = "MODEL", value_delimiter = ',', value_parser = truth)]
    pub truth: Vec<TruthModel>,
    /// Policies: stay, a3-60-40, a3-160-160, conditional-60-40, conditional-160-160, a3-with-beams,
    /// conditional-with-beams, as-now, paper, constant-velocity, forecast, forecast-with-beams, forecast-bound, forecast-commands,
    /// forecast-no-age, perfect-0.9-s, oracle, oracle-with-beams, all-at-once. Default: all.
    #[arg(long, value_name = "POLICY", value_delimiter = ',', value_parser = policy)]
    pub policies: Vec<Policy>,
    /// Devices are 0.3 m ahead of their owners, whose own bodies then block too.
    #[arg(long)]
    pub own_body: bool,
    /// Instead of playing policies, compare the predicted losses with the true ones about fades.
    #[arg(long, conflicts_with = "policies")]
    pub losses: bool,
    /// Write the losses of every scene over time, of the first case alone, instead of playing policies: trace-SEED.csv in
    /// --out. `ns3` is for examples/ns3/umbracast-loss.h.
    #[arg(long, value_name = "SIMULATOR", value_parser = ["ns3"], requires = "out", conflicts_with_all = ["policies", "losses"])]
    pub trace: Option<String>,
    /// Write a data set instead of playing policies, of the first case alone: recordings of LiDARs, who was where, losses every
    /// 10 ms, labels, reports of power, and a split (docs/NETWORK.md).
    #[arg(long, value_name = "DIR", conflicts_with_all = ["policies", "losses", "trace", "out"])]
    pub dataset: Option<PathBuf>,
    /// With --dataset: every table as CSV too.
    #[arg(long, requires = "dataset")]
    pub csv: bool,
    /// Instead of playing policies, compare the predicted losses with measured ones: recordings or captures of a site
    /// whose access points have radios. Power comes from --reports, or from the recordings.
    #[arg(long, value_name = "INPUT", num_args = 1.., conflicts_with_all = ["policies", "losses", "trace", "out", "dataset"])]
    pub measured: Vec<PathBuf>,
    #[command(flatten)]
    pub captures: CaptureArgs,
    /// With --measured: the power that access points received from devices, as for `run`.
    #[arg(long, value_name = "FILE", requires = "measured")]
    pub reports: Option<PathBuf>,
    /// With --measured: the hall without people. Default: empty.mcap beside the recordings.
    #[arg(long, value_name = "PATH", requires = "measured")]
    pub empty: Option<PathBuf>,
    /// Compare the shape of real fades with the model's instead: a table of passages in the form of IMMERSE
    /// (docs/NETWORK.md).
    #[arg(long, value_name = "TRACES.csv", conflicts_with_all = ["policies", "losses", "trace", "dataset"])]
    pub shape: Option<PathBuf>,
    /// Folder for the table, network.csv, and the same as network.json.
    #[arg(long, value_name = "DIR", conflicts_with = "losses")]
    pub out: Option<PathBuf>,
}

fn predictor(text: &str) -> Result<LossModel, Error> {
    one_of(text, PREDICTORS)
}

fn truth(text: &str) -> Result<TruthModel, Error> {
    one_of(text, TruthModel::ALL.map(|model| (model.name(), model)))
}

fn policy(text: &str) -> Result<Policy, Error> {
    one_of(text, Policy::ALL.map(|policy| (policy.name(), policy)))
}

fn one_of<T: Copy, const N: usize>(text: &str, known: [(&str, T); N]) -> Result<T, Error> {
    known.iter().find(|(name, _)| *name == text).map(|(_, value)| *value).ok_or_else(|| {
        Error::new(format!("expected one of {}, found {text:?}", known.map(|(name, _)| name).join(", ")))
    })
}
