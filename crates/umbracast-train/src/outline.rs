//! Fits what outlines of usual bodies look like (`models/outline.toml`): the reach of each level toward a sensor and to either side
//! of its line of sight, as tracks of simulated people show it, how that varies from frame to frame, and how bodies differ.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use umbracast::config::Config;
use umbracast::detect::LEVELS;
use umbracast::gait::relative_speed_hz;
use umbracast::geometry::DVec2;
use umbracast::lidar::{Frame, Views};
use umbracast::track::Track;
use umbracast::track::outline::{Axis, LevelOutline, UsualLevel, UsualOutline, measured, shares, terms};
use umbracast::track::visibility::{Body, Visibility};
use umbracast::{Error, Outcome};
use umbracast_eval::run::chain::CIRCLE_M;
use umbracast_sim::body::Bodies;
use umbracast_sim::body::kind::Kind;
use umbracast_sim::crowd::{Preset, circle_crossing};
use umbracast_sim::scene::Scene;

use crate::bodies::of_family_a;
use crate::stages;

/// Tuning seeds only (docs/CONVENTIONS.md).
const FIRST_SEED: u64 = 135_000;
const PEOPLE: usize = 10;
/// A track nearer than this to a person is that person's.
const OWN_M: f64 = 0.3;
/// Less of a body in free sight is not looked at.
const FREE_SHARE: f64 = 0.9;
/// Fewer frames say nothing of a person.
const FRAMES_MIN: usize = 60;
/// Usual is who carries nothing; how bodies differ is asked of these too.
const CARRYING: [Option<Kind>; 8] = [
    None,
    Some(Kind::Bag),
    None,
    Some(Kind::Phone),
    Some(Kind::Rucksack),
    Some(Kind::Pockets),
    None,
    Some(Kind::Screen),
];

/// Which of these have bodies of another maker.
const OF_FAMILY_A: usize = 2;

/// One reach: its level, whether toward the sensor, cosine and sine of its direction, speed over hip height, height, and metres.
#[derive(Debug, Clone, Copy)]
struct Seen {
    level: usize,
    near: bool,
    cos: f64,
    sin: f64,
    speed_hz: f64,
    height_m: f64,
    reach_m: f64,
}

/// What was seen of one body.
type Person = Vec<Seen>;

/// Watches so many scenes and returns the file. `scene_done` is called after each scene, from any thread.
///
/// # Errors
/// A sensor that cannot be simulated.
pub fn fit_outline(scenes: usize, scene_done: impl Fn(usize, usize) + Sync) -> Result<String, Error> {
    let done = AtomicUsize::new(0);
    let counted = |scene: usize| {
        let people = watch(scene)?;
        scene_done(done.fetch_add(1, Ordering::Relaxed) + 1, scenes);
        Ok::<_, Error>((CARRYING[scene % CARRYING.len()].is_none(), people))
    };
    let watched: Result<Vec<(bool, Vec<Person>)>, Error> = (0..scenes).into_par_iter().map(counted).collect();
    let watched = watched?;
    let usual: Vec<&Seen> =
        watched.iter().filter(|(usual, _)| *usual).flat_map(|(_, people)| people.iter().flatten()).collect();
    let everybody: Vec<&Person> = watched.iter().flat_map(|(_, people)| people).collect();
    let levels = (0..LEVELS).map(|level| fit_level(level, &usual, &everybody)).collect();
    toml::to_string(&UsualOutline { levels }).map_err(|e| Error::new(format!("outline: {e}")))
}

fn fit_level(level: usize, usual: &[&Seen], everybody: &[&Person]) -> UsualLevel {
    let of_side = |near: bool| usual.iter().filter(move |s| s.level == level && s.near == near);
    let row = |s: &Seen| (terms(s.cos, s.speed_hz), s.reach_m / s.height_m);
    let [near, aside] = [true, false].map(|near| least_squares(of_side(near).map(|s| row(s)), 1e-6));
    let expected_m = |s: &Seen| {
        let factors = if s.near { &near } else { &aside };
        s.height_m * terms(s.cos, s.speed_hz).iter().zip(factors).map(|(a, b)| a * b).sum::<f64>()
    };
    let (mut people, mut errors): (Vec<LevelOutline>, [Vec<f64>; 2]) = Default::default();
    for person in everybody {
        let own = || person.iter().filter(|s| s.level == level);
        if own().count() < FRAMES_MIN {
            continue;
        }
        let rows = own().map(|s| (shares(s.cos, s.sin), s.reach_m - expected_m(s)));
        let outline: LevelOutline = least_squares(rows.clone(), 1.0);
        for ((shares, off_m), s) in rows.zip(own()) {
            let told: f64 = shares.iter().zip(outline).map(|(a, b)| a * b).sum();
            errors[usize::from(s.near)].push(off_m - told);
        }
        people.push(outline);
    }
    let [aside_sigma_m, near_sigma_m] = errors.map(|errors| root_mean(errors.into_iter()));
    let person_sigma_m = std::array::from_fn(|i| root_mean(people.iter().map(|outline| outline[i])));
    UsualLevel { near, aside, near_sigma_m, aside_sigma_m, person_sigma_m }
}

/// Everybody in a scene.
fn watch(scene: usize) -> Result<Vec<Person>, Error> {
    let (config, seed) = (Config::default(), FIRST_SEED + scene as u64);
    let preset = [Preset::Orca03, Preset::Mixed][scene / CARRYING.len() % 2];
    let kinds = CARRYING[scene % CARRYING.len()].map(|kind| (kind, 1.0));
    let own = Bodies::new(kinds.into_iter().collect(), None)?;
    let bodies = if scene % CARRYING.len() == OF_FAMILY_A { of_family_a(own)? } else { own };
    let crowd = circle_crossing(preset, PEOPLE, CIRCLE_M, seed);
    let scene = Scene::new(crowd, &config.site, seed)?.with_bodies(&bodies);
    let walkers = scene.walkers().to_vec();
    let mut visibility = Visibility::new(&config.site);
    let mut seen: BTreeMap<usize, Person> = BTreeMap::new();
    let see = |frame: &Frame, outcome: &Outcome| {
        let body = |t: &Track| {
            let floor_m = config.site.hall.floor_m(t.position_m);
            Body { position_m: t.position_m, floor_m, height_m: t.height_m }
        };
        let bodies: Vec<Body> = outcome.tracks.iter().map(body).collect();
        visibility.look(&Views::of(frame), &bodies);
        for (track, body) in outcome.tracks.iter().zip(&bodies).filter(|(track, _)| track.points > 0) {
            let view = visibility.view(body);
            let own = walkers.iter().position(|walker| {
                walker
                    .state_at(frame.time_ns)
                    .is_some_and(|s| s.position_m.distance(track.position_m) < OWN_M)
            });
            let speed_mps = track.velocity_mps.length();
            let Some(own) = own else { continue };
            if view.returns < FREE_SHARE * view.returns_alone || speed_mps < 0.5 {
                continue;
            }
            let ago_s = |time_ns: i64| (frame.time_ns - time_ns) as f64 * 1e-9;
            let detections = outcome.detections.iter().filter(|d| d.full_body && d.points == track.points);
            let at_m = |time_ns: i64| track.position_m - track.velocity_mps * ago_s(time_ns);
            let off = |d: &&umbracast::detect::Detection| d.position_m.distance(at_m(d.time_ns));
            let Some(detection) = detections.min_by(|a, b| off(a).total_cmp(&off(b))) else { continue };
            let axis = Axis {
                from_detection_m: at_m(detection.time_ns) - detection.position_m,
                ahead: DVec2::from_angle(track.heading_rad),
            };
            let person = seen.entry(own).or_default();
            for reach in &detection.reaches {
                let gap_m = visibility.gap_m(reach.sensor, track.position_m);
                for (i, (cos, sin, reach_m)) in measured(reach, &axis, gap_m).into_iter().enumerate() {
                    person.push(Seen {
                        level: reach.level,
                        near: i == 0,
                        cos,
                        sin,
                        speed_hz: relative_speed_hz(speed_mps, track.height_m),
                        height_m: track.height_m,
                        reach_m,
                    });
                }
            }
        }
    };
    stages::run(scene, &config, seed, |_| {}, see)?;
    Ok(seen.into_values().collect())
}

/// The factors with which the rows' terms come nearest to their values; `ridge` holds those of which little is known near 0.
fn least_squares<const N: usize>(rows: impl Iterator<Item = ([f64; N], f64)>, ridge: f64) -> [f64; N] {
    let (mut a, mut b) = ([[0.0; N]; N], [0.0; N]);
    for (terms, value) in rows {
        for i in 0..N {
            b[i] += terms[i] * value;
            (0..N).for_each(|j| a[i][j] += terms[i] * terms[j]);
        }
    }
    (0..N).for_each(|i| a[i][i] += ridge);
    // Gauss and Jordan: the matrix is positive definite.
    for i in 0..N {
        let pivot = a[i][i];
        (0..N).for_each(|j| a[i][j] /= pivot);
        b[i] /= pivot;
        for k in (0..N).filter(|&k| k != i) {
            let factor = a[k][i];
            (0..N).for_each(|j| a[k][j] -= factor * a[i][j]);
            b[k] -= factor * b[i];
        }
    }
    b
}

fn root_mean(errors: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = errors.fold((0.0, 0.0), |(sum, n), e| (sum + e * e, n + 1.0));
    (sum / f64::max(n, 1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_of_a_sum_are_found() {
        let rows = [[1.0, 0.0], [1.0, 1.0], [1.0, 3.0]].map(|[a, x]| ([a, x], 2.0 * x - 0.5));
        let found = least_squares(rows.into_iter(), 0.0);
        assert!((found[0] + 0.5).abs() < 1e-12 && (found[1] - 2.0).abs() < 1e-12, "{found:?}");
    }
}
