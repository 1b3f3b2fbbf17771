//! Moves recorded people apart. Their heads can be nearer to one another than our simulated bodies fit.

use umbracast::geometry::DVec2;

use super::trajectory::{Crowd, Trajectory};

/// Nobody's axis is nearer to another's. Strangers in a lift or a queue stand 0.35 m apart, one behind the other; shoulders with
/// arms are 0.46 m wide, so bodies that stand so side by side overlap at the elbows.
pub const ROOM_M: f64 = 0.35;
/// Places are put right at these times, and between them smoothly.
const NODE_NS: i64 = 100_000_000;
/// One standard deviation, in nodes, of the time over which somebody makes room: people do so within half a second.
const SMOOTH_NODES: f64 = 3.0;
/// Share of what is missing that a round gives: all at once would overshoot where many stand round one.
const SHARE: f64 = 0.6;
/// Rounds at most; a crowd of fifty takes some two hundred.
const ROUNDS: usize = 600;
/// Pairs are looked for anew after so many rounds, among who stands nearer than twice the room.
const ROUNDS_OF_PAIRS: usize = 20;
/// So much less than the room does no harm.
const SLACK_M: f64 = 0.005;

/// Moves people apart until nobody's axis is nearer to another's than `ROOM_M`. Who has room stays where he is, to the
/// bit. Returns how far somebody was moved at most, in metres.
pub fn move_apart(crowd: &mut Crowd) -> f64 {
    let mut people: Vec<Moved> = crowd.trajectories.iter().map(Moved::of).collect();
    let first = people.iter().map(|p| p.first).min().unwrap_or(0);
    let last = people.iter().map(|p| p.first + p.places_m.len() as i64).max().unwrap_or(0);
    let mut pairs = Vec::new();
    for round in 0..ROUNDS {
        if round % ROUNDS_OF_PAIRS == 0 {
            pairs = near_pairs(&people, first..last);
        }
        let mut pushes: Vec<Vec<DVec2>> =
            people.iter().map(|p| vec![DVec2::ZERO; p.places_m.len()]).collect();
        let mut most_m: f64 = 0.0;
        for &(node, a, b) in &pairs {
            let (i, j) = ((node - people[a].first) as usize, (node - people[b].first) as usize);
            let off_m = people[b].places_m[j] - people[a].places_m[i];
            let missing_m = ROOM_M - off_m.length();
            if missing_m > 0.0 {
                most_m = most_m.max(missing_m);
                // Two in one place part along x.
                let push_m = off_m.try_normalize().unwrap_or(DVec2::X) * (0.5 * SHARE * missing_m);
                pushes[a][i] -= push_m;
                pushes[b][j] += push_m;
            }
        }
        if most_m < SLACK_M {
            break;
        }
        for (person, pushes) in people.iter_mut().zip(&pushes) {
            person.give_way(pushes);
        }
    }
    let moved = crowd.trajectories.iter_mut().zip(&people).map(|(way, person)| person.tell(way));
    moved.fold(0.0, f64::max)
}

/// A person's places at nodes, and how far they lie from the recorded ones.
struct Moved {
    /// Number of the first node.
    first: i64,
    places_m: Vec<DVec2>,
    shifts_m: Vec<DVec2>,
}

impl Moved {
    fn of(way: &Trajectory) -> Self {
        let end_ns = way.start_ns + way.step_ns * (way.positions_m.len() as i64 - 1).max(0);
        let first = way.start_ns.div_euclid(NODE_NS);
        let nodes = first..=end_ns.div_euclid(NODE_NS) + 1;
        let at =
            |node: i64| way.at((node * NODE_NS).clamp(way.start_ns, end_ns)).map_or(DVec2::ZERO, |s| s.0);
        let places_m: Vec<DVec2> = nodes.map(at).collect();
        Self { first, shifts_m: vec![DVec2::ZERO; places_m.len()], places_m }
    }

    /// Moves by the pushes, smoothed over time.
    fn give_way(&mut self, pushes_m: &[DVec2]) {
        if pushes_m.iter().all(|push| *push == DVec2::ZERO) {
            return;
        }
        let reach = (3.0 * SMOOTH_NODES) as usize;
        for k in 0..pushes_m.len() {
            let near = k.saturating_sub(reach)..(k + reach + 1).min(pushes_m.len());
            let (mut sum_m, mut weights) = (DVec2::ZERO, 0.0);
            for other in near {
                let weight = (-0.5 * ((other as f64 - k as f64) / SMOOTH_NODES).powi(2)).exp();
                sum_m += pushes_m[other] * weight;
                weights += weight;
            }
            self.shifts_m[k] += sum_m / weights;
            self.places_m[k] += sum_m / weights;
        }
    }

    /// Shifts the way; returns by how much at most.
    fn tell(&self, way: &mut Trajectory) -> f64 {
        let most_m = self.shifts_m.iter().map(|shift| shift.length()).fold(0.0, f64::max);
        if most_m > 0.0 {
            let shifts = Trajectory {
                person: way.person,
                start_ns: self.first * NODE_NS,
                step_ns: NODE_NS,
                positions_m: self.shifts_m.clone(),
                arrived_ns: None,
                height_m: None,
            };
            let (start_ns, step_ns) = (way.start_ns, way.step_ns);
            for (at_m, i) in way.positions_m.iter_mut().zip(0..) {
                *at_m += shifts.at(start_ns + i * step_ns).map_or(DVec2::ZERO, |shift| shift.0);
            }
        }
        most_m
    }
}

/// Node and two people who are near each other then.
fn near_pairs(people: &[Moved], nodes: std::ops::Range<i64>) -> Vec<(i64, usize, usize)> {
    let mut pairs = Vec::new();
    let mut there: Vec<(usize, DVec2)> = Vec::new();
    for node in nodes {
        there.clear();
        there.extend(people.iter().enumerate().filter_map(|(who, person)| {
            let at = usize::try_from(node - person.first).ok()?;
            Some((who, *person.places_m.get(at)?))
        }));
        there.sort_by(|a, b| a.1.x.total_cmp(&b.1.x));
        for (k, (a, at_m)) in there.iter().enumerate() {
            let beside = there[k + 1..].iter().take_while(|(_, other)| other.x - at_m.x < 2.0 * ROOM_M);
            let near = beside.filter(|(_, other)| other.distance(*at_m) < 2.0 * ROOM_M);
            pairs.extend(near.map(|(b, _)| (node, *a.min(b), *a.max(b))));
        }
    }
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crowd::trajectory::STEP_NS;

    fn way(person: u32, start_ns: i64, place: impl Fn(f64) -> DVec2) -> Trajectory {
        let positions_m = (0..=300).map(|i| place(0.01 * f64::from(i))).collect();
        Trajectory { person, start_ns, step_ns: STEP_NS, positions_m, arrived_ns: None, height_m: None }
    }

    fn least_m(crowd: &Crowd) -> f64 {
        let ways = &crowd.trajectories;
        let mut least_m = f64::INFINITY;
        for time_ns in (0..crowd.duration_ns).step_by(10_000_000) {
            let there: Vec<DVec2> = ways.iter().filter_map(|way| Some(way.at(time_ns)?.0)).collect();
            for (k, a) in there.iter().enumerate() {
                least_m = there[k + 1..].iter().map(|b| a.distance(*b)).fold(least_m, f64::min);
            }
        }
        least_m
    }

    #[test]
    fn a_dense_crowd_gets_room_and_nobody_leaps() {
        // Thirty who stand 0.3 m apart and creep on, some of them later than others.
        let trajectories = (0..30u32).map(|k| {
            let at_m = DVec2::new(0.3 * f64::from(k % 6), 0.3 * f64::from(k / 6));
            way(k, i64::from(k % 3) * 130_000_000, move |t| at_m + DVec2::new(0.2 * t, 0.0))
        });
        let mut crowd = Crowd { trajectories: trajectories.collect(), duration_ns: 3_000_000_000 };
        let moved_m = move_apart(&mut crowd);
        assert!(moved_m > 0.1 && moved_m < 0.8, "{moved_m}");
        assert!(least_m(&crowd) > ROOM_M - 0.02, "{}", least_m(&crowd));
        for way in &crowd.trajectories {
            let leaps = way.positions_m.windows(2).map(|p| p[0].distance(p[1])).fold(0.0, f64::max);
            assert!(leaps < 0.02, "{leaps} m in 10 ms");
        }
    }

    #[test]
    fn who_has_room_stays() {
        let trajectories = (0..3u32).map(|k| way(k, 0, move |t| DVec2::new(t, 0.5 * f64::from(k)))).collect();
        let mut crowd = Crowd { trajectories, duration_ns: 3_000_000_000 };
        let before = crowd.clone();
        assert_eq!(move_apart(&mut crowd), 0.0);
        assert_eq!(crowd, before);
    }
}
