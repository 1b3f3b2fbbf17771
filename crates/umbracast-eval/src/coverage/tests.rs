//! The survey against scenes, and what it says of a hall.

use super::*;
use umbracast::{Config, Mode, STEP_NS};
use umbracast_sim::crowd::Crowd;
use umbracast_sim::scene::Scene;

fn site() -> Site {
    Config::for_mode(Mode::Default).site
}

const COARSE: Options = Options { step_m: 4.0, height_m: 1.72, headings: 4 };

#[test]
fn a_place_gives_the_returns_that_people_who_stand_there_have_in_scenes() {
    let site = site();
    let places = [(0.0, 0.0), (8.0, 4.0), (-8.0, 8.0), (0.0, -12.0), (12.0, 4.0)];
    // Everybody comes walking for a second, and then stands for one before the first frame.
    let stand = |person: u32, place_m: DVec2, ahead: DVec2| Trajectory {
        person,
        start_ns: -2_000_000_000,
        step_ns: 10_000_000,
        positions_m: (0..240).map(|i| place_m - ahead * (1.0 - 0.01 * f64::from(i)).max(0.0)).collect(),
        arrived_ns: None,
        height_m: Some(1.72),
    };
    let mut simulated = [0.0; 5];
    let (scenes, frames) = (64, 2);
    for seed in 0..scenes {
        let ahead = DVec2::from_angle(seed as f64 / scenes as f64 * TAU);
        let trajectories =
            (0..).zip(places).map(|(person, place)| stand(person, place.into(), ahead)).collect();
        let crowd = Crowd { trajectories, duration_ns: frames * STEP_NS };
        let mut scene = Scene::new(crowd, &site, seed).unwrap();
        while let Some(frame) = scene.next_frame() {
            for (sum, person) in simulated.iter_mut().zip(&frame.people) {
                *sum += f64::from(person.returns) / (scenes as f64 * frames as f64);
            }
        }
    }
    let coverage = survey(&site, Options { headings: 16, ..COARSE }).unwrap();
    for ((x, y), simulated) in places.into_iter().zip(simulated) {
        let place = coverage.places.iter().find(|place| place.position_m == DVec2::new(x, y)).unwrap();
        let surveyed = place.all_returns();
        // Other builds, and noise.
        assert!((surveyed / simulated - 1.0).abs() < 0.12, "({x}, {y}): {surveyed}, in scenes {simulated}");
        assert!(surveyed > 15.0);
    }
}

#[test]
fn nobody_stands_in_pillars_furniture_and_walls() {
    let site = site();
    let coverage = survey(&site, Options { step_m: 0.5, headings: 1, ..COARSE }).unwrap();
    let stands = |x: f64, y: f64| coverage.places.iter().any(|place| place.position_m == DVec2::new(x, y));
    assert!(stands(0.0, 0.0) && stands(16.5, -16.5));
    assert!(!stands(17.0, 0.0), "the wall");
    assert!(!stands(11.5, 11.5), "a pillar");
    assert!(!stands(0.0, 16.0), "the counter");
}

#[test]
fn a_pillar_hides_people_and_cuts_links() {
    let mut site = site();
    site.sensors.truncate(1);
    site.sensors[0].position_m = [-16.0, 0.0, 4.0];
    site.sensors[0].rotation_deg.pitch = 15.0;
    site.sensors[0].rotation_deg.yaw = 0.0;
    site.pillars.truncate(1);
    (site.pillars[0].position_m, site.pillars[0].radius_m) = ([-4.0, 0.0], 1.0);
    let coverage = survey(&site, COARSE).unwrap();
    let at = |x: f64, y: f64| {
        coverage.places.iter().find(|place| place.position_m == DVec2::new(x, y)).unwrap().clone()
    };
    let (hidden, seen) = (at(0.0, 0.0), at(-8.0, 0.0));
    assert_eq!((hidden.all_returns(), hidden.span_m), (0.0, None));
    assert!(seen.all_returns() > 50.0 && seen.span_m.unwrap().1 > 1.5, "{seen:?}");
    // The pillar stands between the access point `side` at x = 14 and x = -8, and not before x = 0.
    assert!(seen.static_blocked[0] && !hidden.static_blocked[0]);
    let summary = summary(&site, &coverage).unwrap();
    assert!(summary.rows.len() == 2 && summary.rows[0].none > 0.0, "{summary:?}");
    assert!(summary.regions.iter().any(|region| region.worst_m == [0.0, 0.0] || region.x_m[0] <= 0.0));
    assert!(summary.to_text().contains("Fewer than 6 returns"));
}

#[test]
fn shares_add_up_and_the_picture_holds_every_place_and_name() {
    let site = site();
    let coverage = survey(&site, COARSE).unwrap();
    let summary = summary(&site, &coverage).unwrap();
    for row in &summary.rows {
        assert!((row.none + row.few + row.seen - 1.0).abs() < 1e-12 && row.well_seen <= row.seen, "{row:?}");
    }
    let names: Vec<&str> = summary.rows.iter().map(|row| row.what.as_str()).collect();
    assert_eq!(names[..3], ["the whole floor", "within 12.5 m", "lidar_east alone"]);
    let picture = svg(&site, &coverage);
    for words in ["lidar_east, 9 m up", "side", "centre", "none: blind", "64 or more"] {
        assert!(picture.contains(words), "{words}");
    }
    assert_eq!(picture, svg(&site, &coverage));
    let columns = columns(&site, &coverage);
    assert!(columns.iter().all(|(_, values)| values.len() == coverage.places.len()));
    assert!(columns.iter().any(|(name, _)| name == "returns_lidar_west"));
}

#[test]
fn what_cannot_be_surveyed_is_refused_with_its_reason() {
    let refused = |change: &dyn Fn(&mut Site, &mut Options)| {
        let (mut site, mut options) = (site(), COARSE);
        change(&mut site, &mut options);
        survey(&site, options).unwrap_err().to_string()
    };
    let cases: [(String, &str); 5] = [
        (refused(&|site, _| site.sensors.clear()), "site.sensors: expected one or more, found none"),
        (refused(&|site, _| site.hall.width_m = 0.3), "found 34 x 0.3 m"),
        (refused(&|site, _| site.sensors[0].model = "points".into()), "lidar_east"),
        (refused(&|_, options| options.step_m = 0.0), "step"),
        (refused(&|_, options| options.headings = 0), "headings"),
    ];
    for (message, words) in cases {
        assert!(message.contains(words), "{message}");
    }
}
