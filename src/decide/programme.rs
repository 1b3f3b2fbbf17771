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
use crate::radio::Outages;
use crate::site::Costs;

/// Expected costs, seconds in outage.
#[derive(Debug, Clone, Default)]
pub(super) struct Values {
    /// Of staying now.
    pub(super) stay_s: f64,
    /// Of changing now, by access point.
    pub(super) changed_s: Vec<(usize, f64)>,
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
}

impl Programme {
    pub(super) fn run(
        &mut self,
        costs: &Costs,
        ways: &[usize],
        serving: usize,
        person: usize,
        outages: &Outages,
    ) -> Values {
        let numbers = Numbers {
            conditional: costs.conditional,
            lost: ((costs.age_s + costs.command_s) / STEP_S).min(1.0) as f32,
            change_s: (costs.interruption_s + costs.price_s) as f32,
            rest_s: (STEP_S - costs.interruption_s).max(0.0) as f32,
            given_up_s: (costs.given_up_after_s + costs.recovery_s + costs.price_s) as f32,
        };
        let samples = outages.samples();
        let of_step = ways.len() * samples;
        self.value_s.clear();
        self.value_s.resize((MOMENTS + 1) * of_step, 0.0);
        let after_s = self.value_s[MOMENTS * of_step..].chunks_exact_mut(samples);
        for (after_s, &ap) in after_s.zip(ways) {
            let soon = outages.beyond(ap, person);
            let cut = (0..samples).filter(|k| has(soon, *k));
            cut.for_each(|k| after_s[k] = numbers.change_s);
        }
        for step in (0..MOMENTS).rev() {
            self.find_least(&numbers, ways, person, outages, step);
            let (here_s, next_s) = self.value_s[step * of_step..].split_at_mut(of_step);
            for (way, &ap) in ways.iter().enumerate() {
                let out = outages.of(ap, person, step);
                let soon = if step + 1 < MOMENTS { outages.of(ap, person, step + 1) } else { &[] };
                let row = way * samples..(way + 1) * samples;
                let (next_s, here_s) = (&next_s[row.clone()], &mut here_s[row]);
                for k in 0..samples {
                    let stayed_s = if has(out, k) {
                        (STEP_S as f32 + next_s[k]).min(numbers.given_up_s + self.least_s[k])
                    } else {
                        next_s[k]
                    };
                    let lost = numbers.lost(has(out, k), has(soon, k));
                    let changed_s = numbers.change_s + self.least_s[k];
                    here_s[k] = stayed_s.min(changed_s + lost * (stayed_s - changed_s).max(0.0));
                }
            }
        }
        self.weigh(&numbers, ways, serving, person, outages)
    }

    /// Of what is done now, over all samples.
    fn weigh(
        &mut self,
        numbers: &Numbers,
        ways: &[usize],
        serving: usize,
        person: usize,
        outages: &Outages,
    ) -> Values {
        let samples = outages.samples();
        let of_step = ways.len() * samples;
        self.find_least(numbers, ways, person, outages, 0);
        let own = ways.iter().position(|ap| *ap == serving).unwrap_or_default();
        let value_s = |step: usize, way: usize, k: usize| self.value_s[step * of_step + way * samples + k];
        let (out, soon) = (outages.of(serving, person, 0), outages.of(serving, person, 1));
        let mut changed_s = vec![0.0_f64; ways.len()];
        let mut later_s = vec![0.0_f64; ways.len()];
        let (mut stay, mut held, mut given_up, mut later) = (0.0, 0.0, 0.0, 0);
        for k in 0..samples {
            let stayed_s = value_s(1, own, k) + if has(out, k) { STEP_S as f32 } else { 0.0 };
            let given_up_s = numbers.given_up_s + self.least_s[k];
            held += f64::from(stayed_s);
            given_up += f64::from(given_up_s);
            // A prepared change may follow within the step.
            stay +=
                f64::from(if numbers.conditional { value_s(0, own, k) } else { stayed_s.min(given_up_s) });
            let lost = numbers.lost(has(out, k), has(soon, k)) * f32::from(u8::from(!numbers.conditional));
            for (way, sum) in changed_s.iter_mut().enumerate() {
                let rest_s = if has(outages.of(ways[way], person, 0), k) { numbers.rest_s } else { 0.0 };
                let changed_s = numbers.change_s + rest_s + value_s(1, way, k);
                *sum += f64::from(changed_s + lost * (stayed_s - changed_s));
            }
            let onset = (0..MOMENTS).find(|&step| has(outages.of(serving, person, step), k));
            let Some(onset) = onset else { continue };
            let least_s = (0..ways.len()).map(|way| value_s(onset, way, k)).fold(f32::MAX, f32::min);
            if numbers.change_s + least_s < value_s(onset + 1, own, k) + STEP_S as f32 {
                later += 1;
                later_s
                    .iter_mut()
                    .enumerate()
                    .for_each(|(way, sum)| *sum += f64::from(value_s(onset, way, k)));
            }
        }
        let mean = |sum: f64| sum / samples as f64;
        let others = || (0..ways.len()).filter(|way| *way != own);
        let best_later = others().min_by(|a, b| later_s[*a].total_cmp(&later_s[*b])).filter(|_| later > 0);
        Values {
            stay_s: mean(stay),
            changed_s: others().map(|way| (ways[way], mean(changed_s[way]))).collect(),
            held_s: mean(held),
            given_up_s: mean(given_up),
            later: best_later.map(|way| (ways[way], mean(f64::from(later)))),
        }
    }

    /// By sample, what is left after a change at `step` to the best way.
    fn find_least(
        &mut self,
        numbers: &Numbers,
        ways: &[usize],
        person: usize,
        outages: &Outages,
        step: usize,
    ) {
        let samples = outages.samples();
        let of_step = ways.len() * samples;
        self.least_s.clear();
        self.least_s.resize(samples, f32::MAX);
        let next_s = &self.value_s[(step + 1) * of_step..(step + 2) * of_step];
        for (of_way, &ap) in next_s.chunks_exact(samples).zip(ways) {
            let out = outages.of(ap, person, step);
            for (k, (least_s, way_s)) in self.least_s.iter_mut().zip(of_way).enumerate() {
                *least_s = least_s.min(way_s + if has(out, k) { numbers.rest_s } else { 0.0 });
            }
        }
    }
}

impl Numbers {
    /// The chance that a change that begins now does not come about. A link that is out hears no command; a prepared device
    /// needs none.
    #[inline(always)]
    fn lost(&self, out: bool, soon: bool) -> f32 {
        match (self.conditional, out, soon) {
            (true, ..) | (_, false, false) => 0.0,
            (_, true, _) => 1.0,
            (_, false, true) => self.lost,
        }
    }
}

/// Whether a sample's bit is set; in no words none is.
#[inline(always)]
fn has(words: &[u32], sample: usize) -> bool {
    words.get(sample / WORD).is_some_and(|word| word >> (sample % WORD) & 1 == 1)
}
