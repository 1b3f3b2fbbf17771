//! Writes recordings. It creates a topic when the first message is written to it.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use umbracast::lidar::{Frame, Model, Packet};
use umbracast::{Error, Site};

use super::mcap_file::plain;
use super::{CONFIG_TOPIC, topic_of};
use crate::messages::{self, Schema};
use crate::results::{Message, Results};
use crate::rows::{PeopleLinkRow, PeopleRow};

/// A chunk of what goes on for hours, at most, bytes: more than two HDL-32E give in a second, after which it is written anyway.
/// Its buffer has that size from the start; one that outgrows it is moved, and the memory that it leaves is not given back. The
/// index of the file, some 250 bytes a chunk, stays in memory until the file ends, so chunks should be few.
const LIVE_CHUNK_BYTES: u64 = 8 << 20;

/// Writes a recording, in chunks of a frame or two.
pub struct RecordingWriter {
    path: PathBuf,
    mcap: mcap::Writer<BufWriter<File>>,
    site: Site,
    clouds: bool,
    /// By sensor: the topic of its packets, and whether they are of a Velodyne's length.
    packets: Vec<(String, bool)>,
    channels: BTreeMap<String, u16>,
    sequence: u32,
    bytes: u64,
}

impl RecordingWriter {
    /// Starts a recording over whatever is there.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: &Path, config_toml: &str, site: &Site, clouds: bool) -> Result<Self, Error> {
        let mut writer = Self::create_with(mcap::WriteOptions::new(), path, config_toml, site, 0)?;
        writer.clouds = clouds;
        Ok(writer)
    }

    /// The same for what goes on until it is stopped or killed, from this time on: a chunk is held in memory until it is
    /// whole, so that the file never ends in half of one that says it is whole.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create_live(path: &Path, config_toml: &str, site: &Site, start_ns: i64) -> Result<Self, Error> {
        let options = mcap::WriteOptions::new().disable_seeking(true).chunk_size(Some(LIVE_CHUNK_BYTES));
        Self::create_with(options, path, config_toml, site, start_ns)
    }

    fn create_with(
        options: mcap::WriteOptions,
        path: &Path,
        config_toml: &str,
        site: &Site,
        start_ns: i64,
    ) -> Result<Self, Error> {
        let fail = |told: String| Error::new(told).within(path.display());
        let file = BufWriter::new(create(path).map_err(|e| fail(e.to_string()))?);
        // Packets hardly compress (a sixth), and a reader then needs no codec.
        let mcap = options
            .compression(None)
            .profile("ros2")
            .library(concat!("umbracast ", env!("CARGO_PKG_VERSION")))
            .create(file)
            .map_err(|e| fail(plain(&e)))?;
        let packets = site.sensors.iter().enumerate().map(|(number, sensor)| {
            let other = Model::of_sensor(sensor).is_ok_and(|m| m.packet_bytes() != messages::PACKET_BYTES);
            (format!("/{}/packets", topic_of(site, number)), !other)
        });
        let mut writer = Self {
            path: path.to_owned(),
            mcap,
            packets: packets.collect(),
            site: site.clone(),
            clouds: false,
            channels: BTreeMap::new(),
            sequence: 0,
            bytes: 0,
        };
        writer.put(CONFIG_TOPIC, || messages::CONFIG, start_ns, &messages::text(config_toml))?;
        let poses = messages::transforms(&writer.site, start_ns);
        writer.put("/tf_static", || messages::TRANSFORMS, start_ns, &poses)?;
        Ok(writer)
    }

    /// Bytes of all messages so far.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Packets that were sent up to `time_ns`, one list a sensor. Empty lists are written too: whoever reads tells by a
    /// sensor's next list that these are over.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn write_packets(&mut self, time_ns: i64, packets: &[Vec<Packet>]) -> Result<(), Error> {
        for (sensor, packets) in packets.iter().enumerate() {
            let (topic, of_velodyne) = self.packets[sensor].clone();
            let (message, schema) = match of_velodyne {
                true => (messages::scan as fn(i64, &str, &[Packet]) -> Vec<u8>, messages::SCAN),
                false => (messages::sensor_packets as _, messages::SENSOR_PACKETS),
            };
            let message = message(time_ns, &self.site.sensors[sensor].name, packets);
            self.put(&topic, || schema, time_ns, &message)?;
        }
        Ok(())
    }

    /// The clouds of a frame, where [`Self::create`] was asked for them.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn write_clouds(&mut self, frame: &Frame) -> Result<(), Error> {
        let asked_for = self.clouds;
        for scan in frame.scans.iter().filter(|_| asked_for) {
            let start_ns = frame.time_ns - umbracast::STEP_NS;
            let name = &self.site.sensors[scan.sensor].name;
            let topic = format!("/{}/points", topic_of(&self.site, scan.sensor));
            let message = messages::cloud(start_ns, name, scan);
            self.put(&topic, || messages::CLOUD, frame.time_ns, &message)?;
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
        self.put("/truth/people", || messages::PEOPLE, time_ns, &people)?;
        self.put("/truth/links", || messages::LINKS, time_ns, &links)
    }

    /// What a run made of one frame: its rows, and the same as viewers draw it.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn write_results(&mut self, results: &Results) -> Result<(), Error> {
        for Message { topic, schema, bytes } in results.messages(&self.site) {
            self.put(topic, schema, results.logged_ns, &bytes)?;
        }
        Ok(())
    }

    /// A word, on a topic of its own.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn write_text(&mut self, topic: &str, time_ns: i64, text: &str) -> Result<(), Error> {
        self.put(topic, || messages::CONFIG, time_ns, &messages::text(text))
    }

    /// Ends the chunk and hands it to the system: what stands before this survives the program.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn flush(&mut self) -> Result<(), Error> {
        self.mcap.flush().map_err(|e| self.fail(&e))
    }

    /// Writes the index and the end of the file.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn finish(mut self) -> Result<(), Error> {
        self.mcap.finish().map_err(|e| self.fail(&e)).map(|_| ())
    }

    fn put(
        &mut self,
        topic: &str,
        schema: impl FnOnce() -> Schema,
        time_ns: i64,
        message: &[u8],
    ) -> Result<(), Error> {
        let channel_id = match self.channels.get(topic) {
            Some(&channel) => channel,
            None => {
                let Schema { name, definition } = schema();
                let channel = (self.mcap.add_schema(&name, "ros2msg", definition.as_bytes()))
                    .and_then(|schema| self.mcap.add_channel(schema, topic, "cdr", &BTreeMap::new()))
                    .map_err(|e| self.fail(&e))?;
                self.channels.insert(topic.to_owned(), channel);
                channel
            }
        };
        let time = time_ns.max(0) as u64;
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time: time, publish_time: time };
        self.sequence += 1;
        self.bytes += message.len() as u64;
        self.mcap.write_to_known_channel(&header, message).map_err(|e| self.fail(&e))
    }

    fn fail(&self, error: &mcap::McapError) -> Error {
        Error::new(plain(error)).within(self.path.display())
    }
}

/// A new file that its owner and his group read: a recording shows where people were.
fn create(path: &Path) -> std::io::Result<File> {
    let mut options = File::options();
    options.write(true).create(true).truncate(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o640);
    options.open(path)
}
