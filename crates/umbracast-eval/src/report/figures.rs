//! Which figures there are, and what each shows.

use umbracast::{Error, Mode, STEPS};

use super::plot::{Drawing, Mark, Panel, Series, draw, draw_grid};
use super::{Kept, one_scene, published};
use crate::pooled::{Estimate, Group, Scores, WindowScores};
use crate::score::Predictor;

/// A figure with what a reader needs to understand it.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// File name without an ending.
    pub name: &'static str,
    /// One line above it.
    pub title: String,
    /// What is drawn and how to read it.
    pub caption: String,
    /// The picture.
    pub drawing: Drawing,
}

pub const BLUE: &str = "#0072b2";
pub const ORANGE: &str = "#d55e00";
pub const GREEN: &str = "#009e73";
pub const PURPLE: &str = "#aa4499";
pub const GOLD: &str = "#b8860b";
const SKY: &str = "#56b4e9";
pub const GREY: &str = "#888888";
pub const LIGHT: &str = "#cccccc";
pub const BLACK: &str = "#222222";
pub const RED: &str = "#cc3311";

/// Every figure that these scores allow.
///
/// # Errors
/// A picture that could not be coded.
pub fn all(scores: &Scores, kept: Option<&Kept>, access_point: &str) -> Result<Vec<Figure>, Error> {
    let Some(group) = scores.headline() else { return Ok(Vec::new()) };
    let mut figures = vec![metrics(group, access_point)?];
    figures.extend(boxes(group, access_point)?);
    figures.push(displacement(group)?);
    figures.extend(reliability(group, access_point)?);
    figures.extend(ladder(group, access_point)?);
    if let Some(kept) = kept {
        figures.extend(one_scene::plan(kept)?);
        figures.extend(one_scene::link(kept)?);
    }
    Ok(figures)
}

fn color_of(mode: Mode) -> &'static str {
    match mode {
        Mode::Hdl => PURPLE,
        Mode::Paper => ORANGE,
        Mode::Default => BLUE,
    }
}

/// The modes of a group, in the order of the tables.
fn modes(group: &Group) -> Vec<Mode> {
    group.modes.iter().map(|scores| scores.mode).collect()
}

fn over_windows(windows: &[WindowScores], value: impl Fn(&WindowScores) -> Option<f64>) -> Vec<(f64, f64)> {
    windows.iter().filter_map(|scores| Some((scores.w as f64 * 100.0, value(scores)?))).collect()
}

/// A line through what is defined, shaded to its 95 % interval.
fn with_interval(line: Series, estimates: impl Iterator<Item = Estimate>) -> Series {
    Series { band: estimates.filter(|e| e.value.is_some()).filter_map(|e| e.interval).collect(), ..line }
}

/// Points of one kind.
pub fn series(name: impl Into<String>, color: &'static str, mark: Mark, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.into(), color, mark, points, band: Vec::new() }
}

/// Axes of a chart over milliseconds ahead, unless changed.
pub fn axes(title: &str, x_label: &str, y: (f64, f64)) -> Panel {
    Panel {
        title: title.into(),
        x_label: x_label.into(),
        x: (0.0, 1000.0),
        y,
        x_step: Some(200.0),
        y_step: Some(if y.1 - y.0 < 0.55 { 0.1 } else { 0.2 }),
        y_digits: 1,
        y_names: Vec::new(),
        equal_axes: false,
        series: Vec::new(),
        shaded: Vec::new(),
        notes: Vec::new(),
    }
}

type Score = fn(&WindowScores) -> Estimate;
type Marks = Vec<(f64, f64)>;

/// The paper's four figures with what it prints of each.
fn published_scores() -> [(&'static str, Score, Marks); 4] {
    [
        ("accuracy", |s| s.accuracy, vec![(300.0, published::AT_300_MS[0].1)]),
        ("precision", |s| s.precision, vec![(300.0, published::AT_300_MS[1].1)]),
        ("recall", |s| s.recall, vec![(300.0, published::AT_300_MS[2].1)]),
        (
            "F1",
            |s| s.f1,
            vec![
                (300.0, published::F1_AT_300_MS),
                (800.0, published::F1_FROM_800_MS),
                (900.0, published::F1_FROM_800_MS),
            ],
        ),
    ]
}

/// The four figures over the windows, one panel each; `lines` are those of a score.
fn four_panels(name: &str, lines: impl Fn(Score) -> Vec<Series>) -> Result<Drawing, Error> {
    let shown = published_scores().map(|(title, score, marks)| (title, lines(score), marks));
    let everything = shown.iter().flat_map(|(_, lines, _)| lines).flat_map(|line| &line.points);
    let lowest = everything.map(|(_, y)| *y).fold(0.7, f64::min);
    let from = (lowest * 10.0).floor() / 10.0;
    let panel = |(title, lines, marks): (&str, Vec<Series>, Marks)| {
        let published = series("published", BLACK, Mark::Diamonds(5.0), marks);
        Panel { series: [lines, vec![published]].concat(), ..axes(title, "window, ms", (from, 1.0)) }
    };
    draw_grid(name, &shown.map(panel), 2, (430.0, 280.0))
}

/// One predictor's score over the windows, with its interval.
fn score_line(
    group: &Group,
    (mode, predictor, access_point): (Mode, Predictor, &str),
    score: Score,
    (name, color, mark): (String, &'static str, Mark),
) -> Option<Series> {
    let windows = &group.link(Some(mode), predictor, access_point)?.windows;
    let line = series(name, color, mark, over_windows(windows, |s| score(s).value));
    Some(with_interval(line, windows.iter().map(score)))
}

/// Algorithm 1 with either box on every mode's tracks and forecasts: the paper's figure.
fn boxes(group: &Group, access_point: &str) -> Result<Option<Figure>, Error> {
    let lines = |score: Score| -> Vec<Series> {
        let of_mode = |mode: Mode| {
            let boxes = [(Predictor::Aabb, Mark::Line(1.8)), (Predictor::Obb, Mark::Dashed(1.8))];
            boxes.into_iter().filter_map(move |(predictor, mark)| {
                let named = (format!("{}, {}", mode.name(), predictor.name()), color_of(mode), mark);
                score_line(group, (mode, predictor, access_point), score, named)
            })
        };
        modes(group).into_iter().flat_map(of_mode).collect()
    };
    if lines(|s| s.f1).is_empty() {
        return Ok(None);
    }
    Ok(Some(Figure {
        name: "boxes",
        title: format!("The paper's figure again: AABB and OBB, access point {access_point}"),
        caption: format!(
            "Algorithm 1 with axis-aligned (line) and oriented boxes (dashed) on the tracks and forecasts of every \
             mode; shaded: 95 % intervals over scenes. The paper finds more recall and the higher F1 with OBB, more \
             precision with AABB, and precision and recall crossing near 300 ms. Blocked at 300 ms: {} here, {:.2} \
             in the paper.",
            base_rate(group, access_point),
            published::BASE_RATE_AT_300_MS
        ),
        drawing: four_panels("boxes", lines)?,
    }))
}

fn metrics(group: &Group, access_point: &str) -> Result<Figure, Error> {
    let lines = |score: Score| -> Vec<Series> {
        let of_mode = |mode: Mode| {
            let named = (mode.name().to_owned(), color_of(mode), Mark::Line(2.2));
            score_line(group, (mode, Predictor::Run, access_point), score, named)
        };
        modes(group).into_iter().filter_map(of_mode).collect()
    };
    Ok(Figure {
        name: "metrics",
        title: format!("Blockage within the window, access point {access_point}"),
        caption: format!(
            "Accuracy, precision, recall and F1 of every mode over the prediction window, with what the paper \
             prints for 300 ms and the level at which its F1 settles; shaded: 95 % intervals over scenes. The \
             share of blocked windows differs: {} here at 300 ms, {:.2} in the paper.",
            base_rate(group, access_point),
            published::BASE_RATE_AT_300_MS
        ),
        drawing: four_panels("metrics", lines)?,
    })
}

fn base_rate(group: &Group, access_point: &str) -> String {
    let links = group.link(None, Predictor::Never, access_point);
    let rate = links.and_then(|links| links.windows[2].base_rate.value);
    rate.map_or("unknown".into(), |rate| format!("{rate:.2}"))
}

fn displacement(group: &Group) -> Result<Figure, Error> {
    let by_step = |values: &[Option<f64>]| -> Vec<(f64, f64)> {
        (1..).zip(values).filter_map(|(h, value)| Some((f64::from(h) * 100.0, (*value)?))).collect()
    };
    let published = published::DISPLACEMENT_M.map(Some);
    let highest = group.modes.iter().filter_map(|m| m.displacement_m[STEPS - 1].value).fold(1.0, f64::max);
    let mut panel = axes("mean displacement, m", "ahead, ms", (0.0, (highest * 5.0).ceil() / 5.0));
    panel.series.push(series("published (Table I)", BLACK, Mark::Diamonds(5.0), by_step(&published)));
    for mode in &group.modes {
        let values: Vec<_> = mode.displacement_m.iter().map(|step| step.value).collect();
        let line = series(mode.mode.name(), color_of(mode.mode), Mark::Line(2.2), by_step(&values));
        panel.series.push(with_interval(line, mode.displacement_m.iter().copied()));
    }
    let carried_on = by_step(&group.constant_velocity_m);
    panel.series.push(series("constant velocity of the true state", GREY, Mark::Dashed(1.6), carried_on));
    Ok(Figure {
        name: "displacement",
        title: "Displacement error of the forecast".into(),
        caption: "Mean distance between forecast and true position at each step, over people with a track who \
                  have not arrived. The dashed line starts from the true state: what is left of it is the future \
                  alone."
            .into(),
        drawing: draw("displacement", &panel, (860.0, 400.0))?,
    })
}

fn reliability(group: &Group, access_point: &str) -> Result<Option<Figure>, Error> {
    // A yes-or-no answer has no reliability to show.
    let graded = |mode: &Mode| {
        group.link(Some(*mode), Predictor::Run, access_point).is_some_and(|links| {
            links.windows.iter().flat_map(|w| &w.bins[1..w.bins.len() - 1]).any(|bin| bin.count > 0)
        })
    };
    let Some(mode) = modes(group).into_iter().rev().find(graded) else { return Ok(None) };
    let Some(links) = group.link(Some(mode), Predictor::Run, access_point) else { return Ok(None) };
    let mut panel = axes("share blocked", "probability said", (0.0, 1.0));
    (panel.x, panel.x_step, panel.equal_axes) = ((0.0, 1.0), Some(0.2), true);
    panel.series.push(series("perfect", LIGHT, Mark::Line(1.5), vec![(0.0, 0.0), (1.0, 1.0)]));
    for (w, color) in [(1, GREEN), (3, BLUE), (9, PURPLE)] {
        let filled = links.windows[w - 1].bins.iter().filter(|bin| bin.count > 0);
        let points =
            filled.map(|bin| (bin.p_sum / bin.count as f64, bin.blocked as f64 / bin.count as f64)).collect();
        panel.series.push(series(format!("{} ms", w * 100), color, Mark::Discs(4.0), points));
    }
    let ece = |w: usize| links.windows[w - 1].ece.unwrap_or(f64::NAN);
    Ok(Some(Figure {
        name: "reliability",
        title: format!("Are the probabilities honest? Mode {}, access point {access_point}", mode.name()),
        caption: format!(
            "Windows sorted by the probability said into 15 bins of equal width; each point is a bin. On the \
             diagonal, of the windows said to be blocked with 30 % indeed 30 % are. Expected calibration error \
             at 100, 300 and 900 ms: {:.3}, {:.3} and {:.3}.",
            ece(1),
            ece(3),
            ece(9)
        ),
        drawing: draw("reliability", &panel, (560.0, 560.0))?,
    }))
}

fn ladder(group: &Group, access_point: &str) -> Result<Option<Figure>, Error> {
    /// The bodies of the true future; the rungs with errors stand in the table.
    const SHOWN: usize = 5;
    let mut oracles: Vec<&str> = Vec::new();
    for row in &group.ladder {
        if !oracles.contains(&row.oracle) && oracles.len() < SHOWN {
            oracles.push(row.oracle);
        }
    }
    if oracles.is_empty() {
        return Ok(None);
    }
    let mut panel = axes("F1", "window, ms", (0.5, 1.0));
    for (oracle, color) in oracles.iter().zip([GREY, GOLD, SKY, GREEN, BLACK]) {
        let rows =
            group.ladder.iter().filter(|row| row.oracle == *oracle && row.access_point == access_point);
        let points = rows.filter_map(|row| Some((row.window as f64 * 100.0, row.f1?))).collect();
        panel.series.push(series(*oracle, color, Mark::Dashed(1.6), points));
    }
    for mode in modes(group) {
        if let Some(links) = group.link(Some(mode), Predictor::Run, access_point) {
            let points = over_windows(&links.windows, |s| s.f1.value);
            panel.series.push(series(
                format!("mode {}", mode.name()),
                color_of(mode),
                Mark::Line(2.4),
                points,
            ));
        }
    }
    Ok(Some(Figure {
        name: "ladder",
        title: format!("What limits the result, access point {access_point}"),
        caption: "F1 if the future were known and people had the body named (dashed), beside what the modes \
                  reach. The upright body is the ceiling: nobody can pass it without knowing the gait."
            .into(),
        drawing: draw("ladder", &panel, (860.0, 460.0))?,
    }))
}
