//! Small scenes with known answers, for the tests of the scores.

use umbracast::{STEP_NS, STEPS};
use umbracast_io::rows::{LinkRow, PeopleLinkRow, PeopleRow, TrackRow};

use crate::score::scene::SceneTruth;

/// `people` persons who stand 10 m apart for `frames` frames, one access point; `blocked` takes
/// (person, frame).
pub fn truth_of(people: u32, frames: u64, blocked: impl Fn(u32, u64) -> bool) -> SceneTruth {
    let mut truth = SceneTruth::default();
    for frame in 0..frames {
        for person in 0..people {
            let time_ns = (frame as i64 + 1) * STEP_NS;
            truth.people.push(PeopleRow {
                scene: 0,
                frame,
                time_ns,
                person,
                x_m: f64::from(person) * 10.0,
                y_m: 0.0,
                vx_mps: 0.0,
                vy_mps: 0.0,
                heading_rad: 0.0,
                height_m: 1.7,
                arrived: false,
                returns: 30,
            });
            truth.links.push(PeopleLinkRow {
                scene: 0,
                frame,
                time_ns,
                access_point: 0,
                person,
                blocked: blocked(person, frame),
                static_blocked: false,
                self_blocked: None,
            });
        }
    }
    truth
}

/// What a run says of a track at a frame, the same for every window.
pub fn link_row(frame: u64, track: u64, blocked: bool) -> LinkRow {
    let p = if blocked { 1.0 } else { 0.0 };
    LinkRow { frame, track, blocked: [blocked; STEPS], p: [p; STEPS], ..LinkRow::default() }
}

/// A confirmed track that stands still.
pub fn track_row(frame: u64, track: u64, x_m: f64, y_m: f64) -> TrackRow {
    TrackRow { frame, track, x_m, y_m, confirmed: true, ..TrackRow::default() }
}
