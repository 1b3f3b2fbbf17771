//! The inputs of the residual network: one track and the neighbours that it may have to avoid, in the track's own
//! axes (along its heading, and to the left). All inputs are known at the frame.

use std::array::from_fn;

use crate::geometry::DVec2;
use crate::track::{OBSERVED, Track};

/// Numbers that the network reads.
pub const INPUTS: usize = 2 + 4 * LAGS.len() + 4 + 2 + PER_NEIGHBOUR * NEIGHBOURS;

/// Frames back, each with the scale of what a position then may differ by from a constant velocity, metres.
const LAGS: [(usize, f64); 7] = [(1, 0.02), (2, 0.04), (3, 0.06), (4, 0.08), (5, 0.1), (7, 0.15), (9, 0.2)];
/// The most urgent ones.
const NEIGHBOURS: usize = 3;
const PER_NEIGHBOUR: usize = 7;
/// A walking pace and what it changes by; what the filter does not know of position and velocity.
const SPEED_MPS: f64 = 1.5;
const SPEED_CHANGE_MPS: f64 = 0.3;
const SIGMAS: [f64; 4] = [0.02, 0.02, 0.1, 0.1];
/// No track is surer; a state that is known altogether is read as the surest the network has met.
const SIGMAS_MIN: [f64; 4] = [0.004, 0.004, 0.02, 0.02];
/// Nobody evades what is further ahead than this.
const HORIZON_S: f64 = 4.0;
/// What a second until the closest approach weighs against a metre between the two then.
const URGENCY_MPS: f64 = 0.8;
/// A neighbour's weight falls to 1 / e over this distance.
const NEAR_M: f64 = 4.0;
/// Larger inputs are cut off here: the network has hardly seen them.
const LARGEST: f64 = 6.0;

/// A track as the network sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Unit vector of the heading: the first axis. The second points to the left.
    pub ahead: DVec2,
    /// What the network reads.
    pub inputs: [f32; INPUTS],
    /// The filter's standard deviations: position along and across, velocity along and across.
    pub sigmas: [f64; 4],
}

/// What the network reads of `tracks[of]`.
pub fn see(tracks: &[Track], of: usize) -> Seen {
    let track = &tracks[of];
    let ahead = DVec2::from_angle(track.heading_rad);
    let own = |v: DVec2| [ahead.dot(v), ahead.perp_dot(v)];
    let sigmas = sigmas(track, ahead);
    let mut inputs = [0.0; INPUTS];
    let mut places = inputs.iter_mut();
    let mut put = |values: &[f64]| {
        for (value, place) in values.iter().zip(&mut places) {
            *place = value.clamp(-LARGEST, LARGEST) as f32;
        }
    };
    put(&own(track.velocity_mps / SPEED_MPS));
    let past = track.observed.len().saturating_sub(1);
    for (lag, scale_m) in LAGS {
        // Younger tracks have not left their way then.
        let (mut left_m, mut change_mps) = (DVec2::ZERO, DVec2::ZERO);
        if lag <= past {
            let (then, now) = (&track.observed[past - lag], &track.observed[past]);
            let since_s = (now.time_ns - then.time_ns) as f64 * 1e-9;
            left_m = then.position_m - (track.position_m - track.velocity_mps * since_s);
            change_mps = then.velocity_mps - track.velocity_mps;
        }
        put(&own(left_m / scale_m));
        put(&own(change_mps / SPEED_CHANGE_MPS));
    }
    put(&from_fn::<_, 4, _>(|i| (sigmas[i] / SIGMAS[i]).ln()));
    put(&[past as f64 / (OBSERVED - 1) as f64, f64::from(track.points).ln_1p() / 4.0]);
    for neighbour in most_urgent(tracks, of).into_iter().flatten() {
        let near = (-neighbour.apart_m.length() / NEAR_M).exp();
        put(&own(neighbour.apart_m * near / (neighbour.apart_m.length() + 0.5)));
        put(&own(neighbour.closing_mps * near / SPEED_MPS));
        put(&[(-neighbour.closest_s).exp(), (-neighbour.closest_m).exp(), near]);
    }
    Seen { ahead, inputs, sigmas }
}

/// 1 for each input, -1 for those that change their sign when left becomes right.
pub fn mirror() -> [f32; INPUTS] {
    let mut signs = [1.0; INPUTS];
    let across = (0..1 + 2 * LAGS.len()).map(|pair| 2 * pair + 1);
    let first = INPUTS - PER_NEIGHBOUR * NEIGHBOURS;
    let of_neighbours = (0..NEIGHBOURS).flat_map(|k| [1, 3].map(|i| first + k * PER_NEIGHBOUR + i));
    across.chain(of_neighbours).for_each(|i| signs[i] = -1.0);
    signs
}

/// Standard deviations of position and velocity, along and across.
fn sigmas(track: &Track, ahead: DVec2) -> [f64; 4] {
    let p = &track.covariance;
    let along = |at: usize, d: DVec2| {
        let variance =
            p[at][at] * d.x * d.x + 2.0 * p[at][at + 1] * d.x * d.y + p[at + 1][at + 1] * d.y * d.y;
        variance.max(0.0).sqrt()
    };
    let found = [along(0, ahead), along(0, ahead.perp()), along(2, ahead), along(2, ahead.perp())];
    from_fn(|i| found[i].max(SIGMAS_MIN[i]))
}

/// Where another person is and how the two of them will meet.
#[derive(Debug, Clone, Copy)]
struct Neighbour {
    /// From the track to the neighbour.
    apart_m: DVec2,
    closing_mps: DVec2,
    /// Until they are closest, and how close then, if both walk on.
    closest_s: f64,
    closest_m: f64,
}

impl Neighbour {
    fn patience(&self) -> f64 {
        self.closest_m + URGENCY_MPS * self.closest_s
    }
}

/// The confirmed tracks that come close soonest, most urgent first; in the order of the tracks where alike.
fn most_urgent(tracks: &[Track], of: usize) -> [Option<Neighbour>; NEIGHBOURS] {
    let mut found: [Option<Neighbour>; NEIGHBOURS] = [None; NEIGHBOURS];
    for (_, other) in tracks.iter().enumerate().filter(|(i, other)| *i != of && other.confirmed) {
        let apart_m = other.position_m - tracks[of].position_m;
        let closing_mps = other.velocity_mps - tracks[of].velocity_mps;
        let closest_s =
            (-apart_m.dot(closing_mps) / closing_mps.length_squared().max(1e-6)).clamp(0.0, HORIZON_S);
        let closest_m = (apart_m + closing_mps * closest_s).length();
        let mut next = Some(Neighbour { apart_m, closing_mps, closest_s, closest_m });
        for place in &mut found {
            let sooner = |n: &Neighbour| place.is_none_or(|p| n.patience() < p.patience());
            if next.as_ref().is_some_and(sooner) {
                std::mem::swap(place, &mut next);
            }
        }
    }
    found
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::forecast::forecaster::tests::track;

    /// Three people on bent ways, the first of them walking to `heading_rad`, the whole turned and mirrored by
    /// `map`.
    pub(in crate::forecast) fn three_people(map: impl Fn(DVec2) -> DVec2) -> Vec<Track> {
        let way = |start: DVec2, v: DVec2, bend: f64| -> Vec<DVec2> {
            (0..20).map(|k| start + v * (0.1 * f64::from(k)) + v.perp() * bend * f64::from(k * k)).collect()
        };
        let ways = [
            way(DVec2::ZERO, DVec2::new(1.2, 0.1), 0.001),
            way(DVec2::new(5.0, 0.5), DVec2::new(-1.0, 0.2), -0.002),
            way(DVec2::new(1.0, -2.0), DVec2::new(0.3, 1.1), 0.0),
        ];
        let person = |(id, way): (u64, &Vec<DVec2>)| {
            let way: Vec<DVec2> = way.iter().map(|&p| map(p)).collect();
            let velocity = |k: usize| (way[k] - way[k - 1]) / 0.1;
            let mut track = track(id, &way, 15);
            track.velocity_mps = velocity(15);
            track.heading_rad = track.velocity_mps.to_angle();
            for (i, observed) in track.observed.iter_mut().enumerate() {
                observed.velocity_mps = velocity(6 + i);
            }
            track.covariance = [[0.0; 4]; 4];
            (0..4).for_each(|i| track.covariance[i][i] = if i < 2 { 0.0004 } else { 0.01 });
            track
        };
        (0..).zip(&ways).map(person).collect()
    }

    fn largest_difference(a: &[f32; INPUTS], b: &[f32; INPUTS]) -> f32 {
        a.iter().zip(b).fold(0.0, |largest, (a, b)| largest.max((a - b).abs()))
    }

    #[test]
    fn a_turned_and_shifted_scene_looks_the_same() {
        let turned = |p: DVec2| DVec2::from_angle(2.0).rotate(p) + DVec2::new(7.0, -3.0);
        let (one, other) = (see(&three_people(|p| p), 0), see(&three_people(turned), 0));
        assert!(largest_difference(&one.inputs, &other.inputs) < 1e-4);
        assert!(one.inputs.iter().filter(|&&value| value != 0.0).count() > INPUTS * 3 / 4);
    }

    #[test]
    fn a_known_state_is_read_as_the_surest_track_and_not_as_one_never_met() {
        let mut tracks = three_people(|p| p);
        tracks[0].covariance = [[0.0; 4]; 4];
        let known = see(&tracks, 0);
        (0..4).for_each(|i| tracks[0].covariance[i][i] = SIGMAS_MIN[i].powi(2));
        assert!(largest_difference(&known.inputs, &see(&tracks, 0).inputs) < 1e-6);
        assert_eq!(known.sigmas, SIGMAS_MIN);
    }

    #[test]
    fn in_a_mirror_left_and_right_change_places() {
        let one = see(&three_people(|p| p), 0);
        let other = see(&three_people(|p| DVec2::new(p.x, -p.y)), 0);
        let signs = mirror();
        assert!(largest_difference(&one.inputs, &from_fn(|i| other.inputs[i] * signs[i])) < 1e-4);
        assert!(largest_difference(&one.inputs, &other.inputs) > 0.1);
    }

    #[test]
    fn the_most_urgent_neighbour_comes_first() {
        let mut tracks = three_people(|p| p);
        let [first, second, none] = most_urgent(&tracks, 0);
        assert!(first.unwrap().patience() < second.unwrap().patience() && none.is_none());
        // Whoever comes head on is met sooner than whoever walks ahead.
        (tracks[2].velocity_mps, tracks[2].position_m) = (tracks[0].velocity_mps, DVec2::new(1.0, -4.0));
        let first = most_urgent(&tracks, 0)[0].unwrap();
        assert!(first.closing_mps.x < -2.0, "{first:?}");
        tracks[1].confirmed = false;
        assert!(most_urgent(&tracks, 0)[1].is_none(), "who is not confirmed is nobody");
    }
}
