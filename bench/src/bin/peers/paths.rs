//! The static paths of the empty hall: from each access point to each device straight on, and by one reflection from the floor, the
//! ceiling and each wall.

use std::path::Path;

use umbracast::Config;
use umbracast::geometry::DVec3;
use umbracast::radio::reflections;
use umbracast::site::Reflections;

use crate::exchange::{Answer, times, uniform, write_f64};
use crate::loss::DEVICE_M;

const DEVICES: usize = 1_000;
const TRIES: usize = 20;
/// Devices keep so far from the walls.
const FROM_WALL_M: f64 = 0.5;
const LIGHT_M_S: f64 = 299_792_458.0;

pub fn row(folder: &Path) -> Answer {
    let site = Config::default().site;
    let hall = &site.hall;
    let [least_m, most_m] = hall.bounds_m();
    let mut state = 3;
    let mut between = |low: f64, high: f64| low + (high - low) * uniform(&mut state);
    let mut device = |_| {
        let x_m = between(least_m.x + FROM_WALL_M, most_m.x - FROM_WALL_M);
        let y_m = between(least_m.y + FROM_WALL_M, most_m.y - FROM_WALL_M);
        DVec3::new(x_m, y_m, between(DEVICE_M[0], DEVICE_M[1]))
    };
    let devices_m: Vec<DVec3> = (0..DEVICES).map(&mut device).collect();
    let aps_m: Vec<DVec3> = site.access_points.iter().map(|ap| ap.position()).collect();
    let flat = |of: &[DVec3]| -> Vec<f64> { of.iter().flat_map(|at_m| at_m.to_array()).collect() };
    write_f64(folder, "access_points", &[aps_m.len(), 3], &flat(&aps_m));
    write_f64(folder, "devices", &[DEVICES, 3], &flat(&devices_m));
    // Four corners of each surface: the floor and the ceiling are rectangles in the default hall.
    let level = |z: f64| {
        [[least_m.x, least_m.y], [most_m.x, least_m.y], [most_m.x, most_m.y], [least_m.x, most_m.y]]
            .map(|[x, y]| DVec3::new(x, y, z))
    };
    let wall = |[from_m, to_m]: [umbracast::geometry::DVec2; 2]| {
        [from_m.extend(0.0), to_m.extend(0.0), to_m.extend(hall.height_m), from_m.extend(hall.height_m)]
    };
    let surfaces_m: Vec<DVec3> =
        [level(0.0), level(hall.height_m)].into_iter().chain(hall.walls().map(wall)).flatten().collect();
    write_f64(folder, "surfaces", &[surfaces_m.len() / 4, 4, 3], &flat(&surfaces_m));

    // By access point and device: how long each path is, and when a signal arrives by it.
    let mut paths: Vec<(usize, f64, f64)> = Vec::new();
    let ms = times(
        TRIES,
        || (),
        |()| {
            paths.clear();
            for (a, ap_m) in aps_m.iter().enumerate() {
                for (d, ue_m) in devices_m.iter().enumerate() {
                    let pair = a * DEVICES + d;
                    let mut add = |length_m: f64| paths.push((pair, length_m, length_m / LIGHT_M_S));
                    add(ap_m.distance(*ue_m));
                    let ways = reflections(hall, Reflections::default(), *ap_m, *ue_m);
                    ways.iter().for_each(|way| add(way.length_m));
                }
            }
        },
    );
    // The peer's delays are compared with these, pair by pair and in order; where a pair has fewer paths, the rest is 0.
    let pairs = aps_m.len() * DEVICES;
    let most = 1 + surfaces_m.len() / 4;
    let mut by_pair = vec![Vec::new(); pairs];
    paths.iter().for_each(|(pair, _, delay_s)| by_pair[*pair].push(*delay_s));
    let in_order = |mut delays_s: Vec<f64>| {
        delays_s.sort_by(f64::total_cmp);
        delays_s.resize(most, 0.0);
        delays_s
    };
    let delays_s: Vec<f64> = by_pair.into_iter().flat_map(in_order).collect();
    write_f64(folder, "delays", &[aps_m.len(), DEVICES, most], &delays_s);
    let mean_m = paths.iter().map(|(_, length_m, _)| length_m).sum::<f64>() / paths.len() as f64;
    let mut answer = Answer::default();
    let found = [
        ("paths", paths.len() as f64),
        ("mean length, m", mean_m),
        ("pairs with other paths", 0.0),
        ("greatest difference of lengths, mm", 0.0),
        ("greatest difference of delays, ps", 0.0),
    ];
    answer.case(&format!("{} links, one reflection", pairs), &ms, &found);
    answer
}
