//! What `run` reads: recordings, PCD clouds, captures. Each gives frames, one after the other.

use std::path::{Path, PathBuf};

use umbracast::lidar::{Assembler, Cloud, Frame, Scan};
use umbracast::{Config, Error, Health, STEP_NS, Site};
use umbracast_io::pcd::read_pcd;
use umbracast_io::recording::{Entry, RecordingReader};

use crate::setup;

mod sink;
mod captures;
mod point_clouds;

use sink::{Sink, drain};

/// The recording without people, beside those of a simulation.
pub const EMPTY: &str = "empty.mcap";

/// The file that `simulate` writes a scene to.
pub fn scene_file(folder: &Path, number: usize) -> PathBuf {
    folder.join(format!("scene-{number:04}.mcap"))
}

/// The number of the scene in the name that `simulate` gives a recording, `scene-0003.mcap`.
pub fn scene_number(input: &Input) -> Option<u32> {
    let Input::Recording(file) = input else { return None };
    file.file_stem()?.to_str()?.strip_prefix("scene-")?.parse().ok()
}

/// One scene's input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Input {
    /// An MCAP recording.
    Recording(PathBuf),
    /// PCD clouds of one sensor, a frame each, in natural order of their names.
    Clouds(Vec<PathBuf>),
    /// Captures: one for each sensor in the site's order, or one of all.
    Captures(Vec<PathBuf>),
}

/// The scenes that the arguments name.
///
/// # Errors
/// A file of another kind, or a folder without input.
pub fn scenes(paths: &[PathBuf]) -> Result<Vec<Input>, Error> {
    let (mut files, mut folders_of_clouds) = (Vec::new(), Vec::new());
    for path in paths {
        if path.is_dir() {
            let found = folder(path)?;
            let clouds: Vec<PathBuf> =
                found.iter().filter(|file| file.extension().is_some_and(|e| e == "pcd")).cloned().collect();
            if !clouds.is_empty() {
                folders_of_clouds.push(Input::Clouds(clouds));
                continue;
            }
            if found.is_empty() {
                return Err(Error::new("expected .mcap, .pcd or .pcap files in the folder, found none")
                    .within(path.display()));
            }
            files.extend(found);
        } else {
            files.push(path.clone());
        }
    }
    let (mut scenes, mut clouds, mut captures) = (Vec::new(), Vec::new(), Vec::new());
    for file in files {
        match file.extension().and_then(|e| e.to_str()) {
            Some("mcap") => scenes.push(Input::Recording(file)),
            Some("pcd") => clouds.push(file),
            Some("pcap") => captures.push(file),
            _ if !file.exists() => return Err(Error::new("no such file or folder").within(file.display())),
            _ => return Err(Error::new("expected .mcap, .pcd or .pcap").within(file.display())),
        }
    }
    scenes.extend(folders_of_clouds);
    if !clouds.is_empty() {
        setup::sort_naturally(&mut clouds);
        scenes.push(Input::Clouds(clouds));
    }
    if !captures.is_empty() {
        scenes.push(Input::Captures(captures));
    }
    Ok(scenes)
}

/// A folder's recordings, or its clouds, or its captures.
fn folder(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut files = recordings(path)?;
    for extension in ["pcd", "pcap"] {
        if files.is_empty() {
            files = setup::files_with_extension(path, extension)?;
        }
    }
    Ok(files)
}

/// The recordings of people in a folder, in natural order.
pub fn recordings(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut files = setup::files_with_extension(folder, "mcap")?;
    files.retain(|file| file.file_name().is_none_or(|name| name != EMPTY));
    Ok(files)
}

impl std::fmt::Display for Input {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (first, more) = match self {
            Self::Recording(file) => (file, 0),
            Self::Clouds(files) | Self::Captures(files) => (&files[0], files.len() - 1),
        };
        write!(f, "{}", first.display())?;
        if more > 0 { write!(f, " and {more} more") } else { Ok(()) }
    }
}

impl Input {
    /// The site that the input was recorded on, where it says so.
    ///
    /// # Errors
    /// A recording that cannot be read, or whose configuration is not understood.
    pub fn site(&self) -> Result<Option<Site>, Error> {
        let Self::Recording(file) = self else { return Ok(None) };
        let mut reader = RecordingReader::open(file)?;
        match reader.next_entry()? {
            Some(Entry::Config(text)) => {
                let place = format!("{}: recorded configuration", file.display());
                Ok(Some(Config::site_of_run(&text, &place)?))
            }
            _ => Ok(None),
        }
    }

    /// Gives every frame to `sink`; what is broken is counted. Says what was lost at the end of a damaged file.
    ///
    /// # Errors
    /// A file that is not there or of another kind, and what `sink` fails with.
    pub fn frames(
        &self,
        site: &Site,
        health: &mut Health,
        mut sink: impl FnMut(&Frame) -> Result<(), Error>,
    ) -> Result<Option<String>, Error> {
        match self {
            Self::Recording(file) => recording(file, site, health, &mut sink),
            Self::Clouds(files) => clouds(files, site, health, &mut sink),
            Self::Captures(files) => captures::captures(files, site, health, &mut sink),
        }
    }
}

fn recording(file: &Path, site: &Site, health: &mut Health, sink: Sink) -> Result<Option<String>, Error> {
    let mut reader = RecordingReader::open(file)?;
    if point_clouds::are_all_of(site) {
        point_clouds::recording(&mut reader, site, health, sink)?;
        return Ok(reader.lost().map(str::to_owned));
    }
    let mut assembler = Assembler::new(site)?;
    while let Some(entry) = reader.next_entry()? {
        let Entry::Packets(name, packets) = entry else { continue };
        let Some(sensor) = site.sensors.iter().position(|sensor| sensor.name == name) else {
            let known: Vec<&str> = site.sensors.iter().map(|s| s.name.as_str()).collect();
            let story = format!("sensor {name:?}: expected one of the site's, {}", known.join(", "));
            return Err(Error::new(story).within(file.display()));
        };
        packets.iter().for_each(|packet| assembler.push(sensor, packet, health));
        drain(&mut assembler, sink)?;
    }
    assembler.finish();
    drain(&mut assembler, sink)?;
    Ok(reader.lost().map(str::to_owned))
}

/// Clouds carry no time: one period between them. A file named by a number gives its frame that number.
fn clouds(files: &[PathBuf], site: &Site, health: &mut Health, sink: Sink) -> Result<Option<String>, Error> {
    let [sensor] = &site.sensors[..] else {
        let found = site.sensors.len();
        return Err(Error::new(format!("clouds: expected a site with 1 sensor, found {found}"))
            .within(files[0].display()));
    };
    // Longer numbers are times, which are no frame numbers.
    let by_name = files.iter().all(|file| setup::number_of(file).is_some_and(|n| n < 1_000_000_000));
    for (count, file) in files.iter().enumerate() {
        let index = setup::number_of(file).filter(|_| by_name).unwrap_or(count as u64);
        let time_ns = (index as i64 + 1) * STEP_NS;
        let name = file.display().to_string();
        let cloud = read_pcd(&setup::read(file)?, &name)?;
        let (points, dropped) = cloud.sensor_points(time_ns).map_err(|e| e.within(&name))?;
        health.points_invalid += dropped;
        let scan = Scan {
            sensor: 0,
            site_from_sensor: sensor.site_from_sensor(),
            cloud: Cloud::Unorganised(points),
        };
        sink(&Frame { index, time_ns, scans: vec![scan] })?;
    }
    Ok(None)
}
