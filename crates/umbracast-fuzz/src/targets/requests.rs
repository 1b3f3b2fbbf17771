//! Requests to the live server, over loopback.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use socket2::{Domain, Socket, Type};
use umbracast::Config;
use umbracast_live::serve::{Door, Server, Watched, start};
use umbracast_live::{HostClock, Published};

use super::Target;

/// Whatever comes over a connection is answered or cut off, nothing of the hall is shown without the token, and the server
/// goes on. What answers longer than a frame is cut off by this side.
pub const HTTP: Target = Target { name: "http", corpus: requests, check: request };

const TOKEN: &str = "a-token-of-tests";
/// The server answers within less, or it hangs.
const PATIENCE: Duration = Duration::from_secs(20);
/// As much of an answer is read.
const ANSWER_BYTES: usize = 1 << 16;

/// It ends with the program.
static SERVER: LazyLock<Server> = LazyLock::new(|| {
    let watched = Watched::new(Config::default().site, Arc::default(), HostClock::start(), "a hall");
    let address = SocketAddr::from(([127, 0, 0, 1], 0));
    let door = Door { token: Some(TOKEN.to_owned()), ..Door::at(address) };
    let server = start(door, watched).expect("a free port");
    server.publisher().publish(&Arc::new(Published { frame: 12, published_ns: 1, ..Published::default() }));
    server
});

fn requests() -> Vec<Vec<u8>> {
    let get = |path: &str, heads: &str| {
        format!("GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer {TOKEN}\r\n{heads}\r\n")
            .into_bytes()
    };
    let upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let mut watching = get("/api/live?points=0", upgrade);
    // A frame of text with its mask, one in two parts, a ping, a close.
    watching.extend([0x81, 0x82, 1, 2, 3, 4, 0x69, 0x6b]);
    watching.extend([0x01, 0x81, 0, 0, 0, 0, 0x61, 0x80, 0x81, 0, 0, 0, 0, 0x62]);
    watching.extend([0x89, 0x80, 1, 1, 1, 1, 0x88, 0x80, 1, 1, 1, 1]);
    let two = [get("/api/frame?points=0", ""), get("/health", "Connection: close\r\n")].concat();
    let posted = b"POST /api/frame HTTP/1.1\r\nHost: localhost:8600\r\nOrigin: http://localhost:8600\r\nContent-Length: 3\r\n\
                   Cookie: a=b; umbracast_token=a-token-of-tests\r\n\r\nabc";
    let chunked =
        b"GET /metrics?token=a-token-of-tests HTTP/1.1\r\nHost: [::1]\r\nTransfer-Encoding: chunked\r\n\r\n\
                    3\r\nabc\r\n0\r\n\r\n";
    vec![
        two,
        watching,
        posted.to_vec(),
        chunked.to_vec(),
        get("/api/events", ""),
        get("/api/openapi.json", "Accept: */*\r\n"),
    ]
}

fn request(bytes: &[u8]) -> bool {
    let answer = asked(bytes).expect("the server is there");
    let answered = answer.starts_with(b"HTTP/1.1 200") || answer.starts_with(b"HTTP/1.1 101");
    let knew = holds(bytes, TOKEN.as_bytes());
    assert!(knew || !answered, "{}", String::from_utf8_lossy(&answer));
    assert!(answer.is_empty() || answer.starts_with(b"HTTP/1."), "{}", String::from_utf8_lossy(&answer));
    answered
}

/// A connection from an address of loopback that was not used lately: wrong tokens close the door to an address.
fn connected() -> std::io::Result<TcpStream> {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None)?;
    let number = NEXT.fetch_add(1, Ordering::Relaxed) % (1 << 16);
    let from = Ipv4Addr::from_bits((127 << 24) | (1 << 16) | number);
    // Where loopback has one address alone, requests come from that.
    let _ = socket.bind(&SocketAddr::from((from, 0)).into());
    // Closed at once: thousands of connections a second would use up the ports.
    socket.set_linger(Some(Duration::ZERO))?;
    socket.connect(&SERVER.address().into())?;
    let stream = TcpStream::from(socket);
    stream.set_read_timeout(Some(PATIENCE))?;
    Ok(stream)
}

/// What the server says to these bytes, until it or this side has said enough.
fn asked(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut stream = connected()?;
    // Whoever is cut off while it speaks is told so by an error.
    let said = stream.write_all(bytes).and_then(|()| stream.shutdown(Shutdown::Write));
    let (mut answer, mut part) = (Vec::new(), [0; 4096]);
    // Events go on for ever: hyper does not notice that the client has said all while bytes of it wait to be read.
    while said.is_ok() && answer.len() < ANSWER_BYTES && !holds(&answer, b"text/event-stream") {
        match stream.read(&mut part) {
            Ok(0) => break,
            Ok(read) => answer.extend_from_slice(&part[..read]),
            Err(error) if error.kind() == std::io::ErrorKind::ConnectionReset => break,
            Err(error) => return Err(error),
        }
    }
    Ok(answer)
}

fn holds(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|part| part == word)
}
