//! The main figures of several reports side by side, read back from their `scores.json`.

use serde::{Deserialize, Serialize};
use umbracast::{Error, Health, Mode};

use super::tables::{Table, mean, number};
use crate::run::pooled::Estimate;
use crate::run::scene_score::Predictor;

/// One mode in one group of scenes of one report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The report's.
    pub name: String,
    /// The preset or the file replayed.
    pub group: String,
    /// How many scenes.
    pub scenes: usize,
    /// Whose run.
    pub mode: Mode,
    /// Share of persons in frames who are tracked.
    pub recall: Estimate,
    /// CLEAR.
    pub mota: Estimate,
    /// F1 of identities.
    pub idf1: Estimate,
    /// A scene.
    pub switches: Estimate,
    /// Root mean square of the 2-D error, metres.
    pub position_m: Estimate,
    /// The same of the velocity, metres a second.
    pub velocity_mps: Estimate,
    /// Squared errors of position over the covariance that tracks claim: 2 if they are honest.
    pub position_nees: Estimate,
    /// The same of velocity.
    pub velocity_nees: Estimate,
    /// Mean displacement of the forecast at 900 ms, metres.
    pub displacement_m: Estimate,
    /// Shares of true positions within the 50 and the 90 % region of the forecast, means over its steps.
    pub in_regions: [Option<f64>; 2],
    /// F1 at 300 ms by access point.
    pub f1: Vec<(String, Estimate)>,
    /// The same over links in sight when it was said.
    pub onset_f1: Vec<(String, Estimate)>,
    /// F1 at 300 ms of devices that are bound to a track once.
    pub bound_f1: Vec<(String, Estimate)>,
    /// Expected calibration error of the window in which it is largest.
    pub worst_ece: Vec<(String, Estimate)>,
    /// F1 at 300 ms of who says "as now", the present being the truth's.
    pub persistence_f1: Vec<(String, Estimate)>,
    /// Scans of sensors that were not there.
    pub scans_missing: u64,
}

/// What is read of a `scores.json`.
#[derive(Deserialize)]
struct Scores {
    groups: Vec<Group>,
}

#[derive(Deserialize)]
struct Group {
    name: String,
    scenes: usize,
    links: Vec<Links>,
    modes: Vec<Stage1>,
}

#[derive(Deserialize)]
struct Links {
    mode: Option<Mode>,
    predictor: String,
    access_point: String,
    windows: Vec<Window>,
}

#[derive(Deserialize)]
struct Window {
    w: usize,
    f1: Estimate,
    onset_f1: Estimate,
    ece: Option<f64>,
}

#[derive(Deserialize)]
struct Stage1 {
    mode: Mode,
    recall: Estimate,
    mota: Estimate,
    idf1: Estimate,
    switches_per_scene: Estimate,
    position_rmse_m: Estimate,
    velocity_rmse_mps: Estimate,
    position_nees: Estimate,
    velocity_nees: Estimate,
    displacement_m: Vec<Estimate>,
    coverage: Vec<Option<[f64; 2]>>,
    health: Health,
}

/// The rows of one report, in its order of groups and modes.
///
/// # Errors
/// Something other than the scores of a report.
pub fn rows(name: &str, scores_json: &[u8]) -> Result<Vec<Row>, Error> {
    let scores: Scores = serde_json::from_slice(scores_json)
        .map_err(|e| Error::new(format!("expected the scores of a report, found: {e}")))?;
    let of_group =
        |group: &Group| -> Vec<Row> { group.modes.iter().map(|scores| row(name, group, scores)).collect() };
    Ok(scores.groups.iter().flat_map(of_group).collect())
}

fn row(name: &str, group: &Group, scores: &Stage1) -> Row {
    let by_access_point =
        |mode: Option<Mode>, predictor: Predictor, score: &dyn Fn(&[Window]) -> Estimate| {
            let own = |links: &&Links| links.mode == mode && links.predictor == predictor.name();
            let of = |links: &Links| (links.access_point.clone(), score(&links.windows));
            group.links.iter().filter(own).map(of).collect()
        };
    let at_300_ms = |mode: Option<Mode>, predictor: Predictor, score: fn(&Window) -> Estimate| {
        let of =
            |windows: &[Window]| windows.iter().find(|window| window.w == 3).map(score).unwrap_or_default();
        by_access_point(mode, predictor, &of)
    };
    let worst_ece = |windows: &[Window]| {
        let value = windows.iter().filter_map(|window| window.ece).reduce(f64::max);
        Estimate { value, ..Estimate::default() }
    };
    let mode = Some(scores.mode);
    Row {
        name: name.to_owned(),
        group: group.name.clone(),
        scenes: group.scenes,
        mode: scores.mode,
        recall: scores.recall,
        mota: scores.mota,
        idf1: scores.idf1,
        switches: scores.switches_per_scene,
        position_m: scores.position_rmse_m,
        velocity_mps: scores.velocity_rmse_mps,
        position_nees: scores.position_nees,
        velocity_nees: scores.velocity_nees,
        displacement_m: scores.displacement_m.last().copied().unwrap_or_default(),
        in_regions: [0, 1]
            .map(|i| mean(&scores.coverage.iter().map(|step| Some(step.as_ref()?[i])).collect::<Vec<_>>())),
        f1: at_300_ms(mode, Predictor::Run, |window| window.f1),
        onset_f1: at_300_ms(mode, Predictor::Run, |window| window.onset_f1),
        bound_f1: at_300_ms(mode, Predictor::BoundOnce, |window| window.f1),
        worst_ece: by_access_point(mode, Predictor::Run, &worst_ece),
        persistence_f1: at_300_ms(None, Predictor::PersistenceOfTruth, |window| window.f1),
        scans_missing: scores.health.sensors_missing,
    }
}

/// The values, one line a row, and below them the 95 % intervals of the rows that have them. A column for each access
/// point that any row has.
pub fn to_text(rows: &[Row]) -> String {
    let title = "Detection, tracking, displacement of the forecast, and F1 of blockage within 300 ms";
    let values = table(title, rows, |estimate, digits| number(estimate.value, digits));
    let several: Vec<Row> = rows.iter().filter(|row| row.recall.interval.is_some()).cloned().collect();
    let intervals = table("95 % intervals of the same", &several, |estimate, digits| {
        estimate.interval.map_or("-".to_owned(), |[low, high]| format!("{low:.digits$}..{high:.digits$}"))
    });
    match several.is_empty() {
        true => values.to_text(),
        false => values.to_text() + "\n" + &intervals.to_text(),
    }
}

fn table(title: &str, rows: &[Row], text: impl Fn(Estimate, usize) -> String) -> Table {
    let mut access_points: Vec<&str> = Vec::new();
    for (name, _) in rows.iter().flat_map(|row| &row.f1) {
        if !access_points.contains(&name.as_str()) {
            access_points.push(name);
        }
    }
    let header = [
        "report",
        "people",
        "mode",
        "scenes",
        "recall",
        "MOTA",
        "IDF1",
        "switches",
        "position, m",
        "velocity, m/s",
        "NEES",
        "of velocity",
        "900 ms, m",
        "in 50 %",
        "in 90 %",
    ];
    let mut table = Table::new(title, 3, &header);
    for score in ["F1", "onset", "worst ECE", "bound once", "persistence"] {
        table.header.extend(access_points.iter().map(|name| format!("{score} {name}")));
    }
    table.header.push("scans missing".to_owned());
    for row in rows {
        let mut cells = vec![row.name.clone(), row.group.clone(), row.mode.name().to_owned()];
        cells.push(row.scenes.to_string());
        cells.extend([row.recall, row.mota, row.idf1].map(|score| text(score, 3)));
        cells.push(text(row.switches, 2));
        cells.extend([row.position_m, row.velocity_mps].map(|score| text(score, 3)));
        cells.extend([row.position_nees, row.velocity_nees].map(|score| text(score, 2)));
        cells.push(text(row.displacement_m, 3));
        cells.extend(row.in_regions.map(|value| text(Estimate { value, ..Estimate::default() }, 2)));
        for scores in [&row.f1, &row.onset_f1, &row.worst_ece, &row.bound_f1, &row.persistence_f1] {
            let of = |name: &&str| scores.iter().find(|(own, _)| own == name).map(|(_, f1)| *f1);
            cells.extend(access_points.iter().map(|name| text(of(name).unwrap_or_default(), 3)));
        }
        cells.push(row.scans_missing.to_string());
        table.rows.push(cells);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::to_json;
    use crate::run::pooled::pool;
    use crate::run::scene_score::{ModeRun, score_scene};
    use crate::score::hand_made::{link_row, track_row, truth_of};
    use crate::score::scene::SceneRun;
    use umbracast::Config;

    #[test]
    fn the_scores_that_a_report_writes_are_read_back_into_a_line_a_mode() {
        let truth = truth_of(1, 40, |_, frame| frame >= 30);
        let mut run = SceneRun::default();
        for frame in 0..40 {
            run.tracks.push(track_row(frame, 0, 0.0, 0.0));
            run.links.push(link_row(frame, 0, frame >= 27));
        }
        let config = Config::for_mode(Mode::Default);
        let health = Health { sensors_missing: 12, ..Health::default() };
        let run = ModeRun { config: &config, rows: &run, health };
        let scene = score_scene(0, "orca-03", &truth, &[run], None, None).unwrap();
        let json = to_json(&pool(&[&scene], &["side".to_owned()]));
        let mut json: serde_json::Value = serde_json::from_str(&json).unwrap();
        json["groups"][0]["modes"][0]["coverage"] = serde_json::json!([[0.25, 0.75], [0.75, 1.0]]);
        let rows = rows("lost", json.to_string().as_bytes()).unwrap();
        assert_eq!((rows.len(), rows[0].scans_missing), (1, 12));
        assert_eq!((rows[0].f1[0].0.as_str(), rows[0].f1[0].1.value), ("side", Some(1.0)));
        // Blocked in frames 30 to 39 of 40: at 27 to 29 persistence knows nothing of it yet, at 30 it does.
        assert_eq!(rows[0].persistence_f1[0].1.value, Some(0.4));
        assert_eq!((rows[0].bound_f1[0].1.value, rows[0].position_nees.value), (Some(1.0), None));
        assert_eq!(rows[0].in_regions, [Some(0.5), Some(0.875)]);
        let text = to_text(&rows);
        assert!(!text.contains("intervals"), "of a single scene: {text}");
        let line = text.lines().last().unwrap();
        assert!(line.starts_with("lost    orca-03  default") && text.contains("F1 side"), "{text}");
        assert!(super::rows("lost", b"{}").unwrap_err().to_string().contains("groups"));
    }
}
