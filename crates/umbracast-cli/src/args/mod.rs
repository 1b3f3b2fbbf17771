//! The arguments. The same flag means the same everywhere.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use umbracast::{Error, Mode};
use umbracast_eval::run::experiment::Shard;
use umbracast_io::trajectories::Unit;
use umbracast_sim::body::kind::Kind;
use umbracast_sim::crowd::Preset;

mod live;
mod calibrate;
#[cfg(feature = "node")]
mod node;
#[cfg(feature = "node")]
mod fleet;

pub use calibrate::Calibrate;
#[cfg(feature = "node")]
pub use fleet::Fleet;
pub use live::{Check, Live, LogForm, Packets, PageArgs, RecordArgs, ReplayPackets, View};
#[cfg(feature = "node")]
pub use node::Node;

/// Sees people with LiDARs, foresees where they walk, and tells which radio links they are about to block.
#[derive(Debug, Parser)]
#[command(name = "umbracast", version, after_help = "Without a command: demo.")]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// What every command understands.
    #[command(flatten)]
    pub common: Common,
}

/// Flags of every command.
#[derive(Debug, Clone, Args)]
pub struct Common {
    /// Threads to use; 0 means one a core. Results do not depend on it.
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    pub threads: usize,
    /// Print for machines.
    #[arg(long, global = true)]
    pub json: bool,
    /// Show no progress.
    #[arg(long, global = true)]
    pub quiet: bool,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The main job on the embedded site: simulate one scene, run all stages, score, write a report.
    Demo(Demo),
    /// Simulate scenes to recordings with their truth.
    Simulate(Simulate),
    /// Recordings, PCD clouds or pcap captures through the pipeline; writes tracks and links.
    Run(Run),
    /// Sensors in, warnings out: receives packets, runs all stages as frames close, serves a page, records.
    Live(Live),
    /// One process of a hall whose stages run on several hosts, over Zenoh.
    #[cfg(feature = "node")]
    Node(Node),
    /// List the halls of a network with their nodes: who is there, what they use, and what is wrong.
    #[cfg(feature = "node")]
    Fleet(Fleet),
    /// Listen to the sensors of a site and say what is wrong with them, before the first person comes.
    Check(Check),
    /// Find where the sensors of a site hang, from a recording in which people walk.
    Calibrate(Calibrate),
    /// Watch a recording in the browser as if it were live.
    View(View),
    /// Send the packets of recordings again, at the pace they came.
    Replay(ReplayPackets),
    /// Score every stage: a run against its truth, or freshly simulated scenes in memory.
    Evaluate(Evaluate),
    /// Put the main figures of several reports into one table.
    Compare(Compare),
    /// Leave out each mechanism of the default mode alone, and say what it is worth.
    Ablate(Ablate),
    /// Show where a person gives how many returns, and which places are blind.
    Coverage(Coverage),
    /// The paper's whole experiment: 500 scenes, every mode, AABB and OBB. Goes on where it was stopped.
    Reproduce(Reproduce),
    /// Say what is in a file.
    Inspect(Inspect),
    /// Print the commented default configuration, or check a file.
    Config(Config),
    /// Fit what the program learned from data: networks, body and thresholds.
    #[command(subcommand)]
    Train(Train),
}

impl Default for Command {
    fn default() -> Self {
        Self::Demo(Demo {
            site: SiteArgs { site: None },
            crowd: CrowdArgs { preset: Preset::Orca03, people: 10, seed: None },
            out: PathBuf::from("report"),
        })
    }
}

/// Where everything stands.
#[derive(Debug, Clone, Args)]
pub struct SiteArgs {
    /// TOML file laid over the defaults: site, and any other setting that differs.
    #[arg(long, value_name = "FILE")]
    pub site: Option<PathBuf>,
}

/// Who walks.
#[derive(Debug, Clone, Args)]
pub struct CrowdArgs {
    /// The crowd: orca-03, orca-06, mixed or pairs.
    #[arg(long, default_value = "orca-03")]
    pub preset: Preset,
    /// People in a scene.
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = one_or_more)]
    pub people: usize,
    /// Seed of the first scene; the next ones count on. Tests begin at 200000.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
}

/// How recorded people are read.
#[derive(Debug, Clone, Args)]
pub struct Replay {
    /// Frames a second of trajectories whose file does not say.
    #[arg(long, value_name = "HZ")]
    pub fps: Option<f64>,
    /// Unit of PeTrack text, m or cm; default: what the file says, else m.
    #[arg(long)]
    pub unit: Option<Unit>,
    /// Smoothing of the trajectories, standard deviation in seconds; 0 for none.
    #[arg(long, default_value_t = 0.12, value_name = "S")]
    pub smooth: f64,
    /// Of a longer recording replay the middle, so many seconds.
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,
    /// Move people who walk elsewhere to the middle of the site's hall: their recording has a frame of its own.
    #[arg(long)]
    pub centre: bool,
}

/// What bodies they have.
#[derive(Debug, Clone, Args)]
pub struct BodyArgs {
    /// Kinds of bodies and their shares of the people, KIND[=SHARE]: bag, phone (at the ear), pockets (hands in
    /// them), child, wheelchair, cmu-walk (needs --gait), gesturing (with both hands), sitting (wherever they stay); the
    /// rest are plain. Several with commas.
    #[arg(long, value_name = "KIND[=SHARE]", value_delimiter = ',', value_parser = body_share)]
    pub bodies: Vec<(Kind, f64)>,
    /// Motion capture of somebody who walks, BVH: how people of the kind cmu-walk move.
    #[arg(long, value_name = "FILE", requires = "bodies")]
    pub gait: Option<PathBuf>,
}

fn one_or_more(text: &str) -> Result<usize, Error> {
    let number = text.parse().ok().filter(|number| *number > 0);
    number.ok_or_else(|| Error::new(format!("expected 1 or more, found {text}")))
}

fn body_share(text: &str) -> Result<(Kind, f64), Error> {
    let (kind, share) = text.split_once('=').unwrap_or((text, "1"));
    let wrong = || Error::new(format!("share of {kind}: expected a number, found {share:?}"));
    Ok((kind.parse()?, share.parse().map_err(|_| wrong())?))
}

/// `demo`
#[derive(Debug, Args)]
pub struct Demo {
    #[command(flatten)]
    pub site: SiteArgs,
    #[command(flatten)]
    pub crowd: CrowdArgs,
    /// Where the report goes.
    #[arg(long, default_value = "report", value_name = "DIR")]
    pub out: PathBuf,
}

/// `simulate`
#[derive(Debug, Args)]
pub struct Simulate {
    #[command(flatten)]
    pub site: SiteArgs,
    #[command(flatten)]
    pub crowd: CrowdArgs,
    /// Nobody arrives: people walk to and fro across the circle for so many seconds.
    #[arg(long, value_name = "S", conflicts_with = "trajectories", value_parser = clap::value_parser!(u32).range(1..))]
    pub stroll: Option<u32>,
    /// How many scenes.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: u32,
    /// Replay these trajectories in place of a crowd: TrajNet++ ndjson, CSV `t_s,id,x_m,y_m[,height_m]`, or
    /// PeTrack text. One scene a file.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub trajectories: Vec<PathBuf>,
    #[command(flatten)]
    pub replay: Replay,
    #[command(flatten)]
    pub bodies: BodyArgs,
    /// Write PointCloud2 clouds too (up to 1.2 GB a scene).
    #[arg(long)]
    pub clouds: bool,
    /// Write every table as CSV too.
    #[arg(long)]
    pub csv: bool,
    /// The sensors' packets as they send them. udp:HOST:PORT: in real time, the site's first sensor to that port and the
    /// others to those that follow, or each to one of several addresses with commas. pcap: captures beside the recordings,
    /// one of all sensors, or one for each where neither `udp_port` nor `address` tells them apart.
    #[arg(long, value_name = "udp:HOST:PORT|pcap")]
    pub packets: Option<Packets>,
    /// Where the recordings go; may be left out with --packets udp.
    #[arg(long, value_name = "DIR", required_unless_present = "packets")]
    pub out: Option<PathBuf>,
}

/// `run`
#[derive(Debug, Args)]
pub struct Run {
    /// A folder of recordings or PCD clouds, or files: .mcap, .db3, .pcd, or .pcap. A capture of all sensors is a scene of its
    /// own; captures of single sensors are one scene, one for each sensor in the site's order.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    #[command(flatten)]
    pub site: SiteArgs,
    /// Whose method: hdl, paper or default.
    #[arg(long, default_value = "default")]
    pub mode: Mode,
    /// The hall without people, in any form that INPUT may have; default: empty.mcap beside the recordings, else learned
    /// on the way.
    #[arg(long, value_name = "PATH")]
    pub empty: Option<PathBuf>,
    /// Learn the background on the way even where there is an empty recording.
    #[arg(long)]
    pub no_empty: bool,
    /// Weights of the LSTM in place of the embedded ones.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    /// Write every table as CSV too.
    #[arg(long)]
    pub csv: bool,
    /// Write the results of each scene as a recording too, results-0000.mcap, which ROS 2, Foxglove and Rerun open.
    #[arg(long)]
    pub mcap: bool,
    /// The foreground points too, as PointCloud2 in that recording.
    #[arg(long, requires = "mcap")]
    pub points: bool,
    /// Where detections, tracks and links go.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// `evaluate`
#[derive(Debug, Args)]
pub struct Evaluate {
    /// What `run` wrote; left out with --scenes.
    #[arg(value_name = "DIR")]
    pub dir: Option<PathBuf>,
    /// What `simulate` wrote.
    #[arg(long, value_name = "DIR", requires = "dir")]
    pub truth: Option<PathBuf>,
    /// Boxes of people drawn by hand, CSV `frame_file,label_index,x_m,y_m,...` in the sensor's frame.
    #[arg(long, value_name = "FILE", requires = "dir", conflicts_with = "truth")]
    pub labels: Option<PathBuf>,
    /// Simulate and run this many scenes of each preset in memory, and score them.
    #[arg(long, value_name = "N", conflicts_with = "dir", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: Option<u32>,
    /// The crowds of --scenes: orca-03, orca-06, mixed, pairs; several with commas.
    #[arg(long, value_delimiter = ',', default_value = "orca-03,orca-06")]
    pub preset: Vec<Preset>,
    /// Real walkers in place of a crowd; one scene a file.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["dir", "scenes"])]
    pub trajectories: Vec<PathBuf>,
    #[command(flatten)]
    pub replay: Replay,
    #[command(flatten)]
    pub bodies: BodyArgs,
    /// People in a scene of --scenes.
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = one_or_more)]
    pub people: usize,
    /// Seed of the first scene; tests begin at 200000.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Modes of --scenes; several with commas.
    #[arg(long, value_delimiter = ',', default_value = "hdl,paper,default")]
    pub mode: Vec<Mode>,
    #[command(flatten)]
    pub site: SiteArgs,
    /// Weights of the LSTM in place of the embedded ones; those that `run` was given.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    /// Where the report goes.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// `compare`
#[derive(Debug, Args)]
pub struct Compare {
    /// Folders that `evaluate --out` wrote.
    #[arg(required = true, value_name = "DIR")]
    pub reports: Vec<PathBuf>,
}

/// `ablate`
#[derive(Debug, Args)]
pub struct Ablate {
    /// Mechanisms to leave out, as the table calls them; several with commas. Default: every one.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub mechanisms: Vec<String>,
    /// Data to try them on, as the table calls them; several with commas. Default: all there are.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub sets: Vec<String>,
    /// Scenes of each drawn crowd.
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: u32,
    /// Seed of the first scene: one for tuning.
    #[arg(long, default_value_t = 150_000, value_name = "N")]
    pub seed: u64,
    /// Folder of the recordings: real walkers, bottleneck, captured gait, labelled clouds.
    #[arg(long, value_name = "DIR", env = "UMBRACAST_DATA")]
    pub data: Option<PathBuf>,
    /// Where the rows (CSV) and the picture (SVG) go.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// `coverage`
#[derive(Debug, Args)]
pub struct Coverage {
    #[command(flatten)]
    pub site: SiteArgs,
    /// From place to place, metres.
    #[arg(long, default_value_t = 0.5, value_name = "M")]
    pub step: f64,
    /// Standing height of the body, metres.
    #[arg(long, default_value_t = 1.72, value_name = "M")]
    pub height: f64,
    /// Headings to average, each with a build of its own.
    #[arg(long, default_value_t = 6, value_name = "N")]
    pub headings: usize,
    /// Where table (Parquet and CSV) and floor plan (SVG) go.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// `reproduce`
#[derive(Debug, Args)]
pub struct Reproduce {
    /// How many scenes.
    #[arg(long, default_value_t = 500, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: u32,
    /// 40 scenes.
    #[arg(long, conflicts_with = "scenes")]
    pub quick: bool,
    #[command(flatten)]
    pub crowd: CrowdArgs,
    /// Real walkers in place of a crowd; one scene a file.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["scenes", "quick"])]
    pub trajectories: Vec<PathBuf>,
    #[command(flatten)]
    pub replay: Replay,
    #[command(flatten)]
    pub site: SiteArgs,
    /// Weights of the LSTM in place of the embedded ones; `train lstm` says how to fit them as the paper does.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    /// Run every n-th scene only, from the i-th on (i from 0), and write no report.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Run nothing: take the scenes that shards left in these folders. All other flags as for the shards.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with = "shard")]
    pub merge: Vec<PathBuf>,
    /// Where scenes and report go; scenes that are there already are not run again.
    #[arg(long, default_value = "reproduce", value_name = "DIR")]
    pub out: PathBuf,
}

/// `inspect`
#[derive(Debug, Args)]
pub struct Inspect {
    /// A recording, table, capture, cloud, a network's weights or configuration.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
}

/// `config`
#[derive(Debug, Args)]
pub struct Config {
    /// Check this file instead of printing the default.
    #[arg(long, value_name = "FILE")]
    pub check: Option<PathBuf>,
    /// Print the complete values of a mode, without comments.
    #[arg(long)]
    pub mode: Option<Mode>,
}

/// What `train` fits.
#[derive(Debug, Subcommand)]
pub enum Train {
    /// The model of the body axis, on simulated returns. Takes some minutes.
    Axis(TrainAxis),
    /// The default forecast's residual network, on tracks of simulated and replayed people.
    Residual(TrainResidual),
    /// What extents of detections tell of how wide a body is, on tuning scenes; prints constants of the source.
    Width(TrainScenes),
    /// The body that stage 3 puts into the links' way, on recorded tuning scenes.
    Body(TrainBody),
    /// The probability from which on a link is called blocked, on tuning scenes.
    Thresholds(TrainScenes),
    /// The paper's LSTM: a program of its own, `train/`; this prints the command that builds and runs it.
    Lstm(TrainLstm),
}

/// Where weights come from and go to.
#[derive(Debug, Args)]
pub struct Fitted {
    /// The source's commit, for the card.
    #[arg(long)]
    pub commit: Option<String>,
    /// Where the fitted file and its card go.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// `train axis`
#[derive(Debug, Args)]
pub struct TrainAxis {
    #[command(flatten)]
    pub fitted: Fitted,
}

/// `train residual`
#[derive(Debug, Args)]
pub struct TrainResidual {
    /// Passes over the data.
    #[arg(long, default_value_t = 15, value_name = "N")]
    pub epochs: usize,
    /// Drawn scenes to train on.
    #[arg(long, default_value_t = 36, value_name = "N")]
    pub scenes: u64,
    /// Seed of the first scene; 1 to 99999.
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    pub first_scene: u64,
    /// Recorded people to learn from beside the drawn crowds.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub trajectories: Vec<PathBuf>,
    #[command(flatten)]
    pub replay: Replay,
    /// Seed of the first weights and of the samples' order.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    #[command(flatten)]
    pub fitted: Fitted,
}

/// `train body`
#[derive(Debug, Args)]
pub struct TrainBody {
    /// Folders in pairs: what `simulate` wrote with tuning seeds (100000 to 199999), and what `run` made of it.
    #[arg(required = true, value_names = ["SIMULATED", "RUN"], num_args = 2..)]
    pub recordings: Vec<PathBuf>,
}

/// `train width`, `train thresholds`
#[derive(Debug, Args)]
pub struct TrainScenes {
    /// How many scenes, of several crowds in turn.
    #[arg(long, default_value_t = 12, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: u32,
}

/// `train lstm`
#[derive(Debug, Args)]
pub struct TrainLstm {
    /// What that program understands.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENT")]
    pub arguments: Vec<String>,
}
