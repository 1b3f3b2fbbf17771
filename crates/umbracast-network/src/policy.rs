//! Who decides when a device changes, and by what.

use umbracast::STEPS;
use umbracast::decide::{Action, Decider, Decision};
use umbracast::radio::{Loss, Outages};

use crate::device::{Network, Order, REPORT_TICKS, View};
use crate::foreseen::Foreseen;
use crate::truth::{TICK_NS, TICK_S, Traces};

/// A policy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Policy {
    /// Whoever was the strongest at first, for good.
    Stay,
    /// 3GPP's event A3: a neighbour is stronger by an offset for a while, in filtered reports.
    A3 {
        /// Time constant of the filter.
        filter_s: f64,
        /// Time to trigger.
        trigger_s: f64,
    },
    /// The same condition, prepared before and carried out by the device without a command.
    Conditional {
        /// Time constant of the filter.
        filter_s: f64,
        /// Time to trigger.
        trigger_s: f64,
    },
    /// Decisions on what a frame shows, as if nothing moved.
    AsNow,
    /// Decisions on forecasts.
    Foreseen,
    /// The same, published at once.
    ForeseenAtOnce,
    /// Decisions on the true next 0.9 s.
    Perfect,
}

/// A neighbour must be stronger by so much (usual in networks).
const OFFSET_DB: f64 = 3.0;

impl Policy {
    /// Those of the tables, in their order.
    pub const ALL: [Self; 9] = [
        Self::Stay,
        Self::A3 { filter_s: 0.06, trigger_s: 0.04 },
        Self::A3 { filter_s: 0.16, trigger_s: 0.16 },
        Self::Conditional { filter_s: 0.06, trigger_s: 0.04 },
        Self::AsNow,
        Self::Foreseen,
        Self::ForeseenAtOnce,
        Self::Perfect,
        Self::Conditional { filter_s: 0.16, trigger_s: 0.16 },
    ];

    /// As tables name it.
    pub fn name(&self) -> String {
        let ms = |s: &f64| (s * 1e3).round();
        match self {
            Self::Stay => "stay".to_owned(),
            Self::A3 { filter_s, trigger_s } => format!("A3 {}/{}", ms(filter_s), ms(trigger_s)),
            Self::Conditional { filter_s, trigger_s } => {
                format!("conditional {}/{}", ms(filter_s), ms(trigger_s))
            }
            Self::AsNow => "LiDAR, as now".to_owned(),
            Self::Foreseen => "forecast".to_owned(),
            Self::ForeseenAtOnce => "forecast, no age".to_owned(),
            Self::Perfect => "perfect 0.9 s".to_owned(),
        }
    }
}

/// A reactive policy of one device.
#[derive(Debug)]
pub struct Reactive {
    filter_s: f64,
    trigger_s: f64,
    conditional: bool,
    filtered_db: Vec<f64>,
    /// By access point, since when it has been stronger.
    since: Vec<Option<usize>>,
}

impl Reactive {
    /// Before its first report.
    pub fn new(filter_s: f64, trigger_s: f64, conditional: bool, access_points: usize) -> Self {
        Self {
            filter_s,
            trigger_s,
            conditional,
            filtered_db: vec![f64::NAN; access_points],
            since: vec![None; access_points],
        }
    }

    /// What it asks for at an instant.
    pub fn order(&mut self, view: &View<'_>) -> Option<Order> {
        if !view.is_new {
            return None;
        }
        let share = (REPORT_TICKS as f64 * TICK_S / self.filter_s).min(1.0);
        for (filtered_db, reported_db) in self.filtered_db.iter_mut().zip(view.reported_db) {
            let before = if filtered_db.is_finite() { *filtered_db } else { *reported_db };
            *filtered_db = before + share * (reported_db - before);
        }
        let serving_db = self.filtered_db[view.serving];
        let mut best: Option<usize> = None;
        for ap in 0..self.filtered_db.len() {
            let stronger = ap != view.serving && self.filtered_db[ap] > serving_db + OFFSET_DB;
            self.since[ap] = if stronger { self.since[ap].or(Some(view.tick)) } else { None };
            let long = self.since[ap]
                .is_some_and(|since| (view.tick - since) as f64 * TICK_S >= self.trigger_s - 1e-9);
            if long && best.is_none_or(|best| self.filtered_db[ap] > self.filtered_db[best]) {
                best = Some(ap);
            }
        }
        best.map(|ap| {
            self.since.fill(None);
            if self.conditional { Order::Execute(ap) } else { Order::Command(ap) }
        })
    }
}

/// A policy of one device on what frames say.
#[derive(Debug)]
pub struct Advised<'a> {
    /// Every frame of the scene.
    pub frames: &'a [Foreseen],
    /// What of them is believed.
    pub policy: Policy,
    /// For the programme.
    pub decider: Decider,
    /// The network and its truth, for who knows the future.
    pub network: &'a Network,
    /// See `network`.
    pub traces: &'a Traces,
    next: usize,
}

impl<'a> Advised<'a> {
    /// Before the first frame that is published.
    pub fn new(
        frames: &'a [Foreseen],
        policy: Policy,
        decider: Decider,
        network: &'a Network,
        traces: &'a Traces,
    ) -> Self {
        Self { frames, policy, decider, network, traces, next: 0 }
    }

    /// What it asks for at an instant.
    pub fn order(&mut self, view: &View<'_>) -> Option<Order> {
        let age_s = if self.policy == Policy::ForeseenAtOnce { 0.0 } else { self.network.costs.age_s };
        let now_ns = view.tick as i64 * TICK_NS - (age_s * 1e9) as i64;
        let published = self.frames[self.next..].iter().take_while(|frame| frame.time_ns <= now_ns).count();
        self.next += published;
        let frame = published.checked_sub(1).map(|_| &self.frames[self.next - 1])?;
        let decision = self.advise(frame, view)?;
        Some(match (decision.action, decision.target) {
            (Action::HandOver, Some(target)) => Order::Command(target),
            (Action::Prepare, Some(target)) if self.network.costs.conditional => Order::Prepare(target),
            (Action::Wait, _) => Order::Hold,
            _ => Order::Release,
        })
    }

    fn advise(&mut self, frame: &Foreseen, view: &View<'_>) -> Option<Decision> {
        let (person, serving) = (view.person, view.serving);
        if self.policy == Policy::Perfect {
            let tick = (frame.time_ns / TICK_NS) as usize;
            let mut outages = Outages::new(self.network.radios.len(), 1, 1);
            let mut loss = Loss::clear(serving, 0);
            for step in 0..=STEPS {
                // What is out within half a step of a step's instant is out at it.
                let at = tick + 10 * step;
                for ap in self.network.ways() {
                    let last = (at + 5).min(self.traces.ticks);
                    let out =
                        (at.saturating_sub(4)..last).any(|t| self.network.is_out(self.traces, t, ap, person));
                    if out {
                        outages.set(ap, 0, step, 0);
                        loss.p_out[STEPS - 1] = if ap == serving { 1.0 } else { loss.p_out[STEPS - 1] };
                    }
                }
            }
            return self.decider.advise(serving, &loss, 0, &outages);
        }
        let index = frame.index_of[person]?;
        if self.policy == Policy::AsNow {
            let mut outages = Outages::new(self.network.radios.len(), 1, 1);
            let mut loss = Loss::clear(serving, 0);
            for ap in self.network.ways() {
                if frame.loss(ap, index).is_some_and(|loss| loss.p_out_now >= 0.5) {
                    (0..=STEPS).for_each(|step| outages.set(ap, 0, step, 0));
                    loss.p_out_now = if ap == serving { 1.0 } else { loss.p_out_now };
                }
            }
            return self.decider.advise(serving, &loss, 0, &outages);
        }
        let loss = frame.loss(serving, index)?;
        self.decider.advise(serving, loss, index, &frame.outages)
    }
}
