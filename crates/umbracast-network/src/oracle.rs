//! What the best could be: who knows the whole trace, and who has every access point at once.

use crate::device::{Network, Tally};
use crate::truth::{TICK_S, Traces};

/// The least of time in outage and price of changes over the whole trace, by a backward programme over instants. A change takes
/// its interruption, no command is lost, and nothing is ever given up.
pub fn oracle(network: &Network, traces: &Traces, person: usize, begin: usize) -> Tally {
    let ways: Vec<usize> = network.ways().collect();
    let ticks = traces.ticks - begin;
    let change_ticks = ((network.costs.interruption_s / TICK_S).round() as usize).max(1);
    let change = change_ticks as f64 + network.costs.price_s / TICK_S;
    let out = |tick: usize, way: usize| network.is_out(traces, begin + tick, ways[way], person);
    // By instant and way: the cost from there on.
    let mut value = vec![vec![0.0; ways.len()]; ticks + 1];
    let least_at =
        |value: &[Vec<f64>], tick: usize| value[tick.min(ticks)].iter().fold(f64::MAX, |a, b| a.min(*b));
    for tick in (0..ticks).rev() {
        let changed = change + least_at(&value, tick + change_ticks);
        for way in 0..ways.len() {
            let stayed = f64::from(u8::from(out(tick, way))) + value[tick + 1][way];
            value[tick][way] = stayed.min(changed);
        }
    }
    let mut tally = Tally { ticks, ..Tally::default() };
    let first = network.strongest(traces, begin, person);
    let mut way = ways.iter().position(|ap| *ap == first).unwrap_or_default();
    let mut tick = 0;
    while tick < ticks {
        let stayed = f64::from(u8::from(out(tick, way))) + value[tick + 1][way];
        let changed = change + least_at(&value, tick + change_ticks);
        if stayed <= changed + 1e-9 {
            tally.out_ticks += usize::from(out(tick, way));
            tick += 1;
            continue;
        }
        let to = (tick + change_ticks).min(ticks);
        way = (0..ways.len()).min_by(|a, b| value[to][*a].total_cmp(&value[to][*b])).unwrap_or_default();
        tally.handovers += 1;
        tally.out_ticks += to - tick;
        tick = to;
    }
    tally
}

/// Every access point at once: in outage only where all links are out.
pub fn best_of_all(network: &Network, traces: &Traces, person: usize, begin: usize) -> Tally {
    let all_out = |tick: &usize| network.ways().all(|ap| network.is_out(traces, *tick, ap, person));
    let ticks = traces.ticks - begin;
    Tally { ticks, out_ticks: (begin..traces.ticks).filter(all_out).count(), ..Tally::default() }
}
