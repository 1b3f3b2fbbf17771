//! The tables of the report, as rows of cells: printed as text, written as HTML.

use std::fmt::Write as _;

use umbracast::{Mode, STEPS};

use super::published;
use crate::run::pooled::{Estimate, Group, ModeScores, Scores, WindowScores};
use crate::run::scene_score::Predictor;

/// What stands behind the mode of rows whose devices are bound once.
pub const BOUND_ONCE: &str = ", bound once";

/// A table.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Above it.
    pub title: String,
    /// What a reader must know, below it.
    pub note: String,
    /// One a column. The first columns hold words, the others figures.
    pub header: Vec<String>,
    /// How many columns hold words.
    pub words: usize,
    /// As many cells each as there are columns.
    pub rows: Vec<Vec<String>>,
}

/// Windows of the short tables: 100, 300, 800 and 900 ms.
const SHORT_WINDOWS: [usize; 4] = [1, 3, 8, 9];

impl Table {
    /// Without rows.
    pub fn new(title: impl Into<String>, words: usize, header: &[&str]) -> Self {
        let header = header.iter().map(|&name| name.to_owned()).collect();
        Self { title: title.into(), words, header, ..Self::default() }
    }

    pub(crate) fn noted(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Columns in line, words to the left and figures to the right.
    pub fn to_text(&self) -> String {
        let width = |column: usize| {
            let cells = self.rows.iter().map(|row| row[column].chars().count());
            cells.chain([self.header[column].chars().count()]).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.header.len()).map(width).collect();
        let line = |cells: &[String]| {
            let mut text = String::new();
            for (column, (cell, &width)) in cells.iter().zip(&widths).enumerate() {
                let gap = if column == 0 { "" } else { "  " };
                // Writing to a String cannot fail.
                let _ = if column < self.words {
                    write!(text, "{gap}{cell:<width$}")
                } else {
                    write!(text, "{gap}{cell:>width$}")
                };
            }
            text.trim_end().to_owned()
        };
        let mut lines = vec![self.title.clone(), line(&self.header)];
        lines.extend(self.rows.iter().map(|row| line(row)));
        if !self.note.is_empty() {
            lines.push(self.note.clone());
        }
        lines.join("\n") + "\n"
    }
}

/// The short table of stage 3: every mode and access point at four windows, with what the paper prints where that is
/// `published` beside. Persistence stands beside every mode: of two kinds the one that knows the true present, which is
/// harder to beat.
pub fn headline(group: &Group, published: bool) -> Table {
    let header =
        ["access point", "window", "mode", "base rate", "accuracy", "precision", "recall", "F1", "onset F1"];
    let mut table = Table::new(format!("Blockage: {}", scenes(group)), 3, &header);
    for access_point in group.access_points() {
        for w in SHORT_WINDOWS {
            for mode in &group.modes {
                if let Some(links) = group.link(Some(mode.mode), Predictor::Run, access_point) {
                    let start = [access_point.to_owned(), window(w), mode.mode.name().to_owned()];
                    table.rows.push(with_scores(&start, &links.windows[w - 1]));
                }
                if let Some(links) = group.link(Some(mode.mode), Predictor::BoundOnce, access_point) {
                    let name = format!("{}{BOUND_ONCE}", mode.mode.name());
                    let start = [access_point.to_owned(), window(w), name];
                    table.rows.push(with_scores(&start, &links.windows[w - 1]));
                }
            }
            let start = [access_point.to_owned(), window(w)];
            table.rows.extend(persistence(group, access_point, w, &start));
        }
    }
    let mut note = "Bound once: each device is bound to the track that first matches its person and keeps it \
             through identity swaps until the track dies. The other rows match people and tracks anew in every \
             frame. Persistence of truth: the answer \"as now\" from the true present. "
        .to_owned();
    note += brackets(&table);
    if published {
        table.rows.extend(published_rows());
        note += " The published F1 is computed from the published precision and recall.";
    }
    table.noted(note.trim_start())
}

/// What a reader is told of brackets, where there are any.
fn brackets(table: &Table) -> &'static str {
    match table.rows.iter().flatten().any(|cell| cell.contains('[')) {
        true => "In brackets: 95 % interval by bootstrap over recordings.",
        false => "",
    }
}

/// A row a preset, mode and access point, at 300 ms.
pub fn presets(scores: &Scores) -> Table {
    let header =
        ["preset", "access point", "mode", "base rate", "accuracy", "precision", "recall", "F1", "onset F1"];
    let mut table = Table::new("Blockage within 300 ms, by preset", 3, &header);
    for group in &scores.groups {
        for access_point in group.access_points() {
            for mode in &group.modes {
                if let Some(links) = group.link(Some(mode.mode), Predictor::Run, access_point) {
                    let start = [group.name.clone(), access_point.to_owned(), mode.mode.name().to_owned()];
                    table.rows.push(with_scores(&start, &links.windows[2]));
                }
            }
            let start = [group.name.clone(), access_point.to_owned()];
            table.rows.extend(persistence(group, access_point, 3, &start));
        }
    }
    table
}

/// The row of who says "as now" of the true present, after these words.
fn persistence(group: &Group, access_point: &str, w: usize, start: &[String; 2]) -> Option<Vec<String>> {
    let predictor = Predictor::PersistenceOfTruth;
    let links = group.link(None, predictor, access_point)?;
    Some(with_scores(&[start.as_slice(), &[predictor.name().to_owned()]].concat(), &links.windows[w - 1]))
}

/// Algorithm 1 with AABB and with OBB on every mode's tracks and forecasts, and the modes' own stage 3 where it is
/// neither, at one access point and these windows.
pub fn boxes(group: &Group, access_point: &str, windows: &[usize], published: bool) -> Table {
    let header =
        ["window", "mode", "stage 3", "base rate", "accuracy", "precision", "recall", "F1", "onset F1"];
    let title = format!("Boxes, access point {access_point}: {}", scenes(group));
    let mut table = Table::new(title, 3, &header);
    let shown = [(Predictor::Aabb, "AABB"), (Predictor::Obb, "OBB"), (Predictor::Run, "own")];
    for &w in windows {
        for mode in &group.modes {
            let of = |predictor| group.link(Some(mode.mode), predictor, access_point);
            let own_is_a_box = [Predictor::Aabb, Predictor::Obb]
                .iter()
                .any(|&boxed| of(boxed).zip(of(Predictor::Run)).is_some_and(|(a, b)| a.same_counts(b)));
            for (predictor, name) in shown {
                let Some(links) = of(predictor).filter(|_| name != "own" || !own_is_a_box) else { continue };
                let start = [window(w), mode.mode.name().to_owned(), name.to_owned()];
                table.rows.push(with_scores(&start, &links.windows[w - 1]));
            }
        }
        table.rows.extend(persistence(group, access_point, w, &[window(w), String::new()]));
        let printed = published_rows().into_iter().filter(|row| published && row[1] == window(w));
        table.rows.extend(printed.map(|mut row| {
            row[..3].clone_from_slice(&[window(w), "published".to_owned(), String::new()]);
            row
        }));
    }
    let same = "All rows of a mode share its stages 1 and 2.";
    let note = format!("{same} {}", brackets(&table));
    table.noted(note.trim_end())
}

fn published_rows() -> [Vec<String>; 2] {
    let [(_, accuracy), (_, precision), (_, recall)] = published::AT_300_MS;
    let row = |w: usize, cells: [String; 5]| {
        let mut row = vec!["(not given)".to_owned(), window(w), "published".to_owned()];
        row.extend(cells);
        row.push(String::new());
        row
    };
    let none = String::new;
    [
        row(
            3,
            [
                format!("{:.2}", published::BASE_RATE_AT_300_MS),
                format!("{accuracy:.2}"),
                format!("{precision:.2}"),
                format!("{recall:.2}"),
                format!("{:.3}", published::F1_AT_300_MS),
            ],
        ),
        row(8, [none(), none(), none(), none(), format!("{:.3}", published::F1_FROM_800_MS)]),
    ]
}

/// Stage 1 of every mode.
pub fn tracking(group: &Group) -> Table {
    let header = [
        "mode",
        "recall",
        "precision",
        "MOTA",
        "IDF1",
        "HOTA",
        "switches",
        "position, m",
        "velocity, m/s",
        ">= 6 returns",
        "1 to 5",
        "none",
        "NEES",
        "of velocity",
    ];
    let mut table = Table::new("Detection and tracking", 1, &header);
    for mode in &group.modes {
        let mut row = vec![mode.mode.name().to_owned()];
        let scores = [mode.recall, mode.precision, mode.mota, mode.idf1, mode.hota];
        row.extend(scores.iter().map(|score| number(score.value, 3)));
        row.push(number(mode.switches_per_scene.value, 2));
        row.push(number(mode.position_rmse_m.value, 3));
        row.push(number(mode.velocity_rmse_mps.value, 3));
        row.extend(mode.recall_by_returns.iter().rev().map(|&recall| number(recall, 3)));
        row.extend([mode.position_nees, mode.velocity_nees].map(|nees| number(nees.value, 2)));
        table.rows.push(row);
    }
    table.noted(
        "Counted: everybody in the scene from the first frame, and confirmed tracks; gate 0.5 m, HOTA \
         similarity 1 - d / 1 m. Switches are per scene. Position and velocity: root mean square of the 2-D \
         error. Then recall by returns on the body. NEES: squared error over the tracks' covariance; 2 means \
         that the covariance is right.",
    )
}

/// Stage 2 of every mode, beside Table I where that is `published` beside.
pub fn displacement(group: &Group, published: bool) -> Table {
    let mut header = vec!["mode".to_owned()];
    header.extend((1..=STEPS).map(|h| format!("{} ms", h * 100)));
    header.extend(["scored", "NLL", "in 50 %", "in 90 %"].map(str::to_owned));
    let mut table = Table { header, ..Table::new("Displacement of the forecast, m", 1, &[]) };
    for mode in &group.modes {
        let mut row = vec![mode.mode.name().to_owned()];
        row.extend(mode.displacement_m.iter().map(|step| number(step.value, 3)));
        row.push(number(mode.scored_share, 3));
        row.push(number(mean(&mode.nll), 2));
        let covered =
            |i: usize| mean(&mode.coverage.iter().map(|covered| covered.map(|c| c[i])).collect::<Vec<_>>());
        row.extend([number(covered(0), 2), number(covered(1), 2)]);
        table.rows.push(row);
    }
    let four = || vec![String::new(); 4];
    let reference = |name: &str, values: Vec<String>| [vec![name.to_owned()], values, four()].concat();
    let carried_on = group.constant_velocity_m.iter().map(|&m| number(m, 3)).collect();
    table.rows.push(reference("true state carried on", carried_on));
    if published {
        let printed = published::DISPLACEMENT_M.iter().map(|m| format!("{m:.2}")).collect();
        table.rows.push(reference("published", printed));
    }
    table.noted(
        "Scored: share of counted people and instants with a track whose person does not arrive within the \
         forecast. NLL (in nats) and the shares within the 50 and 90 % regions are means over the steps.",
    )
}

/// Every mode and baseline at one access point, at the short windows.
pub fn baselines(group: &Group, access_point: &str) -> Table {
    let shown = [
        Predictor::Never,
        Predictor::PersistenceOfTruth,
        Predictor::PersistenceOfTracks,
        Predictor::ConstantVelocityOfTruth,
        Predictor::Run,
        Predictor::BoundOnce,
    ];
    compared(group, access_point, &shown, format!("Baselines, access point {access_point}")).noted(
        "Persistence: the answer \"as now\", from the true present or from the mode's own. Constant velocity: \
         the true state carried on, then the mode's stage 3. Lead: median time from the start of the unbroken \
         warning to the onset, and the share of onsets warned of.",
    )
}

/// When a link is blocked and when it is clear again, of every mode that reports it.
pub fn times(group: &Group) -> Table {
    let header =
        ["mode", "access point", "time until", "links", "in 10 to 90 %", "median error, s", "mean error, s"];
    let mut table = Table::new("Time to blockage and its duration", 3, &header);
    for mode in &group.modes {
        for (access_point, kinds) in group.access_points().into_iter().zip(&mode.times) {
            let until = ["blocked", "clear", "clear again"];
            for (until, scores) in until.into_iter().zip(kinds).filter(|(_, s)| s.reported > 0) {
                table.rows.push(vec![
                    mode.mode.name().to_owned(),
                    access_point.to_owned(),
                    until.to_owned(),
                    scores.reported.to_string(),
                    number(scores.coverage, 3),
                    number(scores.median_error_s, 2),
                    number(scores.mean_error_s, 2),
                ]);
            }
        }
    }
    table.noted(
        "Time until a free link is blocked, until a blocked link is clear, and until a free link that becomes \
         blocked is clear again. Links: those with a predicted chance of at least 10 % that it happens within \
         900 ms. Then the share of them between the 10 and the 90 % quantile (more than 80 %, because times \
         are whole steps of 100 ms), and the error of the 50 % quantile where it happened.",
    )
}

/// Each stage replaced by the truth, at one access point.
pub fn budget(group: &Group, access_point: &str) -> Table {
    let shown = [Predictor::Run, Predictor::TrueState, Predictor::TrueFuture, Predictor::TrueBody];
    compared(group, access_point, &shown, format!("Error budget, access point {access_point}")).noted(
        "The truth replaces one stage at a time; the rest is the mode's own. Positions and velocities: the true state \
         into forecast and cast, with the people whom the mode missed. Future: the true positions from now on into \
         the cast. Body: the true walking mesh at the forecast position (yes or no at the mean).",
    )
}

fn compared(group: &Group, access_point: &str, shown: &[Predictor], title: String) -> Table {
    let header = [
        "window",
        "mode",
        "predictor",
        "base rate",
        "accuracy",
        "precision",
        "recall",
        "F1",
        "onset F1",
        "AUPRC",
        "Brier",
        "ECE",
        "lead, s",
        "warned",
    ];
    let mut table = Table::new(title, 3, &header);
    let modes = group.modes.iter().map(|scores| Some(scores.mode));
    let columns: Vec<Option<Mode>> = std::iter::once(None).chain(modes).collect();
    for w in SHORT_WINDOWS {
        for &mode in &columns {
            for &predictor in shown {
                let Some(links) = group.link(mode, predictor, access_point) else { continue };
                let scores = &links.windows[w - 1];
                let start = [window(w), mode.map_or("", Mode::name).to_owned(), predictor.name().to_owned()];
                let mut row = with_scores(&start, scores);
                row.push(number(scores.auprc, 3));
                row.push(number(scores.brier, 4));
                row.push(number(scores.ece, 4));
                row.push(number(scores.lead_median_s, 2));
                row.push(number(scores.lead_warned, 2));
                table.rows.push(row);
            }
        }
    }
    table
}

/// Stages 1 and 2 and the calibration of every preset, with intervals: a row a figure, a column a mode, and one for
/// what is `published`.
pub fn figures_by_preset(scores: &Scores, published: bool) -> Table {
    type Figure = (String, usize, fn(&ModeScores, usize) -> Estimate, usize, &'static str);
    let figure = |name: &str, digits, of| -> Figure { (name.to_owned(), digits, of, 0, "") };
    let mut figures = vec![
        figure("MOTA", 3, |m, _| m.mota),
        figure("IDF1", 3, |m, _| m.idf1),
        figure("switches a scene", 2, |m, _| m.switches_per_scene),
        figure("position RMSE, m", 3, |m, _| m.position_rmse_m),
        figure("velocity RMSE, m/s", 3, |m, _| m.velocity_rmse_mps),
        figure("NEES of positions (honest: 2)", 2, |m, _| m.position_nees),
        figure("NEES of velocities (honest: 2)", 2, |m, _| m.velocity_nees),
    ];
    for (h, printed) in [(1, "0.22"), (3, "0.34"), (9, "0.96")] {
        let name = format!("displacement at {}, m", window(h));
        figures.push((name, 3, |m, h| m.displacement_m[h - 1], h, printed));
    }
    let mut table = Table::new("Tracking, forecast and calibration, by preset", 2, &["preset", "figure"]);
    let modes: Vec<Mode> = scores.headline().iter().flat_map(|g| &g.modes).map(|m| m.mode).collect();
    table.header.extend(modes.iter().map(|mode| mode.name().to_owned()));
    table.header.extend(published.then(|| "published".to_owned()));
    for group in &scores.groups {
        for (name, digits, of, step, printed) in &figures {
            let mut row = vec![group.name.clone(), name.clone()];
            row.extend(group.modes.iter().map(|mode| with_interval(&of(mode, *step), *digits)));
            row.extend(published.then(|| (*printed).to_owned()));
            table.rows.push(row);
        }
        for access_point in group.access_points() {
            let mut row = vec![group.name.clone(), format!("ECE, {access_point}, mean of windows")];
            row.extend(modes.iter().map(|&mode| {
                let links = group.link(Some(mode), Predictor::Run, access_point);
                let ece = links.map(|l| l.windows.iter().map(|w| w.ece).collect::<Vec<_>>());
                number(ece.and_then(|ece| mean(&ece)), 4)
            }));
            row.extend(published.then(String::new));
            table.rows.push(row);
        }
    }
    let note = brackets(&table);
    table.noted(note)
}

/// What was counted and skipped, by mode.
pub fn health(group: &Group) -> Table {
    let named = |mode: &ModeScores| serde_json::to_value(mode.health).unwrap_or_default();
    let mut table = Table::new("Health", 1, &["skipped"]);
    table.header.extend(group.modes.iter().map(|mode| mode.mode.name().to_owned()));
    let counters = group.modes.first().map(named).unwrap_or_default();
    for name in counters.as_object().into_iter().flat_map(|fields| fields.keys()) {
        let mut row = vec![name.replace('_', " ")];
        row.extend(group.modes.iter().map(|mode| named(mode)[name].to_string()));
        table.rows.push(row);
    }
    table.noted("Broken input that the run skipped. All counts are zero on clean input.")
}

/// What of it was not zero; none where nothing was skipped.
pub fn losses(group: &Group) -> Option<Table> {
    let mut table = health(group);
    table.rows.retain(|row| row[1..].iter().any(|count| count != "0"));
    (!table.rows.is_empty()).then(|| table.noted("Broken input that the run skipped."))
}

fn with_scores(start: &[String], scores: &WindowScores) -> Vec<String> {
    let mut row = start.to_vec();
    let plain = [scores.base_rate, scores.accuracy, scores.precision, scores.recall];
    row.extend(plain.iter().map(|score| number(score.value, 3)));
    row.push(with_interval(&scores.f1, 3));
    row.push(number(scores.onset_f1.value, 3));
    row
}

fn with_interval(score: &Estimate, digits: usize) -> String {
    match (score.value, score.interval) {
        (Some(value), Some([low, high])) => format!("{value:.digits$} [{low:.digits$}, {high:.digits$}]"),
        (value, _) => number(value, digits),
    }
}

/// A dash where it is not defined.
pub(crate) fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
}

pub(super) fn mean(values: &[Option<f64>]) -> Option<f64> {
    let sum = values.iter().copied().sum::<Option<f64>>()?;
    (!values.is_empty()).then(|| sum / values.len() as f64)
}

pub(super) fn window(w: usize) -> String {
    format!("{} ms", w * 100)
}

pub(super) fn scenes(group: &Group) -> String {
    let s = |count: usize| if count == 1 { "" } else { "s" };
    let (scenes, recordings) = (group.scenes, group.recordings);
    let of = match recordings < scenes {
        true => format!(" of {recordings} recording{}", s(recordings)),
        false => String::new(),
    };
    format!("{}, {scenes} scene{}{of}, {} frames", group.name, s(scenes), group.frames)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_stand_in_line() {
        let mut table = Table::new("Title", 1, &["mode", "F1"]);
        table.rows = vec![vec!["paper".into(), "0.5".into()], vec!["x".into(), "10.25".into()]];
        assert_eq!(table.to_text(), "Title\nmode      F1\npaper    0.5\nx      10.25\n");
    }

    #[test]
    fn what_is_not_defined_is_a_dash_and_an_interval_stands_in_brackets() {
        let known = Estimate { value: Some(0.8765), interval: Some([0.86, 0.891]) };
        assert_eq!(with_interval(&known, 3), "0.876 [0.860, 0.891]");
        assert_eq!(with_interval(&Estimate::default(), 3), "-");
    }
}
