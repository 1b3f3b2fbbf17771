//! The report: one HTML page that needs nothing else, every figure as SVG and PNG beside it, the scores as JSON.

pub mod published;
pub mod tables;
pub mod compare;
mod long_table;
mod ladder_table;
pub(crate) mod plot;
pub(crate) mod figures;
mod one_scene;
pub(crate) mod html;

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
    /// What a reader must know of how it was made, a paragraph each.
    pub notes: &'a [String],
    /// Why rungs of the ladder lie below the reference: (oracle, reason).
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

/// Writes into a directory, which is made where it is not there: `report.html`; its tables as text, `report.txt`;
/// every score as `scores.json` and `scores.csv`; and each figure as `NAME.svg` and `NAME.png`.
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
    let tables = tables(scores, context);
    let page = html::page(scores, context, &figures, &tables);
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

/// The short tables for a terminal: stage 3 of all scenes and by preset, then stages 1 and 2.
pub fn to_text(scores: &Scores) -> String {
    let Some(group) = scores.headline() else { return String::new() };
    let mut shown = vec![tables::headline(group)];
    shown.extend((scores.groups.len() > 1).then(|| tables::presets(scores)));
    shown.extend([tables::tracking(group), tables::displacement(group)]);
    shown.extend(tables::losses(group));
    shown.push(tables::figures_by_preset(scores));
    shown.iter().map(Table::to_text).collect::<Vec<_>>().join("\n")
}

/// The paper's experiment for a terminal: the boxes at 300 and 800 ms.
pub fn boxes_to_text(scores: &Scores) -> String {
    let Some(group) = scores.headline() else { return String::new() };
    let boxes = |access_point| tables::boxes(group, access_point, &[3, 8]);
    let shown: Vec<Table> = group.access_points().into_iter().map(boxes).collect();
    shown.iter().map(Table::to_text).collect::<Vec<_>>().join("\n")
}

/// Every table of the page.
fn tables(scores: &Scores, context: &Context) -> Vec<Table> {
    let Some(group) = scores.headline() else { return Vec::new() };
    let mut all = vec![tables::headline(group)];
    all.extend((scores.groups.len() > 1).then(|| tables::presets(scores)));
    let every_window: Vec<usize> = (1..=umbracast::STEPS).collect();
    all.extend(group.access_points().into_iter().map(|ap| tables::boxes(group, ap, &every_window)));
    all.extend([tables::tracking(group), tables::displacement(group), tables::figures_by_preset(scores)]);
    all.push(tables::times(group));
    for access_point in group.access_points() {
        all.push(tables::baselines(group, access_point));
        all.push(tables::budget(group, access_point));
    }
    let site = context.configs.first().map(|config| &config.site);
    all.extend(ladder_table::ladder(scores, site, context.explanations));
    all.push(tables::health(group));
    all
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    std::fs::write(path, bytes).map_err(|e| Error::new(format!("{}: cannot be written: {e}", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::{link_row, track_row, truth_of};
    use crate::pooled::pool;
    use crate::score::{ModeRun, score_scene};
    use umbracast::Health;

    /// Three people who stand still; the link of the first is blocked from frame 30 on and we say so in time.
    fn scene() -> (SceneTruth, SceneRun) {
        let truth = truth_of(3, 60, |person, frame| person == 0 && frame >= 30);
        let mut run = SceneRun::default();
        for frame in 0..60 {
            for person in 0..3_u32 {
                run.tracks.push(track_row(frame, u64::from(person), f64::from(person) * 10.0, 0.0));
                run.links.push(link_row(frame, u64::from(person), person == 0 && frame >= 21));
            }
        }
        (truth, run)
    }

    fn scores(config: &Config, groups: &[&str]) -> Scores {
        let (truth, run) = scene();
        let of = |group: &&str| {
            let run = ModeRun { config, rows: &run, health: Health::default() };
            score_scene(0, group, &truth, &[run], None, None).unwrap()
        };
        let mut scenes: Vec<_> = groups.iter().map(of).collect();
        // The same truth each time, taken for that of different recordings.
        (0..).zip(&mut scenes).for_each(|(recording, scene)| scene.recording = recording);
        pool(&scenes.iter().collect::<Vec<_>>(), &["side".to_owned()])
    }

    #[test]
    fn the_page_holds_everything_itself_and_the_same_scores_give_the_same_files() {
        let config = Config::for_mode(Mode::Default);
        let scores = scores(&config, &["orca-03"]);
        let (truth, run) = scene();
        let kept =
            Kept { label: "hand made", mode: Mode::Default, site: &config.site, truth: &truth, run: &run };
        let command = "umbracast evaluate --out <here>";
        let configs = [config.clone()];
        let context = Context { configs: &configs, command, kept: Some(kept), notes: &[], explanations: &[] };
        let written = [0, 1].map(|_| {
            let directory = tempfile::tempdir().unwrap();
            write(directory.path(), &scores, &context).unwrap();
            let names = ["report.html", "scores.json", "metrics.svg", "metrics.png", "plan.svg", "link.png"];
            names.map(|name| std::fs::read(directory.path().join(name)).unwrap())
        });
        assert!(written[0] == written[1], "same scores, other bytes");
        let page = String::from_utf8(written[0][0].clone()).unwrap();
        assert!(!page.contains("<script") && !page.contains("src=") && !page.contains("<link"));
        assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
        assert!(page.contains("umbracast evaluate --out &lt;here&gt;") && page.contains("acceleration_psd"));
        assert_eq!(&written[0][3][1..4], b"PNG");
    }

    #[test]
    fn the_text_shows_what_was_scored_beside_what_was_published() {
        let text = to_text(&scores(&Config::for_mode(Mode::Default), &["orca-03"; 5]));
        // Warned from frame 21 for a blockage at 30: right at w = 9, early before; nothing is missed.
        let row = text.lines().find(|line| line.contains("900 ms") && line.contains("default")).unwrap();
        assert!(row.contains("1.000 [1.000, 1.000]"), "{row}");
        assert!(text.contains("published") && text.contains("0.785"));
    }

    #[test]
    fn several_presets_get_a_row_each_and_a_pooled_one() {
        let scores = scores(&Config::for_mode(Mode::Default), &["orca-03", "orca-06", "orca-03"]);
        let named: Vec<_> = scores.groups.iter().map(|group| (group.name.as_str(), group.scenes)).collect();
        assert_eq!(named, [("orca-03", 2), ("orca-06", 1), ("all", 3)]);
        let text = to_text(&scores);
        let row = |name: &str| text.lines().any(|l| l.starts_with(name) && l.contains("position RMSE"));
        assert!(["orca-03 ", "orca-06 ", "all "].into_iter().all(row), "{text}");
        assert!(
            ["orca-03 ", "orca-06 ", "all "].iter().all(|name| text.lines().any(|l| l.starts_with(name)))
        );
    }
}
