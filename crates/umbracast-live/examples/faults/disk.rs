//! The disk that is recorded to, and what fails of it. All but its loss need root: they mount a file system of their own.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::thread::{JoinHandle, sleep};
use std::time::Duration;

use umbracast::Error;
use umbracast_io::recording::{Entry, RecordingReader};
use umbracast_live::HostClock;
use umbracast_live::run::Counters;

use super::hall::{FAILS_NS, S};

/// The small disk: some fourteen seconds of two HDL-32E.
const MIB: u64 = 64;
const INODES: u64 = 64;
/// A slow disk stands still for so much of each second.
const STANDS: Duration = Duration::from_millis(900);

/// What fails of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Disk {
    Fine,
    /// A file stands where the folder was.
    Gone,
    /// A file fills what is left of it.
    Full,
    /// Empty files take all its inodes.
    NoInodes,
    /// It takes nothing for nine tenths of each second.
    Slow,
    /// It takes nothing at all.
    StandsStill,
}

/// How the recording went on.
#[derive(Default)]
pub struct Recorded {
    /// When something was recorded again after the failure: none where nothing failed, and never where it did not happen.
    pub again_ns: Option<Option<i64>>,
    /// What the recorder said at the end of the failure.
    pub told: Option<String>,
    /// Packets and results of frames in the files.
    pub found: u64,
}

/// A folder for recordings, on a disk of its own where that shall fail.
pub struct Folder {
    disk: Disk,
    pub path: PathBuf,
    /// What the disk is mounted at, where it is mounted.
    mounted: Option<PathBuf>,
    image: PathBuf,
}

impl Disk {
    pub fn needs_root(self) -> bool {
        !matches!(self, Self::Fine | Self::Gone)
    }
}

pub fn is_root() -> bool {
    fs::metadata("/proc/self").is_ok_and(|own| own.uid() == 0)
}

impl Folder {
    pub fn on(disk: Disk) -> Result<Self, Error> {
        let own = std::env::temp_dir().join(format!("umbracast-faults-{}", std::process::id()));
        let image = own.with_extension("image");
        let mut folder = Self { disk, path: own.join("recorded"), mounted: None, image };
        fs::create_dir_all(&own).map_err(|e| Error::new(e.to_string()).within(own.display()))?;
        let (at, image) = (own.display().to_string(), folder.image.display().to_string());
        let made = match disk {
            Disk::Fine | Disk::Gone => return Ok(folder),
            Disk::Full => shell(&format!("mount -t tmpfs -o size={MIB}m umbracast {at}")),
            Disk::NoInodes => {
                shell(&format!("mount -t tmpfs -o size={}m,nr_inodes={INODES} umbracast {at}", 4 * MIB))
            }
            Disk::Slow | Disk::StandsStill => shell(&format!(
                "truncate -s {}M {image} && mkfs.ext4 -q {image} && mount -o loop {image} {at}",
                4 * MIB
            )),
        };
        made.map(|()| folder.mounted = Some(own))?;
        Ok(folder)
    }

    /// Lets it fail and puts it right, in a thread of its own.
    pub fn fail(
        &self,
        clock: HostClock,
        begun_ns: i64,
        seconds: u64,
        counters: Arc<Counters>,
    ) -> JoinHandle<Result<Recorded, Error>> {
        let (disk, path) = (self.disk, self.path.clone());
        std::thread::spawn(move || {
            if disk == Disk::Fine {
                return Ok(Recorded::default());
            }
            clock.sleep_until(begun_ns + FAILS_NS.start);
            disk.fails(&path)?;
            while disk == Disk::Slow && clock.now_ns() + S <= begun_ns + FAILS_NS.end {
                sleep(STANDS);
                disk.is_right_again(&path)?;
                sleep(Duration::from_secs(1) - STANDS);
                disk.fails(&path)?;
            }
            clock.sleep_until(begun_ns + FAILS_NS.end);
            let told = counters.recorder().failing;
            disk.is_right_again(&path)?;
            let before = counters.recorder().bytes;
            let mut again_ns = None;
            while again_ns.is_none() && clock.now_ns() < begun_ns + seconds as i64 * S {
                sleep(Duration::from_millis(10));
                again_ns = (counters.recorder().bytes > before).then(|| clock.now_ns());
            }
            Ok(Recorded { again_ns: Some(again_ns), told, found: 0 })
        })
    }

    /// How many packets and results of frames its files hold.
    pub fn found(&self) -> Result<u64, Error> {
        let mut found = 0;
        let entries =
            fs::read_dir(&self.path).map_err(|e| Error::new(e.to_string()).within(self.path.display()))?;
        for file in
            entries.flatten().map(|entry| entry.path()).filter(|p| p.extension().is_some_and(|e| e == "mcap"))
        {
            let mut reader = RecordingReader::open(&file)?;
            while let Some(entry) = reader.next_entry()? {
                found += match entry {
                    Entry::Packets(_, packets) => packets.len() as u64,
                    Entry::Other(topic, ..) => u64::from(topic == "/umbracast/blockages"),
                    _ => 0,
                };
            }
        }
        Ok(found)
    }
}

impl Drop for Folder {
    /// Temporary; what stays of it hurts nobody.
    fn drop(&mut self) {
        if let Some(at) = &self.mounted {
            let at = at.display();
            let _ = shell(&format!("fsfreeze --unfreeze {at} 2>/dev/null; umount {at}"));
            let _ = fs::remove_file(&self.image);
        }
        let _ = self.path.parent().map(fs::remove_dir_all);
    }
}

impl Disk {
    fn fails(self, folder: &Path) -> Result<(), Error> {
        let (own, beside) = (parent(folder), beside(folder));
        let failed = |e: std::io::Error| Error::new(e.to_string()).within(folder.display());
        match self {
            Self::Fine => Ok(()),
            Self::Gone => fs::rename(folder, &beside).and_then(|()| fs::write(folder, "")).map_err(failed),
            // Until no more fits, which is what shall happen.
            Self::Full => {
                shell(&format!("dd if=/dev/zero of={} bs=64k 2>/dev/null || true", beside.display()))
            }
            Self::NoInodes => {
                fs::create_dir(&beside).map_err(failed)?;
                (0..INODES).take_while(|k| fs::write(beside.join(k.to_string()), "").is_ok()).for_each(drop);
                Ok(())
            }
            Self::Slow | Self::StandsStill => shell(&format!("fsfreeze --freeze {own}")),
        }
    }

    fn is_right_again(self, folder: &Path) -> Result<(), Error> {
        let (own, beside) = (parent(folder), beside(folder));
        let failed = |e: std::io::Error| Error::new(e.to_string()).within(folder.display());
        match self {
            Self::Fine => Ok(()),
            Self::Gone => fs::remove_file(folder).and_then(|()| fs::rename(&beside, folder)).map_err(failed),
            Self::Full => fs::remove_file(&beside).map_err(failed),
            Self::NoInodes => fs::remove_dir_all(&beside).map_err(failed),
            Self::Slow | Self::StandsStill => shell(&format!("fsfreeze --unfreeze {own}")),
        }
    }
}

fn parent(folder: &Path) -> String {
    folder.parent().unwrap_or(folder).display().to_string()
}

fn beside(folder: &Path) -> PathBuf {
    folder.with_extension("beside")
}

fn shell(line: &str) -> Result<(), Error> {
    let done = Command::new("sh").args(["-c", line]).output().map_err(|e| Error::new(e.to_string()))?;
    if done.status.success() {
        return Ok(());
    }
    Err(Error::new(format!("{line}: {}", String::from_utf8_lossy(&done.stderr).trim_end())))
}
