//! Who looks at the page: one client as it should be, and beside it, from another address, those that it has to bear.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep};
use std::time::Duration;

use socket2::{Domain, Socket, Type};
use umbracast::Error;
use umbracast_live::HostClock;

use super::hall::FAILS_NS;
use super::stream::{Messages, upgrade};

/// Clients of one kind at once; a process may have some thousand files open.
const SLOW: usize = 48;
const MANY: usize = 400;
/// The system holds no more for a client that is slow.
const RECEIVE_BUFFER_BYTES: usize = 4096;
const LOOPBACK: Ipv4Addr = Ipv4Addr::LOCALHOST;
/// Where the others come from: the same host under another address.
const ELSEWHERE: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 2);

/// Who comes while it fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clients {
    /// There is no page.
    Nobody,
    /// They ask for frames and events, and read a byte a second.
    Slow,
    /// Hundreds at once, and as many again: they connect and say nothing.
    Many,
    /// What they send is no request, or one that must be refused.
    Hostile,
}

/// What the client that is as it should be saw while the others came.
pub struct Page {
    pub frames: usize,
    pub gap_ns: i64,
    /// Connections of the others.
    pub others: usize,
}

impl std::fmt::Display for Page {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { frames, gap_ns, others } = self;
        let gap_ms = *gap_ns as f64 * 1e-6;
        write!(
            f,
            "{others} connections, the page beside them sees {frames} frames, {gap_ms:.0} ms apart at most"
        )
    }
}

impl Clients {
    /// Comes and goes, in a thread of its own; gives how many connections were made.
    pub fn come(self, at: SocketAddr, clock: HostClock, begun_ns: i64) -> JoinHandle<Result<usize, Error>> {
        std::thread::spawn(move || {
            clock.sleep_until(begun_ns + FAILS_NS.start);
            let over = || clock.now_ns() >= begun_ns + FAILS_NS.end;
            Ok(match self {
                Self::Nobody => 0,
                Self::Slow => read_slowly(at, over),
                Self::Many => say_nothing(at, over),
                Self::Hostile => send_garbage(at, over),
            })
        })
    }
}

/// A client of `/api/live` as the page is one, from the beginning of the run until `ended`.
pub fn look(
    at: SocketAddr,
    clock: HostClock,
    begun_ns: i64,
    ended: &Arc<AtomicBool>,
) -> JoinHandle<Result<Page, Error>> {
    let ended = ended.clone();
    std::thread::spawn(move || {
        let failed = |e: std::io::Error| Error::new(e.to_string()).within("who looks at the page");
        let mut stream = ask(at, LOOPBACK, &upgrade("/api/live")).map_err(failed)?;
        stream.set_read_timeout(Some(Duration::from_millis(100))).map_err(failed)?;
        let (mut messages, mut part, mut times_ns) = (Messages::default(), vec![0; 1 << 16], Vec::new());
        while !ended.load(Ordering::Relaxed) {
            match stream.read(&mut part) {
                Ok(0) => return Err(Error::new("the page was closed to who looks at it as one should")),
                Ok(read) => messages.take(&part[..read], |_| times_ns.push(clock.now_ns() - begun_ns)),
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Err(e) => return Err(failed(e)),
            }
        }
        times_ns.retain(|time_ns| FAILS_NS.contains(time_ns));
        let gap_ns = times_ns.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(i64::MAX);
        Ok(Page { frames: times_ns.len(), gap_ns, others: 0 })
    })
}

/// A connection from this address, on which something was said.
fn ask(at: SocketAddr, from: Ipv4Addr, words: &str) -> std::io::Result<TcpStream> {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None)?;
    if from != LOOPBACK {
        socket.set_recv_buffer_size(RECEIVE_BUFFER_BYTES)?;
    }
    socket.bind(&SocketAddr::from((from, 0)).into())?;
    socket.connect_timeout(&at.into(), Duration::from_secs(2))?;
    let mut stream = TcpStream::from(socket);
    stream.write_all(words.as_bytes())?;
    Ok(stream)
}

/// Whoever is refused or dropped comes again.
fn read_slowly(at: SocketAddr, over: impl Fn() -> bool) -> usize {
    let mut came = 0;
    let events = "GET /api/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
    let mut slow: Vec<(String, Option<TcpStream>)> = (0..SLOW)
        .map(|k| (if k % 2 == 0 { upgrade("/api/live") } else { events.to_owned() }, None))
        .collect();
    while !over() {
        for (words, stream) in &mut slow {
            if stream.is_none() {
                *stream = ask(at, ELSEWHERE, words).ok().filter(|new| new.set_nonblocking(true).is_ok());
                came += usize::from(stream.is_some());
            }
            let read = stream.as_mut().map(|stream| stream.read(&mut [0]));
            let is_there = |e: &std::io::Error| e.kind() == ErrorKind::WouldBlock;
            if !matches!(&read, Some(Ok(1))) && !matches!(&read, Some(Err(e)) if is_there(e)) {
                *stream = None;
            }
        }
        sleep(Duration::from_secs(1));
    }
    came
}

fn say_nothing(at: SocketAddr, over: impl Fn() -> bool) -> usize {
    let (mut silent, mut came) = (VecDeque::new(), 0);
    while !over() {
        silent.extend(ask(at, ELSEWHERE, "").inspect(|_| came += 1));
        if silent.len() > MANY {
            silent.pop_front();
        }
        sleep(Duration::from_millis(1));
    }
    came
}

fn send_garbage(at: SocketAddr, over: impl Fn() -> bool) -> usize {
    let long = "x".repeat(1 << 20);
    let host = "Host: 127.0.0.1\r\n";
    let garbage = [
        "\0\u{1}\u{2}\u{3}\u{ff}\r\n\r\n".to_owned(),
        "\u{16}\u{3}\u{1}\u{2}\0\u{1}\0".to_owned(), // As TLS begins.
        format!("GET /{long} HTTP/1.1\r\n{host}\r\n"),
        format!("GET / HTTP/1.1\r\n{host}X-Long: {long}\r\n\r\n"),
        format!("GET /../../etc/passwd HTTP/1.1\r\n{host}\r\n"),
        format!("GET /%00%ff/?token=%zz HTTP/9.9\r\n{host}\r\n"),
        "GET / HTTP/1.1\r\nHost: elsewhere.example\r\nOrigin: http://elsewhere.example\r\n\r\n".to_owned(),
        format!("GET /api/recording/frames?from=-1&count=99999999999999999999 HTTP/1.1\r\n{host}\r\n"),
        format!("POST /api/reports HTTP/1.1\r\n{host}Content-Length: 99999999999\r\n\r\n{{"),
        format!("POST /api/reports HTTP/1.1\r\n{host}Transfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n"),
        format!("{}\u{81}\u{ff}\u{ff}\u{ff}\u{ff}\u{ff}", upgrade("/api/live")),
        format!("{}{long}", upgrade("/api/objects/nobody")),
    ];
    let (mut open, mut came) = (VecDeque::new(), 0);
    for words in garbage.iter().cycle() {
        if over() {
            break;
        }
        // The server closes some while they are written; those that it does not stay open for a while.
        open.extend(ask(at, ELSEWHERE, words));
        came += 1;
        if open.len() > MANY / 4 {
            open.pop_front();
        }
        sleep(Duration::from_millis(2));
    }
    came
}
