//! Algorithm 1 of the paper over nine steps: who is hidden from an access point behind the box of another.

use std::path::Path;

use umbracast::STEPS;
use umbracast::blockage::algorithm1::{PersonBox, Rays};
use umbracast::geometry::{Aabb, DVec2, DVec3};

use crate::exchange::{Answer, times, write_f64};

const AP_M: DVec3 = DVec3::new(0.5, 0.3, 3.0);
const HALF_M: DVec3 = DVec3::new(0.25, 0.25, 0.875);
const PEOPLE: [usize; 3] = [10, 100, 1000];

/// People and where they will be: positions now, their boxes now, and the positions of each step.
struct Scene {
    now: Vec<(DVec2, Aabb)>,
    steps_m: Vec<Vec<DVec2>>,
}

/// A place of 1.2 m square for everybody, so that boxes seldom overlap, and one velocity each.
fn scene(people: usize) -> Scene {
    let side = (people as f64).sqrt().ceil() as usize;
    let place = |i: usize| {
        let wobble = DVec2::new((i * 37 % 101) as f64, (i * 53 % 97) as f64) * 0.003;
        (DVec2::new((i % side) as f64, (i / side) as f64) - 0.5 * side as f64) * 1.2 + wobble
    };
    let now = |i: usize| {
        let middle_m = place(i).extend(HALF_M.z);
        (place(i), Aabb { min_m: middle_m - HALF_M, max_m: middle_m + HALF_M })
    };
    let at = |i: usize, step: usize| place(i) + DVec2::from_angle(0.01 * i as f64) * (0.12 * step as f64);
    let steps_m = (1..=STEPS).map(|step| (0..people).map(|i| at(i, step)).collect()).collect();
    Scene { now: (0..people).map(now).collect(), steps_m }
}

/// Ours, as `Caster` calls it in mode `paper`.
pub fn row(folder: &Path) -> Answer {
    measure(
        |people, scene| {
            let flat: Vec<f64> = scene.steps_m.iter().flatten().flat_map(|p| p.to_array()).collect();
            write_f64(folder, &format!("steps_{people}"), &[STEPS, people, 2], &flat);
            write_f64(folder, "half", &[3], &HALF_M.to_array());
            write_f64(folder, "ap", &[3], &AP_M.to_array());
        },
        |scene| {
            let (mut rays, mut people) = (Rays::default(), Vec::with_capacity(scene.now.len()));
            let mut blocked = vec![false; scene.now.len()];
            for step_m in &scene.steps_m {
                let moved = |(&(from_m, aabb), &to_m): (&(DVec2, Aabb), &DVec2)| {
                    (to_m, PersonBox::Aabb(aabb).moved_by(to_m - from_m, 0.0))
                };
                people.clear();
                people.extend(scene.now.iter().zip(step_m).map(moved));
                rays.cast_step(AP_M, &people, &mut blocked);
            }
            blocked
        },
    )
}

/// The peer: a plain listing, number by number, with the misprints of lines 10 and 11 corrected as ours has them.
pub fn listing(_: &Path) -> Answer {
    measure(
        |_, _| (),
        |scene| {
            let mut blocked = vec![false; scene.now.len()];
            for step_m in &scene.steps_m {
                let moved = |(&(from_m, aabb), &to_m): (&(DVec2, Aabb), &DVec2)| aabb.moved_by(to_m - from_m);
                let boxes: Vec<Aabb> = scene.now.iter().zip(step_m).map(moved).collect();
                for q in 0..boxes.len() {
                    if blocked[q] {
                        continue;
                    }
                    let (to_q, ray) = (step_m[q] - AP_M.truncate(), boxes[q].center_m() - AP_M);
                    let mut nearest = f64::INFINITY;
                    for p in (0..boxes.len()).filter(|&p| p != q) {
                        let to_p = step_m[p] - AP_M.truncate();
                        if to_q.dot(to_p) > 0.0 && to_p.length() < to_q.length() {
                            nearest = nearest.min(entry(&boxes[p], ray));
                        }
                    }
                    blocked[q] = nearest <= 1.0;
                }
            }
            blocked
        },
    )
}

/// Where along the ray from the access point the box is entered; infinite where it is not.
fn entry(aabb: &Aabb, ray: DVec3) -> f64 {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        if ray[axis] == 0.0 {
            if AP_M[axis] < aabb.min_m[axis] || AP_M[axis] > aabb.max_m[axis] {
                return f64::INFINITY;
            }
            continue;
        }
        let (low, high) =
            ((aabb.min_m[axis] - AP_M[axis]) / ray[axis], (aabb.max_m[axis] - AP_M[axis]) / ray[axis]);
        enter = enter.max(low.min(high));
        leave = leave.min(low.max(high));
    }
    if enter <= leave { enter } else { f64::INFINITY }
}

fn measure(write: impl Fn(usize, &Scene), cast: impl Fn(&Scene) -> Vec<bool>) -> Answer {
    let mut answer = Answer::default();
    for people in PEOPLE {
        let scene = scene(people);
        write(people, &scene);
        let blocked = cast(&scene).iter().filter(|&&blocked| blocked).count();
        let ms = times(20, || (), |()| drop(std::hint::black_box(cast(std::hint::black_box(&scene)))));
        answer.case(&format!("{people} people"), &ms, &[("blocked", blocked as f64)]);
    }
    answer
}
