//! Fits stage 3's body on tuning scenes: the few numbers with which stage 3 says the truth of links most surely, of tracks as
//! stages 1 and 2 know them, with their errors and what they claim of them. The fit moves one number at a time as long as it
//! helps.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use umbracast::blockage::{BodyModel, Caster, Numbers};
use umbracast::forecast::Forecast;
use umbracast::lidar::Frame;
use umbracast::track::Track;
use umbracast::{Config, Error, Outcome};
use umbracast_eval::run::chain::CIRCLE_M;
use umbracast_eval::score::instances::{Instance, instances};
use umbracast_eval::score::matching::match_scene;
use umbracast_eval::score::scene::{SceneRun, SceneTruth, TruthIndex, note_truth};
use umbracast_io::rows;
use umbracast_sim::body::Bodies;
use umbracast_sim::body::kind::Kind;
use umbracast_sim::crowd::{Preset, circle_crossing};
use umbracast_sim::scene::Scene;

use crate::bodies::{TURNS, bodies};
use crate::stages;

/// Tuning seeds only (docs/CONVENTIONS.md).
const FIRST_SEED: u64 = 136_000;
const PRESETS: [Preset; 2] = [Preset::Orca03, Preset::Mixed];
const PEOPLE: usize = 10;
/// Every so many frames; what lies between looks alike.
const EVERY: u64 = 4;
/// Windows that count beside now: 300 ms.
const WINDOW: usize = 3;
/// Where the fit begins, a share of the height, and where it ends.
const FIRST_STEP: f64 = 0.008;
const LAST_STEP: f64 = 0.001;
/// A round in which the loss falls by less is the last.
const WORTH: f64 = 1e-4;

/// What stages 1 and 2 know in one frame, and what is true of each link that stage 3 tells: blocked now, and within the window.
/// `None` where that does not count.
struct Moment {
    tracks: Vec<Track>,
    forecasts: Vec<Forecast>,
    truth: Vec<Option<[bool; 2]>>,
}

/// Fits the body on so many scenes and returns the file. `scene_done` is called after each scene, from any thread.
///
/// # Errors
/// A setting that cannot work.
pub fn fit_body(scenes: usize, scene_done: impl Fn(usize, usize) + Sync) -> Result<String, Error> {
    let config = Config::default();
    let done = AtomicUsize::new(0);
    let counted = |scene: usize| {
        let moments = watch(scene, &config);
        scene_done(done.fetch_add(1, Ordering::Relaxed) + 1, scenes);
        moments
    };
    let seen: Vec<Vec<Moment>> = (0..scenes).into_par_iter().map(counted).collect::<Result<_, _>>()?;
    let mut best = BodyModel::shipped();
    let mut least = loss(&best, &config, &seen);
    loop {
        let before = least;
        least = turn_all(&mut best, least, |body| loss(body, &config, &seen));
        if before - least < WORTH {
            return Ok(toml(&mut best));
        }
    }
}

/// Moves one number after another, by ever smaller steps, as long as that lowers the loss; returns the least.
fn turn_all(best: &mut BodyModel, mut least: f64, loss: impl Fn(&BodyModel) -> f64) -> f64 {
    let mut steps = vec![FIRST_STEP; fields(best).len()];
    while steps.iter().any(|&step| step > LAST_STEP) {
        for (i, step) in steps.iter_mut().enumerate() {
            let trials = [*step, -*step].into_iter().filter_map(|change| moved(best, i, change));
            let better = trials.map(|trial| (loss(&trial), trial)).find(|(value, _)| *value < least);
            *step *= if better.is_some() { 1.5 } else { 0.5 };
            if let Some((value, trial)) = better {
                (*best, least) = (trial, value);
            }
        }
    }
    least
}

/// With one number changed; `None` where that is no body.
fn moved(body: &BodyModel, i: usize, change: f64) -> Option<BodyModel> {
    let mut trial = body.clone();
    *fields(&mut trial)[i].1 += change;
    BodyModel::parse(&toml(&mut trial)).is_ok().then_some(trial)
}

/// The numbers as `models/body.toml` has them.
fn toml(body: &mut BodyModel) -> String {
    let slices = body.slices.iter().map(|slice| {
        format!(
            "  {{ top = {:.3}, half_depth = {:.3}, half_width = {:.3}, ahead = {:.3} }},\n",
            slice.top, slice.half_depth, slice.half_width, slice.ahead
        )
    });
    let slices: String = slices.collect();
    let others = fields(body).into_iter().filter(|(name, _)| !name.starts_with("slice"));
    let others: Vec<String> = others.map(|(name, value)| format!("{name} = {value:.4}\n")).collect();
    let (sways, arms) = others.split_at(SWAYS);
    format!("slices = [\n{slices}]\n{}\n[arms]\n{}", sways.concat(), arms.concat())
}

/// How many of the fields that are no slice's are the trunk's.
const SWAYS: usize = 2;

/// What may be turned.
fn fields(body: &mut BodyModel) -> Vec<(String, &mut f64)> {
    let mut all: Vec<(String, &mut f64)> = Vec::new();
    let last = body.slices.len() - 1;
    for (i, slice) in body.slices.iter_mut().enumerate() {
        if i < last {
            all.push((format!("slice {i} top"), &mut slice.top));
        }
        all.push((format!("slice {i} half_depth"), &mut slice.half_depth));
        all.push((format!("slice {i} half_width"), &mut slice.half_width));
        all.push((format!("slice {i} ahead"), &mut slice.ahead));
    }
    let arms = &mut body.arms;
    let named: [(&str, &mut f64); 13] = [
        ("sway_left", &mut body.sway_left),
        ("sway_ahead", &mut body.sway_ahead),
        ("shoulder_up", &mut arms.shoulder_up),
        ("shoulder_out", &mut arms.shoulder_out),
        ("elbow_up", &mut arms.elbow_up),
        ("elbow_out", &mut arms.elbow_out),
        ("hand_up", &mut arms.hand_up),
        ("hand_out", &mut arms.hand_out),
        ("upper_radius", &mut arms.upper_radius),
        ("fore_radius", &mut arms.fore_radius),
        ("elbow_swing", &mut arms.elbow_swing),
        ("hand_ahead", &mut arms.hand_ahead),
        ("hand_swing", &mut arms.hand_swing),
    ];
    all.extend(named.map(|(name, value)| (name.to_owned(), value)));
    all
}

/// [`bodies`] in turn, and then our own of whom half gesture.
fn who_walks(turn: u64) -> Result<Bodies, Error> {
    match turn % (TURNS + 1) {
        TURNS => Bodies::new(vec![(Kind::Gesturing, 0.5)], None),
        turn => bodies(turn),
    }
}

/// A scene's moments.
fn watch(scene: usize, config: &Config) -> Result<Vec<Moment>, Error> {
    let (turn, seed) = (scene as u64, FIRST_SEED + scene as u64);
    let preset = PRESETS[(turn / (TURNS + 1)) as usize % PRESETS.len()];
    let crowd = circle_crossing(preset, PEOPLE, CIRCLE_M, seed);
    let scene = Scene::new(crowd, &config.site, seed)?.with_bodies(&who_walks(turn)?);
    let (mut truth, mut run, mut moments) = (SceneTruth::default(), SceneRun::default(), Vec::new());
    let see = |_: &Frame, outcome: &Outcome| {
        rows::of_outcome(0, outcome, &mut run.tracks, &mut run.links);
        if outcome.frame.is_multiple_of(EVERY) {
            let links = outcome.blockages.iter().map(|b| (outcome.frame, b.access_point as u32, b.track));
            moments.push((outcome.tracks.clone(), outcome.forecasts.clone(), links.collect::<Vec<_>>()));
        }
    };
    stages::run(scene, config, seed, |now| note_truth(0, now, &mut truth), see)?;
    let matching = match_scene(&truth.people, &run.tracks);
    let of_link = |i: &Instance| {
        let track = matching.get(&(i.frame, i.person))?;
        Some(((i.frame, i.access_point, *track), [i.blocked_now, i.blocked_within(WINDOW)]))
    };
    let known: BTreeMap<_, _> = instances(&TruthIndex::new(&truth)).iter().filter_map(of_link).collect();
    let with_truth = moments.into_iter().map(|(tracks, forecasts, links)| {
        let truth = links.iter().map(|link| known.get(link).copied()).collect();
        Moment { tracks, forecasts, truth }
    });
    Ok(with_truth.collect())
}

/// Mean negative logarithm of what stage 3 says of the truth; nothing is said to be certain.
fn loss(body: &BodyModel, config: &Config, seen: &[Vec<Moment>]) -> f64 {
    let numbers = Numbers { body: body.clone(), ..Numbers::new(&config.blockage) };
    let of = |p: f64, blocked: bool| {
        let p = 0.01 + 0.98 * p;
        -(if blocked { p } else { 1.0 - p }).ln()
    };
    let of_scene = |moments: &Vec<Moment>| {
        let mut caster = Caster::with_numbers(&config.blockage, numbers.clone(), &config.site);
        let (mut sum, mut count, mut blockages) = (0.0, 0.0, Vec::new());
        for Moment { tracks, forecasts, truth } in moments {
            caster.cast(tracks, forecasts, &mut blockages);
            for (b, [now, within]) in
                blockages.iter().zip(truth).filter_map(|(b, truth)| Some((b, (*truth)?)))
            {
                sum += of(b.p_now, now) + of(b.p[WINDOW - 1], within);
                count += 2.0;
            }
        }
        [sum, count]
    };
    let sums: Vec<[f64; 2]> = seen.par_iter().map(of_scene).collect();
    let [sum, count] = [0, 1].map(|i| sums.iter().map(|of| of[i]).sum::<f64>());
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_as_the_same_body() {
        let mut body = BodyModel::shipped();
        assert_eq!(BodyModel::parse(&toml(&mut body)).unwrap(), body);
    }
}
