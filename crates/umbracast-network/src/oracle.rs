//! What the best could be: who knows the whole trace, and who has every access point at once.

use crate::device::{Network, Tally};
use crate::truth::{TICK_S, Traces};

/// A way that may serve: an access point's, straight or by its best reflection.
#[derive(Clone, Copy)]
struct Way {
    access_point: usize,
    reflected: bool,
    /// The place of the access point's other way.
    twin: Option<usize>,
}

/// What is done at an instant.
enum Step {
    Stay,
    Change,
    Beam(usize),
}

/// The least of time in outage and price of changes over the whole trace, by a backward programme over instants. A change takes
/// its interruption, no command is lost, and nothing is ever given up. With `beams` reflections serve, too.
pub fn oracle(network: &Network, traces: &Traces, person: usize, begin: usize, beams: bool) -> Tally {
    let mut ways: Vec<Way> =
        network.ways().map(|access_point| Way { access_point, reflected: false, twin: None }).collect();
    let straight = ways.len();
    if beams {
        for twin in 0..straight {
            ways[twin].twin = Some(ways.len());
            ways.push(Way { reflected: true, twin: Some(twin), ..ways[twin] });
        }
    }
    let ticks = traces.ticks - begin;
    let change_ticks = ((network.costs.interruption_s / TICK_S).round() as usize).max(1);
    let change = change_ticks as f64 + network.costs.price_s / TICK_S;
    let beam = network.costs.beam_s / TICK_S;
    let out = |tick: usize, way: usize| {
        let Way { access_point, reflected, .. } = ways[way];
        network.is_way_out(traces, begin + tick, access_point, person, reflected)
    };
    // By instant and way: the cost from there on.
    let mut value = vec![vec![0.0; ways.len()]; ticks + 1];
    let least_at = |value: &[Vec<f64>], tick: usize| {
        value[tick.min(ticks)][..straight].iter().fold(f64::MAX, |a, b| a.min(*b))
    };
    let best = |value: &[Vec<f64>], tick: usize, way: usize| {
        let through = |way: usize| f64::from(u8::from(out(tick, way))) + value[tick + 1][way];
        let (stayed, changed) = (through(way), change + least_at(value, tick + change_ticks));
        let pointed = ways[way].twin.map(|twin| (beam + through(twin), twin));
        match pointed {
            Some((cost, twin)) if cost < stayed - 1e-9 && cost <= changed => (cost, Step::Beam(twin)),
            _ if stayed <= changed + 1e-9 => (stayed, Step::Stay),
            _ => (changed, Step::Change),
        }
    };
    for tick in (0..ticks).rev() {
        for way in 0..ways.len() {
            value[tick][way] = best(&value, tick, way).0;
        }
    }
    let mut tally = Tally { ticks, ..Tally::default() };
    let first = network.strongest(traces, begin, person);
    let mut way = ways.iter().position(|way| way.access_point == first).unwrap_or_default();
    let mut tick = 0;
    while tick < ticks {
        match best(&value, tick, way).1 {
            Step::Change => {
                let to = (tick + change_ticks).min(ticks);
                let cost = |way: &usize| value[to][*way];
                way = (0..straight).min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or_default();
                tally.handovers += 1;
                tally.out_ticks += to - tick;
                tick = to;
                continue;
            }
            Step::Beam(twin) => {
                way = twin;
                tally.point(&network.costs);
            }
            Step::Stay => {}
        }
        tally.out_ticks += usize::from(out(tick, way));
        tick += 1;
    }
    tally
}

/// Every access point at once: in outage only where all links are out.
pub fn best_of_all(network: &Network, traces: &Traces, person: usize, begin: usize) -> Tally {
    let all_out = |tick: &usize| network.ways().all(|ap| network.is_out(traces, *tick, ap, person));
    let ticks = traces.ticks - begin;
    Tally { ticks, out_ticks: (begin..traces.ticks).filter(all_out).count(), ..Tally::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::site::{Handover, Radio};

    #[test]
    fn who_knows_the_trace_points_a_beam_elsewhere_where_a_change_costs_more() {
        // The first access point fades for 400 ms and its reflection does not; the other is in sight all the time.
        let traces = Traces::by_hand(400, 2, |tick, ap| match ap {
            0 if (100..140).contains(&tick) => [25.0, 6.0],
            0 => [0.0, 6.0],
            _ => [1.0, f32::INFINITY],
        });
        let costs = Handover::default().costs();
        let network = Network { radios: vec![Some(Radio::default()); 2], costs, seed: 1 };
        let [without, with] = [false, true].map(|beams| oracle(&network, &traces, 0, 0, beams));
        assert_eq!((without.handovers, without.out_ticks), (1, 3));
        assert_eq!((with.handovers, with.beams, with.out_ms()), (0, 1, 3));
    }
}
