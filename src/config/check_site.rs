//! Refuses impossible sites: things outside the hall, angles and shares out of their range, unknown models.

use super::check_hall::{HALL_MAX_M, above_0, check_hall, within};
use crate::geometry::DVec2;
use crate::lidar::{Model, sensor_model, sensor_models};
use crate::site::{AccessPoint, Furniture, Handover, Pillar, Sensor, Ue};
use crate::{Error, Site};

/// A clock that is further ahead is not set: that is the assembler's to put right.
const CLOCK_MS: f64 = 1000.0;
/// No procedure of a network takes longer.
const LONGEST_MS: f64 = 60_000.0;

/// Refuses the first value that cannot be, with its key, the name of its sensor or access point, what was expected
/// and what was found.
///
/// # Errors
/// As said; names that are empty or given twice, for recordings, tables and links go by them; no sensor.
pub(super) fn check_site(site: &Site) -> Result<(), Error> {
    check_hall(&site.hall)?;
    if site.sensors.is_empty() {
        return Err(Error::new("site.sensors: expected one or more, found none"));
    }
    names("site.sensors", site.sensors.iter().map(|sensor| &*sensor.name))?;
    names("site.access_points", site.access_points.iter().map(|ap| &*ap.name))?;
    site.sensors.iter().try_for_each(|s| sensor(s, site))?;
    site.access_points.iter().try_for_each(|ap| access_point(ap, site))?;
    site.pillars.iter().enumerate().try_for_each(|(i, p)| pillar(i, p, site))?;
    furniture("site.furniture", &site.furniture, site)?;
    ue(&site.ue)?;
    site.handover.as_ref().map_or(Ok(()), handover)?;
    simulation(site)
}

fn sensor(sensor: &Sensor, site: &Site) -> Result<(), Error> {
    let key = |key: &str| format!("site.sensors.{}.{key}", sensor.name);
    if sensor_model(&sensor.model).is_none() {
        let (known, found) = (sensor_models().collect::<Vec<_>>().join(", "), &sensor.model);
        return Err(Error::new(format!("{}: expected one of {known}, found {found:?}", key("model"))));
    }
    // Outdoors, the hall is the part that is watched, and a sensor known by its clouds may stand beside it.
    match sensor_model(&sensor.model) {
        Some("points") => within(&key("position_m, z"), sensor.position_m[2], 0.0, site.hall.height_m)?,
        _ => hung(&key("position_m"), sensor.position_m, site)?,
    }
    let turn = &sensor.rotation_deg;
    within(&key("rotation_deg.yaw"), turn.yaw, -360.0, 360.0)?;
    within(&key("rotation_deg.pitch"), turn.pitch, -90.0, 90.0)?;
    within(&key("rotation_deg.roll"), turn.roll, -180.0, 180.0)?;
    within(&key("clock_offset_ms"), sensor.clock_offset_ms, -CLOCK_MS, CLOCK_MS)?;
    within(&key("rate_hz"), sensor.rate_hz, 1.0, 50.0)?;
    within(&key("cut_deg"), sensor.cut_deg, 0.0, 360.0)?;
    within(&key("range_min_m"), sensor.range_min_m, 0.0, HALL_MAX_M)?;
    above_0(&key("range_max_m"), sensor.range_max_m, HALL_MAX_M)?;
    if sensor.range_max_m <= sensor.range_min_m {
        let (min_m, max_m) = (sensor.range_min_m, sensor.range_max_m);
        let story = format!("{}: expected more than range_min_m, {min_m}, found {max_m}", key("range_max_m"));
        return Err(Error::new(story));
    }
    within(&key("range_noise_m"), sensor.range_noise_m, 0.0, 1.0)?;
    if sensor.address.is_some() && sensor.address_bytes().is_none() {
        let found = sensor.address.as_deref().unwrap_or_default();
        return Err(Error::new(format!("{}: expected an IPv4 address, found {found:?}", key("address"))));
    }
    let file = sensor.calibration_file.as_deref().map(|file| format!(" ({file})")).unwrap_or_default();
    match sensor_model(&sensor.model) {
        Some("points") if sensor.calibration.is_some() || sensor.calibration_file.is_some() => Err(
            Error::new(format!("{}: expected none, because clouds are points already", key("calibration"))),
        ),
        Some("points") => Ok(()),
        _ => Model::of_sensor(sensor)
            .map(|_| ())
            .map_err(|e| e.within(format_args!("site.sensors.{}{file}", sensor.name))),
    }
}

fn simulation(site: &Site) -> Result<(), Error> {
    within("site.simulation.dropout", site.simulation.dropout, 0.0, 1.0)?;
    if let Some(more) = &site.simulation.put_in {
        within("site.simulation.put_in.after_s", more.after_s, 0.0, f64::INFINITY)?;
        furniture("site.simulation.put_in.furniture", &more.furniture, site)?;
    }
    for (key, places_m) in
        [("entrances_m", &site.simulation.entrances_m), ("places_m", &site.simulation.places_m)]
    {
        for (i, place_m) in places_m.iter().enumerate() {
            on_floor(&format!("site.simulation.{key}[{i}]"), *place_m, site)?;
        }
    }
    let (lost, ahead) = (&site.simulation.lost_after_s, &site.simulation.clock_ahead_ms);
    let of = |key: &'static str, least, most| move |(name, &value)| (key, name, value, least, most);
    let lost = lost.iter().map(of("lost_after_s", 0.0, f64::INFINITY));
    let slips = site.simulation.slip.iter().map(|(name, slip)| (name, &slip.after_s));
    let lost = lost.chain(slips.map(of("slip", 0.0, f64::INFINITY)));
    for (name, slip) in &site.simulation.slip {
        let key = |key: &str| format!("site.simulation.slip.{name}.{key}");
        slip.turned_deg.iter().try_for_each(|deg| within(&key("turned_deg"), *deg, -360.0, 360.0))?;
        slip.shifted_m.iter().try_for_each(|m| within(&key("shifted_m"), *m, -HALL_MAX_M, HALL_MAX_M))?;
    }
    let bias = site.simulation.range_bias_m.iter().map(of("range_bias_m", -1.0, 1.0));
    for (key, name, value, least, most) in
        lost.chain(ahead.iter().map(of("clock_ahead_ms", -CLOCK_MS, CLOCK_MS))).chain(bias)
    {
        let key = format!("site.simulation.{key}.{name}");
        if !site.sensors.iter().any(|sensor| sensor.name == *name) {
            let known: Vec<&str> = site.sensors.iter().map(|sensor| &*sensor.name).collect();
            return Err(Error::new(format!("{key}: expected one of {}, found {name}", known.join(", "))));
        }
        within(&key, value, least, most)?;
    }
    optics(site)
}

fn optics(site: &Site) -> Result<(), Error> {
    if let Some(mixed) = &site.simulation.mixed_returns {
        within("site.simulation.mixed_returns.divergence_mrad", mixed.divergence_mrad, 0.0, 100.0)?;
        within("site.simulation.mixed_returns.pulse_m", mixed.pulse_m, 0.0, 10.0)?;
    }
    if let Some(dark) = &site.simulation.dark_cloth {
        within("site.simulation.dark_cloth.people", dark.people, 0.0, 1.0)?;
        within("site.simulation.dark_cloth.dropout", dark.dropout, 0.0, 1.0)?;
    }
    for (i, pane) in site.simulation.panes.iter().enumerate() {
        let key = |key: &str| format!("site.simulation.panes[{i}].{key}");
        let [least, most] = site.hall.bounds_m();
        for (end, [x_m, y_m]) in [("from_m", pane.from_m), ("to_m", pane.to_m)] {
            within(&format!("{}, x (within the hall)", key(end)), x_m, least.x, most.x)?;
            within(&format!("{}, y (within the hall)", key(end)), y_m, least.y, most.y)?;
        }
        if pane.from_m == pane.to_m {
            let found = pane.to_m;
            return Err(Error::new(format!(
                "{}: expected another place than from_m, found {found:?}",
                key("to_m")
            )));
        }
        within(&key("bottom_m"), pane.bottom_m, 0.0, site.hall.height_m)?;
        within(&key("top_m (above bottom_m)"), pane.top_m, pane.bottom_m, site.hall.height_m)?;
    }
    Ok(())
}

fn access_point(ap: &AccessPoint, site: &Site) -> Result<(), Error> {
    let key = |key: &str| format!("site.access_points.{}.{key}", ap.name);
    hung(&key("position_m"), ap.position_m, site)?;
    let Some(radio) = &ap.radio else { return Ok(()) };
    within(&key("radio.carrier_ghz"), radio.carrier_ghz, 0.5, 1000.0)?;
    within(&key("radio.margin_db"), radio.margin_db, 0.0, 60.0)?;
    within(&key("radio.bandwidth_mhz"), radio.bandwidth_mhz, 0.001, 1e5)?;
    within(&key("radio.transmit_dbm"), radio.transmit_dbm, -100.0, 100.0)?;
    within(&key("radio.noise_figure_db"), radio.noise_figure_db, 0.0, 60.0)
}

fn handover(handover: &Handover) -> Result<(), Error> {
    for (key, value_ms) in [
        ("interruption_ms", handover.interruption_ms),
        ("command_ms", handover.command_ms),
        ("age_ms", handover.age_ms),
        ("given_up_after_ms", handover.given_up_after_ms),
        ("recovery_ms", handover.recovery_ms),
        ("price_ms", handover.price_ms),
        ("beam_ms", handover.beam_ms),
    ] {
        within(&format!("site.handover.{key}"), value_ms.unwrap_or_default(), 0.0, LONGEST_MS)?;
    }
    within("site.handover.leaves_at", handover.leaves_at.unwrap_or_default(), 0.0, 1.0)
}

fn pillar(index: usize, pillar: &Pillar, site: &Site) -> Result<(), Error> {
    let key = |key: &str| format!("site.pillars[{index}].{key}");
    on_floor(&key("position_m"), pillar.position_m, site)?;
    above_0(&key("radius_m"), pillar.radius_m, 0.5 * size_m(site).min_element())
}

fn furniture(list: &str, all: &[Furniture], site: &Site) -> Result<(), Error> {
    for (index, furniture) in all.iter().enumerate() {
        let key = |key: &str| format!("{list}[{index}].{key}");
        on_floor(&key("position_m"), furniture.position_m, site)?;
        let [length_m, width_m, height_m] = furniture.size_m;
        let longest_m = size_m(site).x.hypot(size_m(site).y);
        above_0(&key("size_m, x"), length_m, longest_m)?;
        above_0(&key("size_m, y"), width_m, longest_m)?;
        above_0(&key("size_m, z"), height_m, site.hall.height_m)?;
        within(&key("yaw_deg"), furniture.yaw_deg, -360.0, 360.0)?;
    }
    Ok(())
}

fn ue(ue: &Ue) -> Result<(), Error> {
    within("site.ue.forward_m", ue.forward_m, -2.0, 2.0)?;
    within("site.ue.left_m", ue.left_m, -2.0, 2.0)?;
    within("site.ue.spread_m", ue.spread_m, 0.0, 0.5)?;
    // Over the head of who holds it up.
    within("site.ue.height_share", ue.height_share, 0.0, 1.5)
}

fn names<'a>(key: &str, names: impl Iterator<Item = &'a str>) -> Result<(), Error> {
    let mut before = Vec::new();
    for name in names {
        if name.is_empty() || before.contains(&name) {
            let story = format!("{key}: expected a name of its own for each, found {name:?} twice or empty");
            return Err(Error::new(story));
        }
        before.push(name);
    }
    Ok(())
}

/// Sensors and access points: within a rectangle, for it is a room; an outline may be the part of one that is watched.
fn hung(key: &str, [x_m, y_m, z_m]: [f64; 3], site: &Site) -> Result<(), Error> {
    if site.hall.outline_m.is_empty() {
        on_floor(key, [x_m, y_m], site)?;
    } else {
        let [least, most] = site.hall.bounds_m();
        within(&format!("{key}, x (near the hall)"), x_m, least.x - HALL_MAX_M, most.x + HALL_MAX_M)?;
        within(&format!("{key}, y (near the hall)"), y_m, least.y - HALL_MAX_M, most.y + HALL_MAX_M)?;
    }
    within(&format!("{key}, z (from the floor to the ceiling)"), z_m, 0.0, site.hall.height_m)
}

fn on_floor(key: &str, [x_m, y_m]: [f64; 2], site: &Site) -> Result<(), Error> {
    let [least, most] = site.hall.bounds_m();
    within(&format!("{key}, x (within the hall)"), x_m, least.x, most.x)?;
    within(&format!("{key}, y (within the hall)"), y_m, least.y, most.y)?;
    match site.hall.contains(DVec2::new(x_m, y_m)) {
        true => Ok(()),
        false => {
            Err(Error::new(format!("{key}: expected a place within site.hall.outline_m, found {x_m}, {y_m}")))
        }
    }
}

fn size_m(site: &Site) -> DVec2 {
    let [least, most] = site.hall.bounds_m();
    most - least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::{DarkCloth, Pane, PutIn, Slip, Surface};
    use crate::{Config, Mode};

    const SITES: [&str; 10] = [
        include_str!("../../config/sites/hand-mounted.toml"),
        include_str!("../../config/sites/corridor.toml"),
        include_str!("../../config/sites/hexagon.toml"),
        include_str!("../../config/sites/l-hall.toml"),
        include_str!("../../config/sites/logictronix.toml"),
        include_str!("../../config/sites/ouster.toml"),
        include_str!("../../config/sites/lost-sensor.toml"),
        include_str!("../../config/sites/slipping-sensor.toml"),
        include_str!("../../config/sites/turned-sensor.toml"),
        include_str!("../../config/sites/glass.toml"),
    ];

    const PANE: Pane =
        Pane { from_m: [0.0; 2], to_m: [3.0, 0.0], bottom_m: 0.0, top_m: 2.0, surface: Surface::Glass };

    #[test]
    fn every_site_that_ships_is_accepted() {
        for text in SITES.into_iter().chain([""]) {
            let config = Config::with_overlay(Mode::Default, text, "site.toml").unwrap();
            check_site(&config.site).unwrap();
        }
    }

    #[test]
    fn what_cannot_be_is_refused_with_key_name_expected_and_found() {
        type Change = fn(&mut Site);
        let wrong: [(Change, &str); 35] = [
            (|s| s.hall.height_m = 0.0, "site.hall.height_m: expected more than 0 and 1000 at most, found 0"),
            (|s| s.hall.width_m = f64::NAN, "site.hall.width_m: expected more than 0"),
            (|s| s.sensors.clear(), "site.sensors: expected one or more, found none"),
            (|s| s.sensors[1].name = "lidar_east".into(), "site.sensors: expected a name of its own"),
            (|s| s.access_points[0].name.clear(), "site.access_points: expected a name of its own"),
            (
                |s| s.sensors[0].model = "hdl-64".into(),
                "site.sensors.lidar_east.model: expected one of hdl-32e, vlp-16, os0-128,",
            ),
            (
                |s| s.sensors[0].position_m[2] = -1.0,
                "site.sensors.lidar_east.position_m, z (from the floor to the ceiling): expected 0 to 10, found -1",
            ),
            (|s| s.sensors[1].position_m[2] = 11.0, "site.sensors.lidar_west.position_m, z"),
            (
                |s| s.sensors[0].position_m[0] = 40.0,
                "site.sensors.lidar_east.position_m, x (within the hall): expected -17 to 17, found 40",
            ),
            (
                |s| s.sensors[0].rotation_deg.pitch = 120.0,
                "site.sensors.lidar_east.rotation_deg.pitch: expected -90 to 90, found 120",
            ),
            (|s| s.sensors[0].rotation_deg.yaw = f64::INFINITY, "site.sensors.lidar_east.rotation_deg.yaw"),
            (|s| s.sensors[0].rotation_deg.roll = 181.0, "site.sensors.lidar_east.rotation_deg.roll"),
            (
                |s| s.sensors[0].rate_hz = 600.0,
                "site.sensors.lidar_east.rate_hz: expected 1 to 50, found 600",
            ),
            (
                |s| s.sensors[0].cut_deg = 500.0,
                "site.sensors.lidar_east.cut_deg: expected 0 to 360, found 500",
            ),
            (
                |s| s.sensors[0].range_min_m = 60.0,
                "site.sensors.lidar_east.range_max_m: expected more than range_min_m, 60, found 50",
            ),
            (|s| s.sensors[0].range_noise_m = -0.1, "site.sensors.lidar_east.range_noise_m: expected 0 to 1"),
            (
                |s| s.sensors[0].address = Some("192.168.1".into()),
                "site.sensors.lidar_east.address: expected an IPv4 address, found \"192.168.1\"",
            ),
            (
                |s| s.sensors[0].calibration = Some("{}".into()),
                "site.sensors.lidar_east: calibration: expected none, because all hdl-32e have the same beams",
            ),
            (
                |s| {
                    s.sensors[0].model = "points".into();
                    s.sensors[0].calibration = Some("{}".into());
                },
                "site.sensors.lidar_east.calibration: expected none",
            ),
            (
                |s| {
                    s.sensors[1].model = "os0-128".into();
                    s.sensors[1].calibration_file = Some("lidar.json".into());
                    s.sensors[1].calibration = Some("{".into());
                },
                "site.sensors.lidar_west (lidar.json): calibration: expected the sensor's metadata as JSON, found EOF",
            ),
            (
                |s| {
                    s.sensors[1].model = "xt32".into();
                    s.sensors[1].calibration = Some("Channel,Elevation,Azimuth\n1,15.0".into());
                },
                "site.sensors.lidar_west: calibration: line 2: expected channel 1 of 32, its elevation and azimuth",
            ),
            (
                |s| s.simulation.put_in = Some(PutIn { after_s: -1.0, furniture: Vec::new() }),
                "site.simulation.put_in.after_s: expected",
            ),
            (|s| s.simulation.dropout = 2.0, "site.simulation.dropout: expected 0 to 1, found 2"),
            (
                |s| s.simulation.lost_after_s = [("door".to_owned(), 3.0)].into(),
                "site.simulation.lost_after_s.door: expected one of lidar_east, lidar_west, found door",
            ),
            (
                |s| s.simulation.clock_ahead_ms = [("door".to_owned(), 3.0)].into(),
                "site.simulation.clock_ahead_ms.door: expected one of lidar_east, lidar_west, found door",
            ),
            (
                |s| s.simulation.range_bias_m = [("lidar_west".to_owned(), 3.0)].into(),
                "site.simulation.range_bias_m.lidar_west: expected -1 to 1, found 3",
            ),
            (
                |s| s.simulation.dark_cloth = Some(DarkCloth { people: 0.5, dropout: 20.0 }),
                "site.simulation.dark_cloth.dropout: expected 0 to 1, found 20",
            ),
            (
                |s| s.simulation.panes = vec![Pane { to_m: [3.0, 18.0], ..PANE }],
                "site.simulation.panes[0].to_m, y (within the hall): expected -17 to 17, found 18",
            ),
            (
                |s| s.sensors[1].clock_offset_ms = f64::NAN,
                "site.sensors.lidar_west.clock_offset_ms: expected -1000 to 1000, found NaN",
            ),
            (|s| s.access_points[1].position_m[2] = 12.0, "site.access_points.centre.position_m, z"),
            (|s| s.access_points[0].position_m[1] = -30.0, "site.access_points.side.position_m, y"),
            (|s| s.pillars[2].radius_m = -1.0, "site.pillars[2].radius_m: expected more than 0"),
            (|s| s.furniture[1].size_m[2] = 20.0, "site.furniture[1].size_m, z: expected more than 0 and 10"),
            (|s| s.furniture[0].position_m[0] = 99.0, "site.furniture[0].position_m, x"),
            (|s| s.ue.height_share = 50.0, "site.ue.height_share: expected 0 to 1.5, found 50"),
        ];
        for (change, story) in wrong {
            let mut site = Config::default().site;
            change(&mut site);
            let found = check_site(&site).unwrap_err().to_string();
            assert!(found.starts_with(story), "{found}");
        }
    }

    /// A sensor of the simulation turned by what is no number.
    #[test]
    fn a_slip_is_a_turn_and_a_shift() {
        for (turned_deg, shifted_m, key) in
            [([f64::NAN; 3], [0.0; 3], "turned_deg"), ([0.0; 3], [2e3; 3], "shifted_m")]
        {
            let mut site = Config::default().site;
            let slip = Slip { after_s: 1.0, turned_deg, shifted_m };
            site.simulation.slip = [("lidar_west".to_owned(), slip)].into();
            let found = check_site(&site).unwrap_err().to_string();
            assert!(
                found.starts_with(&format!("site.simulation.slip.lidar_west.{key}: expected")),
                "{found}"
            );
        }
    }

    #[test]
    fn what_a_sensor_may_have_beside_is_understood_and_survives_a_recording() {
        let text = "[[site.sensors]]\nname = \"door\"\nmodel = \"xt32\"\nposition_m = [16.0, 0.0, 9.0]\n\
                    rotation_deg = { yaw = 180.0, pitch = 35.0, roll = 0.0 }\ncalibration_file = \"a.csv\"\n\
                    udp_port = 2370\naddress = \"10.0.0.7\"\n";
        let config = Config::with_overlay(Mode::Default, text, "lab.toml").unwrap();
        let angles: String = (1..=32).map(|c| format!("{c},{}.5,-0.1\n", 15 - c)).collect();
        let config =
            config.with_calibrations(|_| Ok(format!("Channel,Elevation,Azimuth\n{angles}"))).unwrap();
        assert_eq!(Config::of_run(&config.to_toml(), "config.toml").unwrap(), config);
        let again =
            config.clone().with_calibrations(|_| panic!("its text stands in the file already")).unwrap();
        assert_eq!(again, config);

        let message =
            |text: &str| Config::with_overlay(Mode::Default, text, "lab.toml").unwrap_err().to_string();
        let found = message(&text.replace("2370", "\"2370\""));
        assert_eq!(found, "lab.toml:7:12: site.sensors.udp_port: expected a whole number, found a string");
        let config = Config::with_overlay(Mode::Default, text, "lab.toml").unwrap();
        let found = config.with_calibrations(|_| Ok("1,2".to_owned())).unwrap_err().to_string();
        assert!(
            found.starts_with("site.sensors.door (a.csv): calibration: line 1: expected channel 1"),
            "{found}"
        );
    }

    /// Six values were to be repeated for each sensor though all are defaults.
    #[test]
    fn a_sensor_needs_name_place_and_rotation_alone() {
        let text = "[[site.sensors]]\nname = \"door\"\nposition_m = [16.0, 0.0, 9.0]\n\
                    rotation_deg = { yaw = 180.0, pitch = 35.0, roll = 0.0 }\n";
        let site = Config::with_overlay(Mode::Default, text, "lab.toml").unwrap().site;
        check_site(&site).unwrap();
        let default = &Config::default().site.sensors[0];
        let expected = Sensor { name: "door".into(), ..default.clone() };
        assert_eq!(site.sensors, [expected]);
        let unknown = format!("{text}range_m = 3.0\n");
        let message = Config::with_overlay(Mode::Default, &unknown, "lab.toml").unwrap_err().to_string();
        assert!(message.starts_with("lab.toml:5:") && message.contains("`range_m`"), "{message}");
    }
}
