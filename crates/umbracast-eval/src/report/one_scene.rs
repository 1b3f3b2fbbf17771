//! The figures that show one scene: an instant from above, and one link over time.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use umbracast::{Error, Site};
use umbracast_io::rows::{LinkRow, TrackRow};

use super::context::Kept;
use super::figure::{BLACK, BLUE, Figure, GOLD, GREY, LIGHT, PURPLE, RED, Sizes, YELLOW, axes, series};
use super::floor::{self, Window};
use super::plot::{Mark, Panel};
use crate::score::instances::instances;
use crate::score::matching::match_scene;
use crate::score::scene::TruthIndex;

/// Width of a figure, pixels.
const WIDTH: f64 = 860.0;
/// What the legend and the labels of the axes take below a figure, pixels.
const LEGEND: f64 = 110.0;

/// The instant of the kept scene at which the most links are about to be blocked.
fn busiest_frame(kept: &Kept) -> Option<u64> {
    let index = TruthIndex::new(kept.truth);
    let mut about_to: BTreeMap<u64, usize> = BTreeMap::new();
    for i in instances(&index).iter().filter(|i| i.access_point == 0) {
        *about_to.entry(i.frame).or_default() += usize::from(!i.blocked_now && i.first_blocked.is_some());
    }
    about_to.into_iter().max_by_key(|&(frame, count)| (count, Reverse(frame))).map(|(frame, _)| frame)
}

/// The hall from above with everybody in it, forecasts and links.
pub fn plan(kept: &Kept) -> Result<Option<Figure>, Error> {
    let Some(frame) = busiest_frame(kept) else { return Ok(None) };
    let site = kept.site;
    let hung = floor::access_points(site);
    let tracks: Vec<&TrackRow> = kept.run.tracks.iter().filter(|t| t.frame == frame && t.confirmed).collect();
    let links: Vec<&LinkRow> = kept.run.links.iter().filter(|link| link.frame == frame).collect();
    let people: Vec<(f64, f64)> =
        kept.truth.people.iter().filter(|p| p.frame == frame).map(|p| (p.x_m, p.y_m)).collect();
    let mut panel = hall(site, floor::window(site, people.iter().copied()));
    // What matters most is drawn last.
    let kinds = [
        ("in sight", GREY, Mark::Line(0.7)),
        ("predicted blocked within 0.9 s", GOLD, Mark::Dashed(2.2)),
        ("blocked now", RED, Mark::Line(2.8)),
    ];
    for (kind, (_, color, mark)) in kinds.iter().enumerate() {
        for link in links.iter().filter(|link| kind_of(link) == kind) {
            let track = tracks.iter().find(|track| track.track == link.track);
            let ends = track.zip(hung.get(link.access_point as usize));
            panel.series.extend(ends.map(|(t, &at)| series("", color, *mark, vec![at, (t.x_m, t.y_m)])));
        }
    }
    for track in &tracks {
        let mut path = vec![(track.x_m, track.y_m)];
        path.extend(track.steps.iter().map(|step| (step[0], step[1])));
        panel.series.push(series("", BLUE, Mark::Line(2.4), path));
    }
    // For the legend alone: each link and each forecast is a series of its own.
    for (name, color, mark) in kinds.into_iter().chain([("forecast of 0.9 s", BLUE, Mark::Line(2.4))]) {
        panel.series.push(series(name, color, mark, Vec::new()));
    }
    let seen = tracks.iter().map(|t| (t.x_m, t.y_m)).collect();
    panel.series.push(series("person (truth)", LIGHT, Mark::Discs(5.5), people));
    panel.series.push(series("track", BLUE, Mark::Discs(2.6), seen));
    panel.series.push(series("LiDAR", BLACK, Mark::Squares(5.0), floor::sensors(site)));
    // As in the animation: yellow with a dark edge.
    panel.series.push(series("", BLACK, Mark::Diamonds(9.0), hung.clone()));
    panel.series.push(series("access point", YELLOW, Mark::Diamonds(7.0), hung.clone()));
    let height_m = panel.y.1 - panel.y.0;
    for (access_point, (x, y)) in site.access_points.iter().zip(hung) {
        panel.notes.push((x, y - 0.05 * height_m, access_point.name.clone()));
    }
    let shape = height_m / (panel.x.1 - panel.x.0);
    let size = |width: f64, below: f64| (width, (width * shape).clamp(0.4 * width, 1.2 * width) + below);
    let time_s = kept.truth.people.iter().find(|p| p.frame == frame).map_or(0.0, |p| p.time_ns as f64 / 1e9);
    let title = format!("From above at {time_s:.1} s: {}", kept.label);
    let caption = format!(
        "All links of all tracks, coloured by the prediction of mode {} at this instant.",
        kept.mode.name()
    );
    let sizes =
        Sizes { alone: size(WIDTH, LEGEND), page: size(560.0, 60.0), narrow: Some(size(400.0, 60.0)) };
    Figure::of("plan", (title, caption), &[panel], sizes).map(Some)
}

/// Which of the plan's three kinds a link is.
fn kind_of(link: &LinkRow) -> usize {
    if link.is_blocked() { 2 } else { usize::from(link.is_warned_of()) }
}

/// Walls, pillars, furniture and a bar for the scale.
fn hall(site: &Site, (x, y): Window) -> Panel {
    let mut panel = axes("y, m", "x, m", y);
    (panel.x, panel.equal_axes, panel.y_digits) = (x, true, 0);
    let step_m = floor::scale_bar_m((x, y));
    (panel.x_step, panel.y_step) = (Some(step_m), Some(step_m));
    panel.series.push(series("", BLACK, Mark::Line(1.8), floor::walls(site)));
    panel.series.extend(floor::standing(site).into_iter().map(|o| series("", GREY, Mark::Line(1.4), o)));
    let (left, bottom) = (x.0 + 0.05 * (x.1 - x.0), y.0 + 0.05 * (y.1 - y.0));
    let bar = vec![(left, bottom), (left + step_m, bottom)];
    panel.series.push(series("", BLACK, Mark::Line(4.0), bar));
    panel.notes.push((left + 0.5 * step_m, bottom + 0.02 * (y.1 - y.0), format!("{step_m} m")));
    panel
}

/// One link over time.
pub fn link(kept: &Kept) -> Result<Option<Figure>, Error> {
    let index = TruthIndex::new(kept.truth);
    let all = instances(&index);
    let onsets = |person: u32| {
        let own = all.iter().filter(|i| i.access_point == 0 && i.person == person);
        own.filter(|i| !i.blocked_now && i.first_blocked == Some(1)).count()
    };
    let busiest = index.persons.iter().copied().max_by_key(|&p| (onsets(p), Reverse(p)));
    let Some(person) = busiest else { return Ok(None) };
    let matching = match_scene(&kept.truth.people, &kept.run.tracks);
    let said = |frame: u64| {
        let track = matching.get(&(frame, person))?;
        let own = |link: &&LinkRow| link.frame == frame && link.access_point == 0 && link.track == *track;
        kept.run.links.iter().find(own)
    };
    let mut panel = axes("probability", "time, s", (0.0, 1.0));
    let times: Vec<(u64, f64)> = index
        .frames
        .iter()
        .filter_map(|&frame| Some((frame, index.person(frame, person)?.time_ns as f64 / 1e9)))
        .collect();
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Ok(None) };
    let step_s = if last.1 - first.1 > 16.0 { 5.0 } else { 2.0 };
    (panel.x, panel.x_step, panel.y) = ((first.1.floor(), last.1.ceil()), Some(step_s), (0.0, 1.1));
    panel.y_step = Some(0.25);
    panel.y_digits = 2;
    for &(frame, time_s) in &times {
        if index.link(frame, person, 0).is_some_and(|link| link.blocked) {
            panel.shaded.push((time_s - 0.05, time_s + 0.05, RED));
        }
    }
    panel.shaded = joined(&panel.shaded);
    panel.series.push(series("blocked (truth)", RED, Mark::Patch, Vec::new()));
    for (w, color, width) in [(3, BLUE, 2.2), (9, PURPLE, 1.4)] {
        let points: Vec<(f64, f64)> =
            times.iter().filter_map(|&(frame, time_s)| Some((time_s, said(frame)?.p[w - 1]))).collect();
        let name = format!("probability: blocked within {} ms", w * 100);
        panel.series.push(series(name, color, Mark::Line(width), points));
    }
    let warned = times
        .iter()
        .filter(|&&(frame, _)| said(frame).is_some_and(|link| link.blocked[2]))
        .map(|&(_, time_s)| (time_s, 1.06))
        .collect();
    panel.series.push(series("predicted: blocked within 300 ms", BLACK, Mark::Squares(2.6), warned));
    let access_point = kept.site.access_points.first().map_or("", |ap| &ap.name);
    let title = format!("One link over time: {access_point} to person {person}, {}", kept.label);
    let caption = format!(
        "Mode {}. Shaded: another body blocks the link in truth. A prediction (marks on top) is right if that \
         happens within its window.",
        kept.mode.name()
    );
    let sizes = Sizes { alone: (WIDTH, 360.0), page: (1100.0, 300.0), narrow: Some((400.0, 260.0)) };
    let mut figure = Figure::of("link", (title, caption), &[panel], sizes)?;
    figure.whole_width = true;
    Ok(Some(figure))
}

/// Neighbouring stretches as one.
fn joined(stretches: &[(f64, f64, &'static str)]) -> Vec<(f64, f64, &'static str)> {
    let mut joined: Vec<(f64, f64, &'static str)> = Vec::new();
    for &(from, to, color) in stretches {
        match joined.last_mut() {
            Some(last) if from - last.1 < 1e-6 => last.1 = to,
            _ => joined.push((from, to, color)),
        }
    }
    joined
}
