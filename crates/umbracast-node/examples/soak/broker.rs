//! A broker of MQTT 3.1.1 for one client: acknowledges what is published, counts it, and hangs up now and then.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use umbracast::Error;

const WAKE: Duration = Duration::from_millis(50);
/// Of packets, in the upper half of their first byte.
const CONNECT: u8 = 1;
const PUBLISH: u8 = 3;
const SUBSCRIBE: u8 = 8;
const PING: u8 = 12;

/// What a broker and its owner share.
#[derive(Debug, Default)]
pub struct Said {
    pub connections: AtomicU64,
    pub frames: AtomicU64,
    pub warnings: AtomicU64,
    /// Set by the owner: the broker hangs up, once.
    pub hang_up: AtomicBool,
    stop: AtomicBool,
}

/// Its thread.
pub struct Broker {
    pub address: SocketAddr,
    pub said: Arc<Said>,
    thread: JoinHandle<()>,
}

impl Broker {
    /// Listens on a free port of this host.
    ///
    /// # Errors
    /// No port.
    pub fn start() -> Result<Self, Error> {
        let failed = |e: std::io::Error| Error::new(e.to_string()).within("broker");
        let listener = TcpListener::bind("127.0.0.1:0").map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let said = Arc::new(Said::default());
        let shared = said.clone();
        let thread = std::thread::spawn(move || {
            while !shared.stop.load(Ordering::Relaxed) {
                match listener.accept() {
                    // Whatever ends a connection, the client comes again.
                    Ok((stream, _)) => drop(talk(stream, &shared)),
                    Err(_) => std::thread::sleep(WAKE),
                }
            }
        });
        Ok(Self { address, said, thread })
    }

    pub fn stop(self) {
        self.said.stop.store(true, Ordering::Relaxed);
        let _ = self.thread.join();
    }
}

/// Until somebody hangs up.
fn talk(mut stream: TcpStream, said: &Said) -> std::io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(WAKE))?;
    let (mut bytes, mut part) = (Vec::new(), vec![0; 1 << 16]);
    while !said.stop.load(Ordering::Relaxed) && !said.hang_up.swap(false, Ordering::Relaxed) {
        match stream.read(&mut part) {
            Ok(0) => break,
            Ok(read) => bytes.extend_from_slice(&part[..read]),
            Err(e) if matches!(e.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {}
            Err(e) => return Err(e),
        }
        let mut taken = 0;
        while let Some((from, to)) = packet(&bytes[taken..]) {
            let answer = answered(bytes[taken], &bytes[taken + from..taken + to], said);
            stream.write_all(&answer)?;
            taken += to;
        }
        bytes.drain(..taken);
    }
    Ok(())
}

/// Where the body of the packet begins and ends with which the bytes begin, once it is whole.
fn packet(bytes: &[u8]) -> Option<(usize, usize)> {
    let mut length = 0;
    for (k, byte) in bytes.iter().skip(1).take(4).enumerate() {
        length |= usize::from(byte & 127) << (7 * k);
        if byte & 128 == 0 {
            return (bytes.len() >= k + 2 + length).then_some((k + 2, k + 2 + length));
        }
    }
    None
}

fn answered(head: u8, body: &[u8], said: &Said) -> Vec<u8> {
    match head >> 4 {
        CONNECT => {
            said.connections.fetch_add(1, Ordering::Relaxed);
            vec![0x20, 2, 0, 0]
        }
        PUBLISH => {
            let [high, low, rest @ ..] = body else { return Vec::new() };
            let length = usize::from(u16::from_be_bytes([*high, *low]));
            let (Some(topic), Some(number)) = (rest.get(..length), rest.get(length..length + 2)) else {
                return Vec::new();
            };
            let is_frame = topic.ends_with(b"/frames");
            let is_warning = topic.windows(10).any(|word| word == b"/warnings/");
            said.frames.fetch_add(u64::from(is_frame), Ordering::Relaxed);
            said.warnings.fetch_add(u64::from(is_warning), Ordering::Relaxed);
            vec![0x40, 2, number[0], number[1]]
        }
        SUBSCRIBE => vec![0x90, 3, body[0], body[1], 0],
        PING => vec![0xD0, 0],
        _ => Vec::new(),
    }
}
