//! Arguments of a node.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;
use umbracast::Mode;
use umbracast_node::role::Role;

use super::SiteArgs;
use super::live::{PageArgs, RecordArgs, positive};

/// `node`
#[derive(Debug, Args)]
pub struct Node {
    /// Stages of this process: sensor, track, forecast, cast, record, serve, router (others connect to it). Separate
    /// several with commas.
    #[arg(required_unless_present = "stages", value_name = "STAGE", value_delimiter = ',')]
    pub stage: Vec<Role>,
    /// The same.
    #[arg(long, conflicts_with = "stage", value_name = "STAGE", value_delimiter = ',')]
    pub stages: Vec<Role>,
    /// Site file with settings and the network in its table [network]. Without it the node asks the hall's other
    /// nodes for the site.
    #[command(flatten)]
    pub site: SiteArgs,
    /// Name of the hall in every key. Default: the site file's.
    #[arg(long, value_name = "NAME")]
    pub hall: Option<String>,
    /// Endpoints to listen on, tcp/HOST:PORT or tls/HOST:PORT, in place of the site file's. Default: loopback.
    #[arg(long, value_name = "ENDPOINT", value_delimiter = ',')]
    pub listen: Vec<String>,
    /// Endpoints to connect to, in place of the site file's. Default: the loopback network of this host.
    #[arg(long, value_name = "ENDPOINT", value_delimiter = ',')]
    pub connect: Vec<String>,
    /// Let anybody who reaches this node's endpoints connect, for a private network; `anyone = true` of the site file.
    #[arg(long)]
    pub anyone: bool,
    /// The method: hdl, paper or default.
    #[arg(long, default_value = "default")]
    pub mode: Mode,
    /// Names of this front end's sensors. Separate several with commas. Default: all sensors of the site.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub sensors: Vec<String>,
    /// UDP port of the front end's first sensor; the others use the ports after it. 0 takes free ports. Default: the
    /// site file's ports, else those of the models.
    #[arg(long, value_name = "PORT", conflicts_with = "from")]
    pub port: Option<u16>,
    /// Read these ROS 2 topics in place of sockets, one for each sensor of the front end: velodyne_msgs/VelodyneScan
    /// or umbracast_msgs/SensorPackets, and sensor_msgs/PointCloud2 for a sensor whose model is "points". The domain
    /// is that of [network.ros2], else 0.
    #[arg(long, value_name = "TOPIC", value_delimiter = ',', conflicts_with_all = ["from", "port"])]
    pub ros2: Vec<String>,
    /// Read this recording in place of sockets, at its original pace. Front ends begin together, when those of all
    /// sensors and all stages are there. The node ends with the recording.
    #[arg(long, value_name = "INPUT")]
    pub from: Option<PathBuf>,
    /// Play this many times faster than recorded.
    #[arg(long, default_value_t = 1.0, value_name = "X", requires = "from", value_parser = positive)]
    pub rate: f64,
    /// The hall without people: a recording or captures. A front end without it asks the other nodes until one has it,
    /// and learns the background meanwhile.
    #[arg(long, value_name = "PATH")]
    pub empty: Option<PathBuf>,
    /// Weights of the LSTM in place of the embedded ones. A forecast node without them asks the other nodes.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    #[command(flatten)]
    pub page: PageArgs,
    /// Take lists of objects of another perception by WebSocket too, at /api/objects/SOURCE of the page.
    #[arg(long)]
    pub objects: bool,
    #[command(flatten)]
    pub record: RecordArgs,
    /// Answer HTTP at this address with 200 while the node lives, for the probes of a cluster. (A service of systemd needs
    /// none: the node tells systemd by itself.)
    #[arg(long, value_name = "HOST:PORT")]
    pub probe: Option<SocketAddr>,
    /// End after this many seconds. Default: run until a signal comes.
    #[arg(long, value_name = "S", value_parser = positive)]
    pub seconds: Option<f64>,
}
