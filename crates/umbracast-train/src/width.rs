//! Fits the numbers of `umbracast::track::width` on simulated people: how the width of a person's trunk for its
//! height follows from the extents of detections in free sight.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use umbracast::config::Config;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::lidar::{Assembler, Views};
use umbracast::track::Track;
use umbracast::track::visibility::{Body, Visibility};
use umbracast::track::width::share;
use umbracast::{Error, Health, Pipeline};
use umbracast_eval::run::chain::{empty_frames, push};
use umbracast_sim::body::Walker;
use umbracast_sim::crowd::{Preset, circle_crossing};
use umbracast_sim::scene::Scene;

/// Tuning seeds only (docs/CONVENTIONS.md).
const FIRST_SEED: u64 = 135_000;
/// A track nearer than this to a person is that person's.
const OWN_M: f64 = 0.3;
/// Where on a body, in shares of the height, the trunk with the arms is measured.
const TRUNK: [f64; 2] = [0.7, 0.8];

/// One detection of a person: extent over height, speed.
type Seen = (f64, f64);

/// Logarithm of the trunk's width over the height, and every frame.
type Person = (f64, Vec<Seen>);

/// Watches so many scenes and returns the constants in the order of the source. `scene_done` is called after each scene,
/// from any thread.
///
/// # Errors
/// A sensor that cannot be simulated.
pub fn fit_width(scenes: usize, scene_done: impl Fn(usize, usize) + Sync) -> Result<String, Error> {
    let done = AtomicUsize::new(0);
    let counted = |scene: usize| {
        let people = watch(scene as u64);
        scene_done(done.fetch_add(1, Ordering::Relaxed) + 1, scenes);
        people
    };
    let people: Result<Vec<Vec<Person>>, Error> = (0..scenes).into_par_iter().map(counted).collect();
    let people: Vec<Person> = people?.concat().into_iter().filter(|(_, seen)| seen.len() >= 60).collect();
    let all: Vec<Seen> = people.iter().flat_map(|(_, seen)| seen.iter().copied()).collect();
    let (per_mps, standing) = line(all.iter().map(|&(share, speed)| (speed, share)));
    let off = |&(share, speed): &Seen| share - standing - per_mps * speed;
    let mean_off = |seen: &[Seen]| seen.iter().map(off).sum::<f64>() / seen.len() as f64;
    let mean_width = people.iter().map(|p| p.0).sum::<f64>() / people.len() as f64;
    let prior = root_mean(people.iter().map(|p| p.0 - mean_width));
    let (per_scale, base) = line(people.iter().map(|(width, seen)| (width - mean_width, mean_off(seen))));
    // Errors of means over so many frames at the beginning: a variance that lasts and one that falls.
    let error2 = |frames: usize| {
        let error = |(width, seen): &Person| {
            let first = &seen[..frames.min(seen.len())];
            mean_off(first) - base - per_scale * (width - mean_width)
        };
        root_mean(people.iter().map(error)).powi(2)
    };
    let (few, many) = (20, 150);
    let share = few as f64 / many as f64;
    let lasting2 = ((error2(many) - share * error2(few)) / (1.0 - share)).max(0.0);
    let frame2 = (error2(few) - lasting2) * few as f64;
    Ok(format!(
        "{} people, {} frames\nPRIOR_SIGMA {prior:.3}\nSHARE_STANDING {standing:.3}\nSHARE_PER_MPS {per_mps:.3}\n\
         SHARE_PER_SCALE {per_scale:.3}\nFRAME_SIGMA {:.3}\nLASTING_SIGMA {:.4}",
        people.len(),
        all.len(),
        frame2.sqrt(),
        lasting2.sqrt()
    ))
}

/// Everybody in a scene.
fn watch(scene: u64) -> Result<Vec<Person>, Error> {
    let (config, seed) = (Config::default(), FIRST_SEED + scene);
    let preset = [Preset::Orca03, Preset::Mixed][scene as usize % 2];
    let mut scene = Scene::new(circle_crossing(preset, 10, 12.5, seed), &config.site, seed)?;
    let walkers = scene.walkers().to_vec();
    let mut visibility = Visibility::new(&config.site);
    let mut pipeline = Pipeline::new(&config, None)?;
    empty_frames(&config.site, seed)?.iter().for_each(|frame| pipeline.learn_empty(frame));
    let (mut assembler, mut health) = (Assembler::new(&config.site)?, Health::default());
    let mut seen: BTreeMap<usize, Vec<Seen>> = BTreeMap::new();
    while let Some(now) = scene.next_frame() {
        push(&mut assembler, &now.packets, &mut health);
        while let Some(frame) = assembler.pop() {
            let outcome = pipeline.step(&frame);
            visibility.look(&Views::of(&frame));
            let body = |t: &Track| {
                let floor_m = config.site.hall.floor_m(t.position_m);
                Body { position_m: t.position_m, floor_m, height_m: t.height_m }
            };
            let bodies: Vec<Body> = outcome.tracks.iter().map(body).collect();
            for (track, body) in outcome.tracks.iter().zip(&bodies).filter(|(track, _)| track.points > 0) {
                let view = visibility.view(body, &bodies);
                let speed_mps = track.velocity_mps.length();
                let nearest = outcome
                    .detections
                    .iter()
                    .filter(|d| d.full_body && d.points == track.points)
                    .min_by(|a, b| away(a.position_m, track).total_cmp(&away(b.position_m, track)));
                let own = walkers.iter().position(|walker| {
                    walker.state_at(frame.time_ns).is_some_and(|s| away(s.position_m, track) < OWN_M)
                });
                let (Some(detection), Some(own)) = (nearest, own) else { continue };
                let share = share(detection, &view, track.height_m, speed_mps);
                seen.entry(own).or_default().extend(share.map(|share| (share, speed_mps)));
            }
        }
    }
    Ok(seen.into_iter().map(|(own, seen)| (trunk_width(&walkers[own]), seen)).collect())
}

fn away(position_m: DVec2, track: &Track) -> f64 {
    position_m.distance(track.position_m)
}

/// Logarithm of the width of the trunk, arms included, over the height of a body that stands upright.
fn trunk_width(walker: &Walker) -> f64 {
    let mut vertices: Vec<DVec3> = Vec::new();
    walker.upright_mesh(DVec2::ZERO, 0.0, &mut vertices);
    let height_m = vertices.iter().fold(0.0, |top: f64, v| top.max(v.z));
    let trunk = vertices.iter().filter(|v| (TRUNK[0] * height_m..TRUNK[1] * height_m).contains(&v.z));
    let (right_m, left_m) = trunk.fold((0.0, 0.0), |(a, b): (f64, f64), v| (a.min(v.y), b.max(v.y)));
    ((left_m - right_m) / height_m).ln()
}

/// Slope and value at 0 of the line of least squares through (x, y).
fn line(points: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    let [n, x, y, xx, xy] =
        points.fold([0.0; 5], |s, (x, y)| [s[0] + 1.0, s[1] + x, s[2] + y, s[3] + x * x, s[4] + x * y]);
    let slope = (n * xy - x * y) / (n * xx - x * x);
    (slope, (y - slope * x) / n)
}

fn root_mean(errors: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = errors.fold((0.0, 0.0), |(sum, n), e| (sum + e * e, n + 1.0));
    (sum / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_points_on_it_is_that_line() {
        let (slope, base) = line([0.0, 1.0, 3.0].map(|x| (x, 2.0 * x - 0.5)).into_iter());
        assert!((slope - 2.0).abs() < 1e-12 && (base + 0.5).abs() < 1e-12, "{slope} {base}");
    }
}
