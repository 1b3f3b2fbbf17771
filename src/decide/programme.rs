//! The least expected cost of a device's next second, by a backward programme over steps and ways on the joint samples.
//!
//! What is decided now is decided for all samples alike, for nobody knows yet which of them will come true. What is decided
//! later is decided for each sample by itself: frames come every 100 ms and tell more, so a later decision knows its future far
//! better than one of now. This is hindsight optimisation (Chong, Givan and Chang 2000): it bounds the cost from below, and waits
//! where waiting costs nothing. Access points behind one person fail together, for their samples are the same.

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
    /// In which share of the samples a change comes later.
    pub(super) later: f64,
}

/// Its working memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Programme {
    /// By way and sample: the cost from the next step on.
    next_s: Vec<f32>,
    here_s: Vec<f32>,
    /// By sample: that of the best way.
    least_s: Vec<f32>,
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
        let samples = outages.samples();
        self.next_s.clear();
        self.next_s.resize(ways.len() * samples, 0.0);
        self.here_s.clone_from(&self.next_s);
        // A command that is under way when the link goes out is lost: the share of a step that it takes.
        let lost = ((costs.age_s + costs.command_s) / STEP_S).min(1.0) as f32;
        let change_s = (costs.interruption_s + costs.price_s) as f32;
        let given_up_s = (costs.given_up_after_s + costs.recovery_s + costs.price_s) as f32;
        for step in (1..MOMENTS).rev() {
            self.find_least(samples);
            for (way, &ap) in ways.iter().enumerate() {
                let out = outages.of(ap, person, step);
                let soon = if step + 1 < MOMENTS { outages.of(ap, person, step + 1) } else { &[] };
                let row = way * samples..(way + 1) * samples;
                let (next_s, here_s) = (&self.next_s[row.clone()], &mut self.here_s[row]);
                for k in 0..samples {
                    let least_s = self.least_s[k];
                    here_s[k] = if has(out, k) {
                        (STEP_S as f32 + next_s[k]).min(given_up_s + least_s)
                    } else {
                        let missed = if has(soon, k) { lost } else { 0.0 };
                        let changed_s = change_s + least_s + missed * (next_s[k] - least_s);
                        next_s[k].min(changed_s)
                    };
                }
            }
            std::mem::swap(&mut self.next_s, &mut self.here_s);
        }
        self.weigh(costs, ways, serving, person, outages, [lost, change_s, given_up_s])
    }

    /// Of what is done now, over all samples.
    fn weigh(
        &mut self,
        costs: &Costs,
        ways: &[usize],
        serving: usize,
        person: usize,
        outages: &Outages,
        [lost, change_s, given_up_s]: [f32; 3],
    ) -> Values {
        let samples = outages.samples();
        self.find_least(samples);
        let own = ways.iter().position(|ap| *ap == serving).unwrap_or_default();
        let own_s = &self.next_s[own * samples..(own + 1) * samples];
        let (out, soon) = (outages.of(serving, person, 0), outages.of(serving, person, 1));
        let mut values = Values::default();
        let mut sums = vec![0.0_f64; ways.len()];
        let (mut stay, mut held, mut given_up, mut later) = (0.0, 0.0, 0.0, 0);
        for k in 0..samples {
            let stay_s = own_s[k];
            let given_up_s = given_up_s + self.least_s[k];
            held += f64::from(stay_s);
            given_up += f64::from(given_up_s);
            stay += f64::from(if has(out, k) { stay_s.min(given_up_s) } else { stay_s });
            later += usize::from(stay_s > self.least_s[k] + 0.5 * STEP_S as f32);
            // A link that is out hears no command, where one is needed.
            let missed = match (has(out, k), has(soon, k)) {
                _ if costs.command_s == 0.0 => 0.0,
                (true, _) => 1.0,
                (false, true) => lost,
                (false, false) => 0.0,
            };
            for (way, sum) in sums.iter_mut().enumerate() {
                let changed_s = change_s + self.next_s[way * samples + k];
                *sum += f64::from(changed_s + missed * (stay_s - changed_s));
            }
        }
        let mean = |sum: f64| sum / samples as f64;
        (values.stay_s, values.held_s, values.given_up_s) = (mean(stay), mean(held), mean(given_up));
        values.later = later as f64 / samples as f64;
        let others = ways.iter().zip(sums).filter(|(ap, _)| **ap != serving);
        values.changed_s = others.map(|(ap, sum)| (*ap, mean(sum))).collect();
        values
    }

    fn find_least(&mut self, samples: usize) {
        self.least_s.clear();
        self.least_s.resize(samples, f32::MAX);
        for of_way in self.next_s.chunks_exact(samples) {
            for (least_s, way_s) in self.least_s.iter_mut().zip(of_way) {
                *least_s = least_s.min(*way_s);
            }
        }
    }
}

/// Whether a sample's bit is set; in no words none is.
#[inline(always)]
fn has(words: &[u32], sample: usize) -> bool {
    words.get(sample / WORD).is_some_and(|word| word >> (sample % WORD) & 1 == 1)
}
