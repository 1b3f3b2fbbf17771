//! What to do about each device's link: stay, wait, point the beam elsewhere, change to another access point, and until when.

mod programme;

use std::collections::BTreeMap;

use crate::blockage::asker::chances_of;
use crate::radio::{Loss, Outages, Served, Surface};
use crate::site::{Costs, Site};
use crate::track::Track;
use crate::{STEP_S, STEPS};

pub use programme::Serving;
use programme::{Programme, Way};

/// What a network should do about the device of one person.
///
/// ```
/// use umbracast::decide::{Action, Decision};
///
/// fn tell(decision: &Decision) {
///     if let (Action::HandOver, Some(target)) = (decision.action, decision.target) {
///         println!("person {}: change to access point {target}", decision.track);
///     }
/// }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// The person.
    pub track: u64,
    /// The access point that serves the device.
    pub serving: usize,
    /// What to do.
    pub action: Action,
    /// Where to: of a change, or of one that should be prepared.
    pub target: Option<usize>,
    /// What a beam should be pointed at, where the action is [`Action::Beam`]; `None` for the device itself. Of several reflections
    /// that are free the likeliest to stay so: a beam search may take another.
    pub surface: Option<Surface>,
    /// Until when the command must have been sent, seconds from the frame's instant. Then the link is likely to be out soon, or
    /// the change would not be over in time. `None` where nothing comes.
    pub deadline_s: Option<f64>,
    /// How much less this action is expected to cost than none, seconds of outage: that of the next 0.9 s, interruptions, prices,
    /// and a change that is due soon after.
    pub saved_s: f64,
    /// The probability that the serving link is out within the next 0.9 s.
    pub p_out: f64,
}

/// See [`Decision`].
///
/// ```
/// assert_eq!(umbracast::decide::Action::HandOver.name(), "hand-over");
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Action {
    /// Nothing comes that a change would help against.
    #[default]
    Stay,
    /// The link is out, or about to be, for so short a time that it is best to sit it out: recovery timers should be held.
    Wait,
    /// Change to the target now.
    HandOver,
    /// Be prepared to change to the target as soon as the serving link falls.
    Prepare,
    /// Point the beam of the serving access point at a surface, or at the device again.
    Beam,
}

impl Action {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Stay, Self::Wait, Self::HandOver, Self::Prepare, Self::Beam];

    /// As tables and messages write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stay => "stay",
            Self::Wait => "wait",
            Self::HandOver => "hand-over",
            Self::Prepare => "prepare",
            Self::Beam => "beam",
        }
    }
}

/// A change is prepared where it would help in so many of the samples: preparing costs little.
const LIKELY: f64 = 0.05;

/// The stage. It remembers which access point serves whom, and takes it that its advice is followed unless it is told otherwise.
///
/// What was heard before an advised change could be over says nothing against it.
#[derive(Debug, Clone)]
pub struct Decider {
    costs: Option<Costs>,
    radios: Vec<bool>,
    places_m: Vec<crate::geometry::DVec3>,
    reflects: bool,
    serving: BTreeMap<u64, Known>,
    programme: Programme,
}

impl Decider {
    /// Needs the site's access points, their radios and `site.handover`; without that it decides nothing. Beams are pointed at
    /// reflections where the site has `site.reflections`.
    pub fn new(site: &Site) -> Self {
        Self {
            costs: site.handover.map(|handover| handover.costs()),
            radios: site.access_points.iter().map(|ap| ap.radio.is_some()).collect(),
            places_m: site.access_points.iter().map(|ap| ap.position()).collect(),
            reflects: site.reflections.is_some(),
            serving: BTreeMap::new(),
            programme: Programme::default(),
        }
    }

    /// Tells which access point serves a person's device. Where that is another one than was taken, its beam is pointed at the
    /// device.
    ///
    /// ```
    /// use umbracast::{Config, decide::Decider, radio::Served};
    ///
    /// let mut decider = Decider::new(&Config::default().site);
    /// decider.serve(&Served { track: 3, access_point: 1, heard_ns: 1_000_000_000 });
    /// ```
    pub fn serve(&mut self, served: &Served) {
        let &Served { track, access_point, heard_ns } = served;
        let known = self.serving.get(&track);
        let is_news = |known: &Known| heard_ns > known.since_ns && access_point != known.serving.access_point;
        if known.is_none_or(is_news) {
            self.serving
                .insert(track, Known { serving: Serving::straight(access_point), since_ns: heard_ns });
        }
    }

    /// Everybody has another number from now on.
    ///
    /// ```
    /// use umbracast::{Config, decide::Decider};
    ///
    /// Decider::new(&Config::default().site).renumber(|track| track + 1000);
    /// ```
    pub fn renumber(&mut self, number: impl Fn(u64) -> u64) {
        let serving = std::mem::take(&mut self.serving);
        self.serving = serving.into_iter().map(|(id, known)| (number(id), known)).collect();
    }

    /// One decision for each confirmed track, in their order. `losses` and `outages` are of the same frame.
    pub fn decide(
        &mut self,
        time_ns: i64,
        tracks: &[Track],
        losses: &[Loss],
        outages: &Outages,
        decisions: &mut Vec<Decision>,
    ) {
        decisions.clear();
        let Some(costs) = self.costs else { return };
        if outages.samples() == 0 {
            return;
        }
        let confirmed = || tracks.iter().filter(|track| track.confirmed);
        self.serving.retain(|id, _| confirmed().any(|track| track.id == *id));
        for (person, track) in confirmed().enumerate() {
            let loss_of = |ap: usize| losses.iter().find(|l| l.track == track.id && l.access_point == ap);
            let known = self.serving.get(&track.id).filter(|of| self.has_radio(of.serving.access_point));
            let best = || {
                let serving = Serving::straight(self.best(track, &loss_of)?);
                Some(Known { serving, since_ns: i64::MIN })
            };
            let Some(known) = known.copied().or_else(best) else { continue };
            let serving = known.serving;
            self.serving.insert(track.id, known);
            let Some(loss) = loss_of(serving.access_point) else { continue };
            let decision = self.of_device(&costs, serving, loss, person, outages);
            let then = match (decision.action, decision.target) {
                (Action::HandOver, Some(target)) => {
                    let takes_s = costs.age_s + costs.command_s + costs.interruption_s;
                    let since_ns = time_ns.saturating_add((takes_s * 1e9) as i64);
                    Known { serving: Serving::straight(target), since_ns }
                }
                (Action::Beam, _) => Known {
                    serving: Serving { is_reflected: decision.surface.is_some(), ..serving },
                    ..known
                },
                _ => known,
            };
            self.serving.insert(track.id, then);
            decisions.push(decision);
        }
    }

    /// What to do about one device that is served so: that of the person at `person` among those of `outages`; `loss` is of the
    /// straight way to it. `None` where the site does not say what changes cost.
    pub fn advise(
        &mut self,
        serving: Serving,
        loss: &Loss,
        person: usize,
        outages: &Outages,
    ) -> Option<Decision> {
        let costs = self.costs?;
        Some(self.of_device(&costs, serving, loss, person, outages))
    }

    fn has_radio(&self, ap: usize) -> bool {
        self.radios.get(ap).copied().unwrap_or_default()
    }

    /// Of the access points with a radio the one that is least likely to be out, and of such the nearest.
    fn best<'a>(&self, track: &Track, loss_of: &impl Fn(usize) -> Option<&'a Loss>) -> Option<usize> {
        let rank = |ap: &usize| {
            let p_out = loss_of(*ap).map_or(1.0, |loss| loss.p_out[STEPS - 1].max(loss.p_out_now));
            (p_out, self.places_m[*ap].truncate().distance(track.position_m))
        };
        (0..self.radios.len())
            .filter(|&ap| self.has_radio(ap))
            .min_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(std::cmp::Ordering::Equal))
    }

    fn of_device(
        &mut self,
        costs: &Costs,
        serving: Serving,
        loss: &Loss,
        person: usize,
        outages: &Outages,
    ) -> Decision {
        let reflection = |ap: usize| if self.reflects { outages.reflected(ap, person) } else { None };
        let of_serving = reflection(serving.access_point);
        let reflected = of_serving.filter(|_| serving.is_reflected);
        let risk = reflected.map_or_else(|| Risk::of_loss(loss), |(way, _)| Risk::of(way, person, outages));
        let mut decision = Decision {
            track: loss.track,
            serving: serving.access_point,
            action: Action::Stay,
            target: None,
            surface: None,
            deadline_s: None,
            saved_s: 0.0,
            p_out: risk.p_out,
        };
        // The reflection that the beam was pointed at is none any more.
        if serving.is_reflected && of_serving.is_none() {
            return Decision { action: Action::Beam, deadline_s: Some(0.0), ..decision };
        }
        // Who is served by a reflection for nothing had better be served straight.
        if risk.p_out == 0.0 && reflected.is_none() {
            return decision;
        }
        let deadline_s = |takes_s: f64| {
            let onset_s = risk.onset_s.map(|onset_s| onset_s - STEP_S);
            onset_s.map(|onset_s| (onset_s - takes_s - costs.command_s - costs.age_s).max(0.0))
        };
        decision.deadline_s = deadline_s(costs.interruption_s);
        let access_points = (0..self.radios.len()).filter(|&ap| self.has_radio(ap));
        let ways = Way::all(access_points, reflection);
        let own = Serving { is_reflected: reflected.is_some(), ..serving };
        let values = self.programme.run(costs, &ways, own, person, outages);
        let best = values.changed_s.iter().min_by(|a, b| a.1.total_cmp(&b.1)).copied();
        let best = best.filter(|(_, cost_s)| *cost_s < values.stay_s);
        let beam_s = values
            .beam_s
            .filter(|cost_s| *cost_s < values.stay_s && best.is_none_or(|(_, change_s)| *cost_s <= change_s));
        if let Some(cost_s) = beam_s {
            let to = of_serving.filter(|_| reflected.is_none());
            (decision.action, decision.surface) = (Action::Beam, to.map(|(_, surface)| surface));
            decision.deadline_s = deadline_s(costs.beam_s);
            decision.saved_s = values.stay_s - cost_s;
        } else if let Some((target, cost_s)) = best {
            (decision.action, decision.target) = (Action::HandOver, Some(target));
            decision.saved_s = values.stay_s - cost_s;
        } else if let Some((target, _)) = values.later.filter(|(_, share)| *share >= LIKELY) {
            (decision.action, decision.target) = (Action::Prepare, Some(target));
        } else if values.held_s < values.given_up_s && risk.p_out_now >= LIKELY {
            decision.action = Action::Wait;
            decision.saved_s = values.given_up_s - values.held_s;
        }
        decision
    }
}

/// How a device is served, as far as is known.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Known {
    serving: Serving,
    /// What was heard until then says nothing about it: a change was under way, or later reports have told.
    since_ns: i64,
}

/// How likely the way that serves a device is out.
struct Risk {
    p_out_now: f64,
    /// Now or at any step.
    p_out: f64,
    /// The earliest of the quantiles.
    onset_s: Option<f64>,
}

impl Risk {
    fn of_loss(loss: &Loss) -> Self {
        let p_out = loss.p_out[STEPS - 1].max(loss.p_out_now);
        Self { p_out_now: loss.p_out_now, p_out, onset_s: loss.onset_s[0] }
    }

    fn of(way: usize, person: usize, outages: &Outages) -> Self {
        let chances = chances_of(|step| outages.of(way, person, step), outages.samples(), 0.5);
        let p_out = chances.p[STEPS - 1].max(chances.p_now);
        Self { p_out_now: chances.p_now, p_out, onset_s: chances.onset_s[0] }
    }
}

#[cfg(test)]
mod tests;
