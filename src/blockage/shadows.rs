//! Finds which people can come between an access point and another person, before any sample is looked at.
//!
//! Seen from the access point, each person covers some sectors of a turn within the next second: as a body that hides
//! others, and as an owner whose link may be hidden. Only pairs that share a sector are compared: at a first
//! glance all steps at once, then step by step while somebody asks. In doubt a pair is kept, so no blockage is lost.

use super::figure::{Band, Figure};
use super::glance::{Look, Way};
use super::spread::{Between, Spread};
use super::trajectories::{Disc, MOMENTS, Trajectories};
use crate::geometry::{Covered, DVec2, DVec3, Sectors};
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
}

/// Shadows of everybody's bodies, seen from one access point, and who of them may stand in the way of one link.
#[derive(Debug, Clone, Default)]
pub(super) struct Shadows {
    ap_m: DVec3,
    ue_reach_m: f64,
    ue_height_share: f64,
    /// How far above or below that height it may be.
    ue_rises_m: f64,
    /// Sectors that each person's body covers.
    covered: Vec<Covered>,
    bodies: Sectors<SECTORS>,
    looks: Vec<Look>,
    /// The last link that a body was compared with.
    compared: Vec<u32>,
    /// Whose link, and its rays by step.
    person: usize,
    bundles: [Bundle; MOMENTS],
    rises_m: [[f64; 2]; MOMENTS],
    /// By step: whom a first glance has kept and nobody has looked at more closely, as [`rank`]s.
    waiting: [Vec<u64>; MOMENTS],
}

/// The sectors in which something within `disc` is seen.
fn covered(disc: Disc, ap_m: DVec2) -> Covered {
    Covered::of::<SECTORS>(disc.center_m - ap_m, disc.radius_m)
}

impl Shadows {
    /// Of nobody yet, with room for so many who wait at a step.
    pub(super) fn with_room(waiting: usize) -> Self {
        Self { waiting: std::array::from_fn(|_| Vec::with_capacity(waiting)), ..Self::default() }
    }

    /// Looks at everybody from an access point.
    pub(super) fn fall(&mut self, ap_m: DVec3, ue: &Ue, people: &[Trajectories]) {
        self.ap_m = ap_m;
        [self.ue_reach_m, self.ue_rises_m] = ue.reach_m();
        self.ue_height_share = ue.height_share;
        self.covered.clear();
        self.covered.extend(people.iter().map(|p| covered(wider(p.second, p.reach_m), ap_m.truncate())));
        self.bodies.sort(&self.covered);
        self.looks.clear();
        self.looks.extend(people.iter().map(|p| Look::of(p, ap_m)));
        self.compared.clear();
        self.compared.resize(people.len(), u32::MAX);
    }

    /// Turns to a person's link: whoever may stand in its way waits to be looked at more closely.
    #[inline(always)]
    pub(super) fn turn_to(&mut self, people: &[Trajectories], person: usize) {
        self.waiting.iter_mut().for_each(Vec::clear);
        self.person = person;
        let q = &people[person];
        let mut way = Way::default();
        for step in 0..MOMENTS {
            let bundle = Bundle::of_step(self.ap_m, q, step, self.ue_reach_m);
            let off_m = [-self.ue_rises_m, self.ue_rises_m];
            let floor_m = q.floor_m[step] - self.ap_m.z;
            let rises_m = [0, 1].map(|i| self.ue_height_share * q.heights_m[i] + floor_m + off_m[i]);
            bundle.lay(&mut way, step, rises_m[0]);
            (self.bundles[step], self.rises_m[step]) = (bundle, rises_m);
        }
        let towards = covered(wider(q.second, self.ue_reach_m), self.ap_m.truncate());
        for &other in towards.each::<SECTORS>().flat_map(|sector| self.bodies.people(sector)) {
            if std::mem::replace(&mut self.compared[other as usize], person as u32) == person as u32
                || other as usize == person
                || people[other as usize].part_of == Some(q.track)
            {
                continue;
            }
            let near = way.near(&self.looks[other as usize]);
            let mut steps = near.steps;
            while steps != 0 {
                let step = steps.trailing_zeros() as usize % MOMENTS.next_power_of_two();
                steps &= steps - 1;
                self.waiting[step].push(rank(near.off_m[step], other));
            }
        }
    }

    /// Lets those who wait at a step come forward in order: who stands nearest to the line blocks most, and what is blocked is not
    /// asked again.
    #[inline(always)]
    pub(super) fn line_up(&mut self, step: usize) {
        self.waiting[step].sort_unstable_by(|a, b| b.cmp(a));
    }

    /// The next of those who wait at a step and may stand in the way indeed.
    #[inline(always)]
    pub(super) fn next(&mut self, figure: &Figure, people: &[Trajectories], step: usize) -> Option<Meeting> {
        while let Some(rank) = self.waiting[step].pop() {
            let meeting = self.meeting(figure, people, rank as u32, step);
            if meeting.is_some() {
                return meeting;
            }
        }
        None
    }

    #[inline(always)]
    fn meeting(&self, figure: &Figure, people: &[Trajectories], other: u32, step: usize) -> Option<Meeting> {
        let (p, bundle, rises_m) = (&people[other as usize], &self.bundles[step], self.rises_m[step]);
        let own = p.own_figure(figure);
        let seen = bundle.seen(p.mean_m[step]);
        let spreads_m = bundle.spreads_m(&p.spread[step]);
        let floor_m = p.floor_m[step];
        let share = bundle.share(&seen, p.reach_m, spreads_m)?;
        let band = self.band(rises_m, share, p, floor_m)?;
        // What is within those heights does not reach as far, so they are fewer still.
        let reach_m = p.reach_of_m[own.plan_of(band)];
        let share = bundle.share(&seen, reach_m, spreads_m)?;
        let band = self.band(rises_m, share, p, floor_m)?;
        let (plan, reach_m) = (own.plan_of(band) as u32, (reach_m + ROOM) as f32);
        Some(Meeting { other, step: step as u32, band, holds: own.holds(band), plan, reach_m })
    }

    /// The heights at which rays may meet the body of `p` between two shares of their length; `None` where they pass above
    /// it. `rises_m` are the least and the most of the rays over their whole length; the body stands on `floor_m`.
    #[inline(always)]
    fn band(
        &self,
        [least_m, most_m]: [f64; 2],
        (near, far): (f64, f64),
        p: &Trajectories,
        floor_m: f64,
    ) -> Option<Band> {
        let low_m = self.ap_m.z + least_m * if least_m < 0.0 { far } else { near } - floor_m;
        let high_m = self.ap_m.z + most_m * if most_m > 0.0 { far } else { near } - floor_m;
        let [per_short, per_tall] = p.per_height;
        let low = low_m * if low_m > 0.0 { per_tall } else { per_short } - ROOM;
        let high = high_m * if high_m > 0.0 { per_short } else { per_tall } + ROOM;
        (low <= p.top).then_some(Band { low, high })
    }
}

impl Meeting {
    /// Of somebody's own body with the own link: all of it.
    pub(super) fn own(person: usize, step: usize) -> Self {
        Self {
            other: person as u32,
            step: step as u32,
            band: Band { low: f64::NEG_INFINITY, high: f64::INFINITY },
            holds: false,
            plan: 0,
            reach_m: 0.0,
        }
    }
}

/// Nearest to the middle ray first, then in order of people: distances are not negative, so their bits are in order.
#[inline(always)]
fn rank(off_m: f32, other: u32) -> u64 {
    u64::from(off_m.to_bits()) << 32 | u64::from(other)
}

/// All rays from an access point to the samples of a person, in plan view.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Bundle {
    start_m: DVec2,
    /// The unit vector along their middle, and how long that is.
    along: DVec2,
    length_m: f64,
    /// Shares of the shortest and of the longest of them in a metre.
    per_m: [f64; 2],
    /// How far the rays' ends lie from the middle's: along it, back, to the left and to the right.
    ends_m: [f64; 4],
    /// Along the middle, and to the left of it.
    sides: [Between; 2],
}

/// Where the middle of somebody's samples is: along a bundle's middle, and to the left of it.
struct Seen {
    way_m: f64,
    off_m: f64,
}

impl Bundle {
    #[inline(always)]
    fn of_step(ap_m: DVec3, q: &Trajectories, step: usize, ue_reach_m: f64) -> Self {
        Self::new(ap_m, q.mean_m[step], |side| q.spread[step].both_ways_m(side).map(|m| m + ue_reach_m))
    }

    #[inline(always)]
    fn new(ap_m: DVec3, end_m: DVec2, both_ways_m: impl Fn(&Between) -> [f64; 2]) -> Self {
        let way_m = end_m - ap_m.truncate();
        let along = way_m.normalize_or(DVec2::X);
        let sides = [Between::of(along), Between::of(along.perp())];
        let [[fore, back], [left, right]] = [both_ways_m(&sides[0]), both_ways_m(&sides[1])];
        let (length_m, ends_m) = (way_m.length(), [fore, back, left, right]);
        let per_m = [length_m - ends_m[1], length_m + ends_m[0]].map(|length_m| 1.0 / length_m);
        Self { start_m: ap_m.truncate(), along, length_m, per_m, ends_m, sides }
    }

    #[inline(always)]
    fn seen(&self, place_m: DVec2) -> Seen {
        let (along, from_start_m) = (self.along, place_m - self.start_m);
        Seen { way_m: along.dot(from_start_m), off_m: along.perp_dot(from_start_m) }
    }

    /// How far somebody's samples spread to each of the four sides.
    #[inline(always)]
    fn spreads_m(&self, spread: &Spread) -> [f64; 4] {
        let [[fore, back], [left, right]] = [0, 1].map(|i| spread.both_ways_m(&self.sides[i]));
        [fore, back, left, right]
    }

    /// The rays for a first glance, of which the first rises least.
    #[inline(always)]
    fn lay(&self, way: &mut Way, step: usize, rise_m: f64) {
        let [fore, back, left, right] = self.ends_m;
        let lengths_m = [self.length_m - back, self.length_m + fore];
        way.set(step, self.along.to_array(), lengths_m, [left, right], rise_m);
    }

    /// Between which shares of their length rays may meet what reaches so far round samples that spread so far to each side;
    /// `None` where none can. A ray that does comes as near as the reach, along the middle and across it.
    #[inline(always)]
    fn share(&self, seen: &Seen, reach_m: f64, spreads_m: [f64; 4]) -> Option<(f64, f64)> {
        let [_, back, left, right] = self.ends_m;
        let [to_fore, to_back, to_left, to_right] = spreads_m.map(|spread_m| reach_m + ROOM + spread_m);
        let last_m = seen.way_m + to_fore;
        if last_m < 0.0 {
            return None;
        }
        let far = if last_m < self.length_m - back { last_m * self.per_m[0] } else { 1.0 };
        if seen.off_m - to_right > far * left || seen.off_m + to_left < -far * right {
            return None;
        }
        let near = ((seen.way_m - to_back) * self.per_m[1]).max(0.0);
        (near <= 1.0).then_some((near, far))
    }
}

fn wider(disc: Disc, by_m: f64) -> Disc {
    Disc { radius_m: disc.radius_m + by_m, ..disc }
}
