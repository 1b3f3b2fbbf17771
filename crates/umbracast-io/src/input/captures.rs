//! Captures: one for each sensor of the site, or whole recordings with all sensors in one, told apart by port and
//! address.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use umbracast::lidar::{Packet, udp_port};
use umbracast::site::Sensor;
use umbracast::{Error, Site};

use super::sink::PacketSink;
use crate::pcap::{Datagram, PcapReader};

/// A capture of several sensors shows more than one of them within so many nanoseconds.
const LOOK_NS: i64 = 2_000_000_000;

/// Captures as scenes. Each is one where the site has one sensor, or where one of them holds packets of several sensors;
/// else they are one for each sensor in the site's order, and one scene together.
///
/// # Errors
/// Another number of captures of single sensors, or a file that is no capture.
pub fn in_scenes(files: Vec<PathBuf>, site: &Site) -> Result<Vec<Vec<PathBuf>>, Error> {
    let (expected, found) = (site.sensors.len(), files.len());
    let apart = whole_site(site).is_ok();
    let mut whole = expected == 1 || found == 1;
    for file in files.iter().filter(|_| apart) {
        whole = whole || shows_several(file, site)?;
    }
    match whole {
        true => Ok(files.into_iter().map(|file| vec![file]).collect()),
        false if found == expected => Ok(vec![files]),
        false => Err(Error::new(format!(
            "expected {expected} captures, one for each sensor of the site in its order, or captures that hold packets \
             of all of them, found {found} of single sensors"
        ))
        .within(files[0].display())),
    }
}

fn shows_several(file: &Path, site: &Site) -> Result<bool, Error> {
    let mut capture = Capture::open(file, whole_site(site)?)?;
    let Some((first, Packet { time_ns, .. })) = capture.next() else { return Ok(false) };
    let others = std::iter::from_fn(|| capture.next());
    Ok(others.take_while(|(_, packet)| packet.time_ns - time_ns < LOOK_NS).any(|(sensor, _)| sensor != first))
}

/// Gives the packets of one scene's captures, as [`in_scenes`] has them, in the order of their times; says which one is
/// cut.
pub fn packets(files: &[PathBuf], site: &Site, sink: PacketSink) -> Result<Option<String>, Error> {
    let mut captures = match files {
        [file] => vec![Capture::open(file, whole_site(site).map_err(|e| e.within(file.display()))?)?],
        _ => (files.iter().zip(&site.sensors))
            .enumerate()
            .map(|(s, (file, sensor))| Capture::open(file, vec![Sender::of(s, sensor)]))
            .collect::<Result<_, _>>()?,
    };
    let mut next: Vec<Option<(usize, Packet)>> = captures.iter_mut().map(Capture::next).collect();
    let time_ns = |next: &Option<(usize, Packet)>| next.as_ref().map(|(_, packet)| packet.time_ns);
    while let Some(capture) =
        (0..next.len()).filter(|&c| next[c].is_some()).min_by_key(|&c| time_ns(&next[c]))
    {
        if let Some((sensor, packet)) = next[capture].take() {
            sink(sensor, packet)?;
        }
        next[capture] = captures[capture].next();
    }
    let cut = files.iter().zip(&captures).find(|(_, capture)| capture.reader.truncated());
    Ok(cut.map(|(file, _)| format!("{}: ends within a record", file.display())))
}

/// A sensor as its datagrams show it.
pub struct Sender {
    sensor: usize,
    port: Option<u16>,
    address: Option<[u8; 4]>,
}

impl Sender {
    fn of(number: usize, sensor: &Sensor) -> Self {
        Self { sensor: number, port: udp_port(sensor), address: sensor.address_bytes() }
    }

    fn sent(&self, datagram: &Datagram) -> bool {
        self.port == Some(datagram.port) && self.address.is_none_or(|address| address == datagram.from)
    }
}

/// All sensors of a site.
///
/// # Errors
/// Two of them whose datagrams cannot be told apart.
pub fn whole_site(site: &Site) -> Result<Vec<Sender>, Error> {
    let senders: Vec<Sender> =
        site.sensors.iter().enumerate().map(|(s, sensor)| Sender::of(s, sensor)).collect();
    for (i, one) in senders.iter().enumerate() {
        let same = |other: &&Sender| {
            let apart = matches!((one.address, other.address), (Some(a), Some(b)) if a != b);
            one.port.is_some() && one.port == other.port && !apart
        };
        if let Some(other) = senders[..i].iter().find(same) {
            let [first, second] = [other.sensor, one.sensor].map(|s| &site.sensors[s].name);
            let port = one.port.unwrap_or_default();
            return Err(Error::new(format!(
                "one capture of several sensors: expected an `address` or a `udp_port` of its own for each, found \
                 {first} and {second} at port {port}"
            )));
        }
    }
    Ok(senders)
}

struct Capture {
    reader: PcapReader<BufReader<File>>,
    senders: Vec<Sender>,
}

impl Capture {
    fn open(file: &Path, senders: Vec<Sender>) -> Result<Self, Error> {
        let open = File::open(file).map_err(|e| Error::new(e.to_string()).within(file.display()))?;
        Ok(Self { reader: PcapReader::new(BufReader::new(open), &file.display().to_string())?, senders })
    }

    /// The next packet of a sensor of this capture.
    fn next(&mut self) -> Option<(usize, Packet)> {
        let Self { reader, senders } = self;
        reader.find_map(|datagram| {
            let sender = senders.iter().find(|sender| sender.sent(&datagram))?;
            Some((sender.sensor, Packet { time_ns: datagram.time_ns, payload: datagram.payload }))
        })
    }
}
