//! Scenes under every policy, case by case.

use rayon::prelude::*;
use umbracast::config::ForecastMethod;
use umbracast::decide::Decider;
use umbracast::forecast::Weights;
use umbracast::{Config, Error};

use crate::bound::carriers;
use crate::case::{Case, handover_under};
use crate::device::{Network, Tally, drive};
use crate::foreseen::{Followed, Foreseen, Foreteller};
use crate::hall::{Crowd, Hall, Seen};
use crate::oracle::{best_of_all, oracle};
use crate::policy::{Advised, Policy, Reactive, Tuning};
use crate::truth::{Air, Counted, Traces};

/// Policies begin when everybody has been followed for so long.
pub(crate) const BEGIN_TICKS: usize = 150;
/// The seed of the reports' noise.
const REPORTS_SEED: u64 = 1;

/// What is played.
#[derive(Debug, Clone)]
pub struct Spec<'a> {
    /// Where.
    pub hall: &'a Hall,
    /// Who walks in each scene.
    pub crowd: Crowd,
    /// One a scene.
    pub seeds: Vec<u64>,
    /// In which networks.
    pub cases: Vec<Case>,
    /// Under which policies.
    pub policies: Vec<Policy>,
    /// The network's, for the paper's method.
    pub weights: Option<&'a Weights>,
}

/// What a policy comes to in a case.
#[derive(Debug, Clone)]
pub struct Row {
    /// The case.
    pub case: Case,
    /// The policy.
    pub policy: Policy,
    /// By scene, of all devices together.
    pub scenes: Vec<Tally>,
}

/// Plays every scene. `progress` is called after each, from any thread. Scenes run in parallel; the rows do not depend on the
/// threads.
///
/// # Errors
/// More access points than the site has, more people than the hall holds, a method that needs weights and gets none.
pub fn run(spec: &Spec, progress: impl Fn() + Sync) -> Result<Vec<Row>, Error> {
    let scene = |seed: u64| {
        let tallies = spec.scene(seed);
        progress();
        tallies
    };
    let scenes: Vec<Vec<Tally>> =
        spec.seeds.par_iter().with_max_len(1).map(|seed| scene(*seed)).collect::<Result<_, _>>()?;
    let rows = spec.cases.iter().flat_map(|case| spec.policies.iter().map(|policy| (*case, *policy)));
    let of = |(row, (case, policy)): (usize, (Case, Policy))| Row {
        case,
        policy,
        scenes: scenes.iter().map(|tallies| tallies[row].clone()).collect(),
    };
    Ok(rows.enumerate().map(of).collect())
}

impl Spec<'_> {
    /// One tally a case and policy, in the order of rows.
    fn scene(&self, seed: u64) -> Result<Vec<Tally>, Error> {
        let seen = self.hall.see(self.crowd, seed)?;
        let reflections = self.policies.iter().any(|policy| policy.has_beams());
        let truths = Truths::of(self.hall.config(), &self.cases, &seen, reflections)?;
        let mut forecasts: Option<(Case, Forecasts)> = None;
        let mut tallies = Vec::new();
        for case in &self.cases {
            let config = case.config(self.hall.config())?;
            let traces = truths.of_case(&config, case);
            if forecasts.as_ref().is_none_or(|(known, _)| !known.foresees_as(case)) {
                // The paper's method knows no radio: with the same access points it says the same.
                let before = forecasts.filter(|(known, _)| known.access_points == case.access_points);
                let paper = before.map(|(_, known)| known.paper);
                forecasts = Some((*case, self.forecasts(&config, &seen, traces, paper)?));
            }
            if let Some((_, forecasts)) = &forecasts {
                let scene = Scene { config: &config, traces, seen: &seen, seed };
                tallies.extend(self.policies.iter().map(|policy| scene.judge(forecasts, *policy)));
            }
        }
        Ok(tallies)
    }

    fn forecasts(
        &self,
        config: &Config,
        seen: &Seen,
        traces: &Traces,
        paper: Option<Vec<Foreseen>>,
    ) -> Result<Forecasts, Error> {
        let wanted = |policies: &[Policy]| policies.iter().any(|policy| self.policies.contains(policy));
        let of = |wanted: bool, config: &Config, frames: &[Followed]| -> Result<Vec<Foreseen>, Error> {
            if !wanted {
                return Ok(Vec::new());
            }
            let mut foreteller = Foreteller::new(config, self.weights)?;
            Ok(frames.iter().map(|frame| foreteller.foresee(frame, traces)).collect())
        };
        let ours = [
            Policy::AsNow,
            Policy::Foreseen,
            Policy::ForeseenBeams,
            Policy::Bound,
            Policy::Commands,
            Policy::AtOnce,
            Policy::Perfect,
        ];
        let mut straight_on = config.clone();
        straight_on.forecast.method = ForecastMethod::ConstantVelocity;
        let of_paper = |paper: &Config| {
            let config = Config { site: config.site.clone(), ..paper.clone() };
            of(wanted(&[Policy::Paper]), &config, &seen.paper)
        };
        Ok(Forecasts {
            ours: of(wanted(&ours), config, &seen.ours)?,
            constant_velocity: of(wanted(&[Policy::ConstantVelocity]), &straight_on, &seen.ours)?,
            paper: match paper {
                Some(paper) => paper,
                None => self.hall.paper().map_or(Ok(Vec::new()), of_paper)?,
            },
        })
    }
}

/// What each method says of a scene.
struct Forecasts {
    ours: Vec<Foreseen>,
    constant_velocity: Vec<Foreseen>,
    paper: Vec<Foreseen>,
}

/// The radio truth of a scene in every case.
pub(crate) struct Truths(Vec<(Air, usize, Traces)>);

impl Truths {
    /// Of a scene that was seen, with the ways by reflections where somebody asks for `reflections`.
    ///
    /// # Errors
    /// More access points than the site has.
    pub(crate) fn of(hall: &Config, cases: &[Case], seen: &Seen, reflections: bool) -> Result<Self, Error> {
        let mut airs: Vec<(Config, Vec<Air>)> = Vec::new();
        for case in cases {
            let config = case.config(hall)?;
            let air = Air::of(&config.site, case.truth);
            let of_as_many =
                airs.iter_mut().find(|(known, _)| known.site.access_points.len() == case.access_points);
            match of_as_many {
                Some((_, known)) if known.contains(&air) => {}
                Some((_, known)) => known.push(air),
                None => airs.push((config, vec![air])),
            }
        }
        // A way that loses its margin without anybody is out whoever stands where.
        let sites = airs.iter().flat_map(|(config, _)| &config.site.access_points);
        let of_sites = sites.filter_map(|ap| Some(ap.radio?.margin_db));
        let most_db = cases.iter().filter_map(|case| case.margin_db).chain(of_sites).fold(0.0, f64::max);
        let reflections_db = if reflections { most_db } else { 0.0 };
        let mut truths = Vec::new();
        for (config, airs) in airs {
            let site = &config.site;
            let own_body = site.ue.forward_m != 0.0 || site.ue.left_m != 0.0;
            let counted = Counted { own_body, reflections_db };
            let traces = Traces::of_scene(site, &seen.walkers, seen.ticks, &airs, counted);
            let count = site.access_points.len();
            truths.extend(airs.into_iter().zip(traces).map(|(air, traces)| (air, count, traces)));
        }
        Ok(Self(truths))
    }

    /// Of one of the cases.
    pub(crate) fn of_case(&self, config: &Config, case: &Case) -> &Traces {
        let air = Air::of(&config.site, case.truth);
        let is_it = |(known, count, _): &&(Air, usize, Traces)| *count == case.access_points && *known == air;
        &self.0.iter().find(is_it).unwrap_or(&self.0[0]).2
    }
}

/// A scene in one case.
struct Scene<'a> {
    config: &'a Config,
    traces: &'a Traces,
    seen: &'a Seen,
    seed: u64,
}

impl Scene<'_> {
    /// What all devices come to under a policy.
    fn judge(&self, forecasts: &Forecasts, policy: Policy) -> Tally {
        let (config, traces) = (self.config, self.traces);
        let mut site = config.site.clone();
        site.handover = site.handover.map(|handover| handover_under(policy, handover));
        site.reflections = site.reflections.filter(|_| policy.has_beams());
        let network = Network {
            radios: site.access_points.iter().map(|ap| ap.radio).collect(),
            costs: site.handover.unwrap_or_default().costs(),
            seed: REPORTS_SEED,
        };
        let decider = Decider::new(&site);
        let frames = match policy {
            Policy::Paper => &forecasts.paper,
            Policy::ConstantVelocity => &forecasts.constant_velocity,
            _ => &forecasts.ours,
        };
        let carriers =
            (policy == Policy::Bound).then(|| carriers(&site, &self.seen.ours, frames, traces, self.seed));
        let mut sum = Tally::default();
        for person in 0..traces.people {
            let reactive = |tuning, conditional, beams| {
                let mut reactive = Reactive::new(tuning, conditional, beams, network.radios.len());
                drive(&network, traces, person, BEGIN_TICKS, |view| reactive.order(view))
            };
            sum.add(&match policy {
                Policy::Stay => drive(&network, traces, person, BEGIN_TICKS, |_| None),
                Policy::A3(tuning) => reactive(tuning, false, false),
                Policy::Conditional(tuning) => reactive(tuning, true, false),
                Policy::Beams => reactive(Tuning::Fast, false, true),
                Policy::ConditionalBeams => reactive(Tuning::Fast, true, true),
                Policy::Oracle | Policy::OracleBeams => {
                    oracle(&network, traces, person, BEGIN_TICKS, policy == Policy::OracleBeams)
                }
                Policy::All => best_of_all(&network, traces, person, BEGIN_TICKS),
                _ => {
                    let advised = Advised::new(frames, policy, decider.clone(), &network, traces);
                    let mut advised = match &carriers {
                        Some(carriers) => advised.bound(carriers),
                        None => advised,
                    };
                    drive(&network, traces, person, BEGIN_TICKS, |view| advised.order(view))
                }
            });
        }
        sum
    }
}
