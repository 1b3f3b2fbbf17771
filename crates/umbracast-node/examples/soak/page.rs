//! Who looks at the page: one client of its stream, which comes again where it is sent away, and asks for the counters now and then.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use super::stream::{Messages, upgrade};

const WAKE: Duration = Duration::from_millis(50);
/// What the page asks of the stream, and what a program that watches asks.
const STREAM: &str = "/api/live";
const COUNTERS: &str = "GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n";
/// Frames between two looks at the counters.
const LOOKS_EVERY: u64 = 100;

/// What it saw.
#[derive(Debug, Default)]
pub struct Saw {
    pub frames: AtomicU64,
    pub bytes: AtomicU64,
    pub connections: AtomicU64,
    /// Looks at the counters, and those that were answered.
    pub looks: AtomicU64,
    pub answers: AtomicU64,
}

impl Saw {
    /// Counts a message of the stream, and asks for the counters after so many.
    fn message(&self, bytes: usize, at: SocketAddr) {
        self.bytes.fetch_add(bytes as u64, Ordering::Relaxed);
        if self.frames.fetch_add(1, Ordering::Relaxed).is_multiple_of(LOOKS_EVERY) {
            self.looks.fetch_add(1, Ordering::Relaxed);
            let is_answered = counters(at).is_ok_and(|is_there| is_there);
            self.answers.fetch_add(u64::from(is_answered), Ordering::Relaxed);
        }
    }
}

/// Its thread.
pub struct Client {
    pub saw: Arc<Saw>,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Client {
    /// Looks until it is told to stop.
    pub fn start(at: SocketAddr) -> Self {
        let (saw, stop) = (Arc::new(Saw::default()), Arc::new(AtomicBool::new(false)));
        let (shared, ended) = (saw.clone(), stop.clone());
        let thread = std::thread::spawn(move || {
            while !ended.load(Ordering::Relaxed) {
                // Whoever is sent away comes again; how often is counted.
                if look(at, &shared, &ended).is_err() {
                    std::thread::sleep(WAKE);
                }
            }
        });
        Self { saw, stop, thread }
    }

    pub fn stop(self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.thread.join();
    }
}

fn look(at: SocketAddr, saw: &Saw, stop: &AtomicBool) -> std::io::Result<()> {
    let mut stream = TcpStream::connect(at)?;
    saw.connections.fetch_add(1, Ordering::Relaxed);
    stream.write_all(upgrade(STREAM).as_bytes())?;
    stream.set_read_timeout(Some(WAKE))?;
    let (mut messages, mut part) = (Messages::default(), vec![0; 1 << 16]);
    while !stop.load(Ordering::Relaxed) {
        match stream.read(&mut part) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(read) => messages.take(&part[..read], |bytes| saw.message(bytes, at)),
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(e) => return Err(e),
        }
    }
    Ok(())
}

fn counters(at: SocketAddr) -> std::io::Result<bool> {
    let mut stream = TcpStream::connect(at)?;
    stream.set_read_timeout(Some(Duration::from_secs(2)))?;
    stream.write_all(COUNTERS.as_bytes())?;
    let mut said = String::new();
    stream.read_to_string(&mut said)?;
    Ok(said.starts_with("HTTP/1.1 200") && said.contains("umbracast_frames"))
}
