//! Legs: a minute or so each of what sensors send while people come, do what they came for, and leave. They are simulated once
//! and kept in files, and [`super::play`] plays them one after the other.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use umbracast::geometry::DVec2;
use umbracast::lidar::{Assembler, Packet};
use umbracast::{Config, Error, Frame, Health, STEP_NS};
use umbracast_live::receive::Arrived;
use umbracast_sim::body::Bodies;
use umbracast_sim::body::kind::Kind;
use umbracast_sim::crowd::Crowd;
use umbracast_sim::scene::{PersonTruth, Scene, SceneFrame};
use umbracast_sim::sensor::Sensors;

use super::crowd;
use super::halls::{HALLS, Hall};

pub const SEED: u64 = 100_000;
/// Of each hall.
const LEGS: usize = 3;
/// Frames of the empty hall.
const EMPTY: u64 = 20;
const BUFFER_BYTES: usize = 1 << 20;
/// What people are and have. Whoever may sit walks plainly elsewhere.
const SHARES: [(Kind, f64); 7] = [
    (Kind::Sitting, 0.56),
    (Kind::Bag, 0.12),
    (Kind::Phone, 0.1),
    (Kind::Rucksack, 0.08),
    (Kind::Screen, 0.06),
    (Kind::Umbrella, 0.04),
    (Kind::Child, 0.04),
];
/// Halfway through a leg whoever sits does.
const HALFWAY_NS: i64 = 30_000_000_000;
/// A head sinks so far when its owner sits down.
const SUNK_M: f64 = 0.2;
const ATTEMPTS: u64 = 1000;

/// A frame of a leg.
#[derive(Debug, Default)]
pub struct LegFrame {
    /// Everybody at its end: number in the leg, and place.
    pub people: Vec<(u16, DVec2)>,
    /// In order of time, which begins at 0 with the leg.
    pub packets: Vec<Arrived>,
}

/// The file of a leg.
pub fn file(folder: &Path, hall: usize, number: usize) -> PathBuf {
    folder.join(format!("leg-{hall}-{number}"))
}

fn empty_file(folder: &Path) -> PathBuf {
    folder.join("empty")
}

/// Numbers of a hall's legs.
pub fn numbers() -> std::ops::Range<usize> {
    0..LEGS
}

/// Simulates all of them into a folder, and says what there is.
///
/// # Errors
/// A folder that takes no files, a leg in which nobody sits.
pub fn simulate(folder: &Path) -> Result<(), Error> {
    let bodies = Bodies::new(SHARES.to_vec(), [])?;
    let (mut frames, mut bytes, mut came, mut present) = (0, 0, 0, 0);
    for state in 0..HALLS {
        let hall = Hall::of(state);
        let sensors = Sensors::new(&hall.site, SEED)?;
        for number in numbers() {
            let first = SEED + 1000 * (LEGS * state + number) as u64;
            let crowd = crowd::people(&hall, first)?;
            came += crowd.trajectories.len();
            let seed = (first..first + ATTEMPTS).find(|seed| all_sit(&hall, &crowd, &bodies, *seed));
            let seed = seed.ok_or_else(|| Error::new("a leg in which all sit: expected one, found none"))?;
            let mut scene = Scene::in_hall(crowd, &hall.site, &sensors, seed).with_bodies(&bodies);
            let file = file(folder, state, number);
            frames += scene.frames();
            let all = std::iter::from_fn(|| scene.next_frame());
            bytes += write(&file, all.inspect(|frame| present += frame.people.len()))?;
        }
    }
    let empty = Scene::empty(&Hall::of(0).site, SEED, EMPTY)?.into_iter().enumerate();
    let nobody = |(index, packets)| SceneFrame {
        index: index as u64,
        time_ns: (index as i64 + 1) * STEP_NS,
        packets,
        people: Vec::new(),
        links: Vec::new(),
    };
    write(&empty_file(folder), empty.map(nobody))?;
    println!(
        "{} legs of {:.0} s on the mean in {HALLS} halls; {:.1} people come in each, {:.1} are there at once; {:.1} GB in files\n",
        HALLS * LEGS,
        0.1 * frames as f64 / (HALLS * LEGS) as f64,
        came as f64 / (HALLS * LEGS) as f64,
        present as f64 / frames as f64,
        1e-9 * bytes as f64
    );
    Ok(())
}

/// Whether those who have a seat have bodies that sit down on it.
fn all_sit(hall: &Hall, crowd: &Crowd, bodies: &Bodies, seed: u64) -> bool {
    let scene = Scene::truth_only(crowd.clone(), &hall.site, seed).with_bodies(bodies);
    scene.walkers().iter().take(hall.seats_m.len()).all(|walker| {
        let state = walker.state_at(HALFWAY_NS);
        state.is_some_and(|state| state.height_m < walker.build.height_m() - SUNK_M)
    })
}

/// How many bytes were written.
fn write(file: &Path, frames: impl Iterator<Item = SceneFrame>) -> Result<u64, Error> {
    let failed = |e: std::io::Error| Error::new(e.to_string()).within(file.display());
    let mut out = BufWriter::with_capacity(BUFFER_BYTES, File::create(file).map_err(failed)?);
    let mut bytes = 0;
    for frame in frames {
        let encoded = encoded(&frame);
        bytes += encoded.len() as u64;
        out.write_all(&encoded).map_err(failed)?;
    }
    out.flush().map_err(failed)?;
    Ok(bytes)
}

/// How many people, each with number and place; how many packets, each with sensor, time, length and payload.
fn encoded(frame: &SceneFrame) -> Vec<u8> {
    let mut bytes = (frame.people.len() as u32).to_le_bytes().to_vec();
    for PersonTruth { person, state, .. } in &frame.people {
        bytes.extend((*person as u16).to_le_bytes());
        state.position_m.to_array().iter().for_each(|m| bytes.extend(m.to_le_bytes()));
    }
    let mut packets: Vec<(usize, &Packet)> =
        frame.packets.iter().enumerate().flat_map(|(s, all)| all.iter().map(move |p| (s, p))).collect();
    packets.sort_by_key(|(_, packet)| packet.time_ns);
    bytes.extend((packets.len() as u32).to_le_bytes());
    for (sensor, packet) in packets {
        bytes.push(sensor as u8);
        bytes.extend(packet.time_ns.to_le_bytes());
        bytes.extend((packet.payload.len() as u32).to_le_bytes());
        bytes.extend(&packet.payload);
    }
    bytes
}

/// A leg from its beginning.
pub struct Leg(BufReader<File>);

impl Leg {
    /// Opens a file.
    ///
    /// # Errors
    /// A file that is not there.
    pub fn open(file: &Path) -> Result<Self, Error> {
        let failed = |e: std::io::Error| Error::new(e.to_string()).within(file.display());
        Ok(Self(BufReader::with_capacity(BUFFER_BYTES, File::open(file).map_err(failed)?)))
    }

    /// The next frame; `None` at the end.
    pub fn next_frame(&mut self) -> Option<LegFrame> {
        let mut frame = LegFrame::default();
        for _ in 0..u32::from_le_bytes(self.take()?) {
            let person = u16::from_le_bytes(self.take()?);
            let place_m = DVec2::new(f64::from_le_bytes(self.take()?), f64::from_le_bytes(self.take()?));
            frame.people.push((person, place_m));
        }
        for _ in 0..u32::from_le_bytes(self.take()?) {
            let [sensor] = self.take()?;
            let time_ns = i64::from_le_bytes(self.take()?);
            let mut payload = vec![0; u32::from_le_bytes(self.take()?) as usize];
            self.0.read_exact(&mut payload).ok()?;
            frame.packets.push(Arrived { sensor: sensor.into(), packet: Packet { time_ns, payload } });
        }
        Some(frame)
    }

    fn take<const BYTES: usize>(&mut self) -> Option<[u8; BYTES]> {
        let mut bytes = [0; BYTES];
        self.0.read_exact(&mut bytes).ok().map(|()| bytes)
    }
}

/// The hall without people, as the program learns it.
///
/// # Errors
/// A file that is not there.
pub fn empty_frames(folder: &Path, config: &Config) -> Result<Vec<Frame>, Error> {
    let (mut assembler, mut health) = (Assembler::new(&config.site)?, Health::default());
    let mut leg = Leg::open(&empty_file(folder))?;
    while let Some(frame) = leg.next_frame() {
        frame.packets.iter().for_each(|a| assembler.push(a.sensor, &a.packet, &mut health));
    }
    assembler.finish();
    Ok(std::iter::from_fn(|| assembler.pop()).collect())
}
