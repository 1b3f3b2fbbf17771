//! The inputs of `run`: recordings, PCD clouds, captures. Each gives frames in order.

use std::path::{Path, PathBuf};

use umbracast::lidar::{Assembler, Cloud, Frame, Packet, Scan};
use umbracast::{Config, Error, Health, STEP_NS, Site};

use crate::pcd::read_pcd;
use crate::recording::{Entry, RecordingReader};
use crate::setup;

mod sink;
mod captures;
mod point_clouds;

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
                return Err(Error::new(
                    "expected .mcap, .db3, .pcd or .pcap files in the folder, found none",
                )
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
            Some("mcap" | "db3") => scenes.push(Input::Recording(file)),
            Some("pcd") => clouds.push(file),
            Some("pcap") => captures.push(file),
            _ if !file.exists() => return Err(Error::new("no such file or folder").within(file.display())),
            _ => return Err(Error::new("expected .mcap, .db3, .pcd or .pcap").within(file.display())),
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

/// The same where the site is known: captures of all its sensors are scenes of their own.
///
/// # Errors
/// Captures that are neither a whole recording each nor one for each sensor.
pub fn of_site(inputs: Vec<Input>, site: &Site) -> Result<Vec<Input>, Error> {
    let mut scenes = Vec::new();
    for input in inputs {
        match input {
            Input::Captures(files) => {
                scenes.extend(captures::in_scenes(files, site)?.into_iter().map(Input::Captures));
            }
            other => scenes.push(other),
        }
    }
    Ok(scenes)
}

/// Whether one capture of all of a site's sensors could be read.
pub fn can_share_a_capture(site: &Site) -> bool {
    captures::whole_site(site).is_ok()
}

/// A folder's recordings, or its clouds, or its captures.
fn folder(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut files = recordings(path)?;
    for extension in ["db3", "pcd", "pcap"] {
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

/// The site on which all inputs were recorded; none where none says so. Captures and clouds never say.
///
/// # Errors
/// Recordings of different sites, or one beside input that names none.
pub fn recorded_site(inputs: &[Input]) -> Result<Option<Site>, Error> {
    let mut first: Option<Site> = None;
    for input in inputs {
        let site = input.site()?;
        if let (Some(first), Some(site)) = (&first, &site)
            && site != first
        {
            let (expected, found) = (&first.name, &site.name);
            let story =
                format!("site: expected {expected:?} as in the first recording, found another, {found:?}");
            return Err(Error::new(story).within(input));
        }
        first = first.or(site);
    }
    let silent = inputs.iter().find(|input| !matches!(input, Input::Recording(_)));
    if let (Some(site), Some(silent)) = (&first, silent) {
        let story = format!(
            "expected --site, or only recordings as inputs: a recording names its site, {:?}, and this input names none",
            site.name
        );
        return Err(Error::new(story).within(silent));
    }
    Ok(first)
}

/// The recording without people that `simulate` wrote beside this one, if it did.
pub fn empty_beside(input: &Input) -> Option<PathBuf> {
    let Input::Recording(file) = input else { return None };
    Some(file.parent().unwrap_or(Path::new(".")).join(EMPTY)).filter(|path| path.is_file())
}

/// The frames of the hall without people, in any form that input may have, and what was lost of them.
///
/// # Errors
/// More than one scene, and whatever [`Input::frames`] fails with.
pub fn empty_frames(
    path: &Path,
    config: &Config,
    health: &mut Health,
) -> Result<(Vec<Frame>, Option<String>), Error> {
    let [empty] = &of_site(scenes(std::slice::from_ref(&path.to_owned()))?, &config.site)?[..] else {
        return Err(Error::new("expected one scene without people, found several").within(path.display()));
    };
    let mut frames = Vec::new();
    let lost = empty.frames(&config.site, health, |frame| {
        frames.push(frame.clone());
        Ok(())
    })?;
    Ok((frames, lost))
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
        let Some(sensor) = site.sensors.iter().position(|sensor| sensor.name == name) else {
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
