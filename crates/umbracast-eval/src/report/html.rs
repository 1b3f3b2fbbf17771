//! The page: text, tables and figures in one file, no script, readable on a phone and on paper.

use std::fmt::Write as _;

use super::context::Context;
use super::figure::Figure;
use super::markup::escaped;
use super::plot::Mark;
use super::published;
use super::tables::{BOUND_ONCE, Table};
use crate::run::pooled::{Group, Scores};
use crate::run::scene_score::Predictor;
use umbracast::Mode;

/// A table with more rows is folded.
const ROWS_MAX: usize = 12;

/// Charts are drawn for a light page; a dark one turns their lightness round and keeps their hues.
const STYLE: &str = "
:root { color-scheme: light dark; --ink: #222; --soft: #555; --line: #ddd; --rule: #999; --page: #fff; --well: #f6f6f6; }
@media (prefers-color-scheme: dark) {
:root { --ink: #e6e6e6; --soft: #aaa; --line: #3a3a3a; --rule: #777; --page: #141414; --well: #1f1f1f; }
.chart, .swatch { filter: invert(0.92) hue-rotate(180deg); }
}
* { box-sizing: border-box; }
body { font: 16px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--page); margin: 0 auto;
  padding: 1.5rem 1rem 4rem; max-width: 78rem; }
a { color: inherit; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0.5rem 0; }
h2 { font-size: 1.2rem; line-height: 1.3; margin: 2.4rem 0 0.5rem; }
p { max-width: 52rem; }
.lead { font-size: 1.1rem; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(10rem, 1fr)); gap: 0.8rem; margin: 1.2rem 0; }
.card { border: 1px solid var(--line); border-radius: 8px; padding: 0.7rem 0.9rem; }
.card b { display: block; font-size: 1.6rem; font-weight: 600; line-height: 1.3; }
.card span { color: var(--soft); font-size: 0.85rem; display: block; }
.figures { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 0 2rem; }
.whole { grid-column: 1 / -1; }
figure { margin: 0; }
.panels { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 15rem), 1fr)); gap: 0.5rem; }
figure svg { display: block; max-width: none !important; }
.narrow { display: none; }
.legend { display: flex; flex-wrap: wrap; gap: 0.1rem 1.2rem; padding: 0; margin: 0.4rem 0; list-style: none;
  font-size: 0.9rem; }
.legend li { display: flex; align-items: center; gap: 0.4rem; }
.legend svg { width: 30px; height: 14px; flex: none; }
figcaption, .note { color: var(--soft); font-size: 0.9rem; max-width: 52rem; margin: 0.3rem 0 0; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.8rem; font-variant-numeric: tabular-nums; white-space: nowrap; }
th, td { padding: 0.25rem 0.4rem; text-align: right; border-bottom: 1px solid var(--line); }
th { border-bottom: 2px solid var(--rule); font-weight: 600; }
.w { text-align: left; }
tr.new td { border-top: 2px solid var(--rule); }
pre { background: var(--well); border-radius: 6px; padding: 0.8rem; overflow-x: auto; font-size: 0.8rem; line-height: 1.4; }
details { border-top: 1px solid var(--line); padding: 0.5rem 0; }
summary { cursor: pointer; }
summary h2 { display: inline; font-size: 1rem; }
nav a { margin-right: 1rem; white-space: nowrap; }
@media (max-width: 760px) {
.figures { grid-template-columns: minmax(0, 1fr); }
.narrowed { display: none; }
.narrow { display: grid; }
}
@media print { body { max-width: none; } h2, figure, tr { break-inside: avoid; } }
";

/// What was drawn and tabulated, in the order of the page.
pub struct Drawn<'a> {
    /// Stands first.
    pub animation: Option<&'a str>,
    /// Then these.
    pub figures: &'a [Figure],
    /// Then these.
    pub tables: &'a [Table],
}

/// The whole page. `published` says whether what the paper prints stands beside.
pub fn page(scores: &Scores, context: &Context, drawn: &Drawn, published: bool) -> String {
    let mut page = String::from("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    // Writing to a String cannot fail.
    let _ = write!(
        page,
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Umbracast: report</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <h1>Which links will people block?</h1>\n"
    );
    if let Some(group) = scores.headline() {
        page += &opening(group, published);
    }
    for note in context.notes {
        let _ = writeln!(page, "<p>{}</p>", escaped(note));
    }
    page += "<nav><a href=\"#figures\">Figures</a><a href=\"#tables\">Tables</a>\
             <a href=\"#again\">Run it again</a></nav>\n<section id=\"figures\" class=\"figures\">\n";
    if let Some(svg) = drawn.animation {
        page += &animated(svg, context);
    }
    drawn.figures.iter().for_each(|figure| page += &charted(figure));
    page += "</section>\n<section id=\"tables\">\n<h2>Tables</h2>\n";
    drawn.tables.iter().enumerate().for_each(|(i, table)| page += &tabulated(table, i == 0));
    page += "</section>\n<section id=\"again\">\n<h2>Run it again</h2>\n";
    let _ = writeln!(page, "<pre>{}</pre>", escaped(context.command));
    for config in context.configs {
        let (name, text) = (config.mode.name(), escaped(&config.to_toml()));
        let _ = write!(
            page,
            "<details><summary>Configuration of mode {name}</summary>\n<pre>{text}</pre></details>\n"
        );
    }
    page + "</section>\n</body>\n</html>\n"
}

/// What was done, in two sentences, and the figures that matter.
fn opening(group: &Group, published: bool) -> String {
    let Some(mode) = group.modes.last() else { return String::new() };
    let access_points = group.access_points();
    let first = access_points.first().copied().unwrap_or_default();
    let scenes = if group.scenes == 1 { "one scene".to_owned() } else { format!("{} scenes", group.scenes) };
    let of_first = match (group.modes.len(), access_points.len()) {
        (1, 1) => String::new(),
        (1, _) => format!(" First figures: access point {}.", escaped(first)),
        _ => format!(" First figures: mode {} at access point {}.", mode.mode.name(), escaped(first)),
    };
    let mut text = format!(
        "<p class=\"lead\">LiDARs see people walk. Umbracast predicts where each person will be within the \
         next 0.9 s, and which radio links between access points and people a body will block. This report \
         scores {scenes} ({} frames) against the truth.{of_first}</p>\n<div class=\"cards\">\n",
        group.frames,
    );
    let mut card = |value: Option<f64>, digits: usize, unit: &str, what: &str, printed: String| {
        let value = value.map_or("-".to_owned(), |value| format!("{value:.digits$}{unit}"));
        let printed = if published { format!("; published {printed}") } else { String::new() };
        let _ = writeln!(text, "<div class=\"card\"><b>{value}</b><span>{what}{printed}</span></div>");
    };
    if let Some(links) = group.link(Some(mode.mode), Predictor::Run, first) {
        let at = &links.windows[2];
        card(at.f1.value, 3, "", "F1 at 300 ms", format!("{:.3}", published::F1_AT_300_MS));
        card(
            at.base_rate.value,
            2,
            "",
            "of windows are blocked",
            format!("{:.2}", published::BASE_RATE_AT_300_MS),
        );
    }
    let ahead = mode.displacement_m.last().and_then(|step| step.value);
    let printed = published::DISPLACEMENT_M[published::DISPLACEMENT_M.len() - 1];
    card(ahead, 2, " m", "off after 900 ms", format!("{printed:.2} m"));
    let mut plain = |value: Option<f64>, digits: usize, unit: &str, what: &str| {
        let value = value.map_or("-".to_owned(), |value| format!("{value:.digits$}{unit}"));
        let _ = writeln!(text, "<div class=\"card\"><b>{value}</b><span>{what}</span></div>");
    };
    if let Some(links) = group.link(None, Predictor::PersistenceOfTruth, first) {
        plain(links.windows[2].f1.value, 3, "", "F1 at 300 ms of persistence of truth (\"as now\")");
    }
    if let Some(links) = group.link(Some(mode.mode), Predictor::Run, first) {
        plain(links.windows[2].onset_f1.value, 3, "", "onset F1: links that are free when predicted");
    }
    plain(mode.tracked_share.value, 3, "", "share of people with a track");
    text + "</div>\n" + &modes(group)
}

/// Which method each mode is, and what the scores mean.
fn modes(group: &Group) -> String {
    let told = |mode: Mode| match mode {
        Mode::Hdl => {
            "detection and tracking of the published code that the paper's authors adapted, with the paper's \
             forecast"
        }
        Mode::Paper => "the method as the paper describes it",
        Mode::Default => "this software's own method",
    };
    let mut text = String::from("<p>");
    for mode in group.modes.iter().map(|scores| scores.mode) {
        let _ = write!(text, "Mode <b>{}</b>: {}. ", mode.name(), told(mode));
    }
    text + "A window counts as blocked if a body cuts the link at any of its steps. F1 is the harmonic mean of \
             precision and recall. Onset F1 counts only links that are free when the prediction is made; the \
             answer &quot;as now&quot; scores zero there.</p>\n"
}

/// The animation, small enough to be seen whole.
fn animated(svg: &str, context: &Context) -> String {
    let of = context.kept.map_or(String::new(), |kept| format!(": {}", escaped(kept.label)));
    let title = format!("A few seconds{of}");
    format!(
        "<div><h2 id=\"animation\">{title}</h2>\n<figure>\n{svg}<figcaption>People are at their true \
         positions. Red is truth, amber is prediction. The file animation.svg beside this page has the same \
         picture.</figcaption>\n\
         </figure></div>\n"
    )
}

fn charted(figure: &Figure) -> String {
    let (title, caption, name) = (escaped(&figure.title), escaped(&figure.caption), figure.name);
    let class = if figure.whole_width { " class=\"whole\"" } else { "" };
    let mut text = format!("<div{class}><h2 id=\"{name}\">{title}</h2>\n<figure>\n");
    let mut panels = |class: &str, svgs: &[String]| {
        let _ = writeln!(text, "<div class=\"{class}\">");
        for svg in svgs {
            let named = format!("<svg class=\"chart\" aria-label=\"{title}\" ");
            let _ = writeln!(text, "{}", svg.replacen("<svg ", &named, 1));
        }
        text += "</div>\n";
    };
    if figure.narrow.is_empty() {
        panels("panels", &figure.panels);
    } else {
        panels("panels narrowed", &figure.panels);
        panels("panels narrow", &figure.narrow);
    }
    text += "<ul class=\"legend\">";
    for (words, color, mark) in &figure.legend {
        let _ = write!(text, "<li>{}{}</li>", swatch(color, *mark), escaped(words));
    }
    let _ = write!(text, "</ul>\n<figcaption>{caption}</figcaption>\n</figure></div>\n");
    text
}

/// How a series looks in its chart.
fn swatch(color: &str, mark: Mark) -> String {
    let line = |width: f64, dashes: &str| {
        format!(
            "<path d=\"M1 7h28\" stroke=\"{color}\" stroke-width=\"{width}\" stroke-dasharray=\"{dashes}\"/>"
        )
    };
    let shape = match mark {
        Mark::Line(width) => line(width, "none"),
        Mark::Dashed(width) => line(width, "6 4"),
        Mark::Discs(radius) => format!("<circle cx=\"15\" cy=\"7\" r=\"{radius}\" fill=\"{color}\"/>"),
        Mark::Diamonds(radius) => {
            let r = radius.min(6.5);
            format!(
                "<path d=\"M15 {}l{r} {r}l-{r} {r}l-{r} -{r}z\" fill=\"{color}\" stroke=\"#222\"/>",
                7.0 - r
            )
        }
        Mark::Squares(radius) => format!(
            "<rect x=\"{}\" y=\"{}\" width=\"{side}\" height=\"{side}\" fill=\"{color}\"/>",
            15.0 - radius,
            7.0 - radius,
            side = 2.0 * radius
        ),
        Mark::Patch => {
            format!("<rect x=\"1\" y=\"1\" width=\"28\" height=\"12\" fill=\"{color}\" opacity=\"0.3\"/>")
        }
    };
    format!("<svg class=\"swatch\" viewBox=\"0 0 30 14\" aria-hidden=\"true\">{shape}</svg>")
}

/// Folded where it is long, but for the one that stands `first`. Rows with devices bound once are folded below the others.
fn tabulated(table: &Table, first: bool) -> String {
    let fold = if first || table.rows.len() <= ROWS_MAX { " open" } else { "" };
    let is_bound_once =
        |row: &&Vec<String>| row.iter().take(table.words).any(|cell| cell.ends_with(BOUND_ONCE));
    let (bound_once, others): (Vec<_>, Vec<_>) = table.rows.iter().partition(is_bound_once);
    let title = escaped(&table.title);
    let mut text = format!("<details{fold}><summary><h2>{title}</h2></summary>\n{}", rows(table, &others));
    if !bound_once.is_empty() {
        let rows = rows(table, &bound_once);
        let _ =
            writeln!(text, "<details><summary>The same with devices bound once</summary>\n{rows}</details>");
    }
    if !table.note.is_empty() {
        let _ = writeln!(text, "<p class=\"note\">{}</p>", escaped(&table.note));
    }
    text + "</details>\n"
}

/// Some rows of a table below its header.
fn rows(table: &Table, rows: &[&Vec<String>]) -> String {
    let mut text = "<div class=\"wide\"><table>\n<tr>".to_owned();
    let class = |column: usize| if column < table.words { " class=\"w\"" } else { "" };
    for (column, name) in table.header.iter().enumerate() {
        let _ = write!(text, "<th{}>{}</th>", class(column), escaped(name));
    }
    text += "</tr>\n";
    for (i, row) in rows.iter().enumerate() {
        // A line where the first word changes, in tables that have several words.
        let new = table.words > 1 && i > 0 && rows[i - 1][..table.words - 1] != row[..table.words - 1];
        text += if new { "<tr class=\"new\">" } else { "<tr>" };
        for (column, cell) in row.iter().enumerate() {
            let _ = write!(text, "<td{}>{}</td>", class(column), escaped(cell));
        }
        text += "</tr>\n";
    }
    text + "</table></div>\n"
}
