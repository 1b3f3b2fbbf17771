//! Plans against what the simulator's own sensors see, and against luck.

use umbracast::site::{AccessPoint, Sensor};
use umbracast::{Config, Mode, Site};
use umbracast_eval::coverage::{Options, survey};
use umbracast_plan::{Wanted, best, map, versus_random};

fn site(name: &str) -> Site {
    let path = format!("{}/../../config/sites/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap();
    Config::with_overlay(Mode::Default, &text, &path).unwrap().site
}

/// A column is no body, so counts differ; where a person is seen must not.
#[test]
fn the_map_agrees_with_the_simulated_sensors() {
    for site in [Config::default().site, site("l-hall")] {
        let truth = survey(&site, Options { step_m: 1.0, height_m: 1.75, headings: 2 }).unwrap();
        let planned = map(&site, 0.0, 1.75, Some(0.5)).unwrap();
        let (mut same, mut ratios, mut places) = (0, Vec::new(), 0);
        for place in &truth.places {
            let floor = &planned.floor;
            let cell =
                (place.position_m - umbracast::geometry::DVec2::from_array(floor.from_m)) / floor.step_m;
            let cell = cell.round().as_usizevec2();
            let index = cell.y.min(floor.rows - 1) * floor.columns + cell.x.min(floor.columns - 1);
            if !floor.open[index] {
                continue;
            }
            places += 1;
            let found = f64::from(planned.returns[index]);
            same += usize::from((place.sensors_seeing() > 0) == (planned.sensors_seeing[index] > 0));
            if place.all_returns() > 30.0 {
                ratios.push(found / place.all_returns());
            }
        }
        ratios.sort_by(f64::total_cmp);
        let median = ratios[ratios.len() / 2];
        println!("{}: seen alike {same} of {places}, median ratio of returns {median:.3}", site.name);
        assert!(same as f64 > 0.95 * f64::from(places), "{}: {same} of {places}", site.name);
        assert!((0.75..1.3).contains(&median), "{}: {median}", site.name);
    }
}

/// The command `umbracast plan --against 1000` prints the same for more placements.
#[test]
fn the_best_places_beat_luck() {
    for name in ["height-6", "l-hall", "hexagon", "corridor", "ramp"] {
        let site = site(name);
        let wanted = Wanted { count: 2, beside: false };
        let sensors = best::<Sensor>(&site, wanted, 20.0, 1.75).unwrap();
        let [lucky, mean] = versus_random::<Sensor>(&site, 2, 20.0, 1.75, (40, 1)).unwrap();
        let reached = *sensors.values.last().unwrap();
        println!(
            "{name}: sensors {reached:.4}, best of 40 random {lucky:.4}, mean {mean:.4}, exact {}",
            sensors.exact
        );
        assert!(reached >= lucky && sensors.bound >= reached, "{name}: {reached} {lucky}");
        let aps = best::<AccessPoint>(&site, wanted, 20.0, 1.75).unwrap();
        let [lucky, _] = versus_random::<AccessPoint>(&site, 2, 20.0, 1.75, (40, 1)).unwrap();
        let reached = *aps.values.last().unwrap();
        assert!(
            reached >= lucky && aps.further.windows(2).all(|two| two[0] <= two[1] + 1e-9),
            "{name}: {reached} {lucky}"
        );
        assert!(aps.placed.iter().all(|ap| ap.name.starts_with("ap_")));
    }
}
