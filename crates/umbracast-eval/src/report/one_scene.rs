//! The figures that show one scene: an instant from above, and one link over time.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use umbracast::{Error, STEPS, Site};
use umbracast_io::rows::{LinkRow, TrackRow};

use super::Kept;
use super::figures::{BLACK, BLUE, Figure, GOLD, GREY, LIGHT, PURPLE, RED, axes, series};
use super::plot::{Mark, Panel, draw};
use crate::instances::instances;
use crate::matching::match_scene;
use crate::scene::TruthIndex;

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

/// Everybody from above, with forecasts and rays.
pub fn plan(kept: &Kept) -> Result<Option<Figure>, Error> {
    let Some(frame) = busiest_frame(kept) else { return Ok(None) };
    let site = kept.site;
    let Some(access_point) = site.access_points.first() else { return Ok(None) };
    let at = (access_point.position_m[0], access_point.position_m[1]);
    let tracks: Vec<&TrackRow> = kept.run.tracks.iter().filter(|t| t.frame == frame && t.confirmed).collect();
    let links: Vec<&LinkRow> =
        kept.run.links.iter().filter(|link| link.frame == frame && link.access_point == 0).collect();
    let people: Vec<(f64, f64)> =
        kept.truth.people.iter().filter(|p| p.frame == frame).map(|p| (p.x_m, p.y_m)).collect();
    let mut panel = hall(site, around(&people, at));
    for track in &tracks {
        let link = links.iter().find(|link| link.track == track.track);
        let color = match link {
            Some(link) if link.blocked_now => RED,
            Some(link) if link.blocked[STEPS - 1] => GOLD,
            _ => LIGHT,
        };
        panel.series.push(series("", color, Mark::Line(1.4), vec![at, (track.x_m, track.y_m)]));
    }
    for track in &tracks {
        let mut path = vec![(track.x_m, track.y_m)];
        path.extend(track.steps.iter().map(|step| (step[0], step[1])));
        panel.series.push(series("", BLUE, Mark::Line(2.0), path));
    }
    panel.series.push(series("person (truth)", GREY, Mark::Discs(5.5), people));
    let seen = tracks.iter().map(|t| (t.x_m, t.y_m)).collect();
    panel.series.push(series("track, line: the next 0.9 s", BLUE, Mark::Discs(2.8), seen));
    panel.series.push(series(
        format!("access point {}", access_point.name),
        RED,
        Mark::Diamonds(6.0),
        vec![at],
    ));
    // For the legend alone: each ray is a series of its own.
    for (name, color) in [("blocked now", RED), ("blocked within 0.9 s", GOLD), ("in sight", LIGHT)] {
        panel.series.push(series(name, color, Mark::Line(1.4), vec![at, at]));
    }
    let (width_m, height_m) = (panel.x.1 - panel.x.0, panel.y.1 - panel.y.0);
    let height = (WIDTH * height_m / width_m).clamp(260.0, 860.0) + LEGEND;
    let time_s = kept.truth.people.iter().find(|p| p.frame == frame).map_or(0.0, |p| p.time_ns as f64 / 1e9);
    Ok(Some(Figure {
        name: "plan",
        title: format!("One instant from above: {}, {time_s:.1} s", kept.label),
        caption: format!(
            "Mode {}. Rays run from the access point to every person who is followed and are coloured by what is \
             said of the link.",
            kept.mode.name()
        ),
        drawing: draw("plan", &panel, (WIDTH, height))?,
    }))
}

/// From, to, along x and along y.
type Window = ((f64, f64), (f64, f64));

/// A window that holds everybody and the access point, in whole metres with some room.
fn around(people: &[(f64, f64)], at: (f64, f64)) -> Window {
    let all = || people.iter().copied().chain([at]);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        ((low - 1.0).floor(), (high + 1.0).ceil())
    };
    (range(&mut all().map(|p| p.0)), range(&mut all().map(|p| p.1)))
}

/// Walls, pillars, furniture and sensors from above, those that lie in the window.
fn hall(site: &Site, (x, y): Window) -> Panel {
    let mut panel = axes("y, m", "x, m", y);
    (panel.x, panel.equal_axes, panel.y_digits) = (x, true, 0);
    (panel.x_step, panel.y_step) = (Some(2.0), Some(2.0));
    let sides = |corners: [(f64, f64); 4]| vec![corners[0], corners[1], corners[2], corners[3], corners[0]];
    let (wall_x, wall_y) = (site.hall.length_m / 2.0, site.hall.width_m / 2.0);
    let walls = sides([(-wall_x, -wall_y), (wall_x, -wall_y), (wall_x, wall_y), (-wall_x, wall_y)]);
    panel.series.push(series("", GREY, Mark::Line(1.5), walls));
    for pillar in &site.pillars {
        let round = (0..=24).map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 24.0).sin_cos();
            (pillar.position_m[0] + pillar.radius_m * cos, pillar.position_m[1] + pillar.radius_m * sin)
        });
        panel.series.push(series("", GREY, Mark::Line(1.2), round.collect()));
    }
    for piece in &site.furniture {
        let (sin, cos) = piece.yaw_deg.to_radians().sin_cos();
        let corner = |along: f64, across: f64| {
            let (u, v) = (along * piece.size_m[0] / 2.0, across * piece.size_m[1] / 2.0);
            (piece.position_m[0] + u * cos - v * sin, piece.position_m[1] + u * sin + v * cos)
        };
        let outline = sides([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
        panel.series.push(series("", GREY, Mark::Line(1.2), outline));
    }
    for sensor in &site.sensors {
        let place = vec![(sensor.position_m[0], sensor.position_m[1])];
        panel.series.push(series("LiDAR", BLACK, Mark::Squares(5.0), place));
    }
    let inside = |p: &(f64, f64)| (x.0..=x.1).contains(&p.0) && (y.0..=y.1).contains(&p.1);
    panel.series.retain(|shape| shape.points.iter().all(inside));
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
    (panel.x, panel.x_step, panel.y) = ((first.1.floor(), last.1.ceil()), Some(2.0), (0.0, 1.1));
    panel.y_step = Some(0.25);
    panel.y_digits = 2;
    for &(frame, time_s) in &times {
        if index.link(frame, person, 0).is_some_and(|link| link.blocked) {
            panel.shaded.push((time_s - 0.05, time_s + 0.05, RED));
        }
    }
    panel.shaded = joined(&panel.shaded);
    // For the legend alone: the stretches stand behind the axes.
    panel.series.push(series("truly blocked", RED, Mark::Line(6.0), vec![(first.1, -1.0); 2]));
    for (w, color) in [(3, BLUE), (9, PURPLE)] {
        let points: Vec<(f64, f64)> =
            times.iter().filter_map(|&(frame, time_s)| Some((time_s, said(frame)?.p[w - 1]))).collect();
        panel.series.push(series(format!("blocked within {} ms", w * 100), color, Mark::Line(1.8), points));
    }
    let warned = times
        .iter()
        .filter(|&&(frame, _)| said(frame).is_some_and(|link| link.blocked[2]))
        .map(|&(_, time_s)| (time_s, 1.06))
        .collect();
    panel.series.push(series("warning (300 ms)", BLUE, Mark::Squares(1.8), warned));
    let access_point = kept.site.access_points.first().map_or("", |ap| &ap.name);
    Ok(Some(Figure {
        name: "link",
        title: format!("One link over time: {access_point} to person {person}, {}", kept.label),
        caption: format!(
            "Mode {}. Red: the link is truly blocked. A warning is right when red follows within its window.",
            kept.mode.name()
        ),
        drawing: draw("link", &panel, (WIDTH, 360.0))?,
    }))
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
