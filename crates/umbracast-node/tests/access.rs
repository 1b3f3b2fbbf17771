//! Rights: sessions of real users at a real router, over loopback.

use std::fs;
use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use umbracast_live::HostClock;
use umbracast_node::network::{Network, Tls};
use zenoh::{Session, Wait};

/// Longer than a message needs on a machine that does other things too.
const SOON: Duration = Duration::from_secs(5);
/// So long nothing must come.
const NEVER: Duration = Duration::from_millis(700);

/// A router with users, their works, and what each needs to connect.
struct Door {
    _session: Session,
    endpoint: String,
    folder: tempfile::TempDir,
}

fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// A file that only its owner can read.
fn secret(file: &Path, text: &str) {
    fs::write(file, text).unwrap();
    #[cfg(unix)]
    fs::set_permissions(file, std::os::unix::fs::PermissionsExt::from_mode(0o600)).unwrap();
}

fn door(works: &str) -> Door {
    let folder = tempfile::tempdir().unwrap();
    let users = ["edge", "server", "screen", "radio", "guest"];
    let lines: String = users.iter().map(|user| format!("{user}:{user}-secret\n")).collect();
    secret(&folder.path().join("users"), &lines);
    let endpoint = format!("tcp/127.0.0.1:{}", free_port());
    let table = format!(
        "[network]\nmode = \"router\"\nlisten = [\"{endpoint}\"]\nusers_file = \"users\"\n[network.roles]\n{works}"
    );
    let network = Network::of_site_file(&table, &folder.path().join("site.toml")).unwrap();
    Door { _session: network.open().unwrap(), endpoint, folder }
}

impl Door {
    /// A session of somebody who knows this name and password.
    fn enter(&self, user: Option<(&str, &str)>) -> Option<Session> {
        let file = self.folder.path().join(format!("{:?}", user.map(|(name, _)| name)));
        let mut network = Network { connect: vec![self.endpoint.clone()], ..Network::default() };
        if let Some((name, password)) = user {
            secret(&file, password);
            (network.user, network.password_file) = (Some(name.to_owned()), Some(file));
        }
        network.visit().ok()
    }

    fn user(&self, name: &str) -> Session {
        self.enter(Some((name, &format!("{name}-secret")))).unwrap_or_else(|| panic!("{name} cannot enter"))
    }
}

fn listen(session: &Session, key: &str) -> Receiver<String> {
    let (sender, receiver) = channel();
    let subscriber = session.declare_subscriber(key.to_owned());
    let each = move |sample: zenoh::sample::Sample| {
        let _ = sender.send(sample.key_expr().to_string()); // The test may be over.
    };
    subscriber.callback(each).background().wait().unwrap();
    receiver
}

/// Sends until it comes, or for so long as nothing must come.
fn comes(from: &Session, key: &str, to: &Receiver<String>, within: Duration) -> bool {
    let clock = HostClock::start();
    let until_ns = clock.now_ns() + within.as_nanos() as i64;
    while clock.now_ns() < until_ns {
        from.put(key.to_owned(), "word").wait().unwrap();
        if to.recv_timeout(Duration::from_millis(50)).is_ok_and(|came| came == key) {
            return true;
        }
    }
    false
}

const WORKS: &str = "edge = \"sensor\"\nserver = [\"track\", \"forecast\", \"cast\"]\nscreen = \"display\"\n\
                     radio = \"lab/controller\"\n";

#[test]
fn each_does_its_own_work_and_no_others() {
    let door = door(WORKS);
    let [edge, server, screen, radio] = ["edge", "server", "screen", "radio"].map(|name| door.user(name));
    let foreground = "umbracast/lab/sensor/east/foreground";
    let to_server = listen(&server, "umbracast/lab/sensor/*/foreground");
    assert!(comes(&edge, foreground, &to_server, SOON), "a front end sends foreground");
    assert!(!comes(&screen, foreground, &to_server, NEVER), "a display sends nothing");

    let (to_radio, to_screen) =
        (listen(&radio, "umbracast/lab/warnings/*"), listen(&screen, "umbracast/lab/warnings/*"));
    let to_edge = listen(&edge, "umbracast/lab/warnings/*");
    assert!(comes(&server, "umbracast/lab/warnings/door", &to_radio, SOON), "a controller gets warnings");
    assert!(comes(&server, "umbracast/lab/warnings/door", &to_screen, SOON), "a display sees them");
    assert!(to_edge.recv_timeout(NEVER).is_err(), "a front end reads no warnings");
    while to_radio.try_recv().is_ok() {}
    assert!(!comes(&edge, "umbracast/lab/warnings/door", &to_radio, NEVER), "a front end warns nobody");

    let elsewhere = listen(&radio, "umbracast/other/warnings/*");
    assert!(!comes(&server, "umbracast/other/warnings/door", &elsewhere, NEVER), "a controller of one hall");
}

#[test]
fn whoever_has_no_credentials_gets_nothing_and_changes_nothing() {
    let door = door(WORKS);
    let [server, screen] = ["server", "screen"].map(|name| door.user(name));
    assert!(door.enter(None).is_none(), "without a name");
    assert!(door.enter(Some(("server", "guess"))).is_none(), "with a guess");
    assert!(door.enter(Some(("nobody", "nobody-secret"))).is_none(), "with another name");
    // A user without work may enter and is told nothing; the tracks of others stay theirs.
    let guest = door.user("guest");
    let (to_guest, to_screen) = (listen(&guest, "**"), listen(&screen, "umbracast/lab/tracks"));
    assert!(comes(&server, "umbracast/lab/tracks", &to_screen, SOON));
    assert!(to_guest.recv_timeout(NEVER).is_err());
    while to_screen.try_recv().is_ok() {}
    assert!(!comes(&guest, "umbracast/lab/tracks", &to_screen, NEVER));
    let queried = guest.get("umbracast/lab/config/site").timeout(NEVER).wait().unwrap();
    assert!(
        queried.recv().is_err()
            && guest.liveliness().get("**").timeout(NEVER).wait().unwrap().recv().is_err()
    );
}

#[test]
fn a_front_end_of_one_sensor_neither_sends_for_another_nor_answers_for_the_empty_hall() {
    let door = door(&WORKS.replace("edge = \"sensor\"", "edge = \"lab/sensor:east\""));
    let [edge, server, screen] = ["edge", "server", "screen"].map(|name| door.user(name));
    let to_server = listen(&server, "umbracast/lab/sensor/*/foreground");
    assert!(comes(&edge, "umbracast/lab/sensor/east/foreground", &to_server, SOON), "its own");
    assert!(!comes(&edge, "umbracast/lab/sensor/west/foreground", &to_server, NEVER), "another's");

    let key = "umbracast/lab/config/background/east";
    let answer = |session: &Session, word: &'static str| {
        let each = move |query: zenoh::query::Query| {
            let _ = query.reply(key, word).wait(); // Who asked may be gone.
        };
        session.declare_queryable(key).callback(each).background().wait().unwrap();
    };
    answer(&edge, "forged");
    answer(&server, "true");
    let asked = |session: &Session| -> Vec<String> {
        let replies = session.get(key).target(zenoh::query::QueryTarget::All).timeout(NEVER).wait().unwrap();
        let word = |reply: zenoh::query::Reply| {
            reply.result().unwrap().payload().try_to_string().unwrap().into_owned()
        };
        replies.into_iter().map(word).collect()
    };
    let first = (0..20).map(|_| asked(&screen)).find(|words| !words.is_empty());
    assert_eq!(first.unwrap_or_default(), ["true"], "the router may need a moment to know who answers");
    (0..5).for_each(|_| assert_eq!(asked(&screen), ["true"]));
}

/// So many connections that say nothing.
fn idle(endpoint: &str, count: usize) -> Vec<TcpStream> {
    let address = endpoint.split_once('/').unwrap().1;
    (0..count).map(|_| TcpStream::connect(address).unwrap()).collect()
}

/// More than Zenoh lets wait by itself.
const IDLE: usize = 150;

#[test]
fn connections_that_say_nothing_keep_nobody_out() {
    let door = door(WORKS);
    let _idle = idle(&door.endpoint, IDLE);
    door.user("edge");
}

#[test]
fn connections_that_say_nothing_to_tls_keep_nobody_out_when_they_are_sent_away() {
    let folder = tempfile::tempdir().unwrap();
    let ours = authority();
    fs::write(folder.path().join("ca.pem"), ours.pem()).unwrap();
    ["door", "edge"].iter().for_each(|name| certify(folder.path(), name, &ours));
    let endpoint = format!("tls/localhost:{}", free_port());
    let table = format!(
        "[network]\nmode = \"router\"\nlisten = [\"{endpoint}\"]\n\
         tls = {{ ca = \"ca.pem\", certificate = \"door.pem\", key = \"door.key\", both = true }}\n\
         [network.roles]\nedge = \"sensor\"\n"
    );
    let network = Network::of_site_file(&table, &folder.path().join("site.toml")).unwrap();
    let _door = network.open().unwrap();
    let mut idle = idle(&endpoint, IDLE);
    // Zenoh rests after each that it sends away: by itself, for a tenth of a second.
    idle[0].set_read_timeout(Some(SOON)).unwrap();
    assert_eq!(idle[0].read(&mut [0]).unwrap(), 0, "it is sent away");
    let file = |end: &str| Some(folder.path().join(format!("edge.{end}")));
    let tls =
        Tls { ca: folder.path().join("ca.pem"), certificate: file("pem"), key: file("key"), both: true };
    let edge = Network { connect: vec![endpoint], tls: Some(tls), ..Network::default() };
    assert!(edge.visit().is_ok(), "it calls for three seconds");
}

/// A certificate of `name`, signed by the authority, as files NAME.pem and NAME.key.
fn certify(folder: &Path, name: &str, authority: &rcgen::CertifiedIssuer<'_, rcgen::KeyPair>) {
    let key = rcgen::KeyPair::generate().unwrap();
    let mut parameters = rcgen::CertificateParams::new(vec!["localhost".to_owned()]).unwrap();
    parameters.distinguished_name.push(rcgen::DnType::CommonName, name);
    let certificate = parameters.signed_by(&key, authority).unwrap();
    fs::write(folder.join(format!("{name}.pem")), certificate.pem()).unwrap();
    secret(&folder.join(format!("{name}.key")), &key.serialize_pem());
}

fn authority() -> rcgen::CertifiedIssuer<'static, rcgen::KeyPair> {
    let mut parameters = rcgen::CertificateParams::default();
    parameters.is_ca = rcgen::IsCa::Ca(rcgen::BasicConstraints::Unconstrained);
    rcgen::CertifiedIssuer::self_signed(parameters, rcgen::KeyPair::generate().unwrap()).unwrap()
}

#[test]
fn a_certificate_is_a_name_and_without_one_nobody_enters() {
    let folder = tempfile::tempdir().unwrap();
    let (ours, others) = (authority(), authority());
    fs::write(folder.path().join("ca.pem"), ours.pem()).unwrap();
    ["door", "edge", "server"].iter().for_each(|name| certify(folder.path(), name, &ours));
    certify(folder.path(), "stranger", &others);
    let endpoint = format!("tls/localhost:{}", free_port());
    let table = format!(
        "[network]\nmode = \"router\"\nlisten = [\"{endpoint}\"]\n\
         tls = {{ ca = \"ca.pem\", certificate = \"door.pem\", key = \"door.key\", both = true }}\n\
         [network.roles]\nedge = \"sensor\"\nserver = \"track\"\nstranger = \"track\"\n"
    );
    let network = Network::of_site_file(&table, &folder.path().join("site.toml")).unwrap();
    let _door = network.open().unwrap();
    let enter = |name: Option<&str>| {
        let file = |end: &str| name.map(|name| folder.path().join(format!("{name}.{end}")));
        let tls = Tls {
            ca: folder.path().join("ca.pem"),
            certificate: file("pem"),
            key: file("key"),
            both: name.is_some(),
        };
        let network = Network { connect: vec![endpoint.clone()], tls: Some(tls), ..Network::default() };
        network.visit().ok()
    };
    let (edge, server) = (enter(Some("edge")).expect("enters"), enter(Some("server")).expect("enters"));
    let to_server = listen(&server, "umbracast/lab/sensor/*/foreground");
    assert!(comes(&edge, "umbracast/lab/sensor/east/foreground", &to_server, SOON));
    let to_edge = listen(&edge, "umbracast/lab/state");
    assert!(!comes(&server, "umbracast/lab/state", &to_edge, NEVER), "states are not a front end's to read");
    assert!(enter(None).is_none(), "without a certificate");
    assert!(enter(Some("stranger")).is_none(), "with one of another authority");
}

#[test]
fn without_settings_only_this_host_is_listened_to() {
    let session = Network::default().open().unwrap();
    let locators = session.info().locators().wait();
    assert!(!locators.is_empty());
    for locator in locators {
        assert!(umbracast_node::network::is_loopback(&locator.to_string()), "{locator}");
    }
}
