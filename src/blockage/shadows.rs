//! Who can come between an access point and whom, before any sample is looked at.
//!
//! Seen from the access point everybody covers some sectors of a turn within the next second: as a body that hides, and
//! as one whose link may be hidden. Only pairs that share a sector are compared, first over the whole second, then step
//! by step. All of it errs on the side of asking the samples, so nothing is lost.

use std::f64::consts::{PI, TAU};

use super::figure::{Band, Figure};
use super::spread::Spread;
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
    /// Where on the body, as shares of its height,
    pub(super) band: Band,
    /// whether all that is between the floor and everybody's head,
    pub(super) holds: bool,
    /// what of it is there, by number,
    pub(super) plan: u32,
    /// and how far from the body's position that reaches.
    pub(super) reach_m: f32,
    /// How far the middle of the body's samples is from the middle ray.
    off_m: f32,
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
    #[inline(always)]
    pub(super) fn meet(
        &mut self,
        figure: &Figure,
        people: &[Trajectories],
        person: usize,
        meetings: &mut Vec<Meeting>,
    ) {
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
        let second = Bundle::of_second(self.ap_m, q, self.ue_reach_m);
        self.candidates.retain(|&other| {
            let p = &people[other as usize];
            let radius_m = p.second.radius_m;
            let around = Around { center_m: p.second.center_m, reach_m: p.reach_m + radius_m, spread: None };
            other as usize != person && second.share(&around).is_some()
        });
        let rises_m = q.heights_m.map(|height_m| self.ue_height_share * height_m - self.ap_m.z);
        for step in 0..MOMENTS {
            let first = meetings.len();
            let bundle = Bundle::of_step(self.ap_m, q, step, self.ue_reach_m);
            for &other in &self.candidates {
                let p = &people[other as usize];
                let around =
                    |reach_m| Around { center_m: p.mean_m[step], reach_m, spread: Some(&p.spread[step]) };
                let whole = bundle.share(&around(p.reach_m)).and_then(|share| self.band(rises_m, share, p));
                let Some(band) = whole else { continue };
                // What is within those heights does not reach as far, so they are fewer still.
                let reach_m = p.reach_of_m[figure.plan_of(band)];
                let part = bundle.share(&around(reach_m)).and_then(|share| self.band(rises_m, share, p));
                let Some(band) = part else { continue };
                let off_m = bundle.off_m(p.mean_m[step]).abs() as f32;
                let (plan, reach_m) = (figure.plan_of(band) as u32, (reach_m + ROOM) as f32);
                let holds = figure.holds(band);
                meetings.push(Meeting { other, step: step as u32, band, holds, plan, reach_m, off_m });
            }
            // Who stands nearest to the line blocks most, and what is blocked is not asked again.
            meetings[first..]
                .sort_unstable_by(|a, b| a.off_m.total_cmp(&b.off_m).then(a.other.cmp(&b.other)));
        }
    }

    /// The heights at which rays may meet the body of `p` between two shares of their length; `None` where they pass above
    /// it. `rises_m` are those of the least and the most of the rays over their whole length.
    #[inline(always)]
    fn band(&self, rises_m: [f64; 2], (near, far): (f64, f64), p: &Trajectories) -> Option<Band> {
        let [of_least, of_most] = rises_m.map(|rise_m| [near * rise_m, far * rise_m]);
        let low_m = self.ap_m.z + of_least[0].min(of_least[1]).min(of_most[0]).min(of_most[1]);
        let high_m = self.ap_m.z + of_least[0].max(of_least[1]).max(of_most[0]).max(of_most[1]);
        let [short, tall] = p.heights_m;
        let per =
            |height_m: f64, [tall, short]: [f64; 2]| height_m / if height_m > 0.0 { tall } else { short };
        let band = Band { low: per(low_m, [tall, short]) - ROOM, high: per(high_m, [short, tall]) + ROOM };
        (band.low <= 1.0).then_some(band)
    }
}

/// All rays from an access point to the samples of a person, in plan view.
struct Bundle {
    start_m: DVec2,
    /// Unit vector along their middle, and its length.
    along: DVec2,
    length_m: f64,
    /// How far the rays' ends lie from the middle's: ahead, back, to the left and to the right.
    ends_m: [f64; 4],
}

/// Where bodies may be.
struct Around<'a> {
    center_m: DVec2,
    reach_m: f64,
    /// How far they spread besides.
    spread: Option<&'a Spread>,
}

impl Bundle {
    fn of_second(ap_m: DVec3, q: &Trajectories, ue_reach_m: f64) -> Self {
        let (along, length_m) = Self::middle(ap_m, q.second.center_m);
        Self { start_m: ap_m.truncate(), along, length_m, ends_m: [q.second.radius_m + ue_reach_m; 4] }
    }

    #[inline(always)]
    fn of_step(ap_m: DVec3, q: &Trajectories, step: usize, ue_reach_m: f64) -> Self {
        let (along, length_m) = Self::middle(ap_m, q.mean_m[step]);
        let ends_m = sides(along).map(|side| q.spread[step].along_m(side) + ue_reach_m);
        Self { start_m: ap_m.truncate(), along, length_m, ends_m }
    }

    fn middle(ap_m: DVec3, end_m: DVec2) -> (DVec2, f64) {
        let way_m = end_m - ap_m.truncate();
        (way_m.normalize_or(DVec2::X), way_m.length())
    }

    /// How far to the left of the middle a place is.
    #[inline(always)]
    fn off_m(&self, place_m: DVec2) -> f64 {
        self.along.perp_dot(place_m - self.start_m)
    }

    /// Between which shares of their length rays may meet what is around a place; `None` where none can. A ray that
    /// does comes as near as the reach, along the middle and across it.
    #[inline(always)]
    fn share(&self, around: &Around) -> Option<(f64, f64)> {
        let reach_m = around.reach_m + ROOM;
        let off_m = self.off_m(around.center_m);
        let [fore, back, left, right] = self.ends_m;
        if off_m.abs() > reach_m + around.spread.map_or(0.0, |spread| spread.radius_m) + left.max(right) {
            return None;
        }
        let spread_m = |side: DVec2| reach_m + around.spread.map_or(0.0, |spread| spread.along_m(side));
        let way_m = self.along.dot(around.center_m - self.start_m);
        let last_m = way_m + spread_m(self.along);
        if last_m < 0.0 {
            return None;
        }
        let far = if last_m < self.length_m - back { last_m / (self.length_m - back) } else { 1.0 };
        let across = self.along.perp();
        if off_m - spread_m(-across) > far * left || off_m + spread_m(across) < -far * right {
            return None;
        }
        let near = ((way_m - spread_m(-self.along)) / (self.length_m + fore)).max(0.0);
        (near <= 1.0).then_some((near, far))
    }
}

/// Ahead, back, to the left and to the right.
fn sides(along: DVec2) -> [DVec2; 4] {
    [along, -along, along.perp(), -along.perp()]
}

fn wider(disc: Disc, by_m: f64) -> Disc {
    Disc { radius_m: disc.radius_m + by_m, ..disc }
}
