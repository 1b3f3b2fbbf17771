//! Arguments of a node.

use std::path::PathBuf;

use clap::Args;
use umbracast::Mode;
use umbracast_node::role::Role;

use super::SiteArgs;
use super::live::{PageArgs, RecordArgs, positive};

/// `node`
#[derive(Debug, Args)]
pub struct Node {
    /// What this process does: sensor, track, forecast, cast, record, serve, router (others meet at it); several with commas.
    #[arg(required_unless_present = "stages", value_name = "STAGE", value_delimiter = ',')]
    pub stage: Vec<Role>,
    /// The same.
    #[arg(long, conflicts_with = "stage", value_name = "STAGE", value_delimiter = ',')]
    pub stages: Vec<Role>,
    /// Site, settings, and the network in its table [network]. Without a file the site is asked for in the hall.
    #[command(flatten)]
    pub site: SiteArgs,
    /// The hall's name in every key. Default: the site file's.
    #[arg(long, value_name = "NAME")]
    pub hall: Option<String>,
    /// Endpoints where others reach this node, tcp/HOST:PORT or tls/HOST:PORT, in place of the site file's. Default:
    /// loopback.
    #[arg(long, value_name = "ENDPOINT", value_delimiter = ',')]
    pub listen: Vec<String>,
    /// Endpoints of others, in place of the site file's. Default: where nodes of this host meet.
    #[arg(long, value_name = "ENDPOINT", value_delimiter = ',')]
    pub connect: Vec<String>,
    /// Whose method: hdl, paper or default.
    #[arg(long, default_value = "default")]
    pub mode: Mode,
    /// The sensors of this front end, by name; several with commas. Default: all of the site.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub sensors: Vec<String>,
    /// UDP port of the front end's first sensor; the others follow. 0: free ones. Default: what the site file says, or its
    /// sensors' own.
    #[arg(long, value_name = "PORT", conflicts_with = "from")]
    pub port: Option<u16>,
    /// Packets from these topics of ROS 2 in place of sockets, one for each sensor of the front end, as drivers publish them:
    /// velodyne_msgs/VelodyneScan or umbracast_msgs/SensorPackets; sensor_msgs/PointCloud2 for a sensor whose model is
    /// "points". The domain is that of [network.ros2], else 0.
    #[arg(long, value_name = "TOPIC", value_delimiter = ',', conflicts_with_all = ["from", "port"])]
    pub ros2: Vec<String>,
    /// Packets of this recording in place of sockets, at the pace they came, once front ends of all sensors and all stages
    /// are there; several front ends begin together. The node ends with it.
    #[arg(long, value_name = "INPUT")]
    pub from: Option<PathBuf>,
    /// How many times faster than it was.
    #[arg(long, default_value_t = 1.0, value_name = "X", requires = "from", value_parser = positive)]
    pub rate: f64,
    /// The hall without people: a recording or captures. A front end without it asks the others; where nobody has it, the
    /// background is learned on the way.
    #[arg(long, value_name = "PATH")]
    pub empty: Option<PathBuf>,
    /// Weights of the LSTM in place of the embedded ones. A forecast without them asks the others.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    #[command(flatten)]
    pub page: PageArgs,
    #[command(flatten)]
    pub record: RecordArgs,
    /// End after so many seconds; default: on a signal.
    #[arg(long, value_name = "S", value_parser = positive)]
    pub seconds: Option<f64>,
}
