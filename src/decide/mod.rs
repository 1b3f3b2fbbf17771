//! What to do about each device's link: stay, wait, change to another access point, and until when.

mod programme;

use std::collections::BTreeMap;

use crate::radio::{Loss, Outages};
use crate::site::{Costs, Site};
use crate::track::Track;
use crate::{STEP_S, STEPS};

use programme::Programme;

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
    /// Until when the command must have been sent, seconds from the frame's instant. Then the link is likely to be out soon, or
    /// the change would not be over in time. `None` where nothing comes.
    pub deadline_s: Option<f64>,
    /// How much less time in outage is expected than without this action, seconds, within the next 0.9 s.
    pub saved_s: f64,
    /// The probability that the serving link is out within that time.
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
}

impl Action {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Stay, Self::Wait, Self::HandOver, Self::Prepare];

    /// As tables and messages write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stay => "stay",
            Self::Wait => "wait",
            Self::HandOver => "hand-over",
            Self::Prepare => "prepare",
        }
    }
}

/// A change is prepared where it would help in so many of the samples: preparing costs little.
const LIKELY: f64 = 0.05;

/// The stage. It remembers which access point serves whom, and takes it that its advice is followed unless it is told otherwise.
#[derive(Debug, Clone)]
pub struct Decider {
    costs: Option<Costs>,
    radios: Vec<bool>,
    places_m: Vec<crate::geometry::DVec3>,
    serving: BTreeMap<u64, usize>,
    programme: Programme,
}

impl Decider {
    /// Needs the site's access points, their radios and `site.handover`; without that it decides nothing.
    pub fn new(site: &Site) -> Self {
        Self {
            costs: site.handover.map(|handover| handover.costs()),
            radios: site.access_points.iter().map(|ap| ap.radio.is_some()).collect(),
            places_m: site.access_points.iter().map(|ap| ap.position()).collect(),
            serving: BTreeMap::new(),
            programme: Programme::default(),
        }
    }

    /// Tells which access point serves a person's device.
    pub fn serve(&mut self, track: u64, access_point: usize) {
        self.serving.insert(track, access_point);
    }

    /// Everybody has another number from now on.
    ///
    /// ```
    /// use umbracast::{Config, decide::Decider};
    ///
    /// Decider::new(&Config::default().site).renumber(|track| track + 1000);
    /// ```
    pub fn renumber(&mut self, number: impl Fn(u64) -> u64) {
        self.serving =
            std::mem::take(&mut self.serving).into_iter().map(|(id, ap)| (number(id), ap)).collect();
    }

    /// One decision for each confirmed track, in their order. `losses` and `outages` are of the same frame.
    pub fn decide(
        &mut self,
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
            let known = self.serving.get(&track.id).copied().filter(|&ap| self.has_radio(ap));
            let Some(serving) = known.or_else(|| self.best(track, &loss_of)) else { continue };
            self.serving.insert(track.id, serving);
            let Some(loss) = loss_of(serving) else { continue };
            let decision = self.of_device(&costs, track.id, serving, loss, person, outages);
            if let (Action::HandOver, Some(target)) = (decision.action, decision.target) {
                self.serving.insert(track.id, target);
            }
            decisions.push(decision);
        }
    }

    /// What to do about one device that `serving` serves: the person at `person` among those of `outages`, of whose link `loss`
    /// is. `None` where the site does not say what changes cost.
    pub fn advise(
        &mut self,
        serving: usize,
        loss: &Loss,
        person: usize,
        outages: &Outages,
    ) -> Option<Decision> {
        let costs = self.costs?;
        Some(self.of_device(&costs, loss.track, serving, loss, person, outages))
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
        track: u64,
        serving: usize,
        loss: &Loss,
        person: usize,
        outages: &Outages,
    ) -> Decision {
        let p_out = loss.p_out[STEPS - 1].max(loss.p_out_now);
        let mut decision = Decision {
            track,
            serving,
            action: Action::Stay,
            target: None,
            deadline_s: None,
            saved_s: 0.0,
            p_out,
        };
        if p_out == 0.0 {
            return decision;
        }
        let onset_s = loss.onset_s[0].map(|onset_s| onset_s - STEP_S);
        decision.deadline_s =
            onset_s.map(|onset_s| (onset_s - costs.interruption_s - costs.command_s - costs.age_s).max(0.0));
        let ways: Vec<usize> = (0..self.radios.len()).filter(|&ap| self.has_radio(ap)).collect();
        let values = self.programme.run(costs, &ways, serving, person, outages);
        let best = values.changed_s.iter().min_by(|a, b| a.1.total_cmp(&b.1)).copied();
        if let Some((target, cost_s)) = best.filter(|(_, cost_s)| *cost_s < values.stay_s) {
            (decision.action, decision.target) = (Action::HandOver, Some(target));
            decision.saved_s = values.stay_s - cost_s;
        } else if let Some((target, _)) = values.later.filter(|(_, share)| *share >= LIKELY) {
            (decision.action, decision.target) = (Action::Prepare, Some(target));
        } else if values.held_s < values.given_up_s && loss.p_out_now >= LIKELY {
            decision.action = Action::Wait;
            decision.saved_s = values.given_up_s - values.held_s;
        }
        decision
    }
}

#[cfg(test)]
mod tests;
