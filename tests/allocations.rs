//! Once everybody is known, a step of the default mode allocates no memory, so a frame's time does not depend on an
//! allocator. Only a buffer that a frame outgrows doubles, which grows rarer and rarer.

use umbracast::geometry::DVec2;
use umbracast::{Config, Pipeline};
use umbracast_sim::crowd::{Crowd, Trajectory};

#[allow(dead_code)] // Nobody is to be found here, so the truth is not looked at.
#[path = "../examples/simulated/mod.rs"]
mod simulated;

/// Each walks to and fro on a line of one's own, there in so many frames and back in as many.
const PEOPLE: usize = 10;
const THERE: usize = 30;
/// Where they walk once more on the same lines, buffers are about as large as they will ever be: about, for nobody takes the
/// same step twice.
const KNOWN_AFTER: usize = 6 * THERE;
const FRAMES: usize = 8 * THERE;
/// How many buffers may double yet, of all that a pipeline holds.
const DOUBLED: u64 = 3;

/// On lines so far apart, in the west and in the east of the hall in turn, from the middles between.
fn to_and_fro(lines_m: f64, middles_m: [f64; 2]) -> Crowd {
    let position = |person: usize, step: usize| {
        let turn = std::f64::consts::PI * step as f64 / (10 * THERE) as f64;
        let (side, ahead) = if person.is_multiple_of(2) { (middles_m[0], 1.0) } else { (middles_m[1], -1.0) };
        let line = person as f64 - 0.5 * (PEOPLE - 1) as f64;
        DVec2::new(side + 1.8 * ahead * turn.cos(), lines_m * line)
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

/// How often each step asks for memory in which nobody new is thought of, once everybody is known.
fn asked(crowd: Crowd) -> Vec<u64> {
    let config = Config::default();
    let recording = simulated::walking(&config.site, crowd, FRAMES).expect("the default site is simulated");
    let mut pipeline = Pipeline::new(&config, None).expect("the defaults work");
    recording.empty.iter().for_each(|frame| pipeline.learn_empty(frame));
    let (mut before, mut since, mut newest) = (0, Vec::new(), None);
    for (k, frame) in recording.frames.iter().enumerate() {
        let (mut followed, last) = (0, newest);
        let asked = allocation_counter::measure(|| {
            let tracks = &pipeline.step(frame).tracks;
            followed = tracks.iter().filter(|track| track.confirmed).count();
            newest = tracks.iter().map(|track| track.id).max();
        });
        if k < KNOWN_AFTER {
            before += asked.count_total;
            continue;
        }
        assert_eq!(followed, PEOPLE, "frame {k}");
        if last == newest {
            since.push(asked.count_total);
        }
    }
    assert!(before > 0, "buffers have to come from somewhere");
    since
}

#[test]
fn a_step_allocates_nothing_once_everybody_is_known() {
    let asked = asked(to_and_fro(1.4, [-6.0, 2.0]));
    assert_eq!(asked.len(), FRAMES - KNOWN_AFTER);
    assert!(asked.iter().sum::<u64>() <= DOUBLED, "{asked:?}");
}

/// They pass each other on lines as near as people come, three times there and back before it counts.
#[test]
fn a_step_allocates_nothing_where_people_touch() {
    let asked = asked(to_and_fro(0.45, [-2.0, -2.0]));
    assert!(asked.len() > FRAMES - KNOWN_AFTER - 5 && asked.iter().sum::<u64>() <= DOUBLED, "{asked:?}");
}
