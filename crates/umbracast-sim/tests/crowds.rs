//! Rules that every crowd obeys.

use umbracast_sim::crowd::{Crowd, Preset, Trajectory, circle_crossing, pairs};

const FRAME_NS: i64 = 100_000_000;

/// The smallest distance between two people at 10 Hz.
fn smallest_distance_m(crowd: &Crowd) -> f64 {
    let mut smallest = f64::INFINITY;
    for time_ns in (0..=crowd.duration_ns).step_by(FRAME_NS as usize) {
        let at: Vec<_> = crowd.trajectories.iter().filter_map(|way| way.at(time_ns)).collect();
        for (i, (p, _)) in at.iter().enumerate() {
            smallest = at[..i].iter().map(|(q, _)| p.distance(*q)).fold(smallest, f64::min);
        }
    }
    smallest
}

#[test]
fn the_same_seed_gives_the_same_crowd_and_another_seed_another() {
    for preset in Preset::ALL {
        let crowd = circle_crossing(preset, 10, 12.5, 7);
        assert_eq!(crowd, circle_crossing(preset, 10, 12.5, 7));
        assert_ne!(crowd, circle_crossing(preset, 10, 12.5, 8));
    }
}

#[test]
fn circle_scenes_last_as_long_as_the_generator_s() {
    // 264 to 295 frames a scene at 10 Hz.
    for preset in [Preset::Orca03, Preset::Orca06] {
        let mut frames: Vec<i64> =
            (0..21).map(|seed| circle_crossing(preset, 10, 12.5, seed).duration_ns / FRAME_NS).collect();
        frames.sort_unstable();
        assert!((264..=295).contains(&frames[10]), "{}: {frames:?}", preset.name());
    }
}

#[test]
fn circle_people_keep_apart_and_all_arrive() {
    // ORCA lets discs touch and overlap by rounding.
    for (preset, apart_m) in [(Preset::Orca03, 0.599), (Preset::Orca06, 1.198)] {
        for seed in 0..10 {
            let crowd = circle_crossing(preset, 10, 12.5, seed);
            assert!(smallest_distance_m(&crowd) > apart_m, "{}, seed {seed}", preset.name());
            for way in &crowd.trajectories {
                let start = way.positions_m[0];
                let (there, _) = way.at(way.arrived_ns.unwrap()).unwrap();
                assert!(there.distance(-start) < 1.0, "{}, seed {seed}", preset.name());
                let (before, _) = way.at(way.arrived_ns.unwrap() - way.step_ns).unwrap();
                assert!(before.distance(-start) >= 1.0, "{}, seed {seed}", preset.name());
                assert!(way.at(crowd.duration_ns).is_some(), "the body stays");
            }
        }
    }
}

#[test]
fn more_people_than_the_circle_holds_still_give_a_crowd() {
    let crowd = circle_crossing(Preset::Orca06, 12, 2.0, 1);
    assert_eq!(crowd.trajectories.len(), 12);
}

#[test]
fn preset_names_are_read_back() {
    for preset in Preset::ALL {
        assert_eq!(preset.name().parse(), Ok(preset));
    }
    assert!("orca".parse::<Preset>().is_err());
}

/// Speeds of a person at 10 Hz until arrival.
fn speeds_mps(way: &Trajectory) -> Vec<f64> {
    let until = way.arrived_ns.unwrap();
    (0..until).step_by(FRAME_NS as usize).map(|time_ns| way.at(time_ns).unwrap().1.length()).collect()
}

#[test]
fn mixed_people_keep_apart_and_all_arrive() {
    for seed in 0..20 {
        let crowd = circle_crossing(Preset::Mixed, 10, 12.5, seed);
        assert_eq!(crowd.trajectories.len(), 10);
        assert!(smallest_distance_m(&crowd) >= 0.35, "seed {seed}");
        assert!(crowd.trajectories.iter().all(|way| way.arrived_ns.is_some()), "seed {seed}");
    }
}

#[test]
fn mixed_people_have_speeds_of_their_own_and_change_them_gently() {
    let mut cruising = Vec::new();
    for seed in 0..20 {
        for way in circle_crossing(Preset::Mixed, 10, 12.5, seed).trajectories {
            let mut speeds = speeds_mps(&way);
            // 2 m/s^2, and as much again for the outer of three who turn.
            assert!(speeds.windows(2).all(|v| (v[1] - v[0]).abs() < 0.35), "seed {seed}");
            speeds.sort_by(f64::total_cmp);
            cruising.push(speeds[speeds.len() * 3 / 4]);
        }
    }
    let n = cruising.len() as f64;
    let mean = cruising.iter().sum::<f64>() / n;
    let deviation = (cruising.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    // 1.34 +- 0.26 for single people; groups walk like their slowest.
    assert!((1.1..1.4).contains(&mean), "{mean}");
    assert!((0.15..0.35).contains(&deviation), "{deviation}");
}

#[test]
fn some_mixed_people_set_off_late_stop_or_turn() {
    let (mut late, mut stopped, mut turned, mut people) = (0, 0, 0, 0);
    for seed in 0..20 {
        for way in circle_crossing(Preset::Mixed, 10, 12.5, seed).trajectories {
            let speeds = speeds_mps(&way);
            let off = speeds.iter().position(|&v| v > 0.5).unwrap();
            people += 1;
            late += i32::from(off > 20);
            stopped += i32::from(speeds[off..].windows(20).any(|v| v.iter().all(|&v| v < 0.1)));
            let (start, end) = (way.positions_m[0], way.at(way.arrived_ns.unwrap()).unwrap().0);
            turned += i32::from(end.distance(-start) > 3.0);
        }
    }
    let share = |n: i32| f64::from(n) / f64::from(people);
    assert!((0.3..0.9).contains(&share(late)), "{late} of {people}");
    assert!((0.1..0.4).contains(&share(stopped)), "{stopped} of {people}");
    assert!((0.1..0.5).contains(&share(turned)), "{turned} of {people}");
}

#[test]
fn pairs_walk_side_by_side_at_their_gap() {
    for seed in 0..5 {
        let crowd = pairs(4, 0.55, 12.5, seed);
        assert_eq!(crowd.trajectories.len(), 8);
        let (mut beside, mut frames) = (0, 0);
        for pair in crowd.trajectories.chunks(2) {
            for time_ns in (0..pair[0].arrived_ns.unwrap()).step_by(FRAME_NS as usize) {
                let ((p, u), (q, v)) = (pair[0].at(time_ns).unwrap(), pair[1].at(time_ns).unwrap());
                assert!((p.distance(q) - 0.55).abs() < 1e-6, "seed {seed}");
                let way = u + v;
                if way.length() > 1.0 {
                    frames += 1;
                    beside += i32::from((p - q).normalize().dot(way.normalize()).abs() < 0.2);
                }
            }
        }
        assert!(f64::from(beside) > 0.9 * f64::from(frames), "seed {seed}: {beside} of {frames}");
    }
}
