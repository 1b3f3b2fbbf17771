//! One device in the network: served, changing, or lost and on its way back; and what that costs it.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use umbracast::site::{Costs, Radio};
use umbracast_sim::random::stream;

use crate::truth::{TICK_S, Traces};

/// Reference signals come so often (3GPP TS 38.213, the usual period of synchronisation blocks).
pub const REPORT_TICKS: usize = 2;
/// Standard deviation of a report, dB: what links in sight show in the passages of IMMERSE.
pub const REPORT_NOISE_DB: f64 = 0.6;
/// No modulation carries more, bits a second in each hertz.
const MOST_BPS_HZ: f64 = 7.4;
/// A change back within so long is a ping-pong.
const PING_PONG_S: f64 = 1.0;
/// A change is needless where the link that was left would not have been out within so long.
const NEEDLESS_S: f64 = 0.9;
/// Rates are means over so many ticks.
const WINDOW_TICKS: usize = 10;

/// What a beam at a reflection that is out loses: nobody looks how much.
const SWALLOWED_DB: f64 = 60.0;

/// What a policy asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Change to an access point, by a command over the serving link.
    Command(usize),
    /// The device changes by itself, as it was prepared to.
    Execute(usize),
    /// The device changes by itself when the serving link falls, until the next order.
    Prepare(usize),
    /// While the link is out it is not given up, until the next order.
    Hold,
    /// As usual, until the next order.
    Release,
    /// The device points the beam at the best reflection of the same access point, or at the access point again.
    Beam(bool),
    /// The same by a command over the serving link.
    Point(bool),
}

/// What a command tells a device.
#[derive(Debug, Clone, Copy)]
enum Command {
    Change(usize),
    Point(bool),
}

/// What a policy sees at an instant.
#[derive(Debug)]
pub struct View<'a> {
    /// The instant.
    pub tick: usize,
    /// Whose device.
    pub person: usize,
    /// The access point that serves it.
    pub serving: usize,
    /// By access point, the last report: signal to noise, dB; of the serving one that of the beam that serves.
    pub reported_db: &'a [f64],
    /// Whether there is a new one.
    pub is_new: bool,
    /// Whether the beam is pointed at a reflection.
    pub reflected: bool,
    /// Whether the way that the beam is pointed at is out.
    pub out: bool,
    /// Whether the straight way to the serving access point is out.
    pub straight_out: bool,
}

/// What came of a device's time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tally {
    /// How long it was in the scene.
    pub ticks: usize,
    /// Of these in outage: the link out, the device changing, or lost.
    pub out_ticks: usize,
    /// Changes that began.
    pub handovers: usize,
    /// Of these, back to the access point before within a second.
    pub ping_pongs: usize,
    /// Of these, away from a link that would not have been out.
    pub needless: usize,
    /// Commands that the serving link did not carry.
    pub lost_commands: usize,
    /// Links that were given up.
    pub recoveries: usize,
    /// How often a beam was pointed elsewhere, and how long nothing was sent meanwhile.
    pub beams: usize,
    /// See `beams`.
    pub beam_ms: u64,
    /// Mean rates of 100 ms, bits a second.
    pub rates_bps: Vec<f32>,
}

impl Tally {
    /// Takes up another device's.
    pub fn add(&mut self, other: &Self) {
        self.ticks += other.ticks;
        self.out_ticks += other.out_ticks;
        self.handovers += other.handovers;
        self.ping_pongs += other.ping_pongs;
        self.needless += other.needless;
        self.lost_commands += other.lost_commands;
        self.recoveries += other.recoveries;
        self.beams += other.beams;
        self.beam_ms += other.beam_ms;
        self.rates_bps.extend_from_slice(&other.rates_bps);
    }

    /// Takes up that a beam is pointed elsewhere.
    pub(crate) fn point(&mut self, costs: &Costs) {
        self.beams += 1;
        self.beam_ms += (costs.beam_s * 1e3).round() as u64;
    }

    /// Time in outage.
    pub fn out_ms(&self) -> u64 {
        (self.out_ticks as f64 * TICK_S * 1e3).round() as u64 + self.beam_ms
    }
}

/// The network's numbers.
#[derive(Debug, Clone)]
pub struct Network {
    /// By access point.
    pub radios: Vec<Option<Radio>>,
    /// Of the procedures.
    pub costs: Costs,
    /// Of the reports' noise.
    pub seed: u64,
}

impl Network {
    /// Those with a radio.
    pub fn ways(&self) -> impl Iterator<Item = usize> {
        (0..self.radios.len()).filter(|&ap| self.radios[ap].is_some())
    }

    /// How many dB a link can lose.
    pub fn margin_db(&self, ap: usize) -> f64 {
        self.radios[ap].map_or(0.0, |radio| radio.margin_db)
    }

    /// Whether a link is out.
    pub fn is_out(&self, traces: &Traces, tick: usize, ap: usize, person: usize) -> bool {
        self.radios[ap].is_none_or(|radio| traces.loss_db(tick, ap, person) >= radio.margin_db)
    }

    /// The same of the way that a beam takes: straight, or by its best reflection.
    pub fn is_way_out(
        &self,
        traces: &Traces,
        tick: usize,
        ap: usize,
        person: usize,
        reflected: bool,
    ) -> bool {
        if !reflected {
            return self.is_out(traces, tick, ap, person);
        }
        self.radios[ap].is_none_or(|radio| traces.reflected_db(tick, ap, person) >= radio.margin_db)
    }

    /// Signal to noise of such a way.
    pub fn snr_db(&self, traces: &Traces, tick: usize, ap: usize, person: usize, reflected: bool) -> f64 {
        let loss_db = match reflected {
            true if self.is_way_out(traces, tick, ap, person, reflected) => SWALLOWED_DB,
            true => traces.reflected_db(tick, ap, person),
            false => traces.loss_db(tick, ap, person),
        };
        self.radios[ap].map_or(f64::NEG_INFINITY, |radio| {
            radio.snr_db(traces.length_m(tick, ap, person).max(0.1)) - loss_db
        })
    }

    /// The access point that a device connects to at an instant.
    pub fn strongest(&self, traces: &Traces, tick: usize, person: usize) -> usize {
        let snr_db = |ap: &usize| self.snr_db(traces, tick, *ap, person, false);
        self.ways().max_by(|a, b| snr_db(a).total_cmp(&snr_db(b))).unwrap_or_default()
    }
}

enum Phase {
    Served,
    Changing { until: usize, to: usize },
    Lost { until: usize },
}

/// Drives a device through a scene under a policy, from `begin` on.
pub fn drive(
    network: &Network,
    traces: &Traces,
    person: usize,
    begin: usize,
    mut policy: impl FnMut(&View<'_>) -> Option<Order>,
) -> Tally {
    let ticks_of = |seconds: f64| (seconds / TICK_S).round() as usize;
    let costs = &network.costs;
    let mut noise = stream(network.seed, "reports", person as u64);
    let mut serving = network.strongest(traces, begin, person);
    let (mut phase, mut command, mut held, mut out_for) = (Phase::Served, None, false, 0);
    let mut prepared: Option<(usize, f64)> = None;
    let mut reflected = false;
    let mut last_change: Option<(usize, usize)> = None;
    let mut reported_db = vec![f64::NEG_INFINITY; network.radios.len()];
    let (mut tally, mut window_bps) = (Tally::default(), 0.0);
    for tick in begin..traces.ticks {
        match phase {
            Phase::Changing { until, to } if tick >= until => {
                (serving, phase, reflected) = (to, Phase::Served, false);
            }
            Phase::Lost { until } if tick >= until => {
                serving = network.strongest(traces, tick, person);
                (phase, reflected) = (Phase::Served, false);
            }
            _ => {}
        }
        let is_new = tick.is_multiple_of(REPORT_TICKS);
        if is_new {
            for ap in network.ways() {
                let beam = reflected && ap == serving;
                reported_db[ap] =
                    network.snr_db(traces, tick, ap, person, beam) + REPORT_NOISE_DB * normal(&mut noise);
            }
        }
        let way_out = |reflected: bool| network.is_way_out(traces, tick, serving, person, reflected);
        let straight_out = way_out(false);
        let mut out = way_out(reflected);
        let (mut change, mut pointed) = (None, None);
        let view =
            View { tick, person, serving, reported_db: &reported_db, is_new, reflected, out, straight_out };
        match policy(&view) {
            Some(Order::Command(to)) if command.is_none() => {
                command = Some((tick + ticks_of(costs.command_s), Command::Change(to)));
                held = false;
            }
            Some(Order::Point(to_reflection)) if command.is_none() => {
                command = Some((tick + ticks_of(costs.command_s), Command::Point(to_reflection)));
                (held, prepared) = (false, None);
            }
            Some(Order::Execute(to)) => change = Some(to),
            Some(Order::Prepare(to)) => {
                // The level to fall from is the best that was heard while being prepared.
                let before = prepared.map_or(f64::NEG_INFINITY, |(_, level_db)| level_db);
                prepared = Some((to, before.max(reported_db[serving])));
                held = false;
            }
            Some(Order::Hold) => (held, prepared) = (true, None),
            Some(Order::Release) => (held, prepared) = (false, None),
            Some(Order::Beam(to_reflection)) => pointed = Some(to_reflection),
            _ => {}
        }
        if let Some((to, level_db)) = prepared.filter(|_| is_new)
            && reported_db[serving] < level_db - costs.leaves_at * network.margin_db(serving)
        {
            change = Some(to);
        }
        if let Some((_, told)) = command.filter(|(at, _)| *at <= tick) {
            command = None;
            match told {
                _ if !matches!(phase, Phase::Served) || out => tally.lost_commands += 1,
                Command::Change(to) => change = Some(to),
                Command::Point(to_reflection) => pointed = Some(to_reflection),
            }
        }
        // Less than an instant of the truth, as a rule.
        if let Some(to_reflection) = pointed.filter(|to| *to != reflected) {
            tally.point(costs);
            (reflected, out) = (to_reflection, way_out(to_reflection));
        }
        if let (Some(to), Phase::Served) = (change.filter(|to| *to != serving), &phase) {
            tally.handovers += 1;
            let back = last_change.is_some_and(|(at, from)| from == to && tick - at <= ticks_of(PING_PONG_S));
            tally.ping_pongs += usize::from(back);
            let last = (tick + ticks_of(NEEDLESS_S)).min(traces.ticks);
            let needed = (tick..last).any(|later| network.is_out(traces, later, serving, person));
            tally.needless += usize::from(!needed);
            last_change = Some((tick, serving));
            prepared = None;
            phase = Phase::Changing { until: tick + ticks_of(costs.interruption_s), to };
        }
        tally.ticks += 1;
        let serves = matches!(phase, Phase::Served) && !out;
        tally.out_ticks += usize::from(!serves);
        out_for = if matches!(phase, Phase::Served) && out { out_for + 1 } else { 0 };
        if out_for >= ticks_of(costs.given_up_after_s) && !held {
            tally.recoveries += 1;
            out_for = 0;
            phase = Phase::Lost { until: tick + ticks_of(costs.recovery_s) };
        }
        if serves {
            let snr_db = network.snr_db(traces, tick, serving, person, reflected);
            window_bps += rate_bps(network, snr_db, serving);
        }
        if (tick - begin + 1).is_multiple_of(WINDOW_TICKS) {
            tally.rates_bps.push((window_bps / WINDOW_TICKS as f64) as f32);
            window_bps = 0.0;
        }
    }
    tally
}

/// Shannon's, with the most that a modulation carries.
fn rate_bps(network: &Network, snr_db: f64, ap: usize) -> f64 {
    let bits = (1.0 + 10.0_f64.powf(0.1 * snr_db)).log2().min(MOST_BPS_HZ);
    network.radios[ap].map_or(0.0, |radio| radio.bandwidth_mhz * 1e6 * bits)
}

fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::policy::{Reactive, Tuning};
    use umbracast::site::Handover;

    fn network() -> Network {
        Network { radios: vec![Some(Radio::default()); 2], costs: Handover::default().costs(), seed: 1 }
    }

    /// The first access point fades for 400 ms; its reflection does not. The other one loses `other_db` all the time.
    fn traces(other_db: f32) -> Traces {
        Traces::by_hand(400, 2, |tick, ap| match ap {
            0 if (100..140).contains(&tick) => [25.0, 6.0],
            0 => [0.0, f32::INFINITY],
            _ => [other_db, f32::INFINITY],
        })
    }

    fn driven(traces: &Traces, conditional: bool, beams: bool) -> Tally {
        let mut policy = Reactive::new(Tuning::Fast, conditional, beams, 2);
        drive(&network(), traces, 0, 0, |view| policy.order(view))
    }

    #[test]
    fn a_beam_at_a_reflection_saves_a_link_that_has_no_other_access_point() {
        let (without, with) = (driven(&traces(30.0), false, false), driven(&traces(30.0), false, true));
        assert!(without.recoveries >= 1 && without.out_ticks >= 30, "{without:?}");
        assert!(with.recoveries == 0 && with.out_ticks <= 4, "two reports, 20 ms apart: {with:?}");
        assert_eq!((with.ticks, with.handovers), (400, 0));
    }

    #[test]
    fn a_command_that_finds_the_link_out_is_lost_and_a_prepared_device_needs_none() {
        let (command, conditional) = (driven(&traces(4.0), false, false), driven(&traces(4.0), true, false));
        assert!(command.lost_commands >= 1, "{command:?}");
        assert!(conditional.lost_commands == 0 && conditional.handovers >= 1, "{conditional:?}");
        assert!(conditional.out_ticks < command.out_ticks, "{conditional:?} {command:?}");
    }
}
