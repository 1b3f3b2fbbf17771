//! Receives everything on some ports for a while, with its senders.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::{IpAddr, UdpSocket};
use std::time::Duration;

use umbracast::Error;

use crate::clock::HostClock;
use crate::receive;

/// One datagram.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heard {
    /// The port of this host that it came to.
    pub port: u16,
    /// Who sent it.
    pub from: IpAddr,
    /// When it came.
    pub time_ns: i64,
    /// What it holds.
    pub payload: Vec<u8>,
}

/// Sockets that are bound and not yet read.
#[derive(Debug)]
pub struct Ears(Vec<(u16, UdpSocket)>);

impl Ears {
    /// Binds every port of `ports`, and those of `besides` that are free: what is sent to a wrong port is heard there.
    ///
    /// # Errors
    /// A port of `ports` that is taken: a program that receives already, for example.
    pub fn open(ports: &[u16], besides: &[u16]) -> Result<Self, Error> {
        let mut sockets = BTreeMap::new();
        for &port in ports {
            if let std::collections::btree_map::Entry::Vacant(free) = sockets.entry(port) {
                free.insert(receive::bind(port).map_err(|e| {
                    Error::new(format!(
                        "UDP port {port}: expected it free (does a live run listen already?), found {e}"
                    ))
                })?);
            }
        }
        for &port in besides.iter().filter(|port| !ports.contains(port)) {
            if let Ok(socket) = receive::bind(port) {
                sockets.insert(port, socket);
            }
        }
        Ok(Self(sockets.into_iter().collect()))
    }

    /// Listens for so long. Gives what came, in order of time.
    pub fn hear(self, wait: Duration, clock: HostClock) -> Vec<Heard> {
        let end_ns = clock.now_ns() + wait.as_nanos() as i64;
        let listening: Vec<_> = (self.0.into_iter())
            .map(|(port, socket)| std::thread::spawn(move || hear(port, &socket, end_ns, clock)))
            .collect();
        let mut all: Vec<Heard> =
            listening.into_iter().flat_map(|thread| thread.join().unwrap_or_default()).collect();
        all.sort_by_key(|heard| heard.time_ns);
        all
    }
}

fn hear(port: u16, socket: &UdpSocket, end_ns: i64, clock: HostClock) -> Vec<Heard> {
    let mut buffer = vec![0; receive::LONGEST_BYTES];
    let mut all = Vec::new();
    while clock.now_ns() < end_ns {
        match socket.recv_from(&mut buffer) {
            Ok((length, from)) => {
                let payload = buffer[..length].to_vec();
                all.push(Heard { port, from: from.ip(), time_ns: clock.now_ns(), payload });
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(_) => break,
        }
    }
    all
}
