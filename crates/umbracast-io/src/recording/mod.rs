//! Recordings: MCAP with ROS 2 CDR messages. A recording holds raw sensor packets with poses, truth and (on request)
//! clouds, so that programs which read ROS 2 messages can open it.
//!
//! | topic | type |
//! |---|---|
//! | `/umbracast/config` | `std_msgs/msg/String`: the configuration as TOML, the first message |
//! | `/tf_static` | `tf2_msgs/msg/TFMessage`: the sensors in the frame `site` |
//! | `/NAME/packets` | `velodyne_msgs/msg/VelodyneScan`, one a frame and sensor; where packets are not of 1206 bytes,
//! `umbracast_msgs/msg/SensorPackets` |
//! | `/NAME/points` | `sensor_msgs/msg/PointCloud2` |
//! | `/truth/people`, `/truth/links` | `umbracast_msgs/msg/People`, `umbracast_msgs/msg/Links` |
//! | `/umbracast/detections`, `/umbracast/tracks`, `/umbracast/blockages` | what a run made of them: see [`crate::wire`] |
//! | `/tf`, `/umbracast/markers`, `/umbracast/people`, `/umbracast/foreground` | the same for viewers: see [`crate::viewers`] |

use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};

use umbracast::lidar::Packet;
use umbracast::{Error, Site};

use crate::messages;
use crate::seam::guarded;

#[cfg(feature = "db3")]
mod db3;
mod mcap_file;
mod writer;

pub use writer::RecordingWriter;

pub use crate::results::Results;

const CONFIG_TOPIC: &str = "/umbracast/config";
/// How every SQLite file begins.
const SQLITE_MAGIC: &[u8; 16] = b"SQLite format 3\0";
/// A record is believed to be no longer than the file, or than this where it may come out of a compressed chunk.
const UNPACKED_BYTES: u64 = 64 << 20;
/// Nor is it believed to be longer than this, however long the file: a chunk has some megabytes, and room is made for a record
/// before it is read.
const RECORD_MAX_BYTES: u64 = 1 << 30;

/// A sensor's name as its topics have it: ROS 2 takes letters, digits, `_` and `/` alone, so anything else becomes `_`; as it is where
/// two sensors would have one topic.
pub fn topic_of(site: &Site, sensor: usize) -> String {
    let plain = |name: &str| -> String {
        name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '/' { c } else { '_' }).collect()
    };
    let name = &site.sensors[sensor].name;
    let topic = plain(name);
    let is_of_two = site.sensors.iter().filter(|other| plain(&other.name) == topic).count() > 1;
    if is_of_two { name.clone() } else { topic }
}

/// The place of the sensor whose topics have this name, or whose own name it is.
pub fn sensor_of(site: &Site, topic: &str) -> Option<usize> {
    let by_name = site.sensors.iter().position(|sensor| sensor.name == topic);
    by_name.or_else(|| (0..site.sensors.len()).find(|&sensor| topic_of(site, sensor) == topic))
}

/// What a reader finds in a recording, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// The configuration that the recording was made with, as TOML.
    Config(String),
    /// Packets of the sensor whose topics have this name: [`sensor_of`].
    Packets(String, Vec<Packet>),
    /// A `sensor_msgs/PointCloud2` as it stands in the file: topic and message, for [`crate::point_cloud::read`].
    Cloud(String, Vec<u8>),
    /// Anything else: topic, type, message.
    Other(String, String, Vec<u8>),
}

/// Reads a recording from its beginning, one message at a time: MCAP, or the SQLite storage of rosbag2 (`.db3`, with the
/// feature `db3`).
pub struct RecordingReader {
    source: Source,
    path: PathBuf,
    begun: bool,
    lost: Option<String>,
}

enum Source {
    Mcap(Box<mcap_file::Messages>),
    #[cfg(feature = "db3")]
    Db3(db3::Messages),
}

impl RecordingReader {
    /// Opens a file.
    ///
    /// # Errors
    /// A file that is not there, or of a kind that this program was built without.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let fail = |e: std::io::Error| Error::new(e.to_string()).within(path.display());
        let mut file = File::open(path).map_err(fail)?;
        let mut magic = [0; SQLITE_MAGIC.len()];
        let is_sqlite = file.read_exact(&mut magic).is_ok() && magic == *SQLITE_MAGIC;
        file.rewind().map_err(fail)?;
        let source = match is_sqlite {
            false => {
                let unpacked = if cfg!(feature = "compression") { UNPACKED_BYTES } else { 0 };
                let longest = file.metadata().map_err(fail)?.len().clamp(unpacked, RECORD_MAX_BYTES);
                Source::Mcap(Box::new(mcap_file::Messages::new(file, longest as usize)))
            }
            #[cfg(feature = "db3")]
            true => Source::Db3(db3::Messages::open(path)?),
            #[cfg(not(feature = "db3"))]
            true => {
                let story = "expected an MCAP recording, found rosbag2's SQLite storage, which this program was built \
                             without: build it with `--features db3`, or convert the bag with `rosbags-convert --src BAG \
                             --dst OUT --dst-storage mcap` (pip install rosbags) or `ros2 bag convert`";
                return Err(Error::new(story).within(path.display()));
            }
        };
        Ok(Self { source, path: path.to_owned(), begun: false, lost: None })
    }

    /// The next message; `None` at the end, also at the end of what is whole in a damaged file: see
    /// [`Self::lost`].
    ///
    /// # Errors
    /// A file that is no recording at all.
    pub fn next_entry(&mut self) -> Result<Option<Entry>, Error> {
        let next = match &mut self.source {
            Source::Mcap(messages) => match guarded(|| messages.next(understand)) {
                Ok(Ok(next)) => Ok(next),
                Ok(Err(found)) | Err(found) => Err(("an MCAP recording", found)),
            },
            #[cfg(feature = "db3")]
            Source::Db3(messages) => match messages.next() {
                Ok(next) => Ok(next.map(|(topic, kind, data)| understand(&topic, &kind, &data))),
                Err(error) => Err(("a recording of rosbag2", error.to_string())),
            },
        };
        match next {
            Ok(entry) => {
                self.begun |= entry.is_some();
                Ok(entry)
            }
            Err((_, found)) if self.begun => {
                self.lost = Some(format!("{}: {found}; everything before is used", self.path.display()));
                Ok(None)
            }
            Err((expected, found)) => {
                Err(Error::new(format!("expected {expected}, found {found}")).within(self.path.display()))
            }
        }
    }

    /// What was lost at the end of a damaged file, if anything.
    pub fn lost(&self) -> Option<&str> {
        self.lost.as_deref()
    }
}

fn understand(topic: &str, kind: &str, data: &[u8]) -> Entry {
    if topic == CONFIG_TOPIC {
        let text = crate::cdr::Decoder::new(data).and_then(|mut d| d.string());
        if let Some(text) = text {
            return Entry::Config(text.to_owned());
        }
    }
    let packets = match kind {
        name if name == messages::SCAN.name => messages::read_scan(data),
        name if name == messages::SENSOR_PACKETS.name => messages::read_sensor_packets(data),
        _ => None,
    };
    if let Some(packets) = packets {
        let sensor = topic.trim_matches('/').trim_end_matches("packets").trim_end_matches('/');
        return Entry::Packets(sensor.to_owned(), packets);
    }
    if kind == messages::CLOUD.name {
        return Entry::Cloud(topic.to_owned(), data.to_vec());
    }
    Entry::Other(topic.to_owned(), kind.to_owned(), data.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::PeopleRow;
    use umbracast::Config;

    fn packet(k: u8) -> Packet {
        Packet { time_ns: i64::from(k) * 1000, payload: vec![k; messages::PACKET_BYTES] }
    }

    fn record(path: &Path) {
        let config = Config::default();
        let mut writer =
            RecordingWriter::create(path, &config.to_toml(), &config.site, false).expect("creates");
        for k in 0..8 {
            let time_ns = i64::from(k) * umbracast::STEP_NS;
            writer.write_packets(time_ns, &[vec![packet(k); 400], vec![packet(k + 100)]]).expect("writes");
            writer.write_truth(time_ns, k.into(), &[PeopleRow::default()], &[]).expect("writes");
        }
        writer.finish().expect("finishes");
    }

    fn read(path: &Path) -> Result<(Vec<Entry>, bool), Error> {
        let mut reader = RecordingReader::open(path)?;
        let mut entries = Vec::new();
        while let Some(entry) = reader.next_entry()? {
            entries.push(entry);
        }
        Ok((entries, reader.lost().is_some()))
    }

    #[cfg(unix)]
    #[test]
    fn strangers_on_the_host_do_not_read_a_recording() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.mcap");
        record(&path);
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o137, 0);
    }

    #[test]
    fn packets_and_configuration_survive() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.mcap");
        record(&path);
        let (entries, lost) = read(&path).unwrap();
        assert!(!lost);
        assert_eq!(entries[0], Entry::Config(Config::default().to_toml()));
        let east: Vec<&Vec<Packet>> = entries
            .iter()
            .filter_map(|e| match e {
                Entry::Packets(name, packets) if name == "lidar_east" => Some(packets),
                _ => None,
            })
            .collect();
        assert_eq!(east.len(), 8);
        assert_eq!(*east[3], vec![packet(3); 400]);
    }

    #[test]
    fn packets_of_any_length_survive_and_bring_their_sensor_s_own_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.mcap");
        let mut config = Config::default();
        config.site.sensors[1].model = "xt32".to_owned();
        let angles: String = (1..=32).map(|c| format!("{c},{}.25,-0.01\n", 16 - c)).collect();
        config.site.sensors[1].calibration = Some(format!("Channel,Elevation,Azimuth\n{angles}"));
        let packets =
            [1080, 512, 0, 3].map(|n| Packet { time_ns: 1_700_000_000_123_456_789, payload: vec![7; n] });
        let mut writer = RecordingWriter::create(&path, &config.to_toml(), &config.site, false).unwrap();
        writer.write_packets(0, &[vec![packet(1)], packets.to_vec()]).unwrap();
        writer.finish().unwrap();
        let (entries, _) = read(&path).unwrap();
        let Entry::Config(text) = &entries[0] else { panic!() };
        assert_eq!(Config::site_of_run(text, "a.mcap").unwrap(), config.site);
        assert!(entries.contains(&Entry::Packets("lidar_east".into(), vec![packet(1)])));
        assert!(entries.contains(&Entry::Packets("lidar_west".into(), packets.to_vec())));
    }

    /// Every fourth damaged recording once ended the program: `capacity overflow`, or an allocation of exabytes.
    #[test]
    fn a_length_is_not_believed_before_the_file_s() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.mcap");
        record(&path);
        let whole = std::fs::read(&path).unwrap();
        // Eight bytes of the magic, then a record each: an operation code and a length of eight bytes.
        let mut at = 8;
        let mut damaged = 0;
        while at + 9 < whole.len() - 8 {
            let length = u64::from_le_bytes(whole[at + 1..at + 9].try_into().unwrap());
            for extreme in [4_412_750_543_122_679_220, u64::MAX, 1 << 62, 0xffff_ffff] {
                let mut bytes = whole.clone();
                bytes[at + 1..at + 9].copy_from_slice(&extreme.to_le_bytes());
                std::fs::write(&path, &bytes).unwrap();
                if let Ok((_, lost)) = read(&path) {
                    assert!(lost, "record at {at}, length {extreme}");
                }
                damaged += 1;
            }
            at += 9 + length as usize;
        }
        assert!(damaged > 40, "{damaged}");
    }

    /// All that was told of a full disk was "I/O error from writing, or reading a compression stream".
    #[test]
    #[cfg(target_os = "linux")]
    fn a_full_disk_is_called_full() {
        let site = Config::default().site;
        let full = Path::new("/dev/full");
        let written = RecordingWriter::create_live(full, "", &site, 0)
            .and_then(|mut writer| writer.flush())
            .unwrap_err();
        assert_eq!(written.to_string(), "/dev/full: No space left on device (os error 28)");
    }

    /// In a file of 6 GB and more a length of 6 GB was believed.
    #[test]
    fn a_length_in_a_long_file_is_not_believed_either() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.mcap");
        record(&path);
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[9..17].copy_from_slice(&(2 * RECORD_MAX_BYTES).to_le_bytes());
        std::fs::write(&path, &bytes).unwrap();
        // A file with a hole: it takes no room on the disk.
        File::options().write(true).open(&path).unwrap().set_len(7 << 30).unwrap();
        let error = read(&path).unwrap_err().to_string();
        assert!(error.contains("a.mcap: expected an MCAP recording") && error.contains("exceeds"), "{error}");
    }

    #[test]
    fn a_file_cut_anywhere_gives_what_stands_before_the_cut() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.mcap");
        record(&path);
        let bytes = std::fs::read(&path).unwrap();
        let (whole, _) = read(&path).unwrap();
        let mut before = 0;
        for cut in (0..bytes.len()).step_by(bytes.len() / 61) {
            let path = directory.path().join("cut.mcap");
            std::fs::write(&path, &bytes[..cut]).unwrap();
            match read(&path) {
                Ok((entries, lost)) => {
                    assert!(lost && entries.len() >= before, "cut at {cut}");
                    assert_eq!(entries[..], whole[..entries.len()], "cut at {cut}");
                    before = entries.len();
                }
                Err(error) => assert!(before == 0 && error.to_string().contains("expected"), "{error}"),
            }
        }
        assert!(before > whole.len() / 2);
    }
}
