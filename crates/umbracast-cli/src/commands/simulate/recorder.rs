//! One scene's files: its recording, and captures beside it.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use umbracast::lidar::{Assembler, Packet, udp_port};
use umbracast::{Config, Error, Health, Site};
use umbracast_eval::run::chain;
use umbracast_eval::score::scene::SceneTruth;
use umbracast_io::pcap::{Datagram, PcapWriter};
use umbracast_io::recording::RecordingWriter;

use crate::args::{Packets, Simulate};
use umbracast_io::{input, recording};

/// Files that appear under their names only when they are whole, so that a run that was stopped leaves none behind that
/// looks finished.
pub struct Recorder {
    recording: RecordingWriter,
    clouds: Option<Assembler>,
    captures: Option<Captures>,
    paths: Vec<PathBuf>,
}

impl Recorder {
    pub fn create(path: &Path, config: &Config, args: &Simulate) -> Result<Self, Error> {
        let (toml, site) = (config.to_toml(), &config.site);
        let recording = RecordingWriter::create(&part(path), &toml, site, args.clouds)?;
        let clouds = args.clouds.then(|| Assembler::new(site)).transpose()?;
        let mut paths = vec![path.to_owned()];
        let wanted = args.packets == Some(Packets::Pcap);
        let captures = wanted.then(|| Captures::create(path, site, &mut paths)).transpose()?;
        Ok(Self { recording, clouds, captures, paths })
    }

    pub fn packets(&mut self, time_ns: i64, packets: &[Vec<Packet>]) -> Result<(), Error> {
        self.recording.write_packets(time_ns, packets)?;
        if let Some(captures) = &mut self.captures {
            captures.write(packets)?;
        }
        if let Some(assembler) = &mut self.clouds {
            chain::push(assembler, packets, &mut Health::default());
            while let Some(frame) = assembler.pop() {
                self.recording.write_clouds(&frame)?;
            }
        }
        Ok(())
    }

    pub fn truth(&mut self, time_ns: i64, frame: u64, truth: &SceneTruth) -> Result<(), Error> {
        self.recording.write_truth(time_ns, frame, &truth.people, &truth.links)
    }

    pub fn finish(mut self) -> Result<(), Error> {
        if let Some(assembler) = &mut self.clouds {
            assembler.finish();
            while let Some(frame) = assembler.pop() {
                self.recording.write_clouds(&frame)?;
            }
        }
        self.recording.finish()?;
        self.captures.map_or(Ok(()), Captures::finish)?;
        for path in &self.paths {
            fs::rename(part(path), path).map_err(|e| Error::new(e.to_string()).within(path.display()))?;
        }
        Ok(())
    }
}

/// What a file is called until it is whole.
fn part(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// One capture of all sensors, or one for each where a reader could not tell them apart.
struct Captures {
    files: Vec<(PathBuf, PcapWriter<BufWriter<File>>)>,
    /// By sensor: its file, the address it sends from, and the port it sends to.
    sensors: Vec<(usize, [u8; 4], u16)>,
}

impl Captures {
    fn create(recording: &Path, site: &Site, paths: &mut Vec<PathBuf>) -> Result<Self, Error> {
        let together = input::can_share_a_capture(site);
        let (mut files, mut sensors) = (Vec::new(), Vec::new());
        for (number, sensor) in site.sensors.iter().enumerate() {
            if number == 0 || !together {
                let stem = recording.file_stem().unwrap_or_default().to_string_lossy();
                let own = if together {
                    String::new()
                } else {
                    format!("-{}", recording::topic_of(site, number).replace(['/', ' '], "_"))
                };
                let path = recording.with_file_name(format!("{stem}{own}.pcap"));
                let file = File::create(part(&path)).and_then(|file| PcapWriter::new(BufWriter::new(file)));
                let file = file.map_err(|e| Error::new(e.to_string()).within(path.display()))?;
                files.push((path.clone(), file));
                paths.push(path);
            }
            let from = sensor.address_bytes().unwrap_or([192, 168, 1, 201_u8.saturating_add(number as u8)]);
            sensors.push((files.len() - 1, from, udp_port(sensor).unwrap_or_default()));
        }
        Ok(Self { files, sensors })
    }

    /// A frame's packets, in the order of their times.
    fn write(&mut self, packets: &[Vec<Packet>]) -> Result<(), Error> {
        let of_sensor = |(packets, to): (&'_ Vec<Packet>, &(usize, [u8; 4], u16))| {
            let to = *to;
            packets.iter().map(move |packet| (to, packet.clone())).collect::<Vec<_>>()
        };
        let mut all: Vec<_> = packets.iter().zip(&self.sensors).flat_map(of_sensor).collect();
        all.sort_by_key(|(_, packet)| packet.time_ns);
        for ((file, from, port), Packet { time_ns, payload }) in all {
            let (path, file) = &mut self.files[file];
            let written = file.write(&Datagram { time_ns, from, port, payload });
            written.map_err(|e| Error::new(e.to_string()).within(path.display()))?;
        }
        Ok(())
    }

    fn finish(self) -> Result<(), Error> {
        for (path, file) in self.files {
            file.finish().map_err(|e| Error::new(e.to_string()).within(path.display()))?;
        }
        Ok(())
    }
}
