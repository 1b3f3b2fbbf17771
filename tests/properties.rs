//! What must hold of any hall and any people: where the zero of time and place is, and who walks elsewhere, changes no answer;
//! more body and more doubt change it in the direction they must.

use umbracast::blockage::{Blockage, Caster};
use umbracast::config::ForecastMethod;
use umbracast::forecast::Forecaster;
use umbracast::geometry::{DVec2, DVec3, Pose};
use umbracast::lidar::{Cloud, Frame};
use umbracast::site::{AccessPoint, Site};
use umbracast::track::Track;
use umbracast::{Config, Mode, Outcome, Pipeline};

#[path = "../examples/simulated/mod.rs"]
mod simulated;
use simulated::{Recording, crossing};

const YEAR_NS: i64 = 365 * 24 * 3600 * 1_000_000_000;

fn recording() -> Recording {
    crossing(&Config::default().site, 8, 6.0, 45).unwrap()
}

fn outcomes(config: &Config, empty: &[Frame], frames: &[Frame]) -> Vec<Outcome> {
    let mut pipeline = Pipeline::new(config, None).unwrap();
    empty.iter().for_each(|frame| pipeline.learn_empty(frame));
    frames.iter().map(|frame| pipeline.step(frame).clone()).collect()
}

fn later(frames: &[Frame]) -> Vec<Frame> {
    let mut frames = frames.to_vec();
    for frame in &mut frames {
        frame.time_ns += YEAR_NS;
        for scan in &mut frame.scans {
            match &mut scan.cloud {
                Cloud::Organised(image) => {
                    image.columns.iter_mut().for_each(|column| column.time_ns += YEAR_NS)
                }
                Cloud::Unorganised(points) => points.iter_mut().for_each(|point| point.time_ns += YEAR_NS),
            }
        }
    }
    frames
}

#[test]
fn a_year_later_everything_is_the_same() {
    let recording = recording();
    let (empty, frames) = (later(&recording.empty), later(&recording.frames));
    for mode in [Mode::Default, Mode::Hdl, Mode::Paper] {
        // The paper's weights are no part of the package: its other stages are asked.
        let config = Config { forecast: Config::default().forecast, ..Config::for_mode(mode) };
        let now = outcomes(&config, &recording.empty, &recording.frames);
        let then = outcomes(&config, &empty, &frames);
        assert!(now.last().is_some_and(|outcome| outcome.tracks.len() > 5), "{mode:?}");
        for (now, then) in now.iter().zip(&then) {
            assert_eq!(now.time_ns + YEAR_NS, then.time_ns);
            assert_eq!(now.blockages, then.blockages, "{mode:?}");
            let state = |track: &Track| (track.id, track.position_m, track.velocity_mps, track.covariance);
            assert!(now.tracks.iter().map(state).eq(then.tracks.iter().map(state)), "{mode:?}");
        }
    }
}

/// The hall with all that stands and hangs in it, turned about the origin and carried off.
fn moved(mut site: Site, by: &Pose, turn_rad: f64) -> Site {
    let plan = |[x, y]: [f64; 2]| by.point(DVec3::new(x, y, 0.0)).truncate().to_array();
    let [least, most] = site.hall.bounds_m();
    site.hall.outline_m =
        [least.to_array(), [most.x, least.y], most.to_array(), [least.x, most.y]].map(plan).to_vec();
    site.pillars.iter_mut().for_each(|pillar| pillar.position_m = plan(pillar.position_m));
    for piece in &mut site.furniture {
        piece.position_m = plan(piece.position_m);
        piece.yaw_deg += turn_rad.to_degrees();
    }
    for place in site.sensors.iter_mut().map(|sensor| &mut sensor.position_m) {
        *place = by.point(DVec3::from_array(*place)).to_array();
    }
    site.sensors.iter_mut().for_each(|sensor| sensor.rotation_deg.yaw += turn_rad.to_degrees());
    for place in site.access_points.iter_mut().map(|ap| &mut ap.position_m) {
        *place = by.point(DVec3::from_array(*place)).to_array();
    }
    site
}

#[test]
fn a_hall_that_is_turned_and_carried_off_has_the_same_people_in_it() {
    let recording = recording();
    let turn_rad = 0.6;
    let by = Pose {
        rotation: umbracast::geometry::DMat3::from_rotation_z(turn_rad),
        translation_m: DVec3::new(120.0, -45.0, 0.0),
    };
    let mut config = Config::default();
    // A hall with an outline of its own, for both, so that the two differ by the turn alone.
    config.site = moved(config.site, &Pose::IDENTITY, 0.0);
    let here = outcomes(&config, &recording.empty, &recording.frames);
    config.site = moved(config.site, &by, turn_rad);
    let elsewhere = |frames: &[Frame]| {
        let mut frames = frames.to_vec();
        for scan in frames.iter_mut().flat_map(|frame| &mut frame.scans) {
            scan.site_from_sensor = config.site.sensors[scan.sensor].site_from_sensor();
        }
        frames
    };
    let there = outcomes(&config, &elsewhere(&recording.empty), &elsewhere(&recording.frames));
    // Who is seen first in a frame has the lower number, which depends on the axes: the nearest is the same.
    let apart_m = |here: &[DVec2], there: &[DVec2]| {
        assert_eq!(here.len(), there.len());
        let nearest_m = |at_m: &DVec2| {
            let moved_m = by.point(at_m.extend(0.0)).truncate();
            there.iter().map(|there_m| there_m.distance(moved_m)).fold(f64::INFINITY, f64::min)
        };
        here.iter().map(nearest_m).fold(0.0, f64::max)
    };
    let detected = |outcome: &Outcome| outcome.detections.iter().map(|d| d.position_m).collect::<Vec<_>>();
    let tracked = |outcome: &Outcome| outcome.tracks.iter().map(|t| t.position_m).collect::<Vec<_>>();
    for (k, (here, there)) in here.iter().zip(&there).enumerate() {
        let detected_m = apart_m(&detected(here), &detected(there));
        let tracked_m = apart_m(&tracked(here), &tracked(there));
        // Nothing is rounded before there are tracks. What a new one is taken for is not the same in every direction, to less than a
        // millimetre; that fades as it grows older.
        let room_m = [1e-9, 1e-3, 1e-4][usize::from(k > 0) + usize::from(k > 30)];
        assert!(detected_m < room_m && tracked_m < room_m, "frame {k}: {detected_m} m, {tracked_m} m");
    }
    let people = recording.truth.last().map(|frame| frame.people.len());
    assert_eq!(here.last().map(|outcome| outcome.tracks.len()), people, "everybody was compared");
}

/// What stage 3 says of tracks, all of them with their forecasts.
fn cast(config: &Config, tracks: &[Track]) -> Vec<Blockage> {
    let (mut forecasts, mut blockages) = (Vec::new(), Vec::new());
    Forecaster::new(&config.forecast, None).unwrap().forecast(tracks, &mut forecasts);
    Caster::new(&config.blockage, &config.site).cast(tracks, &forecasts, &mut blockages);
    blockages
}

/// One access point in a wide hall, and people who go on as they walk: a network that learned how they evade one another
/// looks at all of them.
fn one_access_point() -> Config {
    let mut config = Config::default();
    config.forecast.method = ForecastMethod::ConstantVelocity;
    config.site.access_points =
        vec![AccessPoint { name: "one".into(), position_m: [-12.0, 0.0, 2.5], radio: None }];
    config
}

/// One who is asked, and one 3 m before him, `aside_m` from the line and on the way to it or along it.
fn two(aside_m: f64, across_mps: f64) -> [Track; 2] {
    let asked = Track::new(1, DVec2::new(2.0, 0.0), DVec2::ZERO);
    [asked, Track::new(2, DVec2::new(-1.0, aside_m), DVec2::new(0.0, across_mps))]
}

/// That the one who is asked is blocked within the last window.
fn p_of(config: &Config, tracks: &[Track]) -> f64 {
    let blockages = cast(config, tracks);
    blockages.iter().find(|link| link.track == 1).map(|link| link.p[8]).unwrap()
}

#[test]
fn nobody_is_hidden_by_himself_where_the_device_is_on_the_axis() {
    let config = one_access_point();
    for x_m in [-11.5, -8.0, 0.0, 9.0] {
        let link = cast(&config, &[Track::new(1, DVec2::new(x_m, 0.3), DVec2::new(0.0, 1.2))]).remove(0);
        assert_eq!((link.p_now, link.p, link.own), (0.0, [0.0; 9], None));
    }
}

#[test]
fn who_walks_elsewhere_changes_nobodys_answer() {
    let config = one_access_point();
    let [asked, before] = two(-0.5, 0.9);
    let alone = cast(&config, &[asked.clone(), before.clone()]);
    // Behind the access point, behind the one who is asked, and far aside.
    let far = [(-14.0, 0.2), (9.0, 0.1), (0.0, -9.0), (1.0, 8.0)];
    for (x_m, y_m) in far {
        let other = Track::new(3, DVec2::new(x_m, y_m), DVec2::new(0.3, 0.0));
        let among = cast(&config, &[asked.clone(), before.clone(), other]);
        assert_eq!(alone[..], among[..2], "somebody at {x_m}, {y_m}");
    }
    assert!(alone[0].p[8] > 0.5, "the one before him does matter");
}

#[test]
fn more_body_never_blocks_less() {
    let config = one_access_point();
    for aside_m in [0.0, 0.2, 0.3, 0.4, 0.6] {
        let mut before = 0.0;
        for width in [0.6, 0.8, 1.0, 1.2, 1.4] {
            let [asked, mut other] = two(aside_m, 0.0);
            other.width_scale = width;
            let p = p_of(&config, &[asked, other]);
            assert!(p >= before, "{aside_m} m aside, width {width}: {p} after {before}");
            before = p;
        }
    }
}

#[test]
fn doubt_makes_what_is_sure_less_sure() {
    let mut config = one_access_point();
    // Chances of some hundredths are asked: as many samples as usual tell them to a hundredth.
    config.blockage.samples = 1024;
    let with_doubt = |aside_m: f64, sigma_m: f64| {
        let [asked, mut other] = two(aside_m, 0.0);
        (0..2).for_each(|i| other.covariance[i][i] = sigma_m * sigma_m);
        (2..4).for_each(|i| other.covariance[i][i] = 1e-6);
        p_of(&config, &[asked, other])
    };
    let sigmas_m = [0.01, 0.1, 0.2, 0.4, 0.8];
    let [hidden, clear] = [0.0, 1.2].map(|aside_m| sigmas_m.map(|sigma_m| with_doubt(aside_m, sigma_m)));
    assert!(hidden.is_sorted_by(|a, b| a >= b) && hidden[0] > 0.99 && hidden[4] < 0.7, "{hidden:?}");
    assert!(clear.is_sorted() && clear[0] < 0.01 && clear[4] > 0.05, "{clear:?}");
}

#[test]
fn a_mirror_image_is_answered_alike() {
    let config = one_access_point();
    for (aside_m, across_mps) in [(0.0, 0.0), (-0.9, 1.2), (-0.4, 0.3), (0.5, -1.0), (-1.2, 1.3)] {
        let [left, right] = [1.0, -1.0].map(|side| p_of(&config, &two(side * aside_m, side * across_mps)));
        // As many samples as there are, each side drawn by itself.
        assert!((left - right).abs() < 0.12, "{aside_m}: {left} and {right}");
    }
}
