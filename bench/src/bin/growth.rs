//! How long a step of the default mode takes as people, sensors and access points grow: `cargo run --release --manifest-path
//! bench/Cargo.toml --bin growth [PEOPLE SENSORS ACCESS_POINTS [THREADS] | FIGURE.svg]`. On one core, and some rows once more on all
//! there are. Each frame is run three times from the same memory. The table gives the fastest of the three, which other programs disturb least, and the middle one beside.

use std::time::Duration;

use umbracast::geometry::DVec2;
use umbracast::lidar::Frame;
use umbracast::site::{AccessPoint, Site};
use umbracast::{Config, Health, Pipeline};
use umbracast_bench::simulated::{Recording, crossing, walking};
use umbracast_bench::{Stages, timed};
use umbracast_eval::report::plot::{Mark, Panel, Series, draw};
use umbracast_sim::crowd::{Crowd, Trajectory};

/// How many people, sensors and access points each row has. Rows with the same people and sensors come one after the other.
const CASES: [[usize; 3]; 22] = [
    [10, 2, 1],
    [10, 2, 2],
    [10, 2, 4],
    [10, 2, 16],
    [10, 2, 64],
    [20, 2, 2],
    [40, 2, 2],
    [100, 2, 1],
    [100, 2, 2],
    [100, 2, 4],
    [100, 2, 16],
    [100, 2, 64],
    [300, 2, 2],
    [100, 1, 2],
    [100, 4, 2],
    [100, 4, 8],
    [100, 8, 2],
    [100, 16, 2],
    [300, 16, 2],
    [1000, 16, 2],
    // A stand of a stadium.
    [1000, 16, 32],
    [3000, 16, 2],
];
/// Measured with a thread a core as well.
const SHARED: [[usize; 3]; 5] = [[10, 2, 2], [100, 2, 2], [100, 2, 64], [100, 4, 8], [1000, 16, 32]];
/// With so many people and two sensors the figure shows how access points count.
const LINKS_GROW_WITH: [usize; 2] = [10, 100];
/// Until everybody is followed.
const BEFORE: usize = 30;
/// A circle is crossed within; people meet in the middle after 12 s, sooner where they are many.
const FRAMES: usize = 130;
const RADIUS_M: f64 = 12.5;
/// So many no longer cross a circle: they walk in lanes, in a hall that is as long as it takes.
const LANES_FROM: usize = 200;
const LANES_FRAMES: usize = 90;
/// So many are simulated for a shorter time.
const STAND_FROM: usize = 1000;
const STAND_FRAMES: usize = 40;
/// Lanes lie side by side along y; in each, people follow each other along x.
const LANE_M: f64 = 0.9;
const GAP_M: f64 = 3.0;
const TRIES: usize = 3;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    println!(
        "a frame is run {TRIES} times; ms, median of the frames and 99 %, of the fastest try and of the middle one"
    );
    println!(
        "people  sensors  access points  threads  followed  links  fastest    99 %   middle    99 %   fore  clust  detec  track  forec   cast  fewer"
    );
    if let [people, sensors, access_points, threads @ ..] = &words[..] {
        let number = |word: &String| word.parse::<usize>().expect("a number");
        let case = [people, sensors, access_points].map(number);
        measure(&recording(case[0], case[1]), case, threads.first().map_or(1, number));
        return;
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut rows = Vec::new();
    for of_hall in CASES.chunk_by(|a, b| a[..2] == b[..2]) {
        let recording = recording(of_hall[0][0], of_hall[0][1]);
        for &case in of_hall {
            rows.push(measure(&recording, case, 1));
            if SHARED.contains(&case) && cores > 1 {
                measure(&recording, case, cores);
            }
        }
    }
    if let [figure] = &words[..] {
        std::fs::write(figure, drawn(&rows)).expect("the figure's place can be written");
    }
}

/// A line of the table, of the fastest tries.
struct Row {
    people: usize,
    sensors: usize,
    access_points: usize,
    median_ms: f64,
    p99_ms: f64,
}

/// Over people with two access points, in the hall with two sensors and in those with sixteen, over sensors, and over access points
/// with each number of people.
fn drawn(rows: &[Row]) -> String {
    const COLORS: [&str; 2] = ["#1b6ca8", "#b74a2f"];
    let line = |name: String, color, mark, points| Series { name, color, mark, points, band: Vec::new() };
    let of = |row: &Row, x: f64, p99: bool| (x, if p99 { row.p99_ms } else { row.median_ms });
    let two = || rows.iter().filter(|row| row.access_points == 2);
    let over_people = |sensors: usize, p99: bool| {
        two().filter(|row| row.sensors == sensors).map(|row| of(row, row.people as f64, p99)).collect()
    };
    let people = [2, 16]
        .into_iter()
        .zip(COLORS)
        .flat_map(|(sensors, color)| {
            let name = |what: &str| format!("{sensors} sensors, {what}");
            [
                line(name("median"), color, Mark::Line(2.0), over_people(sensors, false)),
                line(name("99 %"), color, Mark::Dashed(2.0), over_people(sensors, true)),
            ]
        })
        .collect();
    let over_sensors = |p99: bool| {
        let mut points: Vec<(f64, f64)> =
            two().filter(|row| row.people == 100).map(|row| of(row, row.sensors as f64, p99)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let sensors = vec![
        line("median".into(), COLORS[0], Mark::Line(2.0), over_sensors(false)),
        line("99 %".into(), COLORS[0], Mark::Dashed(2.0), over_sensors(true)),
    ];
    let with = |(people, color): (usize, &'static str)| {
        let points = rows.iter().filter(|row| row.people == people && row.sensors == 2);
        let points = points.map(|row| of(row, row.access_points as f64, false)).collect();
        line(format!("{people} people, median"), color, Mark::Line(2.0), points)
    };
    let access_points = LINKS_GROW_WITH.into_iter().zip(COLORS).map(with).collect();
    let panel = |title: &str, x_label: &str, series: Vec<Series>| {
        let most =
            |at: fn(&(f64, f64)) -> f64| series.iter().flat_map(|s| &s.points).map(at).fold(1.0, f64::max);
        Panel {
            title: title.to_owned(),
            x_label: x_label.to_owned(),
            x: (0.0, most(|p| p.0)),
            y: (0.0, 1.1 * most(|p| p.1)),
            series,
            ..Panel::default()
        }
    };
    let panels = [
        panel("a step, ms, best of three tries, two access points", "people", people),
        panel("a step, ms, best of three tries, 100 people, two access points", "sensors", sensors),
        panel("a step, ms, best of three tries, two sensors", "access points", access_points),
    ];
    let drawn = |name, panel| draw(name, panel, (520.0, 320.0)).expect("a figure").svg;
    joined(&[
        drawn("growth-people", &panels[0]),
        drawn("growth-sensors", &panels[1]),
        drawn("growth-links", &panels[2]),
    ])
}

/// One picture above the other.
fn joined(pictures: &[String; 3]) -> String {
    let placed = pictures.iter().enumerate().map(|(i, svg)| {
        svg.replacen("<svg", &format!("<svg y=\"{}\" width=\"520\" height=\"320\"", 320 * i), 1)
    });
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 520 960\">\n{}\n</svg>\n",
        placed.collect::<Vec<_>>().join("\n")
    )
}

fn recording(people: usize, sensors: usize) -> Recording {
    let site = site(people, sensors);
    let made = match people {
        0..LANES_FROM => crossing(&site, people, RADIUS_M, FRAMES),
        LANES_FROM..STAND_FROM => walking(&site, lanes(people, LANES_FRAMES), LANES_FRAMES),
        _ => walking(&site, lanes(people, STAND_FRAMES), STAND_FRAMES),
    };
    made.expect("the site is simulated")
}

/// People in lanes along x, 0.9 m apart, every other lane the other way, 3 m from each to the next.
fn lanes(people: usize, frames: usize) -> Crowd {
    let lanes = lanes_of(people);
    let steps = 10 * frames;
    let way = |person: usize| {
        let (lane, place) = (person % lanes as usize, person / lanes as usize);
        let ahead = if lane % 2 == 0 { 1.0 } else { -1.0 };
        let speed_mps = 1.1 + 0.02 * (lane % 5) as f64;
        let start = DVec2::new(
            place as f64 * GAP_M - 15.0 + 0.37 * (lane % 7) as f64,
            (lane as f64 - 0.5 * (lanes - 1.0)) * LANE_M,
        );
        let at = |step: usize| {
            // Who leaves at one end comes back at the other.
            let x = ahead * start.x + speed_mps * 0.01 * step as f64;
            DVec2::new(ahead * ((x + 15.0).rem_euclid(30.0) - 15.0), start.y)
        };
        (0..=steps).map(at).collect::<Vec<DVec2>>()
    };
    let trajectory = |person: usize| Trajectory {
        person: person as u32,
        start_ns: 0,
        step_ns: 10_000_000,
        positions_m: way(person),
        arrived_ns: None,
        height_m: None,
    };
    Crowd {
        trajectories: (0..people).map(trajectory).collect(),
        duration_ns: frames as i64 * umbracast::STEP_NS,
    }
}

fn lanes_of(people: usize) -> f64 {
    (people as f64 * GAP_M / 30.0).ceil()
}

/// The default site with its first sensors, with four or more evenly about the circle that is crossed. Where people walk in lanes and
/// more than two sensors look, they hang in pairs along the lanes' ends, in a hall of its own with nothing but people in it.
fn site(people: usize, sensors: usize) -> Site {
    let mut site = Config::default().site;
    let of = |i: usize, position_m: [f64; 3], yaw_deg: f64| {
        let mut sensor = Config::default().site.sensors[0].clone();
        sensor.name = format!("lidar_{i}");
        sensor.position_m = position_m;
        sensor.rotation_deg.yaw = yaw_deg;
        sensor
    };
    if sensors <= site.sensors.len() {
        site.sensors.truncate(sensors);
    } else if people < LANES_FROM {
        let about = |i: usize| {
            let turn = std::f64::consts::TAU * i as f64 / sensors as f64;
            let at = DVec2::from_angle(turn) * 16.0;
            of(i, [at.x, at.y, 9.0], turn.to_degrees() + 180.0)
        };
        site.sensors = (0..sensors).map(about).collect();
    } else {
        let width_m = width_m(people);
        (site.hall.length_m, site.hall.width_m) = (34.0, width_m + 4.0);
        (site.pillars, site.furniture) = (Vec::new(), Vec::new());
        let along = |i: usize| {
            let y = width_m * ((i / 2) as f64 + 0.5) / (sensors / 2) as f64 - 0.5 * width_m;
            let (x, yaw_deg) = if i.is_multiple_of(2) { (16.0, 180.0) } else { (-16.0, 0.0) };
            of(i, [x, y, 9.0], yaw_deg)
        };
        site.sensors = (0..sensors).map(along).collect();
    }
    site
}

fn width_m(people: usize) -> f64 {
    lanes_of(people) * LANE_M
}

/// The two of the default site, then more evenly on a circle of 14 m, 2.5 m high; along the hall where it is longer.
fn config([people, sensors, access_points]: [usize; 3]) -> Config {
    let mut config = Config { site: site(people, sensors), ..Config::default() };
    let own = config.site.access_points.clone();
    let is_long = people >= LANES_FROM && sensors > 2;
    let more = |i: usize| {
        let at = match is_long {
            true => {
                let along = (i as f64 + 0.5) / access_points as f64 - 0.5;
                DVec2::new(if i.is_multiple_of(2) { 14.0 } else { -14.0 }, along * width_m(people))
            }
            false => DVec2::from_angle(2.4 * i as f64) * 14.0,
        };
        AccessPoint { name: format!("more-{i}"), position_m: [at.x, at.y, 2.5], radio: None }
    };
    config.site.access_points =
        own.into_iter().chain((0..access_points).map(more)).take(access_points).collect();
    config
}

fn measure(recording: &Recording, case: [usize; 3], threads: usize) -> Row {
    let [people, sensors, access_points] = case;
    let config = config(case);
    let mut stages = Stages::new(&config, &recording.empty).expect("the defaults work");
    let mut pipeline = Pipeline::new(&config, None).expect("the defaults work");
    pipeline.use_threads(threads);
    stages.use_threads(threads);
    recording.empty.iter().for_each(|frame| pipeline.learn_empty(frame));
    let (mut fastest, mut middle_one, mut parts) = (Vec::new(), Vec::new(), vec![Vec::new(); 6]);
    let (mut followed, mut links, mut fewer) = (Vec::new(), Vec::new(), 0);
    for (k, frame) in recording.frames.iter().enumerate() {
        if k < BEFORE {
            pipeline.step(frame);
            stages.step(frame);
            continue;
        }
        let mut tries = Vec::with_capacity(TRIES);
        for _ in 1..TRIES {
            let mut pipeline = pipeline.clone();
            tries.push(timed(|| {
                pipeline.step(frame);
            }));
        }
        let mut health = Health::default();
        tries.push(timed(|| health = pipeline.step(frame).health));
        tries.sort();
        fastest.push(tries[0]);
        middle_one.push(tries[TRIES / 2]);
        for (part, took) in parts.iter_mut().zip(by_stage(&mut stages, frame)) {
            part.push(took);
        }
        followed.push(stages.tracks.iter().filter(|track| track.confirmed).count());
        links.push(stages.blockages.len());
        fewer = health.frames_with_fewer_samples;
    }
    let ms = |times: &mut Vec<Duration>, share: f64| {
        times.sort();
        times[((times.len() as f64 * share) as usize).min(times.len() - 1)].as_secs_f64() * 1e3
    };
    let middle = |values: &mut Vec<usize>| {
        values.sort();
        values[values.len() / 2]
    };
    print!("{people:6} {sensors:8} {access_points:14} {threads:8} ");
    print!("{:9} {:6} ", middle(&mut followed), middle(&mut links));
    let [median_ms, p99_ms] = [0.5, 0.99].map(|share| ms(&mut fastest, share));
    let [middle_ms, middle_p99_ms] = [0.5, 0.99].map(|share| ms(&mut middle_one, share));
    print!("{median_ms:8.2} {p99_ms:7.2} {middle_ms:8.2} {middle_p99_ms:7.2} ");
    for part in &mut parts {
        print!(" {:6.2}", ms(part, 0.5));
    }
    println!(" {fewer:6}");
    Row { people, sensors, access_points, median_ms, p99_ms }
}

fn by_stage(stages: &mut Stages, frame: &Frame) -> [Duration; 6] {
    stages.expect(frame);
    [
        timed(|| stages.foreground(frame)),
        timed(|| stages.clusters()),
        timed(|| stages.detections()),
        timed(|| stages.update(frame)),
        timed(|| stages.forecast()),
        timed(|| stages.cast()),
    ]
}
