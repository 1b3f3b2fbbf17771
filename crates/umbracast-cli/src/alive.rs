//! Says that a process lives: to systemd, which started it, and over HTTP to whoever probes it.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::time::Duration;

use umbracast::Error;
use umbracast_live::HostClock;

/// Whose last beat is older than this hangs: it beats every second.
const HANGS_NS: i64 = 10_000_000_000;
/// How often it beats.
const BEAT_NS: i64 = 1_000_000_000;
/// Who asks has so long to ask, and to read the answer.
const PATIENCE: Duration = Duration::from_secs(1);
/// A question is no longer than this.
const QUESTION_BYTES: usize = 2048;

/// A process that beats.
pub struct Alive {
    state: Arc<State>,
    clock: HostClock,
}

/// What whoever answers shares with the process.
struct State {
    beaten_ns: AtomicI64,
    ready: AtomicBool,
}

impl Alive {
    /// Answers at `probe` from now on: `/ready` with 200 from [`Self::ready`] on, every other path as long as the process beats.
    ///
    /// # Errors
    /// An address that is taken.
    pub fn open(probe: Option<SocketAddr>, clock: HostClock) -> Result<Self, Error> {
        let state = Arc::new(State { beaten_ns: clock.now_ns().into(), ready: false.into() });
        if let Some(address) = probe {
            let listener =
                TcpListener::bind(address).map_err(|e| Error::new(format!("--probe {address}: {e}")))?;
            let state = state.clone();
            std::thread::spawn(move || {
                // Whoever probes asks once in a while, so one after the other is enough.
                for stream in listener.incoming().flatten() {
                    let _ = answer(stream, &state, clock.now_ns()); // Who asked may be gone.
                }
            });
        }
        Ok(Self { state, clock })
    }

    /// It is ready, and stays so.
    pub fn ready(&self) {
        self.state.ready.store(true, Ordering::Relaxed);
        tell_systemd("READY=1");
    }

    /// It lives. To be called as often as one likes.
    pub fn beat(&self) {
        let now_ns = self.clock.now_ns();
        if now_ns - self.state.beaten_ns.load(Ordering::Relaxed) >= BEAT_NS {
            self.state.beaten_ns.store(now_ns, Ordering::Relaxed);
            tell_systemd("WATCHDOG=1");
        }
    }
}

impl State {
    fn is_well(&self, path: &str, now_ns: i64) -> bool {
        let lives = now_ns - self.beaten_ns.load(Ordering::Relaxed) < HANGS_NS;
        lives && (path != "/ready" || self.ready.load(Ordering::Relaxed))
    }
}

fn answer(mut stream: TcpStream, state: &State, now_ns: i64) -> std::io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let (mut question, mut byte) = (Vec::new(), [0; 1]);
    while !question.ends_with(b"\r\n\r\n") && question.len() < QUESTION_BYTES {
        stream.read_exact(&mut byte)?;
        question.push(byte[0]);
    }
    let question = String::from_utf8_lossy(&question);
    let path = question.split(' ').nth(1).unwrap_or_default();
    let (status, word) = match state.is_well(path, now_ns) {
        true => ("200 OK", "well\n"),
        false => ("503 Service Unavailable", "not well\n"),
    };
    let length = word.len();
    let head = "content-type: text/plain\r\nconnection: close";
    write!(stream, "HTTP/1.1 {status}\r\n{head}\r\ncontent-length: {length}\r\n\r\n{word}")
}

/// `sd_notify(3)`: a word to the socket that systemd names. Nothing where no service manager listens.
#[cfg(target_os = "linux")]
fn tell_systemd(word: &str) {
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::net::{SocketAddr, UnixDatagram};
    let Some(name) = std::env::var("NOTIFY_SOCKET").ok().filter(|name| !name.is_empty()) else { return };
    let address = match name.strip_prefix('@') {
        Some(name) => SocketAddr::from_abstract_name(name),
        None => SocketAddr::from_pathname(&name),
    };
    // A manager that does not hear is a matter of the manager.
    let _ = address.and_then(|address| UnixDatagram::unbound()?.send_to_addr(word.as_bytes(), &address));
}

#[cfg(not(target_os = "linux"))]
fn tell_systemd(_: &str) {}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(address: SocketAddr, question: &str) -> String {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(question.as_bytes()).unwrap();
        let mut said = String::new();
        stream.read_to_string(&mut said).unwrap();
        said
    }

    #[test]
    fn a_probe_hears_whether_the_process_is_ready_and_whether_it_beats() {
        let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let alive = Alive::open(Some(free), HostClock::start()).unwrap();
        let _silent = TcpStream::connect(free).unwrap(); // It holds up others for a second at most.
        let well = |path: &str| {
            let said = asked(free, &format!("GET {path} HTTP/1.1\r\nhost: a\r\n\r\n"));
            let (head, word) = said.split_once("\r\n\r\n").unwrap();
            assert!(head.contains(&format!("content-length: {}", word.len())), "{said}");
            head.starts_with("HTTP/1.1 200 ")
        };
        assert!(well("/alive") && !well("/ready"), "it waits for its router");
        alive.ready();
        assert!(well("/alive") && well("/ready"));
        alive.state.beaten_ns.fetch_sub(HANGS_NS, Ordering::Relaxed);
        assert!(!well("/alive") && !well("/ready"), "it hangs");
        alive.beat();
        assert!(well("/alive"), "it goes on");
        assert!(Alive::open(Some(free), HostClock::start()).is_err(), "the address is taken");
    }
}
