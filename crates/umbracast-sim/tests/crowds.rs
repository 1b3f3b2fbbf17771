//! What every crowd keeps to.

use umbracast_sim::crowd::{Crowd, Preset, circle_crossing};

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
