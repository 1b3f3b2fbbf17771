//! How well the sensors of a hall are found again that a site file has elsewhere.
//!
//! ```sh
//! cargo run -p umbracast-calibrate --example hung -- 200000 20
//! ```
//!
//! Every scene is a minute of people who stroll before two HDL-32E, simulated with the true poses; the site file that
//! `calibrate` is given has both sensors 5 degrees and 0.3 m off, each in a direction of its own.

use rand::RngExt;
use rand_pcg::Pcg64;
use umbracast::geometry::{DMat3, DVec3};
use umbracast::lidar::{Assembler, Packet};
use umbracast::site::{Rotation, Sensor};
use umbracast::{Config, Error, Frame, Health, Site};
use umbracast_calibrate::{Calibration, Survey};
use umbracast_sim::crowd::{Preset, strolling};
use umbracast_sim::random::stream;
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

/// How far off the site file has every sensor.
const OFF_DEG: f64 = 5.0;
const OFF_M: f64 = 0.3;
const SECONDS: u64 = 60;
/// Revolutions without people.
const EMPTY: u64 = 20;

/// One line of the table.
struct Case {
    name: &'static str,
    people: usize,
    clock_ms: f64,
    /// Two sensors 30 m apart, each of which sees two thirds of the way.
    far: bool,
    /// Whether the hall is known without people first.
    empty: bool,
    /// Whether the site file knows the walls.
    walls: bool,
}

const CASES: [Case; 9] = [
    Case { name: "ten walkers", people: 10, clock_ms: 0.0, far: false, empty: true, walls: true },
    Case { name: "ten, clock 20 ms", people: 10, clock_ms: 20.0, far: false, empty: true, walls: true },
    Case { name: "ten, clock 50 ms", people: 10, clock_ms: 50.0, far: false, empty: true, walls: true },
    Case { name: "ten, no empty scan", people: 10, clock_ms: 0.0, far: false, empty: false, walls: true },
    Case { name: "ten, walls unknown", people: 10, clock_ms: 0.0, far: false, empty: true, walls: false },
    Case { name: "two walkers", people: 2, clock_ms: 0.0, far: false, empty: true, walls: true },
    Case { name: "two, walls unknown", people: 2, clock_ms: 0.0, far: false, empty: true, walls: false },
    Case { name: "30 m apart", people: 10, clock_ms: 0.0, far: true, empty: true, walls: true },
    Case { name: "30 m, walls unknown", people: 10, clock_ms: 0.0, far: true, empty: true, walls: false },
];

/// How far one found sensor is from the truth, and both from one another: only that is told where no walls are known.
struct Off {
    angle_deg: f64,
    place_m: f64,
    between_deg: f64,
    between_m: f64,
    clock_ms: f64,
    /// Errors in their own standard deviations: yaw, x, y, clock.
    sigmas: [Option<f64>; 4],
}

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default: u64| arguments.get(at).and_then(|n| n.parse().ok()).unwrap_or(default);
    let (first, scenes) = (number(0, 100_000), number(1, 3));
    let only = arguments.get(2);
    println!(
        "{scenes} scenes, seeds from {first}; each sensor {OFF_DEG} deg and {OFF_M} m off before; mean (worst)\n"
    );
    println!(
        "{:20} {:>15} {:>15} {:>17} {:>17} {:>15} {:>18}",
        "", "angle, deg", "place, cm", "between, deg", "between, cm", "clock, ms", "yaw x y ms, sigma"
    );
    for case in CASES.iter().filter(|case| only.is_none_or(|only| case.name.contains(only.as_str()))) {
        let mut errors = Vec::new();
        for seed in first..first + scenes {
            errors.extend(scene(case, seed)?);
        }
        let of = |pick: fn(&Off) -> f64| {
            let mean = errors.iter().map(pick).sum::<f64>() / errors.len() as f64;
            (mean, errors.iter().map(pick).fold(0.0, f64::max))
        };
        let text = |(mean, worst): (f64, f64), digits: usize| format!("{mean:.digits$} ({worst:.digits$})");
        let sigma = |k: usize| {
            let told: Vec<f64> = errors.iter().filter_map(|off| off.sigmas[k]).collect();
            let rms = (told.iter().map(|off| off * off).sum::<f64>() / told.len() as f64).sqrt();
            if told.is_empty() { "-".to_owned() } else { format!("{rms:.1}") }
        };
        println!(
            "{:20} {:>15} {:>15} {:>17} {:>17} {:>15} {:>6}{:>4}{:>4}{:>4}",
            case.name,
            if case.walls { text(of(|e| e.angle_deg), 3) } else { "-".to_owned() },
            if case.walls { text(of(|e| 100.0 * e.place_m), 2) } else { "-".to_owned() },
            text(of(|e| e.between_deg), 3),
            text(of(|e| 100.0 * e.between_m), 2),
            text(of(|e| e.clock_ms), 2),
            sigma(0),
            sigma(1),
            sigma(2),
            sigma(3),
        );
    }
    Ok(())
}

fn scene(case: &Case, seed: u64) -> Result<Vec<Off>, Error> {
    let mut truth = Config::default().site;
    if case.far {
        far(&mut truth);
    }
    if case.clock_ms != 0.0 {
        truth.simulation.clock_ahead_ms.insert(truth.sensors[1].name.clone(), case.clock_ms);
    }
    let mut rng = stream(seed, "hung elsewhere", 0);
    let mut given = truth.clone();
    given.sensors.iter_mut().for_each(|sensor| disturb(sensor, &mut rng));
    if !case.walls {
        (given.hall.length_m, given.hall.width_m) = (90.0, 90.0);
        given.pillars.clear();
        given.furniture.clear();
    }
    let found = calibrated(case, &truth, &given, seed)?;
    Ok(errors(case, &truth, &found))
}

/// A long hall with a sensor at each end that sees two thirds of it.
fn far(site: &mut Site) {
    (site.hall.length_m, site.hall.width_m, site.hall.height_m) = (36.0, 16.0, 7.0);
    site.pillars.clear();
    site.furniture.clear();
    for (sensor, x) in site.sensors.iter_mut().zip([15.0, -15.0]) {
        sensor.position_m = [x, 0.0, 5.0];
        sensor.rotation_deg.pitch = 20.0;
        sensor.range_max_m = 20.6;
    }
    site.access_points.iter_mut().for_each(|ap| ap.position_m = [0.0, 0.0, 2.0]);
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

fn calibrated(case: &Case, truth: &Site, given: &Site, seed: u64) -> Result<Calibration, Error> {
    let radius_m = if case.far { 6.5 } else { 12.5 };
    let mut crowd = strolling(Preset::Orca03, case.people, radius_m, seed, SECONDS);
    if case.far {
        // A third of the hall is not round: the circle is drawn out along it.
        let ways = crowd.trajectories.iter_mut().flat_map(|way| &mut way.positions_m);
        ways.for_each(|p| p.x *= 2.0);
    }
    let sensors = Sensors::new(truth, seed)?;
    let empty = frames(given, Scene::empty(truth, seed, EMPTY)?.into_iter())?;
    let mut scene = Scene::in_hall(crowd, truth, &sensors, seed);
    let recorded = frames(given, std::iter::from_fn(|| Some(scene.next_frame()?.packets)))?;
    let mut survey = Survey::new(given)?;
    match case.empty {
        true => empty.iter().for_each(|frame| survey.take(frame)),
        false => recorded.iter().step_by(10).for_each(|frame| survey.take(frame)),
    }
    let mut walkers = survey.level();
    if case.empty {
        empty.iter().for_each(|frame| walkers.learn_empty(frame));
    }
    recorded.iter().for_each(|frame| walkers.take(frame));
    walkers.finish()
}

fn frames(site: &Site, packets: impl Iterator<Item = Vec<Vec<Packet>>>) -> Result<Vec<Frame>, Error> {
    let (mut assembler, mut health) = (Assembler::new(site)?, Health::default());
    let mut frames = Vec::new();
    for of_sensors in packets {
        let mut all: Vec<(usize, Packet)> = (of_sensors.into_iter().enumerate())
            .flat_map(|(sensor, packets)| packets.into_iter().map(move |packet| (sensor, packet)))
            .collect();
        all.sort_by_key(|(_, packet)| packet.time_ns);
        all.iter().for_each(|(sensor, packet)| assembler.push(*sensor, packet, &mut health));
        frames.extend(std::iter::from_fn(|| assembler.pop()));
    }
    assembler.finish();
    frames.extend(std::iter::from_fn(|| assembler.pop()));
    Ok(frames)
}

fn errors(case: &Case, truth: &Site, found: &Calibration) -> Vec<Off> {
    let turned_deg = |a: DMat3, b: DMat3| {
        let turn = a.transpose() * b;
        (0.5 * (turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0)).clamp(-1.0, 1.0).acos().to_degrees()
    };
    let found_pose = |s: usize| {
        let found = &found.sensors[s];
        let sensor = &truth.sensors[s];
        Sensor { position_m: found.position_m, rotation_deg: found.rotation_deg, ..sensor.clone() }
            .site_from_sensor()
    };
    let true_pose = |s: usize| truth.sensors[s].site_from_sensor();
    let between = |pose: &dyn Fn(usize) -> umbracast::geometry::Pose| pose(0).inverse().after(&pose(1));
    let (found_between, true_between) = (between(&found_pose), between(&true_pose));
    let error = |s: usize| {
        let (is, of) = (found_pose(s), true_pose(s));
        let sigma = &found.sensors[s].sigma;
        let off = is.translation_m - of.translation_m;
        let yaw = (found.sensors[s].rotation_deg.yaw - truth.sensors[s].rotation_deg.yaw + 540.0)
            .rem_euclid(360.0)
            - 180.0;
        let clock_ms = found.sensors[s].clock_offset_ms - if s == 1 { case.clock_ms } else { 0.0 };
        let by = |off: f64, sigma: Option<f64>| sigma.map(|sigma| off / sigma);
        // Without walls the frame is the site file's, and only the clock is told against the truth.
        let in_hall = |off: f64, sigma: Option<f64>| by(off, sigma.filter(|_| case.walls));
        Off {
            angle_deg: turned_deg(is.rotation, of.rotation),
            place_m: off.length(),
            between_deg: turned_deg(found_between.rotation, true_between.rotation),
            between_m: found_between.translation_m.distance(true_between.translation_m),
            clock_ms: clock_ms.abs(),
            sigmas: [
                in_hall(yaw, sigma.yaw_deg),
                in_hall(off.x, sigma.x_m),
                in_hall(off.y, sigma.y_m),
                by(clock_ms, sigma.clock_ms.filter(|_| s == 1)),
            ],
        }
    };
    (0..found.sensors.len()).map(error).collect()
}
