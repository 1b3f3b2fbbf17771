//! A hall with people for the examples: simulated sensors in place of a socket, and the truth to compare with.

use umbracast::lidar::{Assembler, Frame, Packet};
use umbracast::{Error, Health, Site};
use umbracast_sim::crowd::{Crowd, Preset, circle_crossing};
use umbracast_sim::scene::{Scene, SceneFrame};

/// What the sensors see of the hall, first without people, then with people who cross a circle; and what was so.
pub struct Recording {
    pub empty: Vec<Frame>,
    pub frames: Vec<Frame>,
    pub truth: Vec<SceneFrame>,
}

/// Of everything drawn: a tuning scene.
const SEED: u64 = 100_000;

/// `people` start on a circle of this radius. Frame `k` of `frames` and of `truth` are of the same tenth of a second.
pub fn crossing(site: &Site, people: usize, radius_m: f64, frames: usize) -> Result<Recording, Error> {
    walking(site, circle_crossing(Preset::Orca03, people, radius_m, SEED), frames)
}

/// The same of a crowd of one's own.
#[allow(dead_code)] // Of the examples none has one; the benchmarks do.
pub fn walking(site: &Site, crowd: Crowd, frames: usize) -> Result<Recording, Error> {
    let mut scene = Scene::new(crowd, site, SEED)?;
    let mut truth: Vec<SceneFrame> = std::iter::from_fn(|| scene.next_frame()).take(frames).collect();
    let packets = truth.iter_mut().map(|frame| std::mem::take(&mut frame.packets)).collect();
    let empty = assembled(site, Scene::empty(site, SEED, 20)?)?;
    Ok(Recording { empty, frames: assembled(site, packets)?, truth })
}

/// One list of packets a frame, in it one a sensor: as they would arrive, by time.
fn assembled(site: &Site, packets: Vec<Vec<Vec<Packet>>>) -> Result<Vec<Frame>, Error> {
    let mut assembler = Assembler::new(site)?;
    let mut health = Health::default();
    for of_sensors in packets {
        let sensors = of_sensors.into_iter().enumerate();
        let mut arriving: Vec<(usize, Packet)> =
            sensors.flat_map(|(sensor, packets)| packets.into_iter().map(move |p| (sensor, p))).collect();
        arriving.sort_by_key(|(_, packet)| packet.time_ns);
        arriving.iter().for_each(|(sensor, packet)| assembler.push(*sensor, packet, &mut health));
    }
    assembler.finish();
    Ok(std::iter::from_fn(|| assembler.pop()).collect())
}
