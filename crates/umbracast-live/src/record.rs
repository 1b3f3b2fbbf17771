//! The recorder: raw packets and results into MCAP files, on a thread of its own that delays nobody.

use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

use serde::Serialize;
use umbracast::lidar::Packet;
use umbracast::{Config, Error, STEP_NS};
use umbracast_io::recording::RecordingWriter;

use crate::published::Published;
use crate::queue::{Popped, Queue, WhenFull};
use crate::receive::Arrived;

/// Four seconds of two HDL-32E, 1800 packets a second each, and their results: as long as a disk may be busy.
const WAITING: usize = 16_384;
/// They have so many bytes at most: as long of four OS0-128.
const WAITING_BYTES: usize = 256 << 20;
/// After a write that failed the disk is tried again so much later.
const RETRY_NS: i64 = 5_000_000_000;
/// What is younger than this is lost when the program is killed.
const FLUSH_NS: i64 = 1_000_000_000;
/// The same where nothing comes any more.
const REST: Duration = Duration::from_secs(1);

/// How recordings are kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordSettings {
    /// The folder they go to.
    pub folder: PathBuf,
    /// A file is closed when it has so many bytes,
    pub file_bytes: u64,
    /// or has gone on for so long.
    pub file_s: u64,
    /// The oldest are deleted beyond so many; none are without.
    pub keep: Option<usize>,
    /// Foreground points are written too.
    pub points: bool,
}

/// What a recorder did so far.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct RecordStatus {
    /// Files begun.
    pub files: u64,
    /// The one that was begun last.
    pub newest: Option<String>,
    /// Bytes of packets and results handed to the disk.
    pub bytes: u64,
    /// Packets and results that came while the queue was full or the disk failed.
    pub lost: u64,
    /// What the disk said last, while it fails.
    pub failing: Option<String>,
}

enum Item {
    /// Another configuration from now on: a file of its own.
    Config(Box<Config>),
    Packet(Arrived),
    Result(Arc<Published>),
}

impl Item {
    fn bytes(&self) -> usize {
        match self {
            Self::Config(config) => size_of_val(&**config),
            Self::Packet(arrived) => arrived.bytes(),
            Self::Result(published) => published.bytes(),
        }
    }
}

/// The thread's handle. Whoever records only pushes.
pub struct Recorder {
    queue: Arc<Queue<Item>>,
    status: Arc<Mutex<RecordStatus>>,
    thread: JoinHandle<()>,
}

impl Recorder {
    /// Makes the folder and begins; how it goes stands in `status` from then on.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn start(
        settings: RecordSettings,
        config: &Config,
        status: Arc<Mutex<RecordStatus>>,
    ) -> Result<Self, Error> {
        let folder = &settings.folder;
        fs::create_dir_all(folder).map_err(|e| Error::new(e.to_string()).within(folder.display()))?;
        let queue = Arc::new(Queue::of_bytes(WAITING, WAITING_BYTES, Item::bytes, WhenFull::DropNewest));
        let mut files = Files::new(settings, config.clone());
        let (items, shared) = (queue.clone(), status.clone());
        let thread = std::thread::spawn(move || {
            let tell = |files: &Files| {
                let status = RecordStatus { lost: files.status.lost + items.lost(), ..files.status.clone() };
                *shared.lock().unwrap_or_else(PoisonError::into_inner) = status;
            };
            loop {
                match items.pop_within(REST) {
                    Popped::Item(item) => files.take(item),
                    Popped::Nothing => files.rest(),
                    Popped::Closed => break,
                }
                tell(&files);
            }
            files.close();
            tell(&files);
        });
        Ok(Self { queue, status, thread })
    }

    /// A packet, in the order in which the assembler got it.
    pub fn packet(&self, packet: Arrived) {
        self.push(Item::Packet(packet));
    }

    /// A frame's results.
    pub fn result(&self, published: Arc<Published>) {
        self.push(Item::Result(published));
    }

    /// Another configuration of the same sensors, in a new file.
    pub fn take_over(&self, config: &Config) {
        self.push(Item::Config(Box::new(config.clone())));
    }

    /// Where too much waits, the thread hangs at a disk that takes nothing and says nothing: then nobody else could tell it.
    fn push(&self, item: Item) {
        if !self.queue.offer(item) {
            let mut status = self.status.lock().unwrap_or_else(PoisonError::into_inner);
            status.lost += 1; // Until the thread counts again, the queue's with its own.
            status.failing.get_or_insert_with(|| {
                "expected a disk that keeps up, found no room for more that waits for it".to_owned()
            });
        }
    }

    /// True while its thread works.
    pub fn is_well(&self) -> bool {
        !self.thread.is_finished()
    }

    /// Writes what waits, and ends the file.
    pub fn stop(self) -> RecordStatus {
        self.queue.close();
        let panicked = self.thread.join().is_err();
        let mut status = self.status.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if panicked {
            status.failing = Some("the recorder ended; this is a bug".to_owned());
        }
        status
    }
}

/// The files, one after the other. Lives in the recorder's thread.
struct Files {
    settings: RecordSettings,
    config: Config,
    status: RecordStatus,
    open: Option<Open>,
    /// Those of the folder that are ours, the oldest first.
    ours: VecDeque<PathBuf>,
    /// No new file before this, after one that failed.
    not_before_ns: i64,
    /// Of one frame's length, by sensor: a message each.
    batch: Vec<Vec<Packet>>,
    batch_start_ns: Option<i64>,
}

struct Open {
    writer: RecordingWriter,
    started_ns: i64,
    flushed_ns: i64,
    /// Packets and results that the disk has not seen.
    unflushed: u64,
}

impl Files {
    fn new(settings: RecordSettings, config: Config) -> Self {
        let batch = vec![Vec::new(); config.site.sensors.len()];
        let ours = recordings_in(&settings.folder, &file_name(&config.site.name));
        let (status, open) = (RecordStatus::default(), None);
        Self { settings, config, status, open, ours, not_before_ns: i64::MIN, batch, batch_start_ns: None }
    }

    fn take(&mut self, item: Item) {
        match item {
            Item::Config(config) => {
                self.close();
                self.config = *config;
            }
            Item::Packet(Arrived { sensor, packet }) => {
                let start_ns = *self.batch_start_ns.get_or_insert(packet.time_ns);
                if packet.time_ns - start_ns >= STEP_NS {
                    self.write_batch();
                    self.batch_start_ns = Some(packet.time_ns);
                }
                if let Some(batch) = self.batch.get_mut(sensor) {
                    batch.push(packet);
                }
            }
            Item::Result(published) => {
                self.write(published.published_ns, 1, |writer| writer.write_results(&published.results()));
            }
        }
    }

    fn write_batch(&mut self) {
        let mut batch = std::mem::take(&mut self.batch);
        let count: u64 = batch.iter().map(|packets| packets.len() as u64).sum();
        if let Some(time_ns) = batch.iter().flatten().map(|packet| packet.time_ns).max() {
            self.write(time_ns, count, |writer| writer.write_packets(time_ns, &batch));
        }
        batch.iter_mut().for_each(Vec::clear);
        self.batch = batch;
    }

    /// Writes into the file of that time. A disk that fails is told and tried again later; what came meanwhile is
    /// lost, what was written stays.
    fn write(
        &mut self,
        now_ns: i64,
        items: u64,
        write: impl FnOnce(&mut RecordingWriter) -> Result<(), Error>,
    ) {
        let written = self.file_for(now_ns).and_then(|open| {
            let before = open.writer.bytes();
            write(&mut open.writer)?;
            open.unflushed += items;
            if now_ns - open.flushed_ns >= FLUSH_NS {
                open.writer.flush()?;
                (open.flushed_ns, open.unflushed) = (now_ns, 0);
            }
            Ok(open.writer.bytes() - before)
        });
        match written {
            Ok(bytes) => {
                self.status.bytes += bytes;
                self.status.failing = None;
            }
            Err(error) => {
                let unflushed = self.open.take().map(|open| open.unflushed);
                self.status.lost += unflushed.unwrap_or(0).max(items);
                if unflushed.is_some() || self.not_before_ns <= now_ns {
                    self.not_before_ns = now_ns + RETRY_NS;
                }
                self.status.failing = Some(error.to_string());
            }
        }
    }

    /// The open file, or a new one where it is full or there is none.
    fn file_for(&mut self, now_ns: i64) -> Result<&mut Open, Error> {
        let full = |open: &Open| {
            let s = (now_ns - open.started_ns) / 1_000_000_000;
            open.writer.bytes() >= self.settings.file_bytes || s >= self.settings.file_s as i64
        };
        if self.open.as_ref().is_some_and(full) {
            self.finish_file();
        }
        if self.open.is_none() {
            if now_ns < self.not_before_ns {
                let told = self.status.failing.clone().unwrap_or_default();
                return Err(Error::new(told));
            }
            let path = self.settings.folder.join(format!(
                "{}-{}.mcap",
                file_name(&self.config.site.name),
                stamp(now_ns)
            ));
            let toml = self.config.to_toml();
            let begun = RecordingWriter::create_live(&path, &toml, &self.config.site, now_ns)
                .and_then(|mut writer| writer.flush().map(|()| writer));
            // A full disk still makes files: one that holds nothing would count as a recording.
            let writer = begun.inspect_err(|_| {
                let _ = fs::remove_file(&path);
            })?;
            self.status.newest = Some(path.display().to_string());
            self.ours.push_back(path);
            self.make_room();
            self.status.files += 1;
            self.open = Some(Open { writer, started_ns: now_ns, flushed_ns: now_ns, unflushed: 0 });
        }
        self.open.as_mut().ok_or_else(|| Error::new("no open file"))
    }

    fn finish_file(&mut self) {
        let Some(open) = self.open.take() else { return };
        if let Err(error) = open.writer.finish() {
            self.status.lost += open.unflushed.max(1);
            self.status.failing = Some(error.to_string());
        }
    }

    /// Nothing came for a while: what waits is written, so that it is no older than it says.
    fn rest(&mut self) {
        self.write_batch();
        self.batch_start_ns = None;
        let Some(open) = self.open.as_mut().filter(|open| open.unflushed > 0) else { return };
        match open.writer.flush() {
            Ok(()) => open.unflushed = 0,
            Err(error) => {
                self.status.lost += self.open.take().map_or(0, |open| open.unflushed);
                self.status.failing = Some(error.to_string());
            }
        }
    }

    /// Deletes the oldest, only where that was asked for.
    fn make_room(&mut self) {
        let Some(keep) = self.settings.keep else { return };
        while self.ours.len() > keep.max(1) {
            let Some(oldest) = self.ours.pop_front() else { return };
            if let Err(error) = fs::remove_file(&oldest) {
                self.status.failing =
                    Some(Error::new(error.to_string()).within(oldest.display()).to_string());
            }
        }
    }

    fn close(&mut self) {
        self.write_batch();
        self.finish_file();
    }
}

/// Recordings of that site in a folder, the oldest first: their names hold the time.
fn recordings_in(folder: &Path, site: &str) -> VecDeque<PathBuf> {
    let name = |path: &PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let ours = |path: &PathBuf| {
        let name = name(path).unwrap_or_default();
        let time = name.strip_prefix(site).and_then(|rest| rest.strip_prefix('-')?.strip_suffix(".mcap"));
        time.is_some_and(|time| time.bytes().all(|b| b.is_ascii_digit() || b"TZ.".contains(&b)))
    };
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(ours).collect();
    found.sort();
    found.into()
}

/// A site's name as a file's: it must not lead out of the folder.
fn file_name(site: &str) -> String {
    site.chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect()
}

/// A time as a file's name holds it: `20261122T070503.250Z`.
fn stamp(time_ns: i64) -> String {
    let time = SystemTime::UNIX_EPOCH + Duration::from_nanos(time_ns.max(0) as u64);
    humantime::format_rfc3339_millis(time).to_string().replace(['-', ':'], "")
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast_io::recording::{Entry, RecordingReader};

    const START_NS: i64 = 1_795_330_000_000_000_000;

    fn settings(folder: &Path) -> RecordSettings {
        RecordSettings {
            folder: folder.to_owned(),
            file_bytes: u64::MAX,
            file_s: 3600,
            keep: None,
            points: false,
        }
    }

    fn arrived(k: i64) -> Arrived {
        let payload = vec![k as u8; umbracast_io::messages::PACKET_BYTES];
        Arrived { sensor: (k % 2) as usize, packet: Packet { time_ns: START_NS + k * 1_000_000, payload } }
    }

    /// Times of the packets in a file, in its order.
    fn times(path: &Path) -> Vec<i64> {
        let mut reader = RecordingReader::open(path).unwrap();
        let mut times = Vec::new();
        while let Some(entry) = reader.next_entry().unwrap() {
            if let Entry::Packets(_, packets) = entry {
                times.extend(packets.iter().map(|packet| packet.time_ns));
            }
        }
        times
    }

    #[test]
    fn times_are_written_as_dates() {
        assert_eq!(stamp(0), "19700101T000000.000Z");
        assert_eq!(stamp(951_782_400_000_000_000), "20000229T000000.000Z");
        assert_eq!(stamp(1_795_330_000_123_000_000), "20261122T064640.123Z");
    }

    #[test]
    fn every_packet_is_in_the_files_and_files_roll_over_by_time() {
        let folder = tempfile::tempdir().unwrap();
        let recorder = Recorder::start(
            RecordSettings { file_s: 1, ..settings(folder.path()) },
            &Config::default(),
            Arc::default(),
        )
        .unwrap();
        for k in 0..1900 {
            recorder.packet(arrived(k));
        }
        let status = recorder.stop();
        assert_eq!((status.files, status.failing, status.lost), (2, None, 0));
        let files = recordings_in(folder.path(), "default");
        assert_eq!(times(&files[0]).len(), 1000, "a second of a packet a millisecond");
        let mut found: Vec<i64> = files.iter().flat_map(|file| times(file)).collect();
        found.sort_unstable();
        let sent: Vec<i64> = (0..1900).map(|k| arrived(k).packet.time_ns).collect();
        assert!(found == sent, "{} of {} packets, or other ones", found.len(), sent.len());
    }

    #[test]
    fn the_oldest_is_deleted_only_where_that_was_asked_for() {
        for (keep, left) in [(None, 4), (Some(2), 2)] {
            let folder = tempfile::tempdir().unwrap();
            let mut files =
                Files::new(RecordSettings { file_s: 1, keep, ..settings(folder.path()) }, Config::default());
            (0..40).for_each(|k| files.take(Item::Packet(arrived(k * 100))));
            files.close();
            assert_eq!(recordings_in(folder.path(), "default").len(), left);
        }
    }

    #[test]
    fn a_site_s_name_does_not_lead_out_of_the_folder() {
        assert_eq!(file_name("../hall 3/east"), "___hall_3_east");
    }

    /// As one does whose host is gone: a write neither succeeds nor fails. It was told once the disk wrote again, or never.
    #[test]
    fn a_disk_that_stands_still_is_told_while_it_does() {
        let status = Arc::new(Mutex::new(RecordStatus::default()));
        let queue = Arc::new(Queue::new(2, WhenFull::DropNewest));
        let thread = std::thread::spawn(|| ());
        let recorder = Recorder { queue, status: status.clone(), thread };
        let told = || status.lock().unwrap().clone();
        (0..2).for_each(|k| recorder.packet(arrived(k)));
        assert_eq!(told(), RecordStatus::default());
        (2..5).for_each(|k| recorder.packet(arrived(k)));
        assert_eq!(told().lost, 3);
        assert!(told().failing.is_some_and(|told| told.contains("expected a disk that keeps up")));
    }

    #[test]
    fn a_disk_that_fails_is_told_and_tried_again() {
        let folder = tempfile::tempdir().unwrap();
        let gone = folder.path().join("gone");
        let mut files = Files::new(settings(&gone), Config::default());
        (0..300).for_each(|k| files.take(Item::Packet(arrived(k))));
        assert!(files.status.failing.as_ref().is_some_and(|told| told.contains("gone")));
        assert_eq!(files.status.files, 0);
        fs::create_dir(&gone).unwrap();
        (0..70).for_each(|k| files.take(Item::Packet(arrived(400 + k * 100))));
        files.close();
        assert_eq!((files.status.files, files.status.failing.as_ref()), (1, None));
        let found = times(&recordings_in(&gone, "default")[0]).len() as u64;
        assert!(found > 0 && files.status.lost >= 300, "{found} found, {} lost", files.status.lost);
        assert_eq!(found + files.status.lost, 370, "each is found or counted");
    }
}
