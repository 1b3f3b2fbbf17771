//! Who decides when a device changes, and by what.

use umbracast::STEPS;
use umbracast::decide::{Action, Decider, Decision, Serving};
use umbracast::radio::{Loss, Outages};

use crate::bound::Carriers;
use crate::device::{Network, Order, REPORT_TICKS, View};
use crate::foreseen::Foreseen;
use crate::truth::{TICK_NS, TICK_S, Traces};

/// A policy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Policy {
    /// Whoever was the strongest at first, for good.
    Stay,
    /// 3GPP's event A3: a neighbour is stronger by an offset for a while, in filtered reports.
    A3(Tuning),
    /// The same condition, prepared before and carried out by the device without a command.
    Conditional(Tuning),
    /// A3, and a beam that fails is pointed at the best reflection of the same access point (3GPP TS 38.321, 5.17).
    Beams,
    /// The same with a change that is prepared before.
    ConditionalBeams,
    /// Decisions on what a frame shows, as if nothing moved.
    AsNow,
    /// Decisions on what the paper's method says.
    Paper,
    /// Decisions on forecasts by constant velocity.
    ConstantVelocity,
    /// Decisions on forecasts.
    Foreseen,
    /// The same where it has to be found out from the power heard whose each device is. Until that is known, it changes as
    /// `Conditional(Fast)` does.
    Bound,
    /// The same as forecasts where no device can be prepared: every change needs a command.
    Commands,
    /// The same as forecasts, with beams that are pointed at reflections in time; one that fails all the same recovers as with A3.
    ForeseenBeams,
    /// The same as forecasts, published at once.
    AtOnce,
    /// Decisions on the true next 0.9 s.
    Perfect,
    /// The least of outage and price of changes, by who knows the whole trace.
    Oracle,
    /// The same with the ways by a reflection.
    OracleBeams,
    /// Every access point at once.
    All,
}

/// How fast reports count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Tuning {
    /// Filtered over 60 ms, 40 ms to trigger.
    Fast,
    /// 160 ms and 160 ms.
    Slow,
}

/// A neighbour must be stronger by so much (usual in networks).
const OFFSET_DB: f64 = 3.0;
/// A beam has failed after so many reports in which it is out: as fast as the standard lets it be (beamFailureInstanceMaxCount n2).
const FAILED_REPORTS: usize = 2;

impl Tuning {
    /// Time constant of the filter and time to trigger, seconds.
    pub fn seconds(self) -> [f64; 2] {
        match self {
            Self::Fast => [0.06, 0.04],
            Self::Slow => [0.16, 0.16],
        }
    }
}

impl Policy {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 19] = [
        Self::Stay,
        Self::A3(Tuning::Fast),
        Self::A3(Tuning::Slow),
        Self::Conditional(Tuning::Fast),
        Self::Conditional(Tuning::Slow),
        Self::Beams,
        Self::ConditionalBeams,
        Self::AsNow,
        Self::Paper,
        Self::ConstantVelocity,
        Self::Foreseen,
        Self::ForeseenBeams,
        Self::Bound,
        Self::Commands,
        Self::AtOnce,
        Self::Perfect,
        Self::Oracle,
        Self::OracleBeams,
        Self::All,
    ];

    /// Whether it uses ways by a reflection.
    pub fn has_beams(self) -> bool {
        matches!(self, Self::Beams | Self::ConditionalBeams | Self::ForeseenBeams | Self::OracleBeams)
    }

    /// As the command and its tables name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stay => "stay",
            Self::A3(Tuning::Fast) => "a3-60-40",
            Self::A3(Tuning::Slow) => "a3-160-160",
            Self::Conditional(Tuning::Fast) => "conditional-60-40",
            Self::Conditional(Tuning::Slow) => "conditional-160-160",
            Self::Beams => "a3-with-beams",
            Self::ConditionalBeams => "conditional-with-beams",
            Self::AsNow => "as-now",
            Self::Paper => "paper",
            Self::ConstantVelocity => "constant-velocity",
            Self::Foreseen => "forecast",
            Self::ForeseenBeams => "forecast-with-beams",
            Self::Bound => "forecast-bound",
            Self::Commands => "forecast-commands",
            Self::AtOnce => "forecast-no-age",
            Self::Perfect => "perfect-0.9-s",
            Self::Oracle => "oracle",
            Self::OracleBeams => "oracle-with-beams",
            Self::All => "all-at-once",
        }
    }
}

/// A reactive policy of one device.
#[derive(Debug)]
pub struct Reactive {
    filter_s: f64,
    trigger_s: f64,
    conditional: bool,
    beams: bool,
    filtered_db: Vec<f64>,
    /// By access point, since when it has been stronger.
    since: Vec<Option<usize>>,
    recovery: BeamRecovery,
}

/// How a device recovers from a beam that has failed (3GPP TS 38.321, 5.17): it takes the other way of its access point.
#[derive(Debug, Default)]
struct BeamRecovery {
    /// In how many reports in a row the beam was out.
    failed: usize,
}

impl BeamRecovery {
    fn order(&mut self, view: &View<'_>) -> Option<Order> {
        if !view.is_new {
            return None;
        }
        self.failed = if view.out { self.failed + 1 } else { 0 };
        (self.failed >= FAILED_REPORTS && (!view.reflected || !view.straight_out))
            .then_some(Order::Beam(!view.reflected))
    }
}

impl Reactive {
    /// Before its first report. `conditional` changes need no command; with `beams` reflections are used too.
    pub fn new(tuning: Tuning, conditional: bool, beams: bool, access_points: usize) -> Self {
        let [filter_s, trigger_s] = tuning.seconds();
        Self {
            filter_s,
            trigger_s,
            conditional,
            beams,
            filtered_db: vec![f64::NAN; access_points],
            since: vec![None; access_points],
            recovery: BeamRecovery::default(),
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
        if let Some(ap) = best {
            self.since.fill(None);
            return Some(if self.conditional { Order::Execute(ap) } else { Order::Command(ap) });
        }
        if !self.beams {
            return None;
        }
        // The straight way carries more as soon as it is free.
        let is_free = view.reflected && !view.straight_out;
        self.recovery.order(view).or(is_free.then_some(Order::Beam(false)))
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
    recovery: BeamRecovery,
    /// Of [`Policy::Bound`]: who is found to carry whose device, and what decides where nobody is.
    bound: Option<(&'a Carriers, Reactive)>,
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
        let recovery = BeamRecovery::default();
        Self { frames, policy, decider, network, traces, next: 0, recovery, bound: None }
    }

    /// Whose devices are is as it was found out, not as it is.
    pub fn bound(self, carriers: &'a Carriers) -> Self {
        let reactive = Reactive::new(Tuning::Fast, true, false, self.network.radios.len());
        Self { bound: Some((carriers, reactive)), ..self }
    }

    /// What it asks for at an instant. A device whose beam failed all the same does not wait for advice.
    pub fn order(&mut self, view: &View<'_>) -> Option<Order> {
        let recovered = self.recovery.order(view).filter(|_| self.policy.has_beams());
        let advice = self.advice(view);
        let reactive = self.bound.as_mut().and_then(|(carriers, reactive)| {
            let order = reactive.order(view);
            let carrier = self.next.checked_sub(1).and_then(|frame| carriers[frame][view.person]);
            order.filter(|_| carrier.is_none())
        });
        advice.or(recovered).or(reactive)
    }

    fn advice(&mut self, view: &View<'_>) -> Option<Order> {
        let now_ns = view.tick as i64 * TICK_NS - (self.network.costs.age_s * 1e9) as i64;
        let published = self.frames[self.next..].iter().take_while(|frame| frame.time_ns <= now_ns).count();
        self.next += published;
        let frame = published.checked_sub(1).map(|_| &self.frames[self.next - 1])?;
        let decision = self.advise(frame, view)?;
        Some(match (decision.action, decision.target) {
            (Action::HandOver, Some(target)) => Order::Command(target),
            (Action::Prepare, Some(target)) if self.network.costs.conditional => Order::Prepare(target),
            (Action::Wait, _) => Order::Hold,
            (Action::Beam, _) => Order::Point(decision.surface.is_some()),
            _ => Order::Release,
        })
    }

    fn advise(&mut self, frame: &Foreseen, view: &View<'_>) -> Option<Decision> {
        let (person, serving) = (view.person, view.serving);
        let served = Serving { access_point: serving, is_reflected: view.reflected };
        match self.policy {
            Policy::Perfect => self.knowing(frame, person, serving),
            Policy::AsNow => self.as_now(frame, frame.index_of[person]?, serving),
            _ => {
                let index_of = self.bound.as_ref().map(|(carriers, _)| &carriers[self.next - 1]);
                let index = index_of.unwrap_or(&frame.index_of)[person]?;
                self.decider.advise(served, frame.loss(serving, index)?, index, &frame.outages)
            }
        }
    }

    /// What is out within half a step of a step's instant is out at it.
    fn knowing(&mut self, frame: &Foreseen, person: usize, serving: usize) -> Option<Decision> {
        let tick = (frame.time_ns / TICK_NS) as usize;
        let mut outages = Outages::new(self.network.radios.len(), 1, 1);
        let mut loss = Loss::clear(serving, 0);
        for step in 0..=STEPS {
            let at = tick + 10 * step;
            for ap in self.network.ways() {
                let mut instants = at.saturating_sub(4)..(at + 5).min(self.traces.ticks);
                if instants.any(|tick| self.network.is_out(self.traces, tick, ap, person)) {
                    outages.set(ap, 0, step, 0);
                    loss.p_out[STEPS - 1] = if ap == serving { 1.0 } else { loss.p_out[STEPS - 1] };
                }
            }
        }
        self.decider.advise(Serving::straight(serving), &loss, 0, &outages)
    }

    fn as_now(&mut self, frame: &Foreseen, index: usize, serving: usize) -> Option<Decision> {
        let mut outages = Outages::new(self.network.radios.len(), 1, 1);
        let mut loss = Loss::clear(serving, 0);
        for ap in self.network.ways() {
            if frame.loss(ap, index).is_some_and(|loss| loss.p_out_now >= 0.5) {
                (0..=STEPS).for_each(|step| outages.set(ap, 0, step, 0));
                loss.p_out_now = if ap == serving { 1.0 } else { loss.p_out_now };
            }
        }
        self.decider.advise(Serving::straight(serving), &loss, 0, &outages)
    }
}
