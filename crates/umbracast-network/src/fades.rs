//! How well the losses told about fades are those that came.

use std::time::Duration;

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::radio::{Passage, models::kirchhoff_mean};
use umbracast::{Config, Error, Site};
use umbracast_sim::body::{PersonState, Walker};
use umbracast_sim::random::stream;

use crate::case::Case;
use crate::experiment::{BEGIN_TICKS, Spec, Truths};
use crate::foreseen::Foreteller;
use crate::hall::Seen;
use crate::truth::{TICK_NS, Traces, TruthModel};

/// A fade is deeper.
const FADE_DB: f64 = 10.0;
/// So many instants before and after its deepest one belong to it: 400 ms.
const ABOUT_TICKS: usize = 40;
/// Which steps are looked at: 300 and 500 ms ahead.
pub const STEPS_AHEAD: [usize; 2] = [3, 5];
/// A step has so many instants.
const STEP_TICKS: usize = 10;

/// Losses told beside those that came, about fades.
#[derive(Debug, Clone, Default)]
pub struct Compared {
    /// The case.
    pub case: Option<Case>,
    /// Whether the spread of real fades about a model is in what is told and in the truth.
    pub spread: bool,
    /// How many fades.
    pub fades: u64,
    /// By step ahead: sums of squared differences of the median told, dB^2.
    pub squares_db2: [f64; 2],
    /// By step ahead: how many truths lie within the 10 and 90 % told.
    pub within: [u64; 2],
    /// By step ahead: how many truths there are.
    pub count: [u64; 2],
    /// The first of these again: sum of squared differences of what the trunk and head lose that stand at everybody's true
    /// place, dB^2. No forecast can do better with such bodies.
    pub placed_db2: f64,
    /// By other model of the truth: sum of squared differences to this one on the same meshes, dB^2, and of how many.
    pub apart: Vec<(TruthModel, f64, u64)>,
    /// How long the losses of each frame took.
    pub took: Vec<Duration>,
}

impl Compared {
    /// Root of the mean squared difference, dB.
    pub fn rmse_db(&self, ahead: usize) -> f64 {
        (self.squares_db2[ahead] / self.count[ahead].max(1) as f64).sqrt()
    }

    /// The share of truths within the 10 and 90 % told.
    pub fn coverage(&self, ahead: usize) -> f64 {
        self.within[ahead] as f64 / self.count[ahead].max(1) as f64
    }

    /// Root of the mean squared difference with a trunk and a head at everybody's true place, dB.
    pub fn rmse_placed_db(&self) -> f64 {
        (self.placed_db2 / self.count[0].max(1) as f64).sqrt()
    }

    /// By other model of the truth that was asked for: how far it is from this one on the same meshes, dB (root mean square).
    pub fn rmse_apart_db(&self) -> impl Iterator<Item = (TruthModel, f64)> {
        self.apart.iter().map(|(model, db2, count)| (*model, (db2 / *count.max(&1) as f64).sqrt()))
    }

    /// How long the losses of a frame took at this share of frames, milliseconds.
    pub fn took_ms(&self, share: f64) -> f64 {
        let mut took = self.took.clone();
        took.sort_unstable();
        let at = (share * took.len().saturating_sub(1) as f64) as usize;
        took.get(at).map_or(0.0, |took| took.as_secs_f64() * 1e3)
    }

    fn add(&mut self, other: Self) {
        self.fades += other.fades;
        for ahead in 0..STEPS_AHEAD.len() {
            self.squares_db2[ahead] += other.squares_db2[ahead];
            self.within[ahead] += other.within[ahead];
            self.count[ahead] += other.count[ahead];
        }
        self.placed_db2 += other.placed_db2;
        for (sum, of) in self.apart.iter_mut().zip(other.apart) {
            (sum.1, sum.2) = (sum.1 + of.1, sum.2 + of.2);
        }
        self.took.extend(other.took);
    }
}

/// Compares every scene, each case without and with the spread of real fades. `progress` is called after each scene.
///
/// # Errors
/// As [`crate::experiment::run`].
pub fn compare(spec: &Spec, progress: impl Fn() + Sync) -> Result<Vec<Compared>, Error> {
    let scene = |seed: u64| -> Result<Vec<Compared>, Error> {
        let seen = spec.hall.see(spec.crowd, seed)?;
        let truths = Truths::of(spec.hall.config(), &spec.cases, &seen, false)?;
        let mut all = Vec::new();
        for case in &spec.cases {
            for spread in [false, true] {
                let mut config = case.config(spec.hall.config())?;
                let radios = config.site.access_points.iter_mut().filter_map(|ap| ap.radio.as_mut());
                radios.for_each(|radio| radio.fade_spread = spread);
                // Those that differ from this case in nothing but the truth.
                let others = spec.cases.iter().filter(|other| {
                    other.truth != case.truth && Case { truth: case.truth, ..**other } == *case
                });
                let others: Vec<_> =
                    others.map(|other| (other.truth, truths.of_case(&config, other))).collect();
                let compared =
                    of_scene(&config, &seen, truths.of_case(&config, case), &others, seed, spread)?;
                all.push(Compared { case: Some(*case), ..compared });
            }
        }
        progress();
        Ok(all)
    };
    let scenes: Vec<Vec<Compared>> =
        spec.seeds.par_iter().with_max_len(1).map(|seed| scene(*seed)).collect::<Result<_, _>>()?;
    let mut scenes = scenes.into_iter();
    let mut sums = scenes.next().unwrap_or_default();
    scenes.for_each(|scene| sums.iter_mut().zip(scene).for_each(|(sum, other)| sum.add(other)));
    Ok(sums)
}

fn of_scene(
    config: &Config,
    seen: &Seen,
    traces: &Traces,
    others: &[(TruthModel, &Traces)],
    seed: u64,
    spread: bool,
) -> Result<Compared, Error> {
    let mut compared = Compared { spread, ..Compared::default() };
    let truth_db = about_fades(traces, seed, spread, &mut compared.fades);
    if !spread {
        compared.apart = others.iter().map(|(model, other)| apart(*model, &truth_db, other)).collect();
    }
    let at =
        |tick, access_point, person| (tick * traces.access_points + access_point) * traces.people + person;
    let mut foreteller = Foreteller::new(config, None)?;
    for frame in &seen.ours {
        let said = foreteller.foresee(frame, traces);
        compared.took.push(foreteller.fading);
        let tick = (frame.time_ns / TICK_NS) as usize;
        for (ahead, steps) in STEPS_AHEAD.into_iter().enumerate() {
            let then = tick + steps * STEP_TICKS;
            if tick < BEGIN_TICKS || then >= traces.ticks {
                continue;
            }
            let bodies = Bodies::at(&seen.walkers, then as i64 * TICK_NS);
            for person in 0..traces.people {
                let Some(index) = said.index_of[person] else { continue };
                for access_point in 0..traces.access_points {
                    let came_db = truth_db[at(then, access_point, person)];
                    let Some(loss) = said.loss(access_point, index).filter(|_| came_db.is_finite()) else {
                        continue;
                    };
                    let [low_db, told_db, high_db] = loss.steps_db[steps - 1];
                    let came_db = f64::from(came_db);
                    compared.squares_db2[ahead] += (told_db - came_db).powi(2);
                    compared.within[ahead] += u64::from((low_db..=high_db).contains(&came_db));
                    compared.count[ahead] += 1;
                    if ahead == 0 {
                        let placed_db = bodies.loss_db(&config.site, access_point, person);
                        compared.placed_db2 += (placed_db - came_db).powi(2);
                    }
                }
            }
        }
    }
    Ok(compared)
}

/// How far another model of the truth is from this one about its fades.
fn apart(model: TruthModel, truth_db: &[f32], other: &Traces) -> (TruthModel, f64, u64) {
    let (people, links) = (other.people, other.access_points * other.people);
    let about = truth_db.iter().enumerate().filter(|(_, db)| db.is_finite());
    let squares = about.map(|(at, db)| {
        let other_db = other.loss_db(at / links, at % links / people, at % people);
        (f64::from(*db) - other_db).powi(2)
    });
    squares.fold((model, 0.0, 0), |(model, sum, count), square| (model, sum + square, count + 1))
}

/// Everybody where they are, as a trunk and a head.
struct Bodies(Vec<Option<PersonState>>);

/// Powers are averaged over places of the body so far to either side.
const WITHIN_M: f64 = 0.04;

impl Bodies {
    fn at(walkers: &[Walker], time_ns: i64) -> Self {
        Self(walkers.iter().map(|walker| walker.state_at(time_ns)).collect())
    }

    /// What others cost a link, by Kirchhoff's integral as the runtime's.
    fn loss_db(&self, site: &Site, access_point: usize, person: usize) -> f64 {
        let ap = &site.access_points[access_point];
        let (Some(owner), Some(radio)) = (&self.0[person], ap.radio) else { return 0.0 };
        let of_axis_m = site.ue.on_body(owner.position_m, owner.heading_rad, owner.height_m);
        let (ap_m, ue_m) = (ap.position(), of_axis_m + DVec3::Z * owner.floor_m);
        let along = (ap_m - ue_m).truncate().normalize_or_zero();
        let others = self.0.iter().enumerate().filter(|(other, _)| *other != person);
        let of_body_db = |body: &PersonState| {
            let Some(passage) = Passage::new(ap_m, ue_m, body.position_m, body.floor_m) else { return 0.0 };
            let facing = DVec2::from_angle(body.heading_rad);
            let turned = [along.perp_dot(facing), along.dot(facing)];
            let parts = passage.trunk_and_head(body.height_m, 1.0, turned);
            kirchhoff_mean(radio.wavelength_m(), &passage, &parts, WITHIN_M)
        };
        others.filter_map(|(_, body)| body.as_ref().map(of_body_db)).sum()
    }
}

/// The truth about fades, NaN elsewhere: by instant, access point and person. With `spread` each fade is deeper or shallower than
/// the model's by a draw of its own.
fn about_fades(traces: &Traces, seed: u64, spread: bool, fades: &mut u64) -> Vec<f32> {
    let (links, people) = (traces.access_points * traces.people, traces.people);
    let mut truth_db = vec![f32::NAN; traces.ticks * links];
    let mut random = stream(seed, "fades", 0);
    for link in 0..links {
        let loss_db = |tick: usize| traces.loss_db(tick, link / people, link % people);
        let mut tick = 0;
        while tick < traces.ticks {
            if loss_db(tick) < FADE_DB {
                tick += 1;
                continue;
            }
            let end = (tick..traces.ticks).find(|t| loss_db(*t) < FADE_DB).unwrap_or(traces.ticks);
            let deepest = (tick..end).max_by(|a, b| loss_db(*a).total_cmp(&loss_db(*b))).unwrap_or(tick);
            *fades += 1;
            let deeper = if spread { normal(&mut random) } else { 0.0 };
            for t in deepest.saturating_sub(ABOUT_TICKS)..(deepest + ABOUT_TICKS + 1).min(traces.ticks) {
                let db = loss_db(t);
                truth_db[t * links + link] = (db + deeper * sigma_db(db)) as f32;
            }
            tick = end;
        }
    }
    truth_db
}

/// One standard deviation of real fades about a model: residuals of the passages of IMMERSE (TU Dortmund 2024), a draw a fade.
fn sigma_db(model_db: f64) -> f64 {
    let positive_db = model_db.max(0.0);
    (1.5 + 0.9 * positive_db.sqrt()).min(6.0) * (2.0 * positive_db).min(1.0)
}

fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}
