//! The report: one HTML page that needs nothing else, every figure as SVG and PNG beside it, the scores as JSON.

pub mod published;
pub mod tables;
mod causes;
mod verdict;
pub mod compare;
mod long_table;
mod ladder_table;
pub mod plot;
pub(crate) mod figure;
mod context;
mod floor;
mod one_scene;
mod figures;
pub(crate) mod markup;
mod animation_svg;
mod animation;
mod html;

use std::path::Path;

use umbracast::{Config, Error, Mode, Site};

use crate::run::pooled::{Group, Scores};
pub use context::{Context, Kept};
use tables::Table;
pub use verdict::verdict;

/// Writes into a directory, which is made where it is not there: `report.html`; its tables as text, `report.txt`;
/// every score as `scores.json` and `scores.csv`; each figure as `NAME.svg` and `NAME.png`; and some seconds of the
/// scene that was kept as `animation.svg`.
///
/// # Errors
/// A file that cannot be written, or a figure that cannot be drawn.
pub fn write(directory: &Path, scores: &Scores, context: &Context) -> Result<(), Error> {
    std::fs::create_dir_all(directory)
        .map_err(|e| Error::new(format!("{}: cannot be made: {e}", directory.display())))?;
    let access_points = scores.headline().map(|group| group.access_points()).unwrap_or_default();
    let published = beside_the_paper(scores, context.site());
    let first = access_points.first().unwrap_or(&"");
    let figures = figures::all(scores, context.kept.as_ref(), first, published)?;
    for figure in &figures {
        let standalone = figure.drawing.svg.as_bytes();
        write_file(&directory.join(format!("{}.svg", figure.name)), standalone)?;
        write_file(&directory.join(format!("{}.png", figure.name)), &figure.drawing.png)?;
    }
    let animation = context.kept.as_ref().and_then(animation::svg);
    if let Some(svg) = &animation {
        write_file(&directory.join("animation.svg"), svg.as_bytes())?;
    }
    let tables = tables(scores, published);
    let drawn = html::Drawn { animation: animation.as_deref(), figures: &figures, tables: &tables };
    let page = html::page(scores, context, &drawn, published);
    write_file(&directory.join("report.html"), page.as_bytes())?;
    let notes = context.notes.iter().map(|note| note.clone() + "\n");
    let text = notes.chain(tables.iter().map(Table::to_text)).collect::<Vec<_>>().join("\n");
    write_file(&directory.join("report.txt"), text.as_bytes())?;
    write_file(&directory.join("scores.csv"), long_table::to_csv(scores).as_bytes())?;
    write_file(&directory.join("scores.json"), to_json(scores).as_bytes())
}

/// The scores for machines.
pub fn to_json(scores: &Scores) -> String {
    serde_json::to_string(scores).expect("scores are plain data") + "\n"
}

/// Whether what the paper prints stands beside: in the hall that stands for the paper's, where its method was run as
/// well, or where there are scenes enough to speak of. Beside somebody's own hall, or a scene by itself, its figures
/// would compare nothing.
pub fn beside_the_paper(scores: &Scores, site: Option<&Site>) -> bool {
    let same_hall = site.is_some_and(|site| *site == Config::default().site);
    let of_use = |group: &Group| group.scenes > 1 || group.modes.iter().any(|m| m.mode != Mode::Default);
    same_hall && scores.headline().is_some_and(of_use)
}

/// The short tables for a terminal, of scenes at `site`: stage 3 of all scenes and by preset, then stages 1 and 2.
pub fn to_text(scores: &Scores, site: &Site) -> String {
    let Some(group) = scores.headline() else { return String::new() };
    let published = beside_the_paper(scores, Some(site));
    let mut shown = vec![tables::headline(group, published)];
    shown.extend((scores.groups.len() > 1).then(|| tables::presets(scores)));
    shown.extend([tables::tracking(group), tables::displacement(group, published)]);
    shown.extend(tables::losses(group));
    shown.push(causes::causes(group));
    shown.push(tables::figures_by_preset(scores, published));
    shown.retain(|table| !table.rows.is_empty());
    shown.iter().map(Table::to_text).collect::<Vec<_>>().join("\n")
}

/// The paper's experiment for a terminal: the boxes at 300 and 800 ms.
pub fn boxes_to_text(scores: &Scores, site: &Site) -> String {
    let Some(group) = scores.headline() else { return String::new() };
    let published = beside_the_paper(scores, Some(site));
    let boxes = |access_point| tables::boxes(group, access_point, &[3, 8], published);
    let shown: Vec<Table> = group.access_points().into_iter().map(boxes).collect();
    shown.iter().map(Table::to_text).collect::<Vec<_>>().join("\n")
}

/// Every table of the page that has rows.
fn tables(scores: &Scores, published: bool) -> Vec<Table> {
    let Some(group) = scores.headline() else { return Vec::new() };
    let mut all = vec![tables::headline(group, published)];
    all.extend((scores.groups.len() > 1).then(|| tables::presets(scores)));
    all.extend([tables::tracking(group), tables::displacement(group, published)]);
    all.push(tables::figures_by_preset(scores, published));
    all.push(causes::causes(group));
    all.push(tables::times(group));
    for access_point in group.access_points() {
        all.push(tables::baselines(group, access_point));
        all.push(tables::budget(group, access_point));
    }
    let every_window: Vec<usize> = (1..=umbracast::STEPS).collect();
    let boxes = |access_point| tables::boxes(group, access_point, &every_window, published);
    all.extend(group.access_points().into_iter().map(boxes));
    all.extend(ladder_table::ladder(scores));
    all.push(tables::health(group));
    all.retain(|table| !table.rows.is_empty());
    all
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    std::fs::write(path, bytes).map_err(|e| Error::new(format!("{}: cannot be written: {e}", path.display())))
}

#[cfg(test)]
mod tests;
