//! Whether the floor of random rooms and corridors is found, and said where it is not.
//!
//! ```sh
//! cargo run --release -p umbracast-calibrate --example rooms -- 200000 400
//! ```
//!
//! Every room is empty but for one sensor of each model in turn. The site file that `calibrate` is given has it 5 degrees
//! and 0.3 m off. A floor is wrong where the height is 0.1 m or the tilt 1 degree from the truth.

use rand::RngExt;
use rand_pcg::Pcg64;
use umbracast::geometry::{DMat3, DVec3};
use umbracast::lidar::{Assembler, sensor_models};
use umbracast::site::{Rotation, Sensor};
use umbracast::{Config, Error, Frame, Health, Site};
use umbracast_calibrate::{Calibration, Survey};
use umbracast_sim::random::stream;
use umbracast_sim::scene::Scene;

/// How far off the site file has every sensor.
const OFF_DEG: f64 = 5.0;
const OFF_M: f64 = 0.3;
/// Beyond these a floor is wrong.
const WRONG_M: f64 = 0.1;
const WRONG_DEG: f64 = 1.0;
/// Revolutions of the empty room.
const EMPTY: u64 = 10;

/// What came out of one kind of rooms.
#[derive(Default)]
struct Row {
    rooms: usize,
    right: usize,
    wrong_untold: usize,
    wrong_told: usize,
    right_told: usize,
    /// Errors of right floors in their own standard deviations: height, pitch, roll.
    sigmas: [Vec<f64>; 3],
    /// Metres.
    height_m: Vec<f64>,
}

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default: u64| arguments.get(at).and_then(|n| n.parse().ok()).unwrap_or(default);
    let (first, rooms) = (number(0, 100_000), number(1, 60));
    let models: Vec<&str> = sensor_models().filter(|name| *name != "points").collect();
    let mut rows: Vec<Row> = models.iter().map(|_| Row::default()).collect();
    for seed in first..first + rooms {
        let k = (seed - first) as usize % models.len();
        room(models[k], seed, &mut rows[k])?;
    }
    println!(
        "{rooms} rooms and corridors, seeds from {first}; one sensor, {OFF_DEG} deg and {OFF_M} m off before\n"
    );
    println!(
        "{:10} {:>6} {:>6} {:>13} {:>11} {:>11} {:>11} {:>22}",
        "", "rooms", "right", "wrong untold", "wrong told", "right told", "height, mm", "z pitch roll, sigma"
    );
    let mut all = Row::default();
    for (model, row) in models.iter().zip(rows) {
        print(model, &row);
        all.rooms += row.rooms;
        all.right += row.right;
        all.wrong_untold += row.wrong_untold;
        all.wrong_told += row.wrong_told;
        all.right_told += row.right_told;
        all.height_m.extend(row.height_m);
        all.sigmas.iter_mut().zip(row.sigmas).for_each(|(all, of)| all.extend(of));
    }
    print("all", &all);
    Ok(())
}

fn print(name: &str, row: &Row) {
    let rms =
        |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt();
    let [z, pitch, roll] = row.sigmas.each_ref().map(|values| rms(values));
    println!(
        "{name:10} {:>6} {:>6} {:>13} {:>11} {:>11} {:>11.1} {z:>8.1}{pitch:>7.1}{roll:>7.1}",
        row.rooms,
        row.right,
        row.wrong_untold,
        row.wrong_told,
        row.right_told,
        1e3 * rms(&row.height_m)
    );
}

/// A room, every third a corridor, with one sensor near a wall.
fn drawn(model: &str, rng: &mut Pcg64) -> Site {
    let mut site = Config::default().site;
    let corridor = rng.random_range(0..3) == 0;
    site.hall.length_m = if corridor { rng.random_range(12.0..40.0) } else { rng.random_range(6.0..24.0) };
    site.hall.width_m = if corridor { rng.random_range(2.2..4.5) } else { rng.random_range(5.0..18.0) };
    site.hall.height_m = rng.random_range(2.8..6.0);
    site.pillars.clear();
    site.furniture.clear();
    site.sensors.truncate(1);
    let sensor = &mut site.sensors[0];
    sensor.model = model.to_owned();
    let half_m = [0.5 * site.hall.length_m - 0.3, 0.5 * site.hall.width_m - 0.3];
    let z_m = rng.random_range(2.0..(site.hall.height_m - 0.3).min(4.5));
    sensor.position_m = [-half_m[0], rng.random_range(-half_m[1]..half_m[1]), z_m];
    let yaw = rng.random_range(-40.0..40.0);
    sensor.rotation_deg =
        Rotation { yaw, pitch: rng.random_range(0.0..35.0), roll: rng.random_range(-3.0..3.0) };
    site.access_points.iter_mut().for_each(|ap| ap.position_m = [0.0, 0.0, 2.0]);
    site
}

/// What is found of a room, from revolutions without people.
fn calibrated(truth: &Site, given: &Site, seed: u64) -> Result<Calibration, Error> {
    let mut survey = Survey::new(given)?;
    frames(given, truth, seed)?.iter().for_each(|frame| survey.take(frame));
    survey.level().finish()
}

fn room(model: &str, seed: u64, row: &mut Row) -> Result<(), Error> {
    let mut rng = stream(seed, "rooms", 0);
    let truth = drawn(model, &mut rng);
    let mut given = truth.clone();
    disturb(&mut given.sensors[0], &mut rng);
    let found = calibrated(&truth, &given, seed)?;
    let (is, sensor) = (&found.sensors[0], &truth.sensors[0]);
    let off = [
        is.position_m[2] - sensor.position_m[2],
        is.rotation_deg.pitch - sensor.rotation_deg.pitch,
        is.rotation_deg.roll - sensor.rotation_deg.roll,
    ];
    let right = off[0].abs() < WRONG_M && off[1].hypot(off[2]) < WRONG_DEG;
    let told = !found.doubts.is_empty();
    row.rooms += 1;
    match (right, told) {
        (true, false) => row.right += 1,
        (true, true) => row.right_told += 1,
        (false, true) => row.wrong_told += 1,
        (false, false) => row.wrong_untold += 1,
    }
    if right {
        row.height_m.push(off[0]);
        let sigma = [is.sigma.z_m, is.sigma.pitch_deg, is.sigma.roll_deg];
        for (k, sigma) in sigma.into_iter().enumerate() {
            row.sigmas[k].extend(sigma.map(|sigma| off[k] / sigma));
        }
    }
    Ok(())
}

fn disturb(sensor: &mut Sensor, rng: &mut Pcg64) {
    let mut direction = || loop {
        let v = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
        if v.length() > 0.1 && v.length() < 1.0 {
            return v.normalize();
        }
    };
    let (axis, shift) = (direction(), direction());
    let turned = DMat3::from_axis_angle(axis, OFF_DEG.to_radians()) * sensor.site_from_sensor().rotation;
    let (yaw, pitch, roll) = (
        turned.x_axis.y.atan2(turned.x_axis.x),
        -turned.x_axis.z.asin(),
        turned.y_axis.z.atan2(turned.z_axis.z),
    );
    sensor.rotation_deg =
        Rotation { yaw: yaw.to_degrees(), pitch: pitch.to_degrees(), roll: roll.to_degrees() };
    sensor.position_m = (DVec3::from_array(sensor.position_m) + shift * OFF_M).to_array();
}

fn frames(given: &Site, truth: &Site, seed: u64) -> Result<Vec<Frame>, Error> {
    let (mut assembler, mut health) = (Assembler::new(given)?, Health::default());
    let mut frames = Vec::new();
    for of_sensors in Scene::empty(truth, seed, EMPTY)? {
        let mut all: Vec<_> = (of_sensors.iter().enumerate())
            .flat_map(|(sensor, packets)| packets.iter().map(move |packet| (sensor, packet)))
            .collect();
        all.sort_by_key(|(_, packet)| packet.time_ns);
        all.iter().for_each(|(sensor, packet)| assembler.push(*sensor, packet, &mut health));
        frames.extend(std::iter::from_fn(|| assembler.pop()));
    }
    assembler.finish();
    frames.extend(std::iter::from_fn(|| assembler.pop()));
    Ok(frames)
}
