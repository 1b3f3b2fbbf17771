//! What the pipeline says of a scene, frame by frame, kept so that many policies are judged by the same forecasts.

use umbracast::geometry::DVec2;
use umbracast::radio::{Loss, Outages};
use umbracast::{Outcome, Pipeline};

use crate::truth::Traces;

/// A track is a person's where it is no farther from him.
const SAME_M: f64 = 0.5;

/// What one frame says.
#[derive(Debug, Clone)]
pub struct Foreseen {
    /// The frame's instant.
    pub time_ns: i64,
    /// Samples of everybody confirmed.
    pub outages: Outages,
    /// As the pipeline gave them.
    pub losses: Vec<Loss>,
    /// By person of the truth: the place among those confirmed; `None` where nobody is followed there.
    pub index_of: Vec<Option<usize>>,
    /// By place among those confirmed.
    pub tracks: Vec<u64>,
}

impl Foreseen {
    /// Of an outcome; devices are bound to the tracks that are nearest to their people.
    pub fn new(outcome: &Outcome, pipeline: &Pipeline, traces: &Traces) -> Self {
        let confirmed: Vec<(u64, DVec2)> =
            outcome.tracks.iter().filter(|t| t.confirmed).map(|t| (t.id, t.position_m)).collect();
        let tick = ((outcome.time_ns / crate::truth::TICK_NS) as usize).min(traces.ticks - 1);
        let nearest = |person: usize| {
            let place_m = traces.place_m(tick, person);
            let by_distance = confirmed.iter().enumerate().map(|(i, (_, at_m))| (i, at_m.distance(place_m)));
            by_distance.filter(|(_, m)| *m <= SAME_M).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
        };
        Self {
            time_ns: outcome.time_ns,
            outages: pipeline.outages().clone(),
            losses: outcome.losses.clone(),
            index_of: (0..traces.people).map(nearest).collect(),
            tracks: confirmed.iter().map(|(id, _)| *id).collect(),
        }
    }

    /// The loss of a link.
    pub fn loss(&self, access_point: usize, index: usize) -> Option<&Loss> {
        let track = self.tracks.get(index)?;
        self.losses.iter().find(|loss| loss.access_point == access_point && loss.track == *track)
    }
}
