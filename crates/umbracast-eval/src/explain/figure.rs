//! One figure that shows the whole result without the text.

use umbracast::{Error, STEPS};

use crate::report::figure::{BLACK, BLUE, GREEN, GREY, LIGHT, ORANGE, PURPLE, axes, series};
use crate::report::plot::{Drawing, Mark, Panel, draw_grid};
use crate::report::published::{AT_300_MS, BASE_RATE_AT_300_MS, DISPLACEMENT_M};

/// Where a value comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The paper.
    Published,
    /// A run on simulated returns.
    Measured,
    /// An oracle.
    Known,
}

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Story {
    /// F1 at 300 ms, from below: the name, where it comes from, the value.
    pub rungs: Vec<(&'static str, Source, f64)>,
    /// Mean displacement by step of what stands beside Table I, metres.
    pub displacement_m: Vec<(String, [f64; STEPS])>,
    /// Precision and recall by window of the setting that comes nearest.
    pub curves: [[f64; 2]; STEPS],
    /// That setting in words.
    pub nearest: String,
    /// Share of blocked windows at 300 ms by the bodies' width, for each access point: its name, then (times our
    /// width, share).
    pub base_rates: Vec<(String, Vec<(f64, f64)>)>,
}

/// Draws it.
///
/// # Errors
/// The picture could not be coded.
pub fn draw(story: &Story) -> Result<Drawing, Error> {
    let panels = [rungs(story), displacement(story), curves(story), base_rates(story)];
    draw_grid("explain", &panels, 2, (600.0, 400.0))
}

fn rungs(story: &Story) -> Panel {
    let mut panel =
        axes("Where F1 is lost: links blocked within 300 ms", "F1", (0.4, story.rungs.len() as f64 + 0.6));
    (panel.x, panel.x_step, panel.y_step) = ((0.5, 1.05), Some(0.1), None);
    for (place, (name, source, f1)) in (1..).zip(&story.rungs) {
        let y = f64::from(place);
        panel.y_names.push((*name).to_owned());
        let color = match source {
            Source::Published => BLACK,
            Source::Measured => BLUE,
            Source::Known => LIGHT,
        };
        panel.series.push(series("", color, Mark::Line(14.0), vec![(0.5, y), (*f1, y)]));
        panel.notes.push((f1 + 0.03, y - 0.22, format!("{f1:.3}")));
    }
    panel
}

fn displacement(story: &Story) -> Panel {
    let mut panel = axes("Table I: how far forecasts are off, m", "ahead, ms", (0.0, 1.0));
    panel.x = (0.0, 1300.0);
    let by_step = |values: &[f64; STEPS]| (1..).map(|h| f64::from(h) * 100.0).zip(*values).collect();
    panel.series.push(series("", BLACK, Mark::Diamonds(4.5), by_step(&DISPLACEMENT_M)));
    for ((_, values), color) in story.displacement_m.iter().zip([ORANGE, GREY, PURPLE, BLUE]) {
        panel.series.push(series("", color, Mark::Line(2.0), by_step(values)));
    }
    let ends = story.displacement_m.iter().map(|(name, values)| (values[STEPS - 1], name.clone()));
    let ends = ends.chain([(DISPLACEMENT_M[STEPS - 1], "published".to_owned())]).collect();
    panel.notes = apart(ends, 0.06).into_iter().map(|(y, name)| (1100.0, y - 0.03, name)).collect();
    panel
}

fn curves(story: &Story) -> Panel {
    let mut panel =
        axes("The nearest setting found (lines), and the paper (diamonds)", "window, ms", (0.6, 1.0));
    panel.x = (0.0, 1300.0);
    for (i, (name, color)) in [("precision", ORANGE), ("recall", BLUE)].into_iter().enumerate() {
        let points = (1..).map(|w| f64::from(w) * 100.0).zip(story.curves.map(|both| both[i])).collect();
        panel.series.push(series("", color, Mark::Line(2.0), points));
        panel.series.push(series("", color, Mark::Diamonds(5.0), vec![(300.0, AT_300_MS[i + 1].1)]));
        panel.notes.push((1050.0, story.curves[STEPS - 1][i] - 0.01, name.to_owned()));
    }
    panel.notes.push((300.0, 0.72, "published: they cross here".to_owned()));
    panel.notes.push((650.0, 0.64, story.nearest.clone()));
    panel
}

fn base_rates(story: &Story) -> Panel {
    let mut panel = axes(
        "How often links are blocked (300 ms): wide bodies only",
        "width of the bodies, times that of people",
        (0.0, 0.45),
    );
    (panel.x, panel.x_step) = ((0.9, 2.4), Some(0.2));
    let band = [BASE_RATE_AT_300_MS - 0.02, BASE_RATE_AT_300_MS + 0.02];
    for y in band {
        panel.series.push(series("", BLACK, Mark::Dashed(1.2), vec![(0.9, y), (2.4, y)]));
    }
    panel.notes.push((1.12, BASE_RATE_AT_300_MS - 0.01, "published".to_owned()));
    for ((_, points), color) in story.base_rates.iter().zip([ORANGE, BLUE, GREEN, PURPLE]) {
        panel.series.push(series("", color, Mark::Line(2.0), points.clone()));
    }
    let ends = story.base_rates.iter().filter_map(|(name, points)| Some((points.last()?.1, name.clone())));
    panel.notes.extend(apart(ends.collect(), 0.03).into_iter().map(|(y, name)| (2.2, y - 0.01, name)));
    panel
}

/// Labels at these heights, moved up until none lies on another.
fn apart(mut labels: Vec<(f64, String)>, distance: f64) -> Vec<(f64, String)> {
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    for i in 1..labels.len() {
        labels[i].0 = labels[i].0.max(labels[i - 1].0 + distance);
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_label_has_a_place_of_its_own() {
        let label = |y: f64| (y, String::new());
        let placed = apart(vec![label(0.5), label(0.1), label(0.12)], 0.05);
        let heights: Vec<f64> = placed.iter().map(|(y, _)| (y * 1000.0).round()).collect();
        assert_eq!(heights, [100.0, 150.0, 500.0]);
    }

    #[test]
    fn the_same_story_gives_the_same_bytes_and_holds_its_words() {
        let story = Story {
            rungs: vec![("as published", Source::Published, 0.785), ("ceiling", Source::Known, 0.965)],
            displacement_m: vec![("standing still".into(), [0.5; STEPS])],
            curves: [[0.8, 0.7]; STEPS],
            nearest: "boxes of air".into(),
            base_rates: vec![("on the rim".into(), vec![(1.0, 0.2), (2.0, 0.3)])],
        };
        let drawings = [0, 1].map(|_| draw(&story).unwrap().svg);
        assert_eq!(drawings[0], drawings[1]);
        for words in ["as published", "standing still", "on the rim", "0.965", "boxes of air"] {
            assert!(drawings[0].contains(words), "{words}");
        }
    }
}
