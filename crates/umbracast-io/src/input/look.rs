//! What the first seconds of a capture hold: who sent packets of which size to which port, and which sensors of the site may
//! have sent them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use umbracast::lidar::packet::decode;
use umbracast::lidar::{Model, Packet, sensor_models, udp_port};
use umbracast::{Error, Health, Site};

use super::captures::Sender;
use crate::pcap::{Datagram, PcapReader};

/// A capture of several sensors shows all of them within so many nanoseconds after the first packet of one.
const LOOK_NS: i64 = 2_000_000_000;
/// So many packets of one kind tell what they are.
const PACKETS_MAX: usize = 20;
/// Kinds that are looked at; a capture of more is one of other traffic.
const KINDS_MAX: usize = 256;
/// Kinds that a message lists.
const LISTED_MAX: usize = 4;

/// Packets of one size, from one address to one port.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Kind {
    port: u16,
    from: [u8; 4],
    bytes: usize,
}

#[derive(Debug, Default)]
struct Packets {
    count: u64,
    first: Vec<Packet>,
}

/// What a capture shows.
#[derive(Debug)]
pub struct Look {
    kinds: BTreeMap<Kind, Packets>,
    /// By sensor of the site: whether it may have sent some of them.
    fits: Vec<bool>,
}

impl Look {
    /// Looks into a capture: two seconds from the first packet of a sensor on, or all of it where there is none.
    ///
    /// # Errors
    /// A file that is no capture, or a sensor model that is not known.
    pub fn into(file: &Path, site: &Site) -> Result<Self, Error> {
        let open = File::open(file).map_err(|e| Error::new(e.to_string()).within(file.display()))?;
        let reader = PcapReader::new(BufReader::new(open), &file.display().to_string())?;
        let senders = Sender::all_of(site);
        let models: Vec<Option<Model>> = (site.sensors.iter())
            .map(|sensor| udp_port(sensor).map(|_| Model::of_sensor(sensor)).transpose())
            .collect::<Result<_, _>>()?;
        let mut look = Self { kinds: BTreeMap::new(), fits: vec![false; site.sensors.len()] };
        let mut first_ns = None;
        for datagram in reader {
            let time_ns = datagram.time_ns;
            if first_ns.is_some_and(|first_ns| time_ns - first_ns > LOOK_NS) {
                break;
            }
            if look.take(datagram, &senders, &models) {
                first_ns.get_or_insert(time_ns);
            }
        }
        Ok(look)
    }

    /// Whether a sensor may have sent it.
    fn take(&mut self, datagram: Datagram, senders: &[Sender], models: &[Option<Model>]) -> bool {
        let kind = Kind { port: datagram.port, from: datagram.from, bytes: datagram.payload.len() };
        if self.kinds.len() >= KINDS_MAX && !self.kinds.contains_key(&kind) {
            return false;
        }
        let packets = self.kinds.entry(kind).or_default();
        packets.count += 1;
        if packets.first.len() >= PACKETS_MAX {
            return false;
        }
        let mut fits_one = false;
        let sent: Vec<usize> = (0..senders.len()).filter(|&s| senders[s].sent(&datagram)).collect();
        let packet = Packet { time_ns: datagram.time_ns, payload: datagram.payload };
        for sensor in sent {
            let fits = models[sensor].as_ref().is_some_and(|model| has_columns(model, &packet));
            self.fits[sensor] |= fits;
            fits_one |= fits;
        }
        packets.first.push(packet);
        fits_one
    }

    /// The places of the sensors that may have sent some of the packets.
    pub fn sensors(&self) -> Vec<usize> {
        (0..self.fits.len()).filter(|&s| self.fits[s]).collect()
    }

    /// Whether anything was sent to this port.
    pub fn has_port(&self, port: u16) -> bool {
        self.kinds.keys().any(|kind| kind.port == port)
    }

    /// The kinds of packets, most frequent first.
    pub fn summary(&self) -> String {
        let mut kinds: Vec<(&Kind, &Packets)> = self.kinds.iter().collect();
        kinds.sort_by_key(|(_, packets)| std::cmp::Reverse(packets.count));
        let told = |(kind, packets): &(&Kind, &Packets)| {
            let ([a, b, c, d], port, bytes, count) = (kind.from, kind.port, kind.bytes, packets.count);
            let packets = if count == 1 { "packet" } else { "packets" };
            format!("{count} {packets} of {bytes} bytes from {a}.{b}.{c}.{d} to port {port}")
        };
        let mut lines: Vec<String> = kinds.iter().take(LISTED_MAX).map(told).collect();
        if kinds.len() > LISTED_MAX {
            lines.push(format!("{} other kinds", kinds.len() - LISTED_MAX));
        }
        if lines.is_empty() { "no UDP packet over IPv4".to_owned() } else { lines.join(", ") }
    }

    /// Why a capture is of no sensor of the site: what each sends, what was found, and what can be done.
    pub fn misfit(&self, site: &Site) -> Error {
        let expected = |s: usize| {
            let sensor = &site.sensors[s];
            let Some(port) = udp_port(sensor) else { return format!("{}: clouds, no packets", sensor.name) };
            let bytes = Model::of_sensor(sensor).map_or(0, |model| model.packet_bytes());
            let from = sensor.address.as_ref().map_or(String::new(), |from| format!(" from {from}"));
            format!("{} ({}): {bytes} bytes{from} to port {port}", sensor.name, sensor.model)
        };
        let all: Vec<String> = (0..site.sensors.len()).map(expected).collect();
        let mut remedies: Vec<String> =
            (0..site.sensors.len()).filter_map(|s| self.remedy(site, s)).collect();
        remedies.dedup();
        let remedies = if remedies.is_empty() { String::new() } else { format!("; {}", remedies.join("; ")) };
        Error::new(format!(
            "expected packets of {}, found {}{remedies}",
            all.join(", or of "),
            self.summary()
        ))
    }

    /// What would make the capture one of this sensor.
    fn remedy(&self, site: &Site, s: usize) -> Option<String> {
        let sensor = &site.sensors[s];
        let (own_port, model) = (udp_port(sensor)?, Model::of_sensor(sensor).ok()?);
        let columns = |packets: &Packets| packets.first.iter().any(|packet| has_columns(&model, packet));
        // Its own packets, but elsewhere than the site file says.
        if let Some((kind, _)) = self.kinds.iter().find(|(_, packets)| columns(packets)) {
            let [a, b, c, d] = kind.from;
            return Some(match kind.port == own_port {
                true => {
                    format!("if it sends from there, set `address = \"{a}.{b}.{c}.{d}\"` of {}", sensor.name)
                }
                false => format!("if it sends there, set `udp_port = {}` of {}", kind.port, sensor.name),
            });
        }
        let at_port = || self.kinds.iter().filter(|(kind, _)| kind.port == own_port);
        // An Ouster's packets have the length that its columns and profile give, which only its metadata say.
        if sensor.model.to_ascii_lowercase().starts_with("os") && at_port().next().is_some() {
            let metadata = "`curl http://SENSOR/api/v1/sensor/metadata > lidar.json`";
            return Some(match sensor.calibration {
                None => format!(
                    "the site file has no metadata of {}, so the data sheet's columns and profile were taken: get them with \
                     {metadata} and set `calibration_file = \"lidar.json\"`",
                    sensor.name
                ),
                Some(_) => format!(
                    "the metadata of {} are of another profile, number of columns or sensor: get them anew with {metadata}",
                    sensor.name
                ),
            });
        }
        let sends = |name: &&str| {
            let of_model = Model::by_name(name).ok();
            let fits = |packet: &Packet| of_model.as_ref().is_some_and(|model| has_columns(model, packet));
            at_port().any(|(_, packets)| packets.first.iter().any(fits))
        };
        let others: Vec<&str> = sensor_models().filter(sends).collect();
        (!others.is_empty()).then(|| {
            format!("a {} sends such packets: correct `model` of {}", others.join(" or "), sensor.name)
        })
    }
}

/// Whether a packet is a model's and holds columns.
fn has_columns(model: &Model, packet: &Packet) -> bool {
    let mut columns = 0;
    decode(model, packet, &mut Health::default(), |_, _, _| columns += 1);
    columns > 0
}
