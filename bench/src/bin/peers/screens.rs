//! What a million bodies cost a million links, for a peer that works on scenes: in each scene an access point, one body as a
//! screen across the way from it, and devices behind. What the peer is told of is a part, for it is slow; its times are of as many
//! pairs as ours by what one takes.

use std::path::Path;

use umbracast::geometry::{DVec2, DVec3};
use umbracast::radio::{KnifeEdges, Passage};

use crate::exchange::{Answer, times, uniform, write_f64, write_u32};
use crate::loss::{AP_M, BESIDE_M, DEVICE_M, TOP_M, WAVELENGTH_M, WIDTH_M};

const SCENES: usize = 20;
const DEVICES: usize = 50_000;
/// What the peer is told of.
const SCENES_TOLD: usize = 4;
const DEVICES_TOLD: usize = 1_000;
const TRIES: usize = 5;
/// How far a body is from the access point, and how far devices are behind it, in plan view.
const TO_BODY_M: [f64; 2] = [3.0, 12.0];
const BEHIND_M: [f64; 2] = [0.5, 6.0];

/// The screen stands at the origin, along y.
struct Scene {
    ap_m: DVec3,
    devices_m: Vec<DVec3>,
}

fn scenes() -> Vec<Scene> {
    let mut state = 2;
    let mut between = |[low, high]: [f64; 2]| low + (high - low) * uniform(&mut state);
    let mut scene = |_| {
        let ap_m = DVec3::new(-between(TO_BODY_M), 0.0, AP_M);
        let mut device = |_| {
            let behind_m = between(BEHIND_M);
            let aside_m = between([-BESIDE_M, BESIDE_M]) * (behind_m - ap_m.x) / -ap_m.x;
            DVec3::new(behind_m, aside_m, between(DEVICE_M))
        };
        Scene { ap_m, devices_m: (0..DEVICES).map(&mut device).collect() }
    };
    (0..SCENES).map(&mut scene).collect()
}

/// Times ours, and notes what it found of the pairs that the peer is told of.
pub fn cases(answer: &mut Answer, folder: &Path) {
    let scenes = scenes();
    let told = || scenes[..SCENES_TOLD].iter();
    let aps_m: Vec<f64> = told().flat_map(|scene| scene.ap_m.to_array()).collect();
    write_f64(folder, "screen_aps", &[SCENES_TOLD, 3], &aps_m);
    let devices_m: Vec<f64> =
        told().flat_map(|scene| &scene.devices_m[..DEVICES_TOLD]).flat_map(|m| m.to_array()).collect();
    write_f64(folder, "screen_devices", &[SCENES_TOLD, DEVICES_TOLD, 3], &devices_m);
    write_u32(folder, "screen_pairs", &[1], &[(SCENES * DEVICES) as u32]);
    for (name, top_m) in [("screens, two edges", None), ("screens, three edges", Some(TOP_M))] {
        let edges = KnifeEdges { wavelength_m: WAVELENGTH_M, width_m: WIDTH_M, top_m };
        let mut losses_db = Vec::new();
        let ms = times(
            TRIES,
            || (),
            |()| {
                losses_db.clear();
                for scene in &scenes {
                    edges.losses_db(scene.devices_m.iter().map(|ue_m| passage(scene, *ue_m)), &mut losses_db);
                }
            },
        );
        let is_covered = |scene: &Scene, ue_m: DVec3| {
            passage(scene, ue_m).is_some_and(|at| {
                at.aside_m.abs() < 0.5 * WIDTH_M && top_m.is_none_or(|top_m| at.height_m < top_m)
            })
        };
        let losses = scenes.iter().zip(losses_db.chunks_exact(DEVICES)).take(SCENES_TOLD);
        let told: Vec<(f64, bool)> = losses
            .flat_map(|(scene, losses_db)| {
                let of = scene.devices_m.iter().zip(losses_db).take(DEVICES_TOLD);
                of.map(|(ue_m, db)| (*db, is_covered(scene, *ue_m)))
            })
            .collect();
        let covered: Vec<u32> = told.iter().map(|(_, covered)| u32::from(*covered)).collect();
        write_u32(folder, &format!("{name}, covered"), &[SCENES_TOLD, DEVICES_TOLD], &covered);
        let all_db: Vec<f64> = told.iter().map(|(db, _)| *db).collect();
        write_f64(folder, name, &[SCENES_TOLD, DEVICES_TOLD], &all_db);
        let of_covered_db: Vec<f64> =
            told.iter().filter(|(_, covered)| *covered).map(|(db, _)| *db).collect();
        let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
        let found = [
            ("mean, dB", mean(&all_db)),
            ("mean of links that are covered, dB", mean(&of_covered_db)),
            ("mean difference of these, dB", 0.0),
        ];
        answer.case(name, &ms, &found);
    }
}

fn passage(scene: &Scene, ue_m: DVec3) -> Option<Passage> {
    Passage::new(scene.ap_m, ue_m, DVec2::ZERO, 0.0)
}
