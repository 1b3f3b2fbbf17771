//! Receives sensors over UDP: a socket and a thread for each port. The sender's address tells sensors on one port
//! apart.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use socket2::{Domain, Protocol, Socket, Type};
use umbracast::Error;
use umbracast::lidar::Packet;

use crate::clock::HostClock;
use crate::queue::Queue;

/// What the system shall hold for us while we are not scheduled: 4 MiB are two HDL-32E for 0.9 s. The system may give
/// less (`net.core.rmem_max`).
const SOCKET_BUFFER_BYTES: usize = 4 << 20;
/// How long a stop may go unnoticed.
const WAKE: Duration = Duration::from_millis(100);
/// No sensor's packet is longer: the largest Ouster's has 33 kB. Longer ones are cut here, and not understood later.
pub(crate) const LONGEST_BYTES: usize = 33_280;

/// Where a sensor's packets come in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Door {
    /// The sensor's place in the site.
    pub sensor: usize,
    /// UDP port on this host.
    pub port: u16,
    /// The sensor's own address; none takes whatever comes in on the port.
    pub from: Option<IpAddr>,
}

/// A packet and whose it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrived {
    /// The sensor's place in the site.
    pub sensor: usize,
    /// With the time that it came.
    pub packet: Packet,
}

impl Arrived {
    /// Of memory, in a queue.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.packet.payload.len()
    }
}

/// Threads that receive until they are told to stop.
#[derive(Debug)]
pub struct Receivers {
    threads: Vec<JoinHandle<()>>,
    stop: Arc<AtomicBool>,
    /// Packets from addresses that no sensor has.
    strangers: Arc<AtomicU64>,
    /// Where each door's socket is bound.
    bound: Vec<SocketAddr>,
}

impl Receivers {
    /// Opens every port and begins to receive. Port 0 takes a free one.
    ///
    /// # Errors
    /// A port that is taken, and two sensors that cannot be told apart.
    pub fn start(doors: &[Door], clock: HostClock, packets: &Arc<Queue<Arrived>>) -> Result<Self, Error> {
        let stop = Arc::new(AtomicBool::new(false));
        let strangers = Arc::new(AtomicU64::new(0));
        let mut of_port: BTreeMap<(u16, usize), Vec<usize>> = BTreeMap::new();
        for (k, door) in doors.iter().enumerate() {
            // Every free port is a port of its own.
            let key = if door.port == 0 { (0, k) } else { (door.port, 0) };
            of_port.entry(key).or_default().push(k);
        }
        let bound = vec![SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)); doors.len()];
        let mut receivers = Self { threads: Vec::new(), stop, strangers, bound };
        for ((port, _), here) in of_port {
            let shared: Vec<Door> = here.iter().map(|&k| doors[k].clone()).collect();
            told_apart(port, &shared)?;
            let socket = bind(port).map_err(|e| Error::new(format!("UDP port {port}: {e}")))?;
            let at = socket.local_addr().map_err(|e| Error::new(e.to_string()))?;
            here.iter().for_each(|&k| receivers.bound[k] = at);
            let (stop, strangers) = (receivers.stop.clone(), receivers.strangers.clone());
            let packets = packets.clone();
            receivers.threads.push(std::thread::spawn(move || {
                receive(&socket, &shared, clock, &packets, &stop, &strangers);
            }));
        }
        Ok(receivers)
    }

    /// Where each sensor's packets come in, in the order of the doors.
    pub fn bound(&self) -> &[SocketAddr] {
        &self.bound
    }

    /// Packets so far that came from no sensor's address.
    pub fn strangers(&self) -> u64 {
        self.strangers.load(Ordering::Relaxed)
    }

    /// Packets that the system gave up because nobody read them in time, since the sockets were opened; `None` where it
    /// does not say (it does on Linux).
    pub fn dropped_by_system(&self) -> Option<u64> {
        let table = std::fs::read_to_string("/proc/net/udp").ok()?;
        let ports: Vec<u16> = self.bound.iter().map(SocketAddr::port).collect();
        Some(dropped(&table, &ports))
    }

    /// Ends every thread, and closes the sockets with it.
    pub fn stop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join(); // A receiver does not panic; if one did, the others end all the same.
        }
    }
}

/// The last column of `/proc/net/udp`, of sockets that are bound to these ports of every address: `local_address` is the
/// second, in hexadecimal numbers.
fn dropped(table: &str, ports: &[u16]) -> u64 {
    let of_line = |line: &str| {
        let mut columns = line.split_whitespace();
        let (address, port) = columns.nth(1)?.split_once(':')?;
        let port = u16::from_str_radix(port, 16).ok()?;
        let own = address == "00000000" && ports.contains(&port);
        if own { columns.last()?.parse::<u64>().ok() } else { None }
    };
    table.lines().skip(1).filter_map(of_line).sum()
}

fn told_apart(port: u16, doors: &[Door]) -> Result<(), Error> {
    let unnamed = doors.len() > 1 && doors.iter().any(|door| door.from.is_none());
    let twice = (1..doors.len()).any(|i| doors[..i].iter().any(|other| other.from == doors[i].from));
    if unnamed || twice {
        let sensors: Vec<String> = doors.iter().map(|door| door.sensor.to_string()).collect();
        return Err(Error::new(format!(
            "UDP port {port}: expected an address of its own for each of sensors {}, or a port of its own",
            sensors.join(", ")
        )));
    }
    Ok(())
}

pub(crate) fn bind(port: u16) -> std::io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_recv_buffer_size(SOCKET_BUFFER_BYTES)?;
    socket.bind(&SocketAddr::from((Ipv4Addr::UNSPECIFIED, port)).into())?;
    socket.set_read_timeout(Some(WAKE))?;
    Ok(socket.into())
}

fn receive(
    socket: &UdpSocket,
    doors: &[Door],
    clock: HostClock,
    packets: &Queue<Arrived>,
    stop: &AtomicBool,
    strangers: &AtomicU64,
) {
    let mut buffer = vec![0; LONGEST_BYTES];
    while !stop.load(Ordering::Relaxed) {
        match socket.recv_from(&mut buffer) {
            Ok((length, from)) => {
                let time_ns = clock.now_ns();
                let own = |door: &&Door| door.from.is_none_or(|address| address == from.ip());
                match doors.iter().find(own) {
                    Some(door) => {
                        let packet = Packet { time_ns, payload: buffer[..length].to_vec() };
                        packets.push(Arrived { sensor: door.sensor, packet });
                    }
                    None => {
                        strangers.fetch_add(1, Ordering::Relaxed);
                    }
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            // An interface that went away comes back, or does not: no packet is no reason to end.
            Err(_) => std::thread::sleep(WAKE),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::queue::WhenFull;

    fn door(sensor: usize, port: u16, from: Option<[u8; 4]>) -> Door {
        Door { sensor, port, from: from.map(IpAddr::from) }
    }

    #[test]
    fn packets_on_one_port_are_told_apart_by_their_address_and_strangers_are_counted() {
        let packets = Arc::new(Queue::new(16, WhenFull::DropNewest));
        // A free port is known once it is bound: bound twice here, the second time with both sensors on it.
        let port = UdpSocket::bind("0.0.0.0:0").unwrap().local_addr().unwrap().port();
        let doors = [door(0, port, Some([127, 0, 0, 2])), door(1, port, Some([127, 0, 0, 3]))];
        let mut receivers = Receivers::start(&doors, HostClock::start(), &packets).unwrap();
        for last in [3, 2, 9] {
            let sender = UdpSocket::bind(SocketAddr::from(([127, 0, 0, last], 0))).unwrap();
            sender.send_to(&[last; 5], ("127.0.0.1", port)).unwrap();
        }
        let two: Vec<Arrived> = (0..2).filter_map(|_| packets.pop()).collect();
        assert_eq!((two[0].sensor, &two[0].packet.payload[..]), (1, &[3; 5][..]));
        assert_eq!((two[1].sensor, &two[1].packet.payload[..]), (0, &[2; 5][..]));
        while receivers.strangers() == 0 {
            std::thread::yield_now();
        }
        receivers.stop();
    }

    #[test]
    fn a_second_sensor_alone_tells_the_port_that_it_listens_on() {
        let packets = Arc::new(Queue::new(1, WhenFull::DropNewest));
        let mut receivers = Receivers::start(&[door(1, 0, None)], HostClock::start(), &packets).unwrap();
        let [bound] = receivers.bound() else { panic!("{:?}", receivers.bound()) };
        assert_ne!(bound.port(), 0);
        receivers.stop();
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_the_system_gives_up_is_counted() {
        let socket = bind(0).unwrap();
        let port = socket.local_addr().unwrap().port();
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        // Twice of what the system may hold for it, and nobody reads.
        for _ in 0..2 * SOCKET_BUFFER_BYTES / 1206 {
            sender.send_to(&[7; 1206], ("127.0.0.1", port)).unwrap();
        }
        let table = std::fs::read_to_string("/proc/net/udp").unwrap();
        assert!(dropped(&table, &[port]) > 100 && dropped(&table, &[]) == 0, "{table}");
    }

    #[test]
    fn sensors_that_cannot_be_told_apart_are_refused() {
        let packets = Arc::new(Queue::new(1, WhenFull::DropNewest));
        let doors = [door(0, 2368, None), door(1, 2368, Some([10, 0, 0, 1]))];
        let message = Receivers::start(&doors, HostClock::start(), &packets).unwrap_err().to_string();
        assert!(message.contains("2368") && message.contains("sensors 0, 1"), "{message}");
    }
}
