//! Captures: one for each sensor of the site, or one of all sensors, told apart by port and address.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use umbracast::lidar::{Packet, udp_port};
use umbracast::site::Sensor;
use umbracast::{Error, Site};
use umbracast_io::pcap::{Datagram, PcapReader};

use super::sink::PacketSink;

/// Gives the packets of captures in the order of their times; says which one is cut.
pub fn packets(files: &[PathBuf], site: &Site, sink: PacketSink) -> Result<Option<String>, Error> {
    let mut captures = match files {
        [file] => vec![Capture::open(file, whole_site(site).map_err(|e| e.within(file.display()))?)?],
        _ if files.len() == site.sensors.len() => (files.iter().zip(&site.sensors))
            .enumerate()
            .map(|(s, (file, sensor))| Capture::open(file, vec![Sender::of(s, sensor)]))
            .collect::<Result<_, _>>()?,
        _ => {
            let (expected, found) = (site.sensors.len(), files.len());
            return Err(Error::new(format!(
                "expected {expected} captures, one for each sensor of the site in its order, or one of all, \
                 found {found}"
            ))
            .within(files[0].display()));
        }
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
struct Sender {
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
fn whole_site(site: &Site) -> Result<Vec<Sender>, Error> {
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
