//! The Zenoh session that a `[network]` table opens. It may take for ever: who does not answer is told meanwhile.

use std::fs;
use std::net::{TcpListener, TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use umbracast::Error;
use zenoh::{Session, Wait};

use crate::network::{Mode, Network};
use crate::{access, secrets};

/// Where nodes of one host meet without settings: Zenoh's own port.
const MEETING_POINT: &str = "127.0.0.1:7447";
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

/// How often the end may be asked for.
const LOOK: Duration = Duration::from_millis(20);
/// Who has not answered so many looks later is named, and then again after as many.
const LOOKS: usize = 100;
/// A host that says nothing for so long is not there.
const ANSWER: Duration = Duration::from_secs(1);

impl Network {
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

/// Opens the session unless the end is asked for, which `asked` is asked again and again: a client is not open before its router has
/// let it in. `told` gets who does not answer, whenever that is something else than before.
///
/// # Errors
/// As [`Network::open`].
pub fn open(
    network: &Network,
    asked: impl Fn() -> bool,
    told: impl Fn(&str),
) -> Result<Option<Session>, Error> {
    let (sender, opened) = channel();
    let of_thread = network.clone();
    std::thread::spawn(move || drop(sender.send(of_thread.open())));
    let mut unanswered = Unanswered::default();
    loop {
        match opened.recv_timeout(LOOK) {
            Ok(session) => return session.map(Some),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Error::new("network: Zenoh ended; this is a bug"));
            }
            Err(RecvTimeoutError::Timeout) if asked() => return Ok(None),
            Err(RecvTimeoutError::Timeout) => unanswered.look(network, true, &told),
        }
    }
}

/// Tells who does not answer, for as long as nobody does.
#[derive(Debug, Default)]
pub struct Unanswered {
    /// Looks since somebody was there, or since it was asked why nobody is.
    looks: usize,
    asked: Option<Receiver<String>>,
    said: Option<String>,
}

impl Unanswered {
    /// A look at whether this node is alone, some milliseconds after the last one. Waits for nobody.
    pub fn look(&mut self, network: &Network, alone: bool, mut told: impl FnMut(&str)) {
        if !alone {
            if self.said.is_some() {
                told("somebody answers now");
            }
            *self = Self::default();
            return;
        }
        self.looks += 1;
        if let Some(text) = self.asked.as_ref().and_then(|asked| asked.try_recv().ok()) {
            (self.asked, self.looks) = (None, 0);
            if self.said.as_ref() != Some(&text) {
                told(&text);
                self.said = Some(text);
            }
        }
        if self.looks >= LOOKS && self.asked.is_none() {
            let (sender, asked) = channel();
            let network = network.clone();
            std::thread::spawn(move || drop(sender.send(why(&network))));
            self.asked = Some(asked);
        }
    }
}

/// Whether nobody is connected.
pub fn is_alone(session: &Session) -> bool {
    let info = session.info();
    info.routers_zid().wait().next().is_none() && info.peers_zid().wait().next().is_none()
}

/// Why nobody of those whom a node calls has let it in, as far as TCP can tell.
fn why(network: &Network) -> String {
    let meeting = [format!("tcp/{MEETING_POINT}")];
    let called = if network.connect.is_empty() { &meeting[..] } else { &network.connect };
    let of_each: Vec<String> =
        called.iter().map(|endpoint| format!("{endpoint}: {}", no_answer(endpoint))).collect();
    format!("not connected; called again until somebody answers: {}", of_each.join("; "))
}

fn no_answer(endpoint: &str) -> String {
    let address = endpoint.split(['#', '?']).next().unwrap_or_default();
    let Some(("tcp" | "tls", address)) = address.split_once('/') else { return "no answer".to_owned() };
    let found = address.to_socket_addrs().map(Iterator::collect::<Vec<_>>);
    let tried = found.and_then(|found| {
        let address = found.first().ok_or_else(|| std::io::Error::other("no such host"))?;
        TcpStream::connect_timeout(address, ANSWER)
    });
    match tried {
        Ok(_) => "somebody listens there but does not let this node in; are user, password and certificate the right ones?"
            .to_owned(),
        Err(error) => error.to_string(),
    }
}

/// Whether a node would call somebody: one that only waits for others is not told that it is alone.
pub fn calls(network: &Network) -> bool {
    !network.connect.is_empty() || network.mode == Mode::Client
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
