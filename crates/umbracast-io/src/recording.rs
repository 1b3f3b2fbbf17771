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
//! | `/umbracast/detections`, `/umbracast/tracks`, `/umbracast/blockages` | what a live run made of them: see [`crate::wire`] |

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use umbracast::lidar::{Frame, Model, Packet};
use umbracast::{Error, Site};

use crate::messages::{self, Schema};
use crate::rows::{PeopleLinkRow, PeopleRow};
use crate::wire::{self, WireRow};

const CONFIG_TOPIC: &str = "/umbracast/config";
/// A chunk of what goes on for hours, at most, bytes: a second of two HDL-32E. The index of the file, some 250 bytes a
/// chunk, stays in memory until the file ends, so chunks should be few.
const LIVE_CHUNK_BYTES: u64 = 4 << 20;

/// Writes a recording, in chunks of a frame or two.
pub struct RecordingWriter {
    path: PathBuf,
    mcap: mcap::Writer<BufWriter<File>>,
    site: Site,
    /// By sensor: the channel, and whether its packets are of a Velodyne's length.
    packets: Vec<(u16, bool)>,
    /// By sensor; none where no clouds are asked for.
    points: Vec<u16>,
    /// Of every topic that was written to after the beginning.
    others: BTreeMap<String, u16>,
    sequence: u32,
}

impl RecordingWriter {
    /// Starts a recording over whatever is there.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: &Path, config_toml: &str, site: &Site, clouds: bool) -> Result<Self, Error> {
        Self::create_with(mcap::WriteOptions::new(), path, config_toml, site, clouds)
    }

    /// The same for what goes on until it is stopped or killed: a chunk is held in memory until it is whole, so that
    /// the file never ends in half of one that says it is whole.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create_live(path: &Path, config_toml: &str, site: &Site) -> Result<Self, Error> {
        let options = mcap::WriteOptions::new().disable_seeking(true).chunk_size(Some(LIVE_CHUNK_BYTES));
        Self::create_with(options, path, config_toml, site, false)
    }

    fn create_with(
        options: mcap::WriteOptions,
        path: &Path,
        config_toml: &str,
        site: &Site,
        clouds: bool,
    ) -> Result<Self, Error> {
        let fail = |e: &dyn std::fmt::Display| Error::new(e.to_string()).within(path.display());
        let file = BufWriter::new(File::create(path).map_err(|e| fail(&e))?);
        // Packets hardly compress (a sixth), and a reader then needs no codec.
        let mut mcap = options
            .compression(None)
            .profile("ros2")
            .library(concat!("umbracast ", env!("CARGO_PKG_VERSION")))
            .create(file)
            .map_err(|e| fail(&e))?;
        let mut channel = |topic: &str, schema: &Schema| -> Result<u16, Error> {
            let id = mcap
                .add_schema(&schema.name, "ros2msg", schema.definition.as_bytes())
                .map_err(|e| fail(&e))?;
            mcap.add_channel(id, topic, "cdr", &BTreeMap::new()).map_err(|e| fail(&e))
        };
        let config = channel(CONFIG_TOPIC, &messages::CONFIG)?;
        let transforms = channel("/tf_static", &messages::TRANSFORMS)?;
        let packets = site
            .sensors
            .iter()
            .map(|sensor| {
                let other =
                    Model::of_sensor(sensor).is_ok_and(|m| m.packet_bytes() != messages::PACKET_BYTES);
                let schema = if other { &messages::SENSOR_PACKETS } else { &messages::SCAN };
                Ok((channel(&format!("/{}/packets", sensor.name), schema)?, !other))
            })
            .collect::<Result<_, _>>()?;
        let points = site
            .sensors
            .iter()
            .filter(|_| clouds)
            .map(|sensor| channel(&format!("/{}/points", sensor.name), &messages::CLOUD))
            .collect::<Result<_, _>>()?;
        let path = path.to_owned();
        let (site, others) = (site.clone(), BTreeMap::new());
        let mut writer = Self { path, mcap, site, packets, points, others, sequence: 0 };
        writer.put(config, 0, &messages::text(config_toml))?;
        let poses = messages::transforms(&writer.site);
        writer.put(transforms, 0, &poses)?;
        Ok(writer)
    }

    /// Packets that were sent up to `time_ns`, one list a sensor. Empty lists are written too: whoever reads tells by a
    /// sensor's next list that these are over.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn write_packets(&mut self, time_ns: i64, packets: &[Vec<Packet>]) -> Result<(), Error> {
        for (sensor, packets) in packets.iter().enumerate() {
            let (channel, of_velodyne) = self.packets[sensor];
            let message = if of_velodyne { messages::scan } else { messages::sensor_packets };
            let message = message(time_ns, &self.site.sensors[sensor].name, packets);
            self.put(channel, time_ns, &message)?;
        }
        Ok(())
    }

    /// The clouds of a frame, where [`Self::create`] was asked for them.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn write_clouds(&mut self, frame: &Frame) -> Result<(), Error> {
        for scan in &frame.scans {
            if let Some(&channel) = self.points.get(scan.sensor) {
                let start_ns = frame.time_ns - umbracast::STEP_NS;
                let message = messages::cloud(start_ns, &self.site.sensors[scan.sensor].name, scan);
                self.put(channel, frame.time_ns, &message)?;
            }
        }
        Ok(())
    }

    /// The truth of one frame.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn write_truth(
        &mut self,
        time_ns: i64,
        frame: u64,
        people: &[PeopleRow],
        links: &[PeopleLinkRow],
    ) -> Result<(), Error> {
        let (people, links) =
            (messages::people(time_ns, frame, people), messages::links(time_ns, frame, links, &self.site));
        self.put_on("/truth/people", &messages::PEOPLE, time_ns, &people)?;
        self.put_on("/truth/links", &messages::LINKS, time_ns, &links)
    }

    /// What a run made of one frame.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn write_rows<R: WireRow>(&mut self, time_ns: i64, frame: u64, rows: &[R]) -> Result<(), Error> {
        let names: Vec<String> = self.site.access_points.iter().map(|ap| ap.name.clone()).collect();
        let message = wire::encode(time_ns, frame, rows, &names);
        match self.others.get(R::TOPIC) {
            Some(&channel) => self.put(channel, time_ns, &message),
            None => self.put_on(R::TOPIC, &wire::schema::<R>(), time_ns, &message),
        }
    }

    /// A word, on a topic of its own.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn write_text(&mut self, topic: &str, time_ns: i64, text: &str) -> Result<(), Error> {
        self.put_on(topic, &messages::CONFIG, time_ns, &messages::text(text))
    }

    /// Ends the chunk and hands it to the system: what stands before this survives the program.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn flush(&mut self) -> Result<(), Error> {
        self.mcap.flush().map_err(|e| Error::new(e.to_string()).within(self.path.display()))
    }

    /// Writes the index and the end of the file.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn finish(mut self) -> Result<(), Error> {
        self.mcap.finish().map_err(|e| Error::new(e.to_string()).within(self.path.display()))?;
        Ok(())
    }

    /// A message on a topic that is made when it is first written to.
    fn put_on(&mut self, topic: &str, schema: &Schema, time_ns: i64, message: &[u8]) -> Result<(), Error> {
        let channel = match self.others.get(topic) {
            Some(&channel) => channel,
            None => {
                let fail = |e: mcap::McapError| Error::new(e.to_string()).within(self.path.display());
                let id = self
                    .mcap
                    .add_schema(&schema.name, "ros2msg", schema.definition.as_bytes())
                    .map_err(fail)?;
                let channel = self.mcap.add_channel(id, topic, "cdr", &BTreeMap::new()).map_err(fail)?;
                self.others.insert(topic.to_owned(), channel);
                channel
            }
        };
        self.put(channel, time_ns, message)
    }

    fn put(&mut self, channel_id: u16, time_ns: i64, message: &[u8]) -> Result<(), Error> {
        let time = time_ns.max(0) as u64;
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time: time, publish_time: time };
        self.sequence += 1;
        self.mcap
            .write_to_known_channel(&header, message)
            .map_err(|e| Error::new(e.to_string()).within(self.path.display()))
    }
}

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
