//! Fits the few numbers of the predictor's body on tuning scenes: which trunk and head, put at people's true
//! places and headings, agree best with the mesh truth about who is blocked? Prints every improvement and, at
//! the end, the lines for `config/default.toml`.
//!
//! `cargo run --release -p umbracast-eval --example fit_body -- 12`

use rayon::prelude::*;
use umbracast::Config;
use umbracast::blockage::body::{BodySize, UprightBody};
use umbracast::geometry::{DVec2, DVec3};
use umbracast_eval::chain::CIRCLE_M;
use umbracast_sim::crowd::{Preset, circle_crossing};
use umbracast_sim::scene::Scene;

/// Tuning seeds only (docs/CONVENTIONS.md).
const FIRST_SEED: u64 = 100_000;

/// One link in one frame: the ray, the others, and whether it was blocked.
struct Case {
    access_point_m: DVec3,
    ue_m: DVec3,
    others: Vec<(DVec2, DVec2, f64)>,
    blocked: bool,
}

fn cases(preset: Preset, seed: u64, config: &Config) -> Vec<Case> {
    let crowd = circle_crossing(preset, 10, CIRCLE_M, seed);
    let mut scene = Scene::truth_only(crowd, &config.site, seed);
    let mut cases = Vec::new();
    while let Some(frame) = scene.next_frame() {
        let state = |person: u32| frame.people.iter().find(|p| p.person == person).map(|p| p.state);
        for link in frame.links.iter().filter(|_| frame.index % 3 == 0) {
            let Some(own) = state(link.person) else { continue };
            let others = frame.people.iter().filter(|p| p.person != link.person);
            cases.push(Case {
                access_point_m: config.site.access_points[link.access_point].position(),
                ue_m: config.site.ue.on_body(own.position_m, own.heading_rad, own.height_m),
                others: others
                    .map(|p| (p.state.position_m, DVec2::from_angle(p.state.heading_rad), p.state.height_m))
                    .collect(),
                blocked: link.blocked,
            });
        }
    }
    cases
}

fn f1(size: &BodySize, cases: &[Case]) -> f64 {
    let count = |case: &Case| {
        let hit = |&(at_m, ahead, height_m): &(DVec2, DVec2, f64)| {
            UprightBody::new(size, at_m, ahead, height_m).hit(case.access_point_m, case.ue_m).is_some()
        };
        match (case.others.iter().any(hit), case.blocked) {
            (true, true) => [1, 0],
            (false, false) => [0, 0],
            _ => [0, 1],
        }
    };
    let [hits, errors] =
        cases.par_iter().map(count).reduce(|| [0, 0], |a: [u64; 2], b| [a[0] + b[0], a[1] + b[1]]);
    2.0 * hits as f64 / (2 * hits + errors) as f64
}

fn main() {
    let scenes: u64 = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(12);
    let config = Config::default();
    let all: Vec<Case> = (0..scenes)
        .into_par_iter()
        .flat_map_iter(|i| {
            let preset = [Preset::Orca03, Preset::Orca06][(i % 2) as usize];
            cases(preset, FIRST_SEED + i, &config)
        })
        .collect();
    let mut best = BodySize {
        trunk_depth_m: config.blockage.trunk_depth_m,
        trunk_width_m: config.blockage.trunk_width_m,
        shoulder_share: config.blockage.shoulder_share,
        head_diameter_m: config.blockage.head_diameter_m,
    };
    let mut score = f1(&best, &all);
    println!("{} links, start {score:.4}", all.len());
    let fields: [fn(&mut BodySize) -> &mut f64; 4] = [
        |b| &mut b.trunk_depth_m,
        |b| &mut b.trunk_width_m,
        |b| &mut b.shoulder_share,
        |b| &mut b.head_diameter_m,
    ];
    for step in [0.04, 0.02, 0.01] {
        let mut improved = true;
        while improved {
            improved = false;
            for field in fields {
                for change in [step, -step] {
                    let mut trial = best;
                    *field(&mut trial) += change;
                    let value = f1(&trial, &all);
                    if value > score {
                        (best, score, improved) = (trial, value, true);
                        println!("{score:.4} {best:?}");
                    }
                }
            }
        }
    }
    println!("trunk_depth_m = {:.2}", best.trunk_depth_m);
    println!("trunk_width_m = {:.2}", best.trunk_width_m);
    println!("shoulder_share = {:.2}", best.shoulder_share);
    println!("head_diameter_m = {:.2}", best.head_diameter_m);
}
