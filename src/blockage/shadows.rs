//! Who can come between an access point and whom, before any sample is looked at.
//!
//! Seen from the access point everybody covers some sectors of a turn within the next second: as a body that hides, and
//! as one whose link may be hidden. Only pairs that share a sector are compared, first over the whole second, then step
//! by step. All of it errs on the side of asking the samples, so nothing is lost.

use std::f64::consts::{PI, TAU};

use super::figure::Band;
use super::trajectories::{Disc, MOMENTS, Trajectories};
use crate::geometry::{DVec2, DVec3};
use crate::site::Ue;

/// A body at ten metres covers about five.
const SECTORS: usize = 128;
/// Rounding lies below: metres, and shares of a height.
const ROOM: f64 = 1e-6;

/// A body that may stand in the way of a link at a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting {
    /// Whose body.
    pub(super) other: u32,
    pub(super) step: u32,
    /// Where on the body, as shares of its height.
    pub(super) band: Band,
    /// Square of how far the middle of the body's samples is from the middle ray.
    off_m2: f64,
}

/// Shadows of everybody's bodies, seen from one access point.
#[derive(Debug, Clone, Default)]
pub(super) struct Shadows {
    ap_m: DVec3,
    ue_reach_m: f64,
    ue_height_share: f64,
    /// Sectors that each person's body covers.
    covered: Vec<Sectors>,
    /// Where each sector's bodies begin in `bodies`, and one past the last.
    starts: Vec<u32>,
    bodies: Vec<u32>,
    /// The last link that a body was compared with.
    compared: Vec<u32>,
    candidates: Vec<u32>,
}

/// So many from the first on, round the turn.
#[derive(Debug, Clone, Copy)]
struct Sectors {
    first: usize,
    count: usize,
}

impl Sectors {
    /// Those in which something within `disc` is seen.
    fn of(disc: Disc, ap_m: DVec2) -> Self {
        let off_m = disc.center_m - ap_m;
        let (distance_m, radius_m) = (off_m.length(), disc.radius_m + ROOM);
        if distance_m <= radius_m {
            return Self { first: 0, count: SECTORS };
        }
        let half_rad = (radius_m / distance_m).asin();
        let sector = |rad: f64| ((rad + PI) * (SECTORS as f64 / TAU)).floor() as i32;
        let middle_rad = off_m.to_angle();
        let (first, last) = (sector(middle_rad - half_rad), sector(middle_rad + half_rad));
        let count = ((last - first + 1) as usize).min(SECTORS);
        Self { first: first.rem_euclid(SECTORS as i32) as usize, count }
    }

    fn each(self) -> impl Iterator<Item = usize> {
        (self.first..self.first + self.count).map(|sector| sector % SECTORS)
    }
}

impl Shadows {
    /// Looks at everybody from an access point.
    pub(super) fn fall(&mut self, ap_m: DVec3, ue: &Ue, people: &[Trajectories]) {
        self.ap_m = ap_m;
        self.ue_reach_m = ue.forward_m.abs() + ue.left_m.abs();
        self.ue_height_share = ue.height_share;
        self.covered.clear();
        self.covered.extend(people.iter().map(|p| Sectors::of(wider(p.second, p.reach_m), ap_m.truncate())));
        self.compared.clear();
        self.compared.resize(people.len(), u32::MAX);
        self.starts.clear();
        self.starts.resize(SECTORS + 1, 0);
        for sector in self.covered.iter().flat_map(|covered| covered.each()) {
            self.starts[sector + 1] += 1;
        }
        for sector in 0..SECTORS {
            self.starts[sector + 1] += self.starts[sector];
        }
        self.bodies.clear();
        self.bodies.resize(self.starts[SECTORS] as usize, 0);
        // Each sector is filled from its end on, and its start with it moves to its place.
        for (person, covered) in self.covered.iter().enumerate().rev() {
            for sector in covered.each() {
                self.starts[sector + 1] -= 1;
                self.bodies[self.starts[sector + 1] as usize] = person as u32;
            }
        }
        self.starts.rotate_left(1);
        self.starts[SECTORS] = self.bodies.len() as u32;
    }

    /// Adds everybody who may stand in the way of a person's link, step after step.
    pub(super) fn meet(&mut self, people: &[Trajectories], person: usize, meetings: &mut Vec<Meeting>) {
        let q = &people[person];
        self.candidates.clear();
        for sector in Sectors::of(wider(q.second, self.ue_reach_m), self.ap_m.truncate()).each() {
            for &other in &self.bodies[self.starts[sector] as usize..self.starts[sector + 1] as usize] {
                let compared = &mut self.compared[other as usize];
                if *compared != person as u32 {
                    *compared = person as u32;
                    self.candidates.push(other);
                }
            }
        }
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.retain(|&other| {
            let p = &people[other as usize];
            other as usize != person && self.band(q, q.second, p, p.second).is_some()
        });
        for step in 0..MOMENTS {
            let first = meetings.len();
            for &other in &candidates {
                let p = &people[other as usize];
                if let Some((band, off_m2)) = self.band(q, q.discs[step], p, p.discs[step]) {
                    meetings.push(Meeting { other, step: step as u32, band, off_m2 });
                }
            }
            // Who stands nearest to the line blocks most, and what is blocked is not asked again.
            meetings[first..]
                .sort_unstable_by(|a, b| a.off_m2.total_cmp(&b.off_m2).then(a.other.cmp(&b.other)));
        }
        self.candidates = candidates;
    }

    /// The heights at which rays to `q` within `q_disc` may meet the body of `p` within `p_disc`, and the square of how far
    /// apart the middles are; `None` where none can.
    fn band(&self, q: &Trajectories, q_disc: Disc, p: &Trajectories, p_disc: Disc) -> Option<(Band, f64)> {
        let start = self.ap_m.truncate();
        let (along, off) = (q_disc.center_m - start, p_disc.center_m - start);
        let length2 = along.length_squared().max(1e-12);
        let t = (off.dot(along) / length2).clamp(0.0, 1.0);
        let reach = p.reach_m + self.ue_reach_m + p_disc.radius_m + q_disc.radius_m + ROOM;
        let off_m2 = off.distance_squared(along * t);
        let room2 = reach * reach - off_m2;
        if room2 < 0.0 {
            return None;
        }
        // So far along, as a share of the ray, a body is met at most; the ray is highest and lowest at one end of that
        // stretch, towards the highest or lowest UE.
        let slack = (room2 / length2).sqrt();
        let (near, far) = ((t - slack).max(0.0), (t + slack).min(1.0));
        let rises_m = [q.height_min_m, q.height_max_m].map(|h| self.ue_height_share * h - self.ap_m.z);
        let rises_m = rises_m.map(|rise_m| [near * rise_m, far * rise_m]);
        let of_all =
            |fold: fn(f64, f64) -> f64| rises_m.into_iter().flatten().reduce(fold).unwrap_or_default();
        let (low_m, high_m) = (self.ap_m.z + of_all(f64::min), self.ap_m.z + of_all(f64::max));
        let per =
            |height_m: f64, [tall, short]: [f64; 2]| height_m / if height_m > 0.0 { tall } else { short };
        let band = Band {
            low: per(low_m, [p.height_max_m, p.height_min_m]) - ROOM,
            high: per(high_m, [p.height_min_m, p.height_max_m]) + ROOM,
        };
        (band.low <= 1.0).then_some((band, off_m2))
    }
}

fn wider(disc: Disc, by_m: f64) -> Disc {
    Disc { radius_m: disc.radius_m + by_m, ..disc }
}
