//! Hostile clients beside a good one.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;

use umbracast::Config;
use umbracast_io::rows::LinkRow;

use super::*;
use crate::clock::HostClock;
use crate::run::Counters;
use crate::warnings::{Event, State as LinkState};

const UPGRADE: &str = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                       Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

fn server(limits: Limits) -> Server {
    let watched =
        Watched::new(Config::default().site, Arc::new(Counters::default()), HostClock::start(), "a test");
    start_with(limits, Door::at(SocketAddr::from(([127, 0, 0, 1], 0))), watched).unwrap()
}

fn brief() -> Limits {
    let soon = Duration::from_millis(400);
    Limits { ask_within: soon, take_within: soon, ..Limits::default() }
}

/// A frame of some 100 kB.
fn frame(frame: u64) -> Arc<Published> {
    let points_cm = vec![[-1234, 1234, 123]; 6000];
    Arc::new(Published { frame, published_ns: 1, points_cm, ..Published::default() })
}

/// A connection on which this was asked for.
fn ask(server: &Server, path: &str, heads: &str) -> TcpStream {
    let mut stream = TcpStream::connect(server.address()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {}\r\n{heads}\r\n", server.address()).unwrap();
    stream
}

/// What `/metrics` says of it.
fn counted(server: &Server, name: &str) -> f64 {
    let mut metrics = String::new();
    ask(server, "/metrics", "Connection: close\r\n").read_to_string(&mut metrics).unwrap();
    let value = metrics.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    value.unwrap().parse().unwrap()
}

/// Somebody who watches as the page does.
struct Watcher(BufReader<TcpStream>);

impl Watcher {
    fn new(server: &Server) -> Self {
        let mut stream = BufReader::new(ask(server, "/api/live", UPGRADE));
        let mut line = String::new();
        while line != "\r\n" {
            line.clear();
            assert!(stream.read_line(&mut line).unwrap() > 0, "closed");
        }
        let mut watcher = Self(stream);
        watcher.next(); // What there was before.
        watcher
    }

    /// The number of the next frame.
    fn next(&mut self) -> u64 {
        let mut head = [0; 2];
        self.0.read_exact(&mut head).unwrap();
        let mut long = vec![0; usize::from(head[1] == 126) * 2 + usize::from(head[1] == 127) * 8];
        self.0.read_exact(&mut long).unwrap();
        let long = long.iter().fold(0, |length, byte| length << 8 | usize::from(*byte));
        let length = if head[1] < 126 { usize::from(head[1]) } else { long };
        let mut text = vec![0; length];
        self.0.read_exact(&mut text).unwrap();
        let frame: Value = serde_json::from_slice(&text).unwrap();
        frame["frame"].as_u64().unwrap()
    }
}

/// True when the other end closes it within ten seconds.
fn is_closed(mut stream: TcpStream) -> bool {
    stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    stream.read_to_end(&mut Vec::new()).is_ok()
}

#[test]
fn a_thousand_silent_connections_keep_nobody_out() {
    // Nobody goes by himself here: who is silent has an hour.
    let server = server(Limits { ask_within: Duration::from_secs(3600), ..Limits::default() });
    let mut before = Watcher::new(&server);
    let mut silent = VecDeque::new();
    for k in 0..1000 {
        silent.push_back(TcpStream::connect(server.address()).unwrap());
        // As many as a process may have open; the server has closed those before long since.
        if silent.len() > 400 {
            silent.pop_front();
        }
        if k % 100 == 0 {
            server.publisher().publish(&frame(k));
            assert_eq!(before.next(), k, "who watched before");
            let mut now = Watcher::new(&server);
            server.publisher().publish(&frame(k + 1));
            assert_eq!((before.next(), now.next()), (k + 1, k + 1), "who came after {k}");
        }
    }
    assert!(counted(&server, "umbracast_connections_refused_total") > 800.0);
    server.stop();
}

#[test]
fn a_head_that_comes_byte_by_byte_is_not_waited_for() {
    let server = server(brief());
    let mut slow = TcpStream::connect(server.address()).unwrap();
    let clock = HostClock::start();
    let begun_ns = clock.now_ns();
    let head = b"GET /api/frame HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Long: ";
    let mut byte = head.iter().chain(std::iter::repeat(&b'x'));
    while slow.write_all(&[*byte.next().unwrap()]).is_ok() {
        assert!(clock.now_ns() - begun_ns < 10_000_000_000, "still waited for");
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(clock.now_ns() - begun_ns > 300_000_000, "closed at once");
    server.stop();
}

#[test]
fn who_asked_and_asks_no_more_is_let_go() {
    let server = server(brief());
    assert!(is_closed(ask(&server, "/api/frame", "")), "kept alive for good");
    server.stop();
}

#[test]
fn who_never_reads_is_dropped_and_the_others_get_every_frame() {
    let server = server(brief());
    let mut watcher = Watcher::new(&server);
    let deaf = ask(&server, "/api/live", UPGRADE);
    let deaf_to_events = ask(&server, "/api/events", "");
    let link = LinkRow::default();
    let events = vec![Event { access_point: String::new(), link, state: LinkState::Warned }; 500];
    let clock = HostClock::start();
    let begun_ns = clock.now_ns();
    let mut count = 0;
    while counted(&server, "umbracast_streams") < 3.0 {
        std::thread::yield_now();
    }
    while counted(&server, "umbracast_streams") > 1.0 {
        count += 1;
        let published = Published { events: events.clone(), ..(*frame(count)).clone() };
        server.publisher().publish(&Arc::new(published));
        assert_eq!(watcher.next(), count, "the watcher misses nothing");
        assert!(clock.now_ns() - begun_ns < 20_000_000_000, "still waited for");
    }
    assert!(count > 3, "dropped before anything was sent");
    drop((deaf, deaf_to_events));
    server.stop();
}

#[test]
fn one_address_takes_half_of_the_streams_at_most() {
    let server = server(Limits { streams: 4, streams_of_address: 2, ..Limits::default() });
    let _two = [Watcher::new(&server), Watcher::new(&server)];
    let mut third = ask(&server, "/api/live", UPGRADE);
    let mut answer = [0; 12];
    third.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"HTTP/1.1 503");
    server.stop();
}

/// Room for 16 MB was made, 64 times, for frames that never came.
#[test]
fn a_frame_of_a_websocket_is_refused_by_its_length_before_it_comes() {
    let server = server(Limits::default());
    let mut stream = BufReader::new(ask(&server, "/api/live", UPGRADE));
    let mut line = String::new();
    while line != "\r\n" {
        line.clear();
        assert!(stream.read_line(&mut line).unwrap() > 0, "closed");
    }
    // A text of 8 MB, of which the first bytes are sent.
    let mut stream = stream.into_inner();
    stream.write_all(&[0x81, 0xff, 0, 0, 0, 0, 0, 0x80, 0, 0, 1, 2, 3, 4, 5, 6]).unwrap();
    assert!(is_closed(stream));
    server.stop();
}
