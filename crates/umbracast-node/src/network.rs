//! Where nodes meet: the `[network]` table of the site file.
//!
//! Without the table a node listens on loopback alone and looks for the others there. The table is no part of
//! [`umbracast::Config`], so no recording and no output contains it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Deserialize;
use umbracast::{Error, Site};

use crate::access::Works;
pub use crate::keys::chunk;
use crate::mqtt::Mqtt;
use crate::outward::Ros2;

/// `[network]` of the site file. Paths go from the site file's folder.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Network {
    /// The hall's name in every key: one chunk. Default: the site's name.
    pub hall: Option<String>,
    /// `peer`: meets others directly; `router`: passes on between those who do not meet; `client`: knows one router.
    pub mode: Mode,
    /// Endpoints where others reach this node, `tcp/10.0.0.5:7447` or `tls/...`. Default: loopback alone.
    pub listen: Vec<String>,
    /// Endpoints of others. Default: where nodes of this host meet.
    pub connect: Vec<String>,
    /// A frame waits so long for a front end that is late, seconds; then it goes on without.
    pub wait_s: f64,
    /// The name that this node gives at the door of others.
    pub user: Option<String>,
    /// A file that holds this node's password, alone on a line; without `user` the line is `user:password`.
    pub password_file: Option<PathBuf>,
    /// A file of those who may connect to this node, `user:password` a line.
    pub users_file: Option<PathBuf>,
    /// Certificates, for endpoints that begin with `tls/`.
    pub tls: Option<Tls>,
    /// What each user, or each certificate's common name, may do here; others nothing. Empty: whoever may connect may all.
    pub roles: BTreeMap<String, Works>,
    /// True where anybody who reaches an endpoint beyond loopback may connect: a network of one's own.
    pub anyone: bool,
    /// Where a node that serves tells the hall to ROS 2.
    pub ros2: Option<Ros2>,
    /// Where it sends warnings over MQTT.
    pub mqtt: Option<Mqtt>,
}

/// How a session stands among others.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Meets others directly.
    #[default]
    Peer,
    /// Passes on between those who do not meet.
    Router,
    /// Knows one router.
    Client,
}

/// Files of TLS, PEM.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tls {
    /// The certificate that the others' are signed by.
    pub ca: PathBuf,
    /// This node's certificate.
    pub certificate: Option<PathBuf>,
    /// Its key.
    pub key: Option<PathBuf>,
    /// Whether who connects here must show a certificate, too.
    #[serde(default)]
    pub both: bool,
}

impl Default for Network {
    fn default() -> Self {
        Self {
            hall: None,
            mode: Mode::Peer,
            listen: Vec::new(),
            connect: Vec::new(),
            wait_s: 0.1,
            user: None,
            password_file: None,
            users_file: None,
            tls: None,
            roles: BTreeMap::new(),
            anyone: false,
            ros2: None,
            mqtt: None,
        }
    }
}

/// The part of a site file that is read here.
#[derive(Deserialize)]
struct SiteFile {
    #[serde(default)]
    network: Network,
}

impl Network {
    /// The table of a site file; what else stands in it is left to [`umbracast::Config`].
    ///
    /// # Errors
    /// A key that does not exist, a value of the wrong kind or one that cannot work, with file and line.
    pub fn of_site_file(text: &str, file: &Path) -> Result<Self, Error> {
        let SiteFile { mut network } = toml::from_str(text).map_err(|e| {
            let line = text[..e.span().map_or(0, |span| span.start)].matches('\n').count() + 1;
            Error::new(format!("{}:{line}: {}", file.display(), e.message()))
        })?;
        let folder = file.parent().unwrap_or(Path::new(""));
        let files = [&mut network.password_file, &mut network.users_file].into_iter().flatten();
        let tls = network.tls.iter_mut().flat_map(|tls| {
            [Some(&mut tls.ca), tls.certificate.as_mut(), tls.key.as_mut()].into_iter().flatten()
        });
        let mqtt = network
            .mqtt
            .iter_mut()
            .flat_map(|mqtt| [mqtt.password_file.as_mut(), mqtt.ca.as_mut()].into_iter().flatten());
        files.chain(tls).chain(mqtt).for_each(|path| *path = folder.join(&*path));
        network.check().map_err(|e| e.within(file.display()))?;
        Ok(network)
    }

    /// Refuses values that cannot work.
    ///
    /// # Errors
    /// The value, with what was expected.
    pub fn check(&self) -> Result<(), Error> {
        if !(self.wait_s >= 0.0 && self.wait_s <= 60.0) {
            return Err(Error::new(format!("network.wait_s: expected 0 to 60, found {}", self.wait_s)));
        }
        if let Some(hall) = &self.hall {
            chunk(hall).map_err(|e| e.within("network.hall"))?;
        }
        if let Some(mqtt) = self.mqtt.as_ref().filter(|mqtt| mqtt.ca.is_none() && !mqtt.plain)
            && !is_loopback(&mqtt.broker)
        {
            return Err(Error::new(format!(
                "network.mqtt: expected ca, the certificate that encrypts the connection, or plain = true, beside a broker on \
                 another host, found {:?} alone",
                mqtt.broker
            )));
        }
        let guarded = self.users_file.is_some() || self.tls.as_ref().is_some_and(|tls| tls.both);
        if !self.roles.is_empty() && !guarded {
            return Err(Error::new(
                "network.roles: expected a users_file, or tls with both = true, beside it, which tell users apart",
            ));
        }
        let unknown = self.connect.iter().find(|endpoint| !endpoint.starts_with("tls/"));
        if let Some(endpoint) = unknown.filter(|_| !self.roles.is_empty()) {
            return Err(Error::new(format!(
                "network.connect: expected tls/ endpoints beside roles, because only a certificate shows who answers, found \
                 {endpoint:?}"
            )));
        }
        let open = self.listen.iter().find(|endpoint| !is_loopback(endpoint));
        match open.filter(|_| !guarded && !self.anyone) {
            None => Ok(()),
            Some(endpoint) => Err(Error::new(format!(
                "network.listen: expected a users_file, or tls with both = true, or anyone = true beside an endpoint \
                 that other hosts reach, found {endpoint:?} alone"
            ))),
        }
    }

    /// The hall's name in every key.
    ///
    /// # Errors
    /// A site's name that is no chunk of a key.
    pub fn hall(&self, site: &Site) -> Result<String, Error> {
        match &self.hall {
            Some(hall) => Ok(hall.clone()),
            None => chunk(&site.name).map_err(|e| e.within("site.name (or give network.hall)")),
        }
    }

    /// How long a frame waits for a front end.
    pub fn wait(&self) -> Duration {
        Duration::from_secs_f64(self.wait_s)
    }
}

/// Whether only this host reaches an endpoint.
pub fn is_loopback(endpoint: &str) -> bool {
    let address = endpoint.split_once('/').map_or(endpoint, |(_, address)| address);
    let address = address.split(['#', '?']).next().unwrap_or_default();
    let host = address.rsplit_once(':').map_or(address, |(host, _)| host).trim_matches(['[', ']']);
    let numbers = host.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback());
    numbers || host == "localhost" || endpoint.starts_with("unixsock-stream/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network(table: &str) -> Result<Network, Error> {
        Network::of_site_file(&format!("[site]\nname = \"lab\"\n{table}"), Path::new("halls/lab.toml"))
    }

    #[test]
    fn a_table_is_read_with_paths_from_its_folder_and_without_one_all_is_loopback() {
        let given =
            network("[network]\nwait_s = 0.2\nuser = \"edge\"\npassword_file = \"edge.txt\"").unwrap();
        assert_eq!(given.password_file.as_deref(), Some(Path::new("halls/edge.txt")));
        assert_eq!((given.wait(), network("").unwrap()), (Duration::from_millis(200), Network::default()));
        assert!(Network::default().listen.is_empty());
    }

    #[test]
    fn what_cannot_work_is_refused_with_its_place() {
        for (table, told) in [
            ("[network]\nwait = 1.0", "lab.toml:4: unknown field `wait`"),
            ("[network]\nwait_s = -1.0", "network.wait_s: expected 0 to 60, found -1"),
            ("[network]\nhall = \"a/b\"", "network.hall: expected a name"),
            ("[network.mqtt]\nbroker = \"10.0.0.9:1883\"", "or plain = true"),
            ("[network]\nlisten = [\"tcp/0.0.0.0:7447\"]", "other hosts reach, found \"tcp/0.0.0.0:7447\""),
        ] {
            let error = network(table).unwrap_err().to_string();
            assert!(error.contains(told), "{table}: {error}");
        }
        assert!(network("[network.mqtt]\nbroker = \"10.0.0.9:1883\"\nplain = true").is_ok());
        assert!(network("[network.mqtt]\nbroker = \"127.0.0.1:1883\"").is_ok());
        assert!(network("[network]\nlisten = [\"tcp/0.0.0.0:7447\"]\nanyone = true").is_ok());
        let mut site = umbracast::Config::default().site;
        site.name = "hall 3/east".to_owned();
        assert!(Network::default().hall(&site).unwrap_err().to_string().contains("network.hall"));
    }

    #[test]
    fn nobody_is_listened_to_for_a_gigabyte() {
        let config = Network::default().zenoh(&[]).unwrap();
        assert_eq!(config.get_json("transport/link/rx/max_message_size").unwrap(), "33554432");
    }

    #[test]
    fn endpoints_of_this_host_alone_are_told_from_others() {
        for own in ["tcp/127.0.0.1:7447", "tls/localhost:1", "tcp/[::1]:0", "tcp/127.0.0.1:1#so_sndbuf=9"] {
            assert!(is_loopback(own), "{own}");
        }
        for open in ["tcp/0.0.0.0:7447", "tcp/[::]:7447", "udp/10.0.0.5:1", "tcp/127.example.org:1"] {
            assert!(!is_loopback(open), "{open}");
        }
    }
}
