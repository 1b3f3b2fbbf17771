//! Sensors against an independent ray caster, and what they promise.

use parry3d::math::{Pose, Vector};
use parry3d::query::Ray;
use parry3d::shape::{Cuboid, SharedShape, TriMesh};
use umbracast::lidar::{Column, packet};
use umbracast::site::Pillar;
use umbracast::{Config, Health, STEP_NS};

use super::*;

fn site() -> Site {
    Config::default().site
}

/// The hall as shapes of `parry3d`: slabs round the room, boxes, cylinders.
fn hall_shapes(site: &Site) -> Vec<(Pose, SharedShape)> {
    let (x, y, z) = (site.hall.length_m as f32, site.hall.width_m as f32, site.hall.height_m as f32);
    let mut shapes = Vec::new();
    let mut cuboid = |middle: Vector, size: Vector, yaw_deg: f64| {
        let pose = Pose::new(middle, Vector::Z * yaw_deg.to_radians() as f32);
        shapes.push((pose, SharedShape::new(Cuboid::new(size * 0.5))));
    };
    for side in [-1.0, 1.0] {
        cuboid(Vector::new(side * (x + 1.0) * 0.5, 0.0, z * 0.5), Vector::new(1.0, y + 2.0, z + 2.0), 0.0);
        cuboid(Vector::new(0.0, side * (y + 1.0) * 0.5, z * 0.5), Vector::new(x + 2.0, 1.0, z + 2.0), 0.0);
        cuboid(
            Vector::new(0.0, 0.0, z * 0.5 + side * (z + 1.0) * 0.5),
            Vector::new(x + 2.0, y + 2.0, 1.0),
            0.0,
        );
    }
    for item in &site.furniture {
        let ([px, py], [sx, sy, sz]) = (item.position_m, item.size_m.map(|s| s as f32));
        cuboid(Vector::new(px as f32, py as f32, sz * 0.5), Vector::new(sx, sy, sz), item.yaw_deg);
    }
    for pillar in &site.pillars {
        shapes.push((Pose::IDENTITY, SharedShape::new(prism(pillar, z))));
    }
    shapes
}

/// A pillar as a prism of so many sides that it is 3 um from round.
fn prism(pillar: &Pillar, height_m: f32) -> TriMesh {
    const SIDES: u32 = 720;
    let [x, y] = pillar.position_m;
    let corner = |i: u32| {
        let (sin, cos) = (f64::from(i / 2) * std::f64::consts::TAU / f64::from(SIDES)).sin_cos();
        let z = if i.is_multiple_of(2) { 0.0 } else { height_m };
        Vector::new((x + pillar.radius_m * cos) as f32, (y + pillar.radius_m * sin) as f32, z)
    };
    let triangles = (0..2 * SIDES).map(|i| [i, (i + 1) % (2 * SIDES), (i + 2) % (2 * SIDES)]);
    TriMesh::new((0..2 * SIDES).map(corner).collect(), triangles.collect()).unwrap()
}

fn site_ray(sensor: &Sensor, view: &View, c: usize, b: usize) -> Ray {
    let site_from_sensor = sensor.site_from_sensor();
    let origin_m = site_from_sensor.point(view.image.point_m(c, b, 0.0));
    let far_m = site_from_sensor.point(view.image.point_m(c, b, 1.0));
    let vector = |v: DVec3| Vector::new(v.x as f32, v.y as f32, v.z as f32);
    Ray::new(vector(origin_m), vector(far_m - origin_m))
}

#[test]
fn the_hall_is_as_an_independent_caster_sees_it() {
    let site = site();
    let shapes = hall_shapes(&site);
    let mut sensors = Sensors::new(&site, 0).unwrap();
    for (simulated, sensor) in sensors.sensors.iter_mut().zip(&site.sensors) {
        let view = simulated.look(3, &[]);
        let (mut rays, mut apart) = (0, 0);
        for c in 0..view.image.columns.len() {
            for b in 0..view.image.beams.len() {
                let ray = site_ray(sensor, &view, c, b);
                let expected = shapes
                    .iter()
                    .filter_map(|(pose, shape)| shape.cast_ray(pose, &ray, 100.0, false))
                    .fold(f32::INFINITY, f32::min);
                let found = view.image.range_m[c * view.image.beams.len() + b];
                rays += 1;
                apart += usize::from((found - expected).abs() > 1e-3);
            }
        }
        assert!(rays > 69_000);
        assert!(apart <= rays / 10_000, "{apart} of {rays} rays differ by more than 1 mm");
    }
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
    for model in ["hdl-32e", "vlp-16"] {
        let mut site = site();
        site.sensors[0].model = model.into();
        let mut sensors = Sensors::new(&site, 0).unwrap();
        let views: Vec<View> = (0..3).map(|k| sensors.sensors[0].look(k, &[])).collect();
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
        assert!((fired[0].azimuth_cdeg - 18_000.0).abs() < 17.0);
    }
}

#[test]
fn noise_and_drop_outs_have_the_given_statistics() {
    let mut sensors = Sensors::new(&site(), 5).unwrap();
    let simulated = &mut sensors.sensors[0];
    let mut view = simulated.look(0, &[]);
    let truth = view.image.range_m.clone();
    simulated.noise.measure(0, &mut view.image);
    let errors: Vec<f64> = truth
        .iter()
        .zip(&view.image.range_m)
        .filter(|&(_, &measured)| measured > 0.0)
        .map(|(&t, &m)| f64::from(m - t))
        .collect();
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let deviation = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    let lost = 1.0 - n / truth.len() as f64;
    assert!(mean.abs() < 4.0 * 0.02 / n.sqrt(), "mean {mean}");
    assert!((deviation - 0.02).abs() < 2e-4, "deviation {deviation}");
    assert!((lost - 0.02).abs() < 2e-3, "lost {lost}");
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
fn a_sensor_outside_the_hall_is_refused_with_its_name() {
    let mut site = site();
    site.sensors[1].position_m[0] = -17.5;
    let message = Sensors::new(&site, 0).unwrap_err().to_string();
    assert!(message.starts_with("site.sensors.lidar_west: position_m: expected"), "{message}");
}
