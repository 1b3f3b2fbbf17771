//! UDP payloads from and to captures: classic pcap, either byte order, micro- or nanoseconds, Ethernet with or
//! without VLAN tags, IPv4, whole or in fragments. Format: draft-ietf-opsawg-pcap, RFC 791.
//!
//! Written by hand: it reads UDP over IPv4 only, and of a capture that is cut off or broken it returns everything
//! before the fault.

mod ip;
mod fragments;

use std::io::{ErrorKind, Read, Write};

use umbracast::Error;

use fragments::Fragments;
use ip::{IPV4_BYTES, Ipv4};

/// Where Velodyne sensors send their packets unless told otherwise.
pub const DATA_PORT: u16 = 2368;

const MAGIC_MICROSECONDS: u32 = 0xa1b2_c3d4;
const MAGIC_NANOSECONDS: u32 = 0xa1b2_3c4d;
const MAGIC_PCAPNG: u32 = 0x0a0d_0d0a;
const LINK_ETHERNET: u32 = 1;
/// No capture has longer records; a longer one is a broken length.
const RECORD_LIMIT_BYTES: usize = 262_144;
const ETHERNET_BYTES: usize = 14;
const UDP_BYTES: usize = 8;

/// A UDP payload as it was captured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Datagram {
    /// When it was captured, since the epoch.
    pub time_ns: i64,
    /// The sender's address; tells sensors on one port apart.
    pub from: [u8; 4],
    /// The port it was sent to.
    pub port: u16,
    /// Shorter than it was sent when the capture cut it.
    pub payload: Vec<u8>,
}

/// Reads a capture record by record.
#[derive(Debug)]
pub struct PcapReader<R> {
    input: R,
    big_endian: bool,
    nanoseconds: bool,
    truncated: bool,
    done: bool,
    fragments: Fragments,
}

impl<R: Read> PcapReader<R> {
    /// Reads the header. `name` is the file's, for messages.
    ///
    /// # Errors
    /// A file that is no classic pcap of Ethernet, with what it is instead.
    pub fn new(mut input: R, name: &str) -> Result<Self, Error> {
        let mut head = [0; 24];
        input.read_exact(&mut head).map_err(|e| Error::new(format!("{name}: no pcap header: {e}")))?;
        let magic = u32_at(&head, 0, false);
        let big_endian = [MAGIC_MICROSECONDS, MAGIC_NANOSECONDS].contains(&magic.swap_bytes());
        let magic = if big_endian { magic.swap_bytes() } else { magic };
        let found = match magic {
            MAGIC_MICROSECONDS | MAGIC_NANOSECONDS => None,
            MAGIC_PCAPNG => Some("pcapng (convert it with `editcap -F pcap`)".to_owned()),
            other => Some(format!("first bytes {other:#010x}")),
        };
        if let Some(found) = found {
            return Err(Error::new(format!("{name}: expected a classic pcap, found {found}")));
        }
        let link = u32_at(&head, 20, big_endian) & 0xffff;
        if link != LINK_ETHERNET {
            return Err(Error::new(format!("{name}: link type: expected 1 (Ethernet), found {link}")));
        }
        Ok(Self {
            input,
            big_endian,
            nanoseconds: magic == MAGIC_NANOSECONDS,
            truncated: false,
            done: false,
            fragments: Fragments::default(),
        })
    }

    /// True once the file has ended or failed within a record: what came before is whole, what followed is lost.
    pub fn truncated(&self) -> bool {
        self.truncated
    }

    fn record(&mut self) -> Option<(i64, Vec<u8>)> {
        let mut head = [0; 16];
        match read_up_to(&mut self.input, &mut head) {
            Ok(0) => return None,
            Ok(16) => {}
            Ok(_) | Err(_) => {
                self.truncated = true;
                return None;
            }
        }
        let field = |i: usize| u32_at(&head, 4 * i, self.big_endian);
        let length = field(2) as usize;
        let mut frame = vec![0; length.min(RECORD_LIMIT_BYTES)];
        if !matches!(read_up_to(&mut self.input, &mut frame), Ok(n) if n == length) {
            self.truncated = true;
            return None;
        }
        let fraction_ns = i64::from(field(1)) * if self.nanoseconds { 1 } else { 1000 };
        Some((i64::from(field(0)) * 1_000_000_000 + fraction_ns, frame))
    }
}

impl<R: Read> Iterator for PcapReader<R> {
    type Item = Datagram;

    /// The next UDP payload; frames that hold none are passed over.
    fn next(&mut self) -> Option<Datagram> {
        while !self.done {
            let Some((time_ns, frame)) = self.record() else {
                self.done = true;
                break;
            };
            let Some(packet) = Ipv4::of(&frame) else { continue };
            let from = packet.from;
            let datagram = match packet.is_whole() {
                true => udp_payload(packet.body).map(|(port, payload)| (port, payload.to_vec())),
                false => self
                    .fragments
                    .put(&packet)
                    .and_then(|whole| udp_payload(&whole).map(|(port, payload)| (port, payload.to_vec()))),
            };
            if let Some((port, payload)) = datagram {
                return Some(Datagram { time_ns, from, port, payload });
            }
        }
        None
    }
}

/// Writes UDP payloads as a little-endian capture with nanoseconds.
#[derive(Debug)]
pub struct PcapWriter<W> {
    output: W,
}

impl<W: Write> PcapWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// When the output cannot be written.
    pub fn new(mut output: W) -> std::io::Result<Self> {
        output.write_all(&MAGIC_NANOSECONDS.to_le_bytes())?;
        // Version 2.4, two reserved words, longest record, link type.
        output.write_all(&[2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0])?;
        output.write_all(&(RECORD_LIMIT_BYTES as u32).to_le_bytes())?;
        output.write_all(&LINK_ETHERNET.to_le_bytes())?;
        Ok(Self { output })
    }

    /// Writes one payload.
    ///
    /// # Errors
    /// When the output cannot be written, a time lies before 1970 or after 2106, or a payload is longer than a
    /// datagram.
    pub fn write(&mut self, datagram: &Datagram) -> std::io::Result<()> {
        let invalid = |what: &str| std::io::Error::new(ErrorKind::InvalidInput, what);
        let seconds = u32::try_from(datagram.time_ns.div_euclid(1_000_000_000))
            .map_err(|_| invalid("a pcap holds times from 1970 to 2106 only"))?;
        let fraction_ns = datagram.time_ns.rem_euclid(1_000_000_000) as u32;
        let ip_bytes = u16::try_from(IPV4_BYTES + UDP_BYTES + datagram.payload.len())
            .map_err(|_| invalid("a datagram holds 65,507 bytes at most"))?;
        let frame_bytes = (ETHERNET_BYTES + usize::from(ip_bytes)) as u32;

        for field in [seconds, fraction_ns, frame_bytes, frame_bytes] {
            self.output.write_all(&field.to_le_bytes())?;
        }
        // Broadcast from a locally administered address, IPv4.
        self.output.write_all(&[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 2, 0, 0, 0, 0, 1, 0x08, 0x00])?;
        let mut ip = [0; IPV4_BYTES];
        ip[0] = 0x45;
        ip[2..4].copy_from_slice(&ip_bytes.to_be_bytes());
        ip[8..10].copy_from_slice(&[64, 17]);
        ip[12..16].copy_from_slice(&datagram.from);
        ip[16..20].fill(0xff);
        let checksum = ones_complement(&ip);
        ip[10..12].copy_from_slice(&checksum.to_be_bytes());
        self.output.write_all(&ip)?;
        // UDP without a checksum, which IPv4 allows.
        for field in [datagram.port, datagram.port, ip_bytes - IPV4_BYTES as u16, 0] {
            self.output.write_all(&field.to_be_bytes())?;
        }
        self.output.write_all(&datagram.payload)
    }

    /// Hands the output back.
    ///
    /// # Errors
    /// When what is left cannot be written.
    pub fn finish(mut self) -> std::io::Result<W> {
        self.output.flush()?;
        Ok(self.output)
    }
}

/// Port and payload of a UDP datagram, shorter than it says where the capture cut it.
fn udp_payload(udp: &[u8]) -> Option<(u16, &[u8])> {
    let head = udp.get(..UDP_BYTES)?;
    let udp_bytes = usize::from(u16::from_be_bytes([head[4], head[5]]));
    let payload = &udp[UDP_BYTES..udp_bytes.clamp(UDP_BYTES, udp.len())];
    Some((u16::from_be_bytes([head[2], head[3]]), payload))
}

/// Reads until the buffer is full or the input ends.
fn read_up_to(input: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match input.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(n) => filled += n,
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(filled)
}

fn u32_at(bytes: &[u8], at: usize, big_endian: bool) -> u32 {
    let bytes = [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
    if big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
}

fn ones_complement(bytes: &[u8]) -> u16 {
    let sum: u32 = bytes.chunks(2).map(|pair| u32::from(u16::from_be_bytes([pair[0], pair[1]]))).sum();
    !((sum & 0xffff) + (sum >> 16)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    fn datagrams() -> Vec<Datagram> {
        (0..5)
            .map(|i| Datagram {
                time_ns: 1_700_000_000_123_456_789 + i64::from(i) * 552_960,
                from: [192, 168, 1, 200 + i],
                port: DATA_PORT,
                payload: vec![i; 1206],
            })
            .collect()
    }

    fn written(datagrams: &[Datagram]) -> Vec<u8> {
        let mut writer = PcapWriter::new(Vec::new()).unwrap();
        datagrams.iter().for_each(|d| writer.write(d).unwrap());
        writer.finish().unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let bytes = written(&datagrams());
        let mut reader = PcapReader::new(bytes.as_slice(), "a.pcap").unwrap();
        assert_eq!(reader.by_ref().collect::<Vec<_>>(), datagrams());
        assert!(!reader.truncated());
    }

    #[test]
    fn a_file_cut_at_any_byte_gives_its_whole_records() {
        let bytes = written(&datagrams());
        let record = 16 + ETHERNET_BYTES + IPV4_BYTES + UDP_BYTES + 1206;
        for cut in 24..bytes.len() {
            let mut reader = PcapReader::new(&bytes[..cut], "a.pcap").unwrap();
            assert_eq!(reader.by_ref().count(), (cut - 24) / record);
            assert_eq!(reader.truncated(), (cut - 24) % record != 0);
        }
    }

    #[test]
    fn either_byte_order_microseconds_and_vlan_tags() {
        let little = written(&datagrams()[..1]);
        let mut big = Vec::new();
        big.extend_from_slice(&MAGIC_MICROSECONDS.to_be_bytes());
        big.extend_from_slice(&[0, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 1]);
        let frame = [&little[40..52], &[0x81, 0x00, 0x00, 0x07], &little[52..]].concat();
        for field in [1_700_000_000_u32, 123_456, frame.len() as u32, frame.len() as u32] {
            big.extend_from_slice(&field.to_be_bytes());
        }
        big.extend_from_slice(&frame);
        let read: Vec<_> = PcapReader::new(big.as_slice(), "big.pcap").unwrap().collect();
        let expected = Datagram { time_ns: 1_700_000_000_123_456_000, ..datagrams()[0].clone() };
        assert_eq!(read, [expected]);
    }

    #[test]
    fn what_is_no_datagram_is_passed_over() {
        let whole = written(&datagrams()[..2]);
        let ip = 40 + ETHERNET_BYTES;
        for (at, value, why) in [
            (52, 0x86, "not IPv4"),
            (ip, 0x65, "version 6"),
            (ip + 9, 6, "TCP"),
            (ip + 7, 1, "a last fragment"),
        ] {
            let mut bytes = whole.clone();
            bytes[at] = value;
            let read: Vec<_> = PcapReader::new(bytes.as_slice(), "a.pcap").unwrap().collect();
            assert_eq!(read, datagrams()[1..2], "{why}");
        }
    }

    #[test]
    fn a_broken_length_ends_the_capture_as_truncated() {
        let mut bytes = written(&datagrams());
        bytes[35] = 0x7f;
        let mut reader = PcapReader::new(bytes.as_slice(), "a.pcap").unwrap();
        assert_eq!(reader.by_ref().count(), 0);
        assert!(reader.truncated());
    }

    #[test]
    fn other_files_are_refused_by_name() {
        let message = |bytes: &[u8]| PcapReader::new(bytes, "x.pcap").unwrap_err().to_string();
        let mut bytes = written(&[]);
        bytes[20] = 113;
        assert_eq!(message(&bytes), "x.pcap: link type: expected 1 (Ethernet), found 113");
        bytes[..4].copy_from_slice(&MAGIC_PCAPNG.to_le_bytes());
        assert!(message(&bytes).contains("expected a classic pcap, found pcapng"));
        assert!(message(&[0; 24]).contains("found first bytes 0x00000000"));
        assert!(message(&[0; 3]).starts_with("x.pcap: no pcap header"));
    }

    #[test]
    fn any_bytes_are_survived() {
        let whole = written(&datagrams());
        let mut state = 1_u64;
        for _ in 0..20_000 {
            let mut bytes = whole.clone();
            for _ in 0..8 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                bytes[24 + (state >> 33) as usize % 120] = (state >> 25) as u8;
            }
            let read = PcapReader::new(bytes.as_slice(), "a.pcap").unwrap().count();
            assert!(read <= bytes.len() / 16);
        }
    }
}
