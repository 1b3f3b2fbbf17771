//! Recordings: MCAP with ROS 2 CDR messages. Raw sensor packets are the record; poses, truth and (where asked
//! for) clouds stand beside them, so that ROS 2, Foxglove and Rerun open the file.
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
use std::io::BufReader;
use std::path::{Path, PathBuf};

use umbracast::Error;
use umbracast::lidar::Packet;

use crate::messages;

mod writer;

pub use writer::{RecordingWriter, Results};

const CONFIG_TOPIC: &str = "/umbracast/config";

/// What a reader finds in a recording, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// The configuration that the recording was made with, as TOML.
    Config(String),
    /// Packets of the sensor of this name.
    Packets(String, Vec<Packet>),
    /// A `sensor_msgs/PointCloud2` as it stands in the file: topic and message, for [`crate::point_cloud::read`].
    Cloud(String, Vec<u8>),
    /// Anything else: topic, type, message.
    Other(String, String, Vec<u8>),
}

/// Reads a recording from its beginning, one message at a time.
pub struct RecordingReader {
    messages: mcap::io::MessageReader<BufReader<File>>,
    path: PathBuf,
    begun: bool,
    lost: Option<String>,
}

impl RecordingReader {
    /// Opens a file.
    ///
    /// # Errors
    /// A file that is not there.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(|e| Error::new(e.to_string()).within(path.display()))?;
        let messages = mcap::io::MessageReader::new(BufReader::new(file));
        Ok(Self { messages, path: path.to_owned(), begun: false, lost: None })
    }

    /// The next message; `None` at the end, also at the end of what is whole in a damaged file: see
    /// [`Self::lost`].
    ///
    /// # Errors
    /// A file that is no recording at all.
    pub fn next_entry(&mut self) -> Result<Option<Entry>, Error> {
        match self.messages.next() {
            None => Ok(None),
            Some(Ok(message)) => {
                self.begun = true;
                Ok(Some(self.understand(&message)))
            }
            Some(Err(error)) if self.begun => {
                self.lost = Some(format!("{}: {error}; everything before is used", self.path.display()));
                Ok(None)
            }
            Some(Err(error)) => {
                Err(Error::new(format!("expected an MCAP recording, found {}", plain(&error)))
                    .within(self.path.display()))
            }
        }
    }

    /// What was lost at the end of a damaged file, if anything.
    pub fn lost(&self) -> Option<&str> {
        self.lost.as_deref()
    }

    fn understand(&mut self, message: &mcap::Message<'_>) -> Entry {
        let topic = &message.channel.topic;
        let kind = message.channel.schema.as_ref().map_or(String::new(), |schema| schema.name.clone());
        if topic == CONFIG_TOPIC {
            let text = crate::cdr::Decoder::new(&message.data).and_then(|mut d| d.string());
            if let Some(text) = text {
                return Entry::Config(text.to_owned());
            }
        }
        let packets = match kind.as_str() {
            name if name == messages::SCAN.name => messages::read_scan(&message.data),
            name if name == messages::SENSOR_PACKETS.name => messages::read_sensor_packets(&message.data),
            _ => None,
        };
        if let Some(packets) = packets {
            let sensor = topic.trim_matches('/').trim_end_matches("packets").trim_end_matches('/');
            return Entry::Packets(sensor.to_owned(), packets);
        }
        if kind == messages::CLOUD.name {
            return Entry::Cloud(topic.clone(), message.data.to_vec());
        }
        Entry::Other(topic.clone(), kind, message.data.to_vec())
    }
}

fn plain(error: &mcap::McapError) -> String {
    match error {
        mcap::McapError::BadMagic => "other bytes at its beginning".to_owned(),
        mcap::McapError::UnexpectedEof => "its end before the first message".to_owned(),
        other => other.to_string(),
    }
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
