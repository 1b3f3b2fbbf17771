//! One frame of two HDL-32E in the default hall with ten walkers: the rays that may meet somebody, and all that a frame is.

use std::path::Path;

use umbracast::geometry::{DVec3, Pose};
use umbracast::lidar::{Cloud, Frame, RangeImage};
use umbracast::{Config, Site};
use umbracast_bench::simulated::walking;
use umbracast_sim::body::Walker;
use umbracast_sim::crowd::{Crowd, Preset, circle_crossing};
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

use crate::bodies::{write_triangles, write_vertices};
use crate::exchange::{Answer, times, took_ms, write_f32, write_f64};

/// That of every simulated hall of the benchmarks.
const SEED: u64 = 100_000;
/// So many tenths of a second after people set off they meet in the middle of the circle.
const FRAME: u64 = 120;
const TRIES: usize = 40;
/// Ranges in packets are whole multiples of 2 mm; what is nearer than the hall by more is a body.
const UNIT_M: f32 = 0.002;

pub fn row(folder: &Path) -> Answer {
    let site = Config::default().site;
    let crowd = || circle_crossing(Preset::Orca03, 10, 12.5, SEED);
    let scene = Scene::truth_only(crowd(), &site, SEED);
    let body_rays = write(folder, &site, crowd(), scene.walkers());
    let sensors = Sensors::new(&site, SEED).expect("the default site is simulated");
    let whole = || Scene::in_hall(crowd(), &site, &sensors, SEED).starting_at(FRAME);
    let mut frame = None;
    let all_ms = times(TRIES, whole, |scene| frame = scene.next_frame());
    let blocked = frame.map_or(0, |frame| frame.links.iter().filter(|link| link.blocked).count());
    let mut answer = Answer::default();
    answer.case("rays", &rays_ms(&sensors, scene.walkers()), &[("body rays", body_rays), ("agree", 1.0)]);
    answer.case("all", &all_ms, &[("body rays", body_rays), ("blocked links", blocked as f64)]);
    answer
}

/// A frame with people less one of the empty hall, which has the same noise and packets, less what posing takes. Every sensor
/// sees every body at the beginning and at the end of its sweep at least, and bodies are posed for both.
fn rays_ms(sensors: &Sensors, walkers: &[Walker]) -> Vec<f64> {
    let mut vertices_m = Vec::new();
    let once = |_| {
        let [mut with, mut without] = [sensors.clone(), sensors.clone()];
        let with_ms = took_ms(|| drop(with.frame(FRAME, walkers)));
        let without_ms = took_ms(|| drop(without.frame(FRAME, &[])));
        let posing_ms = took_ms(|| {
            for walker in walkers {
                (0..4).for_each(|i| {
                    assert!(walker.mesh_at(FRAME as i64 * umbracast::STEP_NS + i, &mut vertices_m))
                });
            }
        });
        with_ms - without_ms - posing_ms
    };
    (0..=TRIES).map(once).skip(1).collect()
}

/// Without noise: the rays, what we found along them, and the bodies at the instants when each sensor looks at them, at the
/// middle of the frame and at its end. How many rays meet somebody comes back.
fn write(folder: &Path, site: &Site, crowd: Crowd, walkers: &[Walker]) -> f64 {
    let mut exact = site.clone();
    exact.simulation.dropout = 0.0;
    exact.sensors.iter_mut().for_each(|sensor| sensor.range_noise_m = 0.0);
    let nobody = Crowd { trajectories: Vec::new(), duration_ns: crowd.duration_ns };
    let [frame, empty] = [crowd, nobody].map(|crowd| frame_of(&exact, crowd));
    let bodies: Vec<&Walker> = walkers.iter().collect();
    write_triangles(folder, &bodies);
    let at = |name: &str, time_ns: &dyn Fn(usize) -> i64| {
        write_vertices(folder, name, &bodies, |walker, number, vertices_m| {
            assert!(walker.mesh_at(time_ns(number), vertices_m), "everybody is there");
        });
    };
    at("middle", &|_| frame.time_ns - umbracast::STEP_NS / 2);
    at("end", &|_| frame.time_ns);
    let mut body_rays = 0;
    for (sensor, (scan, empty)) in frame.scans.iter().zip(&empty.scans).enumerate() {
        let (Cloud::Organised(image), Cloud::Organised(hall)) = (&scan.cloud, &empty.cloud) else {
            panic!("an HDL-32E gives images")
        };
        assert_eq!(image.columns, hall.columns, "columns of a frame do not depend on who is there");
        let pose = &scan.site_from_sensor;
        at(&format!("seen_{sensor}"), &|number| seen_ns(pose, image, &walkers[number], frame.time_ns));
        let shape = [image.beams.len(), image.columns.len()];
        write_f32(folder, &format!("rays_{sensor}"), &[shape[0], shape[1], 6], &rays(pose, image));
        write_f32(folder, &format!("ours_{sensor}"), &shape, &by_beams(image));
        write_f32(folder, &format!("hall_{sensor}"), &shape, &by_beams(hall));
        let both = image.range_m.iter().zip(&hall.range_m);
        body_rays += both.filter(|(ours_m, hall_m)| **ours_m < **hall_m - 1.5 * UNIT_M).count();
    }
    let aps_m: Vec<f64> = site.access_points.iter().flat_map(|ap| ap.position().to_array()).collect();
    write_f64(folder, "access_points", &[site.access_points.len(), 3], &aps_m);
    let ues_m: Vec<f64> = walkers
        .iter()
        .flat_map(|walker| walker.ue_m_at(&site.ue, frame.time_ns).unwrap_or_default().to_array())
        .collect();
    write_f64(folder, "devices", &[walkers.len(), 3], &ues_m);
    body_rays as f64
}

fn frame_of(site: &Site, crowd: Crowd) -> Frame {
    // One frame more, for the last one's packets are not all sent.
    let frames = walking(site, crowd, FRAME as usize + 2).expect("the default site is simulated").frames;
    frames.into_iter().find(|frame| frame.index == FRAME).expect("the frame is complete")
}

/// When the sensor looks at the middle of a body.
fn seen_ns(site_from_sensor: &Pose, image: &RangeImage, walker: &Walker, frame_ns: i64) -> i64 {
    let sensor_from_site = site_from_sensor.inverse();
    let mut seen_ns = frame_ns - umbracast::STEP_NS / 2;
    // The body has moved by a hair by then, so that looking twice is enough.
    for _ in 0..2 {
        let state = walker.state_at(seen_ns).expect("everybody is there");
        let middle_m = sensor_from_site.point(state.position_m.extend(0.5 * state.height_m));
        let azimuth_cdeg = f64::atan2(-middle_m.y, middle_m.x).to_degrees() * 100.0;
        let off =
            |cdeg: f32| ((f64::from(cdeg) - azimuth_cdeg + 18_000.0).rem_euclid(36_000.0) - 18_000.0).abs();
        let nearest = image.columns.iter().min_by(|a, b| off(a.azimuth_cdeg).total_cmp(&off(b.azimuth_cdeg)));
        seen_ns = nearest.map_or(seen_ns, |column| column.time_ns);
    }
    seen_ns
}

/// Origin and direction of each ray in the site, beam after beam.
fn rays(site_from_sensor: &Pose, image: &RangeImage) -> Vec<f32> {
    let ray = |(b, c): (usize, usize)| {
        let [origin_m, ahead_m] = [0.0, 1.0].map(|range_m| image.point_m(c, b, range_m));
        let direction: DVec3 = site_from_sensor.direction(ahead_m - origin_m);
        let origin_m = site_from_sensor.point(origin_m);
        [origin_m, direction].map(|v| v.as_vec3().to_array())
    };
    let all = (0..image.beams.len()).flat_map(|b| (0..image.columns.len()).map(move |c| (b, c)));
    all.flat_map(ray).flatten().collect()
}

fn by_beams(image: &RangeImage) -> Vec<f32> {
    let beams = image.beams.len();
    (0..beams).flat_map(|b| image.range_m.iter().skip(b).step_by(beams).copied()).collect()
}
