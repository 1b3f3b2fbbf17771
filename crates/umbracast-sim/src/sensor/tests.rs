//! Sensors against an independent ray caster, and what they promise.

use std::f64::consts::PI;

use umbracast::geometry::DVec2;
use umbracast::lidar::{Column, packet};
use umbracast::site::{Floor, Pane, Rotation, Surface};
use umbracast::{Config, Health, STEP_NS};

use super::oracle::Oracle;
use super::*;
use crate::crowd::Trajectory;

fn site() -> Site {
    Config::default().site
}

#[test]
fn the_hall_is_as_an_independent_caster_sees_it() {
    let site = site();
    let mut sensors = Sensors::new(&site, 0).unwrap();
    assert_as_the_oracle_sees(&site, &mut sensors, 3, 1, &[]);
}

#[test]
fn ramps_platforms_and_who_walks_on_them_are_as_an_independent_caster_sees_them() {
    let mut site = site();
    let floor = |[x, y]: [f64; 2], [along, across]: [f64; 2], height_m: f64, slope: [f64; 2]| Floor {
        outline_m: vec![[x, y], [x + along, y], [x + along, y + across], [x, y + across]],
        height_m,
        slope,
    };
    site.hall.floors = vec![
        floor([-6.0, -17.0], [12.0, 34.0], 0.0, [0.05, 0.0]),
        floor([6.0, -17.0], [11.0, 34.0], 0.6, [0.0; 2]),
        floor([-10.0, 2.0], [3.0, 5.0], 0.4, [0.0, 0.02]),
    ];
    let hall = Arc::new(site.hall.clone());
    let mut sensors = Sensors::new(&site, 0).unwrap();
    let walkers: Vec<Walker> = (0..10)
        .map(|i| walker(i, 1.8 + f64::from(i) * 0.2, 10.0 - f64::from(i) * 0.25).on_floor_of(&hall))
        .collect();
    let bodies = assert_as_the_oracle_sees(&site, &mut sensors, 7, 2, &walkers);
    assert!(bodies > 300, "{bodies} rays on bodies");
    let floors_m: Vec<f64> = walkers.iter().filter_map(|w| Some(w.state_at(790_000_000)?.floor_m)).collect();
    assert!(floors_m.iter().any(|m| *m > 0.35) && floors_m.contains(&0.0), "{floors_m:?}");
}

/// Beams that look aside and do not start at the sensor's axis, at another speed and cut.
#[test]
fn people_are_as_an_independent_caster_sees_them_for_a_sensor_whose_beams_look_aside() {
    let mut site = site();
    for (sensor, model) in site.sensors.iter_mut().zip(["os0-64", "xt32"]) {
        sensor.model = model.into();
        (sensor.rate_hz, sensor.cut_deg) = (20.0, 97.0);
    }
    let mut sensors = Sensors::new(&site, 0).unwrap();
    let walkers: Vec<Walker> =
        (0..10).map(|i| walker(i, f64::from(i) * 0.63, 8.0 - f64::from(i) * 0.7)).collect();
    let bodies = assert_as_the_oracle_sees(&site, &mut sensors, 7, 5, &walkers);
    assert!(bodies > 300, "{bodies} rays on bodies");
}

#[test]
fn ten_people_are_as_an_independent_caster_sees_them() {
    let site = site();
    let mut sensors = Sensors::new(&site, 0).unwrap();
    let walkers: Vec<Walker> =
        (0..10).map(|i| walker(i, f64::from(i) * 0.63, 8.0 - f64::from(i) * 0.7)).collect();
    let bodies = assert_as_the_oracle_sees(&site, &mut sensors, 7, 1, &walkers);
    assert!(bodies > 300, "{bodies} rays on bodies");
}

#[test]
fn people_across_the_cut_round_the_sensor_and_under_it_are_as_an_independent_caster_sees_them() {
    let places = [
        ("vlp-16", 1.2, 0.0, 6000),
        ("hdl-32e", 1.3, 8.0, 14_000),
        ("hdl-32e", 2.5, 0.0, 600),
        ("os0-32", 1.3, 8.0, 3000),
        ("os1-32", 1.3, 8.0, 3000),
        ("xt32", 1.3, 8.0, 6000),
    ];
    for (model, height_m, pitch, least) in places {
        let mut site = site();
        site.sensors.truncate(1);
        let sensor = &mut site.sensors[0];
        sensor.model = model.into();
        sensor.position_m = [0.0, 0.0, height_m];
        sensor.rotation_deg = Rotation { yaw: 30.0, pitch, roll: 0.0 };
        let mut sensors = Sensors::new(&site, 0).unwrap();
        // The cut looks along 210 degrees; the last one walks through the sensor.
        let ways = [(210.0, 2.0), (209.0, 5.0), (30.0, 0.9), (120.0, 1.3), (300.0, -0.2)];
        let walkers: Vec<Walker> =
            ways.iter().zip(0..).map(|(&(bearing, d), i)| walker(i, f64::to_radians(bearing), d)).collect();
        let bodies = assert_as_the_oracle_sees(&site, &mut sensors, 1, 7, &walkers);
        assert!(bodies > least, "{bodies} rays on bodies");
    }
}

/// Someone who walks at 1.3 m/s towards the middle and is `distance_m` from it after 0.4 s.
fn walker(person: u32, bearing_rad: f64, distance_m: f64) -> Walker {
    let from = DVec2::from_angle(bearing_rad) * (distance_m + 0.52);
    let step = DVec2::from_angle(bearing_rad + PI) * 0.013;
    let positions_m = (0..200).map(|i| from + step * f64::from(i)).collect();
    let way = Trajectory {
        person,
        start_ns: 0,
        step_ns: 10_000_000,
        positions_m,
        arrived_ns: None,
        height_m: None,
    };
    Walker::new(way, u64::from(person))
}

/// Compares the rays of every `stride`th column of a frame, before noise; gives how many rays show a body.
fn assert_as_the_oracle_sees(
    site: &Site,
    sensors: &mut Sensors,
    frame: u64,
    stride: usize,
    walkers: &[Walker],
) -> usize {
    let oracle = Oracle::new(site, walkers);
    let (mut rays, mut bodies, mut differences) = (0, 0, Vec::new());
    for (simulated, sensor) in sensors.sensors.iter_mut().zip(&site.sensors) {
        let view = simulated.look(frame, walkers, None);
        let (apart, compared) = oracle.compare(sensor, &view.image, stride);
        differences.extend(apart);
        rays += compared;
        bodies += view.owner.iter().filter(|&&owner| owner != NOBODY).count();
    }
    let apart = differences.len();
    assert!(
        apart <= rays.div_ceil(10_000),
        "{apart} of {rays} rays differ by more than 1 mm: {differences:?}"
    );
    differences.retain(|d| !d.at_silhouette());
    assert!(differences.is_empty(), "away from silhouettes: {differences:?}");
    bodies
}

/// Columns of all packets with their ranges, as a decoder gives them.
fn decoded(sensors: &Sensors, sensor: usize, packets: &[Packet]) -> Vec<(Column, Vec<f32>)> {
    let mut columns = Vec::new();
    let mut health = Health::default();
    for packet in packets {
        packet::decode(&sensors.sensors[sensor].head.model, packet, &mut health, |column, range_m, _| {
            columns.push((column, range_m.to_vec()));
        });
    }
    assert!(health.is_clean(), "{health:?}");
    columns
}

#[test]
fn columns_come_out_of_the_decoder_when_and_where_they_were_fired() {
    for model in ["hdl-32e", "vlp-16", "os0-32", "xt32"] {
        let mut site = site();
        site.sensors[0].model = model.into();
        let mut sensors = Sensors::new(&site, 0).unwrap();
        let views: Vec<View> = (0..3).map(|k| sensors.sensors[0].look(k, &[], None)).collect();
        let mut packets: Vec<Packet> = (0..3).flat_map(|k| sensors.frame(k, &[]).0.swap_remove(0)).collect();
        packets.extend(sensors.flush().swap_remove(0));
        let decoded = decoded(&sensors, 0, &packets);
        let fired: Vec<Column> = views.iter().flat_map(|v| v.image.columns.clone()).collect();
        let read: Vec<Column> = decoded.iter().map(|(column, _)| *column).take(fired.len()).collect();
        assert_eq!(read, fired);
        for (k, view) in views.iter().enumerate() {
            let frame_ns = k as i64 * STEP_NS..(k as i64 + 1) * STEP_NS;
            assert!(view.image.columns.iter().all(|c| frame_ns.contains(&c.time_ns)));
        }
        // In phase with the cut behind the sensor: within a column of 180 degrees when a frame begins.
        assert!((fired[0].azimuth_cdeg - 18_000.0).abs() < 17.0, "{model}");
    }
}

#[test]
fn the_same_seed_sends_the_same_bytes_and_a_restart_is_a_new_beginning() {
    let site = site();
    let walkers = [walker(0, 0.3, 5.0), walker(1, 2.0, 7.0)];
    let run = |sensors: &mut Sensors| -> Vec<_> { (0..3).map(|k| sensors.frame(k, &walkers)).collect() };
    let mut sensors = Sensors::new(&site, 1).unwrap();
    let first = run(&mut sensors);
    assert!(first == run(&mut Sensors::new(&site, 1).unwrap()));
    assert!(first != run(&mut Sensors::new(&site, 2).unwrap()));
    sensors.power(0, 0..1);
    sensors.restart(1);
    assert!(first == run(&mut sensors));
}

#[test]
fn a_person_changes_no_range_but_those_of_the_rays_that_meet_the_body() {
    let mut sensors = Sensors::new(&site(), 1).unwrap();
    let walkers = [walker(0, 0.3, 5.0)];
    let with = sensors.frame(0, &walkers);
    sensors.restart(1);
    let without = sensors.frame(0, &[]);
    let mut changed = 0;
    for sensor in 0..2 {
        let with = decoded(&sensors, sensor, &with.0[sensor]);
        let without = decoded(&sensors, sensor, &without.0[sensor]);
        let pairs = with.iter().zip(&without).flat_map(|(a, b)| a.1.iter().zip(&b.1));
        changed += pairs.filter(|(a, b)| a != b).count();
    }
    // A shoe on the floor may be less than the 2 mm of a packet above it.
    let returns = with.1[0] as usize;
    assert!(changed <= returns && changed + 2 >= returns && returns > 20, "{changed} of {returns}");
}

#[test]
fn points_lie_on_a_moving_body_at_the_time_they_carry() {
    let mut site = site();
    site.simulation.dropout = 0.0;
    site.sensors.iter_mut().for_each(|sensor| sensor.range_noise_m = 0.0);
    let mut sensors = Sensors::new(&site, 1).unwrap();
    let walkers = [walker(0, 0.3, 4.5)];
    let empty: Vec<View> = sensors.sensors.iter_mut().map(|s| s.look(4, &[], None)).collect();
    let packets = sensors.frame(4, &walkers).0;
    let (mut points, mut late) = (0, 0);
    for (sensor, view) in empty.iter().enumerate() {
        let site_from_sensor = site.sensors[sensor].site_from_sensor();
        for (column, range_m) in decoded(&sensors, sensor, &packets[sensor]) {
            let Some(c) = view.image.columns.iter().position(|other| *other == column) else { continue };
            for b in 0..range_m.len() {
                let hall_m = view.image.range_m[c * range_m.len() + b];
                if hall_m - range_m[b] < 0.01 {
                    continue;
                }
                let point_m = site_from_sensor.point(view.image.point_m(c, b, f64::from(range_m[b])));
                let off_m = |time_ns| oracle::distance_m(&walkers[0], time_ns, point_m);
                let (then_m, at_end_m) = (off_m(view.image.time_ns(c, b)), off_m(500_000_000));
                // The packet counts in 2 mm.
                assert!(then_m < 1.5e-3, "{then_m} m from the body");
                points += 1;
                late += usize::from(at_end_m > 0.01);
            }
        }
    }
    assert!(
        points > 30 && late > points / 2,
        "{points} points, {late} of them off the body at the frame's end"
    );
}

#[test]
fn noise_and_drop_outs_have_the_given_statistics() {
    let mut sensors = Sensors::new(&site(), 5).unwrap();
    let simulated = &mut sensors.sensors[0];
    let mut view = simulated.look(0, &[], None);
    let truth = view.image.range_m.clone();
    let mut scales = Vec::new();
    simulated.noise.scales(&view, &mut scales);
    simulated.noise.measure(0, &mut view);
    let errors: Vec<f64> = truth
        .iter()
        .zip(&view.image.range_m)
        .zip(&scales)
        .filter(|&((_, &measured), _)| measured > 0.0)
        .map(|((&t, &m), &scale)| f64::from((m - t) / scale))
        .collect();
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let deviation = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    let lost = 1.0 - n / truth.len() as f64;
    assert!(mean.abs() < 4.0 * 0.02 / n.sqrt(), "mean {mean}");
    assert!((deviation - 0.02).abs() < 2e-4, "deviation {deviation}");
    assert!((lost - 0.02).abs() < 2e-3, "lost {lost}");
}

/// A surface far away, or slant, errs by more than one nearby that faces the sensor; none by more than four times as much.
#[test]
fn ranges_err_more_far_away_and_on_slant_surfaces() {
    let mut sensors = Sensors::new(&site(), 5).unwrap();
    let simulated = &mut sensors.sensors[0];
    let view = simulated.look(0, &[], None);
    let mut scales = Vec::new();
    simulated.noise.scales(&view, &mut scales);
    let of = |wanted: &dyn Fn(f32, f32) -> bool| {
        let pixels = (0..scales.len()).filter(|&i| wanted(view.image.range_m[i], view.slope_m(i)));
        let scales: Vec<f32> = pixels.map(|i| scales[i]).collect();
        assert!(!scales.is_empty());
        scales.iter().sum::<f32>() / scales.len() as f32
    };
    let near = of(&|range_m, slope_m| range_m < 12.0 && slope_m < 0.002);
    let far = of(&|range_m, slope_m| range_m > 24.0 && slope_m < 0.002);
    let slant = of(&|range_m, slope_m| range_m < 12.0 && slope_m > 0.04);
    assert!(near < 1.1 && far > 1.2 && slant > 1.2, "{near} {far} {slant}");
    assert!(scales.iter().all(|scale| (1.0..=4.0).contains(scale)));
}

#[test]
fn what_is_nearer_or_farther_than_the_limits_gives_no_return() {
    let mut site = site();
    site.sensors.truncate(1);
    (site.sensors[0].range_min_m, site.sensors[0].range_max_m) = (12.0, 20.0);
    let mut sensors = Sensors::new(&site, 0).unwrap();
    let packets = sensors.frame(0, &[]).0.swap_remove(0);
    let ranges: Vec<f32> = decoded(&sensors, 0, &packets).into_iter().flat_map(|(_, r)| r).collect();
    assert!(ranges.contains(&0.0));
    assert!(ranges.iter().filter(|&&r| r > 0.0).all(|r| (11.999..20.001).contains(r)));
}

#[test]
fn a_lost_sensor_sends_nothing_more_and_one_that_starts_late_begins_within_a_turn() {
    let mut sensors = Sensors::new(&site(), 0).unwrap();
    sensors.power(1, 130_000_000..170_000_000);
    let packets: Vec<_> = (0..3).map(|k| sensors.frame(k, &[]).0).collect();
    assert!(packets[0][1].is_empty() && packets[2][1].is_empty());
    let columns = decoded(&sensors, 1, &packets[1][1]);
    // 40 ms of 46.08 us, less up to a packet of 12 columns at each end.
    assert!((844..=868).contains(&columns.len()), "{}", columns.len());
    assert!(columns.iter().all(|(c, _)| (130_000_000..170_000_000).contains(&c.time_ns)));
    assert_eq!(packets[1][0].len(), 181);
}

#[test]
fn a_surveyed_body_gives_the_returns_that_it_gives_in_a_scene() {
    let mut site = site();
    site.simulation.dropout = 0.3;
    let standing = |x: f64, y: f64| {
        let positions_m = vec![DVec2::new(x, y); 21];
        Walker::new(Trajectory { person: 0, start_ns: 0, positions_m, ..walker(0, 0.0, 1.0).trajectory }, 3)
    };
    let mut sensors = Sensors::new(&site, 0).unwrap();
    let mut survey = Survey::new(&site, &sensors);
    let body = standing(0.0, 0.0);
    // In the open, behind a pillar for one sensor, under the sensor.
    for (x, y) in [(0.0, 0.0), (-12.0, 12.0), (-15.5, 0.0), (3.0, -9.0)] {
        let there = [standing(x, y)];
        let rays = |sensor: &mut Simulated| {
            let owner = sensor.look(0, &there, None).owner;
            owner.iter().filter(|&&owner| owner != NOBODY).count() as f64
        };
        let expected: Vec<f64> = sensors.sensors.iter_mut().map(rays).collect();
        let seen = survey.see(&body, DVec2::new(x, y), 0.0);
        // A ray along a silhouette may fall to either side by rounding.
        for (seen, expected) in seen.iter().zip(&expected) {
            assert!((seen.returns - 0.7 * expected).abs() <= 0.7, "{x} {y}: {seen:?}, {expected}");
        }
        assert_eq!(seen, survey.see(&body, DVec2::new(x, y), 0.0), "nothing is left of the last look");
    }
    let [one, other] = [0.0, PI].map(|heading| survey.see(&body, DVec2::new(0.0, 5.0), heading));
    assert!((one[0].returns - other[0].returns * 1.0).abs() < 0.3 * one[0].returns, "{one:?} {other:?}");
    let (low_m, high_m) = one[0].span_m.unwrap();
    assert!(low_m < 0.3 && (1.4..2.0).contains(&high_m), "{low_m} to {high_m}");
}

#[test]
fn a_person_before_a_mirror_is_shown_behind_it_as_nobodys_body() {
    let mut site = site();
    site.sensors.truncate(1);
    let sensor = &mut site.sensors[0];
    (sensor.position_m, sensor.rotation_deg) =
        ([0.0, -4.0, 1.5], Rotation { yaw: 90.0, pitch: 0.0, roll: 0.0 });
    let mirror =
        Pane { from_m: [-3.0, 6.0], to_m: [3.0, 6.0], bottom_m: 0.0, top_m: 2.5, surface: Surface::Mirror };
    site.simulation.panes = vec![mirror];
    let mut sensors = Sensors::new(&site, 0).unwrap();
    let walkers = [walker(0, f64::to_radians(60.0), 3.0)];
    let empty = sensors.sensors[0].look(4, &[], None);
    let view = sensors.sensors[0].look(4, &walkers, None);
    let site_from_sensor = site.sensors[0].site_from_sensor();
    let (mut straight, mut reflected) = (0, 0);
    for c in 0..view.image.columns.len() {
        for b in 0..view.image.beams.len() {
            let pixel = c * view.image.beams.len() + b;
            let range_m = view.image.range_m[pixel];
            if range_m == empty.image.range_m[pixel] {
                continue;
            }
            let point_m = site_from_sensor.point(view.image.point_m(c, b, f64::from(range_m)));
            let is_behind = point_m.y > 6.0;
            let body_m = if is_behind { DVec3::new(point_m.x, 12.0 - point_m.y, point_m.z) } else { point_m };
            let off_m = oracle::distance_m(&walkers[0], view.image.time_ns(c, b), body_m);
            assert!(off_m < 1e-3, "{point_m} is {off_m} m from the body");
            assert_eq!(view.owner[pixel], if is_behind { NOBODY } else { 0 });
            *(if is_behind { &mut reflected } else { &mut straight }) += 1;
        }
    }
    assert!(straight > 100 && reflected > 20, "{straight} straight, {reflected} reflected");
}

#[test]
fn a_sensor_outside_the_hall_is_refused_with_its_name() {
    let mut site = site();
    site.sensors[1].position_m[0] = -17.5;
    let message = Sensors::new(&site, 0).unwrap_err().to_string();
    assert!(message.starts_with("site.sensors.lidar_west: position_m: expected"), "{message}");
}
