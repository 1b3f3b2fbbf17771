//! The arguments. A flag has the same meaning in all commands.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use umbracast::Mode;
use umbracast_eval::run::experiment::Shard;
use umbracast_sim::crowd::Preset;

mod captures;
mod crowd;
mod live;
mod calibrate;
mod cast;
mod export;
mod network;
mod plan;
#[cfg(feature = "node")]
mod node;
#[cfg(feature = "node")]
mod fleet;

pub use calibrate::Calibrate;
pub use captures::CaptureArgs;
pub use cast::Cast;
use crowd::one_or_more;
pub use crowd::{BodyArgs, CrowdArgs, Replay};
pub use export::{Export, ExportForm};
#[cfg(feature = "node")]
pub use fleet::Fleet;
pub use live::{Check, Live, LogForm, Packets, PageArgs, RecordArgs, ReplayPackets, View};
pub use network::Network;
#[cfg(feature = "node")]
pub use node::Node;
pub use plan::Plan;

/// Detects people with LiDARs, forecasts where they walk, and says which radio links they will block.
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
    /// Threads to use; 0 means one for each core. Results do not depend on it.
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    pub threads: usize,
    /// Print JSON for programs.
    #[arg(long, global = true)]
    pub json: bool,
    /// Show no progress.
    #[arg(long, global = true)]
    pub quiet: bool,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Simulate one scene on the embedded site, run all stages, score them and write a report.
    Demo(Demo),
    /// Simulate scenes and write recordings with their truth.
    Simulate(Simulate),
    /// Run the pipeline on recordings, PCD clouds or pcap captures; write tracks and links.
    Run(Run),
    /// Turn tracks of another program into links: CSV or Parquet with number, time, position and velocity.
    Cast(Cast),
    /// Write scans, foreground, ways and links in forms that other programs open: PCD, PLY, LAS, GeoJSON.
    Export(Export),
    /// Receive sensors' packets, run all stages as frames close, serve a page with warnings, and record.
    Live(Live),
    /// Run one process of a hall whose stages run on several hosts, over Zenoh.
    #[cfg(feature = "node")]
    Node(Node),
    /// List the halls of a network with their nodes, load and faults.
    #[cfg(feature = "node")]
    Fleet(Fleet),
    /// Not in this build.
    #[cfg(not(feature = "node"))]
    #[command(hide = true)]
    Node(NotBuilt),
    /// Not in this build.
    #[cfg(not(feature = "node"))]
    #[command(hide = true)]
    Fleet(NotBuilt),
    /// Listen to the sensors of a site and report their faults, before the first person comes.
    Check(Check),
    /// Find the poses and clocks of a site's sensors from a recording of walking people.
    Calibrate(Calibrate),
    /// Show a recording in the browser as if it were live.
    View(View),
    /// Send the packets of recordings again, at their original pace.
    Replay(ReplayPackets),
    /// Score every stage: a run against its truth, or freshly simulated scenes in memory.
    Evaluate(Evaluate),
    /// Put the main figures of several reports into one table.
    Compare(Compare),
    /// Leave out each mechanism of the default mode alone and measure what it is worth.
    Ablate(Ablate),
    /// Show how many returns a person gives at each place, and which places are blind.
    Coverage(Coverage),
    /// Plan a hall on a page before anything hangs there: what is seen, which links are blocked, the best places.
    Plan(Plan),
    /// Play a radio network in closed loop: what forecasts of blockage gain it, beside other policies and an oracle.
    Network(Network),
    /// Run the paper's whole experiment: 500 scenes, every mode, AABB and OBB. A stopped run resumes.
    Reproduce(Reproduce),
    /// Show what is in a file.
    Inspect(Inspect),
    /// Print the commented default configuration, or check a file.
    Config(Config),
    /// Fit what the program learns from data: networks, body and thresholds.
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

/// Arguments of a command that this build has not.
#[cfg(not(feature = "node"))]
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct NotBuilt {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    pub arguments: Vec<String>,
}

/// Where everything stands.
#[derive(Debug, Clone, Args)]
pub struct SiteArgs {
    /// TOML file with the site and any other setting that differs from the defaults.
    #[arg(long, value_name = "FILE")]
    pub site: Option<PathBuf>,
}

/// `demo`
#[derive(Debug, Args)]
pub struct Demo {
    #[command(flatten)]
    pub site: SiteArgs,
    #[command(flatten)]
    pub crowd: CrowdArgs,
    /// Folder for the report.
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
    /// Let people walk to and fro across the circle for this many seconds; nobody arrives.
    #[arg(long, value_name = "S", conflicts_with = "trajectories", value_parser = clap::value_parser!(u32).range(1..))]
    pub stroll: Option<u32>,
    /// Number of scenes.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: u32,
    /// Replay these trajectories in place of a crowd: TrajNet++ ndjson, CSV `t_s,id,x_m,y_m[,height_m]`, or PeTrack
    /// text. Each file is a scene.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub trajectories: Vec<PathBuf>,
    #[command(flatten)]
    pub replay: Replay,
    #[command(flatten)]
    pub bodies: BodyArgs,
    /// Also write PointCloud2 clouds (up to 1.2 GB for each scene).
    #[arg(long)]
    pub clouds: bool,
    /// Also write every table as CSV.
    #[arg(long)]
    pub csv: bool,
    /// Write the packets that the sensors would send. udp:HOST:PORT sends them in real time: the first sensor to that
    /// port and the others to the ports after it, or each sensor to its own address in a list with commas. pcap
    /// writes captures beside the recordings: one with all sensors, or one for each sensor if neither `udp_port` nor
    /// `address` tells them apart.
    #[arg(long, value_name = "udp:HOST:PORT|pcap")]
    pub packets: Option<Packets>,
    /// Folder for the recordings; optional with --packets udp.
    #[arg(long, value_name = "DIR", required_unless_present = "packets")]
    pub out: Option<PathBuf>,
}

/// `run`
#[derive(Debug, Args)]
pub struct Run {
    /// A folder of recordings or PCD clouds, or files: .mcap, .db3, .pcd or .pcap. A capture with all sensors is a
    /// scene of its own. Captures of single sensors are one scene together; give one for each sensor, in any order.
    /// Files and folders named `empty`, such as empty-east.pcap, are the hall without people.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    #[command(flatten)]
    pub site: SiteArgs,
    #[command(flatten)]
    pub captures: CaptureArgs,
    /// The method: hdl, paper or default.
    #[arg(long, default_value = "default")]
    pub mode: Mode,
    /// The hall without people, in any form that INPUT may have. Default: what is named `empty` among the inputs, or
    /// empty.mcap beside the recordings; without it the background is learned while running.
    #[arg(long, value_name = "PATH")]
    pub empty: Option<PathBuf>,
    /// Learn the background while running, even if there is an empty recording.
    #[arg(long)]
    pub no_empty: bool,
    /// Weights of the LSTM in place of the embedded ones.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    /// The power that access points received from devices, CSV or Parquet with the columns `time_ns`, `access_point`, `device`, `power_dbm`,
    /// and `serves` and `scene` where they are known. Default: what the recordings hold. The table `bindings` says who carries which device.
    #[arg(long, value_name = "FILE")]
    pub reports: Option<PathBuf>,
    /// Also write every table as CSV.
    #[arg(long)]
    pub csv: bool,
    /// Also write the results of each scene as a recording of ROS 2 messages, results-0000.mcap.
    #[arg(long)]
    pub mcap: bool,
    /// Add the foreground points to that recording, as PointCloud2.
    #[arg(long, requires = "mcap")]
    pub points: bool,
    /// Folder for detections, tracks and links.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// `evaluate`
#[derive(Debug, Args)]
pub struct Evaluate {
    /// The folder that `run` wrote; omit it with --scenes.
    #[arg(value_name = "DIR")]
    pub dir: Option<PathBuf>,
    /// The folder that `simulate` wrote.
    #[arg(long, value_name = "DIR", requires = "dir")]
    pub truth: Option<PathBuf>,
    /// Boxes drawn by hand around people, CSV `frame_file,label_index,x_m,y_m,...` in the sensor's frame.
    #[arg(long, value_name = "FILE", requires = "dir", conflicts_with = "truth")]
    pub labels: Option<PathBuf>,
    /// Simulate and run this many scenes of each preset in memory, and score them.
    #[arg(long, value_name = "N", conflicts_with = "dir", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: Option<u32>,
    /// The crowds of --scenes: orca-03, orca-06, mixed, natural, pairs. Separate several with commas.
    #[arg(long, value_delimiter = ',', default_value = "orca-03,orca-06")]
    pub preset: Vec<Preset>,
    /// Replay recorded walkers in place of a crowd. Each file is a scene.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["dir", "scenes"])]
    pub trajectories: Vec<PathBuf>,
    #[command(flatten)]
    pub replay: Replay,
    #[command(flatten)]
    pub bodies: BodyArgs,
    /// People in each scene of --scenes.
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = one_or_more)]
    pub people: usize,
    /// Seed of the first scene. Test seeds begin at 200000.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Modes of --scenes. Separate several with commas.
    #[arg(long, value_delimiter = ',', default_value = "hdl,paper,default")]
    pub mode: Vec<Mode>,
    #[command(flatten)]
    pub site: SiteArgs,
    /// Weights of the LSTM in place of the embedded ones; give the same as to `run`.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    /// Folder for the report.
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
    /// Mechanisms to leave out, by their names in the table. Separate several with commas. Default: all.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub mechanisms: Vec<String>,
    /// Data to score, by their names in the table. Separate several with commas. Default: all that are there.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub sets: Vec<String>,
    /// Scenes of each drawn crowd.
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: u32,
    /// Seed of the first scene, a tuning seed.
    #[arg(long, default_value_t = 150_000, value_name = "N")]
    pub seed: u64,
    /// Folder with the recordings of real walkers, bottleneck, captured gait and labelled clouds.
    #[arg(long, value_name = "DIR", env = "UMBRACAST_DATA")]
    pub data: Option<PathBuf>,
    /// Folder for the rows (CSV) and the picture (SVG).
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// `coverage`
#[derive(Debug, Args)]
pub struct Coverage {
    #[command(flatten)]
    pub site: SiteArgs,
    /// Distance between places, metres.
    #[arg(long, default_value_t = 0.5, value_name = "M")]
    pub step: f64,
    /// Standing height of the body, metres.
    #[arg(long, default_value_t = 1.72, value_name = "M")]
    pub height: f64,
    /// Number of headings to average, each with its own build.
    #[arg(long, default_value_t = 6, value_name = "N")]
    pub headings: usize,
    /// Folder for the table (Parquet and CSV) and the floor plan (SVG).
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// `reproduce`
#[derive(Debug, Args)]
pub struct Reproduce {
    /// Number of scenes.
    #[arg(long, default_value_t = 500, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: u32,
    /// Run 40 scenes only.
    #[arg(long, conflicts_with = "scenes")]
    pub quick: bool,
    #[command(flatten)]
    pub crowd: CrowdArgs,
    /// Replay recorded walkers in place of a crowd. Each file is a scene.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["scenes", "quick"])]
    pub trajectories: Vec<PathBuf>,
    #[command(flatten)]
    pub replay: Replay,
    #[command(flatten)]
    pub site: SiteArgs,
    /// Weights of the LSTM in place of the embedded ones; `train lstm` says how to fit them as the paper does.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    /// Run every N-th scene only, beginning with scene I (from 0), and write no report.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Run nothing, and take the scenes that shards left in these folders. Give all other flags as for the shards.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with = "shard")]
    pub merge: Vec<PathBuf>,
    /// Folder for scenes and report. Scenes that are already there are not run again.
    #[arg(long, default_value = "reproduce", value_name = "DIR")]
    pub out: PathBuf,
}

/// `inspect`
#[derive(Debug, Args)]
pub struct Inspect {
    /// A recording, table, capture, cloud, weights of a network, or configuration.
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
    /// Fit the network that reads the pose of a body, on simulated returns; takes some minutes.
    Pose(TrainPose),
    /// Fit the default forecast's residual network on tracks of simulated and replayed people.
    Residual(TrainResidual),
    /// Fit what outlines of usual bodies look like, on tuning scenes; prints `models/outline.toml`.
    Outline(TrainScenes),
    /// Fit stage 3's model of a body, on tuning scenes; prints `models/body.toml`.
    Body(TrainScenes),
    /// Fit the probability at which a link is called blocked, on tuning scenes.
    Thresholds(TrainScenes),
    /// Print the command that builds and runs the program in `train/`, which fits the paper's LSTM.
    Lstm(TrainLstm),
}

/// Where weights come from and go to.
#[derive(Debug, Args)]
pub struct Fitted {
    /// Commit of the source, for the card.
    #[arg(long)]
    pub commit: Option<String>,
    /// Folder for the fitted file and its card.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// `train pose`
#[derive(Debug, Args)]
pub struct TrainPose {
    #[command(flatten)]
    pub fitted: Fitted,
}

/// `train residual`
#[derive(Debug, Args)]
pub struct TrainResidual {
    /// Passes over the data.
    #[arg(long, default_value_t = 15, value_name = "N")]
    pub epochs: usize,
    /// Number of drawn scenes to train on.
    #[arg(long, default_value_t = 36, value_name = "N")]
    pub scenes: u64,
    /// Seed of the first scene; 1 to 99999.
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    pub first_scene: u64,
    /// Recorded people to learn from in addition to the drawn crowds.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub trajectories: Vec<PathBuf>,
    #[command(flatten)]
    pub replay: Replay,
    /// Seed of the initial weights and of the samples' order.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    #[command(flatten)]
    pub fitted: Fitted,
}

/// `train body`, `train outline`, `train thresholds`
#[derive(Debug, Args)]
pub struct TrainScenes {
    /// Number of scenes, of several crowds in turn.
    #[arg(long, default_value_t = 12, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub scenes: u32,
}

/// `train lstm`
#[derive(Debug, Args)]
pub struct TrainLstm {
    /// Arguments for that program.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENT")]
    pub arguments: Vec<String>,
}
