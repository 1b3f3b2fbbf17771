//! Scores stage 1 up to the detections on simulated scenes: recall, precision and position error of single frames,
//! against the truth at each detection's own time.
//!
//! `cargo run --release -p umbracast-eval --example detect_score -- [--mode default] [--preset orca-03]
//! [--people 10] [--scenes 3] [--seed 100000] [--online] [--pairs] [--gap_cm 50] [--tracker] [--misses] [--points FILE]`
//!
//! Without `--tracker` the priors are empty. `--points` writes the foreground as CSV for a closer look.

use std::fmt::Write as _;

use umbracast::config::{Config, Mode};
use umbracast::detect::{Background, Clusterer, Detection, Measurer};
use umbracast::geometry::DVec2;
use umbracast::lidar::{Assembler, Packet};
use umbracast::track::Tracker;
use umbracast::{Frame, Health, Site};
use umbracast_eval::chain::push;
use umbracast_sim::crowd::{Preset, circle_crossing, pairs};
use umbracast_sim::scene::{PersonTruth, Scene};

/// A detection counts as found within this distance.
const GATE_M: f64 = 0.5;
/// Classes of returns on a person: from this many on.
const CLASSES: [(u32, &str); 5] =
    [(0, "0 returns"), (1, "1 to 5"), (6, "6 to 15"), (16, "16 to 39"), (40, "40 and more")];

#[derive(Default)]
struct Score {
    people: u32,
    found: u32,
    /// Sums over the found: squared error, and error away from the nearest sensor.
    squared_m2: f64,
    away_m: f64,
}

fn main() {
    let value = |name: &str, default: &str| {
        let mut words = std::env::args().skip_while(|word| word != name).skip(1);
        words.next().unwrap_or(default.to_owned())
    };
    let flag = |name: &str| std::env::args().any(|word| word == name);
    let number = |name: &str, default: &str| value(name, default).parse::<u64>().expect("a number");
    let mode: Mode = value("--mode", "default").parse().expect("a mode");
    let preset: Preset = value("--preset", "orca-03").parse().expect("a preset");
    let (scenes, first_seed) = (number("--scenes", "3"), number("--seed", "100000"));
    assert!((100_000..200_000).contains(&first_seed), "tuning uses the seeds 100,000 to 199,999");
    let people = number("--people", "10") as usize;
    let overlay = std::fs::read_to_string(value("--config", "/dev/null")).unwrap_or_default();
    let config = Config::with_overlay(mode, &overlay, "--config").expect("a configuration");

    let mut scores: Vec<Score> = CLASSES.iter().map(|_| Score::default()).collect();
    let (mut detected, mut matched, mut frames) = (0, 0, 0);
    let mut csv = String::from("scene,frame,kind,a,b,c,d,e\n");
    for seed in first_seed..first_seed + scenes {
        let crowd = if flag("--pairs") {
            pairs(people / 2, number("--gap_cm", "50") as f64 * 0.01, 12.5, seed)
        } else {
            circle_crossing(preset, people, 12.5, seed)
        };
        let mut background = Background::new(&config.detect, &config.site).expect("a background");
        let mut clusterer = Clusterer::new(&config.detect, &config.site);
        let mut measurer = Measurer::new(&config.detect, &config.site);
        let mut tracker = Tracker::new(&config.track, &config.site);
        let mut health = Health::default();
        if !flag("--online") {
            for frame in assemble(&config.site, Scene::empty(&config.site, seed, 20).expect("a site")) {
                background.learn_empty(&frame);
            }
        }
        let mut scene = Scene::new(crowd, &config.site, seed).expect("a scene");
        let walkers = scene.walkers().to_vec();
        let mut assembler = Assembler::new(&config.site).expect("an assembler");
        let (mut points, mut clusters, mut detections) = (Vec::new(), Vec::new(), Vec::new());
        let (mut tracks, mut truths) = (Vec::new(), std::collections::VecDeque::new());
        while let Some(now) = scene.next_frame() {
            push(&mut assembler, &now.packets, &mut health);
            truths.push_back(now.people);
            while let Some(frame) = assembler.pop() {
                let truth = truths.pop_front().expect("a truth a frame");
                let priors = if flag("--tracker") { tracker.priors(frame.time_ns) } else { Vec::new() };
                background.foreground(&frame, &priors, &mut health, &mut points);
                clusterer.clusters(&points, &priors, &mut clusters);
                measurer.detections(&points, &clusters, &priors, &mut detections);
                tracker.update(&frame, &detections, &mut tracks);
                if flag("--points") {
                    for p in &points {
                        let (q, ms) = (p.position_m, (p.time_ns - frame.time_ns) as f64 * 1e-6);
                        writeln!(
                            csv,
                            "{seed},{},p,{:.4},{:.4},{:.4},{ms:.2},{}",
                            frame.index, q.x, q.y, q.z, p.sensor
                        )
                        .expect("a string");
                    }
                    for p in &truth {
                        let (q, v) = (p.state.position_m, p.state.velocity_mps);
                        writeln!(
                            csv,
                            "{seed},{},t,{:.4},{:.4},{:.4},{:.4},{:.4}",
                            frame.index, q.x, q.y, v.x, v.y, p.state.heading_rad
                        )
                        .expect("a string");
                    }
                }
                // Where a person was when the points were measured.
                let at = |person: &PersonTruth, d: &Detection| {
                    let walker = &walkers[person.person as usize];
                    walker.state_at(d.time_ns).unwrap_or(person.state).position_m
                };
                let pairs = assign(&truth, &detections, at);
                for (t, person) in truth.iter().enumerate() {
                    let class = CLASSES.iter().rposition(|(from, _)| person.returns >= *from).unwrap_or(0);
                    let score = &mut scores[class];
                    score.people += 1;
                    let Some(&(_, d)) = pairs.iter().find(|&&(of, _)| of == t) else { continue };
                    score.found += 1;
                    let off = detections[d].position_m - at(person, &detections[d]);
                    score.squared_m2 += off.length_squared();
                    score.away_m += off.dot(away(&config.site, detections[d].position_m));
                }
                if flag("--misses") {
                    print_misses(&frame, &truth, &detections, &pairs);
                }
                detected += detections.len();
                matched += pairs.len();
                frames += 1;
            }
        }
        assert!(health.is_clean(), "{health:?}");
    }
    if flag("--points") {
        std::fs::write(value("--points", ""), csv).expect("a place to write");
    }
    println!("{} {scenes} scenes from seed {first_seed}, {frames} frames", mode.name());
    println!("{:12} {:>7} {:>7} {:>8} {:>9}", "returns", "people", "recall", "rmse_m", "away_m");
    let mut seen = Score::default();
    for ((from, name), s) in CLASSES.iter().zip(&scores) {
        print_row(name, s);
        if *from >= 6 {
            seen.people += s.people;
            seen.found += s.found;
            seen.squared_m2 += s.squared_m2;
            seen.away_m += s.away_m;
        }
    }
    print_row("6 and more", &seen);
    println!("precision {:.4}", matched as f64 / f64::from(detected.max(1) as u32));
}

/// Who was missed and what is nobody, with the nearest person or detection.
fn print_misses(frame: &Frame, truth: &[PersonTruth], detections: &[Detection], pairs: &[(usize, usize)]) {
    let nearest = |p: DVec2, others: &mut dyn Iterator<Item = DVec2>| {
        others.map(|q| q.distance(p)).filter(|&m| m > 0.0).fold(f64::INFINITY, f64::min)
    };
    for (_, t) in truth.iter().enumerate().filter(|(t, _)| pairs.iter().all(|(of, _)| of != t)) {
        let p = t.state.position_m;
        let other_m = nearest(p, &mut truth.iter().map(|t| t.state.position_m));
        let detection_m = nearest(p, &mut detections.iter().map(|d| d.position_m));
        println!(
            "{} missed {p:.2}: {} returns, person {other_m:.2} m, detection {detection_m:.2} m",
            frame.index, t.returns
        );
    }
    for (_, d) in detections.iter().enumerate().filter(|(d, _)| pairs.iter().all(|(_, of)| of != d)) {
        let person_m = nearest(d.position_m, &mut truth.iter().map(|t| t.state.position_m));
        let other_m = nearest(d.position_m, &mut detections.iter().map(|d| d.position_m));
        println!(
            "{} nobody {:.2}: {} points, top {:.2}, size {:.2}, person {person_m:.2} m, detection {other_m:.2} m",
            frame.index,
            d.position_m,
            d.points,
            d.top_m,
            d.aabb.size_m()
        );
    }
}

fn print_row(name: &str, s: &Score) {
    let n = f64::from(s.found.max(1));
    let recall = f64::from(s.found) / f64::from(s.people.max(1));
    let (rmse_m, away_m) = ((s.squared_m2 / n).sqrt(), s.away_m / n);
    println!("{name:12} {:7} {recall:7.4} {rmse_m:8.4} {away_m:9.4}", s.people);
}

/// Horizontal direction from the nearest sensor.
fn away(site: &Site, p: DVec2) -> DVec2 {
    let from = site.sensors.iter().map(|s| DVec2::new(s.position_m[0], s.position_m[1]));
    let nearest = from.min_by(|a, b| a.distance_squared(p).total_cmp(&b.distance_squared(p)));
    nearest.map_or(DVec2::ZERO, |s| (p - s).normalize_or_zero())
}

fn assemble(site: &Site, revolutions: Vec<Vec<Vec<Packet>>>) -> Vec<Frame> {
    let mut assembler = Assembler::new(site).expect("an assembler");
    let mut frames = Vec::new();
    for packets in &revolutions {
        push(&mut assembler, packets, &mut Health::default());
        frames.extend(std::iter::from_fn(|| assembler.pop()));
    }
    frames
}

/// Pairs of truth and detection, nearest first: at this gate people are too far apart for it to matter.
fn assign(
    truth: &[PersonTruth],
    detections: &[Detection],
    at: impl Fn(&PersonTruth, &Detection) -> DVec2,
) -> Vec<(usize, usize)> {
    let mut candidates = Vec::new();
    for (t, person) in truth.iter().enumerate() {
        for (d, detection) in detections.iter().enumerate() {
            let off_m = at(person, detection).distance(detection.position_m);
            if off_m < GATE_M {
                candidates.push((off_m, t, d));
            }
        }
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (_, t, d) in candidates {
        if pairs.iter().all(|&(other_t, other_d)| other_t != t && other_d != d) {
            pairs.push((t, d));
        }
    }
    pairs
}
