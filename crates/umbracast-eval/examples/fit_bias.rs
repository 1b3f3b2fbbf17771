//! Fits the linear model of `umbracast::detect::bias` on simulated returns and prints its coefficients.
//!
//! `cargo run --release -p umbracast-eval --example fit_bias -- [SCENES]` (3 of each preset and of pairs by default)
//! Training scenes have the seeds 110,000 and on, the scenes that the errors are printed for 120,000 and on.

use umbracast::Health;
use umbracast::config::Config;
use umbracast::detect::bias::{ACROSS, ALONG, View};
use umbracast::detect::{Background, Clusterer, Measurer};
use umbracast::geometry::DVec2;
use umbracast::lidar::{Assembler, Packet};
use umbracast::track::Tracker;
use umbracast_sim::crowd::{Crowd, Preset, circle_crossing, pairs};
use umbracast_sim::scene::Scene;

/// A cluster whose base is nearer than this to a person is that person.
const OWN_M: f64 = 0.3;
/// Every so many clusters are fitted as if the heading were unknown.
const UNKNOWN_EVERY: usize = 6;

fn main() {
    let scenes: u64 = std::env::args().nth(1).map_or(3, |n| n.parse().expect("a number of scenes"));
    let (training, test) = (samples(110_000, scenes), samples(120_000, scenes.div_ceil(2)));
    let away = fit::<ALONG>(training.iter().map(|s| (s.view.along, s.off_m.x)));
    let left = fit::<ACROSS>(training.iter().map(|s| (s.view.across, s.off_m.y)));
    println!("const AWAY: [f64; ALONG] = {away:.4?};");
    println!("const LEFT: [f64; ACROSS] = {left:.4?};");
    let rmse = |error: &dyn Fn(&Sample) -> DVec2| {
        (test.iter().map(|s| error(s).length_squared()).sum::<f64>() / test.len() as f64).sqrt()
    };
    let model = |s: &Sample| DVec2::new(dot(&away, &s.view.along), dot(&left, &s.view.across));
    println!("{} samples, tested on {}", training.len(), test.len());
    println!("shifted mean {:.4} m", rmse(&|s| s.off_m));
    println!("fitted       {:.4} m", rmse(&|s| s.off_m - model(s)));
}

struct Sample {
    view: View,
    /// From the base to the true axis, along and across the line of sight.
    off_m: DVec2,
}

fn samples(first_seed: u64, scenes: u64) -> Vec<Sample> {
    let mut samples = Vec::new();
    for seed in first_seed..first_seed + scenes {
        for preset in [Preset::Orca03, Preset::Orca06, Preset::Mixed] {
            scene(circle_crossing(preset, 10, 12.5, seed), seed, &mut samples);
        }
        scene(pairs(4, 0.6, 12.5, seed), seed, &mut samples);
    }
    samples
}

fn scene(crowd: Crowd, seed: u64, samples: &mut Vec<Sample>) {
    let config = Config::default();
    let mut health = Health::default();
    let mut background = Background::new(&config.detect, &config.site).expect("a background");
    let mut clusterer = Clusterer::new(&config.detect, &config.site);
    let mut measurer = Measurer::new(&config.detect, &config.site);
    let mut tracker = Tracker::new(&config.track, &config.site);
    let mut empty = Assembler::new(&config.site).expect("an assembler");
    for packets in Scene::empty(&config.site, seed, 20).expect("a site") {
        push(&mut empty, &packets);
        while let Some(frame) = empty.pop() {
            background.learn_empty(&frame);
        }
    }
    let mut scene = Scene::new(crowd, &config.site, seed).expect("a scene");
    let walkers = scene.walkers().to_vec();
    let mut assembler = Assembler::new(&config.site).expect("an assembler");
    let (mut points, mut clusters, mut detections, mut tracks) = (vec![], vec![], vec![], vec![]);
    while let Some(now) = scene.next_frame() {
        push(&mut assembler, &now.packets);
        while let Some(frame) = assembler.pop() {
            let priors = tracker.priors(frame.time_ns);
            background.foreground(&frame, &priors, &mut health, &mut points);
            clusterer.clusters(&points, &priors, &mut clusters);
            measurer.detections(&points, &clusters, &priors, &mut detections);
            tracker.update(&frame, &detections, &mut tracks);
            for cluster in &clusters {
                let known = !samples.len().is_multiple_of(UNKNOWN_EVERY);
                let view = measurer.view(&points, cluster, if known { &priors } else { &[] });
                let late: i64 = cluster.iter().map(|&i| points[i as usize].time_ns - frame.time_ns).sum();
                let time_ns = frame.time_ns + late / cluster.len() as i64;
                let off_m = walkers
                    .iter()
                    .filter_map(|walker| Some(walker.state_at(time_ns)?.position_m - view.base_m))
                    .min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
                    .filter(|off_m| off_m.length() < OWN_M);
                if let Some(off_m) = off_m {
                    let off_m = DVec2::new(off_m.dot(view.away), off_m.dot(view.away.perp()));
                    samples.push(Sample { view, off_m });
                }
            }
        }
    }
}

fn push(assembler: &mut Assembler, packets: &[Vec<Packet>]) {
    let mut all: Vec<(usize, &Packet)> =
        packets.iter().enumerate().flat_map(|(sensor, list)| list.iter().map(move |p| (sensor, p))).collect();
    all.sort_by_key(|(sensor, packet)| (packet.time_ns, *sensor));
    for (sensor, packet) in all {
        assembler.push(sensor, packet, &mut Health::default());
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Least squares by the normal equations, eliminated with pivots.
fn fit<const N: usize>(samples: impl Iterator<Item = ([f64; N], f64)>) -> [f64; N] {
    let mut rows = [[0.0; N]; N];
    let mut right = [0.0; N];
    let mut n = 0.0;
    for (x, y) in samples {
        n += 1.0;
        for i in 0..N {
            right[i] += x[i] * y;
            for j in 0..N {
                rows[i][j] += x[i] * x[j];
            }
        }
    }
    // A little ridge keeps features that are nearly alike from growing against each other.
    (0..N).for_each(|i| rows[i][i] += 1e-6 * n);
    for i in 0..N {
        let pivot = (i..N).max_by(|&a, &b| rows[a][i].abs().total_cmp(&rows[b][i].abs())).expect("a row");
        rows.swap(i, pivot);
        right.swap(i, pivot);
        for k in 0..N {
            if k != i {
                let factor = rows[k][i] / rows[i][i];
                for j in 0..N {
                    rows[k][j] -= factor * rows[i][j];
                }
                right[k] -= factor * right[i];
            }
        }
    }
    std::array::from_fn(|i| right[i] / rows[i][i])
}
