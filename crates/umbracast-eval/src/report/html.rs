//! The page: text, tables and figures in one file, no script, readable on a phone and on paper.

use std::fmt::Write as _;

use super::figures::Figure;
use super::tables::Table;
use super::{Context, published};
use crate::pooled::{Group, Scores};
use crate::score::Predictor;

const STYLE: &str = "
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { font: 16px/1.55 system-ui, sans-serif; color: #222; background: #fff; margin: 0 auto; padding: 1.5rem 1rem 4rem;
  max-width: 74rem; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0.5rem 0; }
h2 { font-size: 1.25rem; margin: 2.8rem 0 0.4rem; }
p { max-width: 44rem; }
.lead { font-size: 1.1rem; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(11rem, 1fr)); gap: 0.8rem; margin: 1.2rem 0; }
.card { border: 1px solid #ddd; border-radius: 8px; padding: 0.7rem 0.9rem; }
.card b { display: block; font-size: 1.6rem; font-weight: 600; line-height: 1.3; }
.card span { color: #555; font-size: 0.85rem; display: block; }
figure { margin: 0.8rem 0 0; }
figure svg { display: block; min-width: 34rem; }
figcaption, .note { color: #555; font-size: 0.9rem; max-width: 44rem; margin: 0.3rem 0 0; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.8rem; font-variant-numeric: tabular-nums; white-space: nowrap; }
th, td { padding: 0.25rem 0.4rem; text-align: right; border-bottom: 1px solid #e6e6e6; }
th { border-bottom: 2px solid #999; font-weight: 600; }
.w { text-align: left; }
tr.new td { border-top: 2px solid #bbb; }
pre { background: #f6f6f6; border-radius: 6px; padding: 0.8rem; overflow-x: auto; font-size: 0.8rem; line-height: 1.4; }
summary { cursor: pointer; margin: 0.4rem 0; }
nav a { margin-right: 1rem; white-space: nowrap; }
@media print { body { max-width: none; } h2, figure, tr { break-inside: avoid; } }
";

const MODES: &str = "<p>Three modes stand side by side. <b>hdl</b>: stage 1 (detect, track) as the code that the paper's
authors adapted ships it, with the paper's forecast and cast. <b>paper</b>: the method as its authors describe it.
<b>default</b>: the best of this software. A window counts as blocked when the link is cut at any step of it; F1 is the
harmonic mean of precision and recall, and onset F1 the same over links that are in sight when the prediction is made,
where saying &quot;as now&quot; earns nothing.</p>
";

/// The whole page.
pub fn page(scores: &Scores, context: &Context, figures: &[Figure], tables: &[Table]) -> String {
    let mut page = String::from("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    // Writing to a String cannot fail.
    let _ = write!(
        page,
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Umbracast: report</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <h1>Which links will people block?</h1>\n"
    );
    if let Some(group) = scores.headline() {
        page += &opening(group);
    }
    for note in context.notes {
        let _ = writeln!(page, "<p>{}</p>", escaped(note));
    }
    page += "<nav><a href=\"#figures\">Figures</a><a href=\"#tables\">Tables</a>\
             <a href=\"#again\">Run it again</a></nav>\n<section id=\"figures\">\n";
    figures.iter().for_each(|figure| page += &drawn(figure));
    page += "</section>\n<section id=\"tables\">\n";
    tables.iter().for_each(|table| page += &tabulated(table));
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
fn opening(group: &Group) -> String {
    let Some(mode) = group.modes.last() else { return String::new() };
    let access_points = group.access_points();
    let first = access_points.first().copied().unwrap_or_default();
    let scenes = if group.scenes == 1 { "one scene".to_owned() } else { format!("{} scenes", group.scenes) };
    let mut text = format!(
        "<p class=\"lead\">LiDARs see people walk, each walker's way is foreseen for 0.9 s, and a ray from every \
         access point to every person tells which radio links a body is about to block. This report holds \
         {scenes} ({} frames) against the truth. First figures: mode {} at access point {}.</p>\n\
         <div class=\"cards\">\n",
        group.frames,
        mode.mode.name(),
        escaped(first)
    );
    let mut card = |value: Option<f64>, digits: usize, unit: &str, what: &str| {
        let value = value.map_or("-".to_owned(), |value| format!("{value:.digits$}{unit}"));
        let _ = writeln!(text, "<div class=\"card\"><b>{value}</b><span>{what}</span></div>");
    };
    if let Some(links) = group.link(Some(mode.mode), Predictor::Run, first) {
        let at = &links.windows[2];
        card(at.f1.value, 3, "", &format!("F1 at 300 ms; published {:.3}", published::F1_AT_300_MS));
        card(at.onset_f1.value, 3, "", "onset F1: links in sight now");
        card(
            at.base_rate.value,
            2,
            "",
            &format!("of windows are blocked; published {:.2}", published::BASE_RATE_AT_300_MS),
        );
    }
    let ahead = mode.displacement_m.last().and_then(|step| step.value);
    let published = published::DISPLACEMENT_M[published::DISPLACEMENT_M.len() - 1];
    card(ahead, 2, " m", &format!("off after 900 ms; published {published:.2} m"));
    card(mode.tracked_share.value.map(|share| share * 100.0), 1, " %", "of people are followed");
    text + "</div>\n" + MODES
}

fn drawn(figure: &Figure) -> String {
    let (title, caption, name) = (escaped(&figure.title), escaped(&figure.caption), figure.name);
    let svg = figure.drawing.svg.replacen("<svg ", &format!("<svg aria-label=\"{title}\" "), 1);
    format!(
        "<h2 id=\"{name}\">{title}</h2>\n<figure>\n{svg}\n<figcaption>{caption}</figcaption>\n</figure>\n"
    )
}

fn tabulated(table: &Table) -> String {
    let mut text = format!("<h2>{}</h2>\n<div class=\"wide\"><table>\n<tr>", escaped(&table.title));
    let class = |column: usize| if column < table.words { " class=\"w\"" } else { "" };
    for (column, name) in table.header.iter().enumerate() {
        let _ = write!(text, "<th{}>{}</th>", class(column), escaped(name));
    }
    text += "</tr>\n";
    for (i, row) in table.rows.iter().enumerate() {
        // A line where the first word changes, in tables that have several words.
        let new = table.words > 1 && i > 0 && table.rows[i - 1][..table.words - 1] != row[..table.words - 1];
        text += if new { "<tr class=\"new\">" } else { "<tr>" };
        for (column, cell) in row.iter().enumerate() {
            let _ = write!(text, "<td{}>{}</td>", class(column), escaped(cell));
        }
        text += "</tr>\n";
    }
    text += "</table></div>\n";
    if !table.note.is_empty() {
        let _ = writeln!(text, "<p class=\"note\">{}</p>", escaped(&table.note));
    }
    text
}

pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
