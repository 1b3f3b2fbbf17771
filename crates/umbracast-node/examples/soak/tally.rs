//! Whether people are followed, and whether somebody is invented.

use std::collections::BTreeMap;

use umbracast::geometry::DVec2;

/// A track is somebody's within this, and nobody's beyond that.
const NEAR_M: f64 = 0.5;
const FAR_M: f64 = 1.0;
/// Who left is expected for so many frames: that long the track may outlast its person.
const OUTLASTS: u64 = 20;

/// Counts over frames.
#[derive(Debug, Default, Clone)]
pub struct Tally {
    pub frames: u64,
    /// People in the frames, and those of them who were followed.
    pub people: u64,
    pub followed: u64,
    /// Tracks in the frames that were somebody's a moment ago, and those that were nobody's.
    pub outlasting: u64,
    pub nobodys: u64,
    /// People who came.
    pub came: u64,
    /// The highest number that was given before, and until now.
    pub first_id: u64,
    pub last_id: u64,
    /// The last number of each who is there.
    of_person: BTreeMap<u64, u64>,
    /// For how many frames each track has been nobody's.
    alone: BTreeMap<u64, u64>,
    /// How often somebody's number changed.
    pub changes: u64,
}

impl Tally {
    /// Counts a frame: confirmed tracks by number, and everybody who is there.
    pub fn count(&mut self, tracks: &[(u64, DVec2)], people: &[(u64, DVec2)]) {
        self.frames += 1;
        self.people += people.len() as u64;
        let mut of_person = BTreeMap::new();
        for (person, at_m) in people {
            let nearest = tracks.iter().min_by(|a, b| a.1.distance(*at_m).total_cmp(&b.1.distance(*at_m)));
            let own = nearest.filter(|(_, track_m)| track_m.distance(*at_m) < NEAR_M).map(|(id, _)| *id);
            self.followed += u64::from(own.is_some());
            let before = self.of_person.get(person).copied();
            self.came += u64::from(before.is_none());
            self.changes += u64::from(matches!((before, own), (Some(a), Some(b)) if a != 0 && a != b));
            of_person.insert(*person, own.or(before).unwrap_or(0));
        }
        self.of_person = of_person;
        let is_nobodys =
            |track: &&(u64, DVec2)| people.iter().all(|(_, at_m)| at_m.distance(track.1) >= FAR_M);
        // One that was never anybody's has been nobody's for longer than that.
        let since = |id: u64| self.alone.get(&id).copied().unwrap_or(OUTLASTS) + 1;
        let alone: BTreeMap<u64, u64> = tracks
            .iter()
            .map(|track| (track.0, if is_nobodys(&track) { since(track.0) } else { 0 }))
            .collect();
        self.outlasting += alone.values().filter(|frames| (1..=OUTLASTS).contains(*frames)).count() as u64;
        self.nobodys += alone.values().filter(|frames| **frames > OUTLASTS).count() as u64;
        self.alone = alone;
        self.last_id = tracks.iter().map(|(id, _)| *id).fold(self.last_id, u64::max);
    }

    /// From zero, with those who are there.
    pub fn followed_on(&self) -> Self {
        let (first_id, last_id) = (self.last_id, self.last_id);
        let (of_person, alone) = (self.of_person.clone(), self.alone.clone());
        Self { first_id, last_id, of_person, alone, ..Self::default() }
    }

    /// People at once, on the mean.
    pub fn at_once(&self) -> f64 {
        self.people as f64 / self.frames.max(1) as f64
    }

    /// Share of them who are followed.
    pub fn share_followed(&self) -> f64 {
        self.followed as f64 / self.people.max(1) as f64
    }

    /// Seconds of tracks that outlasted their person.
    pub fn outlasting_s(&self) -> f64 {
        0.1 * self.outlasting as f64
    }

    /// Seconds of tracks that were nobody's.
    pub fn nobodys_s(&self) -> f64 {
        0.1 * self.nobodys as f64
    }

    /// Numbers that were given.
    pub fn given(&self) -> u64 {
        self.last_id - self.first_id
    }
}
