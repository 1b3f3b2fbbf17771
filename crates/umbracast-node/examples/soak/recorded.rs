//! Recordings, each opened as soon as the next one is begun, and before it is the oldest.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use umbracast::Error;
use umbracast_io::recording::{Entry, RecordingReader};

const WAKE: Duration = Duration::from_millis(200);
/// A message of it is there for every frame.
const OF_FRAMES: &str = "/umbracast/tracks";

/// What was found in recordings that are closed.
#[derive(Debug, Default, Clone)]
pub struct Found {
    pub files: u64,
    pub whole: u64,
    pub packets: u64,
    pub frames: u64,
    pub longest_bytes: u64,
    /// What the first of those said that were not whole.
    pub told: Option<String>,
}

/// Its thread.
pub struct Opener {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Found>,
}

impl Opener {
    /// Looks into the folder until it is told to stop.
    pub fn start(folder: PathBuf) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let ended = stop.clone();
        let thread = std::thread::spawn(move || {
            let (mut found, mut known) = (Found::default(), BTreeSet::new());
            loop {
                // Asked before: what is there once the recorder has ended is closed, the newest too.
                let is_last = ended.load(Ordering::Relaxed);
                let mut files = files(&folder);
                if !is_last {
                    files.pop();
                }
                for file in files {
                    if known.insert(file.clone()) {
                        found.open(&file);
                    }
                }
                if is_last {
                    return found;
                }
                std::thread::sleep(WAKE);
            }
        });
        Self { stop, thread }
    }

    /// Opens what is left; the recorder has ended.
    ///
    /// # Errors
    /// The thread panicked.
    pub fn stop(self) -> Result<Found, Error> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().map_err(|_| Error::new("who opens recordings panicked"))
    }
}

/// The oldest first: their names hold the time.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "mcap"));
    files.sort();
    files
}

impl Found {
    fn open(&mut self, file: &Path) {
        self.files += 1;
        let bytes = std::fs::metadata(file).map_or(0, |found| found.len());
        self.longest_bytes = self.longest_bytes.max(bytes);
        match self.read(file) {
            Ok(None) => self.whole += 1,
            Ok(Some(lost)) => self.told = self.told.take().or(Some(lost)),
            Err(error) => self.told = self.told.take().or(Some(error.to_string())),
        }
    }

    /// What was lost at its end, if anything.
    fn read(&mut self, file: &Path) -> Result<Option<String>, Error> {
        let mut reader = RecordingReader::open(file)?;
        while let Some(entry) = reader.next_entry()? {
            match entry {
                Entry::Packets(_, packets) => self.packets += packets.len() as u64,
                Entry::Other(topic, _, _) if topic == OF_FRAMES => self.frames += 1,
                _ => {}
            }
        }
        Ok(reader.lost().map(str::to_owned))
    }
}
