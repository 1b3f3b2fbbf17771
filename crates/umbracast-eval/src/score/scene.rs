//! The rows of one scene, with an index of its truth.

use std::collections::BTreeMap;

use umbracast_io::rows::{LinkRow, PeopleLinkRow, PeopleRow, TrackRow};
use umbracast_sim::scene::SceneFrame;

use crate::score::fingerprint::fingerprint;

/// What was so: the tables `people` and `people_links` of one scene, in any order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SceneTruth {
    /// Every body in every frame.
    pub people: Vec<PeopleRow>,
    /// Every link in every frame.
    pub links: Vec<PeopleLinkRow>,
}

/// What we said: the tables `tracks` and `links` of one scene, in any order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SceneRun {
    /// Every track in every frame.
    pub tracks: Vec<TrackRow>,
    /// Every link of a confirmed track in every frame.
    pub links: Vec<LinkRow>,
}

/// The rows of a frame's truth.
pub fn note_truth(scene: u32, frame: &SceneFrame, truth: &mut SceneTruth) {
    let (number, time_ns) = (frame.index, frame.time_ns);
    truth.people.extend(frame.people.iter().map(|p| PeopleRow {
        scene,
        frame: number,
        time_ns,
        person: p.person,
        x_m: p.state.position_m.x,
        y_m: p.state.position_m.y,
        vx_mps: p.state.velocity_mps.x,
        vy_mps: p.state.velocity_mps.y,
        heading_rad: p.state.heading_rad,
        height_m: p.state.height_m,
        arrived: p.arrived,
        returns: p.returns,
    }));
    truth.links.extend(frame.links.iter().map(|link| PeopleLinkRow {
        scene,
        frame: number,
        time_ns,
        access_point: link.access_point as u32,
        person: link.person,
        blocked: link.blocked,
        static_blocked: link.static_blocked,
        self_blocked: link.self_blocked,
    }));
}

/// Which track is a person's, by (frame, person): at most one, and no track twice in a frame.
pub type Matching = BTreeMap<(u64, u32), u64>;

/// The truth by frame, person and access point.
#[derive(Debug)]
pub struct TruthIndex<'a> {
    /// The frames with truth, ascending.
    pub frames: Vec<u64>,
    /// Who appears, ascending.
    pub persons: Vec<u32>,
    /// Which access points appear, ascending.
    pub access_points: Vec<u32>,
    people: Vec<Option<&'a PeopleRow>>,
    links: Vec<Option<&'a PeopleLinkRow>>,
}

impl<'a> TruthIndex<'a> {
    /// Lays the rows out.
    pub fn new(truth: &'a SceneTruth) -> Self {
        let frames = ascending(truth.people.iter().map(|r| r.frame));
        let persons = ascending(truth.people.iter().map(|r| r.person));
        let access_points = ascending(truth.links.iter().map(|r| r.access_point));
        let mut index = Self {
            people: vec![None; frames.len() * persons.len()],
            links: vec![None; frames.len() * persons.len() * access_points.len()],
            frames,
            persons,
            access_points,
        };
        for row in &truth.people {
            if let Some(at) = index.place(row.frame, row.person) {
                index.people[at] = Some(row);
            }
        }
        for row in &truth.links {
            if let Some(at) = index.link_place(row.frame, row.person, row.access_point) {
                index.links[at] = Some(row);
            }
        }
        index
    }

    /// A person in a frame, or `None` while not in the scene.
    pub fn person(&self, frame: u64, person: u32) -> Option<&'a PeopleRow> {
        self.place(frame, person).and_then(|at| self.people[at])
    }

    /// A person's link in a frame.
    pub fn link(&self, frame: u64, person: u32, access_point: u32) -> Option<&'a PeopleLinkRow> {
        self.link_place(frame, person, access_point).and_then(|at| self.links[at])
    }

    /// Everybody in a frame, by person.
    pub fn people_of(&self, frame: u64) -> impl Iterator<Item = &'a PeopleRow> + '_ {
        self.persons.iter().filter_map(move |&person| self.person(frame, person))
    }

    /// A fingerprint of everybody's trajectory: the same for two scenes exactly when they replay one recording (or
    /// draw), however their bodies, sensors and noise differ.
    pub fn recording(&self) -> u64 {
        let people = self.frames.iter().flat_map(|&frame| self.people_of(frame));
        let places = people.flat_map(|row| {
            [row.frame, u64::from(row.person), row.x_m.to_bits(), row.y_m.to_bits()].map(u64::to_le_bytes)
        });
        fingerprint(&[places.collect::<Vec<_>>().as_flattened()])
    }

    fn place(&self, frame: u64, person: u32) -> Option<usize> {
        let k = self.frames.binary_search(&frame).ok()?;
        let person = self.persons.binary_search(&person).ok()?;
        Some(k * self.persons.len() + person)
    }

    fn link_place(&self, frame: u64, person: u32, access_point: u32) -> Option<usize> {
        let ap = self.access_points.binary_search(&access_point).ok()?;
        self.place(frame, person).map(|at| ap * self.frames.len() * self.persons.len() + at)
    }
}

fn ascending<T: Ord>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut values: Vec<T> = values.collect();
    values.sort_unstable();
    values.dedup();
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::truth_of;

    #[test]
    fn scenes_of_the_same_trajectories_are_one_recording_whoever_is_blocked() {
        let recording = |truth: &SceneTruth| TruthIndex::new(truth).recording();
        let (mut again, mut another) = (truth_of(2, 20, |_, _| true), truth_of(2, 20, |_, _| true));
        again.people.iter_mut().for_each(|row| (row.height_m, row.returns) = (1.9, 3));
        again.people.reverse();
        another.people[7].x_m += 1e-9;
        let first = recording(&truth_of(2, 20, |_, _| false));
        assert_eq!(recording(&again), first);
        assert_ne!(recording(&another), first);
        assert_ne!(recording(&truth_of(2, 21, |_, _| false)), first);
    }
}
