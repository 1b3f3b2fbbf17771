//! How long a step of the default mode takes as people and access points grow: `cargo run --release --manifest-path
//! bench/Cargo.toml --bin growth [PEOPLE ACCESS_POINTS | FIGURE.svg]`. On one core. Each frame is run three times from the same
//! memory. The table gives the fastest of the three, which other programs disturb least, and the middle one beside.

use std::time::Duration;

use umbracast::geometry::DVec2;
use umbracast::lidar::Frame;
use umbracast::site::AccessPoint;
use umbracast::{Config, Health, Pipeline};
use umbracast_bench::simulated::{Recording, crossing, walking};
use umbracast_bench::{Stages, timed};
use umbracast_eval::report::plot::{Mark, Panel, Series, draw};
use umbracast_sim::crowd::{Crowd, Trajectory};

/// People with two access points, and access points with so many people.
const PEOPLE: [usize; 5] = [10, 20, 40, 100, 300];
const ACCESS_POINTS: [usize; 5] = [1, 2, 4, 16, 64];
/// With so many people every number of access points is tried.
const LINKS_GROW_WITH: [usize; 2] = [10, 100];
/// Until everybody is followed.
const BEFORE: usize = 30;
/// A circle is crossed within; people meet in the middle after 12 s, sooner where they are many.
const FRAMES: usize = 130;
/// So many no longer cross a circle: they walk in lanes.
const LANES_FROM: usize = 200;
const LANES_FRAMES: usize = 90;
const TRIES: usize = 3;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    println!(
        "a frame is run {TRIES} times; ms, median of the frames and 99 %, of the fastest try and of the middle one"
    );
    println!(
        "people  access points  followed  links  fastest    99 %   middle    99 %   fore  clust  detec  track  forec   cast  fewer"
    );
    if let [people, access_points] = &words[..] {
        let [people, access_points] = [people, access_points].map(|word| word.parse().expect("a number"));
        measure(&recording(people), people, access_points);
        return;
    }
    let mut rows = Vec::new();
    for people in PEOPLE {
        let recording = recording(people);
        for access_points in ACCESS_POINTS {
            if access_points == 2 || LINKS_GROW_WITH.contains(&people) {
                rows.push(measure(&recording, people, access_points));
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
    access_points: usize,
    median_ms: f64,
    p99_ms: f64,
}

/// Over people with two access points, and over access points with each number of people.
fn drawn(rows: &[Row]) -> String {
    const COLORS: [&str; 2] = ["#1b6ca8", "#b74a2f"];
    let line = |name: String, color, mark, points| Series { name, color, mark, points, band: Vec::new() };
    let of = |row: &Row, x: f64, p99: bool| (x, if p99 { row.p99_ms } else { row.median_ms });
    let two = || rows.iter().filter(|row| row.access_points == 2);
    let over_people = |p99: bool| two().map(|row| of(row, row.people as f64, p99)).collect();
    let people = vec![
        line("median".into(), COLORS[0], Mark::Line(2.0), over_people(false)),
        line("99 %".into(), COLORS[0], Mark::Dashed(2.0), over_people(true)),
    ];
    let with = |(people, color): (usize, &'static str)| {
        let points = rows.iter().filter(|row| row.people == people);
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
        panel("a step, ms, best of three tries", "access points", access_points),
    ];
    let drawn = |name, panel| draw(name, panel, (520.0, 320.0)).expect("a figure").svg;
    joined(&[drawn("growth-people", &panels[0]), drawn("growth-links", &panels[1])])
}

/// One picture above the other.
fn joined(pictures: &[String; 2]) -> String {
    let placed = pictures.iter().enumerate().map(|(i, svg)| {
        svg.replacen("<svg", &format!("<svg y=\"{}\" width=\"520\" height=\"320\"", 320 * i), 1)
    });
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 520 640\">\n{}\n</svg>\n",
        placed.collect::<Vec<_>>().join("\n")
    )
}

fn recording(people: usize) -> Recording {
    let site = Config::default().site;
    let made = match people < LANES_FROM {
        true => crossing(&site, people, 12.5, FRAMES),
        false => walking(&site, lanes(people), LANES_FRAMES),
    };
    made.expect("the default site is simulated")
}

/// People in lanes along x, 0.9 m apart, every other lane the other way, 3 m from each to the next.
fn lanes(people: usize) -> Crowd {
    const LANE_M: f64 = 0.9;
    const GAP_M: f64 = 3.0;
    let lanes = (people as f64 * GAP_M / 30.0).ceil();
    let steps = 10 * LANES_FRAMES;
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
        duration_ns: LANES_FRAMES as i64 * umbracast::STEP_NS,
    }
}

/// The two of the default site, then more evenly on a circle of 14 m, 2.5 m high.
fn config(access_points: usize) -> Config {
    let mut config = Config::default();
    let own = config.site.access_points.clone();
    let more = |i: usize| {
        let at = DVec2::from_angle(2.4 * i as f64) * 14.0;
        AccessPoint { name: format!("more-{i}"), position_m: [at.x, at.y, 2.5], radio: None }
    };
    config.site.access_points =
        own.into_iter().chain((0..access_points).map(more)).take(access_points).collect();
    config
}

fn measure(recording: &Recording, people: usize, access_points: usize) -> Row {
    let config = config(access_points);
    let mut stages = Stages::new(&config, &recording.empty).expect("the defaults work");
    let mut pipeline = Pipeline::new(&config, None).expect("the defaults work");
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
    print!("{people:6} {access_points:14} {:9} {:6} ", middle(&mut followed), middle(&mut links));
    let [median_ms, p99_ms] = [0.5, 0.99].map(|share| ms(&mut fastest, share));
    let [middle_ms, middle_p99_ms] = [0.5, 0.99].map(|share| ms(&mut middle_one, share));
    print!("{median_ms:8.2} {p99_ms:7.2} {middle_ms:8.2} {middle_p99_ms:7.2} ");
    for part in &mut parts {
        print!(" {:6.2}", ms(part, 0.5));
    }
    println!(" {fewer:6}");
    Row { people, access_points, median_ms, p99_ms }
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
