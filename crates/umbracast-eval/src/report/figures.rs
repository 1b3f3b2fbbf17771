//! The report's figures.

use umbracast::{Error, Mode, STEPS};

use super::context::Kept;
use super::figure::{BLACK, BLUE, Figure, GOLD, GREEN, GREY, ORANGE, PURPLE, SKY, Sizes, axes, series};
use super::plot::{Mark, Panel, Series};
use super::{one_scene, published};
use crate::run::pooled::{Estimate, Group, Scores, WindowScores};
use crate::run::scene_score::Predictor;

/// Of a chart that takes half of the page.
const HALF: Sizes = Sizes { alone: (860.0, 430.0), page: (460.0, 320.0), narrow: None };
/// Of four panels in a row.
const QUARTERS: Sizes = Sizes { alone: (430.0, 280.0), page: (300.0, 250.0), narrow: None };

/// Every figure that these scores allow, beginning with the scene that was kept. `published` says whether what the
/// paper prints stands beside.
///
/// # Errors
/// A picture that could not be coded.
pub fn all(
    scores: &Scores,
    kept: Option<&Kept>,
    access_point: &str,
    published: bool,
) -> Result<Vec<Figure>, Error> {
    let Some(group) = scores.headline() else { return Ok(Vec::new()) };
    let mut figures = Vec::new();
    if let Some(kept) = kept {
        figures.extend(one_scene::plan(kept)?);
        figures.extend(one_scene::link(kept)?);
    }
    figures.push(metrics(group, access_point, published)?);
    figures.extend(boxes(group, access_point, published)?);
    figures.push(displacement(group, published)?);
    figures.extend(ladder(group, access_point)?);
    figures.extend(reliability(group, access_point)?);
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
fn four_panels(published: bool, lines: impl Fn(Score) -> Vec<Series>) -> [Panel; 4] {
    let shown = published_scores().map(|(title, score, marks)| (title, lines(score), marks));
    let everything = shown.iter().flat_map(|(_, lines, _)| lines).flat_map(|line| &line.points);
    let lowest = everything.map(|(_, y)| *y).fold(0.7, f64::min);
    let from = (lowest * 10.0).floor() / 10.0;
    shown.map(|(title, lines, marks)| {
        let marks = published.then(|| series("published", BLACK, Mark::Diamonds(5.0), marks));
        let series = lines.into_iter().chain(marks).collect();
        Panel { series, ..axes(title, "window, ms", (from, 1.0)) }
    })
}

/// What a reader is told of the shades, where there are any.
fn shades<'a>(mut panels: impl Iterator<Item = &'a Panel>) -> &'static str {
    match panels.any(|panel| panel.series.iter().any(|series| !series.band.is_empty())) {
        true => " Shaded: 95 % intervals over recordings.",
        false => "",
    }
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
fn boxes(group: &Group, access_point: &str, published: bool) -> Result<Option<Figure>, Error> {
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
    let panels = four_panels(published, lines);
    let mut caption =
        "People as boxes: axis-aligned (AABB, line) and oriented (OBB, dashed), on the tracks and \
                       forecasts of "
            .to_owned();
    caption += if group.modes.len() == 1 { "the run." } else { "each mode." };
    caption += shades(panels.iter());
    if published {
        caption += " In the paper (its Algorithm 1) recall and F1 are higher with OBB, precision is higher \
                 with AABB, and precision and recall cross near 300 ms.";
        caption += &base_rates(group, access_point);
    }
    let title = match published {
        true => format!("The paper's figure again: AABB and OBB, access point {access_point}"),
        false => format!("With boxes for bodies, access point {access_point}"),
    };
    Figure::of("boxes", (title, caption), &panels, QUARTERS).map(Some)
}

fn metrics(group: &Group, access_point: &str, published: bool) -> Result<Figure, Error> {
    let lines = |score: Score| -> Vec<Series> {
        let of_mode = |mode: Mode| {
            let named = (mode.name().to_owned(), color_of(mode), Mark::Line(2.2));
            score_line(group, (mode, Predictor::Run, access_point), score, named)
        };
        modes(group).into_iter().filter_map(of_mode).collect()
    };
    let panels = four_panels(published, lines);
    let mut caption = "Accuracy, precision, recall and F1 over the prediction window.".to_owned();
    if published {
        caption += " Diamonds: the paper's values for 300 ms, and the level at which its F1 settles.";
        caption += &base_rates(group, access_point);
    }
    caption += shades(panels.iter());
    let title = format!("Blockage within the window, access point {access_point}");
    Figure::of("metrics", (title, caption), &panels, QUARTERS)
}

/// Scores of crowds that block each other more or less often do not compare as they stand.
fn base_rates(group: &Group, access_point: &str) -> String {
    let links = group.link(None, Predictor::Never, access_point);
    let rate = links.and_then(|links| links.windows[2].base_rate.value);
    let here = rate.map_or("unknown".into(), |rate| format!("{rate:.2}"));
    let paper = published::BASE_RATE_AT_300_MS;
    format!(" The share of windows blocked at 300 ms is {here} here and {paper:.2} in the paper.")
}

fn displacement(group: &Group, published: bool) -> Result<Figure, Error> {
    let by_step = |values: &[Option<f64>]| -> Vec<(f64, f64)> {
        (1..).zip(values).filter_map(|(h, value)| Some((f64::from(h) * 100.0, (*value)?))).collect()
    };
    let printed = published::DISPLACEMENT_M.map(Some);
    let least = if published { 1.0 } else { 0.05 };
    let highest = group.modes.iter().filter_map(|m| m.displacement_m[STEPS - 1].value).fold(least, f64::max);
    let (tick_m, digits) = if highest > 0.5 { (0.2, 1) } else { (0.05, 2) };
    let mut panel = axes("mean displacement, m", "ahead, ms", (0.0, (highest / tick_m).ceil() * tick_m));
    (panel.y_step, panel.y_digits) = (Some(tick_m), digits);
    if published {
        let marks = series("published (Table I)", BLACK, Mark::Diamonds(5.0), by_step(&printed));
        panel.series.push(marks);
    }
    for mode in &group.modes {
        let values: Vec<_> = mode.displacement_m.iter().map(|step| step.value).collect();
        let line = series(mode.mode.name(), color_of(mode.mode), Mark::Line(2.2), by_step(&values));
        panel.series.push(with_interval(line, mode.displacement_m.iter().copied()));
    }
    let carried_on = by_step(&group.constant_velocity_m);
    panel.series.push(series("constant velocity of the true state", GREY, Mark::Dashed(1.6), carried_on));
    let caption =
        "Mean distance between forecast and true position at each step, over people with a track who have \
                   not arrived. Dashed: constant velocity from the true state, so that only the future is \
                            unknown."
            .to_owned();
    let caption = caption + shades(std::iter::once(&panel));
    Figure::of("displacement", ("Displacement error of the forecast".into(), caption), &[panel], HALF)
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
    let bins = links.windows[0].bins.len() as f64;
    let most = links.windows.iter().flat_map(|w| &w.bins).map(|bin| bin.count).max().unwrap_or(1);
    let mut shares = axes("share blocked", "predicted probability", (0.0, 1.05));
    (shares.x, shares.x_step, shares.y_step) = ((0.0, 1.05), Some(0.2), Some(0.2));
    let mut counts = axes("predictions in the bin", "predicted probability", (0.8, most as f64 * 2.0));
    (counts.x, counts.x_step, counts.y_step, counts.y_log) = ((0.0, 1.05), Some(0.2), None, true);
    for (w, color, radius) in [(1, GREEN, 5.5), (3, BLUE, 4.0), (9, PURPLE, 3.0)] {
        let filled = || links.windows[w - 1].bins.iter().zip(0..).filter(|(bin, _)| bin.count > 0);
        let share =
            |p_sum: f64, blocked: u64, count: u64| (p_sum / count as f64, blocked as f64 / count as f64);
        let points = filled().map(|(bin, _)| share(bin.p_sum, bin.blocked, bin.count)).collect();
        let mark = match w {
            1 => Mark::Squares(radius),
            3 => Mark::Discs(radius),
            _ => Mark::Diamonds(radius + 1.5),
        };
        shares.series.push(series(format!("within {} ms", w * 100), color, mark, points));
        let middle = |i: i32| (f64::from(i) + 0.5) / bins;
        let points = filled().map(|(bin, i)| (middle(i), bin.count as f64)).collect();
        counts.series.push(series("", color, mark, points));
    }
    shares.series.push(series("perfect", GREY, Mark::Dashed(1.5), vec![(0.0, 0.0), (1.0, 1.0)]));
    let ece = |w: usize| links.windows[w - 1].ece.unwrap_or(f64::NAN);
    let title =
        format!("Calibration of the probabilities: mode {}, access point {access_point}", mode.name());
    let caption = format!(
        "Predictions are sorted by probability into {bins} bins of equal width; each mark is a bin. On the \
         diagonal, 30 % of the links with a predicted probability of 30 % are blocked. Second chart: number of \
         predictions in each bin. With few predictions a mark may be far off by chance. Expected calibration error at \
         100, 300 and 900 ms: {:.3}, {:.3} and {:.3}.",
        ece(1),
        ece(3),
        ece(9)
    );
    let sizes = Sizes { alone: (480.0, 400.0), page: (460.0, 360.0), narrow: None };
    Figure::of("reliability", (title, caption), &[shares, counts], sizes).map(Some)
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
    let title = format!("What limits the result, access point {access_point}");
    let caption =
        "Dashed: F1 of oracles. An oracle knows where everybody will be and models each person as the named \
         body. The upright body ignores the gait, so a method that follows the gait can score above it."
            .to_owned();
    Figure::of("ladder", (title, caption), &[panel], HALF).map(Some)
}
