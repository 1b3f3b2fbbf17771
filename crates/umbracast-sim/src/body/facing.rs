//! Where a trunk faces: along the way of who walks, a little aside as people look about them, and anywhere while standing.

use std::f64::consts::{PI, TAU};

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use umbracast::geometry::DVec2;

use crate::random::stream;

/// A body turns no faster than 200 degrees a second while it walks.
const TURN_RATE_RADPS: f64 = 3.5;
/// The same on the spot, foot by foot.
const TURN_ON_SPOT_RADPS: f64 = 1.6;
/// Who stands for less goes on facing as before.
const STAY_S: f64 = 1.5;
/// How far trunks turn aside while people walk, one standard deviation, and for how long. An assumption: people look about
/// them, and a trunk follows by a part of that.
const ASIDE_RAD: f64 = 0.10;
const ASIDE_S: f64 = 1.0;
/// Trunks follow where people look so much later, smoothly.
const FOLLOWS_S: f64 = 0.3;

/// Headings of a walk whose velocity is given every `step_s`, slower than `standing_mps` while standing, not wrapped. Whoever
/// stands for a while faces anything: somebody, a screen, a wall, what is behind. Before he goes he turns to where he goes.
/// Without a seed people face along their way, and hold that while they stand.
pub(super) fn headings(velocities: &[DVec2], step_s: f64, standing_mps: f64, seed: Option<u64>) -> Vec<f64> {
    let stands = |v: &DVec2| v.length() < standing_mps;
    let mut anything = seed.map(|seed| stream(seed, "facing", 0));
    let mut looks = seed.map(|seed| stream(seed, "looking aside", 0));
    let mut heading = velocities.iter().find(|v| !stands(v)).map_or(0.0, |v| v.to_angle());
    let mut headings = Vec::with_capacity(velocities.len());
    let (mut looked, mut aside) = (0.0, 0.0);
    // What follows later varies less: by the share of both times.
    let looked_rad = ASIDE_RAD * ((ASIDE_S + FOLLOWS_S) / ASIDE_S).sqrt();
    let mut i = 0;
    while i < velocities.len() {
        let stay = velocities[i..].iter().take_while(|v| stands(v)).count();
        if let Some(anything) = anything.as_mut().filter(|_| stay as f64 * step_s >= STAY_S) {
            let faced = anything.random_range(0.0..TAU);
            let leaves = velocities.get(i + stay).map(|v| v.to_angle());
            if i == 0 {
                heading = faced;
            }
            for step in 0..stay {
                // So late that he just faces his way when he goes.
                let left_s = (stay - step) as f64 * step_s;
                let back = leaves.filter(|leaves| off(*leaves, heading).abs() > left_s * TURN_ON_SPOT_RADPS);
                let most = TURN_ON_SPOT_RADPS * step_s;
                heading += off(back.unwrap_or(faced), heading).clamp(-most, most);
                headings.push(heading);
            }
            (i, looked, aside) = (i + stay, 0.0, 0.0);
            continue;
        }
        if !stands(&velocities[i]) {
            let share = step_s / ASIDE_S;
            let draw: f64 = looks.as_mut().map_or(0.0, |looks| StandardNormal.sample(looks));
            looked += -looked * share + looked_rad * (2.0 * share).sqrt() * draw;
            aside += (looked - aside) * step_s / FOLLOWS_S;
            let most = TURN_RATE_RADPS * step_s;
            heading += off(velocities[i].to_angle() + aside, heading).clamp(-most, most);
        }
        headings.push(heading);
        i += 1;
    }
    headings
}

/// From one heading to another, the shorter way round.
fn off(to_rad: f64, from_rad: f64) -> f64 {
    (to_rad - from_rad + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 0.01;

    fn walk(stand_steps: usize, walk_steps: usize) -> Vec<DVec2> {
        [vec![DVec2::ZERO; stand_steps], vec![DVec2::new(1.2, 0.0); walk_steps]].concat()
    }

    /// Simulated people who stood from the first frame on once faced where they would go: a predictor that knew it scored
    /// better than it should.
    #[test]
    fn who_stands_from_the_first_instant_on_faces_anywhere() {
        let mut quarters = [0; 4];
        for seed in 0..400 {
            let headings = headings(&walk(1000, 500), STEP_S, 0.1, Some(seed));
            quarters[(headings[300].rem_euclid(TAU) / TAU * 4.0) as usize] += 1;
            let faces_its_way = off(headings[1000], 0.0).abs();
            assert!(faces_its_way < 0.1, "seed {seed}: {faces_its_way}");
        }
        assert!(quarters.iter().all(|count| (70..130).contains(count)), "{quarters:?}");
    }

    #[test]
    fn trunks_of_who_walks_turn_aside_by_a_tenth() {
        let mut squares = Vec::new();
        for seed in 0..100 {
            let headings = headings(&walk(0, 3000), STEP_S, 0.1, Some(seed));
            squares.extend(headings.iter().skip(500).step_by(100).map(|h| h * h));
        }
        let sigma = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((sigma - ASIDE_RAD).abs() < 0.01, "{sigma}");
    }

    #[test]
    fn nobody_turns_faster_than_a_body_can_and_a_short_stop_turns_nobody() {
        let mut stop = walk(0, 300);
        stop.extend(walk(100, 300));
        let headings = headings(&stop, STEP_S, 0.1, Some(3));
        let fastest = headings.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        assert!(fastest <= TURN_RATE_RADPS * STEP_S + 1e-12, "{fastest}");
        assert!(headings[300..400].iter().all(|heading| *heading == headings[299]));
    }
}
