//! Where nodes meet: the `[network]` table of the site file, and the Zenoh session that it opens.
//!
//! Without the table a node listens on loopback alone and looks for the others there. The table is no part of
//! [`umbracast::Config`], so no recording and no output contains it.

use std::collections::BTreeMap;
use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Deserialize;
use umbracast::{Error, Site};
use zenoh::Wait;

use crate::access::{self, Works};
pub use crate::keys::chunk;
use crate::mqtt::Mqtt;
use crate::outward::Ros2;
use crate::secrets;

/// Where nodes of one host meet without settings: Zenoh's own port.
pub(crate) const MEETING_POINT: &str = "127.0.0.1:7447";
/// A peer that is silent for so long is gone, and is called again. Under a loss of one packet in ten, TCP is silent for a
/// second now and then.
const LEASE_MS: u64 = 2000;
/// No message is longer: the clouds of the finest sensors have 12 MB. Zenoh would gather a gigabyte before it gave up.
const MESSAGE_BYTES: u64 = 32 << 20;
/// Who is not there is called again after so long, and after twice as long each time, up to the second value.
const RETRY_MS: [u64; 2] = [100, 800];

/// Who connects has so long to say who it is, ms: a handshake of four messages, and of TLS before it. Under a loss of one packet in
/// ten TCP needs less, and who is late calls again. Zenoh's own 10 s let whoever says nothing keep others out for as long.
const ACCEPT_MS: u64 = 2000;
/// So many may be about to say who they are; more are sent away at once. Zenoh's own 100 are fewer than one host opens in a moment.
/// With all of them, and with the sessions of a region, a process stays below the 1024 files that Linux lets it open.
const ACCEPT_PENDING: usize = 512;
/// So many sessions are open at once: Zenoh's own number, three times those of a region of a hundred halls.
const SESSIONS: usize = 1000;

/// A visitor calls for so long, ms.
const VISIT_MS: &str = "3000";

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

    /// What Zenoh is told. Neither multicast nor an administration is open.
    ///
    /// # Errors
    /// A file that cannot be read, an endpoint that Zenoh does not understand.
    pub fn zenoh(&self, listen: &[String]) -> Result<zenoh::Config, Error> {
        let mut config = zenoh::Config::default();
        let mode = match self.mode {
            Mode::Peer => "peer",
            Mode::Router => "router",
            Mode::Client => "client",
        };
        let meeting = vec![format!("tcp/{MEETING_POINT}")];
        let alone = self.connect.is_empty() && self.listen.is_empty();
        let connect = if alone { &meeting } else { &self.connect };
        let [first, last] = RETRY_MS;
        let retry = serde_json::json!({
            "period_init_ms": first, "period_max_ms": last, "period_increase_factor": 2,
        });
        let credentials = self.password_file.as_ref().map(|file| self.credentials(file)).transpose()?;
        let mut put = |key: &str, value: serde_json::Value| {
            let wrong = |e| Error::new(format!("network: Zenoh does not take {key} = {value}: {e}"));
            config.insert_json5(key, &value.to_string()).map_err(wrong)
        };
        put("mode", mode.into())?;
        put("connect/endpoints", serde_json::json!(connect))?;
        put("connect/retry", retry)?;
        put("connect/timeout_ms", (-1).into())?;
        put("connect/exit_on_failure", false.into())?;
        let listen: Vec<String> = listen.iter().map(|endpoint| impatient(endpoint)).collect();
        put("listen/endpoints", serde_json::json!(listen))?;
        put("transport/unicast/accept_timeout", ACCEPT_MS.into())?;
        put("transport/unicast/accept_pending", ACCEPT_PENDING.into())?;
        put("transport/unicast/max_sessions", SESSIONS.into())?;
        put("scouting/multicast/enabled", false.into())?;
        put("transport/link/tx/lease", LEASE_MS.into())?;
        put("transport/link/rx/max_message_size", MESSAGE_BYTES.into())?;
        if !self.roles.is_empty() {
            put("access_control", access::access_control(&self.roles))?;
        }
        if let Some((user, password)) = &credentials {
            let wrong = |_| Error::new("network.user: Zenoh does not take this name and password");
            let quoted = |text: &str| serde_json::json!(text).to_string();
            // Not through `put`: its error would show the password.
            config.insert_json5("transport/auth/usrpwd/user", &quoted(user)).map_err(wrong)?;
            config.insert_json5("transport/auth/usrpwd/password", &quoted(password)).map_err(wrong)?;
        }
        let mut put_file = |key: &str, file: Option<&PathBuf>| {
            let Some(file) = file else { return Ok(()) };
            fs::metadata(file).map_err(|e| Error::new(e.to_string()).within(file.display()))?;
            let wrong = |e| Error::new(format!("network: Zenoh does not take {key}: {e}"));
            config.insert_json5(key, &serde_json::json!(file).to_string()).map_err(wrong)
        };
        let keys = self.tls.as_ref().and_then(|tls| tls.key.as_deref());
        [self.users_file.as_deref(), keys].into_iter().flatten().try_for_each(secrets::closed_to_others)?;
        put_file("transport/auth/usrpwd/dictionary_file", self.users_file.as_ref())?;
        if let Some(tls) = &self.tls {
            put_file("transport/link/tls/root_ca_certificate", Some(&tls.ca))?;
            for side in ["listen", "connect"] {
                put_file(&format!("transport/link/tls/{side}_certificate"), tls.certificate.as_ref())?;
                put_file(&format!("transport/link/tls/{side}_private_key"), tls.key.as_ref())?;
            }
            let both = tls.both.to_string();
            let wrong = |e| Error::new(format!("network.tls.both: {e}"));
            config.insert_json5("transport/link/tls/enable_mtls", &both).map_err(wrong)?;
        }
        Ok(config)
    }

    /// User and password.
    fn credentials(&self, file: &Path) -> Result<(String, String), Error> {
        let line = secrets::first_line(file)?;
        let pair = self.user.as_ref().map(|user| (user.as_str(), line.as_str())).or(line.split_once(':'));
        let (user, password) = pair.ok_or_else(|| {
            Error::new("expected user:password, found one word and no network.user").within(file.display())
        })?;
        Ok((user.to_owned(), password.to_owned()))
    }

    /// Opens the session of somebody who looks and goes: nobody meets there.
    ///
    /// # Errors
    /// As [`Self::zenoh`]; where nobody answers.
    pub fn visit(&self) -> Result<zenoh::Session, Error> {
        let mut config = Self { mode: Mode::Client, listen: Vec::new(), ..self.clone() }.zenoh(&[])?;
        for (key, value) in [("connect/timeout_ms", VISIT_MS), ("connect/exit_on_failure", "true")] {
            config.insert_json5(key, value).map_err(|e| Error::new(format!("network: {key}: {e}")))?;
        }
        let meeting = format!("tcp/{MEETING_POINT}");
        let called = if self.connect.is_empty() { &meeting } else { &self.connect.join(", ") };
        zenoh::open(config).wait().map_err(|_| {
            Error::new(format!("network.connect: no answer from {called}, or it refuses these credentials"))
        })
    }

    /// Opens the session. Whoever is not there yet is called again until it is.
    ///
    /// # Errors
    /// As [`Self::check`] and [`Self::zenoh`]; an endpoint that cannot be listened on.
    pub fn open(&self) -> Result<zenoh::Session, Error> {
        self.check()?;
        let open = |listen: &[String]| {
            let opened = zenoh::open(self.zenoh(listen)?).wait();
            opened.map_err(|e| Error::new(format!("network.listen {listen:?}: {e}")))
        };
        match (&self.listen[..], self.mode) {
            ([], Mode::Client) => open(&[]),
            // The first node of a host takes the place where the others look; another one may be faster than this.
            ([], _) if self.connect.is_empty() && TcpListener::bind(MEETING_POINT).is_ok() => {
                open(&[format!("tcp/{MEETING_POINT}")]).or_else(|_| open(&["tcp/127.0.0.1:0".to_owned()]))
            }
            ([], _) => open(&["tcp/127.0.0.1:0".to_owned()]),
            (listen, _) => open(listen),
        }
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

/// A place to listen at whose TLS waits no longer than the handshake behind it.
fn impatient(endpoint: &str) -> String {
    match (endpoint.starts_with("tls/"), endpoint.contains('#')) {
        (false, _) => endpoint.to_owned(),
        (true, has_settings) => {
            let before = if has_settings { ';' } else { '#' };
            format!("{endpoint}{before}tls_handshake_timeout_ms={ACCEPT_MS}")
        }
    }
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

    #[test]
    fn a_password_is_in_no_error_and_no_debug_output() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("password");
        fs::write(&file, "hidden\n").unwrap();
        close(&file);
        let network =
            Network { user: Some("edge".to_owned()), password_file: Some(file), ..Network::default() };
        assert!(network.zenoh(&[]).is_ok() && !format!("{network:?}").contains("hidden"));
        let missing = Network { password_file: Some("/nowhere/password".into()), ..network };
        assert!(missing.zenoh(&[]).unwrap_err().to_string().contains("/nowhere/password"));
    }

    /// As `chmod 600` does.
    fn close(file: &Path) {
        #[cfg(unix)]
        fs::set_permissions(file, std::os::unix::fs::PermissionsExt::from_mode(0o600)).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_users_file_that_others_can_read_is_refused_with_chmod_in_the_error() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("users.txt");
        fs::write(&file, "edge:hidden\n").unwrap();
        fs::set_permissions(&file, std::os::unix::fs::PermissionsExt::from_mode(0o644)).unwrap();
        let network = Network { users_file: Some(file.clone()), ..Network::default() };
        let error = network.zenoh(&[]).unwrap_err().to_string();
        assert!(error.contains("chmod 600") && error.contains("users.txt"), "{error}");
        close(&file);
        assert!(network.zenoh(&[]).is_ok());
    }

    #[test]
    fn who_says_nothing_is_not_waited_for_long() {
        assert_eq!(impatient("tcp/0.0.0.0:1"), "tcp/0.0.0.0:1");
        assert_eq!(impatient("tls/a:1"), "tls/a:1#tls_handshake_timeout_ms=2000");
        assert_eq!(impatient("tls/a:1#so_sndbuf=9"), "tls/a:1#so_sndbuf=9;tls_handshake_timeout_ms=2000");
    }
}
