//! A whole scene: crowd, bodies, sensors and truth, frame by frame.

use std::sync::Arc;

use rand::Rng;
use umbracast::lidar::Packet;
use umbracast::{Error, STEP_NS, Site};

use crate::body::Bodies;
use crate::body::{PersonState, Walker};
use crate::crowd::{Crowd, Trajectory};
use crate::random::stream;
use crate::sensor::Sensors;
use crate::truth::{LinkTruth, Truth};

/// One frame: what the sensors sent during it, and the truth at its end.
#[derive(Debug, Clone)]
pub struct SceneFrame {
    /// Counts from 0.
    pub index: u64,
    /// The frame's end: (index + 1) x 100 ms.
    pub time_ns: i64,
    /// The packets of each sensor of the site; empty without sensors.
    pub packets: Vec<Vec<Packet>>,
    /// Everybody in the scene, arrived ones too.
    pub people: Vec<PersonTruth>,
    /// Every link, access points first.
    pub links: Vec<LinkTruth>,
}

/// One person at the end of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonTruth {
    /// Whose.
    pub person: u32,
    /// Place, speed, heading and height.
    pub state: PersonState,
    /// Came within 1 m of the goal; the body stays.
    pub arrived: bool,
    /// Points on this body during the frame, all sensors; 0 without sensors.
    pub returns: u32,
}

/// Simulates a scene. The same crowd, site and seed give the same frames, byte for byte.
#[derive(Debug)]
pub struct Scene {
    site: Site,
    seed: u64,
    walkers: Vec<Walker>,
    sensors: Option<Sensors>,
    truth: Truth,
    frames: u64,
    next: u64,
}

impl Scene {
    /// A crowd with bodies in a hall with sensors, each of which works until the site lets it fall silent.
    ///
    /// # Errors
    /// A sensor that cannot be simulated.
    pub fn new(crowd: Crowd, site: &Site, seed: u64) -> Result<Self, Error> {
        Ok(Self::in_hall(crowd, site, &Sensors::new(site, seed)?, seed))
    }

    /// The same scene as [`Scene::new`] makes, in a hall that is traced already: `sensors` are those of the site,
    /// whatever their seed.
    pub fn in_hall(crowd: Crowd, site: &Site, sensors: &Sensors, seed: u64) -> Self {
        let mut sensors = sensors.clone();
        sensors.restart(stream(seed, "sensors", 0).next_u64());
        for (number, sensor) in site.sensors.iter().enumerate() {
            if let Some(seconds) = site.simulation.lost_after_s.get(&sensor.name) {
                sensors.power(number, 0..(seconds * 1e9) as i64);
            }
        }
        Self { sensors: Some(sensors), ..Self::truth_only(crowd, site, seed) }
    }

    /// The same people without sensors: no packets and no returns, for training and the ladder of oracles.
    pub fn truth_only(crowd: Crowd, site: &Site, seed: u64) -> Self {
        let frames = (crowd.duration_ns / STEP_NS).max(0) as u64;
        let hall = Arc::new(site.hall.clone());
        let body =
            |(number, way): (usize, Trajectory)| Walker::new(way, own_seed(seed, number)).on_floor_of(&hall);
        Self {
            site: site.clone(),
            seed,
            walkers: crowd.trajectories.into_iter().enumerate().map(body).collect(),
            sensors: None,
            truth: Truth::default(),
            frames,
            next: 0,
        }
    }

    /// The same ways, walked by these bodies. Before the first frame.
    #[must_use]
    pub fn with_bodies(mut self, bodies: &Bodies) -> Self {
        if !bodies.is_plain() {
            let hall = Arc::new(self.site.hall.clone());
            for (number, walker) in self.walkers.iter_mut().enumerate() {
                let body = bodies.walker(walker.trajectory.clone(), own_seed(self.seed, number));
                *walker = body.on_floor_of(&hall);
            }
        }
        self
    }

    /// The same scene from frame `index` on, as if what was before had been seen by nobody. Before the first frame.
    #[must_use]
    pub fn starting_at(mut self, index: u64) -> Self {
        self.next = index;
        self
    }

    /// Goes on with the people of `next`, whose time goes on where this scene's ends: sensors, noise and the count of
    /// frames are this scene's.
    pub fn go_on(&mut self, next: Self) {
        self.walkers = next.walkers;
        self.frames = next.frames;
    }

    /// The packets of `frames` revolutions in the hall without people: one list a frame, in it one a sensor.
    ///
    /// # Errors
    /// A sensor that cannot be simulated.
    pub fn empty(site: &Site, seed: u64, frames: u64) -> Result<Vec<Vec<Vec<Packet>>>, Error> {
        // Noise of its own: that of a scene with the same seed must not be in the background it is seen against.
        let mut sensors = Sensors::new(site, stream(seed, "empty hall", 0).next_u64())?;
        Ok((0..frames).map(|index| sensors.frame(index, &[]).0).collect())
    }

    /// The bodies, in order of person.
    pub fn walkers(&self) -> &[Walker] {
        &self.walkers
    }

    /// How many frames the scene has.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The next frame, or `None` after the last.
    pub fn next_frame(&mut self) -> Option<SceneFrame> {
        let index = self.next;
        if index >= self.frames {
            return None;
        }
        self.next += 1;
        let time_ns = (index as i64 + 1) * STEP_NS;
        let (packets, returns) = match &mut self.sensors {
            Some(sensors) => sensors.frame(index, &self.walkers),
            None => (Vec::new(), vec![0; self.walkers.len()]),
        };
        let person = |(walker, returns): (&Walker, u32)| {
            Some(PersonTruth {
                person: walker.trajectory.person,
                state: walker.state_at(time_ns)?,
                arrived: walker.trajectory.arrived_ns.is_some_and(|arrived| arrived <= time_ns),
                returns,
            })
        };
        let people = self.walkers.iter().zip(returns).filter_map(person).collect();
        let links = self.truth.links(&self.site, &self.walkers, time_ns);
        Some(SceneFrame { index, time_ns, packets, people, links })
    }
}

/// Of a person's body: by the place in the crowd, whatever number a recording gives.
fn own_seed(scene_seed: u64, number: usize) -> u64 {
    stream(scene_seed, "body", number as u64).next_u64()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::kind::Kind;
    use umbracast::Config;
    use umbracast::geometry::DVec2;

    /// Two people who cross, one of whom arrives after a second.
    fn crowd() -> Crowd {
        let way = |person: u32, from: DVec2, step: DVec2| Trajectory {
            person,
            start_ns: 0,
            step_ns: 10_000_000,
            positions_m: (0..=200).map(|i| from + step * f64::from(i)).collect(),
            arrived_ns: (person == 1).then_some(1_000_000_000),
            height_m: None,
        };
        let people = [
            way(0, DVec2::new(-1.0, 0.0), DVec2::new(0.01, 0.0)),
            way(1, DVec2::new(0.0, -1.0), DVec2::new(0.0, 0.01)),
        ];
        Crowd { trajectories: people.to_vec(), duration_ns: 2_000_000_000 }
    }

    #[test]
    fn frames_close_every_hundred_milliseconds_with_truth_at_their_end() {
        let site = Config::default().site;
        let mut scene = Scene::truth_only(crowd(), &site, 7);
        let frames: Vec<SceneFrame> = std::iter::from_fn(|| scene.next_frame()).collect();
        assert_eq!(frames.len(), 20);
        assert_eq!((frames[4].index, frames[4].time_ns), (4, 500_000_000));
        assert!((frames[4].people[0].state.position_m - DVec2::new(-0.5, 0.0)).length() < 1e-9);
        assert_eq!(frames[4].links.len(), 2 * site.access_points.len());
        let arrived = |k: usize| frames[k].people[1].arrived;
        assert!(!arrived(8) && arrived(9) && frames[19].people.len() == 2);
    }

    #[test]
    fn a_hall_traced_once_serves_every_scene() {
        let site = Config::default().site;
        let sensors = Sensors::new(&site, 1).unwrap();
        let packets = |scene: &mut Scene| scene.next_frame().map(|frame| frame.packets);
        for seed in [7, 8] {
            let mut alone = Scene::new(crowd(), &site, seed).unwrap();
            assert!(
                packets(&mut alone) == packets(&mut Scene::in_hall(crowd(), &site, &sensors, seed)),
                "{seed}"
            );
        }
    }

    #[test]
    fn a_sensor_that_the_site_loses_falls_silent_and_is_there_in_the_empty_hall() {
        let mut site = Config::default().site;
        site.simulation.lost_after_s.insert(site.sensors[1].name.clone(), 0.15);
        let mut scene = Scene::new(crowd(), &site, 7).unwrap();
        let frames: Vec<SceneFrame> = (0..3).filter_map(|_| scene.next_frame()).collect();
        let sent = |sensor: usize| -> Vec<usize> { frames.iter().map(|f| f.packets[sensor].len()).collect() };
        assert!(sent(0).iter().all(|&packets| packets > 170), "{:?}", sent(0));
        assert!(sent(1)[0] > 170 && (80..100).contains(&sent(1)[1]) && sent(1)[2] == 0, "{:?}", sent(1));
        assert!(Scene::empty(&site, 7, 3).unwrap().iter().all(|packets| packets[1].len() > 170));
    }

    #[test]
    fn what_is_put_in_is_there_from_its_time_on() {
        let mut site = Config::default().site;
        let before = Scene::empty(&site, 7, 3).unwrap();
        let furniture =
            vec![umbracast::site::Furniture { position_m: [0.0; 2], size_m: [7.0, 2.5, 3.0], yaw_deg: 0.0 }];
        site.simulation.put_in = Some(umbracast::site::PutIn { after_s: 0.2, furniture });
        let with = Scene::empty(&site, 7, 3).unwrap();
        assert_eq!([0, 1, 2].map(|k| before[k] == with[k]), [true, true, false]);
    }

    #[test]
    fn a_scene_that_goes_on_misses_no_packet() {
        let site = Config::default().site;
        let later = |by_s: i64| crowd().later(by_s * 1_000_000_000);
        let mut scene = Scene::new(crowd(), &site, 7).unwrap();
        let mut sent = Vec::new();
        for by_s in [2, 4] {
            sent.extend(std::iter::from_fn(|| scene.next_frame()));
            scene.go_on(Scene::truth_only(later(by_s), &site, 7));
        }
        assert_eq!(sent.iter().map(|frame| frame.index).collect::<Vec<_>>(), (0..40).collect::<Vec<_>>());
        assert!(sent.iter().all(|frame| frame.people.len() == 2));
        let times_ns: Vec<i64> = sent.iter().flat_map(|frame| &frame.packets[0]).map(|p| p.time_ns).collect();
        let longest_ns = times_ns.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert!(longest_ns < Some(1_000_000), "{longest_ns:?} between two packets");
    }

    #[test]
    fn the_same_seed_gives_the_same_truth_and_another_seed_other_bodies() {
        let site = Config::default().site;
        let run = |seed: u64| {
            let mut scene = Scene::truth_only(crowd(), &site, seed);
            std::iter::from_fn(|| scene.next_frame()).map(|f| (f.people, f.links)).collect::<Vec<_>>()
        };
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
    }

    #[test]
    fn bodies_change_who_walks_and_not_where() {
        let site = Config::default().site;
        let run = |bodies: Bodies| {
            let mut scene = Scene::truth_only(crowd(), &site, 7).with_bodies(&bodies);
            scene.next_frame().unwrap().people
        };
        let plain = run(Bodies::default());
        let children = run(Bodies::new(vec![(Kind::Child, 1.0)], None).unwrap());
        for (adult, child) in plain.iter().zip(&children) {
            assert_eq!(adult.state.position_m, child.state.position_m);
            assert!(child.state.height_m < adult.state.height_m);
        }
        let handsfree = run(Bodies::new(vec![(Kind::Pockets, 1.0)], None).unwrap());
        assert_eq!(plain, handsfree, "the same measures and the same gait");
    }
}
