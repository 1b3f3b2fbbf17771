//! How likely each link of one access point to ten people is lost at nine steps, by 64 samples of everybody's next second.

use std::path::Path;

use umbracast::Config;
use umbracast::forecast::Forecast;
use umbracast::geometry::DVec2;
use umbracast::track::Track;
use umbracast::{STEP_S, STEPS};
use umbracast_bench::Stages;
use umbracast_bench::simulated::crossing;
use umbracast_sim::body::Walker;
use umbracast_sim::crowd::{Preset, circle_crossing};
use umbracast_sim::scene::Scene;

use crate::bodies::{write_triangles, write_vertices};
use crate::exchange::{Answer, times, write_f32, write_f64};

/// That of every simulated hall of the benchmarks.
const SEED: u64 = 100_000;
const PEOPLE: usize = 10;
const SAMPLES: usize = 64;
/// So many tenths of a second after people set off they meet in the middle of the circle.
const FRAMES: usize = 121;
const TRIES: usize = 400;

pub fn row(folder: &Path) -> Answer {
    let mut config = Config::default();
    config.blockage.samples = SAMPLES;
    config.site.access_points.truncate(1);
    let hall = crossing(&config.site, PEOPLE, 12.5, FRAMES).expect("the default site is simulated");
    let mut stages = Stages::new(&config, &hall.empty).expect("the defaults work");
    hall.frames.iter().for_each(|frame| stages.step(frame));
    let ms = times(TRIES, || (), |()| stages.cast());
    write(folder, &config, &stages);
    let people = stages.blockages.len() as f64;
    let mean = |window: usize| stages.blockages.iter().map(|link| link.p[window - 1]).sum::<f64>() / people;
    let found = [("links", people), ("p 100 ms", mean(1)), ("p 900 ms", mean(STEPS)), ("apart", 0.0)];
    let mut answer = Answer::default();
    answer.case("64 samples, 9 steps", &ms, &found);
    answer
}

/// Whole bodies, where each sample has everybody at each step, and what we found.
fn write(folder: &Path, config: &Config, stages: &Stages) {
    let scene = Scene::truth_only(circle_crossing(Preset::Orca03, PEOPLE, 12.5, SEED), &config.site, SEED);
    let now_ns = FRAMES as i64 * umbracast::STEP_NS;
    let followed: Vec<(&Track, &Forecast)> =
        stages.tracks.iter().zip(&stages.forecasts).filter(|(track, _)| track.confirmed).collect();
    let body = |(track, _): &(&Track, &Forecast)| -> &Walker {
        let far_m = |walker: &&Walker| {
            walker.state_at(now_ns).map_or(f64::INFINITY, |state| state.position_m.distance(track.position_m))
        };
        let nearest = scene.walkers().iter().min_by(|a, b| far_m(a).total_cmp(&far_m(b)));
        nearest.expect("somebody walks")
    };
    let bodies: Vec<&Walker> = followed.iter().map(body).collect();
    write_triangles(folder, &bodies);
    write_vertices(folder, "upright", &bodies, |walker, _, vertices_m| {
        walker.upright_mesh(DVec2::ZERO, 0.0, vertices_m);
    });
    let mut normal = Normal(1);
    let samples: Vec<f32> =
        followed.iter().flat_map(|(track, forecast)| draw(&mut normal, track, forecast)).collect();
    write_f32(folder, "samples", &[followed.len(), SAMPLES, STEPS, 3], &samples);
    let heights_m: Vec<f64> =
        followed.iter().map(|(track, _)| track.height_m * config.site.ue.height_share).collect();
    write_f64(folder, "device_heights", &[followed.len()], &heights_m);
    write_f64(folder, "access_point", &[3], &config.site.access_points[0].position().to_array());
    let ours: Vec<f64> = stages.blockages.iter().flat_map(|link| link.p).collect();
    write_f64(folder, "ours", &[followed.len(), STEPS], &ours);
}

/// Samples of somebody's place and heading at each step, by the joint distribution of the forecast: sample, step, (x, y, heading).
fn draw(normal: &mut Normal, track: &Track, forecast: &Forecast) -> Vec<f32> {
    let root = root(forecast.coupling.state);
    let noise = root2(forecast.coupling.acceleration_psd_m2ps3.map(|row| row.map(|psd| psd / STEP_S)));
    let mut all = Vec::with_capacity(SAMPLES * STEPS * 3);
    for _ in 0..SAMPLES {
        let z: [f64; 4] = std::array::from_fn(|_| normal.next());
        let of = |row: [f64; 4]| row.iter().zip(&z).map(|(root, z)| root * z).sum::<f64>();
        let [x, y, vx, vy] = root.map(of);
        let (mut off_m, mut off_mps) = (DVec2::new(x, y), DVec2::new(vx, vy));
        let turn_rad = track.heading_sigma_rad.min(1.0) * normal.next();
        for step in &forecast.steps {
            let (a, b) = (normal.next(), normal.next());
            let push_mps2 = DVec2::new(noise[0] * a, noise[1] * a + noise[2] * b);
            off_m += off_mps * STEP_S + push_mps2 * (0.5 * STEP_S * STEP_S);
            off_mps += push_mps2 * STEP_S;
            let at_m = step.mean_m + off_m;
            all.extend([at_m.x, at_m.y, track.heading_rad + turn_rad].map(|value| value as f32));
        }
    }
    all
}

/// The lower triangle whose square is a covariance.
fn root(covariance: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
    let mut root = [[0.0_f64; 4]; 4];
    for i in 0..4 {
        for j in 0..=i {
            let rest = covariance[i][j] - (0..j).map(|k| root[i][k] * root[j][k]).sum::<f64>();
            root[i][j] = if i == j { rest.max(0.0).sqrt() } else { rest / root[j][j].max(1e-12) };
        }
    }
    root
}

/// The same of two: first row, then second.
fn root2([[xx, _], [xy, yy]]: [[f64; 2]; 2]) -> [f64; 3] {
    let first = xx.max(0.0).sqrt();
    let second = xy / first.max(1e-12);
    [first, second, (yy - second * second).max(0.0).sqrt()]
}

/// Normal numbers, the same in every run.
struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f64 {
        let [a, b] = [self.share(), self.share()];
        (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }

    /// In [0, 1), by SplitMix64.
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
