//! Opening a session that may take for ever, and saying who does not answer meanwhile.

use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use umbracast::Error;
use zenoh::{Session, Wait};

use crate::network::{MEETING_POINT, Mode, Network};

/// How often the end may be asked for.
const LOOK: Duration = Duration::from_millis(20);
/// Who has not answered so many looks later is named, and then again after as many.
const LOOKS: usize = 100;
/// A host that says nothing for so long is not there.
const ANSWER: Duration = Duration::from_secs(1);

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
    asked: Option<std::sync::mpsc::Receiver<String>>,
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
