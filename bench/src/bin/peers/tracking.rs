//! From detections to tracks, a frame at a time: people walk on a square, one in twenty is missed, one in fifty is nobody.

use std::path::Path;

use umbracast::detect::Detection;
use umbracast::geometry::{Aabb, DVec2, DVec3, Obb};
use umbracast::lidar::Views;
use umbracast::track::Tracker;
use umbracast::{Config, Mode, STEP_NS, STEP_S};

use crate::exchange::{Answer, took_ms, uniform, write_f64, write_u32};

/// A person for so many square metres.
const ROOM_M2: f64 = 16.0;
const NOISE_M: f64 = 0.05;
const HALF_M: DVec3 = DVec3::new(0.25, 0.25, 0.875);

/// Numbers by chance, from one to the next.
struct Chance(u64);

impl Chance {
    fn uniform(&mut self) -> f64 {
        uniform(&mut self.0)
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Where everybody is and what is detected, frame by frame.
struct Scene {
    truth_m: Vec<Vec<DVec2>>,
    detected_m: Vec<Vec<DVec2>>,
}

/// Everybody walks straight at a pace of their own and turns round at the edge.
fn scene(people: usize, frames: usize) -> Scene {
    let (side_m, mut chance) = ((people as f64 * ROOM_M2).sqrt(), Chance(people as u64));
    let place = |chance: &mut Chance| DVec2::new(chance.uniform() - 0.5, chance.uniform() - 0.5) * side_m;
    let mut walkers: Vec<(DVec2, DVec2)> = (0..people)
        .map(|_| {
            let angle_rad = std::f64::consts::TAU * chance.uniform();
            (place(&mut chance), DVec2::from_angle(angle_rad) * (0.8 + 0.6 * chance.uniform()))
        })
        .collect();
    let mut scene = Scene { truth_m: Vec::new(), detected_m: Vec::new() };
    for _ in 0..frames {
        let mut detected_m = Vec::new();
        for (at_m, velocity_mps) in &mut walkers {
            for axis in 0..2 {
                let next_m = at_m[axis] + velocity_mps[axis] * STEP_S;
                if next_m.abs() > 0.5 * side_m {
                    velocity_mps[axis] = -velocity_mps[axis];
                }
            }
            *at_m += *velocity_mps * STEP_S;
            if chance.uniform() < 0.95 {
                detected_m.push(*at_m + NOISE_M * DVec2::new(chance.normal(), chance.normal()));
            }
            if chance.uniform() < 0.02 {
                detected_m.push(place(&mut chance));
            }
        }
        scene.truth_m.push(walkers.iter().map(|(at_m, _)| *at_m).collect());
        scene.detected_m.push(detected_m);
    }
    scene
}

fn detection(at_m: DVec2, time_ns: i64) -> Detection {
    let middle_m = at_m.extend(HALF_M.z);
    let aabb = Aabb { min_m: middle_m - HALF_M, max_m: middle_m + HALF_M };
    Detection {
        position_m: at_m,
        covariance_m2: Some([[NOISE_M * NOISE_M, 0.0], [0.0, NOISE_M * NOISE_M]]),
        z_m: 0.9,
        time_ns,
        points: 40,
        full_body: true,
        top_m: 1.75,
        top_diagonal_m: 0.2,
        gait: None,
        reaches: Vec::new(),
        bands: Default::default(),
        overhead: None,
        facing: None,
        aabb,
        obb: Obb::from_aabb(&aabb),
    }
}

/// The paper's tracker (Kalman filter, assignment of least cost) and, beside it, ours without beams to look along. Times are
/// of single frames.
pub fn row(folder: &Path) -> Answer {
    let mut answer = Answer::default();
    for (people, frames) in [(100, 100), (1000, 60)] {
        let scene = scene(people, frames);
        write_scene(folder, people, &scene);
        for mode in [Mode::Paper, Mode::Default] {
            // No scan looks, so that our tracker has no sight to tell a miss from somebody hidden.
            let mut config = Config::for_mode(mode);
            config.site.hall.length_m = (people as f64 * ROOM_M2).sqrt() + 1.0;
            config.site.hall.width_m = config.site.hall.length_m;
            let (mut tracker, mut tracks) = (Tracker::new(&config.track, &config.site), Vec::new());
            let (mut ms, mut rows) = (Vec::new(), Vec::new());
            for (frame, detected_m) in scene.detected_m.iter().enumerate() {
                let time_ns = (frame as i64 + 1) * STEP_NS;
                let views = Views { time_ns, of_scans: Vec::new() };
                let detections: Vec<Detection> =
                    detected_m.iter().map(|&at_m| detection(at_m, time_ns)).collect();
                ms.push(took_ms(|| tracker.update(&views, &detections, &mut tracks)));
                for track in tracks.iter().filter(|track| track.confirmed) {
                    rows.extend([frame as f64, track.id as f64, track.position_m.x, track.position_m.y]);
                }
            }
            let name = format!("{people} people, mode {}", mode.name());
            let file = format!("ours_{people}_{}", mode.name());
            write_f64(folder, &file, &[rows.len() / 4, 4], &rows);
            answer.case(&name, &ms, &[]);
        }
    }
    answer
}

fn write_scene(folder: &Path, people: usize, scene: &Scene) {
    let flat =
        |frames: &[Vec<DVec2>]| -> Vec<f64> { frames.iter().flatten().flat_map(|p| p.to_array()).collect() };
    let frames = scene.truth_m.len();
    write_f64(folder, &format!("truth_{people}"), &[frames, people, 2], &flat(&scene.truth_m));
    let detected = flat(&scene.detected_m);
    write_f64(folder, &format!("detected_{people}"), &[detected.len() / 2, 2], &detected);
    let counts: Vec<u32> = scene.detected_m.iter().map(|frame| frame.len() as u32).collect();
    write_u32(folder, &format!("counts_{people}"), &[frames], &counts);
}
