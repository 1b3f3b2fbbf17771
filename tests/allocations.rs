//! Once everybody is known, a step of the default mode asks for no memory: a frame's time does not hang on an allocator.

use umbracast::geometry::DVec2;
use umbracast::{Config, Pipeline};
use umbracast_sim::crowd::{Crowd, Trajectory};

#[allow(dead_code)] // Nobody is to be found here, so the truth is not looked at.
#[path = "../examples/simulated/mod.rs"]
mod simulated;

/// Each walks to and fro on a line of one's own, there in so many frames and back in as many.
const PEOPLE: usize = 10;
const THERE: usize = 30;
const LINES_M: f64 = 1.4;
/// Where they walk once more as they did before, every buffer is as large as it will ever be.
const KNOWN_AFTER: usize = 4 * THERE;
const FRAMES: usize = 6 * THERE;

fn to_and_fro() -> Crowd {
    let position = |person: usize, step: usize| {
        let turn = std::f64::consts::PI * step as f64 / (10 * THERE) as f64;
        let side = if person.is_multiple_of(2) { -6.0 } else { 2.0 };
        DVec2::new(side + 1.8 * turn.cos(), LINES_M * (person as f64 - 0.5 * (PEOPLE - 1) as f64))
    };
    let trajectory = |person: usize| Trajectory {
        person: person as u32,
        start_ns: 0,
        step_ns: umbracast::STEP_NS / 10,
        positions_m: (0..=10 * FRAMES).map(|step| position(person, step)).collect(),
        arrived_ns: None,
        height_m: None,
    };
    Crowd {
        trajectories: (0..PEOPLE).map(trajectory).collect(),
        duration_ns: FRAMES as i64 * umbracast::STEP_NS,
    }
}

#[test]
fn a_step_allocates_nothing_once_everybody_is_known() {
    let config = Config::default();
    let recording =
        simulated::walking(&config.site, to_and_fro(), FRAMES).expect("the default site is simulated");
    let mut pipeline = Pipeline::new(&config, None).expect("the defaults work");
    recording.empty.iter().for_each(|frame| pipeline.learn_empty(frame));
    let (mut before, mut since) = (0, Vec::new());
    for (k, frame) in recording.frames.iter().enumerate() {
        let mut followed = 0;
        let asked = allocation_counter::measure(|| {
            followed = pipeline.step(frame).tracks.iter().filter(|track| track.confirmed).count();
        });
        if k < KNOWN_AFTER {
            before += asked.count_total;
            continue;
        }
        assert_eq!(followed, PEOPLE, "frame {k}");
        since.push(asked.count_total);
    }
    assert!(before > 0, "buffers have to come from somewhere");
    assert_eq!(since, vec![0; FRAMES - KNOWN_AFTER]);
}
