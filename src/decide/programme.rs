//! The least expected cost of a device's next second, by a backward programme over steps and ways on the joint samples.
//!
//! What is decided now is decided for all samples alike, for nobody knows yet which of them will come true. What is decided
//! later is decided for each sample by itself: frames come every 100 ms and tell more, so a later decision knows its future far
//! better than one of now. This is hindsight optimisation (Chong, Givan and Chang 2000): it bounds the cost from below, and waits
//! where waiting costs nothing. After the last step everybody is taken to walk straight on for a second: whose link is cut then
//! will have to change once more. Access points behind one person fail together, for their samples are the same.

use crate::STEP_S;
use crate::blockage::lanes::WORD;
use crate::blockage::trajectories::MOMENTS;
use crate::radio::{Outages, Surface};
use crate::site::Costs;

/// One step on a reflection costs so much more than on the straight way, seconds in outage: it carries less, and is left when the
/// straight way is free again.
const WEAKER_S: f32 = 0.001;

/// A device recovers from a beam that has failed by itself, after two reports 20 ms apart (3GPP TS 38.321, 5.17).
const RECOVERS_S: f32 = 0.04;

/// How a device is served.
///
/// ```
/// use umbracast::decide::Serving;
///
/// assert_eq!(Serving::straight(2), Serving { access_point: 2, is_reflected: false });
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Serving {
    /// By which access point.
    pub access_point: usize,
    /// Whether its beam is pointed at the best reflection.
    pub is_reflected: bool,
}

impl Serving {
    /// By a beam that is pointed at the device.
    pub fn straight(access_point: usize) -> Self {
        Self { access_point, is_reflected: false }
    }
}

/// A way that may serve the device.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    serving: Serving,
    /// Its number in the samples.
    index: usize,
    /// The place of the other way of the same access point.
    twin: Option<usize>,
}

impl Way {
    /// All ways to a device: the straight ones in the order of access points, then those by a reflection.
    pub(super) fn all(
        access_points: impl Iterator<Item = usize>,
        reflection: impl Fn(usize) -> Option<(usize, Surface)>,
    ) -> Vec<Self> {
        let straight = |ap| Self { serving: Serving::straight(ap), index: ap, twin: None };
        let mut ways: Vec<Self> = access_points.map(straight).collect();
        for twin in 0..ways.len() {
            let access_point = ways[twin].index;
            if let Some((index, _)) = reflection(access_point) {
                ways[twin].twin = Some(ways.len());
                let serving = Serving { access_point, is_reflected: true };
                ways.push(Self { serving, index, twin: Some(twin) });
            }
        }
        ways
    }

    fn weaker_s(&self) -> f32 {
        if self.serving.is_reflected { WEAKER_S } else { 0.0 }
    }
}

/// Expected costs, seconds in outage.
#[derive(Debug, Clone, Default)]
pub(super) struct Values {
    /// Of staying now.
    pub(super) stay_s: f64,
    /// Of changing now, by access point.
    pub(super) changed_s: Vec<(usize, f64)>,
    /// Of pointing the beam at the other way of the serving access point now.
    pub(super) beam_s: Option<f64>,
    /// Of an outage now that is sat out, and of one that the network gives up.
    pub(super) held_s: f64,
    pub(super) given_up_s: f64,
    /// Where to when the serving link goes out, and in which share of the samples it does and a change then helps.
    pub(super) later: Option<(usize, f64)>,
}

/// Its working memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Programme {
    /// By step, way and sample: the cost from that step on; after the last step that of one more change where the way is cut soon.
    value_s: Vec<f32>,
    /// By sample: that of the best way.
    least_s: Vec<f32>,
}

/// What does not change over steps.
struct Numbers {
    conditional: bool,
    /// The share of a step that a command is under way: if the link goes out then, it is lost.
    lost: f32,
    change_s: f32,
    /// What is left of a step after a change in it: in outage where the new link is out.
    rest_s: f32,
    given_up_s: f32,
    beam_s: f32,
}

impl Programme {
    pub(super) fn run(
        &mut self,
        costs: &Costs,
        ways: &[Way],
        serving: Serving,
        person: usize,
        outages: &Outages,
    ) -> Values {
        let numbers = Numbers {
            conditional: costs.conditional,
            lost: ((costs.age_s + costs.command_s) / STEP_S).min(1.0) as f32,
            change_s: (costs.interruption_s + costs.price_s) as f32,
            rest_s: (STEP_S - costs.interruption_s).max(0.0) as f32,
            given_up_s: (costs.given_up_after_s + costs.recovery_s + costs.price_s) as f32,
            beam_s: costs.beam_s.min(STEP_S) as f32,
        };
        let samples = outages.samples();
        let of_step = ways.len() * samples;
        self.value_s.clear();
        self.value_s.resize((MOMENTS + 1) * of_step, 0.0);
        let after_s = self.value_s[MOMENTS * of_step..].chunks_exact_mut(samples);
        for (after_s, way) in after_s.zip(ways) {
            let soon = outages.beyond(way.index, person);
            let cut = (0..samples).filter(|k| has(soon, *k));
            cut.for_each(|k| after_s[k] = numbers.change_s);
        }
        for step in (0..MOMENTS).rev() {
            self.find_least(&numbers, ways, person, outages, step);
            let (here_s, next_s) = self.value_s[step * of_step..].split_at_mut(of_step);
            for (way, of) in ways.iter().enumerate() {
                let out = outages.of(of.index, person, step);
                let soon = if step + 1 < MOMENTS { outages.of(of.index, person, step + 1) } else { &[] };
                let row = |way: usize| way * samples..(way + 1) * samples;
                let (here_s, after_s) = (&mut here_s[row(way)], &next_s[row(way)]);
                let weaker_s = of.weaker_s();
                for k in 0..samples {
                    let after_s = weaker_s + after_s[k];
                    let stayed_s = if has(out, k) {
                        (STEP_S as f32 + after_s).min(numbers.given_up_s + self.least_s[k])
                    } else {
                        after_s
                    };
                    let lost = numbers.lost(has(out, k), has(soon, k));
                    let changed_s = numbers.change_s + self.least_s[k];
                    here_s[k] = stayed_s.min(changed_s + lost * (stayed_s - changed_s).max(0.0));
                }
                // Now a beam is pointed elsewhere by a command alone, which is weighed below.
                let Some(twin) = of.twin.filter(|_| step > 0) else { continue };
                let (twin_out, twin_s) = (outages.of(ways[twin].index, person, step), &next_s[row(twin)]);
                for k in 0..samples {
                    let pointed_s = numbers.pointed_s(has(out, k), has(soon, k), has(twin_out, k));
                    here_s[k] = here_s[k].min(pointed_s + twin_s[k]);
                }
            }
        }
        self.weigh(&numbers, ways, serving, person, outages)
    }

    /// Of what is done now, over all samples.
    fn weigh(
        &mut self,
        numbers: &Numbers,
        ways: &[Way],
        serving: Serving,
        person: usize,
        outages: &Outages,
    ) -> Values {
        let samples = outages.samples();
        let of_step = ways.len() * samples;
        self.find_least(numbers, ways, person, outages, 0);
        let own = ways.iter().position(|way| way.serving == serving).unwrap_or_default();
        let of = |way: usize, step: usize| outages.of(ways[way].index, person, step);
        let value_s = |step: usize, way: usize, k: usize| self.value_s[step * of_step + way * samples + k];
        let (out, soon) = (of(own, 0), of(own, 1));
        let weaker_s = ways[own].weaker_s();
        let is_other = |way: &usize| {
            let of = ways[*way].serving;
            !of.is_reflected && of.access_point != serving.access_point
        };
        let others = || (0..ways.len()).filter(is_other);
        let mut changed_s = vec![0.0_f64; ways.len()];
        let mut later_s = vec![0.0_f64; ways.len()];
        let (mut stay, mut held, mut given_up, mut beam, mut later) = (0.0, 0.0, 0.0, 0.0, 0);
        for k in 0..samples {
            let stayed_s = weaker_s + value_s(1, own, k) + if has(out, k) { STEP_S as f32 } else { 0.0 };
            let given_up_s = numbers.given_up_s + self.least_s[k];
            held += f64::from(stayed_s);
            given_up += f64::from(given_up_s);
            // A prepared change may follow within the step.
            stay +=
                f64::from(if numbers.conditional { value_s(0, own, k) } else { stayed_s.min(given_up_s) });
            let lost = numbers.lost(has(out, k), has(soon, k)) * f32::from(u8::from(!numbers.conditional));
            for (way, sum) in changed_s.iter_mut().enumerate() {
                let rest_s = if has(of(way, 0), k) { numbers.rest_s } else { 0.0 };
                let changed_s = numbers.change_s + rest_s + value_s(1, way, k);
                *sum += f64::from(changed_s + lost * (stayed_s - changed_s));
            }
            if let Some(twin) = ways[own].twin {
                let pointed_s = numbers.pointed_s(has(out, k), has(soon, k), has(of(twin, 0), k));
                beam += f64::from(pointed_s + value_s(1, twin, k));
            }
            let Some(onset) = (0..MOMENTS).find(|&step| has(of(own, step), k)) else { continue };
            let of_others_s = others().map(|way| value_s(onset, way, k)).fold(f32::MAX, f32::min);
            let least_s = of_others_s.min(value_s(onset, own, k));
            let stayed_s = value_s(onset + 1, own, k) + STEP_S as f32;
            let recovered_s = ways[own].twin.map_or(f32::MAX, |twin| {
                numbers.pointed_s(true, true, has(of(twin, onset), k)) + value_s(onset + 1, twin, k)
            });
            if numbers.change_s + least_s < stayed_s.min(recovered_s) {
                later += 1;
                later_s
                    .iter_mut()
                    .enumerate()
                    .for_each(|(way, sum)| *sum += f64::from(value_s(onset, way, k)));
            }
        }
        let mean = |sum: f64| sum / samples as f64;
        let best_later = others().min_by(|a, b| later_s[*a].total_cmp(&later_s[*b])).filter(|_| later > 0);
        Values {
            stay_s: mean(stay),
            changed_s: others().map(|way| (ways[way].index, mean(changed_s[way]))).collect(),
            beam_s: ways[own].twin.map(|_| mean(beam)),
            held_s: mean(held),
            given_up_s: mean(given_up),
            later: best_later.map(|way| (ways[way].index, mean(f64::from(later)))),
        }
    }

    /// By sample, what is left after a change at `step` to the best access point: a device that changes is met by a straight beam.
    fn find_least(&mut self, numbers: &Numbers, ways: &[Way], person: usize, outages: &Outages, step: usize) {
        let samples = outages.samples();
        let of_step = ways.len() * samples;
        self.least_s.clear();
        self.least_s.resize(samples, f32::MAX);
        let next_s = &self.value_s[(step + 1) * of_step..(step + 2) * of_step];
        let straight = |(_, way): &(&[f32], &Way)| !way.serving.is_reflected;
        for (of_way, way) in next_s.chunks_exact(samples).zip(ways).filter(straight) {
            let out = outages.of(way.index, person, step);
            for (k, (least_s, way_s)) in self.least_s.iter_mut().zip(of_way).enumerate() {
                *least_s = least_s.min(way_s + if has(out, k) { numbers.rest_s } else { 0.0 });
            }
        }
    }
}

impl Numbers {
    /// The chance that a change that begins now does not come about: a prepared device needs no command.
    #[inline(always)]
    fn lost(&self, out: bool, soon: bool) -> f32 {
        if self.conditional { 0.0 } else { self.lost_command(out, soon) }
    }

    /// The chance that a command does not arrive: a link that is out hears none.
    #[inline(always)]
    fn lost_command(&self, out: bool, soon: bool) -> f32 {
        match (out, soon) {
            (false, false) => 0.0,
            (true, _) => 1.0,
            (false, true) => self.lost,
        }
    }

    /// What a step costs in which a beam is pointed elsewhere: by a command, or by the device once its beam has failed.
    #[inline(always)]
    fn pointed_s(&self, out: bool, soon: bool, other_out: bool) -> f32 {
        let rest_s = if other_out { STEP_S as f32 - self.beam_s } else { 0.0 };
        self.beam_s + rest_s + self.lost_command(out, soon) * RECOVERS_S
    }
}

/// Whether a sample's bit is set; in no words none is.
#[inline(always)]
fn has(words: &[u32], sample: usize) -> bool {
    words.get(sample / WORD).is_some_and(|word| word >> (sample % WORD) & 1 == 1)
}
