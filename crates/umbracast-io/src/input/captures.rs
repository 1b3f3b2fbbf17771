//! Captures: one for each sensor of the site, or whole recordings with all sensors in one, told apart by port and
//! address.

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use umbracast::lidar::{Packet, udp_port};
use umbracast::site::Sensor;
use umbracast::{Error, Site};

use super::sink::PacketSink;
use crate::pcap::{Datagram, PcapReader};

/// A capture that has found its sensors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Capture {
    /// The capture.
    pub file: PathBuf,
    /// The places in the site of the sensors whose packets it begins with.
    pub sensors: Vec<usize>,
    /// What told so, in words: `by` this.
    pub by: String,
    /// Whether packets of every sensor of the site are taken from it, or those of its one sensor alone.
    pub(super) whole: bool,
}

impl Capture {
    /// A line for the user: the file, its sensors, and by what they were found.
    pub fn told(&self, site: &Site) -> String {
        let names: Vec<&str> =
            self.sensors.iter().filter_map(|&s| site.sensors.get(s)).map(|s| s.name.as_str()).collect();
        format!("{} -> {} ({})", self.file.display(), names.join(", "), self.by)
    }
}

/// Gives the packets of one scene's captures, in the order of their times; says which one is cut.
pub fn packets(captures: &[Capture], site: &Site, sink: PacketSink) -> Result<Option<String>, Error> {
    let mut open = captures.iter().map(|capture| Open::of(capture, site)).collect::<Result<Vec<_>, _>>()?;
    let mut next: Vec<Option<(usize, Packet)>> = open.iter_mut().map(Open::next).collect();
    let time_ns = |next: &Option<(usize, Packet)>| next.as_ref().map(|(_, packet)| packet.time_ns);
    // Of packets of one time the first sensor's go first, in whatever order captures are given.
    let place = |next: &Option<(usize, Packet)>| next.as_ref().map(|(sensor, _)| *sensor);
    while let Some(of) =
        (0..next.len()).filter(|&c| next[c].is_some()).min_by_key(|&c| (time_ns(&next[c]), place(&next[c])))
    {
        if let Some((sensor, packet)) = next[of].take() {
            sink(sensor, packet)?;
        }
        next[of] = open[of].next();
    }
    let cut = captures.iter().zip(&open).find(|(_, open)| open.reader.truncated());
    Ok(cut.map(|(capture, _)| format!("{}: ends within a record", capture.file.display())))
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

    /// Of every sensor of a site, in its order.
    pub fn all_of(site: &Site) -> Vec<Self> {
        site.sensors.iter().enumerate().map(|(s, sensor)| Self::of(s, sensor)).collect()
    }

    /// Whether this sensor may have sent it.
    pub fn sent(&self, datagram: &Datagram) -> bool {
        self.port == Some(datagram.port) && self.address.is_none_or(|address| address == datagram.from)
    }
}

/// All sensors of a site.
///
/// # Errors
/// Two of them whose datagrams cannot be told apart.
pub fn whole_site(site: &Site) -> Result<Vec<Sender>, Error> {
    let senders = Sender::all_of(site);
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

struct Open {
    reader: PcapReader<BufReader<File>>,
    senders: Vec<Sender>,
}

impl Open {
    fn of(capture: &Capture, site: &Site) -> Result<Self, Error> {
        let (file, name) = (File::open(&capture.file), capture.file.display());
        let file = file.map_err(|e| Error::new(e.to_string()).within(&name))?;
        let senders = match capture.whole {
            true => whole_site(site).map_err(|e| e.within(&name))?,
            false => {
                Sender::all_of(site).into_iter().filter(|s| capture.sensors.contains(&s.sensor)).collect()
            }
        };
        Ok(Self { reader: PcapReader::new(BufReader::new(file), &name.to_string())?, senders })
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
