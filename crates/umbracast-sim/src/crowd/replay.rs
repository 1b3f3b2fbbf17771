//! Replays recorded people: noisy positions at any rate become smooth paths in steps of 10 ms.

use umbracast::Error;
use umbracast::geometry::DVec2;

use super::trajectory::{Crowd, STEP_NS, Trajectory};

/// The kernel is cut off here, in standard deviations.
const REACH: f64 = 4.0;
/// Nodes are no closer: nearer ones are noise of the clock.
const LEAST_STEP_NS: i64 = 1_000_000;
/// Longer recordings are taken for wrong times: positions every 10 ms would fill the memory.
const LONGEST_S: f64 = 24.0 * 3600.0;

/// What was recorded of one person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recorded<'a> {
    /// Time in seconds, x and y in metres; times increase. At least one.
    pub samples: &'a [[f64; 3]],
    /// Standing height where known.
    pub height_m: Option<f64>,
}

/// Replays recorded people in the order given. Each is smoothed by a Gaussian of `smoothing_s` (0.12 s for
/// heads tracked on video, 0 for none) and then follows a cubic spline from the first sample to the last; nobody
/// arrives. The scene's time 0 is the earliest sample.
///
/// # Errors
/// A person without samples, times that do not increase, values that are not finite,
/// more than a day.
pub fn replay(people: &[Recorded], smoothing_s: f64) -> Result<Crowd, Error> {
    for (person, recorded) in people.iter().enumerate() {
        check(recorded.samples).map_err(|e| e.within(format!("recorded person {person}")))?;
    }
    let zero_s = people.iter().map(|p| p.samples[0][0]).fold(f64::INFINITY, f64::min);
    let span_s = people.iter().map(|p| p.samples[p.samples.len() - 1][0] - zero_s).fold(0.0, f64::max);
    if span_s > LONGEST_S {
        return Err(Error::new(format!(
            "recorded people: expected {LONGEST_S} s at most, found times from {zero_s} s on over {span_s} s"
        )));
    }
    let since_zero_ns = |time_s: f64| ((time_s - zero_s) * 1e9).round() as i64;

    let trajectories: Vec<Trajectory> = people
        .iter()
        .enumerate()
        .map(|(person, recorded)| {
            let times_ns: Vec<i64> = recorded.samples.iter().map(|s| since_zero_ns(s[0])).collect();
            let (start_ns, end_ns) = (times_ns[0], times_ns[times_ns.len() - 1]);
            let times_s: Vec<f64> = times_ns.iter().map(|t| (t - start_ns) as f64 * 1e-9).collect();
            let positions_m: Vec<DVec2> = recorded.samples.iter().map(|s| DVec2::new(s[1], s[2])).collect();
            let smooth_m = smooth(&times_s, &positions_m, smoothing_s);
            let steps = (end_ns - start_ns) / STEP_NS;
            Trajectory {
                person: person as u32,
                start_ns,
                step_ns: STEP_NS,
                positions_m: spline(&times_s, &smooth_m, steps as usize),
                arrived_ns: None,
                height_m: recorded.height_m,
            }
        })
        .collect();
    let duration_ns = trajectories
        .iter()
        .map(|way| way.start_ns + (way.positions_m.len() as i64 - 1) * STEP_NS)
        .max()
        .unwrap_or(0);
    Ok(Crowd { trajectories, duration_ns })
}

fn check(samples: &[[f64; 3]]) -> Result<(), Error> {
    if samples.is_empty() {
        return Err(Error::new("expected samples, found none"));
    }
    if let Some(i) = samples.iter().position(|s| s.iter().any(|v| !v.is_finite())) {
        return Err(Error::new(format!("sample {i}: expected finite numbers, found {:?}", samples[i])));
    }
    let too_soon = |s: &[[f64; 3]]| ((s[1][0] - s[0][0]) * 1e9) < LEAST_STEP_NS as f64;
    if let Some(i) = samples.windows(2).position(too_soon) {
        let (before, after) = (samples[i][0], samples[i + 1][0]);
        return Err(Error::new(format!(
            "sample {}: expected a time later than {before} s by 1 ms or more, found {after} s",
            i + 1
        )));
    }
    Ok(())
}

/// A straight line fitted to the neighbourhood of each sample with Gaussian weights, read at the sample. Within
/// an even recording it is the plain Gaussian mean; that would lag behind at the ends and beside gaps.
fn smooth(times_s: &[f64], positions_m: &[DVec2], deviation_s: f64) -> Vec<DVec2> {
    let mut first = 0;
    let fit = |(i, &time_s): (usize, &f64)| {
        if deviation_s <= 0.0 {
            return positions_m[i];
        }
        while times_s[first] < time_s - REACH * deviation_s {
            first += 1;
        }
        let near = (first..times_s.len()).take_while(|&k| times_s[k] <= time_s + REACH * deviation_s);
        // Moments of the weights over t, and of the positions.
        let (mut w0, mut w1, mut w2) = (0.0, 0.0, 0.0);
        let (mut p0, mut p1) = (DVec2::ZERO, DVec2::ZERO);
        for k in near {
            let t = (times_s[k] - time_s) / deviation_s;
            let weight = (-0.5 * t * t).exp();
            w0 += weight;
            w1 += weight * t;
            w2 += weight * t * t;
            p0 += positions_m[k] * weight;
            p1 += positions_m[k] * (weight * t);
        }
        let determinant = w0 * w2 - w1 * w1;
        // A lone sample has no slope.
        if determinant > 1e-9 * w0 * w0 { (p0 * w2 - p1 * w1) / determinant } else { positions_m[i] }
    };
    times_s.iter().enumerate().map(fit).collect()
}

/// The natural cubic spline through the nodes, at time 0 and every 10 ms after it.
fn spline(times_s: &[f64], nodes_m: &[DVec2], steps: usize) -> Vec<DVec2> {
    if nodes_m.len() < 2 {
        return nodes_m.to_vec();
    }
    let curvatures = curvatures(times_s, nodes_m);
    let mut k = 0;
    (0..=steps)
        .map(|step| {
            let time_s = (step as i64 * STEP_NS) as f64 * 1e-9;
            while k + 2 < times_s.len() && time_s >= times_s[k + 1] {
                k += 1;
            }
            let width = times_s[k + 1] - times_s[k];
            let b = (time_s - times_s[k]) / width;
            let a = 1.0 - b;
            let bend = curvatures[k] * (a * a * a - a) + curvatures[k + 1] * (b * b * b - b);
            nodes_m[k] * a + nodes_m[k + 1] * b + bend * (width * width / 6.0)
        })
        .collect()
}

/// Second derivatives at the nodes, zero at both ends: a tridiagonal system, solved by elimination.
fn curvatures(times_s: &[f64], nodes_m: &[DVec2]) -> Vec<DVec2> {
    let n = times_s.len();
    let mut curvatures = vec![DVec2::ZERO; n];
    let mut upper = vec![0.0; n];
    for i in 1..n - 1 {
        let (before, after) = (times_s[i] - times_s[i - 1], times_s[i + 1] - times_s[i]);
        let slope_change = (nodes_m[i + 1] - nodes_m[i]) / after - (nodes_m[i] - nodes_m[i - 1]) / before;
        let pivot = 2.0 * (before + after) - before * upper[i - 1];
        upper[i] = after / pivot;
        curvatures[i] = (slope_change * 6.0 - curvatures[i - 1] * before) / pivot;
    }
    for i in (1..n - 1).rev() {
        let next = curvatures[i + 1];
        curvatures[i] -= next * upper[i];
    }
    curvatures
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A walk around a circle of 5 m at 1.25 m/s.
    fn on_circle(time_s: f64) -> DVec2 {
        DVec2::from_angle(0.25 * time_s) * 5.0
    }

    fn record(times_s: impl IntoIterator<Item = f64>, way: fn(f64) -> DVec2) -> Vec<[f64; 3]> {
        times_s.into_iter().map(|t| [t, way(t).x, way(t).y]).collect()
    }

    fn one(samples: &[[f64; 3]], smoothing_s: f64) -> Trajectory {
        let people = [Recorded { samples, height_m: Some(1.7) }];
        replay(&people, smoothing_s).unwrap().trajectories.remove(0)
    }

    #[test]
    fn a_smooth_way_is_reproduced_at_any_rate() {
        let even = |rate_hz: f64| (0..=(8.0 * rate_hz) as usize).map(move |i| i as f64 / rate_hz);
        // Steps from 30 to 70 ms.
        let uneven = (0..=160).map(|i| 0.05 * f64::from(i) + 0.01 * f64::from(i).sin());
        for samples in
            [record(even(25.0), on_circle), record(even(10.0), on_circle), record(uneven, on_circle)]
        {
            let way = one(&samples, 0.12);
            for time_ns in (0..way.positions_m.len() as i64).map(|i| i * STEP_NS + 3_000_000) {
                let Some((position, velocity)) = way.at(time_ns) else { continue };
                let time_s = time_ns as f64 * 1e-9 + samples[0][0];
                // A Gaussian of 0.12 s cuts a circle of 5 m at 1.25 m/s by 2 mm.
                assert!(position.distance(on_circle(time_s)) < 0.005, "{time_s} s");
                let expected = on_circle(time_s).perp() * 0.25;
                // A natural spline does not bend at its ends.
                assert!(velocity.distance(expected) < 0.06, "{time_s} s: {velocity} for {expected}");
            }
        }
    }

    #[test]
    fn a_straight_way_is_exact_to_both_ends() {
        let straight = |t: f64| DVec2::new(1.5 * t - 4.0, 2.0 - 0.5 * t);
        let samples = record((0..100).map(|i| f64::from(i) * 0.04), straight);
        let way = one(&samples, 0.12);
        assert_eq!(way.positions_m.len(), 397);
        for (i, position) in way.positions_m.iter().enumerate() {
            assert!(position.distance(straight(i as f64 * 0.01)) < 1e-9, "step {i}");
        }
    }

    #[test]
    fn without_smoothing_the_way_goes_through_every_sample() {
        let samples = [[3.0, 0.0, 0.0], [3.1, 0.2, 0.1], [3.25, 0.1, 0.4], [3.4, 0.5, 0.5]];
        let way = one(&samples, 0.0);
        for [time_s, x, y] in samples {
            let step = ((time_s - 3.0) * 100.0).round() as usize;
            assert!(way.positions_m[step].distance(DVec2::new(x, y)) < 1e-9, "{time_s} s");
        }
    }

    #[test]
    fn a_jump_of_the_tracker_is_smoothed() {
        let mut samples = record((0..100).map(|i| f64::from(i) * 0.04), |t| DVec2::new(1.2 * t, 0.0));
        samples[50][2] = 0.66;
        let speed = |way: &Trajectory| {
            let at = |i: i64| way.at(i * STEP_NS).unwrap().1.length();
            (0..way.positions_m.len() as i64).map(at).fold(0.0, f64::max)
        };
        assert!(speed(&one(&samples, 0.0)) > 10.0);
        assert!(speed(&one(&samples, 0.12)) < 1.6);
    }

    #[test]
    fn people_are_present_from_their_first_to_their_last_sample() {
        let early = record([10.0, 10.1, 10.2], on_circle);
        let late = record([10.1, 10.2, 10.3, 10.5], on_circle);
        let people = [&early, &late].map(|samples| Recorded { samples, height_m: None });
        let crowd = replay(&people, 0.12).unwrap();
        let present =
            |ms: i64| crowd.trajectories.iter().map(|w| w.at(ms * 1_000_000).is_some()).collect::<Vec<_>>();
        assert_eq!(present(0), [true, false]);
        assert_eq!(present(100), [true, true]);
        assert_eq!(present(200), [true, true]);
        assert_eq!(present(210), [false, true]);
        assert_eq!(present(500), [false, true]);
        assert_eq!(crowd.duration_ns, 500_000_000);
        assert!(crowd.trajectories.iter().all(|way| way.arrived_ns.is_none()));
    }

    #[test]
    fn a_person_seen_once_is_there_for_that_instant() {
        let way = one(&[[4.0, 1.0, 2.0]], 0.12);
        assert_eq!(way.at(0), Some((DVec2::new(1.0, 2.0), DVec2::ZERO)));
        assert_eq!(way.at(1), None);
    }

    #[test]
    fn bad_recordings_are_refused_with_their_place() {
        let refuse = |samples: &[[f64; 3]]| {
            replay(&[Recorded { samples, height_m: None }], 0.12).unwrap_err().to_string()
        };
        assert!(refuse(&[]).contains("person 0: expected samples, found none"));
        assert!(refuse(&[[0.0, 1.0, 1.0], [0.0, 1.0, 1.0]]).contains("sample 1: expected a time later"));
        assert!(refuse(&[[0.0, 1.0, 1.0], [0.1, f64::NAN, 1.0]]).contains("sample 1: expected finite"));
        assert!(refuse(&[[0.0, 1.0, 1.0], [1e6, 1.0, 1.0]]).contains("expected 86400 s at most"));
    }
}
