//! Some seconds of the kept scene as one animated SVG (SMIL), which plays wherever a picture is shown. People walk
//! their true paths, and each link is coloured by its true state and by the prediction.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use umbracast::STEPS;
use umbracast_io::rows::{LinkRow, TrackRow};

use super::animation_svg::{Canvas, LinkState, Walker};
use super::context::Kept;
use super::floor;
use crate::score::matching::match_scene;
use crate::score::scene::{Matching, TruthIndex};

/// No longer is shown, seconds.
const LONGEST_S: f64 = 10.0;
/// A code-hosting page shows no picture that is much larger, bytes.
const BYTES_MAX: usize = 300_000;
/// Between two places of a person, seconds; the player draws a straight line between them. The second is for crowds.
const STEPS_S: [f64; 3] = [0.2, 0.4, 0.8];

/// The animation, or `None` where the scene holds nobody, or too many for one picture.
pub fn svg(kept: &Kept) -> Option<String> {
    let stage = Stage::new(kept);
    let (start_s, end_s) = stage.stretch()?;
    let all = kept.site.access_points.len();
    let tries = STEPS_S.iter().flat_map(|&step_s| [all, all.min(1)].map(|shown| (step_s, shown)));
    tries
        .map(|(step_s, shown)| {
            let walkers = stage.walkers(start_s, end_s, step_s, shown);
            drawn(kept, &walkers, (start_s, end_s))
        })
        .find(|svg| svg.len() < BYTES_MAX)
}

fn drawn(kept: &Kept, walkers: &[Walker], (start_s, end_s): (f64, f64)) -> String {
    let places = walkers.iter().flat_map(|walker| walker.places_m.iter().copied().flatten());
    let canvas = Canvas::new(kept.site, floor::window(kept.site, places), end_s - start_s);
    let about = format!("{}, {start_s:.1} to {end_s:.1} s, mode {}", kept.label, kept.mode.name());
    let mut svg = canvas.opened(&about);
    svg += &canvas.hall();
    svg += &canvas.moving(walkers);
    svg += &canvas.fixtures();
    // Writing to a String cannot fail.
    let _ = writeln!(svg, "{}</svg>", canvas.legend());
    svg
}

/// The scene laid out for looking things up.
struct Stage<'a> {
    index: TruthIndex<'a>,
    matching: Matching,
    tracks: BTreeMap<(u64, u64), &'a TrackRow>,
    links: BTreeMap<(u64, u32, u64), &'a LinkRow>,
    /// Every frame and its time, seconds.
    times: Vec<(u64, f64)>,
    access_points: u32,
}

impl<'a> Stage<'a> {
    fn new(kept: &Kept<'a>) -> Self {
        let times: BTreeMap<u64, f64> =
            kept.truth.people.iter().map(|row| (row.frame, row.time_ns as f64 / 1e9)).collect();
        Self {
            index: TruthIndex::new(kept.truth),
            matching: match_scene(&kept.truth.people, &kept.run.tracks),
            tracks: kept.run.tracks.iter().map(|row| ((row.frame, row.track), row)).collect(),
            links: kept.run.links.iter().map(|row| ((row.frame, row.access_point, row.track), row)).collect(),
            times: times.into_iter().collect(),
            access_points: kept.site.access_points.len() as u32,
        }
    }

    fn state(&self, frame: u64, person: u32, access_point: u32) -> LinkState {
        let Some(row) = self.index.person(frame, person).filter(|row| !row.arrived) else {
            return LinkState::Hidden;
        };
        let Some(truth) = self.index.link(frame, row.person, access_point).filter(|l| !l.static_blocked)
        else {
            return LinkState::Hidden;
        };
        if truth.blocked {
            return LinkState::Blocked;
        }
        let track = self.matching.get(&(frame, person));
        let said = track.and_then(|&track| self.links.get(&(frame, access_point, track)));
        match said.is_some_and(|link| link.blocked[STEPS - 1]) {
            true => LinkState::Predicted,
            false => LinkState::InSight,
        }
    }

    /// From, to, seconds: the stretch in which the most is predicted.
    fn stretch(&self) -> Option<(f64, f64)> {
        let predicted = |&(frame, time_s): &(u64, f64)| {
            let links = self.index.persons.iter().flat_map(|&p| (0..self.access_points).map(move |a| (p, a)));
            (time_s, links.filter(|&(p, a)| self.state(frame, p, a) == LinkState::Predicted).count())
        };
        let counts: Vec<(f64, usize)> = self.times.iter().map(predicted).collect();
        let last_s = counts.last()?.0;
        let of = |start_s: f64| -> usize {
            let within = counts.iter().filter(|(t, _)| (start_s..=start_s + LONGEST_S).contains(t));
            within.map(|(_, count)| count).sum()
        };
        let first_s = counts[0].0;
        let starts = counts.iter().map(|&(t, _)| t).filter(|&t| t == first_s || t + LONGEST_S <= last_s);
        // The last of equals is what `max_by_key` would take; the first is wanted.
        let start_s = starts.rev().max_by_key(|&t| of(t))?;
        (last_s > first_s).then_some((start_s, last_s.min(start_s + LONGEST_S)))
    }

    fn walkers(&self, start_s: f64, end_s: f64, step_s: f64, access_points: usize) -> Vec<Walker> {
        let steps = ((end_s - start_s) / step_s).ceil().max(1.0);
        let instants: Vec<f64> =
            (0..=steps as usize).map(|i| start_s + (end_s - start_s) * i as f64 / steps).collect();
        let shown: Vec<(u64, f64)> =
            self.times.iter().copied().filter(|(_, t)| (start_s..=end_s).contains(t)).collect();
        let walker = |&person: &u32| {
            let places_m: Vec<_> = instants.iter().map(|&t| self.place(person, t)).collect();
            let states = |access_point: usize| {
                let mut states: Vec<(f64, LinkState)> = Vec::new();
                for &(frame, time_s) in &shown {
                    let state = self.state(frame, person, access_point as u32);
                    if states.last().is_none_or(|&(_, last)| last != state) {
                        states.push((time_s - start_s, state));
                    }
                }
                states
            };
            places_m.iter().any(Option::is_some).then(|| Walker {
                ways_m: instants.iter().map(|&t| self.way(person, t)).collect(),
                links: (0..access_points).map(states).collect(),
                places_m,
            })
        };
        self.index.persons.iter().filter_map(walker).collect()
    }

    /// The last frame at or before this time, and the first after it.
    fn around(&self, time_s: f64) -> [Option<(u64, f64)>; 2] {
        let after = self.times.partition_point(|&(_, t)| t <= time_s + 1e-6);
        [after.checked_sub(1).map(|i| self.times[i]), self.times.get(after).copied()]
    }

    /// On the straight line between the two frames around.
    fn place(&self, person: u32, time_s: f64) -> Option<(f64, f64)> {
        let [before, after] = self.around(time_s);
        let (frame, before_s) = before?;
        let row = self.index.person(frame, person)?;
        let next = after.and_then(|(frame, t)| Some((self.index.person(frame, person)?, t)));
        let Some((next, after_s)) = next else { return Some((row.x_m, row.y_m)) };
        let share = (time_s - before_s) / (after_s - before_s);
        Some((row.x_m + (next.x_m - row.x_m) * share, row.y_m + (next.y_m - row.y_m) * share))
    }

    fn way(&self, person: u32, time_s: f64) -> (f64, f64) {
        let track = self.around(time_s)[0]
            .and_then(|(frame, _)| self.tracks.get(&(frame, *self.matching.get(&(frame, person))?)));
        track.map_or((0.0, 0.0), |track| {
            let end = track.steps[STEPS - 1];
            (end[0] - track.x_m, end[1] - track.y_m)
        })
    }
}
