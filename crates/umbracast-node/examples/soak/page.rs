//! Who looks at the page: one client of its stream, which comes again where it is sent away, and asks for the counters now and then.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

const WAKE: Duration = Duration::from_millis(50);
/// What the page asks of the stream, and what a program that watches asks.
const STREAM: &str = "GET /api/live HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
                      Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
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
    stream.write_all(STREAM.as_bytes())?;
    stream.set_read_timeout(Some(WAKE))?;
    let (mut bytes, mut part, mut is_open) = (Vec::new(), vec![0; 1 << 16], false);
    while !stop.load(Ordering::Relaxed) {
        match stream.read(&mut part) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(read) => bytes.extend_from_slice(&part[..read]),
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(e) => return Err(e),
        }
        if !is_open && let Some(end) = bytes.windows(4).position(|four| four == b"\r\n\r\n") {
            bytes.drain(..end + 4);
            is_open = true;
        }
        while is_open && let Some(length) = message_bytes(&bytes) {
            bytes.drain(..length);
            saw.bytes.fetch_add(length as u64, Ordering::Relaxed);
            if saw.frames.fetch_add(1, Ordering::Relaxed).is_multiple_of(LOOKS_EVERY) {
                saw.looks.fetch_add(1, Ordering::Relaxed);
                saw.answers
                    .fetch_add(u64::from(counters(at).is_ok_and(|is_there| is_there)), Ordering::Relaxed);
            }
        }
    }
    Ok(())
}

/// Length of the WebSocket message that the bytes begin with, once it is there: a server's are not masked.
fn message_bytes(bytes: &[u8]) -> Option<usize> {
    let (head, length) = match *bytes.get(1)? {
        126 => (4, usize::from(u16::from_be_bytes(bytes.get(2..4)?.try_into().ok()?))),
        127 => (10, u64::from_be_bytes(bytes.get(2..10)?.try_into().ok()?) as usize),
        short => (2, usize::from(short)),
    };
    (bytes.len() >= head + length).then_some(head + length)
}

fn counters(at: SocketAddr) -> std::io::Result<bool> {
    let mut stream = TcpStream::connect(at)?;
    stream.set_read_timeout(Some(Duration::from_secs(2)))?;
    stream.write_all(COUNTERS.as_bytes())?;
    let mut said = String::new();
    stream.read_to_string(&mut said)?;
    Ok(said.starts_with("HTTP/1.1 200") && said.contains("umbracast_frames"))
}
