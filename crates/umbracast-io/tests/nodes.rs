//! Messages between nodes survive the network to the last bit, and no other bytes are accepted.

use umbracast::detect::{Point, Prior, Shape};
use umbracast::forecast::Forecast;
use umbracast::geometry::{DVec2, DVec3, Pose};
use umbracast::lidar::{Fan, SECTORS, View};
use umbracast::track::{Canopy, Observed, Track};
use umbracast_io::fields::{Message, decode, encode};
use umbracast_io::nodes::{Followed, Foreground, NodeHealth, Priors, TrackerState, Warning};

const TIME_NS: i64 = 1_795_330_000_100_000_000;

fn foreground() -> Foreground {
    let site_from_sensor = Pose::from_yaw_pitch_roll_deg(DVec3::new(16.0, 0.0, 9.0), 180.0, 35.0, 0.1);
    let fan = Fan { elevations_rad: vec![-0.5, 0.1, 0.3], columns: [24; SECTORS] };
    let point =
        Point { position_m: DVec3::new(0.1, 1.0 / 3.0, f64::MIN_POSITIVE), time_ns: TIME_NS - 7, sensor: 1 };
    Foreground {
        time_ns: TIME_NS,
        sensors: vec!["east".to_owned(), "west".to_owned()],
        covers: vec![1],
        views: vec![
            View { sensor: 1, site_from_sensor, fan: Some(fan) },
            View { sensor: 0, site_from_sensor: Pose::IDENTITY, fan: None },
        ],
        points: vec![point; 3],
        closed_ns: TIME_NS + 5,
        took_ns: 9,
        ..Foreground::default()
    }
}

fn followed() -> Followed {
    let observed = Observed { time_ns: TIME_NS, position_m: DVec2::new(0.1, 0.2), velocity_mps: DVec2::X };
    let canopy = Some(Canopy::of_numbers([0.1, 0.2, 0.5, 1.8, 2.0]));
    let mut track = Track { id: 3, points: 7, confirmed: true, canopy, part_of: Some(2), ..Track::empty() };
    track.covariance[1][2] = 0.1;
    track.observed.extend([observed; 2]);
    let mut forecast = Forecast { track: 3, ..Forecast::empty() };
    forecast.steps[8].xy_m2 = 0.3;
    forecast.coupling.state[3][0] = 0.7;
    Followed {
        time_ns: TIME_NS,
        frame: 9,
        tracks: vec![track],
        forecasts: vec![forecast],
        sensors: vec![0, 1],
        ..Followed::default()
    }
}

/// Comes back as it was; cut anywhere it is nothing.
fn survives<M: Message + PartialEq + std::fmt::Debug>(mut message: M) {
    let bytes = encode(&mut message);
    assert_eq!(decode::<M>(&bytes).as_ref(), Some(&message));
    for cut in 0..bytes.len() {
        assert!(decode::<M>(&bytes[..cut]).is_none(), "{}, cut at {cut} of {}", M::NAME, bytes.len());
    }
}

#[test]
fn every_message_survives_and_a_part_of_it_is_none() {
    survives(foreground());
    survives(followed());
    let mut shape = Shape::default();
    shape.bands[4].add(DVec2::new(0.2, -0.1));
    let prior = Prior { height_m: 1.7, confirmed: true, ..Prior::empty() };
    let priors = vec![prior, Prior { shape: Some(shape), ..prior }];
    survives(Priors { time_ns: TIME_NS, tracker: "a".to_owned(), term: 5, numbers: 6, priors });
    survives(TrackerState {
        time_ns: 1,
        first_ns: 2,
        term: 3,
        version: "0.1.0".to_owned(),
        tracker: vec![1, 2, 3],
    });
    survives(Warning { state: "blocked".to_owned(), onset_s: [0.1, 0.2, 0.3], ..Warning::default() });
    survives(NodeHealth {
        stages: vec!["track".to_owned()],
        leads: true,
        empty_hall: true,
        troubles: vec!["clock of east 2.0 s off".to_owned()],
        ..NodeHealth::default()
    });
}

#[test]
fn a_length_that_is_not_there_takes_no_memory() {
    let mut bytes = encode(&mut foreground());
    // The number of the sensors' names, behind time and frame.
    let at = 4 + 8 + 4 + "site".len() + 1 + 3;
    assert_eq!(bytes[at..at + 4], [2, 0, 0, 0]);
    bytes[at..at + 4].fill(0xff);
    assert!(decode::<Foreground>(&bytes).is_none());
}
