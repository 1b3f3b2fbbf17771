//! The inputs of `run`: recordings, PCD clouds, captures. Each gives frames in order.

use std::path::{Path, PathBuf};

use umbracast::lidar::{Assembler, Cloud, Frame, Packet, Scan};
use umbracast::{Config, Error, Health, STEP_NS, Site};

use crate::pcd::read_pcd;
use crate::recording::{self, Entry, RecordingReader};
use crate::setup;

mod sink;
mod captures;
mod empty;
mod look;
mod words;
mod matching;
mod point_clouds;

pub use captures::Capture;
pub use matching::Told;
use sink::{PacketSink, Sink, drain};

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
    /// An MCAP recording, or one in rosbag2's SQLite storage.
    Recording(PathBuf),
    /// PCD clouds of one sensor, a frame each, in natural order of their names.
    Clouds(Vec<PathBuf>),
    /// Captures: one for each sensor, or one of all.
    Captures(Vec<Capture>),
}

/// The files that arguments name, before the site is known.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Given {
    recordings: Vec<PathBuf>,
    clouds: Vec<Vec<PathBuf>>,
    captures: Vec<PathBuf>,
    /// Files and folders that are named as the empty hall, beside others that are not.
    empty: Vec<PathBuf>,
}

/// The scenes of a site, and the hall without people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Inputs {
    /// In the order in which they are run.
    pub scenes: Vec<Input>,
    /// The empty hall, where one is named among the scenes or lies beside them.
    pub empty: Option<Input>,
}

impl Given {
    /// Sorts files and the files of folders by what they are. What is named as the empty hall (`empty.mcap`,
    /// `empty-east.pcap`, a folder `empty`) is no scene, unless nothing else is given.
    ///
    /// # Errors
    /// A file of another kind, or a folder without input.
    pub fn of(paths: &[PathBuf]) -> Result<Self, Error> {
        let (mut files, mut empty, mut given) = (Vec::new(), Vec::new(), Self::default());
        let mut sort = |found: Vec<PathBuf>| {
            for file in found {
                if words::is_empty_hall(&file) { empty.push(file) } else { files.push(file) }
            }
        };
        for path in paths {
            if !path.is_dir() || words::is_empty_hall(path) {
                sort(vec![path.clone()]);
                continue;
            }
            let found = filled(path)?;
            match found.iter().all(|file| file.extension().is_some_and(|e| e == "pcd")) {
                true => given.clouds.push(found),
                false => sort(found),
            }
        }
        if files.is_empty() && given.clouds.is_empty() {
            files = std::mem::take(&mut empty);
            let folders = files.extract_if(.., |file| file.is_dir()).collect::<Vec<_>>();
            for path in folders {
                files.extend(filled(&path)?);
            }
        }
        given.empty = empty;
        let mut clouds = Vec::new();
        for file in files {
            match file.extension().and_then(|e| e.to_str()) {
                Some("mcap" | "db3") => given.recordings.push(file),
                Some("pcd") => clouds.push(file),
                Some("pcap") => given.captures.push(file),
                _ if !file.exists() => {
                    return Err(Error::new("no such file or folder").within(file.display()));
                }
                _ => return Err(Error::new("expected .mcap, .db3, .pcd or .pcap").within(file.display())),
            }
        }
        if !clouds.is_empty() {
            setup::sort_naturally(&mut clouds);
            given.clouds.push(clouds);
        }
        Ok(given)
    }

    /// The site on which all recordings were made; none where none says so. Captures and clouds never say.
    ///
    /// # Errors
    /// Recordings of different sites, or one beside input that names none.
    pub fn site(&self) -> Result<Option<Site>, Error> {
        let mut first: Option<Site> = None;
        for file in &self.recordings {
            let site = recorded_site(file)?;
            if let (Some(first), Some(site)) = (&first, &site)
                && site != first
            {
                let (expected, found) = (&first.name, &site.name);
                let story = format!(
                    "site: expected {expected:?} as in the first recording, found another, {found:?}"
                );
                return Err(Error::new(story).within(file.display()));
            }
            first = first.or(site);
        }
        let silent = self.clouds.first().and_then(|clouds| clouds.first()).or(self.captures.first());
        if let (Some(site), Some(silent)) = (&first, silent) {
            let story = format!(
                "expected --site, or only recordings as inputs: a recording names its site, {:?}, and this input names none",
                site.name
            );
            return Err(Error::new(story).within(silent.display()));
        }
        Ok(first)
    }

    /// The scenes: captures have found their sensors. `told` says of some which sensor they are of.
    ///
    /// # Errors
    /// Captures that find no sensor, or more than one.
    pub fn of_site(&self, site: &Site, told: &[Told]) -> Result<Inputs, Error> {
        let mut scenes: Vec<Input> = self.recordings.iter().cloned().map(Input::Recording).collect();
        scenes.extend(self.clouds.iter().cloned().map(Input::Clouds));
        if !self.captures.is_empty() {
            let captures = matching::in_scenes(&self.captures, site, told)?;
            scenes.extend(captures.into_iter().map(Input::Captures));
        }
        let empty = match (&self.empty[..], scenes.first()) {
            ([], Some(Input::Recording(file))) => {
                let beside = file.parent().unwrap_or(Path::new(".")).join(EMPTY);
                (beside.is_file() && beside != *file).then_some(Input::Recording(beside))
            }
            ([], _) => None,
            (empty, _) => Some(empty_hall(empty, site, told)?),
        };
        Ok(Inputs { scenes, empty })
    }
}

/// The hall without people, in any form that input may have.
///
/// # Errors
/// More than one scene, and whatever [`Given::of`] and [`Given::of_site`] fail with.
pub fn empty_hall(paths: &[PathBuf], site: &Site, told: &[Told]) -> Result<Input, Error> {
    let mut scenes = Given::of(paths)?.of_site(site, told)?.scenes;
    match (scenes.pop(), &scenes[..]) {
        (Some(empty), []) => Ok(empty),
        (last, others) => {
            let all: Vec<String> = others.iter().chain(&last).map(Input::to_string).collect();
            let story = format!("the empty hall: expected one scene, found {}", all.join(", "));
            Err(Error::new(story))
        }
    }
}

/// Whether one capture of all of a site's sensors could be read.
pub fn can_share_a_capture(site: &Site) -> bool {
    captures::whole_site(site).is_ok()
}

/// What [`folder`] finds; there has to be something.
fn filled(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let found = folder(path)?;
    if found.is_empty() {
        let story = "expected .mcap, .db3, .pcd or .pcap files in the folder, found none";
        return Err(Error::new(story).within(path.display()));
    }
    Ok(found)
}

/// A folder's recordings, or its clouds, or its captures.
fn folder(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut files = Vec::new();
    for extension in ["mcap", "db3", "pcd", "pcap"] {
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

/// The site that a recording was made on, where it says so.
fn recorded_site(file: &Path) -> Result<Option<Site>, Error> {
    match RecordingReader::open(file)?.next_entry()? {
        Some(Entry::Config(text)) => {
            let place = format!("{}: recorded configuration", file.display());
            Ok(Some(Config::site_of_run(&text, &place)?))
        }
        _ => Ok(None),
    }
}

impl std::fmt::Display for Input {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (first, more) = match self {
            Self::Recording(file) => (file, 0),
            Self::Clouds(files) => (&files[0], files.len() - 1),
            Self::Captures(captures) => (&captures[0].file, captures.len() - 1),
        };
        write!(f, "{}", first.display())?;
        if more > 0 { write!(f, " and {more} more") } else { Ok(()) }
    }
}

impl Input {
    /// A line for each capture: which sensors it was found to be of, and by what.
    pub fn matched(&self, site: &Site) -> Vec<String> {
        let Self::Captures(captures) = self else { return Vec::new() };
        captures.iter().map(|capture| capture.told(site)).collect()
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
            Self::Recording(file) if point_clouds::are_all_of(site) => {
                let mut reader = RecordingReader::open(file)?;
                point_clouds::recording(&mut reader, site, health, &mut sink)?;
                Ok(reader.lost().map(str::to_owned))
            }
            Self::Recording(file) => {
                assembled(site, health, &mut sink, |packets| recorded_packets(file, site, packets))
            }
            Self::Clouds(files) => clouds(files, site, health, &mut sink),
            Self::Captures(files) => {
                assembled(site, health, &mut sink, |packets| captures::packets(files, site, packets))
            }
        }
    }

    /// Gives every packet to `sink`, with its sensor's place in the site, in the order in which they came. Says what
    /// was lost at the end of a damaged file.
    ///
    /// # Errors
    /// Clouds, which have no packets; otherwise as [`Self::frames`].
    pub fn packets(
        &self,
        site: &Site,
        mut sink: impl FnMut(usize, Packet) -> Result<(), Error>,
    ) -> Result<Option<String>, Error> {
        match self {
            Self::Recording(file) => recorded_packets(file, site, &mut sink),
            Self::Captures(files) => captures::packets(files, site, &mut sink),
            Self::Clouds(files) => {
                Err(Error::new("expected packets, found clouds").within(files[0].display()))
            }
        }
    }
}

/// The packets of all sensors in the order in which they came: a recording keeps a list for each sensor and frame.
fn recorded_packets(file: &Path, site: &Site, sink: PacketSink) -> Result<Option<String>, Error> {
    let mut reader = RecordingReader::open(file)?;
    // One list a sensor; a sensor's next list begins the next frame.
    let mut lists: Vec<(usize, Vec<Packet>)> = Vec::new();
    let mut give = |lists: &mut Vec<(usize, Vec<Packet>)>| {
        let of_sensor =
            |(sensor, packets): (usize, Vec<Packet>)| packets.into_iter().map(move |p| (sensor, p));
        let mut all: Vec<(usize, Packet)> = lists.drain(..).flat_map(of_sensor).collect();
        all.sort_by_key(|(_, packet)| packet.time_ns);
        all.into_iter().try_for_each(|(sensor, packet)| sink(sensor, packet))
    };
    while let Some(entry) = reader.next_entry()? {
        let Entry::Packets(name, packets) = entry else { continue };
        let Some(sensor) = recording::sensor_of(site, &name) else {
            let known: Vec<&str> = site.sensors.iter().map(|s| s.name.as_str()).collect();
            let story = format!("sensor {name:?}: expected one of the site's, {}", known.join(", "));
            return Err(Error::new(story).within(file.display()));
        };
        if lists.iter().any(|(other, _)| *other == sensor) {
            give(&mut lists)?;
        }
        lists.push((sensor, packets));
    }
    give(&mut lists)?;
    Ok(reader.lost().map(str::to_owned))
}

/// Packets through an assembler, frames to the sink.
fn assembled(
    site: &Site,
    health: &mut Health,
    sink: Sink,
    packets: impl FnOnce(PacketSink) -> Result<Option<String>, Error>,
) -> Result<Option<String>, Error> {
    let mut assembler = Assembler::new(site)?;
    let lost = packets(&mut |sensor, packet| {
        assembler.push(sensor, &packet, health);
        drain(&mut assembler, sink)
    })?;
    assembler.finish();
    drain(&mut assembler, sink)?;
    Ok(lost)
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
