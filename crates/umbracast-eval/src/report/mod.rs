//! The report: one HTML page that needs nothing else, every figure as SVG and PNG beside it, the scores as JSON.

pub mod published;
pub mod tables;
mod plot;
mod figures;
mod one_scene;
mod html;

use std::path::Path;

use umbracast::{Config, Error, Mode, Site};

use crate::pooled::Scores;
use crate::scene::{SceneRun, SceneTruth};
use tables::Table;

/// What a report is made of, beside the scores.
#[derive(Debug, Clone, Copy)]
pub struct Context<'a> {
    /// The configuration of each mode.
    pub configs: &'a [Config],
    /// The command line that makes the same report.
    pub command: &'a str,
    /// The scene that is shown by itself.
    pub kept: Option<Kept<'a>>,
    /// Why rungs of the ladder differ from the reference: (oracle, reason).
    pub explanations: &'a [(String, String)],
}

/// One scene of one mode, for the figures that show an instant and a link.
#[derive(Debug, Clone, Copy)]
pub struct Kept<'a> {
    /// Its name in captions: preset and seed.
    pub label: &'a str,
    /// Whose run it is.
    pub mode: Mode,
    /// Where it took place.
    pub site: &'a Site,
    /// What was so.
    pub truth: &'a SceneTruth,
    /// What we said.
    pub run: &'a SceneRun,
}

/// Writes `report.html`, `scores.json`, and each figure as `NAME.svg` and `NAME.png` into a directory, which is
/// made where it is not there.
///
/// # Errors
/// A file that cannot be written, or a figure that cannot be drawn.
pub fn write(directory: &Path, scores: &Scores, context: &Context) -> Result<(), Error> {
    std::fs::create_dir_all(directory)
        .map_err(|e| Error::new(format!("{}: cannot be made: {e}", directory.display())))?;
    let access_points = scores.headline().map(|group| group.access_points()).unwrap_or_default();
    let figures = figures::all(scores, context.kept.as_ref(), access_points.first().unwrap_or(&""))?;
    for figure in &figures {
        let standalone = figure.drawing.svg.as_bytes();
        write_file(&directory.join(format!("{}.svg", figure.name)), standalone)?;
        write_file(&directory.join(format!("{}.png", figure.name)), &figure.drawing.png)?;
    }
    let page = html::page(scores, context, &figures, &tables(scores, context));
    write_file(&directory.join("report.html"), page.as_bytes())?;
    write_file(&directory.join("scores.json"), to_json(scores).as_bytes())
}

/// The scores for machines.
pub fn to_json(scores: &Scores) -> String {
    serde_json::to_string(scores).expect("scores are plain data") + "\n"
}

/// The short tables for a terminal: stage 3 of all scenes and by preset, then stages 1 and 2.
pub fn to_text(scores: &Scores) -> String {
    let Some(group) = scores.headline() else { return String::new() };
    let mut shown = vec![tables::headline(group)];
    shown.extend((scores.groups.len() > 1).then(|| tables::presets(scores)));
    shown.extend([tables::tracking(group), tables::displacement(group)]);
    shown.iter().map(Table::to_text).collect::<Vec<_>>().join("\n")
}

/// Every table of the page.
fn tables(scores: &Scores, context: &Context) -> Vec<Table> {
    let Some(group) = scores.headline() else { return Vec::new() };
    let mut all = vec![tables::headline(group)];
    all.extend((scores.groups.len() > 1).then(|| tables::presets(scores)));
    all.extend([tables::tracking(group), tables::displacement(group)]);
    for access_point in group.access_points() {
        all.push(tables::baselines(group, access_point));
        all.push(tables::budget(group, access_point));
    }
    all.extend(tables::ladder(scores, context.explanations));
    all.push(tables::health(group));
    all
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    std::fs::write(path, bytes).map_err(|e| Error::new(format!("{}: cannot be written: {e}", path.display())))
}
